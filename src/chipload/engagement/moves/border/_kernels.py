"""Compiled search for the borders of the material on a circle of the cutter; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.moves.front._kernels`; directions are (cos, sin) of psi. A border is that of
one move, unless what is left beside it was swept by another: then the search goes on from there.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.engagement.moves._kernels import (
    BALL,
    CORNER,
    EPS,
    KIND,
    MATERIAL,
    from_ball,
    from_track,
    section,
    swept,
    what_is,
)

#: square of the angle [rad^2] to which a border is found, and most moves that are asked for it
NARROW, TURNS = 1e-8, 200
#: angle beside a border, at which what is there is asked [rad]
BESIDE = 5e-5
#: most values that are asked for a border
SECANTS = 60


@njit(cache=True, nogil=True)
def crossing(px, py, z, rho, T, cu, su, cs, ss, e, index):
    """Direction at which what the move ``e`` swept begins between the directions u, not swept by it, and s, swept, and
    a direction just before it, not swept.

    Where the move sweeps a disc or is that of a ball, its distance from the point decides: zero of a smooth function,
    found by secants; else by halving.
    """
    m = index[6][e]
    c = index[8][index[7][e]]
    ball = c[KIND] == BALL
    first, last, far2, disc = section(m, c, z)
    if ball:
        far2 = (c[CORNER] + EPS) ** 2
    width = math.sqrt((cu - cs) ** 2 + (su - ss) ** 2)
    near = BESIDE / width
    low = 0.0
    high = 1.0
    at = 0.0
    if ball or disc:
        # at the ends first, then where the secant of the last two values has its zero, if that is between the bounds
        before_at = 0.0
        before_v = 0.0
        for i in range(SECANTS):
            dc = cu + at * (cs - cu)
            ds = su + at * (ss - su)
            size = rho / math.sqrt(dc * dc + ds * ds)
            x = px + size * (dc * T[0] - ds * T[1])
            y = py + size * (dc * T[1] + ds * T[0])
            v = (from_ball(m, c[CORNER], x, y, z) if ball else from_track(m, first, last, x, y)) - far2
            if i == 0:
                before_v = v
                at = 1.0
                if v <= 0.0:
                    at = 0.0
                    break
                continue
            if v < 0.0:
                high = at
            elif i == 1:
                break
            else:
                low = at
            to = at + v * (at - before_at) / (before_v - v) if v != before_v else high
            if not low < to < high:
                to = 0.5 * (low + high)
            before_at = at
            before_v = v
            done = abs(to - at) < 0.2 * near or high - low < near
            at = to
            if done:
                break
        before = max(low, min(at, high) - near)
    else:
        while high - low >= near:
            at = 0.5 * (low + high)
            dc = cu + at * (cs - cu)
            ds = su + at * (ss - su)
            size = rho / math.sqrt(dc * dc + ds * ds)
            if swept(m, c, px + size * (dc * T[0] - ds * T[1]), py + size * (dc * T[1] + ds * T[0]), z):
                high = at
            else:
                low = at
        at = 0.5 * (low + high)
        before = low
    dc = cu + at * (cs - cu)
    ds = su + at * (ss - su)
    size = 1.0 / math.sqrt(dc * dc + ds * ds)
    bc = cu + before * (cs - cu)
    bs = su + before * (ss - su)
    over = 1.0 / math.sqrt(bc * bc + bs * bs)
    return dc * size, ds * size, bc * over, bs * over


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
            dc, ds, bc, bs = crossing(px, py, z, rho, T, cm, sm, ca, sa, e, index)
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
    """Whether there is material between two directions in air, a swept by the move ``ea``, b by ``eb``, and a direction
    in it: from the border of one move on to that of the next until b is reached.
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
        if swept(index[6][ea], index[8][index[7][ea]], x, y, z):
            return False, 0.0, 0.0
        _, _, bc, bs = crossing(px, py, z, rho, T, cb, sb, ca, sa, ea, index)
        f = what_is(px + rho * (bc * T[0] - bs * T[1]), py + rho * (bc * T[1] + bs * T[0]), z, index, eb)
        if f == MATERIAL:
            return True, bc, bs
        if f < 0 or f in (ea, eb):
            return False, 0.0, 0.0
        ca = bc
        sa = bs
        ea = f
    return False, 0.0, 0.0
