"""Compiled: the pallet angles at which one cutter is clear of every check point, exactly.

Notation: as in the kernels of ``impeller``; ``stages`` (k, 2) height above the corner's centres where a cylinder
begins and its radius, the first row the cutting part (its radius rho + r is put in). d distance of a check point from
the cutter's axis. When B moves by dB, h moves by at most sin(alpha) |y| dB and d by at most
sin(alpha) (rho max(1, n/s) + |y - rho V|) dB: only the check points that come that near can matter, and the arcs of
those are computed exactly.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.planning.impeller._kernels import domain, gaps, point_arcs
from chipload.planning.impeller.arcs._kernels import radius_at, slack

#: half of the narrowest part of B for which a near point is proved clear before its arcs are calculated [rad]
FINE = math.radians(0.5)


@njit(cache=True, nogil=True)
def widest(low: float, high: float, rho: float, r: float, stages: Any) -> float:
    """Largest radius [mm] of the cutter between two heights."""
    P = rho + r if len(stages) == 1 or low < stages[1, 0] else 0.0
    for j in range(1, len(stages)):
        if high >= stages[j, 0] and (j + 1 == len(stages) or low < stages[j + 1, 0]):
            P = max(P, stages[j, 1])
    return P


@njit(cache=True, nogil=True)
def collect(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, r: float, near2: float, rho: float,
    stages: Any, B: float, half: float, seen: Any, stamp: int, out: Any,
) -> int:  # fmt: skip
    """Points not ``seen`` with this ``stamp`` that the cutter may meet within ``half`` of B; -1: too many."""
    Tx, Ty, Tz = cone[0] * math.cos(B), cone[0] * math.sin(B), cone[1]
    n = cc[3] * Tx + cc[4] * Ty + cc[5] * Tz
    s = math.sqrt(max(1.0 - n * n, 1e-300))
    Vx, Vy, Vz = (cc[3] - n * Tx) / s, (cc[4] - n * Ty) / s, (cc[5] - n * Tz) / s
    Cx, Cy, Cz = cc[0] + r * cc[3], cc[1] + r * cc[4], cc[2] + r * cc[5]
    turn = cone[0] * half
    least = s - turn
    slide = rho * turn * max(1.0, min(abs(n) + turn, 1.0) / least)
    sid = int(cc[15])
    found, top = 0, 1
    stack = np.empty(64, dtype=np.int64)
    stack[0] = 0
    while top > 0:
        top -= 1
        k = stack[top]
        x, y, z, R = nodes[k, 0] - Cx, nodes[k, 1] - Cy, nodes[k, 2] - Cz, nodes[k, 3]
        if R < 0.0:
            continue
        h = x * Tx + y * Ty + z * Tz
        away = turn * (math.sqrt(x * x + y * y + z * z) + R)
        u, v, w = x - rho * Vx, y - rho * Vy, z - rho * Vz
        far = math.sqrt(u * u + v * v + w * w)
        P = widest(h - R - away, h + R + away, rho, r, stages) + R + slide + turn * (far + R)
        if h + R + away < -r or far * far - h * h > P * P:
            continue
        if k < leaves:
            stack[top], stack[top + 1] = 2 * k + 1, 2 * k + 2
            top += 2
            continue
        for i in range(spans[k, 0], spans[k, 1]):
            if seen[i] == stamp:
                continue
            x, y, z = points[i, 0] - Cx, points[i, 1] - Cy, points[i, 2] - Cz
            h = x * Tx + y * Ty + z * Tz
            away = turn * math.sqrt(x * x + y * y + z * z)
            if h + away < -r:
                continue
            u, v, w = x - rho * Vx, y - rho * Vy, z - rho * Vz
            far = math.sqrt(u * u + v * v + w * w)
            P = widest(h - away, h + away, rho, r, stages) + slide + turn * far
            if far * far - h * h > P * P:
                continue
            seen[i] = stamp
            if own[i] == sid:
                u, v, w = points[i, 0] - cc[0], points[i, 1] - cc[1], points[i, 2] - cc[2]
                if u * u + v * v + w * w < near2:
                    continue
            if found == len(out):
                return -1
            out[found] = i
            found += 1
    return found


@njit(cache=True, nogil=True)
def clear_within(
    points: Any, i: int, cc: Any, cone: Any, r: float, rho: float, stages: Any, lo: float, hi: float, least: float
) -> bool:  # fmt: skip
    """Whether the bounds of ``collect`` prove that the cutter does not meet a point in lo..hi, halved down to
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
                    P = widest(h - turn * away, high, rho, r, stages)
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
def deepest(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, r: float, near2: float, rho: float,
    stages: Any, B: float,
) -> int:  # fmt: skip
    """The check point that is deepest in the cutter at B, by what :func:`slack` says; -1: none."""
    Tx, Ty, Tz = cone[0] * math.cos(B), cone[0] * math.sin(B), cone[1]
    n = cc[3] * Tx + cc[4] * Ty + cc[5] * Tz
    s2 = 1.0 - n * n
    if s2 < 1e-12:
        return -1
    s = math.sqrt(s2)
    Vx, Vy, Vz = (cc[3] - n * Tx) / s, (cc[4] - n * Ty) / s, (cc[5] - n * Tz) / s
    Cx, Cy, Cz = cc[0] + r * cc[3], cc[1] + r * cc[4], cc[2] + r * cc[5]
    sid = int(cc[15])
    deepest, who, top = 0.0, -1, 1
    stack = np.empty(64, dtype=np.int64)
    stack[0] = 0
    while top > 0:
        top -= 1
        k = stack[top]
        x, y, z, R = nodes[k, 0] - Cx, nodes[k, 1] - Cy, nodes[k, 2] - Cz, nodes[k, 3]
        if R < 0.0:
            continue
        h = x * Tx + y * Ty + z * Tz
        u, v, w = x - rho * Vx, y - rho * Vy, z - rho * Vz
        P = widest(h - R, h + R, rho, r, stages) + R
        if h + R < -r or u * u + v * v + w * w - h * h > P * P:
            continue
        if k < leaves:
            stack[top], stack[top + 1] = 2 * k + 1, 2 * k + 2
            top += 2
            continue
        for i in range(spans[k, 0], spans[k, 1]):
            x, y, z = points[i, 0] - Cx, points[i, 1] - Cy, points[i, 2] - Cz
            h = x * Tx + y * Ty + z * Tz
            if h <= -r:
                continue
            P = radius_at(h, rho, r, stages) if h >= 0.0 else 0.0
            if h >= 0.0 and P <= 0.0:
                continue
            yN = x * cc[3] + y * cc[4] + z * cc[5]
            deep = slack(h < 0.0, h, n, s2, yN, x * x + y * y + z * z, rho, r, P)
            if deep >= deepest:
                continue
            if own[i] == sid:
                u, v, w = points[i, 0] - cc[0], points[i, 1] - cc[1], points[i, 2] - cc[2]
                if u * u + v * v + w * w < near2:
                    continue
            deepest, who = deep, i
    return who


