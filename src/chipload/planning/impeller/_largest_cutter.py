"""Compiled: the largest cutter at a contact point over all pallet angles, with its proof.

Notation: ``points`` (m, 3) check points in the order of the tree, ``own`` (m,) their surface, ``nodes`` (k, 4) balls
``x, y, z, radius`` of a complete binary tree, ``spans`` (k, 2) their points, ``leaves`` the first leaf; ``cc`` (16,) a
contact point ``S, N, E1, E2, K11, K12, K22, surface``; ``cone`` (2,) sin and cos of the table angle; ``tool`` (3,)
corner radius r, height ``cut`` above the corner's centre at which the cutter ends, squared radius about S within which
the curvature stands for the check points of the same surface. Lengths in mm, angles in rad. The limit is the largest
rho at which the cutter is clear. Number of a limiting point: -1 none, -2 the curvature at the contact.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.planning.impeller._pallet_arcs import forbidden_arcs, level_crossings, trig_value


@njit(cache=True, nogil=True)
def point_limit(h: float, yV: float, yy: float, r: float, cut: float) -> float:
    """Largest rho [mm] at which one check point is clear of the cutter; inf: at any rho."""
    if h < -r or h >= cut:
        return math.inf
    if h >= 0.0:
        numerator, den = yy - h * h - r * r, r + yV
    else:
        numerator, den = yy - r * r, yV + math.sqrt(r * r - h * h)
    return 0.5 * numerator / den if den > 0.0 else math.inf


@njit(cache=True, nogil=True)
def contact_limit(a: float, b: float, s2: float, r: float, K11: float, K12: float, K22: float) -> float:
    """Largest rho [mm] that the curvature at the contact admits; inf: any.

    ``a``, ``b`` parts of T along the tangents, ``s2`` their sum of squares.
    """
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
    """Least limit at B over all check points, at most ``best``, and its point, ``which`` where none is below ``best``.

    The first ``hinted`` of ``hints`` are tried first; they tighten the bound that prunes the tree.
    """
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
                    numerator, den = yy - h * h - r * r, r + yV
                else:
                    numerator, den = yy - r * r, yV + math.sqrt(r * r - h * h)
                if den <= 0.0 or numerator >= 2.0 * den * best:
                    continue
                if own[i] == sid:
                    u, v, w = points[i, 0] - cc[0], points[i, 1] - cc[1], points[i, 2] - cc[2]
                    if u * u + v * v + w * w < near2:
                        continue
                best, which = 0.5 * numerator / den, i
    return best, which


@njit(cache=True, nogil=True)
def trig_rows(y: Any, cc: Any, cone: Any, out: Any) -> None:
    """Coefficients of h, n, a, b as functions of B, rows of ``out`` (4, 3): ``f0 + f1 cos B + f2 sin B``."""
    for i in range(4):
        f = y if i == 0 else cc[3 * i : 3 * i + 3]
        out[i, 0], out[i, 1], out[i, 2] = f[2] * cone[1], f[0] * cone[0], f[1] * cone[0]


@njit(cache=True, nogil=True)
def point_arcs(
    points: Any, i: int, cc: Any, cone: Any, rho: float, r: float, stages: Any, lo: float, hi: float, least: float,
    out: Any, count: int,
) -> int:  # fmt: skip
    """Append the arcs of lo..hi that point ``i`` forbids (-2: the curvature there) to ``out``; the new count."""
    y, trig = np.zeros(3), np.empty((4, 3))
    if i >= 0:
        for j in range(3):
            y[j] = points[i, j] - cc[j] - r * cc[3 + j]
    trig_rows(y, cc, cone, trig)
    yN = y[0] * cc[3] + y[1] * cc[4] + y[2] * cc[5]
    yy = y[0] * y[0] + y[1] * y[1] + y[2] * y[2]
    return forbidden_arcs(i == -2, trig, yN, yy, rho, r, stages, cc[12:15], lo, hi, least, out, count)  # type: ignore[no-any-return]


@njit(cache=True, nogil=True)
def facing_parts(cc: Any, cone: Any, lo: float, hi: float, out: Any) -> int:
    """Write the parts of lo..hi in which n >= 0 to ``out`` (k, 2); their number."""
    cuts = np.empty(8)
    f = np.array([cc[5] * cone[1], cc[3] * cone[0], cc[4] * cone[0]])
    m = level_crossings(f, 0.0, lo, hi, cuts, 0)
    cuts[:m] = np.sort(cuts[:m])
    cuts[m] = hi
    total = 0
    begin = lo
    for k in range(m + 1):
        mid = 0.5 * (begin + cuts[k])
        if cuts[k] > begin and trig_value(f, math.cos(mid), math.sin(mid)) >= 0.0:
            out[total, 0], out[total, 1] = begin, cuts[k]
            total += 1
        begin = cuts[k]
    return total


@njit(cache=True, nogil=True)
def uncovered_parts(parts: Any, count: int, arcs: Any, number: int, least: float, out: Any) -> int:
    """Write the parts outside all ``arcs``, where they are wider than ``least``, to ``out``; their number."""
    order = np.argsort(arcs[:number, 0])
    total = 0
    for k in range(count):
        reached = parts[k, 0]
        for j in range(number + 1):
            end = parts[k, 1] if j == number else min(arcs[order[j], 0], parts[k, 1])
            if end - reached > least and total < len(out):
                out[total, 0], out[total, 1] = reached, end
                total += 1
            if j < number:
                reached = max(reached, arcs[order[j], 1])
    return total


@njit(cache=True, nogil=True)
def golden_section(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, tool: Any, lo: float, hi: float,
    cap: float, least: float, hints: Any, hinted: int,
) -> tuple[float, float, int]:  # fmt: skip
    """Golden-section search for the largest limit in lo..hi: (rho, B, limiting point).

    It ends when the interval is at most ``least`` wide, or the limit reaches ``cap``.
    """
    g = 0.5 * (math.sqrt(5.0) - 1.0)
    x = np.array([hi - g * (hi - lo), lo + g * (hi - lo)])
    f, point = np.full(2, -math.inf), np.full(2, -1)
    step, side = 0, 0
    while True:
        f[side], point[side] = largest_at(
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
            lo, x[0], f[0], point[0] = x[0], x[1], f[1], point[1]
            x[1] = lo + g * (hi - lo)
        else:
            hi, x[1], f[1], point[1] = x[1], x[0], f[0], point[0]
            x[0] = hi - g * (hi - lo)
    k = 1 if f[0] < f[1] else 0
    return f[k], x[k], point[k]


@njit(cache=True, nogil=True)
def coarse_search(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, tool: Any, parts: Any, count: int,
    cap: float, step: float, blockers: Any,
) -> tuple[float, float, float, int]:  # fmt: skip
    """Search a grid of B of at most ``step``: (largest rho, its B, width of the grid there, number of ``blockers``).

    ``blockers`` (k,) receives the limiting points of the grid.
    """
    best, best_B, width = -math.inf, 0.0, 0.0
    number = 0
    hints = np.empty(2, dtype=np.int64)
    for k in range(count):
        cells = max(math.ceil((parts[k, 1] - parts[k, 0]) / step), 1)
        w = (parts[k, 1] - parts[k, 0]) / cells
        hints[0], hints[1] = -1, -1
        # the ends are evaluated too: the largest limit is often at n = 0, with the flank along the surface
        for j in range(-1, cells + 1):
            B = min(max(parts[k, 0] + (j + 0.5) * w, parts[k, 0]), parts[k, 1])
            rho, i = largest_at(points, own, nodes, spans, leaves, cc, cone, tool, B, cap, -1, hints, 2)
            if rho > best:
                best, best_B, width = rho, B, w
            if i != hints[0]:
                hints[1], hints[0] = hints[0], i
                number = add_blocker(blockers, number, i)
    return best, best_B, width, number


@njit(cache=True, nogil=True)
def add_blocker(blockers: Any, number: int, i: int) -> int:
    """Append point ``i`` to the ``blockers`` unless it is one of them; the new number."""
    if i == -1 or number == len(blockers):
        return number
    for k in range(number):
        if blockers[k] == i:
            return number
    blockers[number] = i
    return number + 1


@njit(cache=True, nogil=True)
def limit_of_blockers(
    points: Any, cc: Any, cone: Any, tool: Any, B: float, blockers: Any, number: int
) -> tuple[float, int]:
    """As :func:`largest_at`, over the first ``number`` of the ``blockers`` alone."""
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
def prove_limit(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, tool: Any, parts: Any, count: int,
    floor: float, cap: float, eps: float, least: float, best: float, best_B: float, blockers: Any, number: int,
    used: Any,
) -> tuple[float, float, float, int, bool]:  # fmt: skip
    """Raise ``best`` until the arcs of few points forbid every B to a cutter larger by ``eps``.

    For each part of B that is still free, the point that limits its middle is found and its arcs are removed from the
    part; an arc that is forbidden to a cutter is forbidden to every larger one. Returns the largest rho, its B, the
    proved bound, the number of points ``used`` in the proof, and whether the bound is proved.
    """
    stages = np.array([[0.0, 0.0], [tool[1], 0.0]]) if tool[1] < math.inf else np.array([[0.0, 0.0]])
    arcs, free, part = np.empty((32, 2)), np.empty((33, 2)), np.empty((1, 2))
    stack = np.empty((256, 2))
    stack[:count] = parts[:count]
    target = max(best + eps, floor)
    used_count, top = 0, count
    for _ in range(4000):
        if best >= cap:
            return cap, best_B, cap, used_count, True
        if top == 0:
            return best, best_B, target, used_count, True
        top -= 1
        lo, hi = stack[top, 0], stack[top, 1]
        B = 0.5 * (lo + hi)
        rho, i = limit_of_blockers(points, cc, cone, tool, B, blockers, number)
        if rho >= target:
            rho, i = largest_at(points, own, nodes, spans, leaves, cc, cone, tool, B, cap, -1, blockers, number)
            number = add_blocker(blockers, number, i)
            if rho >= target:
                rho_top, B_top, i = golden_section(
                    points, own, nodes, spans, leaves, cc, cone, tool, lo, hi, cap, 1e-3 * eps, blockers, number
                )
                number = add_blocker(blockers, number, i)
                if rho_top > rho:
                    rho, B = rho_top, B_top
                best, best_B, target = rho, B, rho + eps
                top += 1
                continue
            if rho > best:
                best, best_B = rho, B
        filled = point_arcs(points, i, cc, cone, target, tool[0], stages, lo, hi, least, arcs, 0)
        part[0, 0], part[0, 1] = lo, hi
        free_count = uncovered_parts(part, 1, arcs, filled, least, free)
        if free_count + top > len(stack) or filled == 0:
            break
        before = used_count
        used_count = add_blocker(used, used_count, i)
        if used_count == before and before == len(used) and used[before - 1] != i:
            break
        for g in range(free_count):
            stack[top], top = free[g], top + 1
    return best, best_B, target, used_count, False


@njit(cache=True, nogil=True)
def search(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, ccs: Any, cones: Any, tool: Any, limits: Any,
    floor: float, cap: float, eps: float, least: float, step: float, every: bool, first: int, last: int, best: Any,
    pallet: Any, bound: Any, proved: Any, proof: Any,
) -> None:  # fmt: skip
    """Fill rows ``first``..``last`` of the results (contact point, table angle): largest rho, its B, bound and proof.

    ``every``: the largest cutter of every table angle is found; else, of all but the best table angle, only the proof
    that no larger cutter fits there. ``limits`` (k, 2): pallet angles that the machine reaches.
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
                count[t] += facing_parts(cc, cones[t], limits[k, 0], limits[k, 1], parts[t, count[t] :])
            number[t] = 0
            best[c, t], pallet[c, t], width[t], number[t] = coarse_search(
                points, own, nodes, spans, leaves, cc, cones[t], tool, parts[t], count[t], cap, step, blockers[t]
            )
        order = np.argsort(-best[c])
        highest = -math.inf
        for j in range(tables):
            t = order[j]
            if count[t] == 0:
                bound[c, t], proved[c, t] = -math.inf, True
                continue
            if (every or j == 0) and best[c, t] < cap:
                k = 0
                while pallet[c, t] > parts[t, k, 1]:
                    k += 1
                rho, B, i = golden_section(
                    points, own, nodes, spans, leaves, cc, cones[t], tool, max(pallet[c, t] - width[t], parts[t, k, 0]),
                    min(pallet[c, t] + width[t], parts[t, k, 1]), cap, 1e-3 * eps, blockers[t], number[t],
                )  # fmt: skip
                if rho > best[c, t]:
                    best[c, t], pallet[c, t] = rho, B
                    number[t] = add_blocker(blockers[t], number[t], i)
            start = floor if every else max(floor, highest + eps)
            best[c, t], pallet[c, t], bound[c, t], used_count, proved[c, t] = prove_limit(
                points, own, nodes, spans, leaves, cc, cones[t], tool, parts[t], count[t], start, cap, eps, least,
                best[c, t], pallet[c, t], blockers[t], number[t], used,
            )  # fmt: skip
            highest = max(highest, best[c, t])
            proof[c, t, :used_count] = used[:used_count]
