"""Compiled loops of the wall error; arrays and scalars only.

Notation as in :mod:`chipload.cutting.wall_error`: theta [rad] rotation of tooth 0 at the tip, lag [rad/mm] =
tan(helix) / R, c = (Ktc, Krc, Kac, Kte, Kre, Kae, m_t, m_r, m_a), a row of an engagement range = (phi from, phi to,
z from, z to, along, offset, across).
Oracles: slice summation and quadrature in tests/cutting.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.cutting._tooth_force import BESIDE, GOLDEN, REFINEMENTS, TAU, breaks_of, thickness_power
from chipload.structure._beam import beam_deflection

#: Gauss-Legendre on [-1, 1], five points
NODES = np.array([-0.906179845938664, -0.5384693101056831, 0.0, 0.5384693101056831, 0.906179845938664])
WEIGHTS = np.array(
    [0.23692688505618908, 0.47862867049936647, 0.5688888888888889, 0.47862867049936647, 0.23692688505618908]
)
#: greatest number of ranges of a step at whose ends the wall is calculated too
FEW = 24
#: longest piece of immersion that five points integrate to rounding [rad]
PIECE = 0.6


@njit(cache=True, nogil=True)
def push(theta, z, rows, tooth, lo, hi, teeth, lag, c, length, fluted, flex_fluted, flex_shank, work):
    """Displacement along n of the cutter at height z, away from the work, under the load at rotation theta [mm]: the
    load of each height with the beam's compliance from there to z, five-point Gauss on smooth pieces.
    """
    total = 0.0
    for r in range(lo, hi):
        p = rows[r, 0]
        q = rows[r, 1]
        za = rows[r, 2]
        zb = rows[r, 3]
        one = tooth[r] >= 0
        for k in range(1 if one else teeth):
            j = tooth[r] if one else k
            turn = (theta - TAU * j / teeth) % TAU
            while turn - lag * zb <= q:
                if turn - lag * za >= p:
                    z1 = za
                    z2 = zb
                    if lag > 0.0:
                        z1 = max(za, (turn - q) / lag)
                        z2 = min(zb, (turn - p) / lag)
                    elif turn >= q:
                        z2 = z1
                    for side in range(2):
                        b1 = z1 if side == 0 else max(z1, z)
                        b2 = min(z2, z) if side == 0 else z2
                        if b2 <= b1:
                            continue
                        parts = math.ceil(lag * (b2 - b1) / PIECE)
                        parts = max(parts, 1)
                        h = (b2 - b1) / parts
                        for part in range(parts):
                            for g in range(5):
                                zz = b1 + h * (part + 0.5 + 0.5 * NODES[g])
                                phi = turn - lag * zz
                                s = math.sin(phi)
                                v = math.cos(phi)
                                thick = rows[r, 4] * s + rows[r, 6] * v + rows[r, 5]
                                f = (c[0] * thickness_power(thick, c[6]) + c[3]) * s
                                f -= (c[1] * thickness_power(thick, c[7]) + c[4]) * v
                                flex = beam_deflection(zz, z, length, fluted, flex_fluted, flex_shank) + work
                                total += 0.5 * h * WEIGHTS[g] * f * flex
                turn += TAU
    return total


@njit(cache=True, nogil=True)
def wall_at(z, gen, lag, teeth, runout, rows, tooth, lo, hi, c, beam, work):
    """Error of the wall at height z [mm], positive where material is left: what the tooth leaves that cuts deepest
    there. ``gen`` the immersion that makes the wall (0 or pi), ``runout`` (2,) [mm, rad].
    """
    sign = 1.0 if gen > 1.0 else -1.0
    inside = gen - sign * BESIDE
    least = math.inf
    for j in range(teeth if runout[0] > 0.0 else 1):
        theta = inside + lag * z + TAU * j / teeth
        e = sign * push(theta, z, rows, tooth, lo, hi, teeth, lag, c, beam[0], beam[1], beam[2], beam[3], work)
        least = min(least, e - runout[0] * math.cos(runout[1] - TAU * j / teeth - lag * z))
    return least


@njit(cache=True, nogil=True)
def wall_profiles(start, rows, tooth, gen, lag, teeth, runout, c, z, beam, work, made, out):
    """Wall error of every step at the heights z (p,): out (n, p); steps that make no wall stay 0."""
    for i in range(len(start) - 1):
        if made[i]:
            for k in range(len(z)):
                out[i, k] = wall_at(z[k], gen, lag, teeth, runout, rows, tooth, start[i], start[i + 1], c, beam, work)


@njit(cache=True, nogil=True)
def wall_worst(start, rows, tooth, piece, flank, gen, lag, teeth, runout, c, heights, depth, beam, work, made, out):
    """Wall error of greatest size of every step, and its height: out (n, 2). Sampled at ``heights`` equal heights and
    at those where an engagement range begins or ends as the generating edge passes; then refined by golden section.
    """
    pitch = TAU / teeth
    for i in range(len(start) - 1):
        if not made[i]:
            continue
        lo = start[i]
        hi = start[i + 1]
        best = -1.0
        for k in range(heights):
            zk = depth * k / (heights - 1)
            e = wall_at(zk, gen, lag, teeth, runout, rows, tooth, lo, hi, c, beam, work)
            if abs(e) > best:
                best = abs(e)
                out[i, 0] = e
                out[i, 1] = zk
        # many ranges are parts of edges whose runout lags: what begins or ends with each is small
        few = lag > 0.0 and hi - lo <= FEW
        room = np.empty(4 * (hi - lo) * teeth if few else 1)
        count = breaks_of(rows, tooth, piece, flank, lo, hi, teeth, pitch, room) if few else 0
        for b in range(count):
            zk = ((room[b] - gen) % pitch) / lag
            while zk < depth:
                e = wall_at(zk, gen, lag, teeth, runout, rows, tooth, lo, hi, c, beam, work)
                if abs(e) > best:
                    best = abs(e)
                    out[i, 0] = e
                    out[i, 1] = zk
                zk += pitch / lag
        a = max(0.0, out[i, 1] - depth / (heights - 1))
        d = min(depth, out[i, 1] + depth / (heights - 1))
        for _ in range(REFINEMENTS):
            x = d - GOLDEN * (d - a)
            y = a + GOLDEN * (d - a)
            ex = wall_at(x, gen, lag, teeth, runout, rows, tooth, lo, hi, c, beam, work)
            ey = wall_at(y, gen, lag, teeth, runout, rows, tooth, lo, hi, c, beam, work)
            if abs(ex) > abs(ey):
                d = y
                if abs(ex) > best:
                    best = abs(ex)
                    out[i, 0] = ex
                    out[i, 1] = x
            else:
                a = x
                if abs(ey) > best:
                    best = abs(ey)
                    out[i, 0] = ey
                    out[i, 1] = y
