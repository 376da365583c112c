"""Compiled loops that follow grazing points through a move and put pieces of boundary together.

Notation: arrays ``cp``, ``ca``, ``K``, ``S``, ``C`` and rows (x, y, theta, t, n_x, n_y, code) as in
:mod:`chipload.engagement.chips._kernels`. An edge (12): x, y of its start, x, y of its end, theta, t of both, slopes of
the curve against the edge at both ends, origin, area between the curve and the
edge (above 0 to the right). ``sign`` of a root: +1 from inward to outward speed with theta rising.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.engagement.chips._kernels import BOTTOM, TAU, TOP, instant, point, reach, speed
from chipload.engagement.chips.zeros._kernels import CORNER, MAX_ROOTS, NODES, deviation, root_near, roots, wrapped

FIRST, LAST, GRAZING, CHORD, CHORD_END, FIRST_CHORD, LAST_CHORD = 0, 1, 2, 3, 4, 5, 6
NOTHING, GENERAL, FULL, UNSETTLED = -1, -2, -3, -4
KNOTS, MOST_KNOTS = 5, 60
INSET = 1e-10  # of a span of time: where a section that begins as a point is looked at


@njit(cache=True, nogil=True)
def spans(cp, ca, K, h, n, out):
    """Times during which the layer cuts the cutter, into ``out`` (m, 2); their count. n intervals are looked at."""
    S = np.empty(27)
    cut = np.empty(4 * n + 8)
    g = np.empty(n + 1)
    for i in range(n + 1):
        g[i] = reach(cp, ca, K, h, i / n, S)
    m = 0
    for i in range(n + 1):
        left, right = max(i - 1, 0), min(i + 1, n)
        s = 1.0 if g[i] > 0.0 else -1.0
        if i > 0 and (g[i] > 0.0) != (g[i - 1] > 0.0):
            m = _crossing(cp, ca, K, h, (i - 1) / n, i / n, g[i] > 0.0, cut, m, S)
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
                    m = _crossing(cp, ca, K, h, left / n, x, s < 0.0, cut, m, S)
                    m = _crossing(cp, ca, K, h, x, right / n, s > 0.0, cut, m, S)
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


@njit(cache=True, nogil=True)
def _crossing(cp, ca, K, h, a, b, rising, cut, m, S):
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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
            if theta < goal + 1e-15 and theta > cur[2] + 1e-14:
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def track(cp, ca, K, h, tol, vmin, first, last, sign, out):
    """The curve V = 0 from row ``first`` to row ``last``, the only one of its sign; rows into ``out``, count, -1."""
    S = np.empty(27)
    C = np.empty((8, 5))
    R = np.empty((MAX_ROOTS, 7))
    signs = np.empty(MAX_ROOTS, np.int64)
    grid = np.empty(NODES)
    new = np.empty(7)
    out[0] = first
    n = 1
    most = (last[3] - first[3]) / 6.0
    dt = most
    slope = 0.0
    while True:
        cur = out[n - 1]
        if n >= out.shape[0] - 1:
            return -1
        rest = last[3] - cur[3]
        whole = dt >= 0.999 * rest
        if whole:
            new[:] = last
            new[2] = cur[2] + wrapped(last[2] - cur[2])
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
            new[2] = cur[2] + wrapped(new[2] - cur[2])
        dev = deviation(cur, new)
        took = new[3] - cur[3]
        if dev > tol:
            if took < 1e-14:
                return -1
            dt = took * max(0.1, 0.85 * math.sqrt(tol / dev))
            continue
        slope = (new[2] - cur[2]) / took
        dt = took * (min(3.0, 0.93 * math.sqrt(tol / dev)) if dev > 0.1 * tol else 3.0)
        dt = min(dt, most)
        out[n] = new
        n += 1
        if whole:
            return n


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


@njit(cache=True, nogil=True)
def loop(cp, ca, K, h, tol, vmin, knots, buf):
    """The covered area where its boundary is one simple loop: count of edges; NOTHING, GENERAL, FULL or
    UNSETTLED, which more ``knots`` in time may mend.
    """
    span = np.empty((4, 2))
    m = spans(cp, ca, K, h, 16, span)
    if m != 1:
        return NOTHING if m == 0 else GENERAL
    ta, tb = span[0, 0], span[0, 1]
    length = tb - ta
    if ta > 0.0:
        ta += INSET * length
    if tb < 1.0:
        tb -= INSET * length
    S = np.empty((knots, 27))
    C = np.empty((knots, 8, 5))
    R = np.empty((knots, MAX_ROOTS, 7))
    sign = np.empty((knots, MAX_ROOTS), np.int64)
    count = np.empty(knots, np.int64)
    around = np.empty(knots, np.int64)
    grid = np.empty((knots, NODES))
    dt = (tb - ta) / (knots - 1)
    for i in range(knots):
        t = tb if i == knots - 1 else ta + i * dt
        if not instant(cp, ca, K, h, t, S[i], C[i]):
            return GENERAL
        count[i], around[i] = roots(S[i], K, C[i], vmin, R[i], sign[i], grid[i])
        if count[i] < 0 or count[i] > 2:
            return GENERAL
    if not _settled(grid, dt, tol):
        return UNSETTLED if knots <= MOST_KNOTS else GENERAL
    last = knots - 1
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
    if i0 > 0 and not _meeting(cp, ca, K, h, tol, vmin, S[i0 - 1, 21], S[i0, 21], down0, up0):
        return GENERAL
    if i1 < last and not _meeting(cp, ca, K, h, tol, vmin, S[i1 + 1, 21], S[i1, 21], down1, up1):
        return GENERAL
    n = 0
    if i0 == 0:
        up0[2] = down0[2] + (up0[2] - down0[2]) % TAU
        n = arc(S[0], K, C[0], down0, up0, tol, FIRST, buf, n)
    else:
        n = between(cp, ca, K, h, down0, up0, tol, buf, n)
    if n < 0:
        return FULL
    rows = np.empty((buf.shape[0], 7))
    n = _side(cp, ca, K, h, tol, vmin, up0, up1, 1, rows, buf, n)
    if n < 0:
        return FULL if n == FULL else GENERAL
    if i1 == last:
        down1[2] = up1[2] + (down1[2] - up1[2]) % TAU
        n = arc(S[last], K, C[last], up1, down1, tol, LAST, buf, n)
    else:
        n = between(cp, ca, K, h, up1, down1, tol, buf, n)
    if n < 0:
        return FULL
    n = _side(cp, ca, K, h, tol, vmin, down0, down1, -1, rows, buf, n)
    if n < 0:
        return FULL if n == FULL else GENERAL
    if not simple(buf, n):
        return GENERAL
    area = 0.0
    for i in range(n):
        area += (buf[i, 0] - buf[0, 0]) * (buf[i, 3] - buf[0, 1]) - (buf[i, 2] - buf[0, 0]) * (buf[i, 1] - buf[0, 1])
    return n if area > 0.0 else GENERAL


@njit(cache=True, nogil=True)
def between(cp, ca, K, h, a, b, tol, buf, n):
    """Edges of the section between two grazing points that meet: it stands still there."""
    S = np.empty(27)
    C = np.empty((8, 5))
    instant(cp, ca, K, h, a[3], S, C)
    end = b.copy()
    end[2] = a[2] + (b[2] - a[2]) % TAU
    return arc(S, K, C, a, end, tol, GRAZING, buf, n)


@njit(cache=True, nogil=True)
def _settled(grid, dt, tol):
    """Whether V can't have changed sign and back between knots by more than tol / 4 of way."""
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
def _meeting(cp, ca, K, h, tol, vmin, t0, t1, down, up):
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


@njit(cache=True, nogil=True)
def _side(cp, ca, K, h, tol, vmin, first, last, sign, rows, buf, n):
    """Edges of one flank of the loop; GENERAL where the curve turns back."""
    m = track(cp, ca, K, h, tol, vmin, first, last, sign, rows)
    if m < 0:
        return GENERAL
    if n + m >= buf.shape[0] - 2:
        return FULL
    for i in range(m - 1):
        a, b = (rows[i], rows[i + 1]) if sign > 0 else (rows[m - 1 - i], rows[m - 2 - i])
        dx, dy = b[0] - a[0], b[1] - a[1]
        if dy * a[4] - dx * a[5] < 0.0 or dy * b[4] - dx * b[5] < 0.0:
            return GENERAL
        n = edge(buf, n, a, b, a[4], a[5], b[4], b[5], kind(a, b))
    return n
