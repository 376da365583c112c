"""Compiled loops of the directional matrix; arrays and scalars only.

Notation: theta [rad] rotation of tooth 0 at the tip; phi immersion; e = du/dphi and u of
:mod:`chipload.engagement.tooth_engagement`, as rows (T, n); r displacement of the cutter from the work. The force on
the cutter that a displacement adds is A(theta) (r(t) - r(t - tau)), A = -sum over the engaged edge of
(kt e + kr u) u^T ds, kept as (TT, Tn, nT, nn) [N/mm].

A row of ``rows`` is one tooth engagement: phi from, phi to, lag at its lower and at its upper end [rad], length along
the edge [mm], kt, kr, ka [MPa], along, across, offset [mm] of the chip thickness h. kt counts the tangential, kr + ka
the radial direction; with exponents m each is multiplied by h^-m.

A cell is 1 / m of a tooth period. In a cell in which an engagement begins or ends, the values at the three Gauss
points are those that keep the moments 0, 1 and 2 of A over the cell, so that the map stays of order 4.

Oracle: tests/stability/oracles.py.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

TAU = 2.0 * math.pi
#: three Gauss points of a cell and their weights
G3 = np.array([0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6)])
W3 = np.array([5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0])
#: five Gauss points of a smooth piece of a cell
_X5, _Y5 = np.polynomial.legendre.leggauss(5)
G5 = (_X5 + 1.0) / 2.0
W5 = _Y5 / 2.0
#: values at the Gauss points from the moments 0, 1, 2 over a cell
FROM_MOMENTS = np.linalg.inv(np.array([[W3[g] * G3[g] ** k for g in range(3)] for k in range(3)]))
#: twelve Gauss points for powers of the chip thickness
G12, W12 = np.polynomial.legendre.leggauss(12)
#: a lag that is shorter than this is none [rad]
UPRIGHT = 1e-9
#: a break nearer to the end of a cell than this is at its end, in cells
AT_END = 1e-9


@njit(cache=True, nogil=True)
def primitive(phi, kt, kr, out):
    """Integral of the four values of A over the immersion from 0 to phi, without exponents, per rad."""
    s2 = math.sin(2.0 * phi)
    c2 = math.cos(2.0 * phi)
    sc = (1.0 - c2) * 0.25
    ss = phi * 0.5 - s2 * 0.25
    cc = phi * 0.5 + s2 * 0.25
    out[0] = -(kt * sc + kr * ss)
    out[1] = -(kt * cc + kr * sc)
    out[2] = kt * ss - kr * sc
    out[3] = kt * sc - kr * cc


@njit(cache=True, nogil=True)
def density(phi, row, exponents, out):
    """The four values of A at the immersion phi for each mm of edge."""
    s = math.sin(phi)
    c = math.cos(phi)
    kt = row[5]
    kr = row[6]
    ka = row[7]
    if exponents[0] != 0.0 or exponents[1] != 0.0 or exponents[2] != 0.0:
        h = row[8] * s + row[9] * c + row[10]
        if h <= 0.0:
            out[:] = 0.0
            return
        kt *= h ** (-exponents[0])
        kr *= h ** (-exponents[1])
        ka *= h ** (-exponents[2])
    a = kt * c + (kr + ka) * s
    b = (kr + ka) * c - kt * s
    out[0] = -a * s
    out[1] = -a * c
    out[2] = -b * s
    out[3] = -b * c


@njit(cache=True, nogil=True)
def integrate_with_exponents(first, last, row, exponents, out, one):
    """Integral of :func:`density` over the immersion with exponents: between peak and trough of h the variable is w,
    phi = zero +- w^3, so that a power of h at its zero is smooth enough for twelve points.
    """
    out[:] = 0.0
    swing = math.hypot(row[8], row[9])
    peak = math.atan2(row[8], row[9])
    reach = math.acos(-row[10] / swing) if swing > abs(row[10]) else math.pi
    k = math.floor((first - peak) / math.pi)
    low = first
    while low < last:
        high = min(last, peak + (k + 1) * math.pi)
        if high > low:
            falling = k % 2 == 0
            zero = peak + k * math.pi + reach if falling else peak + (k + 1) * math.pi - reach
            u = np.cbrt(max(zero - high, 0.0) if falling else max(low - zero, 0.0))
            v = np.cbrt(max(zero - low, 0.0) if falling else max(high - zero, 0.0))
            for g in range(12):
                w = 0.5 * (u + v) + 0.5 * (v - u) * G12[g]
                weight = 1.5 * (v - u) * w * w * W12[g]
                density(zero - w**3 if falling else zero + w**3, row, exponents, one)
                for c in range(4):
                    out[c] += weight * one[c]
        low = high
        k += 1


@njit(cache=True, nogil=True)
def value(theta, row, exponents, out, one, two):
    """The four values of A of one row at a rotation, of the tooth whose immersion there is not wrapped."""
    span = row[3] - row[2]
    if span < UPRIGHT:
        phi = theta - row[2]
        if row[0] < phi < row[1]:
            density(phi, row, exponents, out)
            for c in range(4):
                out[c] *= row[4]
        else:
            out[:] = 0.0
        return
    low = max(row[0], theta - row[3])
    high = min(row[1], theta - row[2])
    if high <= low:
        out[:] = 0.0
        return
    if exponents[0] == 0.0 and exponents[1] == 0.0 and exponents[2] == 0.0:
        primitive(high, row[5], row[6] + row[7], out)
        primitive(low, row[5], row[6] + row[7], two)
        for c in range(4):
            out[c] -= two[c]
    else:
        integrate_with_exponents(low, high, row, exponents, out, one)
    for c in range(4):
        out[c] *= row[4] / span


@njit("void(float64[:,::1], int64, int64, float64, int64, float64[::1], float64[:,:,::1])", cache=True, nogil=True)
def matrices(rows, lo, hi, period, m, exponents, out):
    """A at the three Gauss points of the m cells of a period: adds rows lo .. hi - 1 to out (m, 3, 4) [N/mm].

    ``period`` [rad] is the pitch of evenly spaced teeth, each of which has the rows, or a revolution for one tooth.
    """
    d = period / m
    a = np.empty(4)
    one = np.empty(4)
    two = np.empty(4)
    moments = np.empty((3, 4))
    breaks = np.empty(4)
    ends = np.empty(6)
    for r in range(lo, hi):
        row = rows[r]
        if row[1] <= row[0] or row[4] <= 0.0:
            continue
        breaks[0] = row[0] + row[2]
        breaks[1] = min(row[0] + row[3], row[1] + row[2])
        breaks[2] = max(row[0] + row[3], row[1] + row[2])
        breaks[3] = row[1] + row[3]
        for i in range(math.floor(breaks[0] / d), math.ceil(breaks[3] / d)):
            begin = i * d
            count = 1
            ends[0] = begin
            for k in range(4):
                if ends[count - 1] + AT_END * d < breaks[k] < begin + d - AT_END * d:
                    ends[count] = breaks[k]
                    count += 1
            ends[count] = begin + d
            at = i % m
            if count == 1:
                for g in range(3):
                    value(begin + d * G3[g], row, exponents, a, one, two)
                    for c in range(4):
                        out[at, g, c] += a[c]
                continue
            moments[:] = 0.0
            for k in range(count):
                width = ends[k + 1] - ends[k]
                for g in range(5):
                    theta = ends[k] + width * G5[g]
                    t = (theta - begin) / d
                    value(theta, row, exponents, a, one, two)
                    for c in range(4):
                        x = a[c] * W5[g] * width / d
                        moments[0, c] += x
                        moments[1, c] += x * t
                        moments[2, c] += x * t * t
            for g in range(3):
                for c in range(4):
                    out[at, g, c] += (
                        FROM_MOMENTS[g, 0] * moments[0, c]
                        + FROM_MOMENTS[g, 1] * moments[1, c]
                        + FROM_MOMENTS[g, 2] * moments[2, c]
                    )
