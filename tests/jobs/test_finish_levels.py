"""A wall that a program finishes at several heights: a level each, all semi-finish passes in one text."""

from __future__ import annotations

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

#: a wall with an inside corner of 8 mm, finished at -4 and -7 mm; at the lower height the straight side goes on farther
PROGRAM = """(finish pass of another CAM)
G21 G17 G90 G40 G49 G80 G55
T1 M6
S3000 M3
G0 X-7. Y12. Z10.
Z2.
N100 G1 Z-4. F300.
G3 X0. Y5. I7. F600.
(WALL)
G1 X20.
G3 X23. Y8. J3.
G1 Y28.
(WALL END)
G1 X20. Y30.
{between}
G0 X-7. Y12.
N200 G1 Z-7. F300.
G3 X0. Y5. I7. F600.
(WALL)
G1 X20.
G3 X23. Y8. J3.
G1 Y26.
(WALL END)
G1 X20. Y30.
G0 Z10.
M5
M2
"""
LIFTED, LOW = "G0 Z10.", "G1 X19. Y31."


def job(folder, text, part, axial=4.0, strategies='["backward"]'):
    (folder / "finish.ngc").write_text(text)
    path = folder / "job.toml"
    made = JOB.format(first=1, last=2, side="left", machine="vmc", file="finish.ngc")
    made = made.replace("lines = [1, 2]", part).replace("axial_depth_mm = 5.0", f"axial_depth_mm = {axial:g}")
    path.write_text(made.replace('["plain", "backward"]', strategies).replace("step_mm = 0.1", "step_mm = 0.25"))
    loaded = load_job(path)
    return getattr(loaded, "job", loaded)


@pytest.mark.parametrize(("between", "safe"), [(LIFTED, (6, 16)), (LOW, (6, 6))], ids=["lifted", "low"])
def test_a_level_each_and_one_text(between, safe, tmp_path):
    """Each level is planned from its own top; the text has the passes of both where it is last high before them, and
    its own finish lines, read again, keep the engagement at both heights.
    """
    text = PROGRAM.format(between=between)
    outcome = run(job(tmp_path, text, 'labels = ["WALL", "WALL END"]'))
    assert [(op.top, op.depth) for op in outcome.operations] == [(0.0, 4.0), (-4.0, 3.0)]
    for op in outcome.operations:
        assert op.verifications["backward"].verdict is Verdict.HOLDS, op.verifications["backward"].text
        history = op.result.strategies["backward"].history
        z, cuts = history["z_mm"], history["engagement_deg"] > 0.0
        assert set(z[cuts].round(6).tolist()) == {op.top - op.depth}
        assert z.max() == 5.0
    assert [t.name for t in result_of(outcome).tracks] == ["0-backward", "1-backward"]
    name, new = outcome.operations[0].inserted
    assert outcome.operations[1].inserted == ("", "")
    assert program_files(outcome, result_of(outcome))[f"0-semifinish-{name}"] == new.encode()

    old, now = text.split("\n"), new.split("\n")
    own, k = [], 0  # the place of each old line in the new text
    for line in old:
        k = now.index(line, k)
        own.append(k)
        k += 1
    gaps = [j for j in range(1, len(old)) if own[j] > own[j - 1] + 1]
    assert sorted(set(gaps)) == sorted(set(safe))
    at = [j for j, line in enumerate(now) if line == "(semi-finish passes by chipload)"]
    assert len(at) == 2
    low = [min(float(w[1:]) for line in now[a : a + 8] for w in line.split() if w[0] == "Z") for a in at]
    assert low == [-4.0, -7.0]  # the upper level first

    (tmp_path / "again.ngc").write_text(new)
    p = read_program(tmp_path / "again.ngc", machine_named("vmc")).program
    for op, walls in zip(outcome.operations, ((9, 10), (19, 20)), strict=True):
        stock = op.result.strategies["backward"].drawn["stock before"]
        trail = CentrePath.of_program(p, 5.0, Region(tuple(stock)), op.top - op.depth)
        for j in walls:
            (row,) = np.flatnonzero((p.line == own[j] + 1) & (p.motion != RAPID))
            a = np.degrees(rim_engagement(trail, np.full(30, row), np.linspace(0.35, 1.0, 30), step_deg=0.25).angle)
            assert 11.4 <= a.min() <= a.max() <= 12.95


def test_lines_name_the_same_levels(tmp_path):
    """By lines and by one label as by two: the second label is where the run of level cuts ends only in the text."""
    lines, valid = check(job(tmp_path, PROGRAM.format(between=LIFTED), "lines = [10, 12, 20, 22]"))
    assert valid
    assert [line for line in lines if line.startswith("operation")] == [
        "operation 0: contour, cutter 1 of 10 mm, 2 passes",
        "operation 1: contour, cutter 1 of 10 mm, 2 passes",
    ]
    cut = PROGRAM.replace("G1 X20. Y30.\n", "G0 Z10.\n").format(between=LIFTED)
    lines, valid = check(job(tmp_path, cut, 'labels = ["(wall)"]'))
    assert valid
    assert sum(line.startswith("operation") for line in lines) == 2


@pytest.mark.parametrize(
    ("changes", "part", "axial", "message"),
    [
        ({"Z-7.": "Z-3."}, "lines = [10, 12, 20, 22]", 4.0, "line 20 cuts at -3 mm, above the level before it at -4"),
        (
            {},
            "lines = [10, 12, 20, 22]",
            5.0,
            "operation.axial_depth_mm = 5: finish.ngc finishes the wall 4 mm deep at",
        ),
        ({"J3.\nG1 Y26.": "J3.\nG1 X24. Y26."}, "lines = [10, 12, 20, 22]", 4.0, "at -7 mm the cutter comes"),
        ({}, "lines = [10, 12, 20]", 4.0, "part.lines = [10, 12, 20]: must be a first and a last line for each height"),
        ({}, 'lines = [10, 12]\nlabels = ["WALL"]', 4.0, "part.lines and part.labels: stated twice"),
        ({}, 'labels = ["WALLS"]', 4.0, "part.labels: no line of finish.ngc holds 'WALLS': state a label"),
        ({}, 'labels = ["WALL END", "N100"]', 4.0, "no line of finish.ngc behind line 13 holds 'N100'"),
    ],
)
def test_refused(changes, part, axial, message, tmp_path):
    text = PROGRAM.format(between=LIFTED)
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(InputError) as err:
        check(job(tmp_path, text, part, axial))
    assert message in str(err.value)


def test_a_line_far_down_a_long_program(tmp_path):
    """Programs have more than a thousand lines."""
    long = PROGRAM.format(between=LIFTED).replace("T1 M6\n", "(nothing)\n" * 3000 + "T1 M6\n")
    _, valid = check(job(tmp_path, long, "lines = [3010, 3012]"))
    assert valid
