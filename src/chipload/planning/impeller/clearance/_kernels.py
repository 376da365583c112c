"""Compiled: distance of the check points from a cutter with neck, shank and holder.

Notation: h [mm] height of a point above the centres of the corner, d its distance from the cutter's axis; ``stages``
(k, 2) height where a cylinder begins and its radius, the first row the cutting part, which has the corner of radius r
about the circle of radius rho below. A stage ends where the next begins, the last has no end.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def distance(h: float, d: float, rho: float, r: float, stages: Any) -> float:
    """Distance of a point from the cutter, below 0 inside by at least so much."""
    k = len(stages)
    top = stages[1, 0] if k > 1 else math.inf
    if h <= 0.0:
        best = math.sqrt(max(d - rho, 0.0) ** 2 + h * h) - r if d > rho else -h - r
    elif h <= top:
        best = d - rho - r
    else:
        best = math.sqrt(max(d - rho - r, 0.0) ** 2 + (h - top) ** 2)
    for j in range(1, k):
        low = stages[j, 0]
        high = stages[j + 1, 0] if j + 1 < k else math.inf
        out, away = d - stages[j, 1], max(low - h, h - high)
        inside = out <= 0.0 and away <= 0.0
        best = min(best, max(out, away) if inside else math.sqrt(max(out, 0.0) ** 2 + max(away, 0.0) ** 2))
    return best


@njit(cache=True, nogil=True)
def nearest(
    points: Any, nodes: Any, spans: Any, leaves: int, tips: Any, axes: Any, rho: float, r: float, stages: Any,
    cap: float, out: Any, which: Any,
) -> None:  # fmt: skip
    """Distance ``out`` (n,) of the nearest point from the cutter at each pose, at most ``cap``, and ``which``."""
    stack = np.empty(64, dtype=np.int64)
    for i in range(len(tips)):
        ax, ay, az = axes[i, 0], axes[i, 1], axes[i, 2]
        cx, cy, cz = tips[i, 0] + r * ax, tips[i, 1] + r * ay, tips[i, 2] + r * az
        best, who = cap, -1
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            k = stack[top]
            R = nodes[k, 3]
            if R < 0.0:
                continue
            x, y, z = nodes[k, 0] - cx, nodes[k, 1] - cy, nodes[k, 2] - cz
            h = x * ax + y * ay + z * az
            d = math.sqrt(max(x * x + y * y + z * z - h * h, 0.0))
            if distance(h, d, rho, r, stages) - R >= best:
                continue
            if k < leaves:
                stack[top], stack[top + 1] = 2 * k + 1, 2 * k + 2
                top += 2
                continue
            for j in range(spans[k, 0], spans[k, 1]):
                x, y, z = points[j, 0] - cx, points[j, 1] - cy, points[j, 2] - cz
                h = x * ax + y * ay + z * az
                d = math.sqrt(max(x * x + y * y + z * z - h * h, 0.0))
                one = distance(h, d, rho, r, stages)
                if one < best:
                    best, who = one, j
        out[i], which[i] = best, who
