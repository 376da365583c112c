"""Forced motion at the moment when an edge makes the wall; arrays and scalars only.

Notation: a row is phi from, phi to, lag at its lower and upper end [rad], length [mm], then t0, t1, t2, r0, r1, r2
[N/mm]: the tangential force of a mm of edge t0 + t1 sin(phi) + t2 cos(phi), and likewise the radial one. The force has
the period of a tooth; F_k is its k-th coefficient, r_k = G(i k 2 pi / tau) F_k.

Oracle: quadrature of the periodic motion in tests/stability.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numba import njit

TAU = 2.0 * math.pi
#: harmonics; what is left out falls with the second power of their number
HARMONICS = 400
#: heights of a row at which the wall is looked at
HEIGHTS = 5
#: how near to 0 or pi an engagement must come to make the wall [rad]
REACH = 5e-3


@njit(cache=True, nogil=True)
def _turned_integral(low, high, a):
    """Integral of e^(i a phi) from low to high."""
    if abs(a) < 1e-12:
        return complex(high - low, 0.0)
    return (cmath.exp(1j * a * high) - cmath.exp(1j * a * low)) / (1j * a)


@njit(cache=True, nogil=True)
def harmonic(row, q):
    """Integral over the immersion and the length of a row of the force along T and n times e^(-i q theta)."""
    low = row[0]
    high = row[1]
    e0 = _turned_integral(low, high, -q)
    ep = _turned_integral(low, high, 1.0 - q)
    em = _turned_integral(low, high, -1.0 - q)
    ep2 = _turned_integral(low, high, 2.0 - q)
    em2 = _turned_integral(low, high, -2.0 - q)
    s = (ep - em) / 2j
    c = (ep + em) / 2.0
    sc = (ep2 - em2) / 4j
    ss = e0 / 2.0 - (ep2 + em2) / 4.0
    cc = e0 / 2.0 + (ep2 + em2) / 4.0
    span = row[3] - row[2]
    turn = cmath.exp(-1j * q * row[2]) * row[4]
    if abs(q * span) > 1e-9:
        turn *= (1.0 - cmath.exp(-1j * q * span)) / (1j * q * span)
    along = -(row[5] * c + row[6] * sc + row[7] * cc) - (row[8] * s + row[9] * ss + row[10] * sc)
    across = row[5] * s + row[6] * ss + row[7] * sc - (row[8] * c + row[9] * sc + row[10] * cc)
    return turn * along, turn * across


@njit(
    "void(int64, int64, int64[::1], float64[:,::1], float64[::1], int64, float64[:,::1], float64[::1],"
    " float64[:,:,::1], float64[:,::1])",
    cache=True, nogil=True,
)  # fmt: skip
def wall_errors(first, last, start, rows, tau, teeth, w, z, U, out):
    """Of the cuts first .. last - 1: error of the wall of greatest size [mm], above 0 where material is left, and
    whether a wall is made: out (n, 2).
    """
    modes = len(z)
    motion = np.empty(HARMONICS + 1, np.complex128)
    for i in range(first, last):
        out[i, 0] = 0.0
        out[i, 1] = 0.0
        made = False
        for r in range(start[i], start[i + 1]):
            if rows[r, 0] <= REACH or abs(rows[r, 1] - math.pi) <= REACH:
                made = True
        if not made:
            continue
        for k in range(HARMONICS + 1):
            x = 0.0 + 0.0j
            y = 0.0 + 0.0j
            for r in range(start[i], start[i + 1]):
                a, b = harmonic(rows[r], float(k * teeth))
                x += a
                y += b
            x *= teeth / TAU
            y *= teeth / TAU
            motion[k] = 0.0
            omega = TAU * k / tau[i]
            for j in range(modes):
                share = 1.0 / complex(w[i, j] ** 2 - omega**2, 2.0 * z[j] * w[i, j] * omega)
                motion[k] += U[i, 1, j] * share * (U[i, 0, j] * x + U[i, 1, j] * y)
        for r in range(start[i], start[i + 1]):
            for wall in range(2):
                sign = -1.0 if wall == 0 else 1.0
                at = 0.0 if wall == 0 else math.pi
                if abs(rows[r, wall] - at) > REACH:
                    continue
                for height in range(HEIGHTS):
                    theta = at + rows[r, 2] + (rows[r, 3] - rows[r, 2]) * height / (HEIGHTS - 1.0)
                    step = cmath.exp(1j * teeth * theta)
                    turn = step
                    total = motion[0].real
                    for k in range(1, HARMONICS + 1):
                        total += 2.0 * (motion[k] * turn).real
                        turn *= step
                    out[i, 1] = 1.0
                    if abs(total) > abs(out[i, 0]):
                        out[i, 0] = sign * total
