"""Middle lines of a region: places with two or more nearest places of the walls, and the branches between them.

Notation: **clearance** [mm] the distance of a place from the walls. The lines are edges of the Voronoi diagram of
places on the walls. They lie near the true middle, within the spacing of these places, so their clearance is always
calculated again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.contour import Region
from chipload.geometry.distance import distance
from chipload.lazy import scipy

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: least distance of the two places of the walls that an edge lies between, over its clearance: 41 deg between them
APART = 0.7


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Places (n, 2) [mm], clearances (n,) [mm], and pairs (m, 2) of places that an edge joins."""

    points: Floats
    clearance: Floats
    edges: Ints

    def branches(self, start: int) -> list[Floats]:
        """Polylines (k, 2) that run along all edges which can be reached from a place, each once, the widest first.

        A polyline begins at a place of one before it (the first at ``start``) and ends at a place of one before it or
        where no edge continues.
        """
        near: dict[int, list[int]] = {}
        for a, b in self.edges.tolist():
            near.setdefault(a, []).append(b)
            near.setdefault(b, []).append(a)
        for others in near.values():
            others.sort(key=lambda k: (self.clearance[k], k))
        seen, run, out, open_ = {start}, set[tuple[int, int]](), [], [start]
        while open_:
            at = open_[-1]
            line = [at]
            while True:
                ahead = [k for k in near.get(at, []) if (min(at, k), max(at, k)) not in run]
                if not ahead:
                    break
                k = ahead[-1]
                run.add((min(at, k), max(at, k)))
                line.append(k)
                if k in seen:
                    break
                seen.add(k)
                open_.append(k)
                at = k
            if len(line) > 1:
                out.append(self.points[line])
            else:
                open_.pop()
        return out


def skeleton_of(region: Region, least: float, spacing: float) -> Skeleton:
    """The middle lines of a region with a clearance of at least ``least`` [mm], from wall places ``spacing`` apart.

    Examples
    --------
    The middle of a slot 20 mm long and 4 mm wide is a line of 16 mm, where the clearance is 2 mm.

    >>> from chipload.geometry.contour import Contour
    >>> slot = Region.of([Contour.polyline([[0, 0], [20, 0], [20, 4], [0, 4]], closed=True)])
    >>> lines = skeleton_of(slot, 1.99, 0.1)
    >>> lines.points.round(1).min(axis=0).tolist(), lines.points.round(1).max(axis=0).tolist()
    ([2.0, 2.0], [18.0, 2.0])
    """
    places = []
    for contour in region.contours:
        s = np.linspace(0.0, contour.length, max(16, math.ceil(contour.length / spacing)), endpoint=False)
        places.append(contour.at(s)[0])
    walls = np.vstack(places)
    diagram = scipy.spatial.Voronoi(walls)
    pairs = np.array(diagram.ridge_vertices, dtype=np.int64)
    between = np.asarray(diagram.ridge_points, dtype=np.int64)
    bounded = (pairs >= 0).all(axis=1)
    pairs, between = pairs[bounded], between[bounded]
    vertices = np.asarray(diagram.vertices, dtype=np.float64)
    xmin, ymin, xmax, ymax = region.bounds
    beyond = (vertices < (xmin, ymin)) | (vertices > (xmax, ymax))
    within: NDArray[np.bool_] = np.asarray(~beyond.any(axis=1), dtype=np.bool_)
    within[within] = region.contains(vertices[within])
    clearance = np.zeros(len(vertices))
    clearance[within] = distance(region.segments, vertices[within])
    apart = np.hypot(*(walls[between[:, 0]] - walls[between[:, 1]]).T)
    kept = (clearance[pairs] >= least).all(axis=1)
    kept &= apart >= APART * clearance[pairs].max(axis=1)
    used, edges = np.unique(pairs[kept], return_inverse=True)
    return Skeleton(vertices[used], clearance[used], edges.reshape(-1, 2).astype(np.int64))
