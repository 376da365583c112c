"""Compiled loops that follow grazing points through a move and write the edges of the boundary.

Notation: arrays ``cp``, ``ca``, ``K``, ``S``, ``C`` and rows (x, y, theta, t, n_x, n_y, code) as in
:mod:`chipload.engagement.chips._section`. An edge (12): x, y of its start, x, y of its end, theta, t of both, slopes of
the curve against the edge at both ends, origin, area between the curve and the edge (above 0 to the right). ``sign`` of
a root: +1 from inward to outward speed with theta rising.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.engagement.chips._grazing_points import CORNER, MAX_ROOTS, NODES, deviation, root_near, roots, wrap_angle
from chipload.engagement.chips._section import BOTTOM, TAU, TOP, extent, instant, point, reach, speed, state

FIRST, LAST, GRAZING, CHORD, CHORD_END, FIRST_CHORD, LAST_CHORD = 0, 1, 2, 3, 4, 5, 6
NOTHING, GENERAL, FULL, UNSETTLED = -1, -2, -3, -4
INSET = 1e-10  # of a span of time: where a section that begins as a point is looked at
SAME = 1e-12  # [rad] a corner this near to the end of an arc is its end


#: types are stated: a constant among the arguments would else be compiled as a type of its own
_R1 = types.Array(types.float64, 1, "C", readonly=True)
_R2 = types.Array(types.float64, 2, "C", readonly=True)
_F1, _F2, _I1 = types.float64[::1], types.float64[:, ::1], types.int64[::1]


@njit(types.void(_R2, _R2, _R1, _F2), cache=True, nogil=True)
def levels(cp, ca, K, ends):
    """Lowest and highest point of the cutter [mm] at even instants, into ``ends`` (n + 1, 2)."""
    S = np.empty(27)
    n = ends.shape[0] - 1
    for i in range(n + 1):
        state(cp, ca, i / n, S)
        low, _, high, _ = extent(S, K)
        ends[i, 0] = S[2] + low
        ends[i, 1] = S[2] + high


@njit(
    types.int64(_R2, _R2, _R1, types.float64, types.float64, types.float64, types.boolean, _F1, types.int64, _F1),
    cache=True,
    nogil=True,
)
def _trace_crossing(cp, ca, K, h, a, b, rising, cut, m, S):
    for _ in range(60):
        x = 0.5 * (a + b)
        if x <= a or x >= b:
            break
        if (reach(cp, ca, K, h, x, S) > 0.0) == rising:
            b = x
        else:
            a = x
    cut[m] = b if rising else a
    return m + 1


@njit(types.int64(_R2, _R2, _R1, types.float64, _F2, _F2), cache=True, nogil=True)
def spans(cp, ca, K, h, ends, out):
    """Time ranges in which the layer cuts the cutter, into ``out`` (m, 2); their number. ``ends`` of :func:`levels`."""
    S = np.empty(27)
    n = ends.shape[0] - 1
    cut = np.empty(4 * n + 8)
    g = np.empty(n + 1)
    for i in range(n + 1):
        g[i] = min(h - ends[i, 0], ends[i, 1] - h)
    m = 0
    for i in range(n + 1):
        left, right = max(i - 1, 0), min(i + 1, n)
        s = 1.0 if g[i] > 0.0 else -1.0
        if i > 0 and (g[i] > 0.0) != (g[i - 1] > 0.0):
            m = _trace_crossing(cp, ca, K, h, (i - 1) / n, i / n, g[i] > 0.0, cut, m, S)
        turns = s * g[i] <= s * g[left] and s * g[i] <= s * g[right] and s * g[left] > 0.0 and s * g[right] > 0.0
        if turns and abs(g[i]) <= 2.0 * max(abs(g[i] - g[left]), abs(g[i] - g[right])):
            a, b = left / n, right / n
            for _ in range(60):
                x1 = b - 0.6180339887498949 * (b - a)
                x2 = a + 0.6180339887498949 * (b - a)
                g1 = s * reach(cp, ca, K, h, x1, S)
                g2 = s * reach(cp, ca, K, h, x2, S)
                if min(g1, g2) < 0.0:
                    x = x1 if g1 < g2 else x2
                    m = _trace_crossing(cp, ca, K, h, left / n, x, s < 0.0, cut, m, S)
                    m = _trace_crossing(cp, ca, K, h, x, right / n, s > 0.0, cut, m, S)
                    break
                if g1 < g2:
                    b = x2
                else:
                    a = x1
                if b - a < 1e-12:
                    break
    cuts = np.sort(cut[:m])
    count = 0
    inside = g[0] > 0.0
    start = 0.0
    for i in range(m):
        if inside and cuts[i] > start and count < out.shape[0]:
            out[count, 0], out[count, 1] = start, cuts[i]
            count += 1
        inside = not inside
        start = cuts[i]
    if inside and start < 1.0 and count < out.shape[0]:
        out[count, 0], out[count, 1] = start, 1.0
        count += 1
    return count


@njit(
    types.int64(_F2, types.int64, _F1, _F1, types.float64, types.float64, types.float64, types.float64, types.int64),
    cache=True,
    nogil=True,
)
def edge(buf, n, a, b, ax, ay, bx, by, origin):
    """Write the edge from row a to row b, of which (ax, ay), (bx, by) are normals; the new count."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    if dx == 0.0 and dy == 0.0:
        return n
    row = buf[n]
    row[0], row[1], row[2], row[3] = a[0], a[1], b[0], b[1]
    row[4], row[5], row[6], row[7] = a[2], a[3], b[2], b[3]
    ma, mb = dy * ax - dx * ay, dy * bx - dx * by
    row[8] = row[9] = 0.0
    if abs(ma) > 0.0 or abs(mb) > 0.0:
        ca, cb = dx * ax + dy * ay, dx * bx + dy * by
        if abs(ca) < abs(ma) and abs(cb) < abs(mb):
            row[8], row[9] = ca / ma, cb / mb
    row[10] = origin
    row[11] = (dx * dx + dy * dy) * (row[9] - row[8]) / 12.0
    return n + 1


