"""Plane areas as rings of points for the compiled loops, and their conversion from and to polygons.

Notation: rings as in :mod:`chipload.stock._clip`: not closed by repeating a point, the area on their left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from chipload.stock.tile_grid import polygons

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shapes = NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class PlaneAreas:
    """Plane areas, each bounded by rings.

    Parameters
    ----------
    points : (n, 2) float [mm]
    rings : (k, 2) int, first point and number of points of each ring, in the order of the points
    first : (a, 2) int, first ring of each area, and the ring after its last
    """

    points: Floats
    rings: Ints
    first: Ints

    def __len__(self) -> int:
        return len(self.first)

    @cached_property
    def boxes(self) -> Floats:
        """(a, 4) float [mm]: least x and y, greatest x and y; 0 for an area without rings."""
        out = np.zeros((len(self), 4))
        if not len(self.rings):
            return out
        start = self.rings[:, 0]
        each = np.hstack([np.minimum.reduceat(self.points, start), np.maximum.reduceat(self.points, start)])
        one = self.first[:, 1] - self.first[:, 0] == 1
        out[one] = each[self.first[one, 0]]
        for k in np.flatnonzero(self.first[:, 1] - self.first[:, 0] > 1).tolist():
            some = each[slice(*self.first[k])]
            out[k] = [*some[:, :2].min(axis=0), *some[:, 2:].max(axis=0)]
        return out

    def polygon(self, k: int) -> Polygon | MultiPolygon:
        """Return an area as a polygon or a multipolygon."""
        return polygon_of([self.points[a : a + n] for a, n in self.rings[slice(*self.first[k])].tolist()])


def areas_of(shapes: Sequence[shapely.Geometry] | Shapes) -> PlaneAreas:
    """Return polygons as areas.

    >>> areas = areas_of([shapely.box(0.0, 0.0, 2.0, 1.0), shapely.Polygon()])
    >>> areas.first.tolist(), areas.boxes[0].tolist()
    ([[0, 1], [1, 1]], [0.0, 0.0, 2.0, 1.0])
    """
    geometries = np.empty(len(shapes), dtype=object)
    geometries[:] = list(shapes)
    parts, of = shapely.get_parts(geometries, return_index=True)
    lines, part = shapely.get_rings(parts, return_index=True)
    points, line = shapely.get_coordinates(lines, return_index=True)
    count = np.bincount(line, minlength=len(lines)).astype(np.int64)
    end = np.cumsum(count)
    start = end - count
    # the first ring of a polygon is the outer one
    outer = np.diff(part, prepend=-1) > 0
    back = np.flatnonzero(shapely.is_ccw(lines) != outer)
    for k in back.tolist():
        points[start[k] : end[k]] = points[start[k] : end[k]][::-1]
    keep = np.ones(len(points), dtype=np.bool_)
    keep[end - 1] = False
    number = np.arange(len(lines), dtype=np.int64)
    rings = np.column_stack([start - number, count - 1])
    rings_of = np.bincount(of[part], minlength=len(geometries)).astype(np.int64)
    last = np.cumsum(rings_of)
    return PlaneAreas(np.ascontiguousarray(points[keep]), rings, np.column_stack([last - rings_of, last]))


def polygon_of(rings: Sequence[Floats]) -> Polygon | MultiPolygon:
    """Return the polygon or multipolygon that rings bound; rings that touch themselves are split to make it valid."""
    made = [Polygon(r) for r in rings]
    area = [signed_area(r) for r in rings]
    outer: list[tuple[Polygon, list[Floats]]] = [(p, []) for p, a in zip(made, area, strict=True) if a > 0.0]
    for r, a in zip(rings, area, strict=True):
        if a > 0.0 or not outer:
            continue
        # rings may touch: not every point of a hole need lie inside the outer ring
        inside = shapely.points(r)
        around = [o for o in outer if o[0].area >= -a] or outer
        points_inside = [int(shapely.contains(o[0], inside).sum()) if len(around) > 1 else 1 for o in around]
        most = max(points_inside)
        owners = (o for o, n in zip(around, points_inside, strict=True) if n == most)
        min(owners, key=lambda o: float(o[0].area))[1].append(r)
    parts = [Polygon(p.exterior, holes) for p, holes in outer]
    whole = parts[0] if len(parts) == 1 else MultiPolygon(parts)
    return whole if shapely.is_valid(whole) else valid_of(made, area)


def valid_of(rings: Sequence[Polygon], area: Sequence[float]) -> Polygon | MultiPolygon:
    """Return the area of rings that touch or cross themselves: outer rings minus holes, each made valid."""
    good = [_even_odd(p) for p in rings]
    outer = shapely.union_all([p for p, a in zip(good, area, strict=True) if a > 0.0])
    holes = shapely.union_all([p for p, a in zip(good, area, strict=True) if a <= 0.0])
    parts = polygons(shapely.difference(outer, holes))
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def _even_odd(ring: Polygon) -> MultiPolygon:
    if shapely.is_valid(ring):
        return MultiPolygon([ring])
    made = shapely.make_valid(ring)
    return MultiPolygon([p for part in shapely.get_parts(made) for p in polygons(part)])


def signed_area(ring: Floats) -> float:
    """Return the area of a ring [mm^2], above 0 if it goes counter-clockwise."""
    x, y = (ring - ring[0]).T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
