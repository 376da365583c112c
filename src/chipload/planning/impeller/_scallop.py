"""Compiled: the excess that a straight cutter leaves at points of a surface, from its poses on passes.

Notation: as in ``scallop_height.py``. D [mm] distance of a point from the cutting part, which has no upper end; rho and
``corner`` as in ``_clearance.py``. The least D between three successive poses of a line is that of a parabola;
the excess along the normal follows from it by one secant step.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

#: distance from a pose that does not exist [mm]
_FAR = 1e9
#: the secant step is used where the distance falls by at least this share of the step along the normal
_FALLS = 0.2
#: points between two lines that share one window of poses; relative allowance for rounding
_GROUP, _ROUNDED = 5, 1e-9
#: poses of one vector instruction
_VECTOR = 16
#: coordinate of the tip of a pose that does not exist [mm]
NOWHERE = 1e10


@njit(cache=True, nogil=True)
def distance(x: float, y: float, z: float, tip: Any, axis: Any, rho: float, corner: float) -> float:
    """Distance [mm] of a point from the cutting part at a pose, negative inside; :data:`_FAR` if the pose is nan."""
    x, y, z = x - tip[0], y - tip[1], z - tip[2]
    return float(cutting_part_distance(x, y, z, x * axis[0] + y * axis[1] + z * axis[2], rho, corner))


@njit(cache=True, nogil=True)
def cutting_part_distance(x: float, y: float, z: float, high: float, rho: float, corner: float) -> float:
    """Distance [mm] from the cutting part of a point x, y, z relative to the tip, ``high`` above it along the axis."""
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
def parabola_minimum(d0: float, d1: float, d2: float) -> float:
    """Minimum of the parabola through three distances at equal steps; the middle one if it has no minimum."""
    bend = d0 - 2.0 * d1 + d2
    if bend <= 0.0 or max(d0, d2) >= 0.1 * _FAR:
        return d1
    return d1 - (d2 - d0) * (d2 - d0) / (8.0 * bend)


@njit(cache=True, nogil=True)
def excess_along_normal(
    away: float, x: float, y: float, z: float, N: Any, tip: Any, axis: Any, rho: float, corner: float
) -> float:
    """Excess [mm] along the normal of a point whose least distance from the poses around this one is ``away``."""
    D = distance(x, y, z, tip, axis, rho, corner)
    if D <= 0.0:
        return away
    return float(secant_excess(away, D, distance(x + D * N[0], y + D * N[1], z + D * N[2], tip, axis, rho, corner)))


@njit(cache=True, nogil=True)
def secant_excess(away: float, D: float, D1: float) -> float:
    """Excess [mm] along the normal, from the distances D at a point and D1 at the point moved by D along its normal."""
    return away * D / (D - D1) if D - D1 > _FALLS * D else away


@njit(cache=True, nogil=True)
def distance_keys(
    x: float, y: float, z: float, poses: Any, m: int, first: int, last: int, rho: float, corner: float, out: Any
) -> None:
    """Write (D + r)^2 with the sign of D + r to ``out`` (n,), for the poses ``first``..``last`` - 1 of the line m.

    ``poses`` (2, 6, n) tips and axes of two lines. The key ascends with D. Both cases of the corner are computed for
    every pose with one square root, so that the compiler uses vector instructions.
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
def least_value(values: Any, first: int, last: int) -> float:
    """Least of the values ``first``..``last`` - 1, none of which is nan."""
    least = math.inf
    for j in range(np.uint64(first), np.uint64(last)):
        least = min(values[j], least)
    return least


@njit(cache=True, nogil=True)
def key_distance(key: float, corner: float) -> float:
    """Distance [mm] of a key of :func:`distance_keys`, bit-identical to that of :func:`distance`."""
    return math.sqrt(key) - corner if key >= 0.0 else -math.sqrt(-key) - corner


