"""Compiled: the exact arcs of the pallet angle B in which one check point lies inside one cutter.

Notation: a trigonometric polynomial ``f0 + f1 cos B + f2 sin B`` is a row (3,) of its coefficients. y [mm] vector from
the corner's centre S + r N to the check point, yN = y.N, yy = y.y; h height of the check point above the corner's
centre, n = N.T, s^2 = 1 - n^2 = a^2 + b^2 with a, b the parts of T along the tangents; q = y.N - n h; rho, r and
``stages`` of the cutter as in ``_clearance.py``. With t = tan((B - Bm)/2) = tau (2 v - 1) each of them is a
quadratic in v over W = 1 + t^2, and the limit functions below are polynomials of degree at most 16 in v in 0..1. In the
Bernstein basis the sign changes of the coefficients bound the number of roots, so that none is missed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

_BINOMIAL = np.zeros((17, 17))
for _i in range(17):
    for _j in range(_i + 1):
        _BINOMIAL[_i, _j] = math.comb(_i, _j)


@njit(cache=True, nogil=True)
def trig_value(f: Any, c: float, s: float) -> Any:
    """``f0 + f1 cos B + f2 sin B``."""
    return f[0] + f[1] * c + f[2] * s


@njit(cache=True, nogil=True)
def radius_at(h: float, rho: float, r: float, stages: Any) -> float:
    """Radius [mm] of the cutter at the height h >= 0 above the corner's centre; 0: the cutter has ended."""
    j = 0
    while j + 1 < len(stages) and h >= stages[j + 1, 0]:
        j += 1
    return rho + r if j == 0 else stages[j, 1]


@njit(cache=True, nogil=True)
def limit_function(
    corner: bool, h: float, n: float, s2: float, yN: float, yy: float, rho: float, r: float, P: float
) -> float:
    """Above 0 [mm^2] where the check point is clear of the corner, or of the cylinder of radius P; below 0 inside."""
    offset = 0.0
    if rho > 0.0:
        if s2 <= 0.0:
            return -1.0
        offset = 2.0 * rho * (yN - n * h) / math.sqrt(s2)
    if corner:
        return yy - r * r - offset - 2.0 * rho * math.sqrt(max(r * r - h * h, 0.0))
    return yy - h * h - offset + rho * rho - P * P


@njit(cache=True, nogil=True)
def _quadratic(f: Any, cm: float, sm: float, tau: float, out: Any) -> None:
    """Scaled Bernstein coefficients (3,) of W f over a piece of B, of the half width 2 atan(tau) about Bm.

    ``cm``, ``sm`` cosine and sine of Bm. A scaled coefficient is the Bernstein coefficient times its binomial.
    """
    f1, f2 = f[1] * cm + f[2] * sm, f[2] * cm - f[1] * sm
    c0, c1, c2 = f[0] + f1, 2.0 * f2 * tau, (f[0] - f1) * tau * tau
    out[0], out[1], out[2] = c0 - c1 + c2, 2.0 * (c0 - c2), c0 + c1 + c2


@njit(cache=True, nogil=True)
def _product(a: Any, m: int, b: Any, n: int, out: Any) -> None:
    """Product of two polynomials of degrees m and n, in scaled coefficients."""
    for i in range(m + n + 1):
        out[i] = 0.0
    for i in range(m + 1):
        for j in range(n + 1):
            out[i + j] += a[i] * b[j]


@njit(cache=True, nogil=True)
def _squares(trig: Any, cm: float, sm: float, tau: float, k: Any) -> None:
    """W^2, s^2, h^2 and n h, of degree 4, as rows of ``k`` (5, 17), from ``trig`` (4, 3) = h, n, a, b.

    Row 4 is workspace.
    """
    f = np.empty((5, 3))
    _quadratic(np.array([1.0, 0.0, 0.0]), cm, sm, tau, f[4])
    for i in range(4):
        _quadratic(trig[i], cm, sm, tau, f[i])
    _product(f[4], 2, f[4], 2, k[0])
    _product(f[2], 2, f[2], 2, k[1])
    _product(f[3], 2, f[3], 2, k[4])
    for i in range(5):
        k[1, i] += k[4, i]
    _product(f[0], 2, f[0], 2, k[2])
    _product(f[0], 2, f[1], 2, k[3])


