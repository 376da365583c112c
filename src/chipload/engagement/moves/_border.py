"""Compiled search for the borders of the material on a circle of the cutter; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.moves._contact`; directions are (cos, sin) of psi; (px, py) the axis and
z, rho the height and radius of the circle [mm], T the direction psi = 0. A border belongs to one move. If another move
swept the material next to it, the search continues with that move.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.cutter.record import BALL
from chipload.engagement.moves._sweep import (
    EPS,
    MATERIAL,
    section,
    swept,
    swept_by,
    what_is,
)

#: square of the tolerance of a border [rad^2], and greatest number of moves that are tested for it
NARROW, TURNS = 1e-8, 200
#: angle from a border at which the neighbouring material is tested [rad]
BESIDE = 5e-5
#: greatest number of arcs that are tested for a border, and tolerance of its direction
ARCS, CLOSE = 60, 2e-6


@njit(cache=True, nogil=True)
def halve_to_crossing(px, py, z, rho, T, cu, su, cs, ss, m, c):
    """:func:`crossing_direction` of any move by halving."""
    near = BESIDE / math.sqrt((cu - cs) ** 2 + (su - ss) ** 2)
    low = 0.0
    high = 1.0
    while high - low >= near:
        at = 0.5 * (low + high)
        dc = cu + at * (cs - cu)
        ds = su + at * (ss - su)
        size = rho / math.sqrt(dc * dc + ds * ds)
        x = px + size * (dc * T[0] - ds * T[1])
        y = py + size * (dc * T[1] + ds * T[0])
        if swept(m, c, x, y, z):
            high = at
        else:
            low = at
    at = 0.5 * (low + high)
    dc = cu + at * (cs - cu)
    ds = su + at * (ss - su)
    size = 1.0 / math.sqrt(dc * dc + ds * ds)
    dc *= size
    ds *= size
    bc = cu + low * (cs - cu)
    bs = su + low * (ss - su)
    size = 1.0 / math.sqrt(bc * bc + bs * bs)
    bc *= size
    bs *= size
    return dc, ds, bc, bs


@njit(cache=True, nogil=True)
def crossing_direction(px, py, z, rho, T, cu, su, cs, ss, e, index):
    """Direction at which the volume that move e swept begins, between the directions u, not swept by it, and s, swept;
    and a direction just before it, not swept.

    Where the move sweeps a disc or is that of a ball, the cutter at any time of the move meets the circle in an arc
    whose ends are known. From s on the end of the arc at the time when the cutter is nearest is in the swept volume and
    nearer to its border; that is repeated, and is exact where the time stays. Else the border is found by halving.
    """
    moves = index[6]
    cutters = index[8]
    of = index[7]
    ball = cutters[of[e]].kind == BALL
    disc = ball
    first = 0.0
    last = 1.0
    r = cutters[of[e]].radius[0]
    far2 = (r + EPS) * (r + EPS)
    if not ball:
        first, last, far2, disc = section(moves[e], cutters[of[e]], z)
    dc = cs
    ds = ss
    if disc:
        # the way from s to u: counter-clockwise above 0
        turn = 1.0 if cs * su - ss * cu > 0.0 else -1.0
        ux = moves[e, 3] * T[0] + moves[e, 4] * T[1]
        uy = moves[e, 4] * T[0] - moves[e, 3] * T[1]
        # of the circle's middle, along and across T
        qx = (px - moves[e, 0]) * T[0] + (py - moves[e, 1]) * T[1]
        qy = (py - moves[e, 1]) * T[0] - (px - moves[e, 0]) * T[1]
        uz = moves[e, 5]
        w = z - moves[e, 2] - r
        for _ in range(ARCS):
            along = (qx + rho * dc) * ux + (qy + rho * ds) * uy
            dz = 0.0
            if ball:
                t = (along + w * uz) * moves[e, 7]
                t = 0.0 if t < 0.0 else (1.0 if t > 1.0 else t)
                dz = w - t * uz
            if dz > 0.0 or not ball:
                t = along * moves[e, 6]
                t = first if t < first else (last if t > last else t)
                dz = 0.0
            vx = qx - t * ux
            vy = qy - t * uy
            v2 = vx * vx + vy * vy
            if v2 == 0.0:
                break
            size = 1.0 / math.sqrt(v2)
            vx *= size
            vy *= size
            k = 0.5 * (far2 - v2 - rho * rho - dz * dz) / rho * size
            k = -1.0 if k < -1.0 else (1.0 if k > 1.0 else k)
            n = turn * math.sqrt(1.0 - k * k)
            before_c = dc
            before_s = ds
            dc = k * vx + n * vy
            ds = k * vy - n * vx
            if abs(dc - before_c) + abs(ds - before_s) < CLOSE:
                break
        gone = turn * BESIDE
        bc = dc - gone * ds - 0.5 * gone * gone * dc
        bs = ds + gone * dc - 0.5 * gone * gone * ds
        if turn * (bc * su - bs * cu) <= 0.0:
            bc = cu
            bs = su
    else:
        dc, ds, bc, bs = halve_to_crossing(px, py, z, rho, T, cu, su, cs, ss, moves[e], cutters[of[e]])
    return dc, ds, bc, bs


@njit(cache=True, nogil=True)
def border(px, py, z, rho, T, cm, sm, ca, sa, e, index):
    """Psi between a direction in material (cm, sm) and one in air (ca, sa) where the material ends; ``e`` the move that
    swept the latter, or AIR.
    """
    for _ in range(TURNS):
        if (cm - ca) ** 2 + (sm - sa) ** 2 < NARROW:
            break
        if e < 0:
            bc = cm + ca
            bs = sm + sa
            size = 1.0 / math.sqrt(bc * bc + bs * bs)
            bc *= size
            bs *= size
            dc = bc
            ds = bs
        else:
            dc, ds, bc, bs = crossing_direction(px, py, z, rho, T, cm, sm, ca, sa, e, index)
        f = what_is(px + rho * (bc * T[0] - bs * T[1]), py + rho * (bc * T[1] + bs * T[0]), z, index, e)
        if f == MATERIAL:
            if e >= 0:
                return math.atan2(ds, dc)
            cm = bc
            sm = bs
        else:
            ca = bc
            sa = bs
            e = f
    return math.atan2(sm + sa, cm + ca)


@njit(cache=True, nogil=True)
def ridge(px, py, z, rho, T, ca, sa, cb, sb, ea, eb, index):
    """Whether there is material between two directions in air, a swept by move ``ea`` and b by move ``eb``, and a
    direction in it. The search goes from the border of one move to that of the next until it reaches b.
    """
    if ea < 0:
        ca, sa, cb, sb, ea, eb = cb, sb, ca, sa, eb, ea
    if ea < 0:
        return False, 0.0, 0.0
    for _ in range(TURNS):
        if (ca - cb) ** 2 + (sa - sb) ** 2 < NARROW:
            return False, 0.0, 0.0
        x = px + rho * (cb * T[0] - sb * T[1])
        y = py + rho * (cb * T[1] + sb * T[0])
        if swept_by(ea, x, y, z, index):
            return False, 0.0, 0.0
        _, _, bc, bs = crossing_direction(px, py, z, rho, T, cb, sb, ca, sa, ea, index)
        f = what_is(px + rho * (bc * T[0] - bs * T[1]), py + rho * (bc * T[1] + bs * T[0]), z, index, eb)
        if f == MATERIAL:
            return True, bc, bs
        if f < 0 or f in (ea, eb):
            return False, 0.0, 0.0
        ca = bc
        sa = bs
        ea = f
    return False, 0.0, 0.0
