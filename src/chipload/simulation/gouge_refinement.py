"""Gouges between the points of a part: points that stand closer where the tool goes, and a bound of what is between.

Notation: s the longest side of a triangle of the part, q = s / sqrt(3) the greatest distance of a place in it from its
nearest corner, R the radius of the bottom or of the ball of the least cutter. The distance from the tool changes by no
more than q over q, so that a triangle whose corners are all farther from the tool than q is not gouged. Other triangles
are divided until the bound is small enough.

Bound: a gouge of the depth D is deepest at a place P. If the tool reaches there with a circle of the radius R (its
flank, its ball, or a bottom as wide), a corner of the triangle of P is at least D - e deep in it, where
e = R - sqrt(R^2 - q^2): the depth falls from P as a circle does. A groove that is narrower than 2 q, by the corner or
the point of a cutter alone, may be missed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.simulation.clearance.body import cutting_part
from chipload.simulation.clearance.clearance import LeastDistance
from chipload.simulation.steps import Steps, blocks_of
from chipload.simulation.surface import Difference

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: the bound is made at most this share of the limit
SHARE = 0.25
#: points that are added at most, and how much shorter the sides become in one pass over the steps
MOST, SHORTER = 400_000, 4.0


def gouge_radius(cutters: Mapping[int, Cutter]) -> float:
    """R [mm] of the cutters: the least over them of the greater of corner radius and radius of the bottom.

    >>> gouge_radius({1: Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=1.0)})
    4.0
    """
    return min(max(c.corner_radius, c.radius - c.corner_radius) for c in cutters.values())


def hidden_gouge(spacing: float, radius: float) -> float:
    """Depth e [mm] by which a gouge may be deeper than at any corner of triangles of the side ``spacing`` [mm].

    >>> round(hidden_gouge(0.87, 5.0), 3), round(hidden_gouge(60.0, 5.0), 1)
    (0.025, 34.6)
    """
    q = spacing / math.sqrt(3.0)
    return q if q >= radius else radius - math.sqrt(radius**2 - q**2)


def spacing_for(depth: float, radius: float) -> float:
    """Side of triangles [mm] between whose corners no more than ``depth`` [mm] is hidden."""
    depth = min(depth, radius)
    return math.sqrt(3.0 * (2.0 * radius - depth) * depth)


def refine_gouges(
    left: Difference, steps: Steps | Iterable[Steps], cutters: Mapping[int, Cutter], tolerance: float, limit: float
) -> Difference:
    """Return the difference with more points where a gouge of ``limit`` [mm] may lie between those that it has.

    Parameters
    ----------
    steps : those of the difference, gone through again for each division
    tolerance : of the path [mm]
    """
    radius = gouge_radius(cutters)
    goal = spacing_for(SHARE * limit, radius)
    bodies = {n: cutting_part(c) for n, c in cutters.items()}
    points, faces = left.points, left.faces
    # what is beyond the search range is at least as far as that
    distance, step, deepest = np.minimum(left.distance, left.search_range), left.step, left.deepest
    began, reach = len(points), float(_sides(points, faces).max(initial=0.0)) / math.sqrt(3.0)
    if reach > left.search_range:
        farther = LeastDistance(bodies, points, reach, tolerance)
        for block in blocks_of(steps):
            farther.take(block)
        distance = np.minimum(farther.distance, reach)
    while True:
        long = _sides(points, faces).max(axis=1)
        near = distance[faces].min(axis=1) < long / math.sqrt(3.0)
        coarse = near & (long > goal)
        if not coarse.any() or len(points) - began >= MOST:
            break
        target = max(goal, float(long[coarse].max()) / SHORTER)
        count = len(points)
        kept = faces[~coarse]
        points, some = _divide_triangles(points, faces[coarse], target, began + MOST)
        faces = np.vstack([kept, some])
        lower = LeastDistance(bodies, points[count:], max(target, tolerance), tolerance)
        own = [lower.take(block) for block in blocks_of(steps)]
        distance = np.append(distance, np.minimum(lower.distance, lower.far))
        step = np.append(step, lower.step)
        deepest = np.minimum(deepest, np.concatenate(own))
    spacing = float(long[near].max(initial=0.0))
    between = (points[began:], distance[began:], step[began:])
    return replace(left, deepest=deepest, between=between, hidden=hidden_gouge(spacing, radius), spacing=spacing)


def _sides(points: Floats, faces: Ints) -> Floats:
    """(f, 3) lengths of the sides of triangles, the k-th from corner k to the next."""
    corners = points[faces]
    return np.asarray(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2))


def _divide_triangles(points: Floats, faces: Ints, target: float, most: int) -> tuple[Floats, Ints]:
    """Points and triangles after halving of the longest side of each triangle until it is at most ``target`` [mm]."""
    done = list[Ints]()
    while len(faces) and len(points) < most:
        sides = _sides(points, faces)
        k = sides.argmax(axis=1)
        long = sides.max(axis=1) > target
        done.append(faces[~long])
        faces, k = faces[long], k[long]
        if not len(faces):
            break
        row = np.arange(len(faces))
        a, b, c = faces[row, k], faces[row, (k + 1) % 3], faces[row, (k + 2) % 3]
        edges, at = np.unique(np.sort(np.stack([a, b], axis=1), axis=1), axis=0, return_inverse=True)
        middle = len(points) + at.ravel()
        points = np.vstack([points, 0.5 * (points[edges[:, 0]] + points[edges[:, 1]])])
        faces = np.vstack([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return points, np.vstack([*done, faces])
