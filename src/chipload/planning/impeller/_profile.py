"""Compiled: distance of points from a tapered or barrel cutter, and the scallop between two lines of its poses.

Notation: ``profile`` (11,) as :func:`~chipload.planning.impeller.profile.profile_numbers`: r, e of the corner, whose
centre lies r above the tip; R, E, F of the flank arc (those of the corner where there is none); sine and cosine of the
angle kappa at which the corner ends, of the taper beta; height and radius of the top. d distance of a point from the
axis, z its height above the tip. The profile is convex: the nearest of its parts is found by the normals at its ends.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.planning.impeller._scallop import lowest

#: no pose [mm]
_FAR = 1e9
#: the secant counts where the distance falls by at least this share of a step along the normal
_FALLS = 0.2


@njit(cache=True, nogil=True)
def cutting(d: float, z: float, profile: Any) -> float:
    """Distance [mm] of a point from the cutting part, below 0 inside; beside the rim of its top as if it went on."""
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
def apart(d: float, z: float, profile: Any, stages: Any, tip: float) -> float:
    """Distance of a point from the cutting part and all above it, below 0 inside by at least so much.

    ``stages`` (k, 2) height above the corner's centre, which is ``tip`` above the tip, where a cylinder begins and its
    radius; the first row is the cutting part, which ends at the second.
    """
    best, k = float(cutting(d, z, profile)), len(stages)
    for j in range(1, k):
        low = stages[j, 0] + tip
        high = stages[j + 1, 0] + tip if j + 1 < k else math.inf
        out, away = d - stages[j, 1], max(low - z, z - high)
        if out <= 0.0 and away <= 0.0:
            best = min(best, max(out, away))
        else:
            best = min(best, math.sqrt(max(out, 0.0) ** 2 + max(away, 0.0) ** 2))
    return best


@njit(cache=True, nogil=True)
def nearest(
    points: Any, nodes: Any, spans: Any, leaves: int, tips: Any, axes: Any, profile: Any, stages: Any, cap: float,
    out: Any, which: Any,
) -> None:  # fmt: skip
    """Distance ``out`` (n,) of the nearest point from the cutter at each pose, at most ``cap``, and ``which``."""
    stack = np.empty(64, dtype=np.int64)
    for i in range(len(tips)):
        ax, ay, az = axes[i, 0], axes[i, 1], axes[i, 2]
        best, who = cap, -1
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            k = stack[top]
            R = nodes[k, 3]
            if R < 0.0:
                continue
            x, y, z = nodes[k, 0] - tips[i, 0], nodes[k, 1] - tips[i, 1], nodes[k, 2] - tips[i, 2]
            h = x * ax + y * ay + z * az
            d = math.sqrt(max(x * x + y * y + z * z - h * h, 0.0))
            if apart(d, h, profile, stages, profile[0]) - R >= best:
                continue
            if k < leaves:
                stack[top], stack[top + 1] = 2 * k + 1, 2 * k + 2
                top += 2
                continue
            for j in range(spans[k, 0], spans[k, 1]):
                x, y, z = points[j, 0] - tips[i, 0], points[j, 1] - tips[i, 1], points[j, 2] - tips[i, 2]
                h = x * ax + y * ay + z * az
                d = math.sqrt(max(x * x + y * y + z * z - h * h, 0.0))
                one = apart(d, h, profile, stages, profile[0])
                if one < best:
                    best, who = one, j
        out[i], which[i] = best, who


@njit(cache=True, nogil=True)
def distance(x: float, y: float, z: float, tip: Any, axis: Any, profile: Any) -> float:
    """Distance [mm] of a point from the cutting part; far where there is no pose."""
    x, y, z = x - tip[0], y - tip[1], z - tip[2]
    h = x * axis[0] + y * axis[1] + z * axis[2]
    if math.isnan(h):
        return _FAR
    return float(cutting(math.sqrt(max(x * x + y * y + z * z - h * h, 0.0)), h, profile))


@njit(cache=True, nogil=True)
def left_at(p: Any, N: Any, tips: Any, axes: Any, i: int, wide: Any, profile: Any) -> float:
    """What the poses of two lines near the station i leave at a point p, along its normal N."""
    n, best, line, pose = tips.shape[1], math.inf, 0, 0
    for m in range(2):
        first, last = max(i - wide[m], 0), min(i + wide[m], n - 1)
        least, at = math.inf, first
        for j in range(first, last + 1):
            D = distance(p[0], p[1], p[2], tips[m, j], axes[m, j], profile)
            if least > D:
                least, at = D, j
        if first < at < last:
            least = lowest(
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
    """Crest (n,) between two lines; tips and axes (2, n, 3), ``wide`` (2,) how many poses before and after count.

    Between the shares beside the highest one the crest is looked for in so many ``steps`` of thirds.
    """
    n, shares = points.shape[0], points.shape[1]
    p, N, both = np.empty(3), np.empty(3), np.empty(2)
    for i in range(n):
        out[i] = math.nan
        if math.isnan(tips[0, i, 0]) or math.isnan(tips[1, i, 0]):
            continue
        crest, top = -math.inf, 0
        for k in range(shares):
            left = left_at(points[i, k], normals[i, k], tips, axes, i, wide, profile)
            if left > crest:
                crest, top = left, k
        low, high = float(max(top - 1, 0)), float(min(top + 1, shares - 1))
        for _ in range(steps):
            third = (high - low) / 3.0
            for side in range(2):
                at = low + third if side == 0 else high - third
                k = min(int(at), shares - 2)
                w = at - k
                for j in range(3):
                    p[j] = (1.0 - w) * points[i, k, j] + w * points[i, k + 1, j]
                    N[j] = (1.0 - w) * normals[i, k, j] + w * normals[i, k + 1, j]
                both[side] = left_at(p, N, tips, axes, i, wide, profile)
            crest = max(crest, both[0], both[1])
            if both[0] < both[1]:
                low = low + third
            else:
                high = high - third
        out[i] = crest
