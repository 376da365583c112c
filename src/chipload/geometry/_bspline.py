"""Compiled: points and derivatives of a B-spline surface.

Notation: as in ``bspline.py``; the basis functions by the recurrence of Cox and de Boor, the last ``derivative`` of its
steps those of a derivative.
"""

from __future__ import annotations

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
