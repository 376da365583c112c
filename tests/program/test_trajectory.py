"""Time under LinuxCNC's trajectory planner.

The oracle is LinuxCNC: servo cycles that a real one took for the same texts (`benchmarks/cycle_time.py --record`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.machine.trajectory import TrajectoryPlanner
from chipload.program.build import plunge, rapid
from chipload.program.path_mode import PathControl
from chipload.program.program import Program
from chipload.program.time import program_time
from cycle_counts.clock import cycles_of, machine_of
from cycle_counts.programs import digest, own_programs, recorded

PROGRAMS, COUNTS = own_programs(), recorded()
MILL = machine_of("XYZ")
#: of the time, and at least two servo cycles
CLOSE = 0.015


@pytest.mark.parametrize("name", list(PROGRAMS))
def test_the_servo_cycles_of_a_real_linuxcnc(name):
    letters, text = PROGRAMS[name]
    known, cycles = COUNTS[name]
    assert known == digest(text), "the text is not the one that was counted: count again"
    assert cycles_of(text, machine_of(letters)) == pytest.approx(cycles, rel=CLOSE, abs=2.0)


def path(points, feed, control, tolerance=0.0, naive=0.0):
    mode = np.tile([float(control), tolerance, naive], (len(points), 1))
    parts = [rapid(points[0], 0.0, 1, "a"), plunge(points[1:], feed, 0.0, 1, "a")]
    return replace(Program.join(parts), path_mode=mode)


def test_a_line_from_rest_to_rest():
    """20 mm at 50 mm/s, X at 1000 mm/s^2: exact path with all of the acceleration, G64 with half of it."""
    line = [[0, 0, 0], [20, 0, 0]]
    assert program_time(path(line, 50.0, PathControl.EXACT_PATH), MILL).sum() == pytest.approx(0.4 + 0.05)
    assert program_time(path(line, 50.0, PathControl.CONTINUOUS), MILL).sum() == pytest.approx(0.4 + 0.1)


def test_an_arc_by_the_acceleration_towards_its_centre():
    """v = sqrt(sqrt(3/4) a r) on a full circle of 5 mm, a = 800 mm/s^2 of Y, half of which is left along the path."""
    text = "G21 G90 G61\nG0 X0 Y0 Z0\nG2 I5 F9000\nM2\n"
    v = math.sqrt(math.sqrt(0.75) * 800.0 * 5.0)
    assert cycles_of(text, MILL) == pytest.approx(1e3 * (math.tau * 5.0 / v + v / 400.0), abs=1.0)


def test_modes_at_a_corner():
    """G61.1: three trapezoids of 30 mm at 80 mm/s; G64: the wider the tolerance, the faster."""
    corner = [[0, 0, 0], [30, 0, 0], [30, 30, 0], [0, 30, 0]]
    stop = program_time(path(corner, 80.0, PathControl.EXACT_STOP), MILL).sum()
    assert stop == pytest.approx(3 * 30.0 / 80.0 + 2 * 80.0 / 1000.0 + 80.0 / 800.0)
    wide, tight = (program_time(path(corner, 80.0, PathControl.CONTINUOUS, t), MILL).sum() for t in (1.0, 0.01))
    free = program_time(path(corner, 80.0, PathControl.CONTINUOUS), MILL).sum()
    assert free < wide < tight


def test_the_naive_cam_tolerance_joins_lines():
    """Points 0.1 mm beside a straight line: one line at 0.3 mm, many at 0.001 mm."""
    x = np.linspace(0.0, 40.0, 81)
    points = np.column_stack([x, 0.1 * (np.arange(81) % 2), np.zeros(81)])
    one = program_time(path(points[[0, 80]], 60.0, PathControl.CONTINUOUS, 0.01), MILL).sum()
    joined = program_time(path(points, 60.0, PathControl.CONTINUOUS, 0.01, 0.3), MILL)
    apart = program_time(path(points, 60.0, PathControl.CONTINUOUS, 0.01, 1e-3), MILL)
    assert joined.sum() == pytest.approx(one, abs=2e-3)
    assert (joined[1:] > 0.0).all()
    assert apart.sum() > 2.0 * joined.sum()


def test_rows_of_one_line_are_the_parts_of_its_time():
    points = np.column_stack([[0.0, 1.0, 4.0, 10.0], np.zeros(4), np.zeros(4)])
    rows = program_time(path(points, 10.0, PathControl.CONTINUOUS, 0.01, 0.01), MILL)
    np.testing.assert_allclose(rows[1:] / rows.sum(), [0.1, 0.3, 0.6])


def test_settings_out_of_range():
    with pytest.raises(InputError, match="lookahead = 1: must be from 2 to 100000"):
        TrajectoryPlanner(lookahead=1)
