"""Closed boundaries whose edges know where they come from.

Notation: an edge from P to Q of length L; its curve stands y(s) = L (m0 (s - 2 s^2 + s^3) + m1 (s^3 - s^2)) to the left
of the edge, s in 0 .. 1, m0 and m1 the slopes of the curve against the edge at both ends. Rows of edges (12): P, Q,
theta and t at P, at Q, m0, m1, origin, area between
the curve and the edge, above 0 to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import shapely
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Origin(IntEnum):
    """Origin of a piece of boundary.

    FIRST: leaving edge of the first section; LAST: advancing edge of the last one; GRAZING: envelope of flank and
    corner; CHORD: envelope of the chord that the bottom face, or the top of the flutes, cuts off; CHORD_END: track of
    an end of it; FIRST_CHORD, LAST_CHORD: the chord itself at the first and last instant; STOCK: there before.
    """

    FIRST = 0
    LAST = 1
    GRAZING = 2
    CHORD = 3
    CHORD_END = 4
    FIRST_CHORD = 5
    LAST_CHORD = 6
    STOCK = 7


@dataclass(frozen=True, eq=False)
class Ring:
    """One closed boundary, the area on its left.

    Parameters
    ----------
    points : (m, 2) float [mm], not closed
    origin : (m,) int, :class:`Origin` of the edge from each point to the next
    theta : (m,) float [rad], NaN on old stock
    t : (m,) float, NaN on old stock
    end : (m, 2) float, theta [rad] and t at the end of each edge: where pieces cross it is not the next start
    bulge : (m,) float [mm2], area between each edge and its curve, above 0 to the right of the edge
    """

    points: Floats
    origin: NDArray[np.int64]
    theta: Floats
    t: Floats
    end: Floats
    bulge: Floats

    @property
    def polygon_area(self) -> float:
        """Signed area of the polygon [mm2]; holes below 0."""
        x, y = (self.points - self.points[0]).T
        return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))

    @property
    def area(self) -> float:
        """Signed area within the curves [mm2], of fourth order in the length of the edges."""
        return self.polygon_area + float(self.bulge.sum())


def bulges(edges: Floats, f0: Floats, f1: Floats) -> Floats:
    """Areas between edges (n, 12) and their curves, from the fraction f0 to f1 of each, above 0 to the right.

    >>> float(bulges(np.array([[0, 0, 6, 0, 0, 0, 0, 0, -0.1, 0.1, 0, 0]]), np.zeros(1), np.ones(1))[0].round(9))
    0.6
    """
    L2 = (edges[:, 2] - edges[:, 0]) ** 2 + (edges[:, 3] - edges[:, 1]) ** 2
    m0, m1 = edges[:, 8], edges[:, 9]

    def integral_to(s: Floats) -> Floats:
        return m0 * (s**2 / 2 - 2 * s**3 / 3 + s**4 / 4) + m1 * (s**4 / 4 - s**3 / 3)

    return np.asarray(-L2 * (integral_to(f1) - integral_to(f0)))


def ring_of_edges(edges: Floats) -> Ring:
    """The ring of edges (m, 12) that follow each other."""
    return Ring(edges[:, :2], edges[:, 10].astype(np.int64), edges[:, 4], edges[:, 5], edges[:, 6:8], edges[:, 11])


def rings_of_polygons(area: shapely.Geometry, edges: Floats) -> tuple[Ring, ...]:
    """Rings of a polygon or several, each edge traced to the one of ``edges`` (n, 12) that it lies on.

    Outer rings counter-clockwise, holes clockwise.
    """
    tree = shapely.STRtree(shapely.linestrings(edges[:, :4].reshape(-1, 2, 2)))
    out = []
    for polygon in shapely.get_parts(area):
        if polygon.geom_type != "Polygon" or polygon.is_empty:
            continue
        for k, line in enumerate((polygon.exterior, *polygon.interiors)):
            p = shapely.get_coordinates(line)[:-1]
            p = p if bool(shapely.is_ccw(line)) == (k == 0) else p[::-1]
            out.append(_trace_ring(p, edges, tree))
    return tuple(out)


def _trace_ring(p: Floats, edges: Floats, tree: shapely.STRtree) -> Ring:
    q = np.roll(p, -1, axis=0)
    pairs = tree.query_nearest(shapely.points(0.5 * (p + q)), all_matches=False)
    of = np.empty(len(p), np.int64)
    of[pairs[0]] = pairs[1]
    e = edges[of]
    d = e[:, 2:4] - e[:, :2]
    L2 = (d**2).sum(1)
    f0 = ((p - e[:, :2]) * d).sum(1) / L2
    f1 = ((q - e[:, :2]) * d).sum(1) / L2
    rise = e[:, 6:8] - e[:, 4:6]
    start, end = e[:, 4:6] + f0[:, None] * rise, e[:, 4:6] + f1[:, None] * rise
    return Ring(p, e[:, 10].astype(np.int64), start[:, 0], start[:, 1], end, bulges(e, f0, f1))