@njit(types.int64(_F1, _R1, _F2, _F1, _F1, types.float64, types.int64, _F2, types.int64), cache=True, nogil=True)
def arc(S, K, C, a, b, tol, origin, buf, n):
    """Edges of the section from row a on to row b, counter-clockwise, b[2] > a[2]; new count, -1 where full."""
    cur = a.copy()
    new = np.empty(7)
    end = b[2]
    nc = int(S[20])
    code = cur[6]
    for i in range(nc):
        if code == CORNER and C[i, 1] == cur[0] and C[i, 2] == cur[1]:
            code = C[i, 4]
            _, cur[4], cur[5] = speed(S, K, cur[0], cur[1], int(code))
    step = 0.2
    while True:
        goal = end
        at = -1
        for i in range(nc):
            theta = C[i, 0] + TAU * math.floor((cur[2] - C[i, 0]) / TAU + 1.0 + 1e-15)
            if theta < goal + SAME and theta > cur[2] + 1e-14:
                goal = min(theta, end)
                at = i
        straight = code in (BOTTOM, TOP) and K[1] == 0.0
        if n >= buf.shape[0] - 2:
            return -1
        rest = goal - cur[2]
        whole = straight or step >= 0.999 * rest
        if whole:
            new[:] = b
            if at >= 0:
                new[0], new[1], new[2] = C[at, 1], C[at, 2], goal
                _, new[4], new[5] = speed(S, K, new[0], new[1], int(C[at, 3]))
            new[3] = S[21]
        else:
            point(S, K, cur[2] + min(step, 0.5 * rest), new)
        if not straight:
            dev = deviation(cur, new)
            took = new[2] - cur[2]
            if dev > tol and took > 1e-9:
                step = took * max(0.2, 0.85 * math.sqrt(tol / dev))
                continue
            step = took * (min(3.0, 0.93 * math.sqrt(tol / dev)) if dev > 0.1 * tol else 3.0)
            step = min(step, 0.5)
        of = origin
        if code in (BOTTOM, TOP):
            of = CHORD if origin == GRAZING else (FIRST_CHORD if origin == FIRST else LAST_CHORD)
        n = edge(buf, n, cur, new, cur[4], cur[5], new[4], new[5], of)
        if whole and goal >= end:
            return n
        cur[:] = new
        if whole and at >= 0:
            code = C[at, 4]
            _, cur[4], cur[5] = speed(S, K, cur[0], cur[1], int(code))
            step = 0.2
        else:
            code = cur[6]


