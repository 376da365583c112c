"""Compiled: distance of a point from a tapered or barrel cutter, and the scallop between two lines of its poses.

Notation: ``profile`` (11,) as :func:`~chipload.planning.impeller.profile.profile_numbers`: r, e of the corner, whose
centre lies r above the tip; R, E, F of the flank arc (those of the corner where there is none); sine and cosine of the
angle kappa at which the corner ends, of the taper beta; height and radius of the top. d distance of a point from the
axis, z its height above the tip. The profile is convex: the normals at the ends of its parts tell which part is
nearest.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.planning.impeller._scallop import parabola_minimum

#: distance from a pose that does not exist [mm]
_FAR = 1e9
#: the secant step is used where the distance falls by at least this share of the step along the normal
_FALLS = 0.2


@njit(cache=True, nogil=True)
def cutting_part_distance(d: float, z: float, profile: Any) -> float:
    """Distance [mm] of a point from the cutting part, negative inside.

    Below the top the flank counts as if it had no upper end.
    """
    if z > profile[9]:
        return math.sqrt(max(d - profile[10], 0.0) ** 2 + (z - profile[9]) ** 2)
    r, sb, cb = profile[0], profile[7], profile[8]
    x, y = d - profile[1], z - r
    if x * profile[6] + y * profile[5] <= 0.0:
        return float(-z if x <= 0.0 else math.sqrt(x * x + y * y) - r)
    x, y = d - profile[3], z - profile[4]
    if x * sb + y * cb <= 0.0:
        return float(math.sqrt(x * x + y * y) - profile[2])
    return float(x * cb - y * sb - profile[2])


@njit(cache=True, nogil=True)
def distance(x: float, y: float, z: float, tip: Any, axis: Any, profile: Any) -> float:
    """Distance [mm] of a point from the cutting part at a pose; :data:`_FAR` if the pose is nan."""
    x, y, z = x - tip[0], y - tip[1], z - tip[2]
    h = x * axis[0] + y * axis[1] + z * axis[2]
    if math.isnan(h):
        return _FAR
    return float(cutting_part_distance(math.sqrt(max(x * x + y * y + z * z - h * h, 0.0)), h, profile))


@njit(cache=True, nogil=True)
def excess_at(p: Any, N: Any, tips: Any, axes: Any, i: int, wide: Any, profile: Any) -> float:
    """Excess [mm] along the normal N that the poses of two lines near the station i leave at a point p."""
    n, best, line, pose = tips.shape[1], math.inf, 0, 0
    for m in range(2):
        first, last = max(i - wide[m], 0), min(i + wide[m], n - 1)
        least, at = math.inf, first
        for j in range(first, last + 1):
            D = distance(p[0], p[1], p[2], tips[m, j], axes[m, j], profile)
            if least > D:
                least, at = D, j
        if first < at < last:
            least = parabola_minimum(
                distance(p[0], p[1], p[2], tips[m, at - 1], axes[m, at - 1], profile), least,
                distance(p[0], p[1], p[2], tips[m, at + 1], axes[m, at + 1], profile),
            )  # fmt: skip
        if least < best:
            best, line, pose = least, m, at
    D = distance(p[0], p[1], p[2], tips[line, pose], axes[line, pose], profile)
    if D <= 0.0:
        return best
    D1 = distance(
        p[0] + D * N[0], p[1] + D * N[1], p[2] + D * N[2], tips[line, pose], axes[line, pose], profile
    )  # fmt: skip
    return float(best * D / (D - D1) if D - D1 > _FALLS * D else best)


@njit(cache=True, nogil=True)
def heights(points: Any, normals: Any, tips: Any, axes: Any, wide: Any, profile: Any, steps: int, out: Any) -> None:
    """Scallop height ``out`` (n,) [mm] between two lines at each station; nan where a line has no pose.

    ``points``, ``normals`` (n, k, 3) of the surface at k shares of the distance between the lines; ``tips``, ``axes``
    (2, n, 3), nan where there is no pose; ``wide`` (2,) number of poses before and after a station that count. Between
    the neighbours of the highest share the top is found by ``steps`` of a ternary search.
    """
    n, shares = points.shape[0], points.shape[1]
    p, N, both = np.empty(3), np.empty(3), np.empty(2)
    for i in range(n):
        out[i] = math.nan
        if math.isnan(tips[0, i, 0]) or math.isnan(tips[1, i, 0]):
            continue
        top, highest = -math.inf, 0
        for k in range(shares):
            excess = excess_at(points[i, k], normals[i, k], tips, axes, i, wide, profile)
            if excess > top:
                top, highest = excess, k
        low, high = float(max(highest - 1, 0)), float(min(highest + 1, shares - 1))
        for _ in range(steps):
            third = (high - low) / 3.0
            for side in range(2):
                at = low + third if side == 0 else high - third
                k = min(int(at), shares - 2)
                w = at - k
                for j in range(3):
                    p[j] = (1.0 - w) * points[i, k, j] + w * points[i, k + 1, j]
                    N[j] = (1.0 - w) * normals[i, k, j] + w * normals[i, k + 1, j]
                both[side] = excess_at(p, N, tips, axes, i, wide, profile)
            top = max(top, both[0], both[1])
            if both[0] < both[1]:
                low = low + third
            else:
                high = high - third
        out[i] = top
