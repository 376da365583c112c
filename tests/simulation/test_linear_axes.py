"""Rows whose axis turns along a straight line: the line itself is the oracle."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.program.build import rapid, rows
from chipload.program.program import LINE, Program
from chipload.simulation.linear_axes import with_linear_axes
from chipload.simulation.steps import steps_of

TIMES = np.array([0.0, 4.0, 2.0])


def turning(degrees: float) -> Program:
    """A line of 30 mm on which the axis turns from one side to the other, and one on which it stays."""
    points = [[30.0, 0.0, 0.0], [30.0, 10.0, 0.0]]
    program = Program.join(
        [rapid([0.0, 0.0, 0.0], 300.0, 1, "link"), rows([LINE, LINE], points, (0.0, 0.0), 10.0, 300.0, 1, "cut")]
    )
    half = math.radians(0.5 * degrees)
    side, up = math.sin(half), math.cos(half)
    return replace(program, axis=np.array([[-side, 0.0, up], [side, 0.0, up], [side, 0.0, up]]))


@pytest.mark.parametrize("degrees", [4.0, 60.0, 120.0, 165.0])
def test_the_axis_is_on_the_straight_line_between_its_directions(degrees: float) -> None:
    program = turning(degrees)
    divided, times = with_linear_axes(program, TIMES)
    steps = steps_of(divided, 0.3, 1e-3, times=times)
    u = np.minimum(steps.p1[:, 0] / 30.0, 1.0)
    known = (1.0 - u)[:, None] * program.axis[0] + u[:, None] * program.axis[1]
    known /= np.linalg.norm(known, axis=1)[:, None]
    assert np.abs(steps.a1 - known).max() < 1e-5
    # turned evenly it would be elsewhere, by 4e-6 to 0.5 rad
    even = np.sin(math.radians(degrees) * (u - 0.5))
    assert np.abs(even - known[:, 0]).max() > 2e-6
    assert times.sum() == pytest.approx(6.0)
    assert steps.duration.sum() == pytest.approx(6.0)
    on = steps.p0[:, 0] < 30.0
    np.testing.assert_allclose(np.cumsum(steps.duration[on]), 4.0 * u[on], rtol=1e-9)


def test_rows_whose_axis_stays_are_not_divided() -> None:
    program = turning(60.0)
    divided, _ = with_linear_axes(program, TIMES)
    assert (divided.p_work[:, 1] > 0.0).sum() == 1
    level = replace(program, axis=np.tile([0.0, 0.0, 1.0], (3, 1)))
    assert with_linear_axes(level, TIMES)[0] is level


def test_opposite_directions_are_refused() -> None:
    with pytest.raises(InputError, match=r"the axis turns by 175 deg: must be at most 170"):
        with_linear_axes(turning(175.0), TIMES)