@njit(types.int64(_F1, _R1, _F2, types.float64, types.int64, _F2, types.int64), cache=True, nogil=True)
def ring(S, K, C, tol, origin, buf, n):
    """The whole section at one instant."""
    a = np.empty(7)
    b = np.empty(7)
    if S[20] > 0.0:
        a[0], a[1], a[2], a[3], a[6] = C[0, 1], C[0, 2], C[0, 0], S[21], CORNER
        _, a[4], a[5] = speed(S, K, a[0], a[1], int(C[0, 4]))
    else:
        point(S, K, 0.0, a)
    b[:] = a
    b[2] += TAU
    return arc(S, K, C, a, b, tol, origin, buf, n)


@njit(
    types.int64(
        _F1, _R1, _F2, _F2, _I1, types.int64, types.int64, types.int64, types.float64, types.int64, _F2, types.int64
    ),
    cache=True,
    nogil=True,
)
def sides(S, K, C, R, sign, count, around, wanted, tol, origin, buf, n):
    """Edges of the section where V has the sign ``wanted``; -1 where full."""
    if count == 0:
        return ring(S, K, C, tol, origin, buf, n) if around == wanted else n
    b = np.empty(7)
    for i in range(count):
        if sign[i] == wanted:
            b[:] = R[(i + 1) % count]
            while b[2] <= R[i, 2]:
                b[2] += TAU
            n = arc(S, K, C, R[i], b, tol, origin, buf, n)
            if n < 0:
                return n
    return n


@njit(cache=True, nogil=True)
def kind(a, b):
    """Origin of an edge between two grazing points."""
    code = a[6] if a[3] <= b[3] else b[6]
    if code == CORNER:
        return CHORD_END
    return CHORD if code in (BOTTOM, TOP) else GRAZING


@njit(
    types.int64(_R2, _R2, _R1, types.float64, types.float64, types.float64, _F1, types.int64, _F2, types.int64),
    cache=True,
    nogil=True,
)
def track(cp, ca, K, h, tol, vmin, last, sign, out, n):
    """The curve V = 0 on from row ``out[n - 1]`` to row ``last``, the only one of its sign; count of rows, -1."""
    S = np.empty(27)
    C = np.empty((8, 5))
    R = np.empty((MAX_ROOTS, 7))
    signs = np.empty(MAX_ROOTS, np.int64)
    grid = np.empty(NODES)
    new = np.empty(7)
    dt = last[3] - out[n - 1, 3]
    slope = 0.0
    while True:
        cur = out[n - 1]
        if n >= out.shape[0] - 1:
            return -1
        rest = last[3] - cur[3]
        whole = dt >= 0.999 * rest
        if whole:
            new[:] = last
            new[2] = cur[2] + wrap_angle(last[2] - cur[2])
        else:
            if dt > 0.5 * rest:
                dt = 0.5 * rest
            if not instant(cp, ca, K, h, cur[3] + dt, S, C):
                return -1
            guess = slope * dt
            if not root_near(S, K, C, cur[2] + guess, 0.02 + 0.2 * abs(guess), sign, new):
                count, _ = roots(S, K, C, vmin, R, signs, grid)
                if count != 2:
                    return -1
                new[:] = R[0] if signs[0] == sign else R[1]
            new[2] = cur[2] + wrap_angle(new[2] - cur[2])
        dev = deviation(cur, new)
        took = new[3] - cur[3]
        if dev > tol:
            if took < 1e-14:
                return -1
            dt = took * max(0.1, 0.85 * math.sqrt(tol / dev))
            continue
        slope = (new[2] - cur[2]) / took
        dt = took * (min(3.0, 0.93 * math.sqrt(tol / dev)) if dev > 0.1 * tol else 3.0)
        out[n] = new
        n += 1
        if whole:
            return n
