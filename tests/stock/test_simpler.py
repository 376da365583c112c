"""Simplified tiles of a section: what they share on their common border, their distance and their union."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon

from chipload.stock.simpler import simplify_tiles

TOLERANCE = 0.01
#: tiles below and above y = 0
BORDERS = np.array([[-10.0, -10.0, 10.0, 0.0], [-10.0, 0.0, 10.0, 10.0]])


def tiles(shape: Polygon) -> np.ndarray:
    return shapely.intersection(shapely.box(*BORDERS.T), shape)


def section(shape: Polygon) -> tuple[float, Polygon]:
    """Length that both tiles of a shape share once they are simplified, and their union."""
    new = simplify_tiles(tiles(shape), BORDERS, TOLERANCE)
    return shapely.intersection(*new).length, shapely.union_all(new)


def test_a_corner_just_above_the_border_opens_no_slit():
    """By GEOS alone the upper tile loses (4, 0), and its lower edge runs from (4, 0.001) to (-4, 0)."""
    upper = Polygon([(4.0, 0.001), (3.0, 4.0), (-4.0, 4.0), (-4.0, 0.0), (4.0, 0.0)])
    lower = Polygon([(4.0, 0.0), (-4.0, 0.0), (-4.0, -4.0), (4.0, -4.0)])
    alone = shapely.simplify(upper, TOLERANCE)
    assert shapely.intersection(alone, lower).length == 0.0
    new = simplify_tiles(np.array([lower, upper]), BORDERS, TOLERANCE)
    assert shapely.intersection(*new).length == 8.0
    assert shapely.union_all(new).area == pytest.approx(8.0 * 4.0 + 4.0 * 7.5, abs=8.0 * TOLERANCE)


@pytest.mark.parametrize("seed", range(6))
def test_a_jagged_shape_keeps_what_its_tiles_share(seed):
    """Corners at random, many of them within the tolerance of the border, and points between them."""
    random = np.random.default_rng(seed)
    angle = np.sort(random.uniform(0.0, 2.0 * np.pi, 400))
    r = random.uniform(5.0, 5.0 + 1.5 * TOLERANCE, 400)
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle)])
    near = np.abs(points[:, 1]) < 0.2
    points[near, 1] *= 0.05
    shape = Polygon(points)
    assert shape.is_valid
    shared = shapely.intersection(shapely.LineString([(-10.0, 0.0), (10.0, 0.0)]), shape).length
    length, whole = section(shape)
    assert length == pytest.approx(shared, abs=1e-12)
    assert whole.geom_type == "Polygon"
    assert len(whole.interiors) == 0
    assert whole.exterior.hausdorff_distance(shape.exterior) <= 2.0 * TOLERANCE
    assert len(whole.exterior.coords) < 0.7 * len(points)


def test_holes_and_several_parts_remain():
    ring = shapely.Point(0.0, 0.0).buffer(5.0, 256).difference(shapely.Point(0.0, 2.0).buffer(1.0, 64))
    both = shapely.union(ring, shapely.box(7.0, -1.0, 8.0, 1.0))
    length, whole = section(both)
    assert length == pytest.approx(11.0, abs=1e-12)
    assert shapely.area(whole) == pytest.approx(shapely.area(both), abs=32.0 * TOLERANCE)
    assert sorted(len(part.interiors) for part in whole.geoms) == [0, 1]