@njit(cache=True, nogil=True)
def pose_window(near: Any, least: float, first: int, last: int, corner: float, away: float) -> tuple[int, int]:
    """Window of the poses that may be nearest to a point, and their neighbours: the first, and the one after the last.

    The point is at most ``away`` [mm] from another one, whose keys are ``near`` (n,), ``first``..``last`` - 1, and
    whose least key is ``least``. Their distances from a pose differ by at most ``away``, as long as neither point is
    deeper in the cutter than the corner radius.
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
    # a whole number of vectors
    more = -(high - low) % _VECTOR
    high = min(high + more, last)
    more = -(high - low) % _VECTOR
    return max(low - more, first), high


@njit(cache=True, nogil=True)
def excess_at(
    x: float, y: float, z: float, N: Any, poses: Any, span: Any, windows: Any, g: int, near: Any, rho: float,
    corner: float,
) -> float:  # fmt: skip
    """Excess [mm] that two lines leave at a point with the normal N.

    ``poses`` (2, 6, n) tips and axes; ``span`` (2, 2) first and one after the last pose of each line that counts;
    ``windows`` (g, 2, 2) those that may be nearest, of each group g of points; ``near`` (n,) workspace.
    """
    best, D, line, pose = math.inf, 0.0, 0, 0
    for m in range(2):
        first, last = windows[g, m, 0], windows[g, m, 1]
        distance_keys(x, y, z, poses, m, first, last, rho, corner, near)
        least = least_value(near, first, last)
        at = first
        while near[at] != least:
            at += 1
        nearest = lowest = key_distance(least, corner)
        if span[m, 0] < at < span[m, 1] - 1:
            lowest = parabola_minimum(key_distance(near[at - 1], corner), nearest, key_distance(near[at + 1], corner))
        if lowest < best:
            best, D, line, pose = lowest, nearest, m, at
    if D <= 0.0:
        return best
    x, y, z = (
        x + D * N[0] - poses[line, 0, pose], y + D * N[1] - poses[line, 1, pose], z + D * N[2] - poses[line, 2, pose]
    )  # fmt: skip
    high = x * poses[line, 3, pose] + y * poses[line, 4, pose] + z * poses[line, 5, pose]
    return float(secant_excess(best, D, cutting_part_distance(x, y, z, high, rho, corner)))


@njit(cache=True, nogil=True)
def largest_distance(points: Any, i: int, middle: int, first: int, last: int) -> float:
    """Greatest distance [mm] of the points ``first``..``last`` - 1 of station i from its point ``middle``.

    ``points`` (n, k, 3) [mm], k points at each station.
    """
    squared = 0.0
    for k in range(first, last):
        x, y, z = (
            points[i, k, 0] - points[i, middle, 0], points[i, k, 1] - points[i, middle, 1],
            points[i, k, 2] - points[i, middle, 2],
        )  # fmt: skip
        squared = max(squared, x * x + y * y + z * z)
    return math.sqrt(squared)


@njit(cache=True, nogil=True)
def heights(points: Any, normals: Any, poses: Any, wide: Any, rho: float, corner: float, steps: int, out: Any) -> None:
    """Scallop height ``out`` (n,) [mm] between two lines at each station; nan where a line has no pose.

    ``points``, ``normals`` (n, k, 3) of the surface at k shares of the distance between the lines; ``poses`` (2, 6, n)
    tips, :data:`NOWHERE` where there is no pose, and axes; ``wide`` (2,) number of poses before and after a station
    that count. The top of a scallop is an edge: between the neighbours of the highest share it is found by ``steps`` of
    a ternary search. The keys at the middle share of a group bound the poses that can be nearest to its other shares.
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
        top, highest = -math.inf, 0
        for g in range(groups):
            first, last = g * _GROUP, min((g + 1) * _GROUP, shares)
            middle = (first + last) // 2
            away = largest_distance(points, i, middle, max(first - 1, 0), min(last + 1, shares))
            for m in range(2):
                distance_keys(
                    points[i, middle, 0], points[i, middle, 1], points[i, middle, 2], poses, m, span[m, 0], span[m, 1],
                    rho, corner, near,
                )  # fmt: skip
                least = least_value(near, span[m, 0], span[m, 1])
                windows[g, m, 0], windows[g, m, 1] = pose_window(near, least, span[m, 0], span[m, 1], corner, away)
            for k in range(first, last):
                for j in range(3):
                    N[j] = normals[i, k, j]
                excess = excess_at(
                    points[i, k, 0], points[i, k, 1], points[i, k, 2], N, poses, span, windows, g, near, rho, corner
                )
                if excess > top:
                    top, highest = excess, k
        low, high = float(max(highest - 1, 0)), float(min(highest + 1, shares - 1))
        g = highest // _GROUP
        for _ in range(steps):
            third = (high - low) / 3.0
            for side in range(2):
                at = low + third if side == 0 else high - third
                k = min(int(at), shares - 2)
                w = at - k
                for j in range(3):
                    N[j] = (1.0 - w) * normals[i, k, j] + w * normals[i, k + 1, j]
                both[side] = excess_at(
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
def excess_of_poses(
    points: Any, normals: Any, cells: Any, low: Any, size: float, starts: Any, poses: Any, tips: Any, axes: Any,
    of: Any, rho: float, corner: float, out: Any,
) -> None:  # fmt: skip
    """Lower ``out`` (n,) [mm] to the excess that poses leave at points (n, 3) where that is less.

    The poses are sorted into cells of the width ``size`` [mm] from the corner ``low`` (3,), ``cells`` (3,) in number:
    those of the cell k are ``poses[starts[k]:starts[k + 1]]``. The cell of a point and its neighbours are searched.
    ``of`` (m,) the track of each pose.
    """
    m = len(tips)
    at, last = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for j in range(3):
            c = math.floor((points[i, j] - low[j]) / size)
            at[j], last[j] = max(c - 1, 0), min(c + 1, cells[j] - 1)
        best, pose = math.inf, -1
        for a in range(at[0], last[0] + 1):
            for b in range(at[1], last[1] + 1):
                row = (a * cells[1] + b) * cells[2]
                if at[2] > last[2]:
                    continue
                for p in range(starts[row + at[2]], starts[row + last[2] + 1]):
                    k = poses[p]
                    D = distance(x, y, z, tips[k], axes[k], rho, corner)
                    if best > D:
                        best, pose = D, k
        if pose < 0 or best >= out[i] + corner:
            continue
        least = best
        if 0 < pose < m - 1 and of[pose - 1] == of[pose] and of[pose + 1] == of[pose]:
            least = parabola_minimum(
                distance(x, y, z, tips[pose - 1], axes[pose - 1], rho, corner), best,
                distance(x, y, z, tips[pose + 1], axes[pose + 1], rho, corner),
            )  # fmt: skip
        out[i] = min(out[i], excess_along_normal(least, x, y, z, normals[i], tips[pose], axes[pose], rho, corner))
