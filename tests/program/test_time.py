from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.geometry.contour import Contour
from chipload.machine.feed import corner_speed, curvature_speed, limited_speed
from chipload.machine.machine import machine_named
from chipload.program.build import dwell, follow, helix, plunge, rapid
from chipload.program.check import check_program
from chipload.program.path_mode import PathControl
from chipload.program.program import Program
from chipload.program.read import read_program, times_of
from chipload.program.time import peak_speed, program_time

VMC = machine_named("vmc")


def cut(points, feed=40.0, spindle=800.0):
    return Program.join([rapid(points[0], spindle, 1, "link"), plunge(points[1:], feed, spindle, 1, "cut")])


def test_collinear_rows_are_one_move():
    one = program_time(cut([[0, 0, 0], [90, 0, 0]]), VMC).sum()
    many = program_time(cut([[x, 0, 0] for x in np.linspace(0, 90, 18)]), VMC).sum()
    assert many == pytest.approx(one, rel=1e-12)
    assert one == pytest.approx(90 / 40 + 40 / 3000, rel=1e-12)


def test_square_corner():
    """Down to the corner's speed and up again: twice a trapezoid with one end at v_c."""
    vc = float(corner_speed(math.pi / 2, 3000.0, VMC.corner_tolerance))
    side = 50 / 40 + (40**2 / (2 * 3000) + (40 - vc) ** 2 / (2 * 3000)) / 40
    np.testing.assert_allclose(program_time(cut([[0, 0, 0], [50, 0, 0], [50, 50, 0]]), VMC), [0, side, side])
    stop = program_time(cut([[0, 0, 0], [50, 0, 0], [50, 50, 0]]), replace(VMC, corner_tolerance=0.0))
    np.testing.assert_allclose(stop[1:], 50 / 40 + 40 / 3000)


def test_tangent_contour_against_fine_samples():
    """Lines and arcs that touch: the same as a forward-backward pass over 2e5 samples of the curve."""
    slot = Contour.from_bulges([[0, 0], [30, 0], [30, 2], [0, 2]], [0.0, 1.0, 0.0, 1.0], closed=True)
    feed = 120.0  # the arcs of 1 mm allow sqrt(3000) = 54.8
    part = follow(slot, 0.0, feed, 800.0, 1, "cut")
    rows = program_time(Program.join([rapid([0, 0, 0], 800.0, 1, "link"), part]), VMC)
    s = np.linspace(0, slot.length, 200001)
    wanted = np.minimum(feed, curvature_speed(slot.at(s)[2], 3000.0))
    assert rows.sum() == pytest.approx(limited_speed(s, wanted, 3000.0)[1][-1], rel=1e-5)


def test_helix_dwell_and_rapid():
    entry = helix((20.0, 0.0), (0.0, 0.0), (10.0, 0.0), 5.0, 10.0, 800.0, 1, "entry", level=False)
    parts = [rapid([[20, 0, 60], [20, 0, 10]], 800.0, 1, "link"), entry, dwell([20, 0, 0], 0.75, 800.0, 1, "x")]
    t = program_time(Program.join(parts), VMC)
    assert t[1] == pytest.approx(2 * math.sqrt(50 / 2500))  # never reaches 400 mm/s
    slope = math.atan2(10.0, 80 * math.pi)
    a = min(3000.0 / math.cos(slope), 2500.0 / math.sin(slope))
    assert t[2:6].sum() == pytest.approx(math.hypot(80 * math.pi, 10.0) / 10.0 + 10.0 / a)
    assert t[6] == 0.75


def test_a_dwell_is_a_stop():
    legs = [plunge([x, 0, 0], 40.0, 800.0, 1, "cut") for x in (45, 90)]
    parts = [rapid([0, 0, 0], 800.0, 1, "link"), legs[0], dwell([45, 0, 0], 0.5, 800.0, 1, "x"), legs[1]]
    leg = 45 / 40 + 40 / 3000
    np.testing.assert_allclose(program_time(Program.join(parts), VMC), [0, leg, 0.5, leg])
    # so is a change of speed of the spindle, and the joint of a rapid and a feed
    parts = [rapid([0, 0, 0], 800.0, 1, "link"), legs[0], plunge([90, 0, 0], 40.0, 700.0, 1, "cut")]
    np.testing.assert_allclose(program_time(Program.join(parts), VMC), [0, leg, leg])
    parts = [rapid([[0, 0, 0], [45, 0, 0]], 800.0, 1, "link"), legs[1]]
    np.testing.assert_allclose(program_time(Program.join(parts), VMC), [0, 2 * (45 / 3000) ** 0.5, leg])


