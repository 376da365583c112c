"""Compiled loops that close the boundary where there are two grazing points: all layers of many moves in one call.

Notation: arrays ``cp``, ``ca``, ``K``, ``S``, ``C``, rows, edges as in :mod:`chipload.engagement.chips._grazing_trace`.
A loop bounds the surface in space and time through which points enter the cutter: it goes once round a point for each
time that the cutter comes over the point. It may therefore cross itself; a point that it goes round at least once is
covered.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.engagement.chips._grazing_points import MAX_ROOTS, NODES, roots
from chipload.engagement.chips._grazing_trace import (
    FIRST,
    FULL,
    GENERAL,
    GRAZING,
    INSET,
    LAST,
    NOTHING,
    UNSETTLED,
    arc,
    edge,
    kind,
    levels,
    ring,
    spans,
    track,
)
from chipload.engagement.chips._section import TAU, instant

KNOTS, MOST_KNOTS = 5, 60
INSTANTS = 16  # intervals of a move in which the times are looked for during which it cuts a layer


#: types are stated: a constant among the arguments would else be compiled as a type of its own
_R1 = types.Array(types.float64, 1, "C", readonly=True)
_R2 = types.Array(types.float64, 2, "C", readonly=True)
_F1, _F2 = types.float64[::1], types.float64[:, ::1]
_KNOTS = types.Tuple((types.float64[:, :, ::1], types.int64[:, ::1]))


@njit(cache=True, nogil=True)
def _time_of(s, begins, stops, opens, closes):
    """Time at the share s of the knots: a section that begins or ends as a point grows with the root of time, in which
    the knots are even.
    """
    length = stops - begins
    if opens and closes:
        return begins + length * math.sin(0.25 * TAU * s) ** 2
    if opens:
        return begins + length * s * s
    if closes:
        return stops - length * (1.0 - s) * (1.0 - s)
    return begins + length * s


@njit(cache=True, nogil=True)
def _rate_of(t, begins, stops, opens, closes):
    """Rate of ``_time_of`` over the share, at time t."""
    length = stops - begins
    if opens and closes:
        return 0.5 * TAU * math.sqrt((t - begins) * (stops - t))
    if opens:
        return 2.0 * math.sqrt(length * (t - begins))
    if closes:
        return 2.0 * math.sqrt(length * (stops - t))
    return length


@njit(cache=True, nogil=True)
def simple(buf, n):
    """Whether no two edges of a loop cross, by boxes of eight edges."""
    m = (n + 7) // 8
    box = np.empty((m, 4))
    for i in range(m):
        box[i, 0] = box[i, 1] = math.inf
        box[i, 2] = box[i, 3] = -math.inf
        for j in range(8 * i, min(8 * i + 8, n)):
            for k in range(2):
                box[i, k] = min(box[i, k], buf[j, k], buf[j, 2 + k])
                box[i, 2 + k] = max(box[i, 2 + k], buf[j, k], buf[j, 2 + k])
    for i in range(m):
        for j in range(i, m):
            if box[i, 0] > box[j, 2] or box[j, 0] > box[i, 2] or box[i, 1] > box[j, 3] or box[j, 1] > box[i, 3]:
                continue
            for a in range(8 * i, min(8 * i + 8, n)):
                for b in range(max(8 * j, a + 2), min(8 * j + 8, n)):
                    if (a != 0 or b != n - 1) and _cross(buf[a], buf[b]):
                        return False
    return True


@njit(cache=True, nogil=True)
def _cross(p, q):
    dx, dy = p[2] - p[0], p[3] - p[1]
    o1 = dx * (q[1] - p[1]) - dy * (q[0] - p[0])
    o2 = dx * (q[3] - p[1]) - dy * (q[2] - p[0])
    if o1 * o2 >= 0.0:
        return False
    ex, ey = q[2] - q[0], q[3] - q[1]
    o3 = ex * (p[1] - q[1]) - ey * (p[0] - q[0])
    o4 = ex * (p[3] - q[1]) - ey * (p[2] - q[0])
    return o3 * o4 < 0.0


@njit(types.int64(_R2, _R2, _R1, types.float64, _F1, _F1, types.float64, _F2, types.int64), cache=True, nogil=True)
def edges_between(cp, ca, K, h, a, b, tol, buf, n):
    """Edges of the section between two grazing points that meet: it stands still there."""
    S = np.empty(27)
    C = np.empty((8, 5))
    instant(cp, ca, K, h, a[3], S, C)
    end = b.copy()
    end[2] = a[2] + (b[2] - a[2]) % TAU
    return arc(S, K, C, a, end, tol, GRAZING, buf, n)


@njit(cache=True, nogil=True)
def _sign_is_settled(grid, dt, tol):
    """Whether V, its time in even knots dt apart, can't have changed sign and back by more than tol / 4 of way."""
    for i in range(grid.shape[0] - 1):
        for k in range(NODES):
            s = 1.0 if grid[i, k] > 0.0 else -1.0
            if s * grid[i + 1, k] <= 0.0:
                continue
            bend = 0.0
            if i > 0:
                bend = abs(grid[i - 1, k] - 2.0 * grid[i, k] + grid[i + 1, k])
            if i < grid.shape[0] - 2:
                bend = max(bend, abs(grid[i, k] - 2.0 * grid[i + 1, k] + grid[i + 2, k]))
            if bend * dt <= 3.0 * tol or min(s * grid[i, k], s * grid[i + 1, k]) > 0.125 * bend:
                continue
            before, after = (k - 1) % NODES, (k + 1) % NODES
            alone = True
            for j in range(i, i + 2):
                if s * grid[j, before] <= 0.0 or s * grid[j, after] <= 0.0:
                    alone = False
            if alone:
                return False
    return True


