"""Compiled difference and intersection of two areas bounded by rings.

Notation: an area is some rings of points [mm], none closed by repeating its first point, with the area on the left of
each edge (outer ones counter-clockwise, holes clockwise); ``rings`` (k, 2) holds the first point and the number of
points of each ring, and an area is some consecutive rows of it. A is the area that is cut, C the one that cuts.

What crosses what is decided exactly (:mod:`chipload.stock._crossings`): by signs of determinants, of A and
of C moved by (e, e^2), with e above 0 and smaller than any number. So moved, no vertex lies on an edge of the other and
no edges overlap. Where rings coincide the result has parts of no width, which are left out. Places of crossings are
rounded.

Rings are followed from crossing to crossing ([Weiler1977]). On a ring of either, crossings into and out of
the other alternate. Where they do not, because A or C crosses itself by rounding, the two are not cut: DEGENERATE.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.stock._crossings import (
    BEFORE_C,
    DEGENERATE,
    EDGE_A,
    EDGE_C,
    ENTERS,
    FULL,
    NEXT_A,
    NEXT_C,
    PASSED,
    RANK,
    RING_A,
    RING_C,
    crossings,
    holds_shifted,
    ordered_on_c,
    shifted_holds,
)

#: results of :func:`clip` other than DEGENERATE and FULL (no room for the result): A and C do not meet, they were cut
APART, CUT = 0, 1
#: a ring narrower than this is none [mm]
WIDTH = 1e-12
#: greatest difference between the area of A and the sum of both results [mm^2], and as a share of that area
BALANCE = 1e-9


@njit("boolean(float64, float64, float64, float64, float64, float64)", cache=True, nogil=True)
def turns_back(ax, ay, bx, by, cx, cy):
    """Whether the way from A to B goes back to C along itself, within WIDTH, or B is A."""
    dx, dy, ex, ey = bx - ax, by - ay, cx - bx, cy - by
    if dx * ex + dy * ey > 0.0:
        return False
    d, e = dx * dx + dy * dy, ex * ex + ey * ey
    if d == 0.0 or e == 0.0:
        return True
    across = abs(dx * ey - dy * ex)
    return dx * ex + dy * ey < 0.0 and across * across <= WIDTH * WIDTH * max(d, e)


@njit("int64(float64[:,::1], int64, int64)", cache=True, nogil=True)
def tidied_ring(points, start, count):
    """Number of points of a ring without repeated ones and without ways there and back; they are moved up."""
    last = start - 1
    for k in range(start, start + count):
        x, y = points[k, 0], points[k, 1]
        while last > start and turns_back(
            points[last - 1, 0], points[last - 1, 1], points[last, 0], points[last, 1], x, y
        ):
            last -= 1
        if last < start or x != points[last, 0] or y != points[last, 1]:
            last += 1
            points[last, 0], points[last, 1] = x, y
    first = start
    while last - first >= 2:
        ax, ay, bx, by = points[last - 1, 0], points[last - 1, 1], points[last, 0], points[last, 1]
        cx, cy, dx, dy = points[first, 0], points[first, 1], points[first + 1, 0], points[first + 1, 1]
        if (bx == cx and by == cy) or turns_back(ax, ay, bx, by, cx, cy):
            last -= 1
        elif turns_back(bx, by, cx, cy, dx, dy):
            first += 1
        else:
            break
    if last - first < 2:
        return 0
    count = last - first + 1
    if first > start:
        for k in range(count):
            points[start + k, 0], points[start + k, 1] = points[first + k, 0], points[first + k, 1]
    return count


@njit("UniTuple(float64, 2)(float64[:,::1], int64, int64)", cache=True, nogil=True)
def ring_size(points, start, count):
    """Signed area and length of a ring."""
    x0, y0 = points[start, 0], points[start, 1]
    px, py = points[start + count - 1, 0] - x0, points[start + count - 1, 1] - y0
    area, length = 0.0, 0.0
    for k in range(start, start + count):
        x, y = points[k, 0] - x0, points[k, 1] - y0
        area += px * y - x * py
        length += math.sqrt((x - px) * (x - px) + (y - py) * (y - py))
        px, py = x, y
    return 0.5 * area, length


@njit(
    "int64(float64[:,::1], int64[:,::1], int64, int64, int64, boolean, float64[:,::1], int64)", cache=True, nogil=True
)
def copy_along(P, rings, r, e0, e1, wraps, out, n):
    """Copy the points of a ring between its edges ``e0`` and ``e1``, forwards; ``wraps``: over its first point."""
    start, count = rings[r, 0], rings[r, 1]
    for k in range(e0 + 1, e1 + 1 + (count if wraps else 0)):
        at = start + (k if k < count else k - count)
        out[n, 0], out[n, 1] = P[at, 0], P[at, 1]
        n += 1
    return n


@njit(
    "int64(float64[:,::1], int64[:,::1], int64, int64, int64, boolean, float64[:,::1], int64)", cache=True, nogil=True
)
def copy_against(P, rings, r, e0, e1, wraps, out, n):
    """Copy the points of a ring between its edges ``e0`` and ``e1``, backwards; ``wraps``: over its first point."""
    start, count = rings[r, 0], rings[r, 1]
    for k in range(e0, e1 - (count if wraps else 0), -1):
        at = start + (k if k >= 0 else k + count)
        out[n, 0], out[n, 1] = P[at, 0], P[at, 1]
        n += 1
    return n


@njit(
    "int64(float64[:,::1], int64[:,::1], float64[:,::1], int64[:,::1], int64, boolean, float64[:,::1], int64[:,::1],"
    " float64[:,::1], int64)",
    cache=True,
    nogil=True,
)
def follow_ring(P, A, Q, C, k, taken, X, cross, out, n):
    """Points of the ring of the intersection (``taken``), or else of the difference, that goes through crossing k.

    Returns the place after the last one in ``out``, or DEGENERATE.
    """
    at = k
    while True:
        if cross[at, PASSED]:
            return DEGENERATE
        cross[at, PASSED] = 1
        out[n, 0], out[n, 1] = X[at, 2], X[at, 3]
        then = cross[at, NEXT_A]
        n = copy_along(P, A, cross[at, RING_A], cross[at, EDGE_A], cross[then, EDGE_A], then <= at, out, n + 1)
        out[n, 0], out[n, 1] = X[then, 2], X[then, 3]
        n += 1
        r, e = cross[then, RING_C], cross[then, EDGE_C]
        if taken:
            at = cross[then, NEXT_C]
            n = copy_along(Q, C, r, e, cross[at, EDGE_C], cross[at, RANK] <= cross[then, RANK], out, n)
        else:
            at = cross[then, BEFORE_C]
            n = copy_against(Q, C, r, e, cross[at, EDGE_C], cross[at, RANK] >= cross[then, RANK], out, n)
        if at == k:
            return n


@njit("int64(float64[:,::1], int64[:,::1], int64[::1], int64, float64[::1])", cache=True, nogil=True)
def close_ring(points, rings, used, end, sizes):
    """Enter the ring that ends at ``end``, if it is one; ``used`` holds the numbers of points and rings.

    ``sizes`` gets its area added.
    """
    count = tidied_ring(points, used[0], end - used[0])
    if count:
        area, length = ring_size(points, used[0], count)
        if abs(area) > WIDTH * length:
            rings[used[1], 0], rings[used[1], 1] = used[0], count
            used[0] += count
            used[1] += 1
            sizes[0] += area
    return count


@njit(
    "boolean(float64[:,::1], int64[:,::1], int64, int64, float64[:,::1], int64[:,::1], int64, int64, float64[::1],"
    " float64[:,::1], int64[:,::1], int64[::1], float64[:,::1], int64[:,::1], int64[::1], int64, int64[:,::1],"
    " float64[::1])",
    cache=True,
    nogil=True,
)
def whole_rings(P, A, a0, a1, Q, C, c0, c1, box, left, left_rings, left_used, chip, chip_rings, chip_used, n, cross,
                areas):  # fmt: skip
    """Enter the rings that cross nothing into the results, as :func:`clip`; whether one is in the intersection."""
    met = False
    areas[0] = areas[1] = areas[2] = 0.0
    at = 0
    for r in range(a0, a1):
        start, count = A[r, 0], A[r, 1]
        areas[0] += ring_size(P, start, count)[0]
        crossed = False
        while at < n and cross[at, RING_A] == r:
            at += 1
            crossed = True
        if crossed:
            continue
        x, y = P[start, 0], P[start, 1]
        inside = box[0] <= x <= box[2] and box[1] <= y <= box[3] and shifted_holds(x, y, Q, C, c0, c1)
        into, used = (chip, chip_used) if inside else (left, left_used)
        met = met or inside
        end = used[0]
        for k in range(start, start + count):
            into[end, 0], into[end, 1] = P[k, 0], P[k, 1]
            end += 1
        close_ring(into, chip_rings if inside else left_rings, used, end, areas[2:3] if inside else areas[1:2])
    for r in range(c0, c1):
        start, count = C[r, 0], C[r, 1]
        crossed = False
        for k in range(n):
            crossed = crossed or cross[k, RING_C] == r
        if crossed or not holds_shifted(Q[start, 0], Q[start, 1], P, A, a0, a1):
            continue
        met = True
        end, back = chip_used[0], left_used[0] + count - 1
        for k in range(start, start + count):
            chip[end, 0], chip[end, 1] = Q[k, 0], Q[k, 1]
            left[back, 0], left[back, 1] = Q[k, 0], Q[k, 1]
            end, back = end + 1, back - 1
        close_ring(chip, chip_rings, chip_used, end, areas[2:3])
        close_ring(left, left_rings, left_used, left_used[0] + count, areas[1:2])
    return met


@njit(
    "int64(float64[:,::1], int64[:,::1], int64, int64, float64[:,::1], int64[:,::1], int64, int64, float64[::1],"
    " float64[:,::1], int64[:,::1], int64[::1], float64[:,::1], int64[:,::1], int64[::1], float64[:,::1],"
    " int64[:,::1], float64[::1])",
    cache=True,
    nogil=True,
)
def clip(P, A, a0, a1, Q, C, c0, c1, box, left, left_rings, left_used, chip, chip_rings, chip_used, X, cross, areas):
    """Cut C out of A: APART, CUT, DEGENERATE or FULL.

    ``left`` receives the difference, ``chip`` the intersection; ``left`` and ``P`` may be one array. ``areas`` receives
    the areas of A, of the difference and of the intersection. Unless CUT, nothing is entered.
    """
    n = crossings(P, A, a0, a1, Q, C, c0, c1, box, X, cross)
    if n < 0:
        return n
    if n > 0 and not ordered_on_c(n, X, cross, Q, C, P, A, a0, a1):
        return DEGENERATE
    size_a, size_c = 0, 0
    for r in range(a0, a1):
        size_a += A[r, 1]
    for r in range(c0, c1):
        size_c += C[r, 1]
    # each point of A and C comes at most once into each result, each crossing at most twice
    room, more = size_a + size_c + 2 * n, a1 - a0 + c1 - c0 + n
    if left_used[0] + room > left.shape[0] or chip_used[0] + room > chip.shape[0]:
        return FULL
    if left_used[1] + more > left_rings.shape[0] or chip_used[1] + more > chip_rings.shape[0]:
        return FULL
    l0, l1, h0, h1 = left_used[0], left_used[1], chip_used[0], chip_used[1]
    met = whole_rings(P, A, a0, a1, Q, C, c0, c1, box, left, left_rings, left_used, chip, chip_rings, chip_used, n,
                      cross, areas)  # fmt: skip
    for k in range(n):
        cross[k, PASSED] = 0
    for k in range(n):
        if cross[k, PASSED]:
            continue
        taken = cross[k, ENTERS] == 1
        into, used = (chip, chip_used) if taken else (left, left_used)
        end = follow_ring(P, A, Q, C, k, taken, X, cross, into, used[0])
        if end < 0:
            left_used[0], left_used[1], chip_used[0], chip_used[1] = l0, l1, h0, h1
            return DEGENERATE
        close_ring(into, chip_rings if taken else left_rings, used, end, areas[2:3] if taken else areas[1:2])
    status = CUT
    if abs(areas[0] - areas[1] - areas[2]) > BALANCE * (1.0 + areas[0]) or min(areas[1], areas[2]) < -BALANCE:
        status = DEGENERATE
    elif not met and chip_used[1] == h1:
        status = APART
    if status != CUT:
        left_used[0], left_used[1], chip_used[0], chip_used[1] = l0, l1, h0, h1
    return status
