"""Lines in segments: LinuxCNC's rule of arcs and the reader agree that the text moves as it did."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.jobs.feeds.same_path import lines_off_path
from chipload.machine.machine import machine_named
from chipload.program.commands import ARC, PLANE_AXES, arc_sweeps, starts
from chipload.program.gcode.line_segments import LinePath, line_forms, mismatch, round_point, with_segments
from chipload.program.gcode.reader import read_gcode
from chipload.program.motions import lengths
from chipload.program.program import ARC_CW
from chipload.program.to_work import to_work

HEAD = "G21 G90 G94 G17\nT1 M6\nS3000 M3\nG0 X10 Y0 Z2\nF500\n"


def in_segments(text: str, line: int, shares: list[float], dialect: str = "linuxcnc") -> str:
    """A text with one line divided at shares of its length."""
    commands = read_gcode(text, dialect=dialect)[0]
    (k,) = np.flatnonzero(commands.line == line)
    arc = commands.motion[k] == ARC
    plane = PLANE_AXES[int(commands.plane[k])][:2] if arc else None
    path = LinePath(
        starts(commands)[k, :3], commands.position[k, :3], np.empty((0, 3)), plane, commands.centre[k] if arc else None
    )
    form = line_forms(text)[line]
    assert form.reason == ""
    assert mismatch(form, path) == ""
    sweep = float(arc_sweeps(commands)[k])
    points = [round_point(path, (u, u + 0.01), sweep, form.unit, 4) for u in shares]
    whole = LinePath(path.start, path.end, np.array(points), path.plane, path.centre)
    return with_segments(text, line_forms(text), {line: whole}, 4)[0]


LINES = {
    "line": "N40 G1 X34.5 Y7 Z-1 F600 (wall)",
    "modal": "X30 ; on",
    "packed": "G1X30Y5F600",
    "arc IJ": "G3 X0 Y10 I-10 J0 F300",
    "arc R": "G2 X-10 Y0 R10 (half)",
    "long arc R": "G3 X0 Y-10 R-10",
    "full": "N7 G2 I-10 J0",
    "helix": "G3 X10 Y0 Z-1 I-10 J0",
    "helix half": "G2 X-10 Z-3 I-10",
    "incremental": "G91 G1 X3.3333 Y1.1111",
    "incremental arc": "G91 G2 X-10 Y10 I-10",
    "absolute centre": "G90.1 G3 X0 Y10 I0 J0",
    "XZ plane": "G18 G2 X0 Z2 I-5 K0",
    "inch": "G20 G1 X1.5 Y.1 F20",
}


@pytest.mark.parametrize("name", LINES)
def test_segments_move_as_the_line_did(name: str) -> None:
    """Both texts are read: the same ends, the same length, every end on the path; the rest of the text stays."""
    text = HEAD + ("G1 Z1\n" if name == "modal" else "\n") + LINES[name] + "\nG90 G1 X0 Y0\nM2\n"
    new = in_segments(text, 7, [0.2, 0.55, 0.8])
    assert len(new.split("\n")) == len(text.split("\n")) + 3
    first = {k: k if k <= 7 else k + 3 for k in range(1, len(text.split("\n")) + 1)}
    machine = machine_named("vmc")
    old, after = (to_work(read_gcode(t)[0], machine)[0] for t in (text, new))
    assert lines_off_path(old, after, first, {7}, 1e-4) == set()
    assert lengths(after).sum() == pytest.approx(lengths(old).sum(), abs=2e-4)
    assert new.split("\n")[:6] == text.split("\n")[:6]
    assert new.split("\n")[-3:] == text.split("\n")[-3:]
    # number, words of G and comment stay on the first segment
    kept = [re.findall(r"N\d+|G[\d.]+|\(.*\)|;.*|F\d+", x) for x in (LINES[name], new.split("\n")[6])]
    assert kept[0] == kept[1]
    assert not any(re.search(r"[NGF(;]", x) for x in new.split("\n")[7:10])


def test_a_segment_the_other_way_round_is_found() -> None:
    text = HEAD + "\nG3 X0 Y10 I-10 J0\nM2\n"
    new = in_segments(text, 7, [0.5])
    first = {k: k if k <= 7 else k + 1 for k in range(1, 10)}
    machine = machine_named("vmc")
    old, good = (to_work(read_gcode(t)[0], machine)[0] for t in (text, new))
    assert lines_off_path(old, good, first, {7}, 1e-4) == set()
    lines = new.split("\n")
    for wrong in (
        [*lines[:7], "G2 " + lines[7], *lines[8:]],
        [*lines[:6], re.sub(r"X[\d.]+", "X7.08", lines[6]), "G1 X0 Y10", *lines[8:]],
        [*lines[:6], lines[6].replace("X7.0", "X7.1").replace("I-10", "I-9.9"), *lines[7:]],
    ):
        try:
            after = to_work(read_gcode("\n".join(wrong))[0], machine)[0]
        except InputError:  # the reader refuses an arc whose radii differ
            continue
        assert lines_off_path(old, after, first, {7}, 1e-4) == {7}
    assert old.motion[-1] != ARC_CW


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("G41 D1 G1 X5", "radius compensation"),
        ("G93 G1 X5 F2", "inverse time feed"),
        ("G1 X5 ,R2", "rounded corner"),
        ("G1 X5 RND=2", "rounded corner"),
        ("G1 X[#1+2]", "other words"),
        ("/ G1 X5", "other words"),
        ("G81 X5 R2", "other words"),
        ("G1 X5 A3", "other words"),
        ("G1 X5 M9", "other words"),
        ("G9 G1 X5", "other words"),
        ("G1 X5 T2", "other words"),
        ("G1 X=IC(5)", "other words"),
        ("G1 X5 M8", ""),
        ("G1 X=5 F=300", ""),
        ("G2 X5 CR=9", ""),
    ],
)
def test_lines_that_keep_one_feed(text: str, reason: str) -> None:
    assert line_forms(text)[1].reason == reason


def test_states_hold_for_the_lines_that_follow() -> None:
    forms = line_forms("G41 D1\nG1 X5\nG40 G91\nG1 X5\nG20\nX1\nG1 X9 ,C1\nY5\nY7")
    assert [forms[k].reason for k in (2, 4, 6, 8, 9)] == ["radius compensation", "", "", "rounded corner", ""]
    assert (forms[4].absolute, forms[4].unit, forms[6].unit) == (False, 1.0, 25.4)


def test_a_line_in_turned_coordinates_keeps_its_feed() -> None:
    """The words of the line are not its path there: 30 degrees turn X into Y too."""
    form = line_forms("G1 X10")[1]
    turned = LinePath(np.zeros(3), 10.0 * np.array([math.cos(0.5), math.sin(0.5), 0.0]), np.empty((0, 3)))
    assert mismatch(form, turned) == "transformed coordinates"
    assert mismatch(form, LinePath(np.zeros(3), np.array([10.0, 0.0, 0.0]), np.empty((0, 3)))) == ""