@njit(cache=True, nogil=True)
def _find_meeting(cp, ca, K, h, tol, vmin, t0, t1, down, up):
    """Bring the pair of roots at t1 to where it meets towards t0, V between them within tol / 20 of way; or False."""
    S = np.empty(27)
    C = np.empty((8, 5))
    R = np.empty((MAX_ROOTS, 7))
    sign = np.empty(MAX_ROOTS, np.int64)
    grid = np.empty(NODES)
    most = math.inf
    for _ in range(60):
        if math.hypot(down[0] - up[0], down[1] - up[1]) <= 0.05 * tol or abs(t1 - t0) * most <= 0.05 * tol:
            return True
        t = 0.5 * (t0 + t1)
        if not instant(cp, ca, K, h, t, S, C):
            return False
        count, _ = roots(S, K, C, vmin, R, sign, grid)
        if count == 2:
            most = np.abs(grid).max()
            t1 = t
            k = 0 if sign[0] == -1 else 1
            down[:] = R[k]
            up[:] = R[1 - k]
        elif count == 0:
            t0 = t
        else:
            return False
    return False


@njit(
    types.Tuple((types.int64, types.boolean))(
        _R2, _R2, _R1, types.float64, types.float64, types.float64, _F1, _F1, _KNOTS, types.int64, _F2, _F2, types.int64
    ),
    cache=True,
    nogil=True,
)
def _side(cp, ca, K, h, tol, vmin, first, last, knot, sign, rows, buf, n):
    """Edges of one flank of the loop, by the roots of all knots: new count, GENERAL, FULL; whether any turns back."""
    rows[0] = first
    m = 1
    for i in range(knot[0].shape[0] + 1):
        goal = last if i == knot[0].shape[0] else knot[0][i, 0 if knot[1][i, 0] == sign else 1]
        if rows[m - 1, 3] < goal[3] and (goal[3] < last[3] or i == knot[0].shape[0]):
            m = track(cp, ca, K, h, tol, vmin, goal, sign, rows, m)
            if m < 0:
                return GENERAL, False
    if n + m >= buf.shape[0] - 2:
        return FULL, False
    back = False
    for i in range(m - 1):
        a, b = (rows[i], rows[i + 1]) if sign > 0 else (rows[m - 1 - i], rows[m - 2 - i])
        dx, dy = b[0] - a[0], b[1] - a[1]
        back = back or dy * a[4] - dx * a[5] < 0.0 or dy * b[4] - dx * b[5] < 0.0
        n = edge(buf, n, a, b, a[4], a[5], b[4], b[5], kind(a, b))
    return n, back


