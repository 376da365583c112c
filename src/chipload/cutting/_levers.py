"""Compiled loop of loads times levers over a revolution, for a linear law; arrays and scalars only.

Notation as in :mod:`chipload.cutting._revolution`: at a rotation the edge of an engagement range lies at the
immersions theta - last .. theta - first, of which p .. q cut. A lever is a polynomial of the third degree in the
height above the tip. Where all of an engagement range's edge cuts, its points of Gauss lie at the same lag at every
rotation: as there, its load is a sum of cosine and sine of the rotation and of twice it, the factors of which are
added where that begins and taken away where it ends.
Oracles: :func:`chipload.cutting._strength.in_sections_over_turn` and
:func:`chipload.simulation._form_error.loads_of_teeth`, which integrate engagement range by engagement range and
rotation by rotation.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.cutting._revolution import STRAIGHT, TAU, weights
from chipload.cutting._strength import NODES, PIECE, WEIGHTS, points_of

_F2 = types.float64[:, ::1]
_F3 = types.float64[:, :, ::1]
_RI = types.Array(types.int64, 1, "C", readonly=True)
_RF = tuple(types.Array(types.float64, n, "C", readonly=True) for n in range(1, 4))


@njit(cache=True, nogil=True)
def lever(poly, z):
    """Value of a polynomial of the third degree."""
    return poly[0] + z * (poly[1] + z * (poly[2] + z * poly[3]))


@njit(cache=True, nogil=True)
def whole(v, lag, w, u, rho, share):
    """Add a point of the edge to the factors ``v`` of the rotations at which all of its edge cuts: ``u`` its levers,
    ``share`` of the edge [mm].

    With x, y the cosine and sine of the rotation and X, Y those of twice it the axial force is -(v0 + v1 x + v2 y) and
    the torque v3 + v4 x + v5 y. A lateral load has six factors: along T -(k0 + k2 x + k3 y + k4 X + k5 Y), along n
    k1 + k2 y - k3 x + k4 Y - k5 X. From v6 on are those of the moment of the axial force, along n and against T, from
    v12 on those of each lever.
    """
    c = math.cos(lag)
    s = math.sin(lag)
    c2 = c * c - s * s
    s2 = 2.0 * c * s
    v[0] += share * w[6]
    v[1] += share * (w[8] * c - w[7] * s)
    v[2] += share * (w[7] * c + w[8] * s)
    k = share * rho
    v[3] += k * w[0]
    v[4] += k * (w[2] * c - w[1] * s)
    v[5] += k * (w[1] * c + w[2] * s)
    a = 0.5 * w[7]
    b = 0.5 * w[8]
    v[6] += k * b
    v[7] += k * a
    v[8] += k * w[6] * c
    v[9] += k * w[6] * s
    v[10] += k * (b * c2 - a * s2)
    v[11] += k * (a * c2 + b * s2)
    a = 0.5 * (w[1] + w[5])
    b = 0.5 * (w[2] - w[4])
    k0 = 0.5 * (w[2] + w[4])
    k1 = 0.5 * (w[1] - w[5])
    k2 = w[0] * c - w[3] * s
    k3 = w[0] * s + w[3] * c
    k4 = b * c2 - a * s2
    k5 = a * c2 + b * s2
    for f in range(len(u)):
        k = share * u[f]
        j = 12 + 6 * f
        v[j] += k * k0
        v[j + 1] += k * k1
        v[j + 2] += k * k2
        v[j + 3] += k * k3
        v[j + 4] += k * k4
        v[j + 5] += k * k5


@njit(cache=True, nogil=True)
def add_between(sums, m0, m1, v, c, s):
    """Add the factors ``v`` to ``sums[m0]``, where they begin, and take them from ``sums[m1]``, where they end; the
    rotations are counted from one whose cosine and sine are ``c`` and ``s``. The last column counts what cuts.
    """
    c2 = c * c - s * s
    s2 = 2.0 * c * s
    last = len(v)
    for m, sign in ((m0, 1.0), (m1, -1.0)):
        for j in (0, 3):
            sums[m, j] += sign * v[j]
            sums[m, j + 1] += sign * (v[j + 1] * c + v[j + 2] * s)
            sums[m, j + 2] += sign * (v[j + 2] * c - v[j + 1] * s)
        for j in range(6, last, 6):
            sums[m, j] += sign * v[j]
            sums[m, j + 1] += sign * v[j + 1]
            sums[m, j + 2] += sign * (v[j + 2] * c + v[j + 3] * s)
            sums[m, j + 3] += sign * (v[j + 3] * c - v[j + 2] * s)
            sums[m, j + 4] += sign * (v[j + 4] * c2 + v[j + 5] * s2)
            sums[m, j + 5] += sign * (v[j + 5] * c2 - v[j + 4] * s2)
        sums[m, last] += sign


@njit(cache=True, nogil=True)
def sum_whole_edges(sums, table, v, acc):
    """Add the edges that cut whole at each rotation to ``acc`` (4 + 2 f, m); ``table`` (2, .) of cosines and sines."""
    last = len(v)
    v[:] = 0.0
    n = 0.0
    for m in range(acc.shape[1]):
        if sums[m, last] == 0.0 and n == 0.0:
            continue
        n += sums[m, last]
        if n == 0.0:
            # nothing is left but rounding
            v[:] = 0.0
            continue
        for j in range(last):
            v[j] += sums[m, j]
        x = table[0, m]
        y = table[1, m]
        xx = x * x - y * y
        yy = 2.0 * x * y
        acc[0, m] -= v[0] + v[1] * x + v[2] * y
        acc[1, m] += v[3] + v[4] * x + v[5] * y
        acc[2, m] -= v[7] + v[8] * y - v[9] * x + v[10] * yy - v[11] * xx
        acc[3, m] -= v[6] + v[8] * x + v[9] * y + v[10] * xx + v[11] * yy
        for j in range(12, last, 6):
            f = j // 3
            acc[f, m] -= v[j] + v[j + 2] * x + v[j + 3] * y + v[j + 4] * xx + v[j + 5] * yy
            acc[f + 1, m] += v[j + 1] + v[j + 2] * y - v[j + 3] * x + v[j + 4] * yy - v[j + 5] * xx


@njit(cache=True, nogil=True)
def part(acc, m, theta, s1, s2, base, rate, s0, z0, sine, rho, w, polys, u):
    """Add the edge s1 .. s2 to ``acc`` for one rotation."""
    pieces = max(math.ceil(rate * (s2 - s1) / PIECE), 1)
    h = (s2 - s1) / pieces
    points = points_of(rate * h)
    for i in range(pieces):
        for g in range(points):
            s = s1 + h * (i + 0.5 + 0.5 * NODES[points, g])
            share = 0.5 * h * WEIGHTS[points, g]
            phi = theta - base - rate * s
            S = math.sin(phi)
            C = math.cos(phi)
            t = share * (w[0] + w[1] * S + w[2] * C)
            r = share * (w[3] + w[4] * S + w[5] * C)
            a = -share * (w[6] + w[7] * S + w[8] * C)
            along = -(t * C + r * S)
            across = t * S - r * C
            acc[0, m] += a
            acc[1, m] += rho * t
            acc[2, m] += rho * a * S
            acc[3, m] += rho * a * C
            z = z0 + sine * (s - s0)
            for f in range(len(u)):
                v = lever(polys[f], z)
                acc[4 + 2 * f, m] += v * along
                acc[5 + 2 * f, m] += v * across


@njit(
    types.void(_RI, _RF[1], _RI, _RI, _RF[1], _RF[1], types.int64, types.int64, types.boolean, _RF[0], _RF[1], _F3),
    cache=True,
    nogil=True,
)
def over_turn(start, rows, tooth, piece, slices, table, teeth, count, alike, c, polys, out):
    """Loads of each entry over a period of ``count`` rotations, the pitch where all teeth are ``alike``.

    ``out`` (n, 4 + 2 f, count): axial force, torque, moment of the axial force along T and n by its distance from the
    axis, and for each of f levers the lateral load along T and n; ``polys`` (f, 4), at least two.
    """
    w = np.empty(9)
    u = np.empty(len(polys))
    v = np.empty(12 + 6 * len(polys))
    sums = np.empty((count + 1, len(v) + 1))
    parts = teeth if alike else 1
    step = TAU / parts / count
    for i in range(len(start) - 1):
        acc = out[i]
        acc[:] = 0.0
        sums[:] = 0.0
        for r in range(start[i], start[i + 1]):
            k = piece[r]
            p = rows[r, 0]
            q = rows[r, 1]
            rate = slices[k, 6]
            sine = slices[k, 3]
            rho = slices[k, 1]
            s0 = slices[k, 0]
            z0 = slices[k, 2]
            weights(rows[r, 4], rows[r, 5], rows[r, 6], sine, slices[k, 4], c, w)
            sa = rows[r, 2]
            size = rows[r, 3] - sa
            one = tooth[r] >= 0
            for j in range(1 if one or alike else teeth):
                base = slices[k, 5] - rate * s0 + TAU * (tooth[r] if one else j) / teeth
                first = base + rate * sa
                last = first + rate * size
                straight = last - first < STRAIGHT
                if straight:
                    first = 0.5 * (first + last)
                    last = first
                m0 = math.ceil((p + first) / step)
                m1 = math.ceil((q + last) / step)
                # rotations at which all of the edge cuts
                a0 = m0 if straight else max(math.ceil((p + last) / step), m0)
                a1 = m1 if straight else min(math.ceil((q + first) / step), m1)
                if a0 >= a1:
                    a0 = m1
                    a1 = m1
                for m in range(m0, m1):
                    if a0 <= m < a1:
                        continue
                    theta = step * m
                    s1 = sa
                    s2 = sa + size
                    if rate > 0.0:
                        s1 = max(s1, (theta - base - q) / rate)
                        s2 = min(s2, (theta - base - p) / rate)
                    if s2 > s1:
                        part(acc, m % count, theta, s1, s2, base, rate, s0, z0, sine, rho, w, polys, u)
                if a0 == a1:
                    continue
                pieces = max(math.ceil((last - first) / PIECE), 1)
                h = size / pieces
                points = points_of(rate * h)
                v[:] = 0.0
                for b in range(pieces):
                    for g in range(points):
                        s = sa + h * (b + 0.5 + 0.5 * NODES[points, g])
                        z = z0 + sine * (s - s0)
                        for f in range(len(u)):
                            u[f] = lever(polys[f], z)
                        lag = first if straight else base + rate * s
                        whole(v, lag, w, u, rho, 0.5 * h * WEIGHTS[points, g])
                at = a0
                while at < a1:
                    turn = at // count
                    to = min(a1, (turn + 1) * count)
                    k = (turn % parts) * count
                    add_between(sums, at - turn * count, to - turn * count, v, table[0, k], table[1, k])
                    at = to
        sum_whole_edges(sums, table, v, acc)
