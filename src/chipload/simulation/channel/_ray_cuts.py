"""Compiled: where the moving cutter meets rays normal to a surface.

Notation: a ray is S + s N, S a point of the surface, N its normal, s [mm] from -depth to height; its ``frame`` (3, 3)
has the rows e1, e2, N. A part of the tool is a row ``[r, e, f, m, z1, z2, c, tb, h, big, R, E, F, z3]`` as in the
kernels of the dexels, and the height ``start`` above the tip at which it begins. On a move the tip goes straight and
the axis along the normalised chord. The lower end of the part of a ray that is in the tool is a convex function of time
on a straight move: its least value is found by a golden-section search around the lowest of some instants.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.stock._dexels import pierce

_HALF_ROOT = math.sqrt(0.5)
_GOLDEN = 0.6180339887498949
_STEPS = 14
#: greatest distance of the poses of a move from its middle pose, as a share of its sweep; allows for its turn
_HALF = 0.55
#: between two instants a part is lower than at both by less than this [mm]: for remaining material, for gouges
_LEFT, _DIP = 0.1, 0.05
#: successive points that share one list of groups in reach; relative allowance for rounding
_POINTS, _ROUNDED = 32, 1e-9


@njit(cache=True, nogil=True)
def bound_groups(tips: Any, axes: Any, size: int, out: Any) -> None:
    """Bounds of the moves in groups of ``size``, rows of ``out`` (g, 8).

    Centre and radius [mm] of a ball round their tips, the mean axis, and the greatest length of the difference of an
    axis from it. Move k goes from pose k - 1 to pose k.
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
            # axes that cancel have no mean; any direction is valid, as the difference from it is measured below
            out[g, 4 + j] = out[g, 4 + j] / norm if norm > 1e-9 else axes[first, j]
        for k in range(first - 1, last):
            ball = spread = 0.0
            for j in range(3):
                ball += (tips[k, j] - out[g, j]) ** 2
                spread += (axes[k, j] - out[g, 4 + j]) ** 2
            out[g, 3] = max(out[g, 3], math.sqrt(ball))
            out[g, 7] = max(out[g, 7], math.sqrt(spread))


@njit(cache=True, nogil=True)
def part_distance(h: float, d: float, start: float, shape: Any) -> float:
    """Lower bound [mm] of the distance of a point from a part; negative inside.

    ``h`` [mm] height of the point above the tip, ``d`` [mm] its distance from the axis.
    """
    x, r, e = h - start - shape[2], shape[0], shape[1]
    if shape[7] > 0.0 or shape[10] > 0.0:
        # a tapered or barrel cutter lies inside the cone of its flank line, below its top, and inside the cone
        # of 45 deg that touches its corner
        z = h - start
        chamfer = (d - e - x) * _HALF_ROOT - r if shape[2] - shape[5] <= r * _HALF_ROOT else -z
        cone = (d - shape[6] - shape[7] * z) / math.sqrt(1.0 + shape[7] * shape[7])
        return float(max(-z, z - shape[8], cone, chamfer, d - shape[9]))
    if x <= 0.0:
        return float(math.sqrt((d - e) * (d - e) + x * x) - r if d > e else -x - r)
    return float(max(d - e - r, h - start - shape[8]))


@njit(cache=True, nogil=True)
def out_of_reach(group: Any, middle: Any, half: float, starts: Any, shapes: Any) -> bool:
    """Whether no move of a group can meet a ray of half the length ``half`` [mm] about its ``middle``."""
    x, y, z = middle[0] - group[0], middle[1] - group[1], middle[2] - group[2]
    length = math.sqrt(x * x + y * y + z * z)
    h = x * group[4] + y * group[5] + z * group[6]
    slack = group[3] + length * group[7] + half
    d = math.sqrt(max(length * length - h * h, 0.0))
    nearest = math.inf
    for part in range(len(shapes)):
        nearest = min(nearest, part_distance(h, d, starts[part], shapes[part]))
    return bool(nearest > slack)


@njit(cache=True, nogil=True)
def bounding_ball(points: Any, first: int, last: int, middle: Any) -> float:
    """Radius [mm] of a ball round the points ``first``..``last`` - 1; writes its centre to ``middle``."""
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
    """Write the groups whose moves may meet rays within ``reach`` [mm] of points ``first``..``last`` - 1 to ``out``.

    Their number; they ascend. :func:`out_of_reach` holds for every other group and each of these points.
    """
    half = (bounding_ball(points, first, last, middle) + reach) * (1.0 + _ROUNDED)
    found = 0
    for g in range(len(groups)):
        if not out_of_reach(groups[g], middle, half, starts, shapes):
            out[found] = g
            found += 1
    return found