@njit(
    types.int64(
        _R2, _R2, _R1, types.float64, types.float64, types.float64, types.int64, _F2, _F2, _F2, types.boolean[::1]
    ),
    cache=True,
    nogil=True,
)
def loop(cp, ca, K, h, tol, vmin, knots, ends, rows, buf, whole):
    """The covered area where its boundary is one loop: count of edges; NOTHING, GENERAL, FULL or UNSETTLED, which more
    ``knots`` in time may resolve. ``ends`` as of ``levels``; ``rows`` (k, 7) is room to work in; ``whole`` (1,).
    """
    span = np.empty((4, 2))
    m = spans(cp, ca, K, h, ends, span)
    if m != 1:
        return NOTHING if m == 0 else GENERAL
    begins, stops = span[0, 0], span[0, 1]
    length = stops - begins
    opens, closes = begins > 0.0, stops < 1.0
    ta = begins + INSET * length if opens else begins
    tb = stops - INSET * length if closes else stops
    S = np.empty((knots, 27))
    C = np.empty((knots, 8, 5))
    R = np.empty((knots, MAX_ROOTS, 7))
    sign = np.empty((knots, MAX_ROOTS), np.int64)
    count = np.empty(knots, np.int64)
    around = np.empty(knots, np.int64)
    grid = np.empty((knots, NODES))
    last = knots - 1
    for i in range(knots):
        t = ta if i == 0 else (tb if i == last else _time_of(i / last, begins, stops, opens, closes))
        if not instant(cp, ca, K, h, t, S[i], C[i]):
            return GENERAL
        count[i], around[i] = roots(S[i], K, C[i], vmin, R[i], sign[i], grid[i])
        if count[i] < 0 or count[i] > 2:
            return GENERAL
        rate = _rate_of(t, begins, stops, opens, closes)
        for k in range(NODES):
            grid[i, k] *= rate
    if not _sign_is_settled(grid, 1.0 / last, tol):
        return UNSETTLED if knots <= MOST_KNOTS else GENERAL
    whole[0] = True
    if count.max() == 0:
        if around.max() > 0 and around.min() < 0:
            return GENERAL
        outward = around.max() > 0
        i = last if outward else 0
        n = ring(S[i], K, C[i], tol, LAST if outward else FIRST, buf, 0)
        return FULL if n < 0 else n
    i0 = 0
    while count[i0] == 0:
        i0 += 1
    i1 = last
    while count[i1] == 0:
        i1 -= 1
    for i in range(knots):
        if (i < i0 and around[i] <= 0) or (i > i1 and around[i] >= 0) or (i0 <= i <= i1 and count[i] != 2):
            return GENERAL
    k = 0 if sign[i0, 0] == -1 else 1
    down0, up0 = R[i0, k].copy(), R[i0, 1 - k].copy()
    k = 0 if sign[i1, 0] == -1 else 1
    down1, up1 = R[i1, k].copy(), R[i1, 1 - k].copy()
    if i0 > 0 and not _find_meeting(cp, ca, K, h, tol, vmin, S[i0 - 1, 21], S[i0, 21], down0, up0):
        return GENERAL
    if i1 < last and not _find_meeting(cp, ca, K, h, tol, vmin, S[i1 + 1, 21], S[i1, 21], down1, up1):
        return GENERAL
    n = 0
    if i0 == 0:
        up0[2] = down0[2] + (up0[2] - down0[2]) % TAU
        n = arc(S[0], K, C[0], down0, up0, tol, FIRST, buf, n)
    else:
        n = edges_between(cp, ca, K, h, down0, up0, tol, buf, n)
    if n < 0:
        return FULL
    knot = (R[i0 : i1 + 1], sign[i0 : i1 + 1])
    n, back = _side(cp, ca, K, h, tol, vmin, up0, up1, knot, 1, rows, buf, n)
    if n < 0:
        return n
    if i1 == last:
        down1[2] = up1[2] + (down1[2] - up1[2]) % TAU
        n = arc(S[last], K, C[last], up1, down1, tol, LAST, buf, n)
    else:
        n = edges_between(cp, ca, K, h, up1, down1, tol, buf, n)
    if n < 0:
        return FULL
    n, more = _side(cp, ca, K, h, tol, vmin, down0, down1, knot, -1, rows, buf, n)
    if n < 0:
        return n
    area = 0.0
    for i in range(n):
        area += (buf[i, 0] - buf[0, 0]) * (buf[i, 3] - buf[0, 1]) - (buf[i, 2] - buf[0, 0]) * (buf[i, 1] - buf[0, 1])
    if not area > 0.0:
        return GENERAL
    whole[0] = not back and not more and simple(buf, n)
    return n


@njit(cache=True, nogil=True)
def loops(cps, cas, K, heights, first, tol, vmin, buf, count, knots, whole):
    """Loops of layers ``heights[first[m] : first[m + 1]]`` of moves m, one after the other into ``buf``.

    ``cps`` and ``cas`` (m, n, 3) are filled up with zeros; ``count`` (l,) takes the edges of each layer, NOTHING or
    GENERAL, ``knots`` (l,) how finely time was divided, ``whole`` (l,) whether the loop is known to be simple. Returns
    how many layers are done: all, or ``buf`` is full.
    """
    ends = np.empty((INSTANTS + 1, 2))
    rows = np.empty((buf.shape[0], 7))
    used = 0
    for m in range(len(first) - 1):
        cp, ca = cps[m], cas[m]
        if first[m] < first[m + 1]:
            levels(cp, ca, K, ends)
        for i in range(first[m], first[m + 1]):
            knots[i] = KNOTS
            n = loop(cp, ca, K, heights[i], tol, vmin, KNOTS, ends, rows, buf[used:], whole[i : i + 1])
            while n == UNSETTLED:
                knots[i] = 4 * knots[i] - 3
                n = loop(cp, ca, K, heights[i], tol, vmin, knots[i], ends, rows, buf[used:], whole[i : i + 1])
            if n == FULL:
                return i
            count[i] = n
            used += max(n, 0)
    return len(heights)
