"""Polar and cylindrical interpolation. Oracle: the flat contour, which the tip draws on the turning workpiece."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.errors import Severity
from chipload.machine.machine import machine_named
from chipload.program.program import RAPID
from chipload.program.read import line_times, read_program
from chipload.program.setup import Setup, StatedControl

#: C is upright, and growing C turns the tool right-handed about the workpiece
MILL = machine_named("dmu50")
#: B is upright on a horizontal mill, the tool along Z
PALLET = machine_named("horizontal-b")
HEAD = "%\nO0001\nG21 G90 G17 G94 G40 G49 G80\nT1 M6\nS2000 M3\n"


def read(folder: Path, body: str, machine=MILL, control="fanuc"):
    path = folder / "part.nc"
    path.write_text(f"{HEAD}{body}\nM30\n%\n")
    offsets = {"G54": (0.0,) * 9}
    stated = StatedControl(control, compensation="control")
    cutters = {1: Cutter(6.0, 2, 0.5, 20.0, 30.0, 5.8e5)}
    return read_program(path, machine, setup=Setup(work_offsets=offsets, cutters=cutters, control=stated))


def cuts(reading):
    """(n, 3) ends of the cuts."""
    p = reading.program
    return p.p_work[p.motion != RAPID]


def unread(reading):
    return [f for f in reading.findings if f.severity >= Severity.UNPROVEN]


def off_segments(points, corners):
    """Greatest distance of points (n, 2) from the polygon line through corners."""
    best = np.full(len(points), np.inf)
    for a, b in pairwise(corners):
        a, b = np.array(a), np.array(b)
        t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - a - t[:, None] * (b - a), axis=1))
    return best.max()


SQUARE = "G0 X30. Y0. C0. Z-2.\n{on}\nG1 X20. C0. F{f}\nC15.\nX-20.\nC-15.\nX20.\nC0.\nX30.\n{off}\nG0 Z20."
CORNERS = [(30, 0), (20, 0), (20, 15), (-20, 15), (-20, -15), (20, -15), (20, 0), (30, 0)]


@pytest.mark.parametrize(("on", "off", "control"), [("G12.1", "G13.1", "fanuc"), ("G112", "G113", "haas")])
def test_a_square_by_polar_interpolation(tmp_path: Path, on, off, control):
    reading = read(tmp_path, SQUARE.format(on=on, off=off, f="300."), control=control)
    assert unread(reading) == []
    points = cuts(reading)
    assert off_segments(points[:, :2], CORNERS) < 1e-3
    # all corners are reached, and it ends where it began after a whole turn of C
    for corner in CORNERS:
        assert np.abs(points[:, :2] - corner).max(axis=1).min() < 1e-6
    c = np.degrees(reading.axes[:, 5])
    assert c[-1] == pytest.approx(360.0, abs=1e-6)
    assert np.abs(reading.axes[:, 1]).max() < 1e-9


def test_the_feed_is_that_of_the_flat_path(tmp_path: Path):
    """At a feed so low that accelerations do not count: 150 mm at 30 mm/min take 5 minutes."""
    reading = read(tmp_path, SQUARE.format(on="G12.1", off="G13.1", f="30."))
    lines, seconds = line_times(reading, MILL)
    length = sum(math.dist(a, b) for a, b in pairwise(CORNERS))
    cut = (lines >= 8) & (lines <= 14)
    assert seconds[cut].sum() == pytest.approx(60.0 * length / 30.0, rel=5e-3)


def test_an_arc_and_compensation(tmp_path: Path):
    """A circle of 10 mm about (15, 0) of the plane, cut from outside beside it by the radius 3 of the tool."""
    body = (
        "G0 X40. Y0. C0. Z-2.\nG12.1\nG1 G42 D1 X25. C0. F200.\nG3 X25. C0. I-10. J0.\nG1 G40 X40. C0.\nG13.1\nG0 Z20."
    )
    reading = read(tmp_path, body)
    assert unread(reading) == []
    points = cuts(reading)[:, :2]
    r = np.hypot(points[:, 0] - 15.0, points[:, 1])
    round_it = np.abs(r - 13.0) < 1e-3
    assert round_it.sum() > 30
    assert np.ptp(np.unwrap(np.arctan2(points[round_it, 1], points[round_it, 0] - 15.0))) == pytest.approx(
        math.tau, rel=1e-3
    )
    assert r.min() > 13.0 - 1e-3


def test_over_the_pole_is_left_out(tmp_path: Path):
    reading = read(tmp_path, "G0 X30. Y0. C0. Z-2.\nG12.1\nG1 X-30. C0. F200.\nX30. C10.\nG13.1\nG0 Z20.")
    assert any("pole" in f.text and f.line == 8 for f in unread(reading))


def test_a_machine_without_the_axis_leaves_it_out(tmp_path: Path):
    body = SQUARE.format(on="G12.1", off="G13.1", f="300.").replace("G0 X30. Y0. C0. Z-2.", "G0 X30. Y0. Z-2.")
    reading = read(tmp_path, body, machine_named("vmc"))
    assert any("no machine with an axis C" in f.text for f in unread(reading))


def test_a_contour_on_a_cylinder(tmp_path: Path):
    """A line and a half circle of 8 mm on a cylinder of 50 mm about B, which is at Y = 8 and 24."""
    r = 50.0
    degrees = [math.degrees(20.0 / r), math.degrees(20.0 / r)]
    body = (
        f"G0 X0. Y8. B0. Z50.\nG7.1 B{r}\nG1 B{degrees[0]:.9f} F200.\nG3 Y24. B{degrees[1]:.9f} R8.\nG1 B0.\n"
        "G7.1 B0\nG0 Z80."
    )
    reading = read(tmp_path, body, PALLET)
    assert unread(reading) == []
    points = cuts(reading)
    # Z of the workpiece is along the axis of the pallet, X towards the spindle
    older = read(tmp_path, body.replace("G7.1", "G107"), PALLET)
    np.testing.assert_array_equal(cuts(older), points)
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), r, atol=1e-3)
    flat = np.column_stack([r * np.arctan2(points[:, 1], points[:, 0]), points[:, 2]])
    arc = flat[:, 0] > 20.0 + 1e-6
    np.testing.assert_allclose(np.hypot(flat[arc, 0] - 20.0, flat[arc, 1] - 16.0), 8.0, atol=1e-3)
    assert flat[:, 0].max() == pytest.approx(28.0, abs=1e-2)
    assert off_segments(flat[~arc], [(0, 8), (20, 8), (20, 24), (0, 24)]) < 1e-3
    lines, seconds = line_times(read(tmp_path, body.replace("F200.", "F20."), PALLET), PALLET)
    length = 20.0 + math.pi * 8.0 + 20.0
    assert seconds[(lines >= 8) & (lines <= 10)].sum() == pytest.approx(60.0 * length / 20.0, rel=5e-3)


@pytest.mark.parametrize("code", ["G55", "G68 X0. Y0. R20.", "G18", "G92 X0."])
def test_codes_that_change_coordinates_within_it(tmp_path: Path, code):
    body = SQUARE.format(on="G12.1", off="G13.1", f="300.").replace("X-20.\n", f"{code}\nX-20.\n")
    assert any("within G12.1" in f.text and f.line == 10 for f in unread(read(tmp_path, body)))


def test_along_a_radius_to_the_pole_and_back(tmp_path: Path):
    """C stands still on a radius, also on the pole."""
    reading = read(tmp_path, "G0 X30. Y0. C0. Z-2.\nG12.1\nG1 X20. C20. F200.\nX0. C0.\nX10. C10.\nG13.1\nG0 Z20.")
    assert unread(reading) == []
    assert np.degrees(reading.axes[-1, 5]) == pytest.approx(45.0)
    assert off_segments(cuts(reading)[:, :2], [(30, 0), (20, 20), (0, 0)]) < 1e-3


WRAP = "G0 X0. Y0. B0. Z50.\n{on}\nG1 X20. F{f}\nG3 Y16. R8.\nG1 X0.\nG107\nG1 Y40. F100.\nG0 Z80."


@pytest.mark.parametrize("size", ["R50.", "Q100."])
def test_a_haas_wraps_a_linear_axis(tmp_path: Path, size):
    """X about B, a cylinder of 50 mm: a line of 20 mm, a half circle of 8 mm, a line back; then X and Y as before."""
    reading = read(tmp_path, WRAP.format(f="20.", on=f"G107 B0. X0. {size}"), PALLET, control="haas")
    assert unread(reading) == []
    points, r = cuts(reading), 50.0
    wrapped = points[reading.program.line[reading.program.motion != RAPID] <= 10]
    np.testing.assert_allclose(np.hypot(wrapped[:, 0], wrapped[:, 1]), r, atol=1e-3)
    flat = np.column_stack([r * np.arctan2(wrapped[:, 1], wrapped[:, 0]), wrapped[:, 2]])
    arc = flat[:, 0] > 20.0 + 1e-6
    np.testing.assert_allclose(np.hypot(flat[arc, 0] - 20.0, flat[arc, 1] - 8.0), 8.0, atol=1e-3)
    assert off_segments(flat[~arc], [(0, 0), (20, 0), (20, 16), (0, 16)]) < 1e-3
    assert points[-1].tolist() == pytest.approx([r, 0.0, 40.0], abs=1e-6)
    lines, seconds = line_times(reading, PALLET)
    assert seconds[(lines >= 8) & (lines <= 10)].sum() == pytest.approx(60.0 * (40.0 + math.pi * 8.0) / 20.0, rel=5e-3)


@pytest.mark.parametrize(
    ("on", "why"),
    [
        ("G107 B0. X0.", "Setting 34"),
        ("G107 C0. Y0. R20.", "no machine with an axis C"),
        ("G107 B0. Y0. R20.", "in the plane of G17"),
        ("G107 B10. X0. R20.", "does not begin at X0"),
    ],
)
def test_a_mapping_that_is_left_out(tmp_path: Path, on, why):
    """Its motions are a finding with their lines; what follows is read."""
    reading = read(tmp_path, f"G0 X0. Y0. Z2.\n{on}\nG1 Y5. F100.\nG107\nG1 X9. F100.", PALLET, control="haas")
    assert [(f.line, f.code) for f in unread(reading)] == [(7, "nc-left-out")]
    assert why in unread(reading)[0].text
