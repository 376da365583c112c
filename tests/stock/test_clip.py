"""Compiled difference and intersection of areas against GEOS, and the side of a point against fractions."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from chipload.stock import _clip as kernels
from chipload.stock import _crossings as crossings
from chipload.stock._orientation import orient
from chipload.stock.areas import PlaneAreas, areas_of, polygon_of
from chipload.stock.tile_grid import polygons

Floats = NDArray[np.float64]
Make = Callable[[np.random.Generator], tuple[shapely.Geometry, shapely.Geometry]]


class Result:
    """What :func:`kernels.clip` makes of polygons a less c."""

    def __init__(self, a: PlaneAreas, c: PlaneAreas) -> None:
        left, chip = np.empty((20_000, 2)), np.empty((20_000, 2))
        left_rings, chip_rings = np.empty((2000, 2), dtype=np.int64), np.empty((2000, 2), dtype=np.int64)
        some, other = np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64)
        self.areas = np.zeros(3)
        self.status = kernels.clip(
            a.points, a.rings, 0, len(a.rings), c.points, c.rings, 0, len(c.rings), c.boxes[0],
            left, left_rings, some, chip, chip_rings, other, np.empty((4096, 4)), np.empty((4096, 11), dtype=np.int64),
            self.areas,
        )  # fmt: skip
        self.left = even_odd(left, left_rings[: some[1]])
        self.chip = even_odd(chip, chip_rings[: other[1]])


def even_odd(points: Floats, rings: NDArray[np.int64]) -> shapely.Geometry:
    """Union of the outer rings less that of the holes, each taken apart where it touches itself."""
    outer, holes = list[shapely.Geometry](), list[shapely.Geometry]()
    for start, count in rings.tolist():
        ring = np.ascontiguousarray(points[start : start + count])
        made = shapely.make_valid(shapely.Polygon(ring))
        flat = [p for part in shapely.get_parts(made) for p in polygons(part)]
        (outer if kernels.ring_size(ring, 0, count)[0] > 0.0 else holes).extend(flat)
    return shapely.difference(shapely.union_all(outer), shapely.union_all(holes))


def plate(rng: np.random.Generator) -> shapely.Geometry:
    """Some discs joined, some of them holes."""
    out = shapely.Polygon()
    for _ in range(rng.integers(1, 5)):
        disc = shapely.Point(*rng.uniform(0.0, 10.0, 2)).buffer(rng.uniform(0.5, 4.0), int(rng.integers(1, 8)))
        out = out.union(disc) if rng.random() < 0.7 else out.difference(disc)
    return out


def capsule(rng: np.random.Generator) -> shapely.Geometry:
    a, b = (shapely.Point(*rng.uniform(0.0, 10.0, 2)).buffer(2.0, 6) for _ in range(2))
    return a.union(b).convex_hull


def random(rng: np.random.Generator) -> tuple[shapely.Geometry, shapely.Geometry]:
    return plate(rng), plate(rng)


def on_grid(rng: np.random.Generator) -> tuple[shapely.Geometry, shapely.Geometry]:
    """Vertices on edges, edges along edges, vertices on vertices."""
    a, c = (shapely.transform(plate(rng), lambda xy: np.round(2.0 * xy) / 2.0) for _ in range(2))
    return shapely.buffer(a, 0.0), shapely.buffer(c, 0.0)


def again(rng: np.random.Generator) -> tuple[shapely.Geometry, shapely.Geometry]:
    """A capsule out of what is left after it."""
    c = capsule(rng)
    left = plate(rng).difference(c)
    return (left if rng.random() < 0.5 else left.union(c.intersection(shapely.box(0.0, 0.0, 5.0, 5.0)))), c


def next_step(rng: np.random.Generator) -> tuple[shapely.Geometry, shapely.Geometry]:
    """Steps in line: sides along sides, the end of one in the other."""
    (x, y), way, turn = rng.uniform(2.0, 8.0, 2), rng.uniform(0.5, 3.0), rng.choice([0.0, rng.uniform(0.0, 6.0)])
    d = way * np.array([np.cos(turn), np.sin(turn)])
    ends = [shapely.Point(x + k * d[0], y + k * d[1]).buffer(1.5, 7) for k in range(3)]
    first, then = (ends[k].union(ends[k + 1]).convex_hull for k in range(2))
    return shapely.box(0.0, 0.0, 10.0, 10.0).difference(first), then


@pytest.mark.parametrize("make", [random, on_grid, again, next_step])
def test_difference_and_intersection_are_those_of_geos(make: Make) -> None:
    rng = np.random.default_rng(7)
    cut = apart = 0
    for n in range(500):
        a, c = make(rng)
        kinds = ("Polygon", "MultiPolygon")
        if a.is_empty or c.is_empty or a.geom_type not in kinds or c.geom_type not in kinds:
            continue
        found = Result(areas_of([a]), areas_of([c]))
        left, chip = a.difference(c), a.intersection(c)
        assert found.status in (kernels.CUT, kernels.APART), n
        if found.status == kernels.APART:
            assert chip.area < 1e-9, n
            apart += 1
            continue
        cut += 1
        assert found.areas == pytest.approx([a.area, left.area, chip.area], abs=1e-9), n
        assert found.left.symmetric_difference(left).area < 1e-9, n
        assert found.chip.symmetric_difference(chip).area < 1e-9, n
    assert cut > 100
    assert make is next_step or apart > 20


def test_many_passes_along_one_wall_take_what_the_first_takes() -> None:
    """Sides that coincide but for rounding: later passes take nothing, and the ring does not grow."""
    rng = np.random.default_rng(3)
    for _ in range(40):
        turn, start = rng.uniform(0.0, 6.0), rng.uniform(3.0, 7.0, 2)
        d = np.array([np.cos(turn), np.sin(turn)])
        left = shapely.box(0.0, 0.0, 10.0, 10.0)
        areas, first = areas_of([left]), 0.0
        for n in range(12):
            s, e = rng.uniform(-8.0, 8.0, 2) if n else (-20.0, 20.0)
            ends = [shapely.Point(*(start + w * d)).buffer(1.0, 8) for w in (s, e)]
            c = areas_of([ends[0].union(ends[1]).convex_hull])
            found = Result(areas, c)
            assert found.status >= 0
            if n == 0:
                first = found.areas[2]
                left = left.difference(c.polygon(0))
            if found.status == kernels.CUT:
                areas = areas_of([found.left])
        assert shapely.area(areas.polygon(0)) == pytest.approx(100.0 - first, abs=1e-9)
        assert areas.polygon(0).symmetric_difference(left).area < 1e-9


def test_an_area_that_crosses_itself_is_not_cut() -> None:
    """A bow tie has edges with its area on the wrong side."""
    bow = PlaneAreas(np.array([(0.0, 0.0), (4.0, 3.0), (4.0, 0.0), (0.0, 3.0)]), np.array([[0, 4]]), np.array([[0, 1]]))
    found = Result(bow, areas_of([shapely.box(-1.0, 1.0, 5.0, 1.4)]))
    assert found.status == crossings.DEGENERATE


def test_the_side_of_a_point_is_exact() -> None:
    """Against fractions: points on a line but for rounding."""
    rng = np.random.default_rng(1)
    zero = small = 0
    for n in range(3000):
        a, b = rng.uniform(-50.0, 50.0, (2, 2))
        c = a + rng.random() * (b - a) if n % 3 else b.copy()
        if n % 2:
            c[0] = np.nextafter(c[0], 100.0)
        (ax, ay), (bx, by), (cx, cy) = ([Fraction(float(x)) for x in p] for p in (a, b, c))
        known = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
        found = orient(*a.tolist(), *b.tolist(), *c.tolist())
        assert (found > 0) - (found < 0) == (known > 0) - (known < 0)
        zero, small = zero + (known == 0), small + (0.0 < abs(found) < 1e-13)
    assert zero > 400
    assert small > 400


def test_a_ring_that_touches_itself_becomes_valid_polygons() -> None:
    """Two squares that meet in a corner, as one ring; a square with a hole at its edge."""
    eight = np.array([(1.0, 1.0), (0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)])
    made = polygon_of([eight])
    assert made.is_valid
    assert made.area == pytest.approx(2.0)
    square = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])
    hole = np.array([(1.0, 0.0), (1.0, 2.0), (3.0, 2.0), (3.0, 0.0)])
    made = polygon_of([square, hole])
    assert made.is_valid
    assert made.area == pytest.approx(12.0)
