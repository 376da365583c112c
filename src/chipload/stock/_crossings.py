"""Compiled loops that find where the boundaries of two areas cross, and in what order.

Notation: as in :mod:`chipload.stock._clip`. C is moved by (e, e^2), with e above 0 and smaller than any number.
Which edges cross is decided exactly, by signs of determinants. Crossings on one edge are in the order of their rounded
places. Where these are next to each other, two edges that follow each other decide by the turn between them; otherwise
the order is that in which ways into the other area and out of it alternate. The first point of a ring, inside or
outside the other area, must agree with it.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.stock._orientation import orient

#: results that are no number of crossings
DEGENERATE, FULL = -1, -2
#: two crossings nearer than this on an edge may be in either order [mm]
NEAR = 1e-10
#: columns of a crossing: ring and edge of A, of C, whether A enters C there, the next one on A, the next and the one
#: before it on C, whether it was passed; row n also holds the n-th crossing on C, and a crossing its place there
RING_A, EDGE_A, RING_C, EDGE_C, ENTERS, NEXT_A, NEXT_C, BEFORE_C, PASSED, ROW, RANK = range(11)


@njit(cache=True, nogil=True, inline="always")
def left_of_shifted(value, dx, dy):
    """Whether a point is left of an edge (dx, dy) of C, by :func:`orient` of the edge and the point."""
    if value != 0.0:
        return value > 0.0
    return dy > 0.0 if dy != 0.0 else dx < 0.0


@njit(cache=True, nogil=True, inline="always")
def shifted_left_of(value, dx, dy):
    """Whether a point of C is left of an edge (dx, dy), by :func:`orient` of the edge and the point."""
    if value != 0.0:
        return value > 0.0
    return dy < 0.0 if dy != 0.0 else dx > 0.0


@njit("boolean(float64, float64, float64[:,::1], int64[:,::1], int64, int64)", cache=True, nogil=True)
def shifted_holds(x, y, points, rings, first, last):
    """Whether a point lies in the area C, moved."""
    odd = False
    for r in range(first, last):
        start, count = rings[r, 0], rings[r, 1]
        k = start + count - 1
        for n in range(start, start + count):
            ux, uy, vx, vy = points[k, 0], points[k, 1], points[n, 0], points[n, 1]
            k = n
            if (uy >= y) == (vy >= y):
                continue
            if max(ux, vx) < x:
                continue
            if min(ux, vx) > x or left_of_shifted(orient(ux, uy, vx, vy, x, y), vx - ux, vy - uy) == (vy >= y):
                odd = not odd
    return odd


@njit("boolean(float64, float64, float64[:,::1], int64[:,::1], int64, int64)", cache=True, nogil=True)
def holds_shifted(x, y, points, rings, first, last):
    """Whether a point of C, moved, lies in an area."""
    odd = False
    for r in range(first, last):
        start, count = rings[r, 0], rings[r, 1]
        k = start + count - 1
        for n in range(start, start + count):
            ux, uy, vx, vy = points[k, 0], points[k, 1], points[n, 0], points[n, 1]
            k = n
            if (uy > y) == (vy > y):
                continue
            if max(ux, vx) < x:
                continue
            if min(ux, vx) > x or shifted_left_of(orient(ux, uy, vx, vy, x, y), vx - ux, vy - uy) == (vy > y):
                odd = not odd
    return odd


@njit(
    "void(float64, float64, float64, float64, float64, float64, float64, float64, float64, float64, float64, float64,"
    " float64[::1])",
    cache=True,
    nogil=True,
)
def place(px, py, qx, qy, ux, uy, vx, vy, s1, s2, s3, s4, row):
    """Place of a crossing of P to Q with U to V into ``row``: its distances from P and from U, and x, y.

    ``s1`` to ``s4`` are the determinants of U and V against P to Q, and of P and Q against U to V. Where the edges are
    almost parallel the place is on the shorter one, and the distances are those of that place.
    """
    dx, dy, ex, ey = qx - px, qy - py, vx - ux, vy - uy
    a, c = math.sqrt(dx * dx + dy * dy), math.sqrt(ex * ex + ey * ey)
    if s1 == 0.0:
        x, y = ux, uy
    elif s2 == 0.0:
        x, y = vx, vy
    elif a <= c:
        t = s3 / (s3 - s4)
        x, y = (px + t * dx, py + t * dy) if t <= 0.5 else (qx - s4 / (s4 - s3) * dx, qy - s4 / (s4 - s3) * dy)
    else:
        t = s1 / (s1 - s2)
        x, y = (ux + t * ex, uy + t * ey) if t <= 0.5 else (vx - s2 / (s2 - s1) * ex, vy - s2 / (s2 - s1) * ey)
    # an edge along an axis, as the borders of tiles are, stays in line
    if px == qx:
        x = px
    if py == qy:
        y = py
    row[0] = ((x - px) * dx + (y - py) * dy) / a
    row[1] = ((x - ux) * ex + (y - uy) * ey) / c
    row[2], row[3] = x, y


@njit(
    "boolean(float64, int64[:,::1], int64, int64, int64, float64[:,::1], int64[:,::1], int64)", cache=True, nogil=True
)
def comes_before(way, cross, k, b, column, points, rings, left_first):
    """Whether crossing k comes before b on an edge that both are on, b having been found first.

    Parameters
    ----------
    way : distance from b to k along the edge
    column : RING_A or RING_C of the other area, whose ``points`` and ``rings`` follow
    left_first : what ENTERS is of the crossing that comes first where the other area turns left between the two
    """
    if abs(way) > NEAR:
        return way < 0.0
    r, e, f = cross[k, column], cross[k, column + 1], cross[b, column + 1]
    if cross[b, column] == r and cross[b, ENTERS] != cross[k, ENTERS]:
        start, count = rings[r, 0], rings[r, 1]
        # the vertex between two edges that follow each other is on one side, and the turn there says which is first
        if (e + 1) % count == f or (f + 1) % count == e:
            at = f if (e + 1) % count == f else e
            i, j, n = start + (at - 1) % count, start + at, start + (at + 1) % count
            turn = orient(points[i, 0], points[i, 1], points[j, 0], points[j, 1], points[n, 0], points[n, 1])
            if turn != 0.0:
                return (cross[k, ENTERS] == left_first) == (turn > 0.0)
    return way < 0.0


@njit(
    "int64(float64, float64, float64, float64, int64, int64, float64[:,::1], int64[:,::1], int64, int64,"
    " float64[:,::1], int64[:,::1], int64)",
    cache=True,
    nogil=True,
)
def edge_crossings(px, py, qx, qy, r, e, Q, C, c0, c1, X, cross, n):
    """Add the crossings of one edge of A to the ``n`` found, sorted along it; their number, or FULL."""
    begin = n
    x0, x1, y0, y1 = min(px, qx), max(px, qx), min(py, qy), max(py, qy)
    for c in range(c0, c1):
        start, count = C[c, 0], C[c, 1]
        ux, uy = Q[start, 0], Q[start, 1]
        for f in range(count):
            v = start + f + 1 if f + 1 < count else start
            bx, by = ux, uy
            ux, uy = Q[v, 0], Q[v, 1]
            if max(bx, ux) < x0 or min(bx, ux) > x1 or max(by, uy) < y0 or min(by, uy) > y1:
                continue
            s3, s4 = orient(bx, by, ux, uy, px, py), orient(bx, by, ux, uy, qx, qy)
            inside = left_of_shifted(s4, ux - bx, uy - by)
            if left_of_shifted(s3, ux - bx, uy - by) == inside:
                continue
            s1, s2 = orient(px, py, qx, qy, bx, by), orient(px, py, qx, qy, ux, uy)
            if shifted_left_of(s1, qx - px, qy - py) == shifted_left_of(s2, qx - px, qy - py):
                continue
            if n == X.shape[0]:
                return FULL
            place(px, py, qx, qy, bx, by, ux, uy, s1, s2, s3, s4, X[n])
            cross[n, RING_A], cross[n, EDGE_A], cross[n, RING_C], cross[n, EDGE_C] = r, e, c, f
            cross[n, ENTERS] = 1 if inside else 0
            k = n
            while k > begin and comes_before(X[k, 0] - X[k - 1, 0], cross, k, k - 1, RING_C, Q, C, 1):
                for i in range(X.shape[1]):
                    X[k, i], X[k - 1, i] = X[k - 1, i], X[k, i]
                for i in range(ENTERS + 1):
                    cross[k, i], cross[k - 1, i] = cross[k - 1, i], cross[k, i]
                k -= 1
            n += 1
    return n


@njit(
    "int64(float64[:,::1], int64[:,::1], int64, int64, float64[:,::1], int64[:,::1], int64, int64, float64[::1],"
    " float64[:,::1], int64[:,::1])",
    cache=True,
    nogil=True,
)
def crossings(P, A, a0, a1, Q, C, c0, c1, box, X, cross):
    """Crossings of A and C in their order on A: their number, FULL or DEGENERATE.

    ``box`` holds the least and greatest x and y of C; ``X`` takes rows of :func:`place`.
    """
    n = 0
    for r in range(a0, a1):
        start, count = A[r, 0], A[r, 1]
        ring = n
        px, py = P[start, 0], P[start, 1]
        for e in range(count):
            q = start + e + 1 if e + 1 < count else start
            qx, qy = P[q, 0], P[q, 1]
            if max(px, qx) < box[0] or min(px, qx) > box[2] or max(py, qy) < box[1] or min(py, qy) > box[3]:
                px, py = qx, qy
                continue
            n = edge_crossings(px, py, qx, qy, r, e, Q, C, c0, c1, X, cross, n)
            if n < 0:
                return n
            px, py = qx, qy
        # into and out of C in turn
        if (n - ring) % 2:
            return DEGENERATE
        for k in range(ring, n):
            if k > ring and cross[k, ENTERS] == cross[k - 1, ENTERS]:
                near = k + 1 < n and cross[k + 1, EDGE_A] == cross[k, EDGE_A] and X[k + 1, 0] - X[k, 0] <= NEAR
                if not near or cross[k + 1, ENTERS] == cross[k, ENTERS]:
                    return DEGENERATE
                for i in range(X.shape[1]):
                    X[k, i], X[k + 1, i] = X[k + 1, i], X[k, i]
                for i in range(ENTERS + 1):
                    cross[k, i], cross[k + 1, i] = cross[k + 1, i], cross[k, i]
            cross[k, NEXT_A] = k + 1 if k + 1 < n else ring
        if n == ring:
            continue
        if cross[ring, ENTERS] == cross[n - 1, ENTERS]:
            return DEGENERATE
        if shifted_holds(P[start, 0], P[start, 1], Q, C, c0, c1) == (cross[ring, ENTERS] == 1):
            return DEGENERATE
    return n


@njit(
    "boolean(int64, float64[:,::1], int64[:,::1], float64[:,::1], int64[:,::1], float64[:,::1], int64[:,::1], int64,"
    " int64)",
    cache=True,
    nogil=True,
)
def ordered_on_c(n, X, cross, Q, C, P, A, a0, a1):
    """Find which crossing follows which on the rings of C; False: they do not go into A and out of it in turn."""
    for k in range(n):
        r, f, at = cross[k, RING_C], cross[k, EDGE_C], k
        while at > 0:
            b = cross[at - 1, ROW]
            rb, fb = cross[b, RING_C], cross[b, EDGE_C]
            if rb < r or (rb == r and fb < f):
                break
            if rb == r and fb == f and not comes_before(X[k, 1] - X[b, 1], cross, k, b, RING_A, P, A, 0):
                break
            cross[at, ROW] = b
            at -= 1
        cross[at, ROW] = k
    begin = 0
    while begin < n:
        end = begin + 1
        while end < n and cross[cross[end, ROW], RING_C] == cross[cross[begin, ROW], RING_C]:
            end += 1
        if (end - begin) % 2:
            return False
        for k in range(begin + 1, end):
            a, b = cross[k - 1, ROW], cross[k, ROW]
            if cross[a, ENTERS] != cross[b, ENTERS]:
                continue
            if k + 1 == end:
                return False
            c = cross[k + 1, ROW]
            if cross[c, ENTERS] == cross[b, ENTERS] or cross[c, EDGE_C] != cross[b, EDGE_C]:
                return False
            if X[c, 1] - X[b, 1] > NEAR:
                return False
            cross[k, ROW], cross[k + 1, ROW] = c, b
        for k in range(begin, end):
            a, b = cross[k, ROW], cross[k + 1 if k + 1 < end else begin, ROW]
            cross[a, NEXT_C], cross[b, BEFORE_C], cross[a, RANK] = b, a, k
        a = cross[begin, ROW]
        if cross[a, ENTERS] == cross[cross[end - 1, ROW], ENTERS]:
            return False
        start = C[cross[a, RING_C], 0]
        if holds_shifted(Q[start, 0], Q[start, 1], P, A, a0, a1) != (cross[a, ENTERS] == 1):
            return False
        begin = end
    return True
