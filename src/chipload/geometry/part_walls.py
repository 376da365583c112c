"""Straight walls of a part that is milled from above: thickness, height, length, place.

Notation: an edge of a section runs with the material on its left. A wall lies between two straight edges that run in
opposite directions with material between them. Its foot is the higher of the floors on its two sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.geometry.pocketed_part import LEVEL, Slabs

Floats = NDArray[np.float64]

#: edges [mm] that are shorter are those of facets, and number of edges of a section that are compared
SHORT, MOST = 1.0, 2000
#: least length of a wall over its thickness, and distance from a side at which its floor is looked for [mm]
ASPECT, OFF_SIDE = 2.0, 0.05


@dataclass(frozen=True)
class Wall:
    """A straight wall: thickness, height above its foot and length of its straight part [mm], the ends (2,) of its
    middle line, the heights of its foot and of its top [mm], and whether one of its sides is the outside of the part.
    """

    thickness_mm: float
    height_mm: float
    length_mm: float
    start: tuple[float, float]
    end: tuple[float, float]
    foot_mm: float
    top_mm: float
    outer: bool

    @property
    def slenderness(self) -> float:
        """Height over thickness."""
        return self.height_mm / self.thickness_mm


def find_walls(slabs: Slabs, slenderness: float) -> tuple[Wall, ...]:
    """Straight walls of a part that are more slender than a bound, the most slender first.

    Parameters
    ----------
    slenderness : least height over thickness
    """
    out: list[Wall] = []
    most = float(slabs.levels[-1] - slabs.levels[0]) / slenderness
    for k in range(len(slabs.material) - 1, -1, -1):
        for a, b, thickness, points in _between(slabs.material[k], most):
            if any(_same(wall, a, b, thickness) for wall in out):
                continue
            feet = [_floor_at(slabs, k, point) for point in points]
            foot, top = max(z for z, _ in feet), _top_at(slabs, k, 0.5 * (a + b))
            if (top - foot) < slenderness * thickness * (1.0 - LEVEL):
                continue
            length = float(np.hypot(*(b - a)))
            ends = ((float(a[0]), float(a[1])), (float(b[0]), float(b[1])))
            out.append(Wall(thickness, top - foot, length, *ends, foot, top, any(outside for _, outside in feet)))
    return tuple(sorted(out, key=lambda w: (-w.slenderness, -w.length_mm)))


def _between(section: shapely.Geometry, most: float) -> list[tuple[Floats, Floats, float, tuple[Floats, Floats]]]:
    """Pairs of edges with less than ``most`` [mm] of material between them: ends of the middle line, distance, and a
    point just outside each edge.
    """
    start, end = _edges(section)
    if not len(start):
        return []
    along = end - start
    length = np.hypot(along[:, 0], along[:, 1])
    t = along / length[:, None]
    inward = np.column_stack([-t[:, 1], t[:, 0]])
    i, j = np.nonzero(np.triu((t @ t.T) < -1.0 + LEVEL, 1))
    apart = np.einsum("ij,ij->i", start[j] - start[i], inward[i])
    near = (apart > LEVEL) & (apart < most)
    out = []
    for p, q, d in zip(i[near].tolist(), j[near].tolist(), apart[near].tolist(), strict=True):
        s = np.sort([(end[q] - start[p]) @ t[p], (start[q] - start[p]) @ t[p]])
        low, high = max(0.0, float(s[0])), min(float(length[p]), float(s[1]))
        if high - low < max(ASPECT * d, SHORT):
            continue
        a, b = (start[p] + x * t[p] + 0.5 * d * inward[p] for x in (low, high))
        if section.covers(shapely.linestrings([a, b])):
            off = (0.5 * d + OFF_SIDE) * inward[p]
            middle = 0.5 * (a + b)
            out.append((a, b, float(d), (middle - off, middle + off)))
    return out


def _edges(section: shapely.Geometry) -> tuple[Floats, Floats]:
    """Starts and ends (n, 2) of the straight edges of a section, the material on their left."""
    found: list[Floats] = []
    for polygon in shapely.get_parts(section):
        if polygon.geom_type != "Polygon":
            continue
        turned = shapely.geometry.polygon.orient(polygon)
        for ring in (turned.exterior, *turned.interiors):
            points = shapely.get_coordinates(_straightened(ring))
            found.append(np.column_stack([points[:-1], points[1:]]))
    edges = np.vstack(found) if found else np.zeros((0, 4))
    length = np.hypot(edges[:, 2] - edges[:, 0], edges[:, 3] - edges[:, 1])
    kept = edges[length >= SHORT]
    kept = kept[np.argsort(-length[length >= SHORT], kind="stable")[:MOST]]
    return kept[:, :2], kept[:, 2:]


def _straightened(ring: shapely.LinearRing) -> shapely.Geometry:
    """A ring without the vertices on its straight edges, which begins at a corner."""
    points = shapely.get_coordinates(ring)[:-1]
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    bend = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    corner = int(np.argmax(bend / np.maximum(np.hypot(*before.T) * np.hypot(*after.T), LEVEL)))
    moved = np.roll(points, -corner, axis=0)
    return shapely.LinearRing(np.vstack([moved, moved[:1]])).simplify(LEVEL)


def _floor_at(slabs: Slabs, k: int, point: Floats) -> tuple[float, bool]:
    """Height of the floor beside a slab at a point, and whether the point is outside the part."""
    place = shapely.Point(*point)
    if not slabs.whole.covers(place):
        return float(slabs.levels[0]), True
    j = k
    while j >= 0 and slabs.free[j].covers(place):
        j -= 1
    return float(slabs.levels[j + 1]), False


def _top_at(slabs: Slabs, k: int, point: Floats) -> float:
    """Height up to which the material reaches from a slab at a point."""
    place = shapely.Point(*point)
    while k + 1 < len(slabs.material) and slabs.material[k + 1].covers(place):
        k += 1
    return float(slabs.levels[k + 1])


def _same(wall: Wall, a: Floats, b: Floats, thickness: float) -> bool:
    """Whether a wall lies on the same line, with the same thickness, as one that was found above."""
    if abs(wall.thickness_mm - thickness) > 1e-3 * thickness:
        return False
    line = shapely.LineString([wall.start, wall.end])
    return bool(line.distance(shapely.Point(*(0.5 * (a + b)))) < 1e-3)
