"""What a pocket's plan says is left, against the union of all discs of its path."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.geometry.contour import Contour, Region
from chipload.planning.pocket.clearing import CHORD, clear_region
from chipload.planning.pocket.clearing_path import LIFT, polyline
from chipload.planning.pocket.leftover import cleared_squares, leftover, near_partly_cleared
from chipload.planning.pocket.reach import centre_region
from chipload.stock.planar import PlanarStock

R = 3.0
#: the neck between two chambers, [mm] wider than the cutter
NECK = 0.4


def chambers() -> Region:
    """Two chambers and a neck that passes give up: something is left."""
    a, b = 12.0 - 0.5 * (2.0 * R + NECK), 12.0 + 0.5 * (2.0 * R + NECK)
    corners = [
        [0, 0],
        [20, 0],
        [20, a],
        [60, a],
        [60, 0],
        [80, 0],
        [80, 24],
        [60, 24],
        [60, b],
        [20, b],
        [20, 24],
        [0, 24],
    ]
    return Region.of([Contour.polyline(corners, closed=True)])


def test_a_plan_leaves_what_the_discs_along_its_path_do_not_reach() -> None:
    """The union of buffers asks no stock; chords of both leave arcs by 2e-5 R."""
    region = chambers()
    path = clear_region(region, R, math.radians(60.0))
    raised = path.kind >= LIFT
    raised[0] = True
    points, breaks = polyline(
        np.column_stack([path.x, path.y]), path.centre, np.where(raised, 0.0, path.sweep), raised, 2.0 * CHORD * R
    )
    area, contours, _ = leftover(centre_region(centre_region(region, R), -R), points, breaks, R)
    assert area > 0.01
    assert path.leftover_mm2 == pytest.approx(area, abs=1e-3)
    # which films are too narrow to be drawn may differ
    assert sum(c.area for c in path.leftover) == pytest.approx(sum(c.area for c in contours), abs=5e-3)


def test_squares_that_are_cleared_lie_in_the_capsule_and_near_legs_leave_out_what_is_far() -> None:
    """A slot of 40 mm with R 1: squares within it, all but the film of a cell's reach at its edge; of a second slot
    that lies wholly in the first one no leg comes near the edge.
    """
    stock = PlanarStock((-5.0, -5.0, 45.0, 5.0), 1.0)
    stock.remove([[0.0, y, 40.0, y] for y in np.linspace(-2.0, 2.0, 9)])
    squares = cleared_squares(stock)
    assert squares.bounds[1] >= -3.0
    assert squares.bounds[3] <= 3.0
    whole = 40.0 * 6.0
    assert 0.85 * whole < squares.area < whole + 4.0 * math.pi
    points = np.array([[10.0, 0.0], [30.0, 0.0], [30.0, 2.0], [10.0, 2.0]])
    kept, breaks = near_partly_cleared(stock, points, np.array([True, False, False, False]))
    assert kept[0].tolist() == [30.0, 0.0]  # the first leg is far from every edge
    assert breaks.tolist() == [True, False, False]