@njit(cache=True, nogil=True)
def _cylinder_polynomial(
    trig: Any, yN: float, yy: float, rho: float, P: float, cm: float, sm: float, tau: float, G: Any
) -> int:
    """Limit of a cylinder of radius P: (|y|^2 - h^2 + rho^2 - P^2)^2 s^2 - 4 rho^2 q^2; its degree."""
    k = np.empty((5, 17))
    _squares(trig, cm, sm, tau, k)
    A, q, u = np.empty(17), np.empty(17), np.empty(17)
    for i in range(5):
        A[i] = (yy + rho * rho - P * P) * k[0, i] - k[2, i]
        q[i] = yN * k[0, i] - k[3, i]
    if rho == 0.0:
        G[:5] = A[:5]
        return 4
    _product(A, 4, A, 4, u)
    _product(u, 8, k[1], 4, G)
    _product(q, 4, q, 4, u)
    _product(u, 8, k[0], 4, A)
    for i in range(13):
        G[i] -= 4.0 * rho * rho * A[i]
    return 12


@njit(cache=True, nogil=True)
def _corner_polynomial(
    trig: Any, yN: float, yy: float, rho: float, r: float, cm: float, sm: float, tau: float, G: Any
) -> int:
    """Limit of the corner: ((k^2 + 4 rho^2 w^2) s^2 - 4 rho^2 q^2)^2 - 16 rho^2 k^2 w^2 s^4; its degree.

    w^2 = r^2 - h^2, k = |y|^2 - r^2.
    """
    if rho == 0.0:
        G[0] = yy - r * r
        return 0
    k = np.empty((5, 17))
    _squares(trig, cm, sm, tau, k)
    d = yy - r * r
    four = 4.0 * rho * rho
    w2, x, u, v = np.empty(17), np.empty(17), np.empty(17), np.empty(17)
    for i in range(5):
        w2[i] = r * r * k[0, i] - k[2, i]
        u[i] = yN * k[0, i] - k[3, i]
    _product(u, 4, u, 4, v)
    for i in range(5):
        u[i] = d * d * k[0, i] + four * w2[i]
    _product(u, 4, k[1], 4, x)
    for i in range(9):
        x[i] -= four * v[i]
    if d == 0.0:
        G[:9] = x[:9]
        return 8
    _product(x, 8, x, 8, G)
    _product(k[1], 4, k[1], 4, u)
    _product(u, 8, w2, 4, v)
    _product(v, 12, k[0], 4, u)
    for i in range(17):
        G[i] -= 4.0 * four * d * d * u[i]
    return 16


@njit(cache=True, nogil=True)
def curvature_limit(a: float, b: float, s2: float, rho: float, r: float, K: Any) -> Any:
    """Positive where the curvature at the contact admits rho: ``s^3 det(I - r K) - rho (Q - r s^2 det K)``."""
    det = K[0] * K[2] - K[1] * K[1]
    free = 1.0 - r * (K[0] + K[2]) + r * r * det
    Q = K[0] * b * b - 2.0 * K[1] * a * b + K[2] * a * a
    return s2 * math.sqrt(s2) * free - rho * (Q - r * s2 * det)


