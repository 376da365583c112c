"""A contour whose finish path comes from an NC program: the plan of its drawing, and a text that reads back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.contour import Region
from chipload.jobs import load_job
from chipload.jobs.contour.programs import program_files
from chipload.jobs.contour.result import result_of
from chipload.jobs.contour.run import check, run
from chipload.machine.machine import machine_named
from chipload.program.program import RAPID
from chipload.program.read import read_program
from chipload.result import Verdict
from chipload.simulation.centre_path import CentrePath, rim_engagement
from finish_job import JOB

#: a wall with an inside corner of 8 mm, finished by a cutter of 10 mm; a hole is drilled before, a chamfer cut after it
PROGRAM = """(finish pass of another CAM)
G21 G17 G90 G40 G49 G80 G55
T7 M6
S2000 M3
G0 X10. Y20. Z10.
G1 Z-3. F100.
G0 Z10.
T1 M6
S3000 M3
G0 X-7. Y12. Z10.
Z2.
G1 Z-5. F300.
G3 X0. Y5. I7. F600.
G1 X20.
G3 X23. Y8. J3.
G1 Y28.
G1 X20. Y30.
G0 Z10.
G1 X0. Y0. F900.
M5
M2
"""
WALL = (14, 16)
#: the same path as conversational program and as CL data: text, lines of the wall, line that ends at a safe height
CONVERSATIONAL = """0 BEGIN PGM FINISH MM
1 TOOL CALL 7 Z S2000
2 L X+10 Y+20 Z+10 R0 FMAX M3
3 L Z-3 F100
4 L Z+10 FMAX
5 TOOL CALL 1 Z S3000
6 L X-7 Y+12 Z+10 R0 FMAX M3
7 L Z+2 FMAX
8 L Z-5 F300
9 CC X+0 Y+12
10 C X+0 Y+5 DR+ F600
11 L X+20
12 CC X+20 Y+8
13 C X+23 Y+8 DR+
14 L Y+28
15 L X+20 Y+30
16 L Z+10 FMAX
17 L X+0 Y+0 F900
18 L M5
19 END PGM FINISH MM
"""
CL_DATA = """PARTNO/FINISH
UNITS/MM
LOADTL/7
SPINDL/2000,RPM,CLW
RAPID
GOTO/10,20,10
FEDRAT/100,MMPM
GOTO/10,20,-3
RAPID
GOTO/10,20,10
LOADTL/1
SPINDL/3000,RPM,CLW
RAPID
GOTO/-7,12,10
RAPID
GOTO/-7,12,2
FEDRAT/300,MMPM
GOTO/-7,12,-5
FEDRAT/600,MMPM
CIRCLE/0,12,-5,0,0,1
GOTO/0,5,-5
GOTO/20,5,-5
CIRCLE/20,8,-5,0,0,1
GOTO/23,8,-5
GOTO/23,28,-5
GOTO/20,30,-5
RAPID
GOTO/20,30,10
SPINDL/OFF
FINI
"""
DIALECTS = {"finish.h": (CONVERSATIONAL, (12, 15), 8), "finish.apt": (CL_DATA, (22, 25), 16)}


def job(folder: Path, text: str = PROGRAM, lines=WALL, side="left", machine="vmc", file="finish.ngc"):
    (folder / file).write_text(text)
    path = folder / "job.toml"
    path.write_text(JOB.format(first=lines[0], last=lines[1], side=side, machine=machine, file=file))
    loaded = load_job(path)
    return getattr(loaded, "job", loaded)


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    return run(job(tmp_path_factory.mktemp("finish")))


def test_the_corner_is_that_of_the_drawing(outcome):
    (op,) = outcome.operations
    for name, most in (("plain", 18.7375), ("backward", 12.902)):
        h = op.result.strategies[name].history
        assert h["engagement_deg"][h["pass"] == "finish"].max() == pytest.approx(most, abs=2e-3)
        assert op.verifications[name].verdict is Verdict.HOLDS, op.verifications[name].text


def test_the_text_is_the_old_one_with_passes_inserted(outcome, tmp_path):
    """Every old line is there in its order; the new ones stand behind line 11, the last at a safe height."""
    name, text = outcome.operations[0].inserted
    assert name == "finish.ngc"
    old, new = PROGRAM.split("\n"), text.split("\n")
    added = len(new) - len(old)
    assert added > 5
    assert new[:11] == old[:11]
    assert new[11 + added :] == old[11:]
    assert program_files(outcome, result_of(outcome))["0-semifinish-finish.ngc"] == text.encode()
    assert "0-semifinish-finish.ngc" in result_of(outcome).tracks[0].programs


def test_the_finish_pass_of_the_text_keeps_the_engagement(outcome, tmp_path):
    """The text alone, read again: its own finish lines behind the new passes, in the stock that roughing left."""
    file = tmp_path / "again.ngc"
    file.write_text(outcome.operations[0].inserted[1])
    p = read_program(file, machine_named("vmc")).program
    stock = outcome.operations[0].result.strategies["backward"].drawn["stock before"]
    trail = CentrePath.of_program(p, 5.0, Region(tuple(stock)), -5.0)
    line = np.array(outcome.operations[0].inserted[1].split("\n"))
    for words, least, most in (("G1 X20.", 11.4, 12.95), ("G3 X23. Y8. J3.", 11.4, 12.95)):
        number = int(np.flatnonzero(line == words)[-1]) + 1
        (k,) = np.flatnonzero((p.line == number) & (p.motion != RAPID))
        share = np.linspace(0.3, 1.0, 40)
        a = np.degrees(rim_engagement(trail, np.full(40, k), share, step_deg=0.25).angle)
        assert least <= a.min()
        assert a.max() <= most


@pytest.mark.parametrize("file", DIALECTS)
def test_conversational_programs_and_cl_data(file, tmp_path):
    """The passes stand behind the last line at a safe height, all other lines are the old ones (but for their block
    numbers), and the finish lines of the new text, read again, keep the engagement of the plan.
    """
    text, lines, safe = DIALECTS[file]
    outcome = run(job(tmp_path, text=text, lines=lines, file=file))
    name, new = outcome.operations[0].inserted
    assert name == file
    assert program_files(outcome, result_of(outcome))[f"0-semifinish-{file}"] == new.encode()
    old, now = text.split("\n"), new.split("\n")
    added = len(now) - len(old)
    assert now[:safe] == old[:safe]

    def unnumbered(lines):
        return [line.lstrip("0123456789 ") if file.endswith(".h") else line for line in lines]

    assert unnumbered(now[safe + added :]) == unnumbered(old[safe:])
    if file.endswith(".h"):
        assert [int(line.split()[0]) for line in now[:-1]] == list(range(len(now) - 1))
    again = tmp_path / f"again{file[6:]}"
    again.write_text(new)
    p = read_program(again, machine_named("vmc")).program
    before = read_program(tmp_path / file, machine_named("vmc")).program
    kept = (p.line <= safe) | (p.line > safe + added)
    assert p.p_work[kept] == pytest.approx(before.p_work, abs=1e-6)
    assert p.feed[kept] == pytest.approx(before.feed)
    stock = outcome.operations[0].result.strategies["backward"].drawn["stock before"]
    trail = CentrePath.of_program(p, 5.0, Region(tuple(stock)), -5.0)
    rows = np.flatnonzero((p.line >= lines[0] + added) & (p.line <= lines[1] + added) & (p.motion != RAPID))
    assert len(rows) == 3
    share = np.linspace(0.35, 1.0, 30)
    a = np.degrees(rim_engagement(trail, np.repeat(rows[:2], 30), np.tile(share, 2), step_deg=0.25).angle)
    assert 11.4 <= a.min() <= a.max() <= 12.95


@pytest.mark.parametrize(
    ("file", "old", "new", "found"),
    [
        ("finish.h", "L Z-5 F300", "L Z-5 RL F300", "RL"),
        ("finish.apt", "UNITS/MM", "UNITS/MM\nMULTAX/ON", "MULTAX/ON"),
    ],
)
def test_a_text_with_modes_that_would_change_the_passes_is_not_written_back(file, old, new, found, tmp_path):
    text, lines, _ = DIALECTS[file]
    moved = new.count("\n")
    made = job(tmp_path, text=text.replace(old, new), lines=(lines[0] + moved, lines[1] + moved), file=file)
    with pytest.raises(InputError) as err:
        run(made)
    assert f"{file}: not written back: the program contains {found}" in str(err.value)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"side": "right"}, "operation.side = 'right': the path of finish.ngc with milling = 'down' is on the left of"),
        ({"lines": (1, 6)}, "no horizontal cut below the stock's top in lines 1 to 6"),
        ({"text": PROGRAM.replace("G1 Y28.", "G0 Z3.\nG0 Z-5.\nG1 Y28."), "lines": (14, 18)}, "the cut is interrupted"),
        ({"text": PROGRAM.replace("T1 M6", "T3 M6")}, "line 14 is cut by tool 3, the operation has cutter = 1"),
    ],
)
def test_refused(tmp_path, changes, text):
    made = job(tmp_path, **changes)
    with pytest.raises(InputError) as err:
        check(made)
    assert text in str(err.value)


def test_incremental_words_are_not_written_back(tmp_path):
    made = job(tmp_path, PROGRAM.replace("M5\nM2", "G91\nG0 Z5.\nG90\nM5\nM2"))
    with pytest.raises(InputError, match=r"not written back: the program contains G91"):
        run(made)
