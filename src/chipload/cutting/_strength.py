"""Compiled loop of the loads in sections of a cutter; arrays and scalars only.

Notation as in ``strength.py`` and :mod:`chipload.cutting._tooth_force`. Oracles: closed forms and a sum
over slices in tests/cutting/test_strength.py.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.cutting._tooth_force import TAU, edge, engaged_part, first_turn

#: longest piece of immersion that is integrated at once [rad]
PIECE = 0.6
#: Gauss-Legendre on [-1, 1]: points of a piece by its immersion, so that what is left out is below 1e-7 of the load
SHORT, MEDIUM = 0.1, 0.35
NODES, WEIGHTS = np.zeros((6, 5)), np.zeros((6, 5))
for _n in (2, 3, 5):
    NODES[_n, :_n], WEIGHTS[_n, :_n] = np.polynomial.legendre.leggauss(_n)


@njit(cache=True, nogil=True)
def points_of(angle):
    """How many points integrate a piece of so much immersion [rad]."""
    return 2 if angle <= SHORT else (3 if angle <= MEDIUM else 5)


@njit(cache=True, nogil=True)
def edge_at(phi, linear, along, offset, across, sine, cosine, c):
    """:func:`chipload.cutting._tooth_force.edge` at one immersion; ``linear``: the law has no exponents."""
    if not linear:
        return edge(phi, 0.0, along, offset, across, sine, cosine, c)
    s = math.sin(phi)
    o = math.cos(phi)
    h = along * s + across * o + offset
    tangential = c[0] * h + c[3]
    radial = c[1] * h + c[4]
    axial = c[2] * h + c[5]
    r = sine * radial + cosine * axial
    return -(tangential * o + r * s), tangential * s - r * o, cosine * radial - sine * axial, tangential


@njit(cache=True, nogil=True)
def in_sections(theta, rows, tooth, piece, slices, lo, hi, teeth, c, heights, out):
    """What the teeth below each height load its section with at one rotation: out (h, 4) = lever along T and n [N mm],
    axial force [N], torque [N mm]. ``heights`` rise.
    """
    out[:] = 0.0
    linear = c[6] == 0.0 and c[7] == 0.0 and c[8] == 0.0
    for r in range(lo, hi):
        p = rows[r, 0]
        q = rows[r, 1]
        k = piece[r]
        rate = slices[k, 6]
        rho = slices[k, 1]
        sine = slices[k, 3]
        base = slices[k, 5] - rate * slices[k, 0]
        first = base + rate * rows[r, 2]
        last = base + rate * rows[r, 3]
        one = tooth[r] >= 0
        for i in range(1 if one else teeth):
            j = tooth[r] if one else i
            turn = first_turn(theta, j, teeth, p, first)
            while turn - last <= q:
                s1, s2 = engaged_part(turn, base, rate, p, q, rows[r, 2], rows[r, 3])
                # pieces between neighbouring sections load those above them
                b1 = s1
                for e in range(len(heights)):
                    if b1 >= s2:
                        break
                    high = slices[k, 0] + (heights[e] - slices[k, 2]) / sine if sine > 0.0 else s2
                    if sine <= 0.0 and slices[k, 2] > heights[e]:
                        continue
                    b2 = min(s2, high)
                    if b2 <= b1:
                        continue
                    parts = max(math.ceil(rate * (b2 - b1) / PIECE), 1)
                    h = (b2 - b1) / parts
                    points = points_of(rate * h)
                    for part in range(parts):
                        for g in range(points):
                            s = b1 + h * (part + 0.5 + 0.5 * NODES[points, g])
                            phi = turn - base - rate * s
                            t, n, a, m = edge_at(phi, linear, rows[r, 4], rows[r, 5], rows[r, 6], sine, slices[k, 4], c)
                            w = 0.5 * h * WEIGHTS[points, g]
                            z = slices[k, 2] + sine * (s - slices[k, 0])
                            sa = rho * a * math.sin(phi)
                            ca = rho * a * math.cos(phi)
                            for f in range(e, len(heights)):
                                lever = heights[f] - z
                                out[f, 0] += w * (lever * t + sa)
                                out[f, 1] += w * (lever * n + ca)
                                out[f, 2] += w * a
                                out[f, 3] += w * rho * m
                    b1 = b2
                turn += TAU


@njit(cache=True, nogil=True)
def in_sections_over_turn(start, rows, tooth, piece, slices, theta, teeth, c, heights, out):
    """``in_sections`` of every step at every rotation: out (n, m, h, 4)."""
    for i in range(len(start) - 1):
        for k in range(len(theta)):
            in_sections(theta[k], rows, tooth, piece, slices, start[i], start[i + 1], teeth, c, heights, out[i, k])


@njit(
    types.void(
        types.float64[:, :, ::1],
        *[types.Array(types.float64, 1, "C", readonly=True)] * 2,
        types.boolean,
        types.float64[::1],
    ),
    cache=True,
    nogil=True,
)
def greatest_stress(loads, heights, diameters, brittle, out):
    """Greatest equivalent stress of each step in sections above all that cuts: out (n,).

    ``loads`` (n, 8, m): axial force, torque, moments of the axial force, lateral force and its moment about the tip, as
    :func:`chipload.cutting.levers.lever_loads` of the levers 1 and z gives them.
    """
    for i in range(len(loads)):
        own = loads[i]
        worst = 0.0
        for e in range(len(heights)):
            d = diameters[e]
            area = math.pi * d * d / 4.0
            bend = math.pi * d**3 / 32.0
            for m in range(own.shape[1]):
                x = heights[e] * own[4, m] - own[6, m] + own[2, m]
                y = heights[e] * own[5, m] - own[7, m] + own[3, m]
                bending = math.sqrt(x * x + y * y) / bend
                axial = own[0, m] / area
                tau = 0.5 * own[1, m] / bend
                if brittle:
                    sigma = max(bending - axial, 0.0)
                    value = 0.5 * sigma + math.sqrt(0.25 * sigma * sigma + tau * tau)
                else:
                    value = math.sqrt((bending + abs(axial)) ** 2 + 3.0 * tau * tau)
                worst = max(worst, value)
        out[i] = worst