@njit(cache=True, nogil=True)
def _curvature_polynomial(trig: Any, K: Any, rho: float, r: float, cm: float, sm: float, tau: float, G: Any) -> int:
    """The limit of :func:`curvature_limit` squared: s^6 det^2 - rho^2 (Q - r s^2 det K)^2; its degree."""
    f = np.empty((3, 3))
    _quadratic(np.array([1.0, 0.0, 0.0]), cm, sm, tau, f[2])
    _quadratic(trig[2], cm, sm, tau, f[0])
    _quadratic(trig[3], cm, sm, tau, f[1])
    W2, aa, ab, bb = np.empty(17), np.empty(17), np.empty(17), np.empty(17)
    _product(f[2], 2, f[2], 2, W2)
    _product(f[0], 2, f[0], 2, aa)
    _product(f[0], 2, f[1], 2, ab)
    _product(f[1], 2, f[1], 2, bb)
    det = K[0] * K[2] - K[1] * K[1]
    free = 1.0 - r * (K[0] + K[2]) + r * r * det
    s2, Q, u = np.empty(17), np.empty(17), np.empty(17)
    for i in range(5):
        s2[i] = aa[i] + bb[i]
        Q[i] = K[0] * bb[i] - 2.0 * K[1] * ab[i] + K[2] * aa[i] - r * det * s2[i]
    _product(s2, 4, s2, 4, u)
    _product(u, 8, s2, 4, G)
    _product(Q, 4, Q, 4, u)
    _product(u, 8, W2, 4, aa)
    for i in range(13):
        G[i] = G[i] * free * free - rho * rho * aa[i]
    return 12


@njit(cache=True, nogil=True)
def _sign_changes(c: Any, m: int) -> int:
    """Number of sign changes of the coefficients of a polynomial of degree m."""
    count, last = 0, 0.0
    for i in range(m + 1):
        if c[i] != 0.0:
            if last * c[i] < 0.0:
                count += 1
            last = 1.0 if c[i] > 0.0 else -1.0
    return count


@njit(cache=True, nogil=True)
def _limit_value(B: float, kind: int, trig: Any, yN: float, yy: float, rho: float, r: float, P: float, K: Any) -> Any:
    """Limit function at B, not squared; ``kind`` 0: corner, 1: cylinder, 2: curvature at the contact."""
    c, s = math.cos(B), math.sin(B)
    a, b = trig_value(trig[2], c, s), trig_value(trig[3], c, s)
    if kind == 2:
        return curvature_limit(a, b, a * a + b * b, rho, r, K)
    return limit_function(
        kind == 0, trig_value(trig[0], c, s), trig_value(trig[1], c, s), a * a + b * b, yN, yy, rho, r, P
    )


@njit(cache=True, nogil=True)
def _roots(
    G: Any, m: int, Bm: float, tau: float, least: float, kind: int, trig: Any, yN: float, yy: float, rho: float,
    r: float, P: float, K: Any, out: Any,
) -> int:  # fmt: skip
    """Write the roots [rad] of the limit function inside one piece to ``out``, ascending; their number."""
    found = 0
    stack = np.empty((64, 19))
    for i in range(m + 1):
        stack[0, i] = G[i] / _BINOMIAL[m, i]
    stack[0, 17], stack[0, 18] = 0.0, 1.0
    top = 1
    work = np.empty(17)
    while top > 0:
        top -= 1
        v0, v1 = stack[top, 17], stack[top, 18]
        count = _sign_changes(stack[top], m)
        if count == 0:
            continue
        B0 = Bm + 2.0 * math.atan(tau * (2.0 * v0 - 1.0))
        B1 = Bm + 2.0 * math.atan(tau * (2.0 * v1 - 1.0))
        if count == 1:
            f0 = _limit_value(B0, kind, trig, yN, yy, rho, r, P, K)
            f1 = _limit_value(B1, kind, trig, yN, yy, rho, r, P, K)
            if f0 * f1 < 0.0:
                while least < B1 - B0:
                    mid = 0.5 * (B0 + B1)
                    f = _limit_value(mid, kind, trig, yN, yy, rho, r, P, K)
                    if (f < 0.0) == (f0 < 0.0):
                        B0 = mid
                    else:
                        B1 = mid
                if found < len(out):
                    out[found] = 0.5 * (B0 + B1)
                    found += 1
            # else it is a root of the squared function only
            continue
        if least > B1 - B0 or top > 61:
            if found + 1 < len(out):
                out[found], out[found + 1] = B0, B1
                found += 2
            continue
        for i in range(m + 1):
            work[i] = stack[top, i]
        vm = 0.5 * (v0 + v1)
        # de Casteljau: the right half replaces the piece, the left half is pushed above it
        stack[top + 1, 0], stack[top, m] = work[0], work[m]
        for j in range(1, m + 1):
            for i in range(m - j + 1):
                work[i] = 0.5 * (work[i] + work[i + 1])
            stack[top + 1, j], stack[top, m - j] = work[0], work[m - j]
        stack[top, 17], stack[top, 18] = vm, v1
        stack[top + 1, 17], stack[top + 1, 18] = v0, vm
        top += 2
    return found


