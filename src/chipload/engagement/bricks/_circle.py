"""Compiled search for the material on a circle of a cutter in any direction; arrays and scalars only.

Notation: ``ring`` holds the centre of the circle and its two radii across each other [mm]; the direction psi is the
point centre + cos(psi) first + sin(psi) second. A border belongs to one move. If another move swept the material next
to it, the search continues with that move, as in :mod:`chipload.engagement.moves._border`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.engagement.bricks._index import solid, what_is
from chipload.engagement.bricks._sweep import estimated_least, swept
from chipload.engagement.moves._border import BESIDE, NARROW, TURNS
from chipload.engagement.moves._sweep import AIR, MATERIAL

PI = math.pi
#: distance from the end of the front at which the contact is tested [rad]
ASIDE = 1e-4
#: greatest number of secant steps
SECANTS = 12


@njit(cache=True, nogil=True)
def ask_circle(ring, c, s, index, hint, wait):
    """MATERIAL, AIR or the move that swept the direction (c, s) of the circle; ``hint`` is tested first."""
    return what_is(
        ring[0] + c * ring[3] + s * ring[6], ring[1] + c * ring[4] + s * ring[7], ring[2] + c * ring[5] + s * ring[8],
        index, hint, wait,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def swept_at(ring, c, s, e, index, wait):
    """Whether the move e swept a direction of the circle."""
    return swept(
        index[6][e], index[8][index[7][e]], ring[0] + c * ring[3] + s * ring[6], ring[1] + c * ring[4] + s * ring[7],
        ring[2] + c * ring[5] + s * ring[8], wait,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def estimated_least_at(ring, c, s, e, index):
    """Estimate of the distance [mm] of the direction (c, s) from the volume that move e swept, negative within."""
    return estimated_least(
        index[6][e], index[8][index[7][e]], ring[0] + c * ring[3] + s * ring[6], ring[1] + c * ring[4] + s * ring[7],
        ring[2] + c * ring[5] + s * ring[8],
    )  # fmt: skip


@njit(cache=True, nogil=True)
def solid_at(ring, c, s, index):
    """Whether a direction of the circle is in the initial body."""
    return solid(
        ring[0] + c * ring[3] + s * ring[6], ring[1] + c * ring[4] + s * ring[7], ring[2] + c * ring[5] + s * ring[8],
        index,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def chord_direction(cu, su, cs, ss, part):
    """Direction at a part of the chord from u to s."""
    dc = cu + part * (cs - cu)
    ds = su + part * (ss - su)
    size = 1.0 / math.sqrt(dc * dc + ds * ds)
    return dc * size, ds * size


@njit(cache=True, nogil=True)
def crossing_direction(ring, cu, su, cs, ss, e, index, wait):
    """Direction at which the volume that move e swept begins, between u, not swept by it, and s, swept; and a direction
    just before it, not swept. With AIR as e: the end of the initial body.

    The border is the zero of the distance, by secants; if that fails, or there is no distance, it is found by halving.
    """
    low = 0.0
    high = 1.0
    near = 0.5 * BESIDE / math.sqrt((cu - cs) ** 2 + (su - ss) ** 2)
    if e >= 0 and near < 0.25:
        f0 = estimated_least_at(ring, cu, su, e, index)
        f1 = estimated_least_at(ring, cs, ss, e, index)
        if f0 > 0.0 > f1:
            a = 0.0
            b = 1.0
            at = 0.5
            side = 0
            for _ in range(SECANTS):
                to = b - f1 * (b - a) / (f1 - f0)
                if abs(to - at) < 0.2 * near or b - a < near:
                    at = to
                    break
                at = to
                dc, ds = chord_direction(cu, su, cs, ss, at)
                f = estimated_least_at(ring, dc, ds, e, index)
                if f > 0.0:
                    a = at
                    f0 = f
                    # an end that stays counts half
                    if side == 1:
                        f1 *= 0.5
                    side = 1
                else:
                    b = at
                    f1 = f
                    if side == -1:
                        f0 *= 0.5
                    side = -1
            before = max(at - 0.8 * near, 0.0)
            after = min(at + 0.8 * near, 1.0)
            dc, ds = chord_direction(cu, su, cs, ss, before)
            bc, bs = chord_direction(cu, su, cs, ss, after)
            if before > 0.0 and swept_at(ring, dc, ds, e, index, wait):
                high = before
            elif after < 1.0 and not swept_at(ring, bc, bs, e, index, wait):
                low = after
            else:
                bc, bs = chord_direction(cu, su, cs, ss, at)
                return bc, bs, dc, ds
    while high - low > 2.0 * near:
        at = 0.5 * (low + high)
        dc, ds = chord_direction(cu, su, cs, ss, at)
        if swept_at(ring, dc, ds, e, index, wait) if e >= 0 else not solid_at(ring, dc, ds, index):
            high = at
        else:
            low = at
    dc, ds = chord_direction(cu, su, cs, ss, 0.5 * (low + high))
    bc, bs = chord_direction(cu, su, cs, ss, low)
    return dc, ds, bc, bs


@njit(cache=True, nogil=True)
def border(ring, cm, sm, ca, sa, e, index, wait):
    """Psi between a direction m in material and one a in air where the material ends; ``e`` the move that swept the
    latter, or AIR outside the body.
    """
    for _ in range(TURNS):
        if (cm - ca) ** 2 + (sm - sa) ** 2 < NARROW:
            break
        dc, ds, bc, bs = crossing_direction(ring, cm, sm, ca, sa, e, index, wait)
        f = ask_circle(ring, bc, bs, index, e, wait)
        if f == MATERIAL:
            return math.atan2(ds, dc)
        ca = bc
        sa = bs
        e = f
    return math.atan2(sm + sa, cm + ca)


@njit(cache=True, nogil=True)
def ridge(ring, ca, sa, cb, sb, ea, eb, index, wait):
    """Whether there is material between two directions in air, a swept by move ``ea`` and b by move ``eb``, and a
    direction in it. The search goes from the border of one move to that of the next until it reaches b.
    """
    if ea < 0:
        ca, sa, cb, sb, ea, eb = cb, sb, ca, sa, eb, ea
    if ea < 0 or swept_at(ring, cb, sb, ea, index, wait):
        return False, 0.0, 0.0
    # most moves overlap: a direction that both swept
    for _ in range(TURNS):
        dc = ca + cb
        ds = sa + sb
        size = 1.0 / math.sqrt(dc * dc + ds * ds)
        dc *= size
        ds *= size
        one = swept_at(ring, dc, ds, ea, index, wait)
        two = eb >= 0 and swept_at(ring, dc, ds, eb, index, wait)
        if (one and two) or (ca - cb) ** 2 + (sa - sb) ** 2 < NARROW:
            return False, 0.0, 0.0
        if not one and not two:
            break
        if one:
            ca = dc
            sa = ds
        else:
            cb = dc
            sb = ds
    for _ in range(TURNS):
        if (ca - cb) ** 2 + (sa - sb) ** 2 < NARROW or swept_at(ring, cb, sb, ea, index, wait):
            return False, 0.0, 0.0
        _, _, bc, bs = crossing_direction(ring, cb, sb, ca, sa, ea, index, wait)
        f = ask_circle(ring, bc, bs, index, eb, wait)
        if f == MATERIAL:
            return True, bc, bs
        if f < 0 or f in (ea, eb):
            return False, 0.0, 0.0
        ca = bc
        sa = bs
        ea = f
    return False, 0.0, 0.0


@njit(cache=True, nogil=True)
def unwound(psi, near):
    """The angle psi as the one nearest to another."""
    return psi - 2.0 * PI * math.floor((psi - near) / (2.0 * PI) + 0.5)


@njit(cache=True, nogil=True)
def intervals(ring, end, apart, index, wait, out):
    """Find the ranges of -end .. end [rad] in material; return their number.

    They are the rows (from, to) of ``out``. At the ends of the front the contact is tested just inside; samples are at
    most ``apart`` [rad] from one another.
    """
    first = min(ASIDE - end, 0.0) if end < PI else -end
    last = max(end - ASIDE, 0.0) if end < PI else end
    if last <= first:
        return 0
    n = max(math.ceil((last - first) / apart), 2)
    d = (last - first) / n
    c = math.cos(first)
    s = math.sin(first)
    cd = math.cos(d)
    sd = math.sin(d)
    count = 0
    before = np.int64(AIR)
    inside = False
    c0 = c
    s0 = s
    for i in range(n + 1):
        f = ask_circle(ring, c, s, index, before, wait)
        middle = first + (i - 0.5) * d
        if i > 0 and f != MATERIAL and not inside and f != before:
            found, cr, sr = ridge(ring, c0, s0, c, s, before, f, index, wait)
            if found:
                out[count, 0] = unwound(border(ring, cr, sr, c0, s0, before, index, wait), middle)
                out[count, 1] = unwound(border(ring, cr, sr, c, s, f, index, wait), middle)
                count += 1
        if f == MATERIAL and not inside:
            if i > 0:
                out[count, 0] = unwound(border(ring, c, s, c0, s0, before, index, wait), middle)
            else:
                out[count, 0] = -end
            inside = True
        elif f != MATERIAL and inside:
            out[count, 1] = unwound(border(ring, c0, s0, c, s, f, index, wait), middle)
            count += 1
            inside = False
        if f != MATERIAL:
            before = f
        c0 = c
        s0 = s
        c, s = c * cd - s * sd, c * sd + s * cd
    if inside:
        out[count, 1] = end
        count += 1
    return count
