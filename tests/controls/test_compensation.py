"""Compensation by control: what an offset holds, the entry, corners, G41 again, parts that do not fit.

Oracle: closed forms of offset paths in complex numbers, none of them of the code under test.
"""

from __future__ import annotations

import cmath
import math
import random
from pathlib import Path

import numpy as np
import pytest
import shapely

from chipload.cutter.cutter import Cutter
from chipload.machine.machine import machine_named
from chipload.program.commands import ARC
from chipload.program.read import read_program
from chipload.program.setup import Setup, StatedControl
from control_texts import codes, ends, read

CASES = ("fanuc", "haas", "mazak", "sinumerik")


def path_of(points, control="fanuc", side="G41", r=2.0):
    """The centre's path beside a closed contour of lines, whose first point is entered from its inside."""
    body = "\n".join(f"X{z.real:.9f} Y{z.imag:.9f}" for z in points[1:])
    entry = f"G1 {side} D1 X{points[0].real:.9f} Y{points[0].imag:.9f} F500."
    commands, findings = read(f"#13001={r}\nG0 X0. Y0.\n{entry}\n{body}\nG40 X0. Y0.", control)
    return commands, findings


@pytest.mark.parametrize("seed", range(6))
def test_random_convex_contours(seed):
    """Outside of a convex contour the centre keeps r of each side, sharp corners included: a parallel polygon.

    The corners lie where the parallels of two sides cross, up to a right angle; beyond, two points r behind each side.
    """
    dice = random.Random(seed)
    n, r = dice.randint(5, 9), 2.0
    angles = sorted(dice.uniform(0.0, math.tau) for _ in range(n))
    points = [40.0 + 30j + cmath.rect(25.0, -a) for a in angles]  # clockwise: the tool is on the left outside
    start = points[0] - 30.0 * (points[1] - points[0]) / abs(points[1] - points[0])
    loop = [start, *points, points[0], points[1]]
    commands, findings = path_of(loop[1:], r=r)
    assert findings == []
    path = [complex(x, y) for x, y in ends(commands)[:, :2]]
    ring = shapely.Polygon([(z.real, z.imag) for z in points])
    # between the first and the last corner no point of the path is nearer than r, and each side has one at r
    inner = shapely.LineString([(z.real, z.imag) for z in path[4:-3]])
    assert ring.exterior.distance(inner) == pytest.approx(r, abs=1e-6)
    for k in range(1, n - 1):
        u1 = (points[k] - points[k - 1]) / abs(points[k] - points[k - 1])
        u2 = (points[k + 1] - points[k]) / abs(points[k + 1] - points[k])
        turn = abs(cmath.phase(u2 / u1))
        if turn <= math.pi / 2:
            expected = [points[k] + r * 1j * (u1 + u2) / (1.0 + (u1 * u2.conjugate()).real)]
        else:
            expected = [points[k] + r * (1j * u1 + u1), points[k] + r * (1j * u2 - u2)]
        for z in expected:
            assert min(abs(z - p) for p in path) < 1e-6


def test_an_inside_corner_is_the_crossing():
    commands, findings = path_of([20 + 0j, 40 + 0j, 40 + 30j, 0 + 30j, 0 + 0j, 20 + 0j])
    assert findings == []
    assert ends(commands)[2:-1, :2].tolist() == [[20, 2], [38, 2], [38, 28], [2, 28], [2, 2], [20, 2]]


@pytest.mark.parametrize("r", [1.0, 3.0, 4.7625, 6.0])
def test_an_arc_beside_a_short_lead_in(r):
    """The lead-in ends square to the arc, at R - r from its centre, whatever the lead-in's length."""
    body = "G0 X9.05 Y7.14\nG1 G41 X10. Y0. D1 F500.\nG3 X16.19 Y6.19 I0. J6.19\nG1 Y30.\nG40 X9."
    commands, findings = read(f"#13001={r}\n{body}")
    assert findings == []
    assert ends(commands)[2, :2].tolist() == pytest.approx([10, r])
    arc = commands.motion == ARC
    assert commands.centre[arc][0].tolist() == pytest.approx([10, 6.19])
    assert ends(commands)[3, :2].tolist() == pytest.approx([16.19 - r, 6.19])