@njit(cache=True, nogil=True)
def level_crossings(f: Any, level: float, lo: float, hi: float, out: Any, found: int) -> int:
    """Append the B in lo..hi at which ``f`` has the value ``level`` to ``out``; the new number ``found``."""
    amplitude = math.hypot(f[1], f[2])
    if amplitude == 0.0 or abs(level - f[0]) > amplitude:
        return found
    phi, w = math.atan2(f[2], f[1]), math.acos((level - f[0]) / amplitude)
    for k in range(2):
        B = phi + w if k == 0 else phi - w
        B += 2.0 * math.pi * math.ceil((lo - B) / (2.0 * math.pi))
        while hi > B:
            if lo < B:
                out[found] = B
                found += 1
            B += 2.0 * math.pi
    return found


@njit(cache=True, nogil=True)
def forbidden_arcs(
    contact: bool, trig: Any, yN: float, yy: float, rho: float, r: float, stages: Any, K: Any, lo: float, hi: float,
    least: float, out: Any, count: int,
) -> int:  # fmt: skip
    """Append the arcs of lo..hi that one check point forbids to ``out``, from row ``count`` on; the new count.

    ``contact``: the arcs are those of the curvature ``K`` of the surface at the contact instead. Roots are found to
    ``least`` [rad].
    """
    cuts = np.empty(12 + 4 * len(stages))
    m = 0
    if not contact:
        m = level_crossings(trig[0], -r, lo, hi, cuts, 0)
        for j in range(len(stages)):
            m = level_crossings(trig[0], stages[j, 0], lo, hi, cuts, m)
    cuts[:m] = np.sort(cuts[:m])
    cuts[m] = hi
    G, roots = np.empty(17), np.empty(36)
    begin, first = lo, count
    for k in range(m + 1):
        end = cuts[k]
        mid = 0.5 * (begin + end)
        h = trig_value(trig[0], math.cos(mid), math.sin(mid))
        kind = 2 if contact else (0 if h < 0.0 else 1)
        P = radius_at(h, rho, r, stages) if kind == 1 else 0.0
        pieces = math.ceil((end - begin) / 1.3)
        if (kind < 2 and h < -r) or (kind == 1 and P <= 0.0):
            pieces = 0
        for piece in range(pieces):
            b0 = begin + (end - begin) * piece / pieces
            b1 = end if piece + 1 == pieces else begin + (end - begin) * (piece + 1) / pieces
            Bm, tau = 0.5 * (b0 + b1), math.tan(0.25 * (b1 - b0))
            cm, sm = math.cos(Bm), math.sin(Bm)
            if kind == 2:
                d = _curvature_polynomial(trig, K, rho, r, cm, sm, tau, G)
            elif kind == 0:
                d = _corner_polynomial(trig, yN, yy, rho, r, cm, sm, tau, G)
            else:
                d = _cylinder_polynomial(trig, yN, yy, rho, P, cm, sm, tau, G)
            number = _roots(G, d, Bm, tau, least, kind, trig, yN, yy, rho, r, P, K, roots)
            left_end = b0
            for i in range(number + 1):
                right_end = b1 if i == number else roots[i]
                if right_end <= left_end:
                    continue
                if _limit_value(0.5 * (left_end + right_end), kind, trig, yN, yy, rho, r, P, K) < 0.0:
                    if count > first and out[count - 1, 1] == left_end:
                        out[count - 1, 1] = right_end
                    elif count < len(out):
                        out[count, 0], out[count, 1] = left_end, right_end
                        count += 1
                left_end = right_end
        begin = end
    return count
