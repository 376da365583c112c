"""What is left of the reachable region after a path: area, contours and places, by another method than the stock.

Notation: R [mm] cutter radius. The swept area is the union of the path's buffers (shapely); its arcs are polygons whose
corners lie on the circle, so that it is less than the truth by at most 2e-5 R.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.geometry.contour import Contour, Region

Floats = NDArray[np.float64]
Place = tuple[float, float, float]

#: corners of a buffer in a quarter turn
CORNERS = 128
#: path points in one buffer
CHUNK = 64
#: pieces narrower than this part of R are the polygons' own and count only in the area
NARROW = 2e-3
#: most pieces that are reported one by one
MOST = 20
#: side / R of a square of material beyond which another entry is worth it
WORTH = 0.5


def swept(points: Floats, breaks: NDArray[np.bool_], radius: float) -> shapely.Geometry:
    """Union of the discs of ``radius`` [mm] along the polyline ``points`` (n, 2); no leg leads to a true break."""
    out = []
    at = np.flatnonzero(breaks)
    for a, b in zip(at, np.append(at[1:], len(points)), strict=True):
        for k in range(a, b, CHUNK):
            p = points[k : min(k + CHUNK + 1, b)]
            line = shapely.linestrings(p) if len(p) > 1 else shapely.points(p[0])
            out.append(shapely.buffer(line, radius, quad_segs=CORNERS))
    return shapely.union_all(out)


class PocketRemainder:
    """What is left of a region, less and less of it as a path goes on; each part of the path is taken away once."""

    def __init__(self, reachable: Region, radius: float, free: Sequence[Region] = ()) -> None:
        self.radius = radius
        self.rest: shapely.Geometry = reachable.flatten(1e-5 * radius)
        for region in free:
            self.rest = shapely.difference(self.rest, region.flatten(1e-5 * radius))

    def take(self, points: Floats, breaks: NDArray[np.bool_]) -> None:
        """Take away what the discs along a part of the path sweep, as in :func:`swept`."""
        if len(points):
            self.rest = shapely.difference(self.rest, swept(points, breaks, self.radius))

    def parts(self) -> tuple[float, tuple[Contour, ...], list[tuple[float, tuple[float, float]]]]:
        """Area [mm^2] left, contours of the pieces that are no mere film, and (area, place) of each, greatest first."""
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
        """(x, y, room) [mm]: the middle of the widest place of what is left where the cutter's centre may go
        (``allowed``), and its distance from where it may not; room 0 where there is none.
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
    """:meth:`Remainder.parts` of a whole path at once."""
    rest = PocketRemainder(reachable, radius)
    rest.take(points, breaks)
    return rest.parts()