@pytest.mark.parametrize("control", ["fanuc", "haas", "mazak"])
def test_g41_again(control):
    commands, findings = read("#13001=4.\n#2401=8.\nG41 D1 G1 X10. Y0. F500.\nY20.\nG41 Y30.\nG40 X0.", control)
    assert findings == []
    assert ends(commands)[1:4, :2].tolist() == [[6, 0], [6, 20], [6, 30]]


def test_g41_again_at_a_corner_ends_square_to_the_block_before():
    commands, findings = read("#13001=2.\nG41 D1 G1 X10. Y0. F500.\nY20.\nG41 X-10.\nG40 Y0.")
    assert findings == []
    # the end of the block before by its own normal, not the crossing (8, 18)
    assert [8, 20] in ends(commands)[:, :2].tolist()
    assert ends(commands)[-2, :2].tolist() == [-10, 18]


def test_a_part_that_does_not_fit_is_a_finding():
    body = "G41 D1 G1 X10. Y0. F500.\nY10.\nG3 X6. Y14. R4.\nG1 X-20.\nG40 Y0."
    commands, findings = read(f"#13001=5.\n{body}")
    assert codes(findings) == ["nc-compensation"]
    assert ends(commands)[-2, :2].tolist() == [-20, 9]


LINE_PROGRAM = Path("g41line.nc")
TEXT = "%\nO2\nG90 G94 G17 G21 G40\nT1 M6\nS5000 M3\nG54\nG0 X0. Y0.\nG43 Z5. H1\nG1 Z-1. F100.\n{}\nG0 Z5.\nM30\n"
SIDE = "G41 X10. Y0. D1 F500.\nY20.\nG40 X0."
FILLET = "G41 X10. Y0. D1 F500.\nY10.\nG3 X6. Y14. R4.\nG1 X-20.\nG40 Y0."


def job(tmp_path, body, compensation):
    (tmp_path / "part.nc").write_text(TEXT.format(body))
    cutters = {1: Cutter(10.0, 2, 0.5, 20.0, 30.0, 5.8e5)}
    setup = Setup(cutters=cutters, control=StatedControl("fanuc", compensation=compensation))
    reading = read_program(tmp_path / "part.nc", machine_named("vmc"), setup=setup)
    gaps = [f.code for f in reading.findings if f.severity and "length" not in f.code]
    return reading.program.p_work, gaps


@pytest.mark.parametrize(("compensation", "x"), [("control", 5.0), ("wear", 10.0), ("off", 10.0)])
def test_what_an_offset_holds(tmp_path: Path, compensation, x):
    path, gaps = job(tmp_path, SIDE, compensation)
    assert gaps == []
    assert path[:, 0].max() == pytest.approx(x)


def test_an_offset_that_nobody_states_is_asked_for(tmp_path: Path):
    path, gaps = job(tmp_path, SIDE, None)
    assert gaps == ["nc-compensation-unstated"]
    assert path[:, 0].max() == pytest.approx(5.0)


def test_a_fillet_smaller_than_the_cutter_speaks_for_wear(tmp_path: Path):
    path, gaps = job(tmp_path, FILLET, None)
    assert gaps == ["nc-compensation-wear"]
    assert path[:, 0].max() == pytest.approx(10.0)
    assert job(tmp_path, FILLET, "control")[1] == ["nc-compensation"]
    assert job(tmp_path, FILLET, "wear")[1] == []


def test_wear_moves_the_path():
    commands, findings = read(f"G10 L13 P1 R-0.1\n{SIDE.replace('G41', 'G41 G1')}", compensation="wear")
    assert np.abs(ends(commands)[:, 0]).max() == pytest.approx(10.1)
    assert findings == []
