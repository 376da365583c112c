"""Room about a place of the centre region and a part of a rim, each against another method."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from chipload.geometry.contour import Contour, Region
from chipload.planning.pocket import _pass_steps
from chipload.planning.pocket.reach import reach_of
from chipload.stock._planar import uncut_between
from chipload.stock.planar import TOUCH, PlanarStock


def test_no_edge_is_nearer_than_the_room_about_a_place() -> None:
    """Held against the distance to the edges, of a region with slanted and short edges; most places have room."""
    corners = [[0.0, 0.0], [31.0, 2.0], [40.0, 17.0], [22.0, 19.3], [21.7, 24.0], [3.0, 21.0]]
    region = Region.of([Contour.polyline(corners, closed=True)])
    stock = PlanarStock((-3.0, -3.0, 43.0, 27.0), 3.0)
    reach = reach_of(region, stock.grid, 3e-5)
    inside = shapely.polygons(corners)
    rng = np.random.default_rng(5)
    places = rng.uniform([-2.0, -2.0], [42.0, 26.0], (20_000, 2))
    room = np.array([_pass_steps.room(x, y, stock.grid, reach.flag) for x, y in places.tolist()])
    far = shapely.distance(shapely.points(places), inside.exterior)
    free = room > 0.0
    assert (far[free] >= room[free]).all()
    assert shapely.contains_xy(inside, *places[free].T).all()
    assert free.sum() > 0.7 * shapely.contains_xy(inside, *places.T).sum()


def test_a_part_of_a_rim_meets_what_the_whole_one_meets_there() -> None:
    """Beside a slot of width 2 R a cutter at (x, 1.2 R) meets the stock from the slot's edge on, in closed form."""
    stock = PlanarStock((-8.0, -8.0, 8.0, 8.0), 2.0)
    stock.remove([[-8.0, 0.0, 8.0, 0.0]])
    pieces = round(math.pi / stock.grid[6])
    held = (stock.grid, stock.head, stock.link, stock.axis, stock.rim)
    # heading along +x at y = 2.4: the rim is in the slot below y = 2, from -pi/2 to asin(-0.2)
    n = uncut_between(0.0, 2.4, 1.0, 0.0, 2.0 * (1.0 - TOUCH), 2.0, pieces // 3, pieces - pieces // 3, *held)
    assert n == 1
    assert stock.rim[0].tolist() == pytest.approx([max(math.asin(-0.2), -math.pi / 6.0), math.pi / 6.0], abs=1e-8)