@njit(cache=True, nogil=True)
def merged(cover: Any, number: int, arcs: Any, first: int, last: int) -> int:
    """Puts the ``arcs`` first..last into ``cover``, ascending and apart; how many there are, -1: too many."""
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
def uncovered(
    cover: Any, number: int, lo: float, hi: float, least: float
) -> tuple[float, float, float, float]:  # fmt: skip
    """The widest part of lo..hi that is not covered, (lo, lo) where none is wider than ``least``; the begin of the
    first such part and the end of the last.
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
def valid(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, r: float, near2: float, rho: float,
    stages: Any, parts: Any, count: int, width: float, flat: float, least: float, hints: Any, seen: Any, stamp: int,
    arcs: Any, owner: Any, out: Any,
) -> tuple[int, int]:  # fmt: skip
    """Valid parts as rows of ``out`` and how many; how many ``arcs`` were filled (-1: too many), with their ``owner``.

    Parts narrower than ``flat`` where n comes near 1 count as forbidden (owner -3).
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
    todo, cover = np.empty((512, 2)), np.empty((4096, 2))
    waiting = gaps(parts, count, arcs, filled, least, todo)
    covered = merged(cover, 0, arcs, 0, filled)
    while waiting > 0:
        waiting -= 1
        lo, hi = todo[waiting, 0], todo[waiting, 1]
        a, b, begin, end = uncovered(cover, covered, lo, hi, least)
        if b <= a:
            continue
        # one point that forbids the middle of the widest gap may spare all others
        who = deepest(points, own, nodes, spans, leaves, cc, cone, r, near2, rho, stages, 0.5 * (a + b))
        if who >= 0 and seen[who] != stamp:
            seen[who] = stamp
            before = filled
            for k in range(count):
                filled = point_arcs(
                    points, who, cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled
                )
            owner[before:filled] = who
            covered = merged(cover, covered, arcs, before, filled)
            if filled + 32 > len(arcs) or covered < 0:
                return 0, -1
            todo[waiting, 0], todo[waiting, 1] = lo, hi
            waiting += 1
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
            covered = merged(cover, covered, arcs, filled - 1, filled)
            if covered < 0:
                return 0, -1
            continue
        if not steep:
            # what is covered at either end of the part is left out; s stays above the turn of what is left
            lo, hi = begin, end
            B, half = 0.5 * (lo + hi), 0.5 * (hi - lo)
        if steep or hi - lo > width:
            if waiting + 2 > len(todo):
                return 0, -1
            todo[waiting, 0], todo[waiting, 1] = B, hi
            todo[waiting + 1, 0], todo[waiting + 1, 1] = lo, B
            waiting += 2
            continue
        found = collect(points, own, nodes, spans, leaves, cc, cone, r, near2, rho, stages, B, half, seen, stamp, near)
        for j in range(found):
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
            covered = merged(cover, covered, arcs, before, filled)
            if filled + 32 > len(arcs) or covered < 0:
                return 0, -1
    return gaps(parts, count, arcs, filled, least, out), filled


