"""Region in which the cutter's centre may be, and the region that the cutter reaches from there.

Notation: R [mm] cutter radius. The **centre region** is the region inset by R plus the allowance; what is reachable is
the centre region grown by R: the opening of the region by a disc.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.geometry.contour import Contour, Region
from chipload.geometry.offset import offset_region
from chipload.lazy import LateModule

_pass_steps = LateModule("chipload.planning.pocket._pass_steps")

Floats = NDArray[np.float64]

#: directions of a ramp that are tried, and how much of the free length it takes
DIRECTIONS, WITHIN = 36, 0.98
#: chords leave the arcs of the centre region by at most this part of R, to its inside
CHORD = 1e-5
#: parts that the way between them begins at, one after the other
STARTS = 20


@dataclass(frozen=True, eq=False)
class Reach:
    """The centre region as edges (n, 4) [mm], and its cells for the kernels (see ``_pass_steps``)."""

    edges: Floats
    rows: NDArray[np.int64]
    row_edges: NDArray[np.int64]
    flag: NDArray[np.int8]

    def holds(self, x: float, y: float, grid: Floats) -> bool:
        """Whether the centre may be at a place."""
        return bool(_pass_steps.in_centre_region(x, y, grid, *self.arguments()))

    def arguments(self) -> tuple[NDArray[Any], ...]:
        """Arguments of the kernels."""
        return self.flag, self.edges, self.rows, self.row_edges


def centre_region(region: Region, distance: float) -> Region:
    """The region of the cutter's centre: inset by ``distance`` [mm]; no contour where nothing is left."""
    return offset_region(region, distance)


def inner_points(contour: Contour, chord: float) -> Floats:
    """Vertices (m, 2) [mm] of a polygon inside a closed contour of the centre region: chords where the arc bends around
    the inside, tangents where the inside bends around the arc; at most ``chord`` [mm] off.
    """
    out = []
    for (x0, y0, _, _, xc, yc, sweep), r in zip(contour.segments, contour.radii, strict=True):
        out.append([x0, y0])
        if sweep == 0.0:
            continue
        n = max(2, math.ceil(abs(sweep) / (2.0 * math.acos(1.0 - min(chord / r, 0.5)))))
        a0, d = math.atan2(y0 - yc, x0 - xc), sweep / n
        if sweep > 0.0:
            a = a0 + d * np.arange(1, n)
            rr = r
        else:
            a = a0 + d * (np.arange(n) + 0.5)
            rr = r / math.cos(0.5 * d)
        out.extend(np.column_stack([xc + rr * np.cos(a), yc + rr * np.sin(a)]).tolist())
    return np.array(out)


def reach_of(centres: Region, grid: Floats, chord: float) -> Reach:
    """The centre region laid on the cells of the stock's grid."""
    loops = [inner_points(c, chord) for c in centres.contours]
    edges = np.vstack([np.hstack([p, np.roll(p, -1, axis=0)]) for p in loops])
    y0, h, nx, ny = grid[1], grid[2], int(grid[3]), int(grid[4])
    low = np.floor((np.minimum(edges[:, 1], edges[:, 3]) - y0) / h).astype(np.int64)
    high = np.floor((np.maximum(edges[:, 1], edges[:, 3]) - y0) / h).astype(np.int64)
    row = np.concatenate([np.arange(a, b + 1) for a, b in zip(low, high, strict=True)])
    edge = np.repeat(np.arange(len(edges)), high - low + 1)
    order = np.argsort(row, kind="stable")
    rows = np.searchsorted(row[order], np.arange(ny + 1)).astype(np.int64)
    flag = np.zeros(nx * ny, dtype=np.int8)
    row_edges = edge[order].astype(np.int64)
    _pass_steps.mark(grid, edges, rows, row_edges, flag)
    return Reach(edges, rows, row_edges, flag)


def widest_places(centres: Region, chord: float) -> list[tuple[float, float, float]]:
    """Largest circles (x, y, radius) [mm], one in each separate part of the centre region, in the order of a short path
    between them.
    """
    rings = [shapely.make_valid(shapely.polygons(inner_points(c, chord))) for c in centres.contours]
    outer = [g for g, c in zip(rings, centres.contours, strict=True) if c.area > 0.0]
    holes = [g for g, c in zip(rings, centres.contours, strict=True) if c.area <= 0.0]
    whole = shapely.difference(shapely.union_all(outer), shapely.union_all(holes))
    out = []
    for part in shapely.get_parts(whole):
        if part.area <= 0.0:
            continue
        size = math.sqrt(part.area)
        line = shapely.maximum_inscribed_circle(part, tolerance=1e-4 * size)
        (x, y), _ = shapely.get_coordinates(line)
        radius = float(shapely.distance(shapely.points(x, y), part.boundary))
        out.append((float(x), float(y), radius))
    return [out[k] for k in shortest_order(np.array([p[:2] for p in out]).reshape(-1, 2))]


def shortest_order(points: Floats) -> list[int]:
    """Order in which a short open path visits all points (n, 2): the nearest next, from every first point, each
    improved by reversing parts of it (2-opt) as long as that shortens it; the shortest, of equal ones the first.

    >>> shortest_order(np.array([[0.0, 0.0], [3.0, 0.0], [1.0, 0.0], [2.0, 0.0]]))
    [0, 2, 3, 1]
    """
    n = len(points)
    far = np.hypot(*(points[:, None] - points[None]).T)
    best: tuple[float, list[int]] = (math.inf, [])
    for first in range(min(n, STARTS)):
        order, left = [first], set(range(n)) - {first}
        while left:
            order.append(min(left, key=lambda k: (far[order[-1], k], k)))
            left.remove(order[-1])
        shorter = True
        while shorter:
            shorter = False
            for i in range(n - 1):
                for j in range(i + 1, n):
                    before = (far[order[i - 1], order[i]] if i else 0.0) + (
                        far[order[j], order[j + 1]] if j + 1 < n else 0.0
                    )
                    after = (far[order[i - 1], order[j]] if i else 0.0) + (
                        far[order[i], order[j + 1]] if j + 1 < n else 0.0
                    )
                    if after < before - 1e-9:
                        order[i : j + 1] = order[i : j + 1][::-1]
                        shorter = True
        length = sum(float(far[a, b]) for a, b in pairwise(order))
        if length < best[0] - 1e-9:
            best = (length, order)
    return best[1]


def longest_line(centres: shapely.Geometry, middle: Floats, half: float) -> Floats:
    """Ends (2, 2) [mm] of the longest straight line through ``middle`` inside the centre region, at most ``half`` to
    either side, of ``DIRECTIONS`` even directions.

    >>> longest_line(shapely.box(0.0, 0.0, 9.0, 0.2), np.array([4.0, 0.1]), 3.0).round(6).tolist()
    [[1.06, 0.1], [6.94, 0.1]]
    """
    best, longest = np.vstack([middle, middle]), -1.0
    for angle in np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
        ahead = np.array([np.cos(angle), np.sin(angle)])
        sides = []
        for sign in (-1.0, 1.0):
            inside = shapely.intersection(shapely.linestrings([middle, middle + sign * half * ahead]), centres)
            parts = [part for part in shapely.get_parts(inside) if shapely.dwithin(part, shapely.points(middle), 1e-6)]
            sides.append(sign * WITHIN * max((shapely.length(part) for part in parts), default=0.0))
        if sides[1] - sides[0] > longest:
            longest, best = sides[1] - sides[0], middle + np.array(sides)[:, None] * ahead
    return best
