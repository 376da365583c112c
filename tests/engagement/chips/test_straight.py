"""What a cutter with a fixed axis covers on a straight way, against points in it."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.section import depth

Floats = NDArray[np.float64]

CUTTERS = {
    "flat": Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5),
    "ball": Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0),
    "bull": Cutter(12.0, 3, 0.4, 20.0, 30.0, 6e5, corner_radius=2.0),
    "taper": Cutter(6.0, 3, 0.5, 20.0, 30.0, 6e5, corner_radius=1.0, taper=math.radians(5.0)),
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


@pytest.mark.parametrize("name", ["ball", "bull", "taper"])
def test_a_point_is_covered_where_it_is_in_the_cutter_at_some_time(name: str) -> None:
    """Random points, but for those nearer to the outline than the tolerance, and the time between two instants.

    A flat or pointed cutter is left out: straight up and down its loops leave out 1 % of a layer.
    """
    cutter, rng, seen = CUTTERS[name], np.random.default_rng(3), 0
    times, points = np.linspace(0.0, 1.0, 121), rng.uniform(-12.0, 12.0, (1500, 2))
    for p, v, a in ways(11, 12):
        move = Move.lerp(p, a, p + v, a)
        heights = rng.uniform(-4.0, 16.0, 4)
        found = covered_areas(move, cutter, heights.tolist(), TOLERANCE)
        for k, h in enumerate(heights.tolist()):
            known = np.zeros(len(points), dtype=np.bool_)
            for t in times.tolist():
                known |= depth(move, cutter, h, t, points) <= 0.0
            area = found[k]
            if area is None:
                assert not known.any()
                continue
            shape = shapely.buffer(area.polygon, 0.0)
            wrong = points[shapely.contains_xy(shape, points) != known]
            # the section moves by a 120th of the way, and where it opens by the root of that
            off = shapely.distance(shape.boundary, shapely.points(wrong))
            assert (off <= TOLERANCE + 0.05).all(), (name, h)
            assert (off > TOLERANCE).sum() <= 4
            seen += int(known.sum())
    assert seen > 500


def test_what_a_leaning_cylinder_covers_level_is_its_ellipse_swept() -> None:
    """Between the ends of the flutes: pi R^2 / A_z plus the way times the width of the ellipse across it."""
    cutter, a = CUTTERS["flat"], np.array([0.6, 0.0, 0.8])
    for v, wide in ((np.array([0.0, 7.0, 0.0]), 2.0 * 5.0 / 0.8), (np.array([7.0, 0.0, 0.0]), 10.0)):
        move = Move.lerp([0.0, 0.0, 0.0], a, v, a)
        found = covered_areas(move, cutter, [8.0], 1e-4)[0]
        assert found is not None
        assert found.area == pytest.approx(math.pi * 25.0 / 0.8 + 7.0 * wide, rel=1e-4)
