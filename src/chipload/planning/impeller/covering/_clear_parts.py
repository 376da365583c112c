"""Compiled: the parts of ranges of the pallet angle B in which a cutter is clear of the nodes of a covering.

Notation: as in ``_pallet_ranges.py``; a part is an interval of B. If a node's distance from the cutter at the middle
of a part is greater than the relative motion of node and cutter within the part, the node is clear in the whole part.
Parts are halved until this decides, or until few nodes remain or the part is narrow: then the exact arcs of the
remaining nodes decide.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.planning.impeller._clearance import distance
from chipload.planning.impeller._largest_cutter import point_arcs, uncovered_parts
from chipload.planning.impeller._pallet_ranges import add_arcs
from chipload.planning.impeller._tree import next_node

#: the exact arcs decide where at most this many nodes remain
FEW = 2
#: a part wider than ``width`` is halved where more nodes than this are in reach
MANY = 256
#: the exact arcs decide in a part narrower than this [rad], for any number of nodes
NARROW = 1e-4


@njit(cache=True, nogil=True)
def frame_at(cc: Any, cone: Any, r: float, B: float, half: float, rho: float, out: Any) -> None:
    """Frame of the cutter at the pallet angle B, ``out`` (11,).

    T, V, the corner's centre S + r N [mm], the greatest turn sin(alpha) ``half`` [rad] of the axis within ``half`` of
    B, and the greatest displacement [mm] of the axis (of rho V) within it.
    """
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
def distance_and_motion(
    x: float, y: float, z: float, R: float, f: Any, rho: float, r: float, stages: Any
) -> tuple[float, float]:
    """Distance [mm] from the cutter of a ball of radius R, and a bound [mm] of their relative motion in a part of B.

    ``f`` (11,) frame of the cutter at the middle of the part, as :func:`frame_at`.
    """
    x, y, z = x - f[6], y - f[7], z - f[8]
    h = x * f[0] + y * f[1] + z * f[2]
    u, v, w = x - rho * f[3], y - rho * f[4], z - rho * f[5]
    axis2 = u * u + v * v + w * w
    d = math.sqrt(max(axis2 - h * h, 0.0))
    axial = f[9] * (math.sqrt(x * x + y * y + z * z) + R)
    lateral = f[10] + f[9] * (math.sqrt(axis2) + R)
    return distance(h, d, rho, r, stages) - R, math.sqrt(axial * axial + lateral * lateral)


@njit(cache=True, nogil=True)
def nodes_near_contact(points: Any, nodes: Any, spans: Any, leaves: int, cc: Any, near2: float, out: Any) -> int:
    """Write the nodes within the distance sqrt(``near2``) of the contact point to ``out``; their number."""
    near, count, node = math.sqrt(near2), 0, 0
    while node >= 0:
        x, y, z, R = nodes[node, 0] - cc[0], nodes[node, 1] - cc[1], nodes[node, 2] - cc[2], nodes[node, 3]
        enter = R >= 0.0 and x * x + y * y + z * z <= (near + R) ** 2
        if enter and node >= leaves:
            for i in range(spans[node, 0], spans[node, 1]):
                x, y, z = points[i, 0] - cc[0], points[i, 1] - cc[1], points[i, 2] - cc[2]
                if x * x + y * y + z * z < near2:
                    out[count] = i
                    count += 1
        node = next_node(node, leaves, enter)
    return count


@njit(cache=True, nogil=True)
def nodes_in_reach(
    points: Any, nodes: Any, spans: Any, leaves: int, f: Any, rho: float, r: float, stages: Any, seen: Any, stamp: int,
    most: int, out: Any,
) -> int:  # fmt: skip
    """Write the nodes that the cutter may meet in the part of B of a frame ``f`` to ``out``; their number.

    Nodes whose ``seen`` equals ``stamp`` are left out. -1: there are more than ``most``.
    """
    count, node = 0, 0
    while node >= 0:
        enter = False
        if nodes[node, 3] >= 0.0:
            separation, motion = distance_and_motion(
                nodes[node, 0], nodes[node, 1], nodes[node, 2], nodes[node, 3], f, rho, r, stages
            )
            enter = separation <= motion
        if enter and node >= leaves:
            for i in range(spans[node, 0], spans[node, 1]):
                if seen[i] == stamp:
                    continue
                separation, motion = distance_and_motion(
                    points[i, 0], points[i, 1], points[i, 2], 0.0, f, rho, r, stages
                )
                if separation <= motion:
                    if count == most:
                        return -1
                    out[count] = i
                    count += 1
        node = next_node(node, leaves, enter)
    return count


@njit(cache=True, nogil=True)
def uncovered_span(cover: Any, number: int, lo: float, hi: float) -> tuple[float, float]:
    """Least and greatest B of lo..hi outside the intervals ``cover`` (k, 2), ascending and disjoint; (hi, hi): none."""
    for k in range(number):
        if cover[k, 0] <= lo < cover[k, 1]:
            lo = cover[k, 1]
    for k in range(number - 1, -1, -1):
        if cover[k, 0] < hi <= cover[k, 1]:
            hi = cover[k, 0]
    return (lo, hi) if lo < hi else (hi, hi)


@njit(cache=True, nogil=True)
def push_halves(stack: Any, spans: Any, top: int, lo: float, hi: float, first: int, last: int) -> int:
    """Push both halves of the part lo..hi on the ``stack`` of parts, with its span ``first``..``last`` of nodes.

    The new number of parts on the stack; -1: the stack is full.
    """
    middle = 0.5 * (lo + hi)
    stack[top, 0], stack[top, 1] = middle, hi
    stack[top + 1, 0], stack[top + 1, 1] = lo, middle
    for k in range(top, top + 2):
        spans[k, 0], spans[k, 1] = first, last
    return top + 2 if top + 4 <= len(stack) else -1


@njit(cache=True, nogil=True)
def clear_parts_at_contact(
    points: Any, nodes: Any, spans: Any, leaves: int, cc: Any, cone: Any, rho: float, r: float, stages: Any, parts: Any,
    count: int, near2: float, width: float, least: float, seen: Any, stamp: int, work: Any, stack: Any,
    stack_spans: Any, arcs: Any, cover: Any, out: Any,
) -> int:  # fmt: skip
    """Write the parts of the ``count`` ``parts`` that are clear of all nodes to ``out``; their number.

    -1: there are more arcs, or more parts to examine, than the workspace holds. Workspace: ``work`` (2 m,) numbers of
    nodes, ``stack`` (k, 2) parts to examine and ``stack_spans`` (k, 2) their nodes in ``work``, ``arcs`` (a, 2),
    ``cover`` (b, 2).
    """
    f = np.empty(11)
    covered = 0
    near = nodes_near_contact(points, nodes, spans, leaves, cc, near2, work)
    for j in range(near):
        seen[work[j]] = stamp
        filled = 0
        for k in range(count):
            filled = point_arcs(
                points, work[j], cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled
            )
        covered = add_arcs(cover, covered, arcs, 0, filled)
        if covered < 0:
            return -1
    top = uncovered_parts(parts, count, cover, covered, least, stack)
    stack_spans[:top] = -1
    while top > 0:
        top -= 1
        lo, hi = stack[top, 0], stack[top, 1]
        first, last = stack_spans[top, 0], stack_spans[top, 1]
        lo, hi = uncovered_span(cover, covered, lo, hi)
        if hi - lo <= least:
            continue
        frame_at(cc, cone, r, 0.5 * (lo + hi), 0.5 * (hi - lo), rho, f)
        if first < 0:
            # a wide part with few nodes in reach is not halved
            most = MANY if hi - lo > width else len(points)
            first, last = 0, nodes_in_reach(points, nodes, spans, leaves, f, rho, r, stages, seen, stamp, most, work)
            if last < 0:
                top = push_halves(stack, stack_spans, top, lo, hi, -1, -1)
                if top < 0:
                    return -1
                continue
        least_separation, deepest, end = 0.0, -1, last
        for j in range(first, last):
            i = work[j]
            if seen[i] == stamp:
                continue
            separation, motion = distance_and_motion(points[i, 0], points[i, 1], points[i, 2], 0.0, f, rho, r, stages)
            if separation > motion:
                continue
            if end == len(work):
                return -1
            work[end] = i
            end += 1
            if separation < least_separation:
                least_separation, deepest = separation, i
        if end == last:
            continue
        exact = end - last <= FEW or hi - lo < NARROW
        if exact or deepest >= 0:
            for j in range(last, end):
                i = work[j]
                if (not exact and i != deepest) or seen[i] == stamp:
                    continue
                seen[i] = stamp
                filled = 0
                for k in range(count):
                    filled = point_arcs(
                        points, i, cc, cone, rho, r, stages, parts[k, 0], parts[k, 1], least, arcs, filled
                    )
                covered = add_arcs(cover, covered, arcs, 0, filled)
                if covered < 0:
                    return -1
        if exact:
            continue
        if deepest >= 0:
            stack[top, 0], stack[top, 1] = lo, hi
            stack_spans[top, 0], stack_spans[top, 1] = first, last
            top += 1
            continue
        top = push_halves(stack, stack_spans, top, lo, hi, last, end)
        if top < 0:
            return -1
    return uncovered_parts(parts, count, cover, covered, least, out)  # type: ignore[no-any-return]


@njit(cache=True, nogil=True)
def clear_parts(
    points: Any, nodes: Any, spans: Any, leaves: int, ccs: Any, cones: Any, tool: Any, stages: Any, ranges: Any,
    count: Any, near2: float, width: float, least: float, first: int, last: int, seen: Any, work: Any, out: Any,
    number: Any,
) -> None:  # fmt: skip
    """Clear parts of the ``ranges`` (c, k, 2) of the contact points ``first``..``last``, each at its own table angle.

    Fills ``out`` (c, k, 2) and ``number`` (c,), as :func:`clear_parts_at_contact`. Workspace: ``seen`` (m,) zeros,
    ``work`` (k,); memory of them that no contact point needs is never touched.
    """
    stack, stack_spans = np.empty((4096, 2)), np.empty((4096, 2), dtype=np.int64)
    arcs, cover = np.empty((256, 2)), np.empty((4096, 2))
    for c in range(first, last):
        number[c] = clear_parts_at_contact(
            points, nodes, spans, leaves, ccs[c], cones[c], tool[0], tool[1], stages, ranges[c], count[c], near2, width,
            least, seen, c + 1, work, stack, stack_spans, arcs, cover, out[c],
        )  # fmt: skip
