"""Compiled: where the moving cutter meets rays that stand on a surface.

Notation: a ray is S + s N, S a point of the surface, N its normal, s [mm] from -depth to height. A part of the tool is
a row ``[r, e, f, m, z1, z2, c, tb, h, big, R, E, F, z3]`` as in the kernels of the dexels, and the height above the tip
at which it begins. On a move the tip goes straight, the axis along the normalised chord; while a ray is met the lower
end of what it loses is convex in time for a straight move, so that its least is found by golden section beside the
least instant.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.stock.dexels._kernels import pierce

_HALF_ROOT = math.sqrt(0.5)
_GOLDEN = 0.6180339887498949
_STEPS = 14
#: of the sweep of a move, how far its poses are from the one half-way, turns included
_HALF = 0.55
#: between two instants a part comes lower than at both by less than this [mm]: for what is left, for gouges
_LEFT, _DIP = 0.1, 0.05
#: so many points one after the other are searched in the groups that are near any of them; what rounding may do
_POINTS, _ROUNDED = 32, 1e-9


@njit(cache=True, nogil=True)
def groups_of(tips: Any, axes: Any, size: int, out: Any) -> None:
    """Moves in groups of ``size``: rows (g, 8) of ``out``, a ball round their tips, centre and radius, the mean axis,
    and the greatest length of the difference of an axis from it. Move k goes from k - 1 to k.
    """
    n = len(tips)
    for g in range(len(out)):
        first, last = 1 + g * size, min(1 + (g + 1) * size, n)
        for j in range(8):
            out[g, j] = 0.0
        count = last - first + 1
        for k in range(first - 1, last):
            for j in range(3):
                out[g, j] += tips[k, j] / count
                out[g, 4 + j] += axes[k, j] / count
        norm = math.sqrt(out[g, 4] ** 2 + out[g, 5] ** 2 + out[g, 6] ** 2)
        for j in range(3):
            # axes that cancel have no mean: any direction will do, for their difference from it is measured
            out[g, 4 + j] = out[g, 4 + j] / norm if norm > 1e-9 else axes[first, j]
        for k in range(first - 1, last):
            ball = spread = 0.0
            for j in range(3):
                ball += (tips[k, j] - out[g, j]) ** 2
                spread += (axes[k, j] - out[g, 4 + j]) ** 2
            out[g, 3] = max(out[g, 3], math.sqrt(ball))
            out[g, 7] = max(out[g, 7], math.sqrt(spread))


@njit(cache=True, nogil=True)
def apart(h: float, d: float, start: float, shape: Any) -> float:
    """How far a point at the height h above the tip, d from the axis, is at least from a part; below 0 inside."""
    x, r, e = h - start - shape[2], shape[0], shape[1]
    if shape[7] > 0.0 or shape[10] > 0.0:
        # tapered or a barrel: it lies in the cone of its flank line, below its top and inside the tangent of its corner
        # that rises by 45 deg
        z = h - start
        chamfer = (d - e - x) * _HALF_ROOT - r if shape[2] - shape[5] <= r * _HALF_ROOT else -z
        cone = (d - shape[6] - shape[7] * z) / math.sqrt(1.0 + shape[7] * shape[7])
        return float(max(-z, z - shape[8], cone, chamfer, d - shape[9]))
    if x <= 0.0:
        return float(math.sqrt((d - e) * (d - e) + x * x) - r if d > e else -x - r)
    return float(max(d - e - r, h - start - shape[8]))


@njit(cache=True, nogil=True)
def out_of_reach(group: Any, middle: Any, half: float, starts: Any, shapes: Any) -> bool:
    """Whether no move of a group can meet the ray of half the length ``half`` round its ``middle``."""
    x, y, z = middle[0] - group[0], middle[1] - group[1], middle[2] - group[2]
    far = math.sqrt(x * x + y * y + z * z)
    h = x * group[4] + y * group[5] + z * group[6]
    slack = group[3] + far * group[7] + half
    d = math.sqrt(max(far * far - h * h, 0.0))
    nearest = math.inf
    for part in range(len(shapes)):
        nearest = min(nearest, apart(h, d, starts[part], shapes[part]))
    return bool(nearest > slack)


@njit(cache=True, nogil=True)
def ball_of(points: Any, first: int, last: int, middle: Any) -> float:
    """Radius of a ball about the points ``first``..``last``; its ``middle``."""
    for j in range(3):
        middle[j] = 0.0
    for i in range(first, last):
        for j in range(3):
            middle[j] += points[i, j] / (last - first)
    radius = 0.0
    for i in range(first, last):
        x, y, z = points[i, 0] - middle[0], points[i, 1] - middle[1], points[i, 2] - middle[2]
        radius = max(radius, x * x + y * y + z * z)
    return math.sqrt(radius)


@njit(cache=True, nogil=True)
def groups_near(
    points: Any, first: int, last: int, reach: float, groups: Any, starts: Any, shapes: Any, middle: Any, out: Any
) -> int:
    """The groups whose moves may meet rays that lie within ``reach`` of the points ``first``..``last``, ascending, into
    ``out``; how many. A point passes over no other group, for whichever of them it would be left out.
    """
    half = (ball_of(points, first, last, middle) + reach) * (1.0 + _ROUNDED)
    found = 0
    for g in range(len(groups)):
        if not out_of_reach(groups[g], middle, half, starts, shapes):
            out[found] = g
            found += 1
    return found


@njit(cache=True, nogil=True)
def lower(
    t: float, tips: Any, axes: Any, k: int, start: float, shape: Any, S: Any, frame: Any, depth: float, height: float,
    tip: Any, axis: Any,
) -> float:  # fmt: skip
    """Least s of the ray in the part at the share ``t`` of move k, from -depth; ``height``: not met below it."""
    norm = 0.0
    for j in range(3):
        axis[j] = axes[k - 1, j] * (1.0 - t) + axes[k, j] * t
        norm += axis[j] * axis[j]
    norm = math.sqrt(norm)
    x0 = x1 = x2 = a0 = a1 = a2 = 0.0
    for j in range(3):
        a = axis[j] / norm
        p = tips[k - 1, j] * (1.0 - t) + tips[k, j] * t + start * a - S[j]
        x0 += frame[0, j] * p
        x1 += frame[1, j] * p
        x2 += frame[2, j] * p
        a0 += frame[0, j] * a
        a1 += frame[1, j] * a
        a2 += frame[2, j] * a
    tip[0], tip[1], tip[2] = x0, x1, x2
    axis[0], axis[1], axis[2] = a0, a1, a2
    lo, hi = pierce(2, 0.0, 0.0, tip, axis, shape)
    if lo > hi or hi <= -depth or lo >= height:
        return height
    return max(float(lo), -depth)


@njit(cache=True, nogil=True)
def seen_from(middle: Any, tips: Any, axes: Any, k: int, half: float) -> tuple[float, float, float]:
    """How far the tool sweeps past the ray of half length ``half`` about ``middle`` in move k; half-way through it the
    height of ``middle`` along the axis, and its distance from the axis.
    """
    norm = h = far2 = long2 = turn2 = 0.0
    for j in range(3):
        a = axes[k, j] + axes[k - 1, j]
        x = middle[j] - 0.5 * (tips[k, j] + tips[k - 1, j])
        norm += a * a
        h += a * x
        far2 += x * x
        long2 += (tips[k, j] - tips[k - 1, j]) ** 2
        turn2 += (axes[k, j] - axes[k - 1, j]) ** 2
    h /= math.sqrt(norm)
    long = math.sqrt(long2)
    sweep = long + math.sqrt(turn2) * (math.sqrt(far2) + long + half)
    return sweep, h, math.sqrt(max(far2 - h * h, 0.0))


@njit(cache=True, nogil=True)
def away_at(t: float, tips: Any, axes: Any, k: int, start: float, shape: Any, middle: Any) -> float:
    """How far the point ``middle`` is at least from the part at the share ``t`` of move k."""
    norm = h = far = 0.0
    for j in range(3):
        a = axes[k - 1, j] * (1.0 - t) + axes[k, j] * t
        x = middle[j] - tips[k - 1, j] * (1.0 - t) - tips[k, j] * t
        norm += a * a
        h += a * x
        far += x * x
    h /= math.sqrt(norm)
    return float(apart(h, math.sqrt(max(far - h * h, 0.0)), start, shape))


@njit(cache=True, nogil=True)
def least_of(
    count: int, tips: Any, axes: Any, k: int, start: float, shape: Any, S: Any, frame: Any, depth: float,
    height: float, tip: Any, axis: Any, middle: Any, near: float,
) -> tuple[float, int]:  # fmt: skip
    """The least ``lower`` of the instants 0 .. count of move k, and which it is.

    Left out are instants at which the part is farther than ``near`` from ``middle``.
    """
    best, at = height, 0
    for m in range(count + 1):
        if away_at(m / count, tips, axes, k, start, shape, middle) > near:
            continue
        s = lower(m / count, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
        if s < best:
            best, at = s, m
    return best, at


@njit(cache=True, nogil=True)
def least_near(
    best: float, at: int, count: int, tol: float, tips: Any, axes: Any, k: int, start: float, shape: Any, S: Any,
    frame: Any, depth: float, height: float, tip: Any, axis: Any,
) -> float:  # fmt: skip
    """The least ``lower`` between the instants beside ``at``, by golden section to ``tol`` [mm]; at most ``best``."""
    lo, hi = max(at - 1, 0) / count, min(at + 1, count) / count
    t1, t2 = hi - _GOLDEN * (hi - lo), lo + _GOLDEN * (hi - lo)
    f1 = lower(t1, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
    f2 = lower(t2, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
    for _ in range(_STEPS):
        best = min(best, f1, f2)
        if abs(f1 - f2) < tol and f1 < height:
            break
        if f1 <= f2:
            hi, t2, f2 = t2, t1, f1
            t1 = hi - _GOLDEN * (hi - lo)
            f1 = lower(t1, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
        else:
            lo, t1, f1 = t1, t2, f2
            t2 = lo + _GOLDEN * (hi - lo)
            f2 = lower(t2, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
    return float(min(best, f1, f2))


@njit(cache=True, nogil=True)
def along(S: Any, frame: Any, depth: float, top: float, middle: Any) -> float:
    """Half the length of the ray from -depth to ``top``; its ``middle``."""
    for j in range(3):
        middle[j] = S[j] + 0.5 * (top - depth) * frame[2, j]
    return 0.5 * (top + depth)


@njit(cache=True, nogil=True)
def highest(low: Any, met: Any) -> float:
    """The highest of the least s of the kinds of parts that there are."""
    top = -math.inf
    for kind in range(len(low)):
        if met[kind]:
            top = max(top, low[kind])
    return top


@njit(cache=True, nogil=True)
def left(
    points: Any, frames: Any, tips: Any, axes: Any, groups: Any, size: int, starts: Any, shapes: Any, cutting: Any,
    depth: float,
    height: float, step: float, tol: float, first: int, last: int, rest: Any, rest_row: Any, gouge: Any,
    gouge_row: Any, gouge_part: Any,
) -> None:  # fmt: skip
    """For the points ``first``..``last``: ``rest`` [mm] above the surface that no cutting move takes, ``gouge`` [mm]
    the deepest below it that any part comes, the rows that do, the part. ``cutting`` (n,) whether a row feeds.
    """
    tip, axis, middle = np.empty(3), np.empty(3), np.empty(3)
    n, parts = len(tips), len(shapes)
    near, found = np.empty(len(groups), dtype=np.int64), 0
    for i in range(first, last):
        if (i - first) % _POINTS == 0:
            found = groups_near(
                points, i, min(i + _POINTS, last), max(depth, height), groups, starts, shapes, middle, near
            )
        S, frame = points[i], frames[i]
        # of the ray counts what is below the least that is known
        top = max(rest[i], 0.0)
        half = along(S, frame, depth, top, middle)
        g, k, end = -1, 0, 0
        while True:
            k += 1
            if k >= end:
                g += 1
                if g == found:
                    break
                k, end = 1 + near[g] * size, min(1 + (near[g] + 1) * size, n)
                # the moves of a group are left out together
                if out_of_reach(groups[near[g]], middle, half, starts, shapes):
                    k = end
                    continue
            sweep, h, d = seen_from(middle, tips, axes, k, half)
            slack = _HALF * sweep + half
            for part in range(parts):
                if apart(h, d, starts[part], shapes[part]) > slack:
                    continue
                count = max(1, math.ceil(sweep / step))
                best, at = least_of(
                    count, tips, axes, k, starts[part], shapes[part], S, frame, depth, height, tip, axis,
                    middle, half + _LEFT,
                )  # fmt: skip
                if best >= height:
                    continue
                known = rest[i] if part == 0 and cutting[k] else height
                if best - _LEFT < known or best < _LEFT:
                    best = least_near(
                        best, at, count, tol, tips, axes, k, starts[part], shapes[part], S, frame, depth, height, tip,
                        axis,
                    )  # fmt: skip
                if part == 0 and cutting[k] and best < rest[i]:
                    rest[i], rest_row[i] = best, k
                    if top > 0.0:
                        top = max(best, 0.0)
                        half = along(S, frame, depth, top, middle)
                if -best > gouge[i]:
                    gouge[i], gouge_row[i], gouge_part[i] = -best, k, part


@njit(cache=True, nogil=True)
def lowest(
    points: Any, frames: Any, tips: Any, axes: Any, groups: Any, size: int, starts: Any, shapes: Any, kinds: Any,
    depth: float, height: float,
    step: float, tol: float, low: Any, rows: Any, part_of: Any,
) -> None:  # fmt: skip
    """The least s of the ray of each point in the parts of each of the ``kinds`` 0..2, into ``low`` (n, 3), which holds
    ``height``; the row and the part where it is met into ``rows``, ``part_of`` (n, 3).
    """
    tip, axis, middle = np.empty(3), np.empty(3), np.empty(3)
    n, parts = len(tips), len(shapes)
    met = np.zeros(3, dtype=np.bool_)
    for part in range(parts):
        met[kinds[part]] = True
    near, found = np.empty(len(groups), dtype=np.int64), 0
    for i in range(len(points)):
        if i % _POINTS == 0:
            found = groups_near(
                points, i, min(i + _POINTS, len(points)), max(depth, height), groups, starts, shapes, middle, near
            )
        S, frame = points[i], frames[i]
        # of the ray counts what is below the least that is known of each kind
        top = highest(low[i], met)
        half = along(S, frame, depth, top, middle)
        g, k, end = -1, 0, 0
        while True:
            k += 1
            if k >= end:
                g += 1
                if g == found:
                    break
                k, end = 1 + near[g] * size, min(1 + (near[g] + 1) * size, n)
                # the moves of a group are left out together
                if out_of_reach(groups[near[g]], middle, half, starts, shapes):
                    k = end
                    continue
            sweep, h, d = seen_from(middle, tips, axes, k, half)
            slack = _HALF * sweep + half
            for part in range(parts):
                if apart(h, d, starts[part], shapes[part]) > slack:
                    continue
                kind = kinds[part]
                count = max(1, math.ceil(sweep / step))
                best, at = least_of(
                    count, tips, axes, k, starts[part], shapes[part], S, frame, depth, height, tip, axis,
                    middle, half + _DIP,
                )  # fmt: skip
                # between two instants a part comes lower by less than this
                if best >= height or best - _DIP >= low[i, kind]:
                    continue
                best = least_near(
                    best, at, count, tol, tips, axes, k, starts[part], shapes[part], S, frame, depth, height, tip, axis
                )
                if best < low[i, kind]:
                    low[i, kind], rows[i, kind], part_of[i, kind] = best, k, part
                    top = highest(low[i], met)
                    half = along(S, frame, depth, top, middle)
