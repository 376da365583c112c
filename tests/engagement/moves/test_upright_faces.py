"""A tube as the initial body, whose walls stand upright: beside them is air, also in a cell that they stand in."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.engagement.bricks.stock import BrickStock
from chipload.engagement.moves.stock import MoveStock
from chipload.stock.rings import ring_stock

LOW, HIGH = np.array([-22.5, -22.5, -20.0]), np.array([22.5, 22.5, 0.0])
MILL = Cutter(10.0, 3, math.radians(30.0), 22.0, 30.0, 6e5)
#: distance of the cutter's axis from that of the tube, and radius of the tube [mm]
APART, OUTER = 26.0, 22.5


@pytest.fixture(scope="module")
def tube():
    stock = ring_stock(np.array([-20.0, 0.0]), lambda z: 0 * z + 15.0, lambda z: 0 * z + OUTER)
    return stock.part


def lens() -> float:
    """Area that the circles of cutter and tube share [mm^2]."""
    a = math.acos((APART**2 + MILL.radius**2 - OUTER**2) / (2.0 * APART * MILL.radius))
    b = math.acos((APART**2 + OUTER**2 - MILL.radius**2) / (2.0 * APART * OUTER))
    return MILL.radius**2 * a + OUTER**2 * b - APART * MILL.radius * math.sin(a)


def test_a_range_of_material_holds_in_all_of_its_cell(tube):
    stock = MoveStock(LOW, HIGH, {1: MILL}, tube)
    solid = np.flatnonzero(stock.level[:, 0] > stock.level[:, 2])
    assert len(solid) > 1000
    i, j = np.divmod(solid, stock.shape[1])
    for dx in (0.0, 1.0):
        for dy in (0.0, 1.0):
            r = np.hypot(stock.grid[0] + (i + dx) * stock.grid[2], stock.grid[1] + (j + dy) * stock.grid[3])
            # a corner of the polygon lies on the circle, a chord within 0.4 um of it
            assert r.min() > 15.0 - 1e-3
            assert r.max() < OUTER + 1e-3


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, 4.1])
def test_a_plunge_into_the_rim_removes_the_lens_of_two_circles(tube, angle):
    """1 mm deep; by the engine of the upright axis, and by that of one that leans by 0.1 mrad."""
    tip = [APART * math.cos(angle), APART * math.sin(angle)]
    p = np.array([[*tip, 1.0], [*tip, 0.0], [*tip, -1.0]])
    tools = np.array([1, 1])
    stock = MoveStock(LOW, HIGH, {1: MILL}, tube)
    found = stock.take(p[:-1], p[1:], tools, corner_slices=96, flank_mm={1: 2.5})
    assert found.volume.sum() / len(found.volume) == pytest.approx(lens(), rel=0.01)
    lean = np.tile([1e-4, 0.0, math.sqrt(1.0 - 1e-8)], (2, 1))
    bricks = BrickStock(LOW, HIGH, {1: MILL}, tube)
    leaning = bricks.take(p[:-1], p[1:], lean, lean, tools, corner_slices=48, flank_mm={1: 2.5})
    assert leaning.volume.sum() / len(leaning.volume) == pytest.approx(lens(), rel=0.01)
