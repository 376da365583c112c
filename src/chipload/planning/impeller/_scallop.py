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


@njit(cache=True, nogil=True)
def distance(x: float, y: float, z: float, tip: Any, axis: Any, rho: float, corner: float) -> float:
    """Distance [mm] of a point from the cutting part; below 0 inside; far where there is no pose."""
    x, y, z = x - tip[0], y - tip[1], z - tip[2]
    high = x * axis[0] + y * axis[1] + z * axis[2]
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
    D1 = distance(x + D * N[0], y + D * N[1], z + D * N[2], tip, axis, rho, corner)
    return away * D / (D - D1) if D - D1 > _FALLS * D else away


@njit(cache=True, nogil=True)
def distances(
    x: float, y: float, z: float, poses: Any, m: int, count: int, rho: float, corner: float, out: Any
) -> None:
    """As :func:`distance`, of the first ``count`` of the ``poses`` (2, 6, k) of a line m, tips and axes, into ``out``.

    Both cases of the corner are computed for all, so that the loop is one of vector instructions.
    """
    for j in range(count):
        u, v, w = x - poses[m, 0, j], y - poses[m, 1, j], z - poses[m, 2, j]
        high = u * poses[m, 3, j] + v * poses[m, 4, j] + w * poses[m, 5, j]
        off = u * u + v * v + w * w - high * high
        d = math.sqrt(off if off > 0.0 else 0.0)
        h = high - corner
        edge = math.sqrt((d - rho) * (d - rho) + h * h) - corner
        low = edge if d > rho else -h - corner
        D = d - rho - corner if h > 0.0 else low
        out[j] = D if high == high else _FAR


@njit(cache=True, nogil=True)
def left_at(
    x: float, y: float, z: float, N: Any, tips: Any, axes: Any, poses: Any, first: Any, count: Any, near: Any,
    rho: float, corner: float,
) -> float:  # fmt: skip
    """What the ``poses`` of two lines, ``count`` from ``first`` on, leave at a point; ``near`` is room to work."""
    best, line, pose = math.inf, 0, 0
    for m in range(2):
        distances(x, y, z, poses, m, count[m], rho, corner, near)
        least = near[0]
        for j in range(count[m]):
            least = min(near[j], least)
        at = 0
        while near[at] != least:
            at += 1
        low = near[at]
        if 0 < at < count[m] - 1:
            low = lowest(near[at - 1], low, near[at + 1])
        if low < best:
            best, line, pose = low, m, first[m] + at
    return float(along_normal(best, x, y, z, N, tips[line, pose], axes[line, pose], rho, corner))


@njit(cache=True, nogil=True)
def heights(
    points: Any, normals: Any, tips: Any, axes: Any, wide: Any, rho: float, corner: float, steps: int, out: Any
) -> None:
    """Crest (n,) between two lines; tips and axes (2, n, 3), ``wide`` (2,) how many poses before and after count.

    The crest is an edge: between the shares beside the highest one it is looked for in so many ``steps`` of thirds.
    """
    n, shares = points.shape[0], points.shape[1]
    most = 2 * max(wide[0], wide[1]) + 1
    near, N, both = np.empty(most), np.empty(3), np.empty(2)
    poses, first, count = np.empty((2, 6, most)), np.empty(2, dtype=np.int64), np.empty(2, dtype=np.int64)
    for i in range(n):
        out[i] = math.nan
        if math.isnan(tips[0, i, 0]) or math.isnan(tips[1, i, 0]):
            continue
        for m in range(2):
            first[m] = max(i - wide[m], 0)
            count[m] = min(i + wide[m], n - 1) + 1 - first[m]
            for k in range(3):
                for j in range(count[m]):
                    poses[m, k, j], poses[m, 3 + k, j] = tips[m, first[m] + j, k], axes[m, first[m] + j, k]
        crest, top = -math.inf, 0
        for k in range(shares):
            left = left_at(
                points[i, k, 0], points[i, k, 1], points[i, k, 2], normals[i, k], tips, axes, poses, first, count,
                near, rho, corner,
            )  # fmt: skip
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
                    N[j] = (1.0 - w) * normals[i, k, j] + w * normals[i, k + 1, j]
                both[side] = left_at(
                    (1.0 - w) * points[i, k, 0] + w * points[i, k + 1, 0],
                    (1.0 - w) * points[i, k, 1] + w * points[i, k + 1, 1],
                    (1.0 - w) * points[i, k, 2] + w * points[i, k + 1, 2],
                    N, tips, axes, poses, first, count, near, rho, corner,
                )  # fmt: skip
            crest = max(crest, both[0], both[1])
            if both[0] < both[1]:
                low = low + third
            else:
                high = high - third
        out[i] = crest


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
