"""Compiled: points and derivatives of a B-spline surface.

Notation: as in ``bspline.py``; the basis functions by the recurrence of Cox and de Boor, the last ``derivative`` of its
steps those of a derivative.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def basis_of(knots: Any, degree: int, x: float, derivative: int, out: Any) -> int:
    """Values (degree + 1,) of the basis functions that are not 0 at x into ``out``, and the first of them."""
    count = len(knots) - degree - 1
    low, high = degree, count
    # the last span that begins at or before x
    while high - low > 1:
        middle = (low + high) // 2
        if knots[middle] <= x:
            low = middle
        else:
            high = middle
    span = low
    out[0] = 1.0
    for d in range(1, degree + 1):
        sloped = d > degree - derivative
        kept = 0.0
        for k in range(d):
            a, b = knots[span + 1 - d + k], knots[span + 1 + k]
            if sloped:
                part = d * out[k] / (b - a)
                out[k] = kept - part
                kept = part
            else:
                part = out[k] / (b - a)
                out[k] = kept + part * (b - x)
                kept = part * (x - a)
        out[d] = kept
    if derivative > degree:
        out[: degree + 1] = 0.0
    return span - degree


@njit(cache=True, nogil=True)
def points_of(
    knots_u: Any, knots_v: Any, control: Any, p: int, q: int, u: Any, v: Any, du: int, dv: int, out: Any
) -> None:
    """Points or derivatives (k, 3) at u (k,), v (k,) into ``out``."""
    N, M = np.empty(p + 1), np.empty(q + 1)
    for k in range(len(u)):
        i = basis_of(knots_u, p, u[k], du, N)
        j = basis_of(knots_v, q, v[k], dv, M)
        x = y = z = 0.0
        for a in range(p + 1):
            rx = ry = rz = 0.0
            for b in range(q + 1):
                rx += M[b] * control[i + a, j + b, 0]
                ry += M[b] * control[i + a, j + b, 1]
                rz += M[b] * control[i + a, j + b, 2]
            x += N[a] * rx
            y += N[a] * ry
            z += N[a] * rz
        out[k, 0], out[k, 1], out[k, 2] = x, y, z


@njit(cache=True, nogil=True)
def facing_of(
    knots_u: Any, knots_v: Any, control: Any, side: int, p: int, q: int, u: Any, v: Any, points: Any, normals: Any
) -> bool:
    """Points and unit normals (k, 3) at u (k,), v (k,); False where there is none.

    Basis functions that the point before has too are not computed again.
    """
    N, dN, M, dM = np.empty(p + 1), np.empty(p + 1), np.empty(q + 1), np.empty(q + 1)
    i = j = 0
    for k in range(len(u)):
        if k == 0 or u[k] != u[k - 1]:
            i = basis_of(knots_u, p, u[k], 0, N)
            basis_of(knots_u, p, u[k], 1, dN)
        if k == 0 or v[k] != v[k - 1]:
            j = basis_of(knots_v, q, v[k], 0, M)
            basis_of(knots_v, q, v[k], 1, dM)
        x = y = z = a0 = a1 = a2 = b0 = b1 = b2 = 0.0
        for a in range(p + 1):
            rx = ry = rz = sx = sy = sz = 0.0
            for b in range(q + 1):
                c0, c1, c2 = control[i + a, j + b, 0], control[i + a, j + b, 1], control[i + a, j + b, 2]
                rx += M[b] * c0
                ry += M[b] * c1
                rz += M[b] * c2
                sx += dM[b] * c0
                sy += dM[b] * c1
                sz += dM[b] * c2
            x += N[a] * rx
            y += N[a] * ry
            z += N[a] * rz
            a0 += dN[a] * rx
            a1 += dN[a] * ry
            a2 += dN[a] * rz
            b0 += N[a] * sx
            b1 += N[a] * sy
            b2 += N[a] * sz
        points[k, 0], points[k, 1], points[k, 2] = x, y, z
        x, y, z = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        length = math.sqrt(x * x + y * y + z * z)
        if length == 0.0:
            return False
        normals[k, 0], normals[k, 1], normals[k, 2] = side * x / length, side * y / length, side * z / length
    return True


@njit(cache=True, nogil=True)
def shape_of(
    knots_u: Any, knots_v: Any, control: Any, side: int, p: int, q: int, u: Any, v: Any, points: Any, normals: Any,
    tangents: Any, bends: Any,
) -> bool:  # fmt: skip
    """Points, unit normals (k, 3), S_u and S_v (2, k, 3), S_uu, S_uv and S_vv (3, k, 3); False where there is no
    normal.
    """
    N, M = np.empty((3, p + 1)), np.empty((3, q + 1))
    # S, S_u, S_v, S_uu, S_uv, S_vv
    s = np.empty((6, 3))
    for k in range(len(u)):
        i = j = 0
        for d in range(3):
            i = basis_of(knots_u, p, u[k], d, N[d])
            j = basis_of(knots_v, q, v[k], d, M[d])
        s[:] = 0.0
        for a in range(p + 1):
            for c in range(3):
                r0 = r1 = r2 = 0.0
                for b in range(q + 1):
                    value = control[i + a, j + b, c]
                    r0 += M[0, b] * value
                    r1 += M[1, b] * value
                    r2 += M[2, b] * value
                s[0, c] += N[0, a] * r0
                s[1, c] += N[1, a] * r0
                s[2, c] += N[0, a] * r1
                s[3, c] += N[2, a] * r0
                s[4, c] += N[1, a] * r1
                s[5, c] += N[0, a] * r2
        a0, a1, a2, b0, b1, b2 = s[1, 0], s[1, 1], s[1, 2], s[2, 0], s[2, 1], s[2, 2]
        x, y, z = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        length = math.sqrt(x * x + y * y + z * z)
        if length == 0.0:
            return False
        normals[k, 0], normals[k, 1], normals[k, 2] = side * x / length, side * y / length, side * z / length
        for c in range(3):
            points[k, c], tangents[0, k, c], tangents[1, k, c] = s[0, c], s[1, c], s[2, c]
            for d in range(3):
                bends[d, k, c] = s[3 + d, c]
    return True