@njit(cache=True, nogil=True)
def lowest_on_ray(
    t: float, tips: Any, axes: Any, k: int, start: float, shape: Any, S: Any, frame: Any, depth: float, height: float,
    tip: Any, axis: Any,
) -> float:  # fmt: skip
    """Least s [mm] of the ray in the part at the share ``t`` of move k, at least -depth; ``height``: it is not met.

    Workspace: ``tip``, ``axis`` (3,).
    """
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
def sweep_of_move(middle: Any, tips: Any, axes: Any, k: int, half: float) -> tuple[float, float, float]:
    """Sweep [mm] of the tool past a ray in move k, and height and distance of the ray's middle at the middle pose.

    The ray is of half the length ``half`` about ``middle``; the sweep bounds the travel of the tool's points near it.
    The height is measured along the axis from the tip, the distance from the axis.
    """
    norm = h = distance2 = travel2 = turn2 = 0.0
    for j in range(3):
        a = axes[k, j] + axes[k - 1, j]
        x = middle[j] - 0.5 * (tips[k, j] + tips[k - 1, j])
        norm += a * a
        h += a * x
        distance2 += x * x
        travel2 += (tips[k, j] - tips[k - 1, j]) ** 2
        turn2 += (axes[k, j] - axes[k - 1, j]) ** 2
    h /= math.sqrt(norm)
    travel = math.sqrt(travel2)
    sweep = travel + math.sqrt(turn2) * (math.sqrt(distance2) + travel + half)
    return sweep, h, math.sqrt(max(distance2 - h * h, 0.0))


@njit(cache=True, nogil=True)
def distance_at(t: float, tips: Any, axes: Any, k: int, start: float, shape: Any, middle: Any) -> float:
    """Lower bound [mm] of the distance of the point ``middle`` from the part at the share ``t`` of move k."""
    norm = h = squared = 0.0
    for j in range(3):
        a = axes[k - 1, j] * (1.0 - t) + axes[k, j] * t
        x = middle[j] - tips[k - 1, j] * (1.0 - t) - tips[k, j] * t
        norm += a * a
        h += a * x
        squared += x * x
    h /= math.sqrt(norm)
    return float(part_distance(h, math.sqrt(max(squared - h * h, 0.0)), start, shape))


