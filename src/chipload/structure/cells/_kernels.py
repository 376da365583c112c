"""Moments of polygons in the cells of a plane grid, compiled; the tests hold them against clipped polygons."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True)
def _strip(left, right, low, high, i, s, at, weight, out):
    """A piece of an edge within one column of cells: what lies below it."""
    ny, n = out.shape[1], out.shape[2]
    a, va = left, low
    up = high > low
    while True:
        # the cell in which the piece goes on from (a, va)
        j = math.floor(va)
        if not up and va == j and high < va:
            j -= 1
        j = min(max(j, 0), ny - 1)
        b, vb = right, high
        if high > low and high > j + 1 and j < ny - 1:
            vb = float(j + 1)
            b = left + (right - left) * (vb - low) / (high - low)
        elif high < low and high < j and j > 0:
            vb = float(j)
            b = left + (right - left) * (vb - low) / (high - low)
        b = min(max(b, a), right)
        half = b - a
        for g in range(len(at)):
            t = 0.5 * (1.0 + at[g])
            xi = 2.0 * (a + (b - a) * t - i) - 1.0
            eta = 2.0 * (va + (vb - va) * t - j) - 1.0
            w = s * weight[g] * half
            p0, p1 = 1.0, xi
            for k in range(n):
                # integrals of P_l from -1 to eta: (P_(l+1) - P_(l-1)) / (2 l + 1)
                q0, q1 = 1.0, eta
                out[i, j, k, 0] += w * p0 * (eta + 1.0)
                for m in range(1, n):
                    q2 = ((2.0 * m + 1.0) * eta * q1 - m * q0) / (m + 1.0)
                    out[i, j, k, m] += w * p0 * (q2 - q0) / (2.0 * m + 1.0)
                    q0, q1 = q1, q2
                for below in range(j):
                    out[i, below, k, 0] += 2.0 * w * p0
                p2 = ((2.0 * k + 3.0) * xi * p1 - (k + 1.0) * p0) / (k + 2.0)
                p0, p1 = p1, p2
        if vb == high or b >= right:
            break
        a, va = b, vb


@njit(cache=True, nogil=True)
def ring_moments(points, start, sign, at, weight, out):
    """Add the moments of rings; see :func:`chipload.structure.cells.moments.section_moments`.

    Parameters
    ----------
    points : (m, 2) float, in cells: cell (i, j) spans i..i + 1, j..j + 1
    start : (r + 1,) int, ring r has the points start[r] .. start[r + 1] - 1, the first and the last are equal
    sign : (r,) float, by which each ring counts
    at, weight : (g,) float, Gauss points and weights on -1..1
    out : (nx, ny, n, n) float, to which is added
    """
    nx = out.shape[0]
    for r in range(len(sign)):
        for e in range(start[r], start[r + 1] - 1):
            u0, v0 = points[e, 0], points[e, 1]
            u1, v1 = points[e + 1, 0], points[e + 1, 1]
            if u1 == u0:
                continue
            s = -sign[r]
            if u1 < u0:
                u0, u1, v0, v1, s = u1, u0, v1, v0, -s
            slope = (v1 - v0) / (u1 - u0)
            i = min(max(math.floor(u0), 0), nx - 1)
            left = u0
            while left < u1:
                right = min(u1, float(i + 1)) if i < nx - 1 else u1
                if right > left:
                    _strip(left, right, v0 + slope * (left - u0), v0 + slope * (right - u0), i, s, at, weight, out)
                left = right
                i += 1
                if i >= nx:
                    break
