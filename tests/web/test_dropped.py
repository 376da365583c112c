"""A program that is dropped on the page: what is taken, what is asked, which job the answers make."""

import base64
import tomllib
from pathlib import Path

import pytest
import trimesh

import chipload.examples
from chipload.errors import InputError
from chipload.jobs import load_job
from chipload.jobs.drafts.make import draft_of
from chipload.web.dropped import (
    LARGEST,
    LARGEST_MODEL,
    Upload,
    draft_with_answers,
    file_name,
    read_dropped,
    write_answers,
)

EXAMPLES = Path(chipload.examples.__file__).parent
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
        ({**part(b"", count=0, name="part.step"), "size": LARGEST_MODEL + 1}, f"models of at most {LARGEST_MODEL}"),
        (part(b"x", name="run.py"), "not the ending of a program"),
        (part(b"x", name="part.ply"), "not the ending of a program"),
    ):
        with pytest.raises(InputError, match=message):
            Upload().take(wrong)
    assert file_name("C:\\cam\\..\\O 1.NC") == "O_1.NC"
    assert "/" not in file_name("../../etc/a;b.nc")


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


def test_drawings_and_models_are_larger_than_programs() -> None:
    upload, data = Upload(), b"0" * (LARGEST + 1)
    assert upload.take(part(data[:LARGEST], 0, 2, "a.dxf", len(data))) is None
    assert upload.take(part(data[LARGEST:], 1, 2, "a.dxf", len(data))) == ("a.dxf", data)


def test_a_drawing_becomes_the_job_that_init_drafts(tmp_path) -> None:
    drawing = (EXAMPLES / "pocket" / "housing.dxf").read_bytes()
    dropped = read_dropped("housing.dxf", drawing)
    (tmp_path / "housing.dxf").write_bytes(drawing)
    other = draft_of(tmp_path / "housing.dxf", tmp_path)
    assert tuple(q.text for q in dropped.questions) == other.questions
    assert dropped.folder == "housing-job"
    by_path = {one.path: (one.table, one.key) for q in dropped.questions for one in q.keys}
    job = write_answers(dropped, {by_path["cutter.0.diameter_mm"]: "6"}, tmp_path / "housing-job")
    assert (tmp_path / "housing-job" / "housing.dxf").read_bytes() == drawing
    raw = tomllib.loads(job.read_text())
    assert raw["part"]["file"] == "housing.dxf"
    assert raw["cutter"][0]["diameter_mm"] == 6.0
    assert load_job(job).guesses


def test_a_mesh_becomes_the_job_of_its_pocket(tmp_path) -> None:
    block = trimesh.creation.box(bounds=[[0.0, 0.0, 0.0], [60.0, 40.0, 15.0]])
    hollow = trimesh.creation.box(bounds=[[10.0, 10.0, 5.0], [50.0, 30.0, 16.0]])
    mesh = trimesh.boolean.difference([block, hollow], engine="manifold").export(file_type="stl")
    dropped = read_dropped("block.stl", mesh)
    assert dropped.draft.notes == ("1 pocket: 1 with the floor at z = 5 mm, 10 mm deep, with sharp corners",)
    job = write_answers(dropped, {}, tmp_path / "block-job")
    # the outline that was drafted lies beside the mesh
    assert {path.name for path in job.parent.iterdir()} == {"job.toml", "block.stl", "block-floor.dxf"}
    assert load_job(job).guesses


def write_frame(path: Path) -> None:
    """A box of 40 x 30 x 12 mm with one pocket, whose walls are 1.5 mm thick."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    hollow = BRepPrimAPI_MakeBox(gp_Pnt(1.5, 1.5, 2.0), gp_Pnt(38.5, 28.5, 13.0)).Shape()
    writer = STEPControl_Writer()
    writer.Transfer(BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(40.0, 30.0, 12.0).Shape(), hollow).Shape(), STEPControl_AsIs)
    writer.Write(str(path))


def test_a_model_with_thin_walls_says_that_it_needs_more_jobs(tmp_path) -> None:
    write_frame(tmp_path / "frame.step")
    dropped = read_dropped("frame.step", (tmp_path / "frame.step").read_bytes())
    assert dropped.draft.notes[0] == (
        "thin walls: chipload init frame.step DIR writes 4 jobs that check them too; this is the first"
    )
    job = write_answers(dropped, {}, tmp_path / "frame-job")
    assert tomllib.loads(job.read_text())["part"]["file"] == "frame.step"


def test_what_cannot_be_read_is_refused_as_by_init() -> None:
    with pytest.raises(InputError):
        read_dropped("a.nc", bytes(range(256)))
    for name in ("a.dxf", "a.step", "a.stl"):
        with pytest.raises(InputError) as wrong:
            read_dropped(name, bytes(range(256)))
        # where it was read is not said
        assert f"{name}: " in str(wrong.value)
        assert "/" not in str(wrong.value)
