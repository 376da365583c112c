"""Outlines of what was swept at a height, by a net over the plan: its nodes, the rings through it, their area."""

from __future__ import annotations

import itertools
import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon

from chipload.lazy import LateModule
from chipload.stock.tile_grid import polygons

_outline = LateModule("chipload.engagement.moves._outline")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: most nodes of the net
NODES = 1_000_000


def nodes_of(low: Floats, high: Floats, side: float, radius: float, tolerance: float) -> tuple[Floats, Floats]:
    """Nodes in x and y over a box and one beside it all round.

    Parameters
    ----------
    low, high : (3,) float [mm], of the box
    side : most that two nodes are apart [mm]
    radius, tolerance : chords of a circle of that radius stay within the tolerance [mm], unless there would be more
        than ``NODES`` nodes
    """
    size = high[:2] - low[:2]
    pitch = max(min(side, math.sqrt(8.0 * tolerance * radius)), math.sqrt(size[0] * size[1] / NODES))
    axes = []
    for a, b in zip(low[:2], high[:2], strict=True):
        inner = np.linspace(a, b, max(math.ceil((b - a) / pitch), 1) + 1)
        axes.append(np.concatenate([[a - pitch], inner, [b + pitch]]))
    return axes[0], axes[1]


def rings(inside: NDArray[np.bool_]) -> tuple[Ints, Ints]:
    """Sides of the net that the rings around the marked nodes cross, and where each ring begins; the end last."""
    onward, room = np.empty(2 * inside.size, dtype=np.int64), 4096
    while True:
        sides, first = np.empty(room, dtype=np.int64), np.zeros(room, dtype=np.int64)
        count = int(_outline.trace_rings(inside, onward, sides, first))
        if count >= 0:
            return sides[: first[count]], first[: count + 1]
        room *= 4


def area_of(points: Floats, first: Ints, tolerance: float) -> MultiPolygon:
    """The area within rings of points (n, 2), made simpler by the tolerance [mm]."""
    lines = [np.vstack([points[a:b], points[a : a + 1]]) for a, b in itertools.pairwise(first.tolist())]
    area = shapely.build_area(shapely.GeometryCollection([shapely.LinearRing(line) for line in lines]))
    return MultiPolygon(polygons(shapely.make_valid(shapely.simplify(area, tolerance))))
