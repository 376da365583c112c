"""Compiled loop of the loads over a revolution where the law of the material is linear; arrays and scalars only.

Notation as in :mod:`chipload.cutting._tooth_force`. At a rotation the edge of an engagement range lies in lo .. hi
of the immersion. Its load is (I(hi) - I(lo)) / rate, I the integral over the immersion of the load per mm: products of
sine and cosine, which one table contains for all rotations. Where the whole edge cuts, the load is a sum of the cosine
and sine of the rotation and of its double. Their factors are added where this part begins and subtracted where it ends,
so that the time for a range does not depend on the number of rotations in which it cuts.
Oracle: :func:`chipload.cutting.force.forces_over_turn`, which integrates each range at each rotation.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types

from chipload.cutting._tooth_force import chip_at_border, edge, part_between, run_of

TAU = 2.0 * math.pi
#: lag over an engagement range below which an edge counts as straight [rad]
STRAIGHT = 1e-5
#: relative difference up to which loads are equal: rounding does not decide which rotation has the greatest
ALIKE = 1e-7
#: greatest difference of angles [rad] and places [mm], and greatest relative difference of chips, of two entries with
#: the same loads
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
def add_whole(sums, m0, m1, cl, sl, one, two, w, size, arm):
    """Add the loads of an edge that cuts whole at the rotations ``m0`` to ``m1``: to ``sums[m0]`` what begins there,
    from ``sums[m1]`` what ends.

    With x, y the cosine and sine of the rotation and X, Y those of twice it the force along T is
    -(s0 + s2 x + s3 y + s4 X + s5 Y), along n s1 + s2 y - s3 x + s4 Y - s5 X, along the axis -(s6 + s7 x + s8 y) and
    the torque s9 + s10 x + s11 y; s12 counts what cuts. ``cl``, ``sl``: of the lag of the middle of the edge, ``one``
    and ``two`` the means of the cosine and of that of twice the angle over it, from its middle.
    """
    p = size * one * w[0]
    q = size * one * w[3]
    a = 0.5 * size * two * (w[1] + w[5])
    b = 0.5 * size * two * (w[2] - w[4])
    c2 = cl * cl - sl * sl
    s2 = 2.0 * cl * sl
    k0 = 0.5 * size * (w[2] + w[4])
    k1 = 0.5 * size * (w[1] - w[5])
    k2 = p * cl - q * sl
    k3 = p * sl + q * cl
    k4 = b * c2 - a * s2
    k5 = a * c2 + b * s2
    u = size * one
    k6 = size * w[6]
    k7 = u * (w[8] * cl - w[7] * sl)
    k8 = u * (w[7] * cl + w[8] * sl)
    k9 = arm * size * w[0]
    k10 = arm * u * (w[2] * cl - w[1] * sl)
    k11 = arm * u * (w[1] * cl + w[2] * sl)
    for m, sign in ((m0, 1.0), (m1, -1.0)):
        sums[m, 0] += sign * k0
        sums[m, 1] += sign * k1
        sums[m, 2] += sign * k2
        sums[m, 3] += sign * k3
        sums[m, 4] += sign * k4
        sums[m, 5] += sign * k5
        sums[m, 6] += sign * k6
        sums[m, 7] += sign * k7
        sums[m, 8] += sign * k8
        sums[m, 9] += sign * k9
        sums[m, 10] += sign * k10
        sums[m, 11] += sign * k11
        sums[m, 12] += sign


@njit(cache=True, nogil=True)
def sum_whole_edges(sums, table, acc):
    """Add what cuts whole at each rotation to ``acc`` (4, m): ``table`` (4, m) of x, y, X and Y."""
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = s9 = s10 = s11 = n = 0.0
    for m in range(acc.shape[1]):
        if sums[m, 12] != 0.0 or n > 0.0:
            n += sums[m, 12]
            s0 += sums[m, 0]
            s1 += sums[m, 1]
            s2 += sums[m, 2]
            s3 += sums[m, 3]
            s4 += sums[m, 4]
            s5 += sums[m, 5]
            s6 += sums[m, 6]
            s7 += sums[m, 7]
            s8 += sums[m, 8]
            s9 += sums[m, 9]
            s10 += sums[m, 10]
            s11 += sums[m, 11]
            if n == 0.0:
                # nothing is left but rounding
                s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = s9 = s10 = s11 = 0.0
                continue
            x = table[0, m]
            y = table[1, m]
            xx = table[2, m]
            yy = table[3, m]
            acc[0, m] -= s0 + s2 * x + s3 * y + s4 * xx + s5 * yy
            acc[1, m] += s1 + s2 * y - s3 * x + s4 * yy - s5 * xx
            acc[2, m] -= s6 + s7 * x + s8 * y
            acc[3, m] += s9 + s10 * x + s11 * y


@njit(cache=True, nogil=True)
def add_part(acc, m0, k0, k1, m1, at, step, back, table, first, last, p, q, w, arm, rate):
    """Add the loads of a range to ``acc`` (4, m), rows along T, n, the axis and torque, for the rotations ``m0`` to
    ``k0`` and ``k1`` to ``m1``, at which the edge is cut off at an end; they begin at ``back`` [rad] and are the
    entries ``at`` on of the table of cosines and sines.

    The edge lies at the immersions theta - last .. theta - first, of which p .. q cut; ``rate`` [rad/mm] its lag.
    """
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
def add_between_borders(acc, m0, k0, k1, m1, step, back, row, slices, k, base, p, q, run_p, run_q, c):
    """:func:`add_part` of a range whose borders p and q run along the edge, with the rates ``run_p`` and ``run_q``."""
    rate = slices[k, 6]
    for i in range(m1 - m0 - (k1 - k0)):
        m = m0 + i if i < k0 - m0 else i + m0 + k1 - k0
        theta = back + step * m
        s1, s2 = part_between(theta, base, rate, p, q, run_p, run_q, slices[k, 9], row[2], row[3])
        ds = s2 - s1
        if ds > 0.0:
            mid = theta - base - 0.5 * rate * (s1 + s2)
            along, across = chip_at_border(slices, k, row[4], row[6], run_p, run_q, 0.5 * (s1 + s2))
            t, n, a, torque = edge(mid, 0.5 * rate * ds, along, row[5], across, slices[k, 3], slices[k, 4], c)
            acc[0, m] += ds * t
            acc[1, m] += ds * n
            acc[2, m] += ds * a
            acc[3, m] += ds * slices[k, 1] * torque


@njit(cache=True, nogil=True)
def same(i, j, start, rows, tooth, piece, slices, frame, left):
    """Whether entries i and j have the same engagement, as the steps along a straight row have."""
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
        for d in range(7, slices.shape[1]):
            if abs(slices[piece[r], d] - slices[piece[q], d]) > SAME:
                return False
    return True


@njit(cache=True, nogil=True)
def thickest(p, q, along, across):
    """Greatest along sin(phi) + across cos(phi) of the immersion p .. q."""
    cp = math.cos(p)
    sp = math.sin(p)
    cq = math.cos(q)
    sq = math.sin(q)
    # it rises at p and falls at q: over less than half a turn the peak lies between them
    peak = along * cp >= across * sp and along * cq <= across * sq
    if q - p >= 0.5 * TAU:
        top = math.atan2(along, across)
        peak = top + TAU * math.ceil((p - top) / TAU) <= q
    return math.hypot(along, across) if peak else max(along * sp + across * cp, along * sq + across * cq)


@njit(cache=True, nogil=True)
def greatest(acc, frame, left, i, out):
    """Fill the greatest and least loads of ``out[i]``, as of :func:`over_turn`, from those at each rotation; ``acc`` is
    overwritten.
    """
    out[i, :] = 0.0
    out[i, 3:6] = -math.inf
    out[i, 6:9] = math.inf
    out[i, 11] = -math.inf
    for m in range(acc.shape[1]):
        size2 = 0.0
        away = 0.0
        for d in range(3):
            f = acc[0, m] * frame[i, 0, d] + acc[1, m] * frame[i, 1, d] + acc[2, m] * frame[i, 2, d]
            out[i, 3 + d] = max(out[i, 3 + d], f)
            out[i, 6 + d] = min(out[i, 6 + d], f)
            size2 += f * f
            away -= f * left[i, d]
        acc[0, m] = size2
        out[i, 9] = max(out[i, 9], size2)
        out[i, 11] = max(out[i, 11], acc[3, m])
        out[i, 14] = max(out[i, 14], away)
    for m in range(acc.shape[1] - 1, -1, -1):
        # the first of those that are alike
        if acc[0, m] >= (1.0 - 2.0 * ALIKE) * out[i, 9]:
            out[i, 15] = m
        if acc[3, m] >= out[i, 11] - ALIKE * abs(out[i, 11]):
            out[i, 16] = m
    out[i, 9] = math.sqrt(out[i, 9])


@njit(
    types.void(
        _RI, _RF[1], _RI, _RI, _RF[1], _RF[1], _RF[2], types.int64, types.int64, types.boolean, _RF[0], _RF[1], _F2
    ),
    cache=True,
    nogil=True,
)
def over_turn(start, rows, tooth, piece, slices, table, frame, teeth, count, alike, c, left, out):
    """Loads of each entry over a period of ``count`` rotations, the pitch where all teeth are ``alike``.

    ``table`` (2, .): cosines and sines of the rotations of a revolution.
    ``out`` (n, 17): mean, greatest and least x, y, z of the force in the frame of the work, its greatest size, mean and
    greatest torque [N mm], 0, thickest chip, greatest force against ``left``, numbers of the rotations at which force
    and torque are greatest. The means are left to the caller.
    """
    acc = np.empty((4, count))
    sums = np.empty((count + 1, 13))
    w = np.empty(9)
    turned = np.empty((4, count))
    for m in range(count):
        x = table[0, m]
        y = table[1, m]
        turned[0, m] = x
        turned[1, m] = y
        turned[2, m] = x * x - y * y
        turned[3, m] = 2.0 * x * y
    # where all teeth are alike each is the one before a pitch later, and a period of the pitch takes all in
    parts = teeth if alike else 1
    step = TAU / parts / count
    # typed: a literal would compile what it is passed to twice
    known: Any = np.int64(-1)
    for i in range(len(start) - 1):
        if known >= 0 and same(i, known, start, rows, tooth, piece, slices, frame, left):
            out[i] = out[known]
            continue
        known = i
        acc[:] = 0.0
        sums[:] = 0.0
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
            chip = max(chip, thickest(p, q, along, across) + offset)
            run_p = run_of(slices, k, p)
            run_q = run_of(slices, k, q)
            runs = run_p != 0.0 or run_q != 0.0
            one = tooth[r] >= 0
            for j in range(1 if one or alike else teeth):
                lag = slices[k, 5] + rate * (rows[r, 2] - slices[k, 0])
                lag += TAU * (tooth[r] if one else j) / teeth
                last = lag + rate * size
                from_lag = lag
                to_lag = last
                straight = last - lag < STRAIGHT
                mid = 0.5 * (lag + last)
                half = 0.5 * (last - lag)
                even = 1.0
                twice = 1.0
                if straight:
                    lag = mid
                    last = mid
                else:
                    even = math.sin(half) / half
                    twice = even * math.cos(half)
                cm = math.cos(mid)
                sm = math.sin(mid)
                # rotations at which the first and the last of the edge begins and ends to cut
                begin = p + lag
                all_in = p + last
                first_out = q + lag
                end = q + last
                if runs:
                    low = run_p * (rows[r, 2] - slices[k, 9])
                    high = run_p * (rows[r, 3] - slices[k, 9])
                    begin = min(p + from_lag + low, p + to_lag + high)
                    all_in = max(p + from_lag + low, p + to_lag + high)
                    low = run_q * (rows[r, 2] - slices[k, 9])
                    high = run_q * (rows[r, 3] - slices[k, 9])
                    first_out = min(q + from_lag + low, q + to_lag + high)
                    end = max(q + from_lag + low, q + to_lag + high)
                whole = straight and not runs
                m0 = math.ceil(begin / step)
                m1 = math.ceil(end / step)
                while m0 < m1:
                    turn = m0 // count
                    m2 = min(m1, (turn + 1) * count)
                    back = step * turn * count
                    at = (turn % parts) * count
                    a0 = m0 - turn * count
                    a1 = m2 - turn * count
                    # rotations at which all of it cuts
                    k0 = a0 if whole else min(max(math.ceil((all_in - back) / step), a0), a1)
                    k1 = a1 if whole else max(min(math.floor((first_out - back) / step) + 1, a1), k0)
                    if k1 > k0:
                        ca = table[0, at]
                        sa = table[1, at]
                        add_whole(
                            sums, k0, k1, cm * ca + sm * sa, sm * ca - cm * sa, even, twice, w, size, slices[k, 1]
                        )  # fmt: skip
                    if runs and k1 - k0 < a1 - a0:
                        add_between_borders(
                            acc, a0, k0, k1, a1, step, back, rows[r], slices, k, from_lag - rate * rows[r, 2], p, q,
                            run_p, run_q, c,
                        )  # fmt: skip
                    elif k1 - k0 < a1 - a0:
                        add_part(acc, a0, k0, k1, a1, at, step, back, table, lag, last, p, q, w, slices[k, 1], rate)
                    m0 = m2
        sum_whole_edges(sums, turned, acc)
        greatest(acc, frame, left, i, out)
        out[i, 13] = chip
