"""Material that a path leaves of the reachable region: area, contours and places.

Notation: R [mm] cutter radius. The swept area is the union of the path's buffers (shapely); its arcs are polygons whose
corners lie on the circle, so it is less than the true area by at most 2e-5 R. While a pocket is planned, the cells that
the stock knows to be wholly cleared are removed as squares, and buffers only of the path near the other cells;
:func:`leftover` does not use a stock.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.geometry.contour import Contour, Region
from chipload.stock.planar import PlanarStock

Floats = NDArray[np.float64]
Place = tuple[float, float, float]

#: corners of a buffer in a quarter turn
CORNERS = 128
#: path points in one buffer, and the angle [rad] by which its line turns, at most
CHUNK, TURNS = 128, 4.0
#: pieces narrower than this part of R are the polygons' own and count only in the area
NARROW = 2e-3
#: most pieces that are reported one by one
MOST = 20
#: side / R of a square of material beyond which another entry is worth it
WORTH = 0.5


def swept(points: Floats, breaks: NDArray[np.bool_], radius: float) -> shapely.Geometry:
    """Union of the discs of ``radius`` [mm] along the polyline ``points`` (n, 2); no leg leads to a true break.

    A buffer of a line that turns much costs the square of its vertices, many short lines cost the ends of their
    buffers: a line is buffered in parts that turn by at most ``TURNS``.
    """
    edge = np.diff(points, axis=0, prepend=points[:1])
    turn = np.diff(np.arctan2(edge[:, 1], edge[:, 0]), prepend=0.0)
    turned = np.cumsum(np.abs(turn - 2.0 * np.pi * np.round(turn / (2.0 * np.pi))))
    parts = np.floor(turned / TURNS)
    begins = np.flatnonzero(breaks | np.append(True, parts[1:] != parts[:-1]))
    run = np.append(np.flatnonzero(breaks)[1:], len(points))[np.cumsum(breaks)[begins] - 1]  # end of its run
    lines = []
    for a, b, end in zip(begins, np.append(begins[1:], len(points)), run, strict=True):
        for k in range(a, b, CHUNK):
            p = points[k : min(k + CHUNK + 1, b + 1, end)]
            lines.append(shapely.linestrings(p) if len(p) > 1 else shapely.points(p[0]))
    return shapely.union_all(shapely.buffer(np.array(lines), radius, quad_segs=CORNERS))


def cleared_squares(stock: PlanarStock) -> shapely.Geometry:
    """Union of the cells of a stock that are wholly cleared."""
    x0, y0, h = stock.grid[:3].tolist()
    nx, ny = int(stock.grid[3]), int(stock.grid[4])
    empty = np.zeros((ny, nx + 2), dtype=np.int8)
    empty[:, 1:-1] = stock.cleared().reshape(ny, nx)
    change = np.diff(empty, axis=1)
    (row, begin), (_, end) = np.nonzero(change == 1), np.nonzero(change == -1)
    boxes = shapely.box(x0 + begin * h, y0 + row * h, x0 + end * h, y0 + (row + 1) * h)
    return shapely.union_all(boxes)


def near_partly_cleared(
    stock: PlanarStock, points: Floats, breaks: NDArray[np.bool_]
) -> tuple[Floats, NDArray[np.bool_]]:
    """The legs of a polyline whose discs may reach a cell that is cleared in part, as of :func:`swept`.

    What reaches no such cell lies in cells that are cleared, and a cell that nothing reaches loses nothing.
    """
    x0, y0, h = stock.grid[:3].tolist()
    nx, ny = int(stock.grid[3]), int(stock.grid[4])
    n = math.ceil(stock.radius / h) + 2  # cells that a disc about a place of a cell may reach to either side, and one
    partly = np.zeros((ny + 2 * n + 1, nx + 2 * n + 1), dtype=np.int64)
    partly[n + 1 : n + 1 + ny, n + 1 : n + 1 + nx] = (stock.head >= 0).reshape(ny, nx)
    total = partly.cumsum(axis=0).cumsum(axis=1)
    w = 2 * n + 1
    near = total[w:, w:] - total[:-w, w:] - total[w:, :-w] + total[:-w, :-w] > 0
    before = np.where(breaks[:, None], points, np.vstack([points[:1], points[:-1]]))
    edge = np.hypot(*(points - before).T)
    parts = np.maximum(1, np.ceil(edge / h).astype(np.int64))
    k = np.repeat(np.arange(len(points)), parts)
    share = (np.arange(len(k)) - np.repeat(np.cumsum(parts) - parts, parts) + 1) / parts[k]
    at = before[k] + share[:, None] * (points - before)[k]
    i = np.clip(((at[:, 0] - x0) / h).astype(np.int64), 0, nx - 1)
    j = np.clip(((at[:, 1] - y0) / h).astype(np.int64), 0, ny - 1)
    kept = np.zeros(len(points), dtype=bool)
    np.logical_or.at(kept, k, near[j, i])
    needed = kept | np.append(kept[1:] & ~breaks[1:], False)
    return points[needed], (breaks | ~kept)[needed]


class PocketRemainder:
    """Remaining material of a region, reduced as a path continues; each part of the path is removed once."""

    def __init__(self, reachable: Region, radius: float, free: Sequence[Region] = ()) -> None:
        self.radius = radius
        self.rest: shapely.Geometry = reachable.flatten(1e-5 * radius)
        for region in free:
            self.rest = shapely.difference(self.rest, region.flatten(1e-5 * radius))

    def take(self, points: Floats, breaks: NDArray[np.bool_]) -> None:
        """Remove the area that the discs along a part of the path sweep, as in :func:`swept`."""
        if len(points):
            self.rest = shapely.difference(self.rest, swept(points, breaks, self.radius))

    def take_from(self, stock: PlanarStock, points: Floats, breaks: NDArray[np.bool_]) -> None:
        """Remove the cleared part of a stock: the squares of its cleared cells, and the area that a part of the path
        sweeps near a cell that is cleared in part. All earlier cuts must have been removed in the same manner.
        """
        if len(points):
            self.rest = shapely.difference(self.rest, cleared_squares(stock))
            self.take(*near_partly_cleared(stock, points, breaks))

    def parts(self) -> tuple[float, tuple[Contour, ...], list[tuple[float, tuple[float, float]]]]:
        """Area [mm^2] left, contours of the pieces other than films, and (area, place) of each, greatest first."""
        solid = [g for g in shapely.get_parts(self.rest) if g.area > 0.0]
        kept = [g for g in solid if not shapely.is_empty(shapely.buffer(g, -0.5 * NARROW * self.radius))]
        kept.sort(key=lambda g: -g.area)
        rings = [ring for g in kept for ring in (g.exterior, *g.interiors)]
        contours = [Contour.polyline(np.asarray(ring.coords)[:-1], closed=True) for ring in rings]
        places = []
        for g in kept[:MOST]:
            p = g.representative_point()
            places.append((float(g.area), (float(p.x), float(p.y))))
        return float(self.rest.area), tuple(contours), places

    def widest(self, allowed: shapely.Geometry) -> Place:
        """Widest place (x, y, room) [mm] of the remaining material where the cutter's centre may go (``allowed``): its
        middle and its distance from where the centre may not go; room 0 where there is none.
        """
        best = (0.0, 0.0, 0.0)
        for piece in shapely.get_parts(shapely.intersection(self.rest, allowed)):
            if piece.area > (WORTH * self.radius) ** 2:
                line = shapely.maximum_inscribed_circle(piece, tolerance=1e-3 * self.radius)
                x, y = shapely.get_coordinates(line)[0]
                width, room = shapely.length(line), shapely.distance(shapely.points(x, y), allowed.boundary)
                if width > best[2]:
                    best = (float(x), float(y), float(min(room, 10.0 * self.radius)))
        return best


def leftover(
    reachable: Region, points: Floats, breaks: NDArray[np.bool_], radius: float
) -> tuple[float, tuple[Contour, ...], list[tuple[float, tuple[float, float]]]]:
    """Remaining material after a whole path: :meth:`PocketRemainder.parts`."""
    rest = PocketRemainder(reachable, radius)
    rest.take(points, breaks)
    return rest.parts()
