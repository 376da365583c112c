"""Points of a stock along leaning directions, against planes and slots whose places follow by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from chipload.checking.leaning_stock import _frame as frame
from chipload.checking.leaning_stock import _walls as walls
from chipload.checking.leaning_stock import fixed_directions, grid_along
from chipload.program.build import plunge, rapid
from chipload.program.program import Program

LOW, HIGH = np.array([0.0, 0.0, -20.0]), np.array([60.0, 40.0, 0.0])
PITCH = 0.5


def block(p: NDArray[np.float64]) -> NDArray[np.bool_]:
    """A block of 60 x 40 x 20 mm."""
    return np.asarray(((p > LOW) & (p < HIGH)).all(axis=1))


def slotted(axis: NDArray[np.float64], wall: float, deep: float) -> object:
    """The block with two slots along y, 10 mm wide, at both sides of a wall through (30, 0, 0) along an axis."""
    across = np.array([axis[2], 0.0, -axis[0]])

    def inside(p: NDArray[np.float64]) -> NDArray[np.bool_]:
        q = p - (30.0, 0.0, 0.0)
        beside, down = np.abs(q @ across) - 0.5 * wall, -(q @ axis)
        return block(p) & ~((beside > 0.0) & (beside < 10.0) & (down < deep))

    return inside


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0, 90.0])
def test_the_volume_of_a_grid_is_that_of_the_block(degrees: float) -> None:
    lean = math.radians(degrees)
    grid = grid_along(block, LOW, HIGH, frame(np.array([math.sin(lean), 0.0, math.cos(lean)])), PITCH)
    cell = math.prod(float(a[1] - a[0]) for a in grid.at)
    # half a cell at each of the faces at most
    assert grid.filled.sum() * cell == pytest.approx(48_000.0, rel=0.01)
    assert grid.axes @ grid.axes.T == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize(("wall", "found"), [(1.5, 1), (2.5, 1), (5.0, 0)])
def test_a_wall_along_a_leaning_axis(wall: float, found: int) -> None:
    """A wall 14 mm high between two slots along an axis that leans by 20 deg is not seen from above."""
    axis = np.array([math.sin(math.radians(20.0)), 0.0, math.cos(math.radians(20.0))])
    after, start = (grid_along(s, LOW, HIGH, frame(axis), PITCH) for s in (slotted(axis, wall, 14.0), block))
    each = walls(after, start, 5.0)
    assert len(each) == found
    for one in each:
        assert one.thickness_mm == pytest.approx(wall, abs=PITCH)
        # the top of the block leans across the wall
        assert one.height_mm == pytest.approx(14.0, abs=PITCH + 0.5 * wall * math.tan(math.radians(20.0)))
        # the place lies in the wall
        assert abs((np.array(one.place) - (30.0, 0.0, 0.0)) @ (axis[2], 0.0, -axis[0])) <= 0.5 * wall + PITCH


def program(*axes: tuple[float, float]) -> Program:
    """A line of 10 mm at a feed for each lean [deg] and length [mm] across."""
    rows = [rapid([0.0, 0.0, 9.0], 0, 1, "way")]
    for k, (_, along) in enumerate(axes):
        rows += [
            rapid([0.0, 0.0, float(k)], 0, 1, "way"),
            plunge([along, 0.0, float(k)], 15.0, 600.0, 1, "way"),
        ]
    whole = Program.join(rows)
    lean = np.radians([0.0, *(a for a, _ in axes for _ in (0, 1))])
    return replace(whole, axis=np.column_stack([np.sin(lean), np.zeros(len(lean)), np.cos(lean)]))


def test_fixed_directions_of_a_program() -> None:
    """Of upright, 30 and 60 deg the leaning ones, the longer first; one that turns on and on is left out, in words."""
    found, left = fixed_directions(program((0.0, 40.0), (30.0, 50.0), (60.0, 90.0)))
    assert np.degrees(np.arccos(found[:, 2])) == pytest.approx([60.0, 30.0], abs=1e-3)
    turning = program((0.0, 40.0), *((10.0 + k, 0.5) for k in range(40)))
    assert len(fixed_directions(turning)[0]) == 0
    assert "another direction" in fixed_directions(turning)[1]
    assert left == ""