@njit(cache=True, nogil=True)
def lowest_of_instants(
    count: int, tips: Any, axes: Any, k: int, start: float, shape: Any, S: Any, frame: Any, depth: float,
    height: float, tip: Any, axis: Any, middle: Any, near: float,
) -> tuple[float, int]:  # fmt: skip
    """Least :func:`lowest_on_ray` of the instants 0..count of move k, and the number of that instant.

    Instants at which the part is farther than ``near`` [mm] from ``middle`` are left out.
    """
    best, at = height, 0
    for m in range(count + 1):
        if distance_at(m / count, tips, axes, k, start, shape, middle) > near:
            continue
        s = lowest_on_ray(m / count, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
        if s < best:
            best, at = s, m
    return best, at


@njit(cache=True, nogil=True)
def refined_lowest(
    best: float, at: int, count: int, tol: float, tips: Any, axes: Any, k: int, start: float, shape: Any, S: Any,
    frame: Any, depth: float, height: float, tip: Any, axis: Any,
) -> float:  # fmt: skip
    """Least :func:`lowest_on_ray` between the neighbours of instant ``at``, at most ``best``.

    Golden-section search, to ``tol`` [mm].
    """
    lo, hi = max(at - 1, 0) / count, min(at + 1, count) / count
    t1, t2 = hi - _GOLDEN * (hi - lo), lo + _GOLDEN * (hi - lo)
    f1 = lowest_on_ray(t1, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
    f2 = lowest_on_ray(t2, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
    for _ in range(_STEPS):
        best = min(best, f1, f2)
        if abs(f1 - f2) < tol and f1 < height:
            break
        if f1 <= f2:
            hi, t2, f2 = t2, t1, f1
            t1 = hi - _GOLDEN * (hi - lo)
            f1 = lowest_on_ray(t1, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
        else:
            lo, t1, f1 = t1, t2, f2
            t2 = lo + _GOLDEN * (hi - lo)
            f2 = lowest_on_ray(t2, tips, axes, k, start, shape, S, frame, depth, height, tip, axis)
    return float(min(best, f1, f2))


@njit(cache=True, nogil=True)
def half_ray(S: Any, frame: Any, depth: float, top: float, middle: Any) -> float:
    """Half the length [mm] of the ray from -depth to ``top``; writes its middle point to ``middle``."""
    for j in range(3):
        middle[j] = S[j] + 0.5 * (top - depth) * frame[2, j]
    return 0.5 * (top + depth)


@njit(cache=True, nogil=True)
def greatest_of_kinds(low: Any, met: Any) -> float:
    """Greatest of the least s of those kinds of parts that the tool has."""
    top = -math.inf
    for kind in range(len(low)):
        if met[kind]:
            top = max(top, low[kind])
    return top


@njit(cache=True, nogil=True)
def rest_and_gouge(
    points: Any, frames: Any, tips: Any, axes: Any, groups: Any, size: int, starts: Any, shapes: Any, cutting: Any,
    depth: float, height: float, step: float, tol: float, first: int, last: int, rest: Any, rest_row: Any, gouge: Any,
    gouge_row: Any, gouge_part: Any,
) -> None:  # fmt: skip
    """Remaining material and gouge at the points ``first``..``last`` - 1.

    ``rest`` (p,) [mm] lowest s of the cutting part in feed moves, ``gouge`` (p,) [mm] greatest depth of any part below
    the surface, the moves ``rest_row`` and ``gouge_row`` and the part ``gouge_part``. ``cutting`` (n,) whether a
    move is a feed move.
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
        # only the part of the ray below the least s known so far matters
        top = max(rest[i], 0.0)
        half = half_ray(S, frame, depth, top, middle)
        for g in near[:found]:
            # the moves of a group that is out of reach are skipped together
            if out_of_reach(groups[g], middle, half, starts, shapes):
                continue
            for k in range(1 + g * size, min(1 + (g + 1) * size, n)):
                sweep, h, d = sweep_of_move(middle, tips, axes, k, half)
                slack = _HALF * sweep + half
                for part in range(parts):
                    if part_distance(h, d, starts[part], shapes[part]) > slack:
                        continue
                    count = max(1, math.ceil(sweep / step))
                    best, at = lowest_of_instants(
                        count, tips, axes, k, starts[part], shapes[part], S, frame, depth, height, tip, axis,
                        middle, half + _LEFT,
                    )  # fmt: skip
                    if best >= height:
                        continue
                    known = rest[i] if part == 0 and cutting[k] else height
                    if best - _LEFT < known or best < _LEFT:
                        best = refined_lowest(
                            best, at, count, tol, tips, axes, k, starts[part], shapes[part], S, frame, depth, height,
                            tip, axis,
                        )  # fmt: skip
                    if part == 0 and cutting[k] and best < rest[i]:
                        rest[i], rest_row[i] = best, k
                        if top > 0.0:
                            top = max(best, 0.0)
                            half = half_ray(S, frame, depth, top, middle)
                    if -best > gouge[i]:
                        gouge[i], gouge_row[i], gouge_part[i] = -best, k, part


@njit(cache=True, nogil=True)
def lowest_of_kinds(
    points: Any, frames: Any, tips: Any, axes: Any, groups: Any, size: int, starts: Any, shapes: Any, kinds: Any,
    depth: float, height: float, step: float, tol: float, low: Any, rows: Any, part_of: Any,
) -> None:  # fmt: skip
    """Lower ``low`` (p, 3) [mm] to the least s of the ray of each point in the parts of each of the ``kinds`` 0..2.

    ``low`` holds the heights below which a value is wanted. ``rows``, ``part_of`` (p, 3) the move and the part.
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
        # only the part of the ray below the least s known so far of any kind matters
        top = greatest_of_kinds(low[i], met)
        half = half_ray(S, frame, depth, top, middle)
        for g in near[:found]:
            # the moves of a group that is out of reach are skipped together
            if out_of_reach(groups[g], middle, half, starts, shapes):
                continue
            for k in range(1 + g * size, min(1 + (g + 1) * size, n)):
                sweep, h, d = sweep_of_move(middle, tips, axes, k, half)
                slack = _HALF * sweep + half
                for part in range(parts):
                    if part_distance(h, d, starts[part], shapes[part]) > slack:
                        continue
                    kind = kinds[part]
                    count = max(1, math.ceil(sweep / step))
                    best, at = lowest_of_instants(
                        count, tips, axes, k, starts[part], shapes[part], S, frame, depth, height, tip, axis,
                        middle, half + _DIP,
                    )  # fmt: skip
                    if best >= height or best - _DIP >= low[i, kind]:
                        continue
                    best = refined_lowest(
                        best,
                        at,
                        count,
                        tol,
                        tips,
                        axes,
                        k,
                        starts[part],
                        shapes[part],
                        S,
                        frame,
                        depth,
                        height,
                        tip,
                        axis,
                    )
                    if best < low[i, kind]:
                        low[i, kind], rows[i, kind], part_of[i, kind] = best, k, part
                        top = greatest_of_kinds(low[i], met)
                        half = half_ray(S, frame, depth, top, middle)
