"""Compiled: what of ranges of the pallet angle B is clear of nodes that lie close together.

Notation: as in ``ranges/_kernels.py``. A node whose distance from the cutter at the middle of a part of B is more than
the node and the cutter can move against each other within it is clear in all of it. Parts are halved; what is left of
few nodes, or in a narrow part, is told by the exact arcs of each.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.planning.impeller._kernels import gaps, point_arcs
from chipload.planning.impeller.clearance._kernels import distance
from chipload.planning.impeller.ranges._kernels import merged

#: so few nodes are told by their arcs, and in so narrow a part [rad] as many as there are
FEW = 2
#: with more nodes than these a part wider than the width is halved
MANY = 256
NARROW = 1e-4


@njit(cache=True, nogil=True)
def framed(cc: Any, cone: Any, r: float, B: float, half: float, rho: float, out: Any) -> None:
    """``out`` (11,): T, V, the centre S + r N, sin(alpha) half, how far the axis goes within ``half`` of B."""
    Tx, Ty, Tz = cone[0] * math.cos(B), cone[0] * math.sin(B), cone[1]
    n = cc[3] * Tx + cc[4] * Ty + cc[5] * Tz
    s = math.sqrt(max(1.0 - n * n, 1e-300))
    turn = cone[0] * half
    least = max(s - turn, 1e-12)
    out[0], out[1], out[2] = Tx, Ty, Tz
    out[3], out[4], out[5] = (cc[3] - n * Tx) / s, (cc[4] - n * Ty) / s, (cc[5] - n * Tz) / s
    out[6], out[7], out[8] = cc[0] + r * cc[3], cc[1] + r * cc[4], cc[2] + r * cc[5]
    out[9] = turn
    out[10] = rho * turn * max(1.0, min(abs(n) + turn, 1.0) / least)


@njit(cache=True, nogil=True)
def spare(x: float, y: float, z: float, R: float, f: Any, rho: float, r: float, stages: Any) -> tuple[float, float]:
    """Distance [mm] of a ball about a point from the cutter, and how much of it a part of B may take."""
    x, y, z = x - f[6], y - f[7], z - f[8]
    h = x * f[0] + y * f[1] + z * f[2]
    u, v, w = x - rho * f[3], y - rho * f[4], z - rho * f[5]
    far2 = u * u + v * v + w * w
    d = math.sqrt(max(far2 - h * h, 0.0))
    away = f[9] * (math.sqrt(x * x + y * y + z * z) + R)
    side = f[10] + f[9] * (math.sqrt(far2) + R)
    return distance(h, d, rho, r, stages) - R, math.sqrt(away * away + side * side)


@njit(cache=True, nogil=True)
def about(points: Any, nodes: Any, spans: Any, leaves: int, cc: Any, near2: float, stack: Any, out: Any) -> int:
    """The nodes nearer to the contact point than the root of ``near2``."""
    near, found, top = math.sqrt(near2), 0, 1
    stack[0] = 0
    while top > 0:
        top -= 1
        k = stack[top]
        x, y, z = nodes[k, 0] - cc[0], nodes[k, 1] - cc[1], nodes[k, 2] - cc[2]
        if nodes[k, 3] < 0.0 or x * x + y * y + z * z > (near + nodes[k, 3]) ** 2:
            continue
        if k < leaves:
            stack[top], stack[top + 1] = 2 * k + 1, 2 * k + 2
            top += 2
            continue
        for i in range(spans[k, 0], spans[k, 1]):
            x, y, z = points[i, 0] - cc[0], points[i, 1] - cc[1], points[i, 2] - cc[2]
            if x * x + y * y + z * z < near2:
                out[found] = i
                found += 1
    return found


@njit(cache=True, nogil=True)
def collected(
    points: Any, nodes: Any, spans: Any, leaves: int, f: Any, rho: float, r: float, stages: Any, seen: Any, stamp: int,
    most: int, stack: Any, out: Any,
) -> int:  # fmt: skip
    """Nodes not ``seen`` that the cutter may meet in the part of B of a frame ``f``; -1: more than ``most``."""
    found, top = 0, 1
    stack[0] = 0
    while top > 0:
        top -= 1
        k = stack[top]
        if nodes[k, 3] < 0.0:
            continue
        away, moves = spare(nodes[k, 0], nodes[k, 1], nodes[k, 2], nodes[k, 3], f, rho, r, stages)
        if away > moves:
            continue
        if k < leaves:
            stack[top], stack[top + 1] = 2 * k + 1, 2 * k + 2
            top += 2
            continue
        for i in range(spans[k, 0], spans[k, 1]):
            if seen[i] == stamp:
                continue
            away, moves = spare(points[i, 0], points[i, 1], points[i, 2], 0.0, f, rho, r, stages)
            if away <= moves:
                if found == most:
                    return -1
                out[found] = i
                found += 1
    return found


@njit(cache=True, nogil=True)
def uncovered(cover: Any, number: int, lo: float, hi: float) -> tuple[float, float]:
    """From the first to the last B of lo..hi that ``cover`` (k, 2), ascending and apart, leaves; (hi, hi): none."""
    for k in range(number):
        if cover[k, 0] <= lo < cover[k, 1]:
            lo = cover[k, 1]
    for k in range(number - 1, -1, -1):
        if cover[k, 0] < hi <= cover[k, 1]:
            hi = cover[k, 0]
    return (lo, hi) if lo < hi else (hi, hi)


@njit(cache=True, nogil=True)
def halved(todo: Any, of: Any, waiting: int, lo: float, hi: float, first: int, last: int) -> int:
    """Puts both halves of a part with its nodes ``first``..``last`` to what is waiting; how many wait, -1: too many."""
    middle = 0.5 * (lo + hi)
    todo[waiting, 0], todo[waiting, 1] = middle, hi
    todo[waiting + 1, 0], todo[waiting + 1, 1] = lo, middle
    for k in range(waiting, waiting + 2):
        of[k, 0], of[k, 1] = first, last
    return waiting + 2 if waiting + 4 <= len(todo) else -1


@njit(cache=True, nogil=True)
def kept_of(
    points: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, rho: float, r: float, stages: Any, parts: Any,
    count: int, near2: float, width: float, least: float, seen: Any, stamp: int, work: Any, todo: Any, of: Any,
    arcs: Any, cover: Any, out: Any,
) -> int:  # fmt: skip
    """What of the ``parts`` is clear of the nodes as rows of ``out``; how many, -1: too many arcs to tell.

    ``work`` (2 m,), ``todo`` (k, 2) with ``of`` (k, 2) their nodes in ``work``, ``arcs``, ``cover`` are room to work.
    """
    stack, f = np.empty(64, dtype=np.int64), np.empty(11)
    covered = 0
    found = about(points, nodes, spans, leaves, cc, near2, stack, work)
    for j in range(found):
        seen[work[j]] = stamp
        filled = 0
        for k in range(count):
            filled = point_arcs(
                points, work[j], cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled
            )
        covered = merged(cover, covered, arcs, 0, filled)
        if covered < 0:
            return -1
    waiting = gaps(parts, count, cover, covered, least, todo)
    of[:waiting] = -1
    while waiting > 0:
        waiting -= 1
        lo, hi = todo[waiting, 0], todo[waiting, 1]
        first, last = of[waiting, 0], of[waiting, 1]
        lo, hi = uncovered(cover, covered, lo, hi)
        if hi - lo <= least:
            continue
        framed(cc, cone, r, 0.5 * (lo + hi), 0.5 * (hi - lo), rho, f)
        if first < 0:
            # a wide part that meets few nodes is looked at as a whole
            most = MANY if hi - lo > width else len(points)
            first, last = 0, collected(points, nodes, spans, leaves, f, rho, r, stages, seen, stamp, most, stack, work)
            if last < 0:
                waiting = halved(todo, of, waiting, lo, hi, -1, -1)
                if waiting < 0:
                    return -1
                continue
        deepest, who, end = 0.0, -1, last
        for j in range(first, last):
            i = work[j]
            if seen[i] == stamp:
                continue
            away, moves = spare(points[i, 0], points[i, 1], points[i, 2], 0.0, f, rho, r, stages)
            if away > moves:
                continue
            if end == len(work):
                return -1
            work[end] = i
            end += 1
            if away < deepest:
                deepest, who = away, i
        if end == last:
            continue
        tell = end - last <= FEW or hi - lo < NARROW
        if tell or who >= 0:
            for j in range(last, end):
                i = work[j]
                if (not tell and i != who) or seen[i] == stamp:
                    continue
                seen[i] = stamp
                filled = 0
                for k in range(count):
                    filled = point_arcs(
                        points, i, cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled
                    )
                covered = merged(cover, covered, arcs, 0, filled)
                if covered < 0:
                    return -1
        if tell:
            continue
        if who >= 0:
            todo[waiting, 0], todo[waiting, 1] = lo, hi
            of[waiting, 0], of[waiting, 1] = first, last
            waiting += 1
            continue
        waiting = halved(todo, of, waiting, lo, hi, last, end)
        if waiting < 0:
            return -1
    return gaps(parts, count, cover, covered, least, out)  # type: ignore[no-any-return]


@njit(cache=True, nogil=True)
def kept(
    points: Any, nodes: Any, spans: Any, leaves: int, ccs: Any, cones: Any, tool: Any, stages: Any, ranges: Any,
    count: Any, near2: float, width: float, least: float, first: int, last: int, seen: Any, work: Any, out: Any,
    number: Any,
) -> None:  # fmt: skip
    """Each contact point of ``first``..``last`` at its own table angle and its own ``ranges`` (c, k, 2).

    ``seen`` (m,) zeros and ``work`` (k,) are room to work; what of them is not touched costs nothing.
    """
    todo, of = np.empty((4096, 2)), np.empty((4096, 2), dtype=np.int64)
    arcs, cover = np.empty((256, 2)), np.empty((4096, 2))
    for c in range(first, last):
        number[c] = kept_of(
            points, nodes, spans, leaves, ccs[c], cones[c], tool[0], tool[1], stages, ranges[c], count[c], near2, width,
            least, seen, c + 1, work, todo, of, arcs, cover, out[c],
        )  # fmt: skip
