"""A program that is dropped on the page: what is taken, what is asked, which job the answers make."""

import base64
import tomllib

import pytest

from chipload.errors import InputError
from chipload.jobs import load_job
from chipload.jobs.drafts.make import draft_of
from chipload.web.dropped import LARGEST, Upload, draft_with_answers, program_name, read_dropped, write_answers

#: no tool size, no stock, no machine, no material: the draft guesses them
PROGRAM = "G90\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z-2 F480\nX40\nY40\nX0\nY0\nG0 Z5\nM2\n"


@pytest.fixture(scope="module")
def dropped():
    return read_dropped("square.nc", PROGRAM.encode())


def part(data: bytes, number: int = 0, count: int = 1, name: str = "a.nc", size: int | None = None) -> dict:
    """A part as the browser sends it."""
    text = base64.b64encode(data).decode()
    return {"name": name, "size": len(data) if size is None else size, "part": number, "of": count, "data": text}


def test_parts_make_the_file_again_and_what_is_no_program_is_refused() -> None:
    upload = Upload()
    assert upload.take(part(b"G0 X1\n", 0, 2, size=12)) is None
    assert upload.take(part(b"G0 X2\n", 1, 2, size=12)) == ("a.nc", b"G0 X1\nG0 X2\n")
    for wrong, message in (
        (part(b"x", 1, 2), "did not arrive whole"),
        (part(b"x", 0, 1, size=2), "did not arrive whole"),
        ({**part(b"x"), "data": "?"}, "did not arrive whole"),
        ({"name": "a.nc"}, "did not arrive whole"),
        ({**part(b"", count=0), "size": LARGEST + 1}, f"at most {LARGEST}"),
        (part(b"x" * (LARGEST + 1), 0, 1, size=1), f"at most {LARGEST}"),
        (part(b"x", name="part.step"), "not the ending of a program"),
        (part(b"x", name="run.py"), "not the ending of a program"),
    ):
        with pytest.raises(InputError, match=message):
            Upload().take(wrong)
    assert program_name("C:\\cam\\..\\O 1.NC") == "O_1.NC"
    assert "/" not in program_name("../../etc/a;b.nc")


def test_the_questions_are_those_of_init(dropped, tmp_path) -> None:
    (tmp_path / "square.nc").write_text(PROGRAM)
    other = draft_of(tmp_path / "square.nc", tmp_path)
    assert tuple(q.text for q in dropped.questions) == other.questions
    assert 1 <= len(dropped.questions) <= 5
    keys = {one.path: one for q in dropped.questions for one in q.keys}
    assert "vmc" in keys["machine.name"].choices
    assert "al7075-t6" in keys["material.name"].choices
    assert keys["cutter.0.diameter_mm"].field.unit == "mm"


def test_answers_are_facts_of_the_job_and_the_rest_stays_a_guess(dropped, tmp_path) -> None:
    by_path = {one.path: (one.table, one.key) for q in dropped.questions for one in q.keys}
    answers = {
        by_path["machine.name"]: "vmc",
        by_path["stock.low_mm"]: "-5, -5, -10",
        by_path["stock.high_mm"]: "[45 45 0]",
        by_path["cutter.0.diameter_mm"]: "8",
    }
    job = write_answers(dropped, answers, tmp_path / "square-job")
    assert (tmp_path / "square-job" / "square.nc").read_bytes() == PROGRAM.encode()
    raw = tomllib.loads(job.read_text())
    assert raw["stock"]["low_mm"] == [-5.0, -5.0, -10.0]
    assert raw["stock"]["high_mm"] == [45.0, 45.0, 0.0]
    assert raw["cutter"][0]["diameter_mm"] == 8.0
    assert raw["machine"] == {"name": "vmc"}
    assert "confirm" not in raw["stock"]
    guesses = load_job(job).guesses
    assert not [g for g in guesses if g.startswith(("stock.", "machine."))]
    assert [g for g in guesses if g.startswith("material.name")]
    # what stays is what init guessed less the answers
    assert len(dropped.draft.guesses) - len(draft_with_answers(dropped, answers).guesses) == len(answers)
    for path, text, message in (
        ("stock.low_mm", "1, 2", "must be 3 numbers"),
        ("cutter.0.diameter_mm", "wide", "must be a number"),
        ("cutter.0.diameter_mm", "-8", "diameter_mm"),
    ):
        with pytest.raises(InputError, match=message):
            write_answers(dropped, {by_path[path]: text}, tmp_path / "wrong")
    with pytest.raises(InputError, match="already exists"):
        write_answers(dropped, answers, tmp_path / "square-job")
    assert not (tmp_path / "wrong").exists()


def test_what_cannot_be_read_is_refused_as_by_init() -> None:
    with pytest.raises(InputError):
        read_dropped("a.nc", bytes(range(256)))
