"""Compiled: moments of polygons in the cells of a plane grid. Oracle: clipped polygons, in tests/structure/cells."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def _cell(planes, x):
    """Number of the cell between ``planes`` (n + 1,), ascending, that contains x."""
    low, high = 0, len(planes) - 2
    while low < high:
        middle = (low + high + 1) // 2
        if planes[middle] <= x:
            low = middle
        else:
            high = middle - 1
    return low


@njit(cache=True, nogil=True)
def _strip(left, right, low, high, i, s, xs, ys, at, weight, out):
    """Add the moments of the area below a piece of an edge, within the column i of cells, with the sign s."""
    ny, n = out.shape[1], out.shape[2]
    width = xs[i + 1] - xs[i]
    a, va = left, low
    # the cell into which the piece continues from (a, va)
    j = _cell(ys, va)
    if high < va and va == ys[j] and j > 0:
        j -= 1
    while True:
        b, vb, following = right, high, j
        if high > ys[j + 1] and j < ny - 1:
            following, vb = j + 1, ys[j + 1]
        elif high < ys[j] and j > 0:
            following, vb = j - 1, ys[j]
        if following != j:
            b = min(max(left + (right - left) * (vb - low) / (high - low), a), right)
        half, height = (b - a) / width, ys[j + 1] - ys[j]
        for g in range(len(at)):
            t = 0.5 * (1.0 + at[g])
            xi = 2.0 * (a + (b - a) * t - xs[i]) / width - 1.0
            eta = 2.0 * (va + (vb - va) * t - ys[j]) / height - 1.0
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
        if following == j or b >= right:
            break
        a, va, j = b, vb, following


@njit(cache=True, nogil=True)
def ring_moments(points, start, sign, xs, ys, at, weight, out):
    """Add the moments of rings; see :func:`chipload.structure.cells.moments.section_moments`.

    Parameters
    ----------
    points : (m, 2) float, within the planes
    start : (r + 1,) int, ring r has the points start[r] .. start[r + 1] - 1, the first and the last are equal
    sign : (r,) float, by which each ring counts
    xs, ys : (nx + 1,), (ny + 1,) float, planes of the cells
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
            i = _cell(xs, u0)
            left = u0
            while left < u1:
                right = min(u1, xs[i + 1]) if i < nx - 1 else u1
                if right > left:
                    low, high = v0 + slope * (left - u0), v0 + slope * (right - u0)
                    _strip(left, right, low, high, i, s, xs, ys, at, weight, out)
                left = right
                i += 1
                if i >= nx:
                    break
