"""Outlines of what a cutter with a fixed axis covers on a straight way: against points in it, and general loops."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.covered import covered_areas, covered_rings
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.section import cutter_numbers, depth

Floats = NDArray[np.float64]

CUTTERS = {
    "flat": Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5),
    "ball": Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0),
    "bull": Cutter(12.0, 3, 0.4, 20.0, 30.0, 6e5, corner_radius=2.0),
    "taper": Cutter(6.0, 3, 0.5, 20.0, 30.0, 6e5, corner_radius=1.0, taper=math.radians(5.0)),
    "point": Cutter(10.0, 3, 0.5, 20.0, 30.0, 6e5, bottom=math.radians(20.0)),
    "short": Cutter(10.0, 2, 0.5, 3.0, 30.0, 6e5, corner_radius=5.0),
}
TOLERANCE = 0.01


def ways(seed: int, count: int) -> list[tuple[Floats, Floats, Floats]]:
    """Starts, ways and axes; some level, some along the axis, some straight up and down."""
    rng = np.random.default_rng(seed)
    out = []
    for n in range(count):
        a = np.array([*rng.uniform(-0.5, 0.5, 2), 1.0])
        a = a / np.linalg.norm(a)
        p, v = rng.uniform(-3.0, 3.0, (2, 3))
        if n % 4 == 1:
            v[2] = 0.0
        if n % 4 == 2:
            v = a * rng.uniform(-3.0, 3.0)
        if n % 8 == 3:
            v[:2] = 0.0
        out.append((p, v, a))
    return out


@pytest.mark.parametrize("name", CUTTERS)
def test_a_point_is_covered_where_it_is_in_the_cutter_at_some_time(name: str) -> None:
    """Random points, but for those nearer to the outline than the tolerance, and the time between two instants."""
    cutter, rng, seen = CUTTERS[name], np.random.default_rng(3), 0
    times, points = np.linspace(0.0, 1.0, 121), rng.uniform(-12.0, 12.0, (1500, 2))
    for p, v, a in ways(11, 12):
        move = Move.lerp(p, a, p + v, a)
        heights = rng.uniform(-4.0, 16.0, 4)
        found = covered_rings([move], np.array(cutter_numbers(cutter)), [heights], TOLERANCE)
        for k, h in enumerate(heights.tolist()):
            known = np.zeros(len(points), dtype=np.bool_)
            for t in times.tolist():
                known |= depth(move, cutter, h, t, points) <= 0.0
            if found.first[k, 1] == found.first[k, 0]:
                assert not known.any()
                continue
            shape = found.polygon(k)
            assert shape.is_valid
            wrong = points[shapely.contains_xy(shape, points) != known]
            # the section moves by a 120th of the way, and where it opens by the root of that
            off = shapely.distance(shape.boundary, shapely.points(wrong))
            assert (off <= TOLERANCE + 0.05).all(), (name, h)
            assert (off > TOLERANCE).sum() <= 4
            seen += int(known.sum())
    assert seen > 500


@pytest.mark.parametrize("name", ["flat", "ball", "bull", "taper"])
def test_outlines_are_those_of_general_loops(name: str) -> None:
    """Both within the tolerance of the truth, so that their areas are within it times the length of the outline.

    Straight up and down a flat cutter is left out: there general loops leave out 1 % of a layer, as points show.
    """
    cutter, compared = CUTTERS[name], 0
    for p, v, a in [way for n, way in enumerate(ways(5, 16)) if name != "flat" or n % 8 != 3]:
        move, heights = Move.lerp(p, a, p + v, a), np.linspace(-4.0, 16.0, 13)
        found = covered_rings([move], np.array(cutter_numbers(cutter)), [heights], TOLERANCE)
        for k, area in enumerate(covered_areas(move, cutter, heights.tolist(), TOLERANCE)):
            if area is None:
                assert found.first[k, 1] == found.first[k, 0]
                continue
            some, other = found.polygon(k), area.polygon
            assert some.symmetric_difference(other.buffer(0.0)).area <= TOLERANCE * other.length
            assert some.area <= area.area + 1e-6
            assert some.convex_hull.area == pytest.approx(some.area, abs=1e-6)
            compared += 1
    assert compared > 60


def test_what_a_leaning_cylinder_covers_level_is_its_ellipse_swept() -> None:
    """Between the ends of the flutes: pi R^2 / A_z plus the way times the width of the ellipse across it."""
    cutter, a = CUTTERS["flat"], np.array([0.6, 0.0, 0.8])
    for v, wide in ((np.array([0.0, 7.0, 0.0]), 2.0 * 5.0 / 0.8), (np.array([7.0, 0.0, 0.0]), 10.0)):
        move = Move.lerp([0.0, 0.0, 0.0], a, v, a)
        found = covered_rings([move], np.array(cutter_numbers(cutter)), [np.array([8.0])], 1e-4)
        assert found.polygon(0).area == pytest.approx(math.pi * 25.0 / 0.8 + 7.0 * wide, rel=1e-4)


def test_no_point_of_a_finer_general_loop_is_further_out_than_the_tolerance() -> None:
    """Each loop of a tolerance of 1e-4 mm lies within the outline of 0.1 mm and its tolerance; some come near it."""
    cutter, most = CUTTERS["ball"], 0.0
    for p, v, a in ways(5, 8):
        move, heights = Move.lerp(p, a, p + v, a), np.linspace(-2.0, 16.0, 7)
        found = covered_rings([move], np.array(cutter_numbers(cutter)), [heights], 0.1)
        for k, area in enumerate(covered_areas(move, cutter, heights.tolist(), 1e-4)):
            if area is not None:
                off = shapely.distance(found.polygon(k), shapely.points(area.rings[0].points))
                most = max(most, float(off.max()))
    assert 0.08 < most <= 0.1


def test_a_finer_tolerance_has_more_points_and_fourth_of_the_error() -> None:
    cutter, (p, v, a) = CUTTERS["bull"], ways(11, 1)[0]
    move, heights = Move.lerp(p, a, p + v, a), np.array([3.0])
    area = [
        covered_rings([move], np.array(cutter_numbers(cutter)), [heights], tol).polygon(0).area
        for tol in (0.04, 0.0004, 1e-6)
    ]
    assert area[0] < area[1] < area[2]
    assert (area[2] - area[1]) < 0.03 * (area[2] - area[0])
