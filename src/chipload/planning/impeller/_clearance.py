"""Compiled: distance of points from a cutter with neck, shank and holder.

Notation: d [mm] distance of a point from the cutter's axis, h its height above the corner's centre, z its height above
the tip. ``stages`` (k, 2) one row for each cylinder: the height above the corner's centre at which it begins, and its
radius. A cylinder ends where the next begins, the last has no end. Row 0 is the cutting part, whose shape is stated by
rho and r (a corner of radius r about a circle of radius rho) or by the profile of ``_profile.py``.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from chipload.planning.impeller._profile import cutting_part_distance
from chipload.planning.impeller._tree import next_node


@njit(cache=True, nogil=True)
def cylinder_distance(h: float, d: float, low: float, high: float, radius: float) -> float:
    """Distance [mm] of a point from a cylinder about the axis that extends from ``low`` to ``high``.

    Inside the cylinder the value is the depth below its nearest face, negative.
    """
    radial, axial = d - radius, max(low - h, h - high)
    if radial <= 0.0 and axial <= 0.0:
        return max(radial, axial)
    return math.sqrt(max(radial, 0.0) ** 2 + max(axial, 0.0) ** 2)


@njit(cache=True, nogil=True)
def distance(h: float, d: float, rho: float, r: float, stages: Any) -> float:
    """Distance [mm] of a point from a straight cutter; inside it negative, of at most the point's depth."""
    k = len(stages)
    top = stages[1, 0] if k > 1 else math.inf
    if h <= 0.0:
        least = math.sqrt(max(d - rho, 0.0) ** 2 + h * h) - r if d > rho else -h - r
    elif h <= top:
        least = d - rho - r
    else:
        least = math.sqrt(max(d - rho - r, 0.0) ** 2 + (h - top) ** 2)
    for j in range(1, k):
        high = stages[j + 1, 0] if j + 1 < k else math.inf
        least = min(least, cylinder_distance(h, d, stages[j, 0], high, stages[j, 1]))
    return least


@njit(cache=True, nogil=True)
def profile_distance(z: float, d: float, profile: Any, stages: Any) -> float:
    """Distance [mm] of a point from a tapered or barrel cutter; inside it negative, as :func:`distance`."""
    least, k, corner = float(cutting_part_distance(d, z, profile)), len(stages), profile[0]
    for j in range(1, k):
        high = stages[j + 1, 0] + corner if j + 1 < k else math.inf
        least = min(least, cylinder_distance(z, d, stages[j, 0] + corner, high, stages[j, 1]))
    return least


@njit(cache=True, nogil=True)
def nearest(
    points: Any, nodes: Any, spans: Any, leaves: int, tips: Any, axes: Any, rho: float, r: float, stages: Any,
    cap: float, out: Any, which: Any,
) -> None:  # fmt: skip
    """Distance ``out`` (n,) [mm] of the nearest point from a straight cutter at each pose, at most ``cap``, and its
    number ``which`` (n,); -1: no point is nearer than ``cap``.
    """
    for i in range(len(tips)):
        ax, ay, az = axes[i, 0], axes[i, 1], axes[i, 2]
        cx, cy, cz = tips[i, 0] + r * ax, tips[i, 1] + r * ay, tips[i, 2] + r * az
        best, number, node = cap, -1, 0
        while node >= 0:
            enter, R = False, nodes[node, 3]
            if R >= 0.0:
                x, y, z = nodes[node, 0] - cx, nodes[node, 1] - cy, nodes[node, 2] - cz
                h = x * ax + y * ay + z * az
                d = math.sqrt(max(x * x + y * y + z * z - h * h, 0.0))
                enter = distance(h, d, rho, r, stages) - R < best
            if enter and node >= leaves:
                for j in range(spans[node, 0], spans[node, 1]):
                    x, y, z = points[j, 0] - cx, points[j, 1] - cy, points[j, 2] - cz
                    h = x * ax + y * ay + z * az
                    d = math.sqrt(max(x * x + y * y + z * z - h * h, 0.0))
                    own = distance(h, d, rho, r, stages)
                    if own < best:
                        best, number = own, j
            node = next_node(node, leaves, enter)
        out[i], which[i] = best, number


@njit(cache=True, nogil=True)
def nearest_to_profile(
    points: Any, nodes: Any, spans: Any, leaves: int, tips: Any, axes: Any, profile: Any, stages: Any, cap: float,
    out: Any, which: Any,
) -> None:  # fmt: skip
    """As :func:`nearest`, from a tapered or barrel cutter."""
    for i in range(len(tips)):
        ax, ay, az = axes[i, 0], axes[i, 1], axes[i, 2]
        cx, cy, cz = tips[i, 0], tips[i, 1], tips[i, 2]
        best, number, node = cap, -1, 0
        while node >= 0:
            enter, R = False, nodes[node, 3]
            if R >= 0.0:
                x, y, z = nodes[node, 0] - cx, nodes[node, 1] - cy, nodes[node, 2] - cz
                h = x * ax + y * ay + z * az
                d = math.sqrt(max(x * x + y * y + z * z - h * h, 0.0))
                enter = profile_distance(h, d, profile, stages) - R < best
            if enter and node >= leaves:
                for j in range(spans[node, 0], spans[node, 1]):
                    x, y, z = points[j, 0] - cx, points[j, 1] - cy, points[j, 2] - cz
                    h = x * ax + y * ay + z * az
                    d = math.sqrt(max(x * x + y * y + z * z - h * h, 0.0))
                    own = profile_distance(h, d, profile, stages)
                    if own < best:
                        best, number = own, j
            node = next_node(node, leaves, enter)
        out[i], which[i] = best, number