@njit(cache=True, nogil=True)
def chain(parts: Any, count: int, arcs: Any, owner: Any, number: int, least: float, out: Any) -> int:
    """Fewest owners whose arcs together forbid the ``parts`` (that all arcs forbid); how many."""
    order = np.argsort(arcs[:number, 0])
    found = 0
    for k in range(count):
        reached, j = parts[k, 0], 0
        while reached < parts[k, 1] - least:
            best, who = reached, -1
            while j < number and arcs[order[j], 0] <= reached + least:
                if arcs[order[j], 1] > best:
                    best, who = arcs[order[j], 1], order[j]
                j += 1
            if who < 0 or found == len(out):
                return found
            out[found] = owner[who]
            found += 1
            reached = best
    return found


@njit(cache=True, nogil=True)
def fitted(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, ccs: Any, cones: Any, near2: float, tool: Any,
    stages: Any, limits: Any, width: float, flat: float, least: float, hints: Any, first: int, last: int, number: Any,
    ranges: Any, proof: Any,
) -> None:  # fmt: skip
    """Each contact point of ``first``..``last`` at its own table angle ``cones`` (c, 2) with one cutter.

    ``tool`` (2,) rho, r. ``number`` (c,) how many ``ranges`` (c, k, 2); -1: too many arcs to tell. ``proof`` (c, k)
    the points that forbid all, where there are none.
    """
    seen = np.zeros(len(points), dtype=np.int64)
    arcs, owner = np.empty((65536, 2)), np.empty(65536, dtype=np.int64)
    parts = np.empty((3 * len(limits), 2))
    for c in range(first, last):
        count = 0
        for k in range(len(limits)):
            count += domain(ccs[c], cones[c], limits[k, 0], limits[k, 1], parts[count:])
        number[c], filled = valid(
            points, own, nodes, spans, leaves, ccs[c], cones[c], tool[1], near2, tool[0], stages, parts, count, width,
            flat, least, hints[c], seen, c + 1, arcs, owner, ranges[c],
        )  # fmt: skip
        if filled < 0:
            number[c] = -1
        elif number[c] == 0:
            chain(parts, count, arcs, owner, filled, least, proof[c])
