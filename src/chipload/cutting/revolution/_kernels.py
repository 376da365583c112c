"""Compiled loop of the loads over a revolution where the law of the material is linear; arrays and scalars only.

Notation as in :mod:`chipload.cutting._kernels`. Over the part lo .. hi of the immersion in which a bite's edge lies at
a rotation the load of the edge is (I(hi) - I(lo)) / rate, I the integral of the load of a mm over the immersion:
products of sine and cosine. These of all rotations come from one table.
Oracle: :func:`chipload.cutting.force.forces_over_turn`, which integrates bite by bite and rotation by rotation.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

TAU = 2.0 * math.pi
#: an edge that lags by less than this over a bite counts as one that does not [rad]
STRAIGHT = 1e-5
#: entries whose angles [rad] and places [mm] differ by no more than this, and whose chips by no more than this share,
#: have the same loads: those of the first of them
SAME = 1e-8

_F2 = types.float64[:, ::1]
_RI = types.Array(types.int64, 1, "C", readonly=True)
_RF = tuple(types.Array(types.float64, n, "C", readonly=True) for n in range(1, 4))


@njit(cache=True, nogil=True)
def weights(along, offset, across, sine, cosine, c, out):
    """Factors of the load of a mm of edge: with S, C of the immersion, force along T = -(w0 C + w1 S C + w2 C C + w3 S
    + w4 S S), along n = w0 S + (w1 S + w2 C) S - w3 C - w4 S C + ..., see :func:`add`.
    """
    kr = sine * c[1] + cosine * c[2]
    ka = sine * c[2] - cosine * c[1]
    out[0] = c[0] * offset + c[3]
    out[1] = c[0] * along
    out[2] = c[0] * across
    out[3] = kr * offset + sine * c[4] + cosine * c[5]
    out[4] = kr * along
    out[5] = kr * across
    out[6] = ka * offset + sine * c[5] - cosine * c[4]
    out[7] = ka * along
    out[8] = ka * across


@njit(cache=True, nogil=True)
def add(acc, m0, m1, at, step, back, table, first, last, p, q, w, size, arm, rate):
    """Add the loads of a bite to ``acc`` (4, m), rows along T, n, the axis and torque, for the rotations ``m0`` to
    ``m1``, which begin at ``back`` [rad] and are the entries ``at`` on of the table (2, .) of cosines and sines.

    The edge lies at the immersions theta - last .. theta - first, of which p .. q cut; ``size`` its length [mm] where
    it does not lag, ``rate`` [rad/mm] its lag.
    """
    straight = last - first < STRAIGHT
    # rotations at which all of the edge cuts
    k0 = m0 if straight else min(max(math.ceil((p + last - back) / step), m0), m1)
    k1 = m1 if straight else max(min(math.floor((q + first - back) / step) + 1, m1), k0)
    if k1 > k0:
        add_whole(acc, k0, k1, at, table, 0.5 * (first + last), 0.5 * (last - first), w, size, arm)
    if k1 - k0 < m1 - m0:
        add_part(acc, m0, k0, k1, m1, at, step, back, table, first, last, p, q, w, arm, rate)


@njit(cache=True, nogil=True)
def add_whole(acc, m0, m1, at, table, mid, half, w, size, arm):
    """:func:`add` where all of the edge cuts, half an angle to both sides of the lag ``mid``: closed forms over it."""
    at_, bt, ct, ar, br, cr = size * w[0], size * w[1], size * w[2], size * w[3], size * w[4], size * w[5]
    a0, a1, a2 = size * w[6], size * w[7], size * w[8]
    one = 1.0
    two = 1.0
    if half > 0.5 * STRAIGHT:
        one = math.sin(half) / half
        two = one * math.cos(half)
    cl = math.cos(mid)
    sl = math.sin(mid)
    for m in range(m0, m1):
        x = table[0, at + m]
        y = table[1, at + m]
        C = x * cl + y * sl
        S = y * cl - x * sl
        co = C * one
        si = S * one
        sc = S * C * two
        ss = 0.5 - (0.5 - S * S) * two
        cc = 1.0 - ss
        acc[0, m] -= at_ * co + (bt + cr) * sc + ct * cc + ar * si + br * ss
        acc[1, m] += at_ * si + bt * ss + (ct - br) * sc - ar * co - cr * cc
        acc[2, m] -= a0 + a1 * si + a2 * co
        acc[3, m] += arm * (at_ + bt * si + ct * co)


@njit(cache=True, nogil=True)
def add_part(acc, m0, k0, k1, m1, at, step, back, table, first, last, p, q, w, arm, rate):
    """:func:`add` where the edge is cut off at an end: from ``m0`` to ``k0`` and from ``k1`` to ``m1``."""
    at_, bt, ct, ar, br, cr, a0, a1, a2 = w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8]
    cf = math.cos(first)
    sf = math.sin(first)
    cl = math.cos(last)
    sl = math.sin(last)
    cp = math.cos(p)
    sp = math.sin(p)
    cq = math.cos(q)
    sq = math.sin(q)
    over = 1.0 / rate
    for i in range(m1 - m0 - (k1 - k0)):
        m = m0 + i if i < k0 - m0 else i + m0 + k1 - k0
        x = table[0, at + m]
        y = table[1, at + m]
        theta = back + step * m
        high = theta - first
        low = theta - last
        end = high >= q
        begin = low <= p
        high = q if end else high
        low = p if begin else low
        C1 = cq if end else x * cf + y * sf
        S1 = sq if end else y * cf - x * sf
        C0 = cp if begin else x * cl + y * sl
        S0 = sp if begin else y * cl - x * sl
        d = high - low
        dS = S1 - S0
        dC = C1 - C0
        ss = 0.5 * (S1 * S1 - S0 * S0)
        sc = 0.5 * (S1 * C1 - S0 * C0)
        cc2 = 0.5 * d + sc
        ss2 = 0.5 * d - sc
        acc[0, m] -= over * (at_ * dS + (bt + cr) * ss + ct * cc2 - ar * dC + br * ss2)
        acc[1, m] += over * (-at_ * dC + bt * ss2 + (ct - br) * ss - ar * dS - cr * cc2)
        acc[2, m] -= over * (a0 * d - a1 * dC + a2 * dS)
        acc[3, m] += over * arm * (at_ * d - bt * dC + ct * dS)


@njit(cache=True, nogil=True)
def same(i, j, start, rows, tooth, piece, slices, frame, left):
    """Whether two entries cut alike, as the steps along a straight row do."""
    count = start[i + 1] - start[i]
    if start[j + 1] - start[j] != count:
        return False
    for d in range(3):
        if abs(left[i, d] - left[j, d]) > SAME:
            return False
        for e in range(3):
            if abs(frame[i, d, e] - frame[j, d, e]) > SAME:
                return False
    for n in range(count):
        r = start[i] + n
        q = start[j] + n
        if tooth[r] != tooth[q]:
            return False
        thick = SAME * (abs(rows[q, 4]) + abs(rows[q, 5]) + abs(rows[q, 6]))
        for d in range(7):
            if abs(rows[r, d] - rows[q, d]) > (SAME if d < 4 else thick):
                return False
            if abs(slices[piece[r], d] - slices[piece[q], d]) > SAME:
                return False
    return True


@njit(
    types.void(
        _RI, _RF[1], _RI, _RI, _RF[1], _RF[1], _RF[2], types.int64, types.int64, types.boolean, _RF[0], _RF[1], _F2
    ),
    cache=True,
    nogil=True,
)
def over_turn(start, rows, tooth, piece, slices, table, frame, teeth, count, alike, c, left, out):
    """Loads of each entry over a period of ``count`` rotations, the pitch where all teeth are ``alike``.

    ``out`` (n, 17): mean, greatest and least x, y, z of the force in the frame of the work, its greatest size, mean and
    greatest torque [N mm], 0, thickest chip, greatest force against ``left``, numbers of the rotations at which force
    and torque are greatest. The means are left to the caller.
    """
    acc = np.empty((4, count))
    w = np.empty(9)
    # where all teeth are alike each is the one before a pitch later, and a period of the pitch takes all in
    parts = teeth if alike else 1
    step = TAU / parts / count
    known = -1
    for i in range(len(start) - 1):
        if known >= 0 and same(i, known, start, rows, tooth, piece, slices, frame, left):
            out[i] = out[known]
            continue
        known = i
        acc[:] = 0.0
        chip = 0.0
        for r in range(start[i], start[i + 1]):
            k = piece[r]
            p = rows[r, 0]
            q = rows[r, 1]
            along = rows[r, 4]
            offset = rows[r, 5]
            across = rows[r, 6]
            weights(along, offset, across, slices[k, 3], slices[k, 4], c, w)
            rate = slices[k, 6]
            size = rows[r, 3] - rows[r, 2]
            crest = math.atan2(along, across)
            crest += TAU * math.ceil((p - crest) / TAU)
            h = math.hypot(along, across)
            if crest > q:
                h = max(along * math.sin(p) + across * math.cos(p), along * math.sin(q) + across * math.cos(q))
            chip = max(chip, h + offset)
            one = tooth[r] >= 0
            for j in range(1 if one or alike else teeth):
                lag = slices[k, 5] + rate * (rows[r, 2] - slices[k, 0])
                lag += TAU * (tooth[r] if one else j) / teeth
                last = lag + rate * size
                if last - lag < STRAIGHT:
                    lag = 0.5 * (lag + last)
                    last = lag
                # rotations at which part of the edge cuts
                m0 = math.ceil((p + lag) / step)
                m1 = math.ceil((q + last) / step)
                while m0 < m1:
                    turn = m0 // count
                    m2 = min(m1, (turn + 1) * count)
                    back = step * turn * count
                    add(
                        acc, m0 - turn * count, m2 - turn * count, (turn % parts) * count, step, back, table, lag,
                        last, p, q, w, size, slices[k, 1], rate,
                    )  # fmt: skip
                    m0 = m2
        out[i, :] = 0.0
        out[i, 3:6] = -math.inf
        out[i, 6:9] = math.inf
        out[i, 11] = -math.inf
        for m in range(count):
            size2 = 0.0
            away = 0.0
            for d in range(3):
                f = acc[0, m] * frame[i, 0, d] + acc[1, m] * frame[i, 1, d] + acc[2, m] * frame[i, 2, d]
                out[i, 3 + d] = max(out[i, 3 + d], f)
                out[i, 6 + d] = min(out[i, 6 + d], f)
                size2 += f * f
                away -= f * left[i, d]
            if size2 > out[i, 9]:
                out[i, 9] = size2
                out[i, 15] = m
            if acc[3, m] > out[i, 11]:
                out[i, 11] = acc[3, m]
                out[i, 16] = m
            out[i, 14] = max(out[i, 14], away)
        out[i, 9] = math.sqrt(out[i, 9])
        out[i, 13] = chip
