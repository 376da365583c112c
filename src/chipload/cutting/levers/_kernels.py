"""Compiled loop of loads times levers over a revolution, for a linear law; arrays and scalars only.

Notation as in :mod:`chipload.cutting.revolution._kernels`: at a rotation the edge of a bite lies at the immersions
theta - last .. theta - first, of which p .. q cut. A lever is a polynomial of the third degree in the height above the
tip. Where all of a bite's edge cuts, its points of Gauss lie at the same lag at every rotation, and their sine and
cosine come from those of the rotations, which are one table.
Oracles: :func:`chipload.cutting._strength.in_sections_over_turn` and
:func:`chipload.simulation.bending._kernels.bent_many`, which integrate bite by bite and rotation by rotation.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.cutting._strength import NODES, PIECE, WEIGHTS, points_of
from chipload.cutting.revolution._kernels import STRAIGHT, TAU, weights

_F2 = types.float64[:, ::1]
_F3 = types.float64[:, :, ::1]
_RI = types.Array(types.int64, 1, "C", readonly=True)
_RF = tuple(types.Array(types.float64, n, "C", readonly=True) for n in range(1, 4))


@njit(cache=True, nogil=True)
def lever(poly, z):
    """Value of a polynomial of the third degree."""
    return poly[0] + z * (poly[1] + z * (poly[2] + z * poly[3]))


@njit(cache=True, nogil=True)
def whole(acc, m0, m1, at, table, lag, w, u, rho, share):
    """Add a point of the edge to ``acc`` for the rotations ``m0`` to ``m1``, which are the entries ``at`` on of the
    table: ``u`` its levers, ``share`` of the edge [mm].
    """
    cl = math.cos(lag)
    sl = math.sin(lag)
    at_, bt, ct, ar, br, cr = w[0] * share, w[1] * share, w[2] * share, w[3] * share, w[4] * share, w[5] * share
    a0, a1, a2 = w[6] * share, w[7] * share, w[8] * share
    levers = len(u)
    u0 = u[0]
    u1 = u[1]
    for m in range(m0, m1):
        x = table[0, at + m]
        y = table[1, at + m]
        C = x * cl + y * sl
        S = y * cl - x * sl
        t = at_ + bt * S + ct * C
        r = ar + br * S + cr * C
        a = -(a0 + a1 * S + a2 * C)
        along = -(t * C + r * S)
        across = t * S - r * C
        acc[0, m] += a
        acc[1, m] += rho * t
        acc[2, m] += rho * a * S
        acc[3, m] += rho * a * C
        acc[4, m] += u0 * along
        acc[5, m] += u0 * across
        acc[6, m] += u1 * along
        acc[7, m] += u1 * across
        for f in range(2, levers):
            acc[4 + 2 * f, m] += u[f] * along
            acc[5 + 2 * f, m] += u[f] * across


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
    parts = teeth if alike else 1
    step = TAU / parts / count
    for i in range(len(start) - 1):
        acc = out[i]
        acc[:] = 0.0
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
                for b in range(pieces):
                    for g in range(points):
                        s = sa + h * (b + 0.5 + 0.5 * NODES[points, g])
                        z = z0 + sine * (s - s0)
                        for f in range(len(u)):
                            u[f] = lever(polys[f], z)
                        lag = first if straight else base + rate * s
                        at = a0
                        while at < a1:
                            turn = at // count
                            to = min(a1, (turn + 1) * count)
                            whole(
                                acc, at - turn * count, to - turn * count, (turn % parts) * count, table, lag, w, u,
                                rho, 0.5 * h * WEIGHTS[points, g],
                            )  # fmt: skip
                            at = to
