"""Compiled loops of the general case: all curves of the diagram as edges, and the test whether a point is covered.

Notation: arrays, rows and edges as in :mod:`chipload.engagement.chips._section` and its ``trace``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.engagement.chips._grazing_points import MAX_ROOTS, NODES, deviation, roots
from chipload.engagement.chips._grazing_trace import FIRST, FULL, GRAZING, INSET, LAST, arc, edge, kind, ring, sides
from chipload.engagement.chips._section import TAU, instant, state

DEPTH = 64
LEAST = 1e-12  # [t] nearer than this two instants are one


@njit(cache=True, nogil=True)
def candidates(cp, ca, K, h, tol, vmin, ta, tb, knots, buf, n, jumps):
    """Edges of all candidate pieces of one span of time: new count, FULL; and how many ``jumps`` (t) of the section."""
    width = tb - ta
    if ta > 0.0:
        ta += INSET * width
    if tb < 1.0:
        tb -= INSET * width
    S = np.empty((DEPTH, 27))
    C = np.empty((DEPTH, 8, 5))
    R = np.empty((DEPTH, MAX_ROOTS, 7))
    sign = np.empty((DEPTH, MAX_ROOTS), np.int64)
    count = np.empty(DEPTH, np.int64)
    around = np.empty(DEPTH, np.int64)
    grid = np.empty(NODES)
    most = np.empty(DEPTH)
    found = 0
    if not instant(cp, ca, K, h, ta, S[0], C[0]):
        return n, 0
    count[0], around[0] = roots(S[0], K, C[0], vmin, R[0], sign[0], grid)
    most[0] = np.abs(grid).max()
    n = sides(S[0], K, C[0], R[0], sign[0], max(count[0], 0), around[0], -1, tol, FIRST, buf, n)
    if n < 0:
        return FULL, 0
    for i in range(knots):
        top = 1
        t = tb if i == knots - 1 else ta + (tb - ta) * (i + 1) / knots
        while True:
            if not instant(cp, ca, K, h, t, S[top], C[top]):
                return n, found
            count[top], around[top] = roots(S[top], K, C[top], vmin, R[top], sign[top], grid)
            most[top] = np.abs(grid).max()
            while top > 0:
                short = S[top, 21] - S[0, 21] < LEAST or top >= DEPTH - 1
                quiet = (S[top, 21] - S[0, 21]) * max(most[0], most[top]) <= 0.05 * tol or short
                one = (S[0], C[0], R[0], sign[0], count[0], around[0])
                other = (S[top], C[top], R[top], sign[top], count[top], around[top])
                m = link(one, other, K, tol, quiet, buf, n)
                if m == -2:
                    return FULL, 0
                if m == -1 and not short:
                    break
                if m == -1:
                    if found < jumps.shape[0]:
                        jumps[found] = S[0, 21]
                        found += 1
                else:
                    n = m
                S[0], C[0], R[0], sign[0] = S[top], C[top], R[top], sign[top]
                count[0], around[0], most[0] = count[top], around[top], most[top]
                top -= 1
            if top == 0:
                break
            t = 0.5 * (S[0, 21] + S[top, 21])
            top += 1
    n = sides(S[0], K, C[0], R[0], sign[0], max(count[0], 0), around[0], 1, tol, LAST, buf, n)
    return (FULL if n < 0 else n), found


@njit(cache=True, nogil=True)
def _drop_two_roots(R, sign, n, i, R_out, sign_out):
    """All roots but i and the next one."""
    k = 0
    for m in range(n):
        if m != i and m != (i + 1) % n:
            R_out[k] = R[m]
            sign_out[k] = sign[m]
            k += 1


@njit(cache=True, nogil=True)
def link(one, other, K, tol, quiet, buf, n):
    """Join the roots of two instants in cyclic order; new count, -1 where they don't fit, -2 where full.

    A pair that is there at one instant only is joined along the section, where the two points are within tol / 5 or
    ``quiet``: nothing moves by more than that in between. An instant: S, C, rows, signs,
    count, sign where there are none.
    """
    S0, C0, R0, s0, n0, around0 = one
    S1, C1, R1, s1, n1, around1 = other
    if n0 < 0 or n1 < 0 or abs(n0 - n1) > 2:
        return -1
    if n + n0 + n1 + 2 >= buf.shape[0]:
        return -2
    if n0 == 0 and n1 == 0 and around0 != around1:
        if not quiet:
            return -1
        n = ring(S0, K, C0, tol, GRAZING, buf, n)
        return -2 if n < 0 else n
    if n0 == n1:
        total, shift = _match(R0, s0, R1, s1, n0, tol)
        if total == math.inf:
            return -1
        for i in range(n0):
            a, b = R0[i], R1[(i + shift) % n0]
            n = edge(buf, n, a, b, a[4], a[5], b[4], b[5], kind(a, b))
        return n
    S, C, big, sb, nb = (S1, C1, R1, s1, n1) if n1 > n0 else (S0, C0, R0, s0, n0)
    small, ss, around = (R0, s0, around0) if n1 > n0 else (R1, s1, around1)
    if nb == 2 and around == 0:
        if not quiet:
            return -1
        for wanted in (-1, 1):
            n = sides(S, K, C, big, sb, nb, 0, wanted, tol, GRAZING, buf, n)
            if n < 0:
                return -2
        return n
    rest = np.empty((MAX_ROOTS, 7))
    sr = np.empty(MAX_ROOTS, np.int64)
    best, pair, shift = math.inf, -1, 0
    for i in range(nb):
        j = (i + 1) % nb
        d = math.hypot(big[i, 0] - big[j, 0], big[i, 1] - big[j, 1])
        if (d > 0.2 * tol and not quiet) or (nb == 2 and sb[i] == around):
            continue
        _drop_two_roots(big, sb, nb, i, rest, sr)
        total, k = _match(small, ss, rest, sr, nb - 2, tol)
        if d + total < best:
            best, pair, shift = d + total, i, k
    if pair < 0:
        return -1
    _drop_two_roots(big, sb, nb, pair, rest, sr)
    for i in range(nb - 2):
        a, b = small[i], rest[(i + shift) % (nb - 2)]
        n = edge(buf, n, a, b, a[4], a[5], b[4], b[5], kind(a, b))
    b = big[(pair + 1) % nb].copy()
    b[2] = big[pair, 2] + (b[2] - big[pair, 2]) % TAU
    n = arc(S, K, C, big[pair], b, tol, GRAZING, buf, n)
    return -2 if n < 0 else n


@njit(cache=True, nogil=True)
def _match(R0, s0, R1, s1, n, tol):
    """Least sum of distances [mm] of roots in cyclic order, and its shift; inf: an edge would miss by more than tol."""
    best, shift = math.inf, 0
    if n == 0:
        return 0.0, 0
    for k in range(n):
        if s0[0] != s1[k]:
            continue
        total = 0.0
        for i in range(n):
            total += math.hypot(R0[i, 0] - R1[(i + k) % n, 0], R0[i, 1] - R1[(i + k) % n, 1])
        if total < best:
            best, shift = total, k
    for i in range(n):
        if deviation(R0[i], R1[(i + shift) % n]) > tol:
            return math.inf, shift
    return best, shift


@njit(cache=True, nogil=True)
def depth(S, K, x, y, h):
    """Above 0 outside the cutter, below inside; changes by no more than the distance [mm]."""
    X, Y, Z = x - S[0], y - S[1], h - S[2]
    w = X * S[3] + Y * S[4] + Z * S[5]
    rho = math.sqrt(max(X * X + Y * Y + Z * Z - w * w, 0.0))
    u, v = rho - K[0], K[2] - w
    d = w - K[10]
    d = max(d, (rho - K[9]) * K[7] - w * K[6])
    d = max(d, rho * K[3] - w * K[4])
    if u * K[4] > v * K[3] and u * K[16] < v * K[15] and (K[1] > 0.0 or K[13] > 0.0):
        d = max(d, math.hypot(u, v) - K[1])
    if K[13] > 0.0:
        u, v = rho - K[12], K[14] - w
        if u * K[16] >= v * K[15] and u * K[6] < v * K[7]:
            d = max(d, math.hypot(u, v) - K[13])
    return d


@njit(cache=True, nogil=True)
def quickest(cp, ca):
    """Bounds of |p'| and |A'|: the greatest of 65 samples and a tenth."""
    S = np.empty(27)
    p = a = 0.0
    for i in range(65):
        state(cp, ca, i / 64.0, S)
        p = max(p, math.sqrt(S[6] ** 2 + S[7] ** 2 + S[8] ** 2))
        a = max(a, math.sqrt(S[9] ** 2 + S[10] ** 2 + S[11] ** 2))
    return 1.1 * p, 1.1 * a


@njit(cache=True, nogil=True)
def covered_at(cp, ca, K, h, x, y, over, slack):
    """Whether (x, y) on the layer is within ``over`` of the cutter at some t; up to ``slack`` more in doubt (no).

    Branch and bound: the depth changes no faster than the cutter's points near (x, y) move.
    """
    vp, va = quickest(cp, ca)
    S = np.empty(27)
    stack = np.empty((96, 2))
    stack[0] = 0.0, 1.0
    n = 1
    while n > 0:
        n -= 1
        a, b = stack[n, 0], stack[n, 1]
        t = 0.5 * (a + b)
        state(cp, ca, t, S)
        d = depth(S, K, x, y, h)
        if d <= over:
            return True
        half = 0.5 * (b - a)
        far = math.sqrt((x - S[0]) ** 2 + (y - S[1]) ** 2 + (h - S[2]) ** 2) + vp * half
        if d - (vp + far * va) * half > over - slack or half < 1e-13:
            continue
        stack[n] = a, t
        stack[n + 1] = t, b
        n += 2
    return False


@njit(cache=True, nogil=True)
def covered_points(cp, ca, K, h, points, over, slack, out):
    """``covered_at`` of many points (n, 2), ``over`` (n,)."""
    for i in range(points.shape[0]):
        out[i] = covered_at(cp, ca, K, h, points[i, 0], points[i, 1], over[i], slack)
