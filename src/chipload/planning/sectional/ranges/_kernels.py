"""Compiled: the pallet angles at which one cutter is clear of every check point, exactly.

Notation: as in the kernels of ``sectional``; ``stages`` (k, 2) height above the corner's centres where a cylinder
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

from chipload.planning.sectional._kernels import domain, gaps, point_arcs


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
    free, one = np.empty((64, 2)), np.empty((1, 2))
    todo = np.empty((512, 2))
    waiting = gaps(parts, count, arcs, filled, least, todo)
    while waiting > 0:
        waiting -= 1
        lo, hi = todo[waiting, 0], todo[waiting, 1]
        one[0, 0], one[0, 1] = lo, hi
        if gaps(one, 1, arcs, filled, least, free) == 0:
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
            continue
        if steep or hi - lo > width:
            if waiting + 2 > len(todo):
                return 0, -1
            todo[waiting, 0], todo[waiting, 1] = B, hi
            todo[waiting + 1, 0], todo[waiting + 1, 1] = lo, B
            waiting += 2
            continue
        found = collect(points, own, nodes, spans, leaves, cc, cone, r, near2, rho, stages, B, half, seen, stamp, near)
        for j in range(found):
            before = filled
            for k in range(count):
                filled = point_arcs(
                    points, near[j], cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled
                )
            owner[before:filled] = near[j]
            if filled + 32 > len(arcs):
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