def test_steep_helix_keeps_both_limits():
    """On a helix v^2 cos^2 / r stays within a_xy: 1 mm radius, 20 mm a turn."""
    entry = helix((1.0, 0.0), (0.0, 0.0), (100.0, 0.0), 20.0, 190.0, 800.0, 1, "entry", level=False)
    t = program_time(Program.join([rapid([1, 0, 100], 800.0, 1, "link"), entry]), VMC)
    slope = math.atan2(20.0, 2 * math.pi)
    v = math.sqrt(3000.0) / math.cos(slope)
    a = min(3000.0 / math.cos(slope), 2500.0 / math.sin(slope))
    assert t.sum() == pytest.approx(5 * math.hypot(20.0, 2 * math.pi) / v + v / a, rel=1e-12)


def test_diagonal_uses_both_axes():
    t = program_time(cut([[0, 0, 0], [30, 30, 0]], feed=50.0), VMC)
    assert t[1] == pytest.approx(30 * math.sqrt(2) / 50 + 50 / (3000 * math.sqrt(2)))


def test_what_the_machine_cannot_do():
    slot = Contour.circle((792.0, 0.0), 10.0)
    parts = [rapid([802, 0, 600], 800.0, 1, "link"), follow(slot, -1.0, 300.0, 1.0, 1, "cut")]
    parts += [plunge([0, 0, 0], 5.0, 0.0, 1, "cut")]
    found = check_program(Program.join(parts), VMC)
    assert [(f.code, f.text) for f in found] == [
        (
            "machine-limit",
            "row 0: X goes from 0 to 802 mm: machine vmc travels 800 mm, wherever the work lies (4 rows, the first is "
            "0)",
        ),
        (
            "machine-limit",
            "row 0: Z goes from -1 to 600 mm: machine vmc travels 500 mm, wherever the work lies (2 rows, the first is "
            "0)",
        ),
        ("machine-feed", "row 1: feed 18000 mm/min: machine vmc reaches 12000 mm/min (2 rows, the first is 1)"),
        (
            "machine-spindle",
            "row 1: spindle 9.5493 rpm: machine vmc turns from 60 to 15000 rpm (2 rows, the first is 1)",
        ),
        ("machine-spindle-off", "row 3: cuts with the spindle at rest: state a spindle speed"),
    ]
    assert check_program(cut([[0, 0, 0], [9, 0, 0]]), VMC) == ()
    # an arc whose ends are inside and whose bulge is not
    bulge = Contour.from_bulges([[395.0, -10.0], [395.0, 10.0]], [1.0])
    inside = [rapid([[-400, 0, 0], [395, -10, 0]], 800.0, 1, "link"), follow(bulge, 0.0, 5.0, 800.0, 1, "cut")]
    assert "X goes from -400 to 405 mm" in check_program(Program.join(inside), VMC)[0].text
    assert check_program(plunge([0, 0, 0], 5.0, 100.0, 1, "cut"), VMC)[0].code == "program-start"


def test_a_dwell_while_the_spindle_starts_is_no_cut():
    """A post that waits for the spindle before the first rapid begins with a rapid; before a cut it does not."""
    wait = dwell([0, 0, 5], 5.0, 800.0, 1, "wait")
    first = rapid([[0, 0, 5], [1, 0, 5]], 800.0, 1, "link")
    assert "program-start" not in [f.code for f in check_program(Program.join([wait, first]), VMC)]
    plain = Program.join([wait, plunge([0, 0, 0], 5.0, 100.0, 1, "cut")])
    assert "program-start" in [f.code for f in check_program(plain, VMC)]


def test_asking_no_more_than_the_peak_changes_no_time_and_less_does():
    """Short lines, arcs and corners: the peak is what the feed of a row may be lowered to for nothing."""
    rng = np.random.default_rng(4)
    points = np.cumsum(rng.normal(0.0, 1.0, (60, 3)) * rng.choice([0.02, 0.5, 8.0], (60, 1)), axis=0)
    program = cut(points, feed=150.0)
    peak = peak_speed(program, VMC)
    feeds = program.motion != 0
    assert (peak[feeds] < 150.0).sum() > 20
    whole = program_time(program, VMC)
    np.testing.assert_allclose(program_time(replace(program, feed=np.where(feeds, peak, 0.0)), VMC), whole, rtol=1e-9)
    for k in np.flatnonzero(feeds)[::7]:
        slower = replace(program, feed=np.where(np.arange(len(peak)) == k, 0.98 * peak, program.feed))
        assert program_time(slower, VMC).sum() > whole.sum() * (1.0 + 1e-9)
    rapids = np.flatnonzero(~feeds)
    assert (peak[rapids] <= VMC.rapid).all()


