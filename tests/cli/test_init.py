"""`chipload init` and `simulate`: what a file states is in the job; the rest is a guess that must be confirmed."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from chipload.jobs import check_job, load_job
from chipload.jobs.confirm import guesses_of, take_confirm
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry, write_draft
from command import call
from fusion_text import FUSION


def test_what_a_program_states_and_what_is_guessed(program: Path, tmp_path: Path) -> None:
    code, said, _ = call("init", program, tmp_path / "job")
    assert code == 0
    job = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert job["program"] == {"file": "../slot.nc"}
    (cutter,) = job["cutter"]
    assert (cutter["number"], cutter["diameter_mm"], cutter["confirm"]) == (3, 8.0, True)
    assert job["material"]["name"] == "steel-1045-from-group-2"
    # the centre path goes from (-10, 5, -2) to (30, 15, -2); program zero is the top; 1 mm around it
    assert job["stock"]["low_mm"] == [-11.0, 4.0, -3.0]
    assert job["stock"]["high_mm"] == [31.0, 16.0, 0.0]
    # the spindle of the machine bounds torque and power
    assert (job["limits"]["torque_nm"], job["limits"]["power_w"]) == (70.0, 11000.0)
    written = (tmp_path / "job" / "job.toml").read_text()
    assert "flutes = 3                       # guess: no file states them; a common number" in written
    # the greatest effects first, at most five; what is stated is no guess
    asked = [line.split("?")[0] for line in said.splitlines() if line.startswith("question: ")]
    assert asked == [
        "question: [stock]: which block is it cut from",
        "question: [machine]: which machine runs it",
        "question: [material]: which material is it",
        "question: [[cutter]]: flutes, helix_deg, flute_length_mm, overhang_mm, modulus_gpa of T3",
    ]


def test_a_draft_is_refused_until_confirmed(program: Path, tmp_path: Path) -> None:
    call("init", program, tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    code, _, said = call("run", job, "--out", tmp_path / "out")
    assert code == 2
    lines = said.splitlines()
    text = job.read_text().splitlines()
    number = next(k for k, line in enumerate(text, 1) if line.startswith("flutes"))
    assert f"chipload: cutter.0.flutes = 3: no file states them; a common number (line {number})" in lines
    assert len(lines) == job.read_text().count("# guess: ") + 1
    assert lines[-1].startswith(f"chipload: {len(lines) - 1} guesses are not confirmed")
    assert not (tmp_path / "out").exists()
    # a table without `confirm` is confirmed
    job.write_text(job.read_text().replace("confirm = true\n", ""))
    assert load_job(job).guesses == ()


def test_an_option_is_a_guess_no_more(program: Path, tmp_path: Path) -> None:
    call("init", program, tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    before, after = load_job(job).guesses, load_job(job, ["cutter.0.flutes=4"]).guesses
    assert [g for g in before if g not in after] == [next(g for g in before if g.startswith("cutter.0.flutes"))]


def test_accepted_guesses_of_a_program_leave_it_unproven(program: Path, tmp_path: Path) -> None:
    call("init", program, tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    code, said, _ = call("run", job, "--accept", "--out", tmp_path / "out", "--set", "operation.0.step_mm=4")
    assert code == 3
    summary = json.loads((tmp_path / "out" / "summary.json").read_bytes())
    guesses = [f for f in summary["findings"] if f["code"] == "job-guess"]
    assert len(guesses) == len(load_job(job).guesses) > 5
    assert {f["severity"] for f in guesses} == {"unproven"}
    assert {c["state"] for c in summary["limits"]} == {"unproven"}
    lines, holds = check_job(load_job(job))
    assert not holds
    assert lines[0].startswith("guess: machine.name = ")
    assert "report:" in said
    assert said.startswith("Unproven: ")
    # confirmed, the same values are those of the user
    (tmp_path / "job" / "own.toml").write_text(job.read_text().replace("confirm = true", ""))
    code, said, _ = call(
        "run", tmp_path / "job" / "own.toml", "--out", tmp_path / "own", "--set", "operation.0.step_mm=4"
    )
    summary = json.loads((tmp_path / "own" / "summary.json").read_bytes())
    assert "holds" in {c["state"] for c in summary["limits"]}


def test_a_first_look_is_never_better_than_unproven(program: Path, tmp_path: Path) -> None:
    code, said, _ = call("simulate", program, "--set", "operation.0.step_mm=4", "--out", tmp_path / "out")
    assert code == 3
    lines = said.splitlines()
    assert lines[1].startswith("question: [stock]: which block is it cut from? ")
    assert json.loads((tmp_path / "out" / "summary.json").read_bytes())["verdict"] == "unproven"
    # the same job with its guesses accepted is no worse than that, and writes nothing beside the program
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out", "slot.nc"]


def test_a_job_is_not_overwritten(program: Path, tmp_path: Path) -> None:
    call("init", program, tmp_path / "job")
    before = (tmp_path / "job" / "job.toml").read_bytes()
    code, _, said = call("init", program, tmp_path / "job")
    assert code == 2
    assert said.startswith(f"chipload: {tmp_path / 'job' / 'job.toml'}: already exists: name another folder")
    assert (tmp_path / "job" / "job.toml").read_bytes() == before


def test_a_draft_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from chipload.jobs.drafts import draft as module

    write = module.write_whole

    def fails(path: Path, data: bytes) -> None:
        if path.name == "job.toml":
            raise OSError(28, "No space left on device")
        write(path, data)

    monkeypatch.setattr(module, "write_whole", fails)
    made = Draft("a job", (DraftTable("machine", (Entry("name", "vmc"),)),), files={"program.ngc": b"M2\n"})
    (tmp_path / "old").mkdir()
    for folder in ("new", "old"):
        with pytest.raises(Exception, match="cannot be written"):
            write_draft(made, tmp_path / folder)
    assert not (tmp_path / "new").exists()
    assert list((tmp_path / "old").iterdir()) == []


def test_confirm_must_be_true_or_false() -> None:
    raw = {"cutter": [{"number": 1, "confirm": True}], "machine": {"confirm": False, "name": "vmc"}}
    assert take_confirm(raw) == ("cutter.0",)
    assert raw == {"cutter": [{"number": 1}], "machine": {"name": "vmc"}}
    with pytest.raises(Exception, match=r"machine.confirm = 'yes': must be true or false"):
        take_confirm({"machine": {"confirm": "yes"}})
    # a table without marked guesses is named itself
    assert guesses_of(["machine"], '[machine]\nconfirm = true\nname = "vmc"\n') == (
        "machine: confirm = true: the table is not confirmed",
    )


def test_a_program_that_never_starts_the_spindle(program: Path, tmp_path: Path) -> None:
    """150 m/min with 8 mm is 5968 rpm, in two digits 6000; the loads are those of the same text with S6000 M3."""
    silent = FUSION.replace("S4000 M3\n", "")
    program.write_text(silent)
    code, said, _ = call("init", program, tmp_path / "job")
    assert code == 0
    assert "program.speed_rpm = 6000.0: the text cuts with the spindle at rest; 150 m/min" in said
    assert "machine-spindle-off" not in said
    job = (tmp_path / "job" / "job.toml").read_text()
    assert tomllib.loads(job)["program"]["speed_rpm"] == 6000.0
    worst = []
    for name, text, keys in (("guessed", silent, job), ("stated", FUSION.replace("S4000", "S6000"), "")):
        program.write_text(text)
        (tmp_path / "job" / "job.toml").write_text(keys or job.replace("speed_rpm = 6000.0", "# "))
        code, _, said = call("run", tmp_path / "job" / "job.toml", "--accept", "--out", tmp_path / name)
        assert code == 3, said
        summary = json.loads((tmp_path / name / "summary.json").read_text())
        worst.append({c["name"]: c["worst"] for c in summary["limits"]})
        assert not [f for t in summary["tracks"] for f in t["findings"] if f["code"] == "machine-spindle-off"]
    assert worst[0] == worst[1]
    assert worst[0]["spindle_power_w"] > 0.0


def test_a_speed_that_the_tool_change_stops_is_the_one_that_is_guessed(program: Path, tmp_path: Path) -> None:
    """M6 stops the spindle that M3 S10000 started: its speed is known. One above the spindle's is its greatest."""
    program.write_text(FUSION.replace("T3 M6\nS4000 M3", "(S9 of old) M3 S10000\nT3 M6"))
    code, said, _ = call("init", program, tmp_path / "job")
    assert code == 0
    assert "program.speed_rpm = 10000.0: the text cuts with the spindle at rest; S10000 of the text" in said
    program.write_text(FUSION.replace("T3 M6\nS4000 M3", "M3 S24000\nT3 M6"))
    _, said, _ = call("init", program, tmp_path / "fast")
    assert "speed_rpm = 15000.0: the text cuts with the spindle at rest; S24000 of the text, as far as" in said


def test_a_draft_is_looked_at(program: Path, tmp_path: Path) -> None:
    """The same verdict and the same worst values as of the file itself; a machine is stated in the job."""
    assert call("init", program, tmp_path / "job")[0] == 0
    job = tmp_path / "job" / "job.toml"
    code, said, _ = call("simulate", program, "--set", "operation.0.step_mm=20")
    again, same, _ = call("simulate", job, "--set", "operation.0.step_mm=20")
    worst = [[line for line in text.splitlines() if line.startswith("worst values")] for text in (said, same)]
    assert (again, worst[1]) == (code, worst[0])
    assert same.splitlines()[-1] == "unproven: a first result"
    code, _, said = call("simulate", job, "--machine", "vmc")
    assert (code, said) == (2, "chipload: --machine: job.toml is a job: state it there, or with --set\n")
