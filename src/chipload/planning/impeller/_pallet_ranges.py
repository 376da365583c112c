"""Compiled: the exact ranges of the pallet angle in which a cutter is clear of every check point.

Notation: as in ``_largest_cutter.py``; ``stages`` as in ``_clearance.py``, the radius of row 0 is not used
(it is rho + r). d distance of a check point from the cutter's axis. When B changes by dB, h changes by at most
sin(alpha) |y| dB and d by at most sin(alpha) (rho max(1, n/s) + |y - rho V|) dB. Only the check points that come within
the cutter by these bounds can forbid a part of B; their arcs are computed exactly.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.planning.impeller._largest_cutter import facing_parts, point_arcs, uncovered_parts
from chipload.planning.impeller._pallet_arcs import limit_function, radius_at
from chipload.planning.impeller._tree import next_node

#: half of the narrowest part of B for which a near point is proved clear before its arcs are calculated [rad]
FINE = math.radians(0.5)


@njit(cache=True, nogil=True)
def largest_radius(low: float, high: float, rho: float, r: float, stages: Any) -> float:
    """Largest radius [mm] of the cutter between two heights."""
    P = rho + r if len(stages) == 1 or low < stages[1, 0] else 0.0
    for j in range(1, len(stages)):
        if high >= stages[j, 0] and (j + 1 == len(stages) or low < stages[j + 1, 0]):
            P = max(P, stages[j, 1])
    return P


@njit(cache=True, nogil=True)
def points_in_reach(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, r: float, near2: float, rho: float,
    stages: Any, B: float, half: float, seen: Any, stamp: int, out: Any,
) -> int:  # fmt: skip
    """Write the check points that the cutter may meet within ``half`` of B to ``out``; their number.

    Points whose ``seen`` equals ``stamp`` are left out. -1: ``out`` is full.
    """
    Tx, Ty, Tz = cone[0] * math.cos(B), cone[0] * math.sin(B), cone[1]
    n = cc[3] * Tx + cc[4] * Ty + cc[5] * Tz
    s = math.sqrt(max(1.0 - n * n, 1e-300))
    Vx, Vy, Vz = (cc[3] - n * Tx) / s, (cc[4] - n * Ty) / s, (cc[5] - n * Tz) / s
    Cx, Cy, Cz = cc[0] + r * cc[3], cc[1] + r * cc[4], cc[2] + r * cc[5]
    turn = cone[0] * half
    least = s - turn
    slide = rho * turn * max(1.0, min(abs(n) + turn, 1.0) / least)
    sid = int(cc[15])
    count, node = 0, 0
    while node >= 0:
        enter, R = False, nodes[node, 3]
        if R >= 0.0:
            x, y, z = nodes[node, 0] - Cx, nodes[node, 1] - Cy, nodes[node, 2] - Cz
            h = x * Tx + y * Ty + z * Tz
            rise = turn * (math.sqrt(x * x + y * y + z * z) + R)
            u, v, w = x - rho * Vx, y - rho * Vy, z - rho * Vz
            length = math.sqrt(u * u + v * v + w * w)
            P = largest_radius(h - R - rise, h + R + rise, rho, r, stages) + R + slide + turn * (length + R)
            enter = h + R + rise >= -r and length * length - h * h <= P * P
        if enter and node >= leaves:
            for i in range(spans[node, 0], spans[node, 1]):
                if seen[i] == stamp:
                    continue
                x, y, z = points[i, 0] - Cx, points[i, 1] - Cy, points[i, 2] - Cz
                h = x * Tx + y * Ty + z * Tz
                rise = turn * math.sqrt(x * x + y * y + z * z)
                if h + rise < -r:
                    continue
                u, v, w = x - rho * Vx, y - rho * Vy, z - rho * Vz
                length = math.sqrt(u * u + v * v + w * w)
                P = largest_radius(h - rise, h + rise, rho, r, stages) + slide + turn * length
                if length * length - h * h > P * P:
                    continue
                seen[i] = stamp
                if own[i] == sid:
                    u, v, w = points[i, 0] - cc[0], points[i, 1] - cc[1], points[i, 2] - cc[2]
                    if u * u + v * v + w * w < near2:
                        continue
                if count == len(out):
                    return -1
                out[count] = i
                count += 1
        node = next_node(node, leaves, enter)
    return count


@njit(cache=True, nogil=True)
def clear_within(
    points: Any, i: int, cc: Any, cone: Any, r: float, rho: float, stages: Any, lo: float, hi: float, least: float
) -> bool:  # fmt: skip
    """Whether the bounds of ``points_in_reach`` prove that the cutter does not meet a point in lo..hi, halved down to
    ``least``.
    """
    x, y, z = points[i, 0] - cc[0] - r * cc[3], points[i, 1] - cc[1] - r * cc[4], points[i, 2] - cc[2] - r * cc[5]
    yy, yN = x * x + y * y + z * z, x * cc[3] + y * cc[4] + z * cc[5]
    away = math.sqrt(yy)
    # part k of as many as are in hi - lo, each ``half`` to either side of B
    k, half, whole = 0, 0.5 * (hi - lo), True
    while not (whole and k == 1):
        B = lo + (2 * k + 1) * half
        c, s = math.cos(B), math.sin(B)
        h = cone[0] * (x * c + y * s) + cone[1] * z
        n = cone[0] * (cc[3] * c + cc[4] * s) + cone[1] * cc[5]
        sine = math.sqrt(max(1.0 - n * n, 1e-300))
        turn = cone[0] * half
        clear = False
        if sine > turn:
            high = h + turn * away
            far2 = yy - 2.0 * rho * (yN - n * h) / sine + rho * rho
            if high < -r:
                clear = True
            else:
                slide = rho * turn * max(1.0, min(abs(n) + turn, 1.0) / (sine - turn))
                slide += turn * math.sqrt(max(far2, 0.0))
                if high < 0.0:
                    P = rho + math.sqrt(r * r - high * high)
                else:
                    P = largest_radius(h - turn * away, high, rho, r, stages)
                clear = far2 - h * h > (P + slide) * (P + slide)
        if clear:
            k += 1
            while k % 2 == 0 and not whole:
                k //= 2
                half *= 2.0
                whole = half > 0.4 * (hi - lo)
            continue
        if half <= least:
            return False
        k *= 2
        half *= 0.5
        whole = False
    return True


@njit(cache=True, nogil=True)
def deepest_point(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, r: float, near2: float, rho: float,
    stages: Any, B: float,
) -> int:  # fmt: skip
    """Number of the check point in the cutter at B whose :func:`limit_function` is least; -1: none is in it."""
    Tx, Ty, Tz = cone[0] * math.cos(B), cone[0] * math.sin(B), cone[1]
    n = cc[3] * Tx + cc[4] * Ty + cc[5] * Tz
    s2 = 1.0 - n * n
    if s2 < 1e-12:
        return -1
    s = math.sqrt(s2)
    Vx, Vy, Vz = (cc[3] - n * Tx) / s, (cc[4] - n * Ty) / s, (cc[5] - n * Tz) / s
    Cx, Cy, Cz = cc[0] + r * cc[3], cc[1] + r * cc[4], cc[2] + r * cc[5]
    sid = int(cc[15])
    least, number, node = 0.0, -1, 0
    while node >= 0:
        enter, R = False, nodes[node, 3]
        if R >= 0.0:
            x, y, z = nodes[node, 0] - Cx, nodes[node, 1] - Cy, nodes[node, 2] - Cz
            h = x * Tx + y * Ty + z * Tz
            u, v, w = x - rho * Vx, y - rho * Vy, z - rho * Vz
            P = largest_radius(h - R, h + R, rho, r, stages) + R
            enter = h + R >= -r and u * u + v * v + w * w - h * h <= P * P
        if enter and node >= leaves:
            for i in range(spans[node, 0], spans[node, 1]):
                x, y, z = points[i, 0] - Cx, points[i, 1] - Cy, points[i, 2] - Cz
                h = x * Tx + y * Ty + z * Tz
                if h <= -r:
                    continue
                P = radius_at(h, rho, r, stages) if h >= 0.0 else 0.0
                if h >= 0.0 and P <= 0.0:
                    continue
                yN = x * cc[3] + y * cc[4] + z * cc[5]
                value = limit_function(h < 0.0, h, n, s2, yN, x * x + y * y + z * z, rho, r, P)
                if value >= least:
                    continue
                if own[i] == sid:
                    u, v, w = points[i, 0] - cc[0], points[i, 1] - cc[1], points[i, 2] - cc[2]
                    if u * u + v * v + w * w < near2:
                        continue
                least, number = value, i
        node = next_node(node, leaves, enter)
    return number


@njit(cache=True, nogil=True)
def add_arcs(cover: Any, number: int, arcs: Any, first: int, last: int) -> int:
    """Add the ``arcs`` first..last to the union ``cover`` (k, 2) of arcs, ascending and disjoint.

    The new number of arcs in ``cover``; -1: it is full.
    """
    for k in range(first, last):
        lo, hi = arcs[k, 0], arcs[k, 1]
        i = 0
        while i < number and cover[i, 1] < lo:
            i += 1
        j = i
        while j < number and cover[j, 0] <= hi:
            lo, hi = min(lo, cover[j, 0]), max(hi, cover[j, 1])
            j += 1
        if j == i:
            if number == len(cover):
                return -1
            for m in range(number, i, -1):
                cover[m, 0], cover[m, 1] = cover[m - 1, 0], cover[m - 1, 1]
            number += 1
        elif j > i + 1:
            for m in range(j, number):
                cover[m - j + i + 1, 0], cover[m - j + i + 1, 1] = cover[m, 0], cover[m, 1]
            number -= j - i - 1
        cover[i, 0], cover[i, 1] = lo, hi
    return number


@njit(cache=True, nogil=True)
def widest_uncovered(
    cover: Any, number: int, lo: float, hi: float, least: float
) -> tuple[float, float, float, float]:  # fmt: skip
    """Widest part of lo..hi outside ``cover``, (lo, lo): none is wider than ``least``; the begin of the first such part
    and the end of the last.
    """
    a, b, reached = lo, lo, lo
    begin, end = hi, lo
    for k in range(number + 1):
        left = hi if k == number else min(cover[k, 0], hi)
        if left - reached > least:
            begin, end = min(begin, reached), left
            if left - reached > b - a:
                a, b = reached, left
        if k < number:
            reached = max(reached, cover[k, 1])
            if reached >= hi:
                break
    return a, b, begin, end


@njit(cache=True, nogil=True)
def ranges_at_contact(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, r: float, near2: float, rho: float,
    stages: Any, parts: Any, count: int, width: float, flat: float, least: float, hints: Any, seen: Any, stamp: int,
    arcs: Any, owner: Any, out: Any,
) -> tuple[int, int]:  # fmt: skip
    """Write the valid ranges within ``parts`` of one contact point to ``out``: their number, and that of the ``arcs``.

    ``owner`` (a,) number of the check point that forbids each arc; -2: the curvature at the contact; -3: the part is
    narrower than ``flat`` and n is close to 1, it counts as forbidden. The number of arcs is -1 where they are more
    than the workspace holds. ``hints`` (h,) points whose arcs are computed first, -1: none.
    """
    filled = 0
    for j in range(len(hints)):
        if hints[j] < 0 and hints[j] != -2:
            continue
        if hints[j] >= 0:
            seen[hints[j]] = stamp
        before = filled
        for k in range(count):
            filled = point_arcs(
                points, hints[j], cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled
            )
        owner[before:filled] = hints[j]
    near = np.empty(len(points), dtype=np.int64)
    stack, cover = np.empty((512, 2)), np.empty((4096, 2))
    top = uncovered_parts(parts, count, arcs, filled, least, stack)
    covered = add_arcs(cover, 0, arcs, 0, filled)
    while top > 0:
        top -= 1
        lo, hi = stack[top, 0], stack[top, 1]
        a, b, begin, end = widest_uncovered(cover, covered, lo, hi, least)
        if b <= a:
            continue
        # the deepest point at the middle of the widest uncovered part often forbids all of it: no other is needed then
        i = deepest_point(points, own, nodes, spans, leaves, cc, cone, r, near2, rho, stages, 0.5 * (a + b))
        if i >= 0 and seen[i] != stamp:
            seen[i] = stamp
            before = filled
            for k in range(count):
                filled = point_arcs(points, i, cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled)
            owner[before:filled] = i
            covered = add_arcs(cover, covered, arcs, before, filled)
            if filled + 32 > len(arcs) or covered < 0:
                return 0, -1
            stack[top, 0], stack[top, 1] = lo, hi
            top += 1
            continue
        B, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
        n = cone[0] * (cc[3] * math.cos(B) + cc[4] * math.sin(B)) + cone[1] * cc[5]
        s = math.sqrt(max(1.0 - n * n, 0.0))
        steep = cone[0] * half > 0.5 * s
        if steep and hi - lo < flat:
            if filled == len(arcs):
                return 0, -1
            arcs[filled, 0], arcs[filled, 1], owner[filled] = lo, hi, -3
            filled += 1
            covered = add_arcs(cover, covered, arcs, filled - 1, filled)
            if covered < 0:
                return 0, -1
            continue
        if not steep:
            # what is covered at either end of the part is left out; s stays above the turn of what is left
            lo, hi = begin, end
            B, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
        if steep or hi - lo > width:
            if top + 2 > len(stack):
                return 0, -1
            stack[top, 0], stack[top, 1] = B, hi
            stack[top + 1, 0], stack[top + 1, 1] = lo, B
            top += 2
            continue
        reached = points_in_reach(
            points, own, nodes, spans, leaves, cc, cone, r, near2, rho, stages, B, half, seen, stamp, near
        )
        for j in range(reached):
            if clear_within(points, near[j], cc, cone, r, rho, stages, lo, hi, FINE):
                # it may be met elsewhere
                seen[near[j]] = 0
                continue
            before = filled
            for k in range(count):
                filled = point_arcs(
                    points, near[j], cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled
                )
            owner[before:filled] = near[j]
            covered = add_arcs(cover, covered, arcs, before, filled)
            if filled + 32 > len(arcs) or covered < 0:
                return 0, -1
    return uncovered_parts(parts, count, arcs, filled, least, out), filled


@njit(cache=True, nogil=True)
def fewest_blockers(parts: Any, count: int, arcs: Any, owner: Any, number: int, least: float, out: Any) -> int:
    """Write the fewest owners whose arcs together forbid the ``parts`` to ``out``; their number.

    All arcs together must forbid the parts.
    """
    order = np.argsort(arcs[:number, 0])
    total = 0
    for k in range(count):
        reached, j = parts[k, 0], 0
        while reached < parts[k, 1] - least:
            farthest, arc = reached, -1
            while j < number and arcs[order[j], 0] <= reached + least:
                if arcs[order[j], 1] > farthest:
                    farthest, arc = arcs[order[j], 1], order[j]
                j += 1
            if arc < 0 or total == len(out):
                return total
            out[total] = owner[arc]
            total += 1
            reached = farthest
    return total


@njit(cache=True, nogil=True)
def ranges_of_contacts(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, ccs: Any, cones: Any, near2: float, tool: Any,
    stages: Any, limits: Any, width: float, flat: float, least: float, hints: Any, first: int, last: int, number: Any,
    ranges: Any, proof: Any,
) -> None:  # fmt: skip
    """Valid ranges of one cutter at the contact points ``first``..``last``, each at its table angle ``cones`` (c, 2).

    ``tool`` (2,) rho, r; ``limits`` (k, 2) pallet angles that the machine reaches. Fills ``ranges`` (c, k, 2), their
    ``number`` (c,), -1 where there are more arcs than the workspace holds, and ``proof`` (c, k), where there is no
    range: the points that forbid every B.
    """
    seen = np.zeros(len(points), dtype=np.int64)
    arcs, owner = np.empty((65536, 2)), np.empty(65536, dtype=np.int64)
    parts = np.empty((3 * len(limits), 2))
    for c in range(first, last):
        count = 0
        for k in range(len(limits)):
            count += facing_parts(ccs[c], cones[c], limits[k, 0], limits[k, 1], parts[count:])
        number[c], filled = ranges_at_contact(
            points, own, nodes, spans, leaves, ccs[c], cones[c], tool[1], near2, tool[0], stages, parts, count, width,
            flat, least, hints[c], seen, c + 1, arcs, owner, ranges[c],
        )  # fmt: skip
        if filled < 0:
            number[c] = -1
        elif number[c] == 0:
            fewest_blockers(parts, count, arcs, owner, filled, least, proof[c])