def with_mode(program, control, tolerance=0.0):
    mode = np.tile([float(control), tolerance, tolerance], (len(program), 1))
    return replace(program, path_mode=mode)


def test_path_modes_on_another_controller():
    """G61.1 stops at every joint, G61 at corners, G64 P rounds them off by P, G64 by the machine's own tolerance."""
    corner = cut([[0, 0, 0], [25, 0, 0], [50, 0, 0], [50, 50, 0]])
    own = program_time(corner, VMC)
    stop = 40 / 3000
    times = {c: program_time(with_mode(corner, c), VMC) for c in PathControl}
    np.testing.assert_allclose(times[PathControl.MACHINE], own)
    np.testing.assert_allclose(times[PathControl.CONTINUOUS], own)
    np.testing.assert_allclose(times[PathControl.EXACT_PATH].sum(), 100 / 40 + 2 * stop)
    np.testing.assert_allclose(times[PathControl.EXACT_STOP][1:], [25 / 40 + stop, 25 / 40 + stop, 50 / 40 + stop])
    wide = program_time(with_mode(corner, PathControl.CONTINUOUS, 0.02), VMC)
    np.testing.assert_allclose(wide, program_time(corner, replace(VMC, corner_tolerance=0.02)))
    assert wide.sum() < own.sum()


def test_a_corner_takes_half_of_a_short_row_at_most():
    """Chords of 1 mm of a circle of 5 mm, rounded off by up to 1 mm: sqrt(a r) at joints, little more between."""
    a = np.arange(0.0, 20.0, 0.2)
    points = np.column_stack([5 * np.cos(a), 5 * np.sin(a), 0 * a])
    program = with_mode(cut(points, feed=190.0), PathControl.CONTINUOUS, 1.0)
    v = math.sqrt(3000.0 * 5.0)
    length = 99 * 10.0 * math.sin(0.1)
    mean = length / (program_time(program, VMC).sum() - v / 3000.0)
    assert 0.99 * v < mean < 1.1 * v


def test_the_mode_of_a_text_reaches_its_program(tmp_path):
    text = "G21 G90\nG0 X0 Y0\nG1 X1 F100\nG61.1\nX2\nG64 P0.02 Q0.01\nX3\nG20 G64 P0.01\nX1\nG61\nX2\nG64\nX3\nM2\n"
    (tmp_path / "p.ngc").write_text(text)
    modes = read_program(tmp_path / "p.ngc", VMC).program.path_mode
    wanted = [[4, 0, 0], [3, 0, 0], [1, 0, 0], [3, 0.02, 0.01], [3, 0.254, 0.254], [2, 0, 0], [3, 0, 0]]
    np.testing.assert_allclose(modes, wanted)


def test_rapids_from_nowhere_take_no_time(tmp_path):
    """X and Y first, then Z: where they come from is not known. What follows counts."""
    (tmp_path / "p.ngc").write_text("G21 G90\nG0 X30 Y20\nZ50\nG0 X75\nG1 Z40 F1200\nM2\n")
    reading = read_program(tmp_path / "p.ngc", VMC)
    wanted = [0.0, 0.0, 2 * math.sqrt(45 / 3000), 10 / 20 + 20 / 2500]
    np.testing.assert_allclose(times_of(reading, VMC), wanted)


def test_a_control_that_needs_10_ms_for_a_block():
    """Rows of 0.1 mm at 50 mm/s run at 10 mm/s, in a trapezoid over all of them; longer rows are not concerned."""
    slow = replace(VMC, block_time=0.01)
    fine = cut([[0.1 * k, 0.0, 0.0] for k in range(101)], feed=50.0)
    assert program_time(fine, slow).sum() == pytest.approx(10.0 / 10.0 + 10.0 / 3000.0, rel=1e-9)
    assert peak_speed(fine, slow).max() == pytest.approx(10.0)
    coarse = cut([[k, 0.0, 0.0] for k in range(11)], feed=50.0)
    assert program_time(coarse, slow).sum() == program_time(coarse, VMC).sum()
