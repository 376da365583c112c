"""Compiled test on which side of a line a point lies, exact for all inputs.

Reference: [Shewchuk1997] (error bound of the rounded determinant; expansions where it does not decide).
"""

from __future__ import annotations

import numpy as np
from numba import njit

#: (3 + 16 eps) eps: a determinant above this share of its parts has the right sign
BOUND = 3.3306690738754716e-16
#: splits a float into two halves
SPLIT = 134217729.0


@njit("float64(float64, float64, float64)", cache=True, nogil=True)
def product_error(a, b, x):
    """Error of the rounded product x: a b - x, exact."""
    c = SPLIT * a
    ah = c - (c - a)
    al = a - ah
    c = SPLIT * b
    bh = c - (c - b)
    bl = b - bh
    return al * bl - (((x - ah * bh) - al * bh) - ah * bl)


@njit("float64(float64, float64, float64, float64, float64, float64)", cache=True, nogil=True)
def orient_exact(ax, ay, bx, by, cx, cy):
    """Value of :func:`orient` with the sign of the exact one."""
    terms = np.empty(12)
    factors = ((ax, by), (-ax, cy), (-cx, by), (-ay, bx), (ay, cx), (cy, bx))
    for k in range(6):
        a, b = factors[k]
        x = a * b
        terms[2 * k], terms[2 * k + 1] = x, product_error(a, b, x)
    # an expansion: components that do not overlap, the greatest last
    out = np.zeros(13)
    count = 0
    for k in range(12):
        q = terms[k]
        kept = 0
        for i in range(count):
            e = out[i]
            total = q + e
            part = total - q
            error = (q - (total - part)) + (e - part)
            q = total
            if error != 0.0:
                out[kept] = error
                kept += 1
        out[kept] = q
        count = kept + 1
    total = 0.0
    for i in range(count):
        total += out[i]
    return total


@njit("float64(float64, float64, float64, float64, float64, float64)", cache=True, nogil=True)
def orient(ax, ay, bx, by, cx, cy):
    """Twice the area of the triangle A, B, C: above 0 where C is left of A to B, 0 only where they are in line."""
    left = (ax - cx) * (by - cy)
    right = (ay - cy) * (bx - cx)
    det = left - right
    if abs(det) > BOUND * (abs(left) + abs(right)):
        return det
    if left == 0.0 and right == 0.0 and (ax == cx or by == cy) and (ay == cy or bx == cx):
        return 0.0
    return orient_exact(ax, ay, bx, by, cx, cy)
