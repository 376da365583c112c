"""Compiled: the largest cutter at a contact point over all pallet angles, with its proof.

Notation: ``points`` (m, 3) check points in the order of the tree, ``own`` (m,) their surface, ``nodes`` (k, 4) balls
``x, y, z, radius`` of a complete binary tree, ``spans`` (k, 2) their points, ``leaves`` the first leaf; ``cc`` (16,) a
contact point ``S, N, E1, E2, K11, K12, K22, surface``; ``cone`` (2,) sin and cos of the table angle; ``tool`` (3,)
corner radius r, height ``cut`` above the corner's centres where the cutter ends, squared radius about S in which check
points of the same surface are left to the curvature. Lengths in mm, angles in rad. A limiting point of -1 is none, of
-2 the curvature at the contact.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.planning.impeller.arcs._kernels import at, forbidden, levels


@njit(cache=True, nogil=True)
def point_limit(h: float, yV: float, yy: float, r: float, cut: float) -> float:
    """Largest rho [mm] that leaves one check point clear; inf: any."""
    if h < -r or h >= cut:
        return math.inf
    if h >= 0.0:
        top, den = yy - h * h - r * r, r + yV
    else:
        top, den = yy - r * r, yV + math.sqrt(r * r - h * h)
    return 0.5 * top / den if den > 0.0 else math.inf


@njit(cache=True, nogil=True)
def contact_limit(a: float, b: float, s2: float, r: float, K11: float, K12: float, K22: float) -> float:
    """Largest rho [mm] that the curvature at the contact admits."""
    det = K11 * K22 - K12 * K12
    den = K11 * b * b - 2.0 * K12 * a * b + K22 * a * a - r * s2 * det
    if den <= 0.0:
        return math.inf
    return s2 * math.sqrt(s2) * (1.0 - r * (K11 + K22) + r * r * det) / den


@njit(cache=True, nogil=True)
def largest_at(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, tool: Any, B: float, best: float,
    which: int, hints: Any, hinted: int,
) -> tuple[float, int]:  # fmt: skip
    """Least limit rho at B over all check points that is below ``best``, and its point; ``hints`` are tried first."""
    Tx, Ty, Tz = cone[0] * math.cos(B), cone[0] * math.sin(B), cone[1]
    n = cc[3] * Tx + cc[4] * Ty + cc[5] * Tz
    a = cc[6] * Tx + cc[7] * Ty + cc[8] * Tz
    b = cc[9] * Tx + cc[10] * Ty + cc[11] * Tz
    s2 = a * a + b * b
    if s2 == 0.0:
        return best, which
    r, cut, near2 = tool[0], tool[1], tool[2]
    sid = int(cc[15])
    s = math.sqrt(s2)
    Vx, Vy, Vz = (cc[3] - n * Tx) / s, (cc[4] - n * Ty) / s, (cc[5] - n * Tz) / s
    Cx, Cy, Cz = cc[0] + r * cc[3], cc[1] + r * cc[4], cc[2] + r * cc[5]
    limit = contact_limit(a, b, s2, r, cc[12], cc[13], cc[14])
    if limit < best:
        best, which = limit, -2
    for k in range(hinted):
        i = hints[k]
        if i < 0:
            continue
        x, y, z = points[i, 0] - Cx, points[i, 1] - Cy, points[i, 2] - Cz
        limit = point_limit(x * Tx + y * Ty + z * Tz, x * Vx + y * Vy + z * Vz, x * x + y * y + z * z, r, cut)
        if limit < best:
            best, which = limit, i
    stack = np.empty(64, dtype=np.int64)
    keys = np.empty(64)
    stack[0], keys[0] = 0, -math.inf
    top = 1
    while top > 0:
        top -= 1
        k = stack[top]
        rho = max(best, 0.0)
        for child in range(2 * k + 1, 2 * k + 3) if k < leaves else range(k, k + 1):
            x, y, z = nodes[child, 0] - Cx, nodes[child, 1] - Cy, nodes[child, 2] - Cz
            R = nodes[child, 3]
            h = x * Tx + y * Ty + z * Tz
            if h + R < -r or h - R >= cut or R < 0.0:
                continue
            P = rho + (r if h + R >= 0.0 else math.sqrt(r * r - (h + R) * (h + R))) + R
            d2 = x * x + y * y + z * z - h * h - 2.0 * rho * (x * Vx + y * Vy + z * Vz) + rho * rho
            if d2 >= P * P:
                continue
            if child < leaves:
                key = d2 - P * P
                stack[top], keys[top] = child, key
                if top > 0 and child == 2 * k + 2 and stack[top - 1] == child - 1 and keys[top - 1] < key:
                    stack[top], keys[top] = child - 1, keys[top - 1]
                    stack[top - 1], keys[top - 1] = child, key
                top += 1
                continue
            for i in range(spans[child, 0], spans[child, 1]):
                x, y, z = points[i, 0] - Cx, points[i, 1] - Cy, points[i, 2] - Cz
                h = x * Tx + y * Ty + z * Tz
                if h < -r or h >= cut:
                    continue
                yy = x * x + y * y + z * z
                yV = x * Vx + y * Vy + z * Vz
                if h >= 0.0:
                    over, den = yy - h * h - r * r, r + yV
                else:
                    over, den = yy - r * r, yV + math.sqrt(r * r - h * h)
                if den <= 0.0 or over >= 2.0 * den * best:
                    continue
                if own[i] == sid:
                    u, v, w = points[i, 0] - cc[0], points[i, 1] - cc[1], points[i, 2] - cc[2]
                    if u * u + v * v + w * w < near2:
                        continue
                best, which = 0.5 * over / den, i
    return best, which


@njit(cache=True, nogil=True)
def trigs(y: Any, cc: Any, cone: Any, out: Any) -> None:
    """Rows h, n, a, b of ``out`` (4, 3): ``f0 + f1 cos B + f2 sin B``."""
    for i in range(4):
        f = y if i == 0 else cc[3 * i : 3 * i + 3]
        out[i, 0], out[i, 1], out[i, 2] = f[2] * cone[1], f[0] * cone[0], f[1] * cone[0]


@njit(cache=True, nogil=True)
def point_arcs(
    points: Any, i: int, cc: Any, cone: Any, rho: float, r: float, stages: Any, lo: float, hi: float, least: float,
    out: Any, count: int,
) -> int:  # fmt: skip
    """Adds what point ``i`` (-2: the curvature at the contact) forbids in lo..hi to ``out``; the new count."""
    y, trig = np.zeros(3), np.empty((4, 3))
    if i >= 0:
        for j in range(3):
            y[j] = points[i, j] - cc[j] - r * cc[3 + j]
    trigs(y, cc, cone, trig)
    yN = y[0] * cc[3] + y[1] * cc[4] + y[2] * cc[5]
    yy = y[0] * y[0] + y[1] * y[1] + y[2] * y[2]
    return forbidden(i == -2, trig, yN, yy, rho, r, stages, cc[12:15], lo, hi, least, out, count)  # type: ignore[no-any-return]


@njit(cache=True, nogil=True)
def domain(cc: Any, cone: Any, lo: float, hi: float, out: Any) -> int:
    """Parts of lo..hi where n >= 0 as rows of ``out``; how many."""
    cuts = np.empty(8)
    f = np.array([cc[5] * cone[1], cc[3] * cone[0], cc[4] * cone[0]])
    m = levels(f, 0.0, lo, hi, cuts, 0)
    cuts[:m] = np.sort(cuts[:m])
    cuts[m] = hi
    found = 0
    left = lo
    for k in range(m + 1):
        mid = 0.5 * (left + cuts[k])
        if cuts[k] > left and at(f, math.cos(mid), math.sin(mid)) >= 0.0:
            out[found, 0], out[found, 1] = left, cuts[k]
            found += 1
        left = cuts[k]
    return found


@njit(cache=True, nogil=True)
def gaps(parts: Any, count: int, arcs: Any, number: int, least: float, out: Any) -> int:
    """What the ``arcs`` leave of the ``parts``, wider than ``least``, as rows of ``out``; how many."""
    order = np.argsort(arcs[:number, 0])
    found = 0
    for k in range(count):
        reached = parts[k, 0]
        for j in range(number + 1):
            left = parts[k, 1] if j == number else min(arcs[order[j], 0], parts[k, 1])
            if left - reached > least and found < len(out):
                out[found, 0], out[found, 1] = reached, left
                found += 1
            if j < number:
                reached = max(reached, arcs[order[j], 1])
    return found


@njit(cache=True, nogil=True)
def climb(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, tool: Any, lo: float, hi: float,
    cap: float, least: float, hints: Any, hinted: int,
) -> tuple[float, float, int]:  # fmt: skip
    """Golden section for the largest limit in lo..hi: (rho, B, limiting point)."""
    g = 0.5 * (math.sqrt(5.0) - 1.0)
    x = np.array([hi - g * (hi - lo), lo + g * (hi - lo)])
    f, who = np.full(2, -math.inf), np.full(2, -1)
    step, side = 0, 0
    while True:
        f[side], who[side] = largest_at(
            points, own, nodes, spans, leaves, cc, cone, tool, x[side], cap, -1, hints, hinted
        )
        step += 1
        if step == 1:
            side = 1
            continue
        if hi - lo <= least or max(f[0], f[1]) >= cap:
            break
        side = 1 if f[0] < f[1] else 0
        if side == 1:
            lo, x[0], f[0], who[0] = x[0], x[1], f[1], who[1]
            x[1] = lo + g * (hi - lo)
        else:
            hi, x[1], f[1], who[1] = x[1], x[0], f[0], who[0]
            x[0] = hi - g * (hi - lo)
    k = 1 if f[0] < f[1] else 0
    return f[k], x[k], who[k]


@njit(cache=True, nogil=True)
def scan(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, tool: Any, parts: Any, count: int,
    cap: float, step: float, blockers: Any,
) -> tuple[float, float, float, int]:  # fmt: skip
    """Coarse grid of B: (largest rho, its B, the width of a cell there, how many ``blockers`` were met)."""
    best, where, width = -math.inf, 0.0, 0.0
    number = 0
    hints = np.empty(2, dtype=np.int64)
    for k in range(count):
        cells = max(math.ceil((parts[k, 1] - parts[k, 0]) / step), 1)
        w = (parts[k, 1] - parts[k, 0]) / cells
        hints[0], hints[1] = -1, -1
        # both ends too: n = 0, the flank along the surface, is often the best
        for j in range(-1, cells + 1):
            B = min(max(parts[k, 0] + (j + 0.5) * w, parts[k, 0]), parts[k, 1])
            rho, i = largest_at(points, own, nodes, spans, leaves, cc, cone, tool, B, cap, -1, hints, 2)
            if rho > best:
                best, where, width = rho, B, w
            if i != hints[0]:
                hints[1], hints[0] = hints[0], i
                number = remember(blockers, number, i)
    return best, where, width, number


@njit(cache=True, nogil=True)
def remember(blockers: Any, number: int, i: int) -> int:
    """Adds point ``i`` to the ``blockers`` if it is a new one; the new number."""
    if i == -1 or number == len(blockers):
        return number
    for k in range(number):
        if blockers[k] == i:
            return number
    blockers[number] = i
    return number + 1


@njit(cache=True, nogil=True)
def known_limit(points: Any, cc: Any, cone: Any, tool: Any, B: float, blockers: Any, number: int) -> tuple[float, int]:
    """As :func:`largest_at`, over the ``blockers`` alone."""
    Tx, Ty, Tz = cone[0] * math.cos(B), cone[0] * math.sin(B), cone[1]
    n = cc[3] * Tx + cc[4] * Ty + cc[5] * Tz
    a = cc[6] * Tx + cc[7] * Ty + cc[8] * Tz
    b = cc[9] * Tx + cc[10] * Ty + cc[11] * Tz
    s2 = a * a + b * b
    if s2 == 0.0:
        return math.inf, -1
    r, s = tool[0], math.sqrt(s2)
    best, which = contact_limit(a, b, s2, r, cc[12], cc[13], cc[14]), -2
    for k in range(number):
        i = blockers[k]
        if i < 0:
            continue
        x, y, z = (points[i, 0] - cc[0] - r * cc[3], points[i, 1] - cc[1] - r * cc[4], points[i, 2] - cc[2] - r * cc[5])
        h = x * Tx + y * Ty + z * Tz
        yV = (x * cc[3] + y * cc[4] + z * cc[5] - n * h) / s
        limit = point_limit(h, yV, x * x + y * y + z * z, r, tool[1])
        if limit < best:
            best, which = limit, i
    return best, which


@njit(cache=True, nogil=True)
def cover(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, tool: Any, parts: Any, count: int,
    floor: float, cap: float, eps: float, least: float, best: float, where: float, blockers: Any, number: int,
    used: Any,
) -> tuple[float, float, float, int, bool]:  # fmt: skip
    """Raises ``best`` until the arcs of few points forbid every B to a larger one.

    Takes a gap, finds the point that limits its middle, takes that point's arcs out of the gap; what is forbidden to a
    cutter stays forbidden to a larger one. (largest rho, its B, proved bound, number of points ``used``, proved.)
    """
    stages = np.array([[0.0, 0.0], [tool[1], 0.0]]) if tool[1] < math.inf else np.array([[0.0, 0.0]])
    arcs, free, one = np.empty((32, 2)), np.empty((33, 2)), np.empty((1, 2))
    stack = np.empty((256, 2))
    stack[:count] = parts[:count]
    target = max(best + eps, floor)
    taken, top = 0, count
    for _ in range(4000):
        if best >= cap:
            return cap, where, cap, taken, True
        if top == 0:
            return best, where, target, taken, True
        top -= 1
        lo, hi = stack[top, 0], stack[top, 1]
        B = 0.5 * (lo + hi)
        rho, i = known_limit(points, cc, cone, tool, B, blockers, number)
        if rho >= target:
            rho, i = largest_at(points, own, nodes, spans, leaves, cc, cone, tool, B, cap, -1, blockers, number)
            number = remember(blockers, number, i)
            if rho >= target:
                high, C, i = climb(
                    points, own, nodes, spans, leaves, cc, cone, tool, lo, hi, cap, 1e-3 * eps, blockers, number
                )
                number = remember(blockers, number, i)
                if high > rho:
                    rho, B = high, C
                best, where, target = rho, B, rho + eps
                top += 1
                continue
            if rho > best:
                best, where = rho, B
        filled = point_arcs(points, i, cc, cone, target, tool[0], stages, lo, hi, least, arcs, 0)
        one[0, 0], one[0, 1] = lo, hi
        left = gaps(one, 1, arcs, filled, least, free)
        if left + top > len(stack) or filled == 0:
            break
        size = taken
        taken = remember(used, taken, i)
        if taken == size and size == len(used) and used[size - 1] != i:
            break
        for g in range(left):
            stack[top], top = free[g], top + 1
    return best, where, target, taken, False


@njit(cache=True, nogil=True)
def search(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, ccs: Any, cones: Any, tool: Any, limits: Any,
    floor: float, cap: float, eps: float, least: float, step: float, every: bool, first: int, last: int, best: Any,
    where: Any, bound: Any, proved: Any, proof: Any,
) -> None:  # fmt: skip
    """Fills rows ``first``..``last`` of the tables (contact point, table angle).

    ``every``: each table angle to its own largest cutter; else only to the proof that it takes none larger than the
    best table angle does. ``limits`` (k, 2): pallet angles that the machine reaches.
    """
    tables, size = len(cones), proof.shape[2]
    parts, count = np.empty((tables, 3 * len(limits), 2)), np.zeros(tables, dtype=np.int64)
    blockers, number = np.empty((tables, size), dtype=np.int64), np.zeros(tables, dtype=np.int64)
    width, used = np.zeros(tables), np.empty(size, dtype=np.int64)
    for c in range(first, last):
        cc = ccs[c]
        for t in range(tables):
            count[t] = 0
            for k in range(len(limits)):
                count[t] += domain(cc, cones[t], limits[k, 0], limits[k, 1], parts[t, count[t] :])
            number[t] = 0
            best[c, t], where[c, t], width[t], number[t] = scan(
                points, own, nodes, spans, leaves, cc, cones[t], tool, parts[t], count[t], cap, step, blockers[t]
            )
        order = np.argsort(-best[c])
        high = -math.inf
        for j in range(tables):
            t = order[j]
            if count[t] == 0:
                bound[c, t], proved[c, t] = -math.inf, True
                continue
            if (every or j == 0) and best[c, t] < cap:
                k = 0
                while where[c, t] > parts[t, k, 1]:
                    k += 1
                rho, B, i = climb(
                    points, own, nodes, spans, leaves, cc, cones[t], tool, max(where[c, t] - width[t], parts[t, k, 0]),
                    min(where[c, t] + width[t], parts[t, k, 1]), cap, 1e-3 * eps, blockers[t], number[t],
                )  # fmt: skip
                if rho > best[c, t]:
                    best[c, t], where[c, t] = rho, B
                    number[t] = remember(blockers[t], number[t], i)
            start = floor if every else max(floor, high + eps)
            best[c, t], where[c, t], bound[c, t], taken, proved[c, t] = cover(
                points, own, nodes, spans, leaves, cc, cones[t], tool, parts[t], count[t], start, cap, eps, least,
                best[c, t], where[c, t], blockers[t], number[t], used,
            )  # fmt: skip
            high = max(high, best[c, t])
            proof[c, t, :taken] = used[:taken]
