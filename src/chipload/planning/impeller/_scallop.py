"""Compiled: how far points of a surface stay from the poses of passes.

Notation: as in ``scallop_height.py``: D distance of a point from the cutting part, taken without end; between three
poses of a line the least D by a parabola; along the normal by one step of the secant.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

#: no pose [mm]
_FAR = 1e9
#: the secant counts where the distance falls by at least this share of a step along the normal
_FALLS = 0.2
#: so many points between two lines are searched in the poses that are near the middle one; what rounding may do
_GROUP, _ROUNDED = 5, 1e-9
#: poses that are computed at once
_VECTOR = 16
#: place of the tip where there is no pose [mm]
NOWHERE = 1e10


@njit(cache=True, nogil=True)
def distance(x: float, y: float, z: float, tip: Any, axis: Any, rho: float, corner: float) -> float:
    """Distance [mm] of a point from the cutting part; below 0 inside; far where there is no pose."""
    x, y, z = x - tip[0], y - tip[1], z - tip[2]
    return float(from_part(x, y, z, x * axis[0] + y * axis[1] + z * axis[2], rho, corner))


@njit(cache=True, nogil=True)
def from_part(x: float, y: float, z: float, high: float, rho: float, corner: float) -> float:
    """Distance [mm] from the cutting part of a point at x, y, z from its tip, ``high`` along its axis."""
    if math.isnan(high):
        return _FAR
    d = math.sqrt(max(x * x + y * y + z * z - high * high, 0.0))
    h = high - corner
    if h > 0.0:
        return d - rho - corner
    if d > rho:
        return math.sqrt((d - rho) * (d - rho) + h * h) - corner
    return float(-h - corner)


@njit(cache=True, nogil=True)
def lowest(d0: float, d1: float, d2: float) -> float:
    """Least of the parabola through three distances one step apart, or the middle one where that is no valley."""
    bend = d0 - 2.0 * d1 + d2
    if bend <= 0.0 or max(d0, d2) >= 0.1 * _FAR:
        return d1
    return d1 - (d2 - d0) * (d2 - d0) / (8.0 * bend)


@njit(cache=True, nogil=True)
def along_normal(
    away: float, x: float, y: float, z: float, N: Any, tip: Any, axis: Any, rho: float, corner: float
) -> float:
    """What is left along the normal of a point that is ``away`` from the nearest of the poses beside this one."""
    D = distance(x, y, z, tip, axis, rho, corner)
    if D <= 0.0:
        return away
    return float(risen(away, D, distance(x + D * N[0], y + D * N[1], z + D * N[2], tip, axis, rho, corner)))


@njit(cache=True, nogil=True)
def risen(away: float, D: float, D1: float) -> float:
    """What is left along the normal, by the distances D at a point and D1 at D along its normal from it."""
    return away * D / (D - D1) if D - D1 > _FALLS * D else away


@njit(cache=True, nogil=True)
def keys(
    x: float, y: float, z: float, poses: Any, m: int, first: int, last: int, rho: float, corner: float, out: Any
) -> None:
    """(D + r)^2 with the sign of D + r, of the ``poses`` (2, 6, n) of a line m, tips and axes, from ``first`` to before
    ``last``, into ``out`` (n,).

    They ascend as the distances do. Both cases of the corner are computed for all with one root, so that the loop is
    one of vector instructions.
    """
    for j in range(np.uint64(first), np.uint64(last)):
        u, v, w = x - poses[m, 0, j], y - poses[m, 1, j], z - poses[m, 2, j]
        high = u * poses[m, 3, j] + v * poses[m, 4, j] + w * poses[m, 5, j]
        off = u * u + v * v + w * w - high * high
        d = math.sqrt(off if off > 0.0 else 0.0) - rho
        h = high - corner
        beyond = d if d > 0.0 else 0.0
        low = beyond * beyond + h * h
        out[j] = d * abs(d) if h > 0.0 else low


@njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})
def least_of(values: Any, first: int, last: int) -> float:
    """The least of the values, none of which is nan, from ``first`` to before ``last``."""
    least = math.inf
    for j in range(np.uint64(first), np.uint64(last)):
        least = min(values[j], least)
    return least


@njit(cache=True, nogil=True)
def distance_of(key: float, corner: float) -> float:
    """The distance of a key of :func:`keys`, to the last bit as of :func:`distance`."""
    return math.sqrt(key) - corner if key >= 0.0 else -math.sqrt(-key) - corner


@njit(cache=True, nogil=True)
def reach_of(near: Any, least: float, first: int, last: int, corner: float, away: float) -> tuple[int, int]:
    """The first pose and the one after the last that may be nearest, or beside it, to a point that is at most ``away``
    from one whose keys are ``near`` (n,) from ``first`` to before ``last``.

    No distance of the two differs by more than ``away``, as long as neither is deeper than the corner in the cutter.
    """
    if least <= 4.0 * away * away or corner <= 0.0:
        return first, last
    most = math.sqrt(least) + 2.0 * away
    most = most * most * (1.0 + _ROUNDED)
    low, high = first, last
    while near[low] > most:
        low += 1
    while near[high - 1] > most:
        high -= 1
    low, high = max(low - 1, first), min(high + 1, last)
    # a full number of vectors
    more = -(high - low) % _VECTOR
    high = min(high + more, last)
    more = -(high - low) % _VECTOR
    return max(low - more, first), high


@njit(cache=True, nogil=True)
def left_at(
    x: float, y: float, z: float, N: Any, poses: Any, span: Any, windows: Any, g: int, near: Any, rho: float,
    corner: float,
) -> float:  # fmt: skip
    """What two lines leave at a point with the normal N: ``poses`` (2, 6, n) of the ``span`` (2, 2) from first to
    before last, of which those of the window g may be nearest; ``near`` (n,) is room to work.
    """
    best, D, line, pose = math.inf, 0.0, 0, 0
    for m in range(2):
        first, last = windows[g, m, 0], windows[g, m, 1]
        keys(x, y, z, poses, m, first, last, rho, corner, near)
        least = least_of(near, first, last)
        at = first
        while near[at] != least:
            at += 1
        own = low = distance_of(least, corner)
        if span[m, 0] < at < span[m, 1] - 1:
            low = lowest(distance_of(near[at - 1], corner), own, distance_of(near[at + 1], corner))
        if low < best:
            best, D, line, pose = low, own, m, at
    if D <= 0.0:
        return best
    x, y, z = (
        x + D * N[0] - poses[line, 0, pose], y + D * N[1] - poses[line, 1, pose], z + D * N[2] - poses[line, 2, pose]
    )  # fmt: skip
    high = x * poses[line, 3, pose] + y * poses[line, 4, pose] + z * poses[line, 5, pose]
    return float(risen(best, D, from_part(x, y, z, high, rho, corner)))


@njit(cache=True, nogil=True)
def farthest(points: Any, i: int, middle: int, first: int, last: int) -> float:
    """Greatest distance of the points (n, k, 3) of a place i from ``first`` to before ``last`` from the middle one."""
    far = 0.0
    for k in range(first, last):
        x, y, z = (
            points[i, k, 0] - points[i, middle, 0], points[i, k, 1] - points[i, middle, 1],
            points[i, k, 2] - points[i, middle, 2],
        )  # fmt: skip
        far = max(far, x * x + y * y + z * z)
    return math.sqrt(far)


@njit(cache=True, nogil=True)
def heights(points: Any, normals: Any, poses: Any, wide: Any, rho: float, corner: float, steps: int, out: Any) -> None:
    """Scallop (n,) between two lines; ``poses`` (2, 6, n) tips, :data:`NOWHERE` where there is none, and axes, ``wide``
    (2,) how many before and after count.

    The scallop is an edge: between the shares beside the highest one it is searched in so many ``steps`` of thirds. The
    keys of the middle one of some shares tell which poses may be nearest to the others, and to those beside them.
    """
    n, shares = points.shape[0], points.shape[1]
    N, both, near = np.empty(3), np.empty(2), np.empty(n)
    groups = (shares + _GROUP - 1) // _GROUP
    span, windows = np.empty((2, 2), dtype=np.int64), np.empty((groups, 2, 2), dtype=np.int64)
    for i in range(n):
        out[i] = math.nan
        if poses[0, 0, i] >= _FAR or poses[1, 0, i] >= _FAR:
            continue
        for m in range(2):
            span[m, 0], span[m, 1] = max(i - wide[m], 0), min(i + wide[m], n - 1) + 1
        top, where = -math.inf, 0
        for g in range(groups):
            first, last = g * _GROUP, min((g + 1) * _GROUP, shares)
            middle = (first + last) // 2
            away = farthest(points, i, middle, max(first - 1, 0), min(last + 1, shares))
            for m in range(2):
                keys(
                    points[i, middle, 0], points[i, middle, 1], points[i, middle, 2], poses, m, span[m, 0], span[m, 1],
                    rho, corner, near,
                )  # fmt: skip
                least = least_of(near, span[m, 0], span[m, 1])
                windows[g, m, 0], windows[g, m, 1] = reach_of(near, least, span[m, 0], span[m, 1], corner, away)
            for k in range(first, last):
                for j in range(3):
                    N[j] = normals[i, k, j]
                left = left_at(
                    points[i, k, 0], points[i, k, 1], points[i, k, 2], N, poses, span, windows, g, near, rho, corner
                )
                if left > top:
                    top, where = left, k
        low, high = float(max(where - 1, 0)), float(min(where + 1, shares - 1))
        g = where // _GROUP
        for _ in range(steps):
            third = (high - low) / 3.0
            for side in range(2):
                at = low + third if side == 0 else high - third
                k = min(int(at), shares - 2)
                w = at - k
                for j in range(3):
                    N[j] = (1.0 - w) * normals[i, k, j] + w * normals[i, k + 1, j]
                both[side] = left_at(
                    (1.0 - w) * points[i, k, 0] + w * points[i, k + 1, 0],
                    (1.0 - w) * points[i, k, 1] + w * points[i, k + 1, 1],
                    (1.0 - w) * points[i, k, 2] + w * points[i, k + 1, 2],
                    N, poses, span, windows, g, near, rho, corner,
                )  # fmt: skip
            top = max(top, both[0], both[1])
            if both[0] < both[1]:
                low = low + third
            else:
                high = high - third
        out[i] = top


@njit(cache=True, nogil=True)
def left_of(
    points: Any, normals: Any, cells: Any, low: Any, size: float, starts: Any, poses: Any, tips: Any, axes: Any,
    of: Any, rho: float, corner: float, out: Any,
) -> None:  # fmt: skip
    """What poses leave at points (n, 3), into ``out`` (n,) where it is less.

    The poses stand in cells of the width ``size`` from ``low`` (3,), ``cells`` (3,) how many: those of the cell k are
    ``poses[starts[k]:starts[k + 1]]``. Looked at are the cells beside that of the point. ``of`` (m,) the track of each.
    """
    m = len(tips)
    at, last = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for j in range(3):
            c = math.floor((points[i, j] - low[j]) / size)
            at[j], last[j] = max(c - 1, 0), min(c + 1, cells[j] - 1)
        best, who = math.inf, -1
        for a in range(at[0], last[0] + 1):
            for b in range(at[1], last[1] + 1):
                row = (a * cells[1] + b) * cells[2]
                if at[2] > last[2]:
                    continue
                for p in range(starts[row + at[2]], starts[row + last[2] + 1]):
                    k = poses[p]
                    D = distance(x, y, z, tips[k], axes[k], rho, corner)
                    if best > D:
                        best, who = D, k
        if who < 0 or best >= out[i] + corner:
            continue
        low_D = best
        if 0 < who < m - 1 and of[who - 1] == of[who] and of[who + 1] == of[who]:
            low_D = lowest(
                distance(x, y, z, tips[who - 1], axes[who - 1], rho, corner), best,
                distance(x, y, z, tips[who + 1], axes[who + 1], rho, corner),
            )  # fmt: skip
        out[i] = min(out[i], along_normal(low_D, x, y, z, normals[i], tips[who], axes[who], rho, corner))
