"""Compiled loops of the force; arrays and scalars only.

Notation as in :mod:`chipload.engagement.tooth_engagement` and :mod:`chipload.cutting.force`: theta [rad] rotation of
tooth 0 at the tip, c = (Ktc, Krc, Kac, Kte, Kre, Kae, m_t, m_r, m_a), a row of an engagement range = (phi from, phi to,
s from, s to, along, offset, across), a slice = (s from, rho, z, sin(kappa), cos(kappa), lag, rate of the lag),
``piece`` the slice of each row.
Oracles: slice summation and quadrature in tests/cutting.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

PI = math.pi
TAU = 2.0 * math.pi
#: distance from a break at which the smooth piece next to it is sampled [rad]
BESIDE = 1e-9
GOLDEN = 0.6180339887498949
REFINEMENTS = 14
#: half an angle below which its sine over it is 1 [rad]
FLAT = 1e-8
#: Gauss-Legendre on [-1, 1], twelve points
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


@njit(cache=True, nogil=True)
def thickness_power(h, m):
    """h^(1 - m) for h [mm], the thickness that a law with exponent m counts; 0 where h is not above 0."""
    if m == 0.0:
        return h
    return h ** (1.0 - m) if h > 0.0 else 0.0


@njit(cache=True, nogil=True)
def powers(first, last, along, offset, across, c, out):
    """Means over the immersion from ``first`` to ``last`` of h^(1 - m) times 1, sin and cos: out (3, 3), a row a
    direction. Between peak and trough of h the variable is w, phi = zero +- w^3, so that the root of h at its zero,
    or near it, is smooth in w; twelve points of Gauss, right to 1e-7 of the thickest chip's, or better.
    """
    out[:] = 0.0
    swing = math.hypot(along, across)
    peak = math.atan2(along, across)
    reach = math.acos(-offset / swing) if swing > abs(offset) else PI
    k = math.floor((first - peak) / PI)
    low = first
    while low < last:
        high = min(last, peak + (k + 1) * PI)
        if high > low:
            falling = k % 2 == 0
            zero = peak + k * PI + reach if falling else peak + (k + 1) * PI - reach
            u = np.cbrt(max(zero - high, 0.0) if falling else max(low - zero, 0.0))
            v = np.cbrt(max(zero - low, 0.0) if falling else max(high - zero, 0.0))
            for g in range(len(NODES)):
                w = 0.5 * (u + v) + 0.5 * (v - u) * NODES[g]
                weight = 1.5 * (v - u) * w * w * WEIGHTS[g]
                phi = zero - w**3 if falling else zero + w**3
                si = math.sin(phi)
                co = math.cos(phi)
                h = along * si + across * co + offset
                for d in range(3):
                    value = weight * thickness_power(h, c[6 + d])
                    out[d, 0] += value
                    out[d, 1] += value * si
                    out[d, 2] += value * co
        low = high
        k += 1
    out /= last - first


@njit(cache=True, nogil=True)
def edge(mid, half, along, offset, across, sine, cosine, c):
    """Mean load of a mm of edge over the immersion mid - half .. mid + half [N/mm]: along T, n and the axis, and the
    tangential force. The radial force acts along nu, the axial one along cos(kappa) u + sin(kappa) A.
    """
    sinc1 = 1.0
    sinc2 = 1.0
    if half > FLAT:
        sh = math.sin(half)
        sinc1 = sh / half
        sinc2 = sinc1 * math.cos(half)
    sm = math.sin(mid)
    cm = math.cos(mid)
    si = sm * sinc1
    co = cm * sinc1
    if c[6] == 0.0 and c[7] == 0.0 and c[8] == 0.0:
        sc = sm * cm * sinc2
        ss = 0.5 * (1.0 - (1.0 - 2.0 * sm * sm) * sinc2)
        cc = 1.0 - ss
        kr = sine * c[1] + cosine * c[2]
        ka = sine * c[2] - cosine * c[1]
        at = c[0] * offset + c[3]
        bt = c[0] * along
        ct = c[0] * across
        ar = kr * offset + sine * c[4] + cosine * c[5]
        br = kr * along
        cr = kr * across
        t = at * co + bt * sc + ct * cc + ar * si + br * ss + cr * sc
        n = at * si + bt * ss + ct * sc - ar * co - br * sc - cr * cc
        a = ka * offset + sine * c[5] - cosine * c[4] + ka * (along * si + across * co)
        return -t, n, -a, at + bt * si + ct * co
    j = np.empty((3, 3))
    if half > FLAT:
        powers(mid - half, mid + half, along, offset, across, c, j)
    else:
        h = along * sm + across * cm + offset
        for d in range(3):
            j[d, 0] = thickness_power(h, c[6 + d])
            j[d, 1] = j[d, 0] * sm
            j[d, 2] = j[d, 0] * cm
    for d in range(3):
        j[d, 0] = c[d] * j[d, 0] + c[3 + d]
        j[d, 1] = c[d] * j[d, 1] + c[3 + d] * si
        j[d, 2] = c[d] * j[d, 2] + c[3 + d] * co
    t = j[0, 2] + sine * j[1, 1] + cosine * j[2, 1]
    n = j[0, 1] - sine * j[1, 2] - cosine * j[2, 2]
    return -t, n, cosine * j[1, 0] - sine * j[2, 0], j[0, 0]


@njit(cache=True, nogil=True)
def first_turn(theta, j, teeth, p, first):
    """Least theta - 2 pi j / teeth + 2 pi i at which the edge of tooth j, lagging by ``first`` [rad], has reached p."""
    turn = theta - TAU * j / teeth
    turn -= TAU * math.floor(turn / TAU)
    if turn - first < p:
        turn += TAU * math.ceil((p + first - turn) / TAU)
    return turn


@njit(cache=True, nogil=True)
def engaged_part(turn, base, rate, p, q, s1, s2):
    """Part of the edge s1 .. s2 [mm], lagging by base + rate s, that is between p and q at ``turn``; none: s1 .. s1."""
    if rate > 0.0:
        return max(s1, (turn - base - q) / rate), min(s2, (turn - base - p) / rate)
    if turn - base >= q:
        return s1, s1
    return s1, s2


@njit(cache=True, nogil=True)
def run_of(slices, k, phi):
    """Rate [rad/mm] at which a border at ``phi`` runs along slice k."""
    if slices.shape[1] < 13 or slices[k, 11] <= 0.0:
        return 0.0
    d = phi - slices[k, 10]
    d -= TAU * math.floor((d + 0.5) / TAU)
    return slices[k, 7] + min(max(d / slices[k, 11], 0.0), 1.0) * (slices[k, 8] - slices[k, 7])


@njit(cache=True, nogil=True)
def part_between(turn, base, rate, p, q, run_p, run_q, middle, s1, s2):
    """Part of the edge s1 .. s2 [mm], lagging by base + rate s, between borders that run: they are p and q at s =
    ``middle``; none: the second is not above the first.
    """
    # not before it has passed p
    slope = rate + run_p
    rest = turn - base - p + run_p * middle
    if slope > FLAT:
        s2 = min(s2, rest / slope)
    elif slope < -FLAT:
        s1 = max(s1, rest / slope)
    elif rest < 0.0:
        return s1, s1
    slope = rate + run_q
    rest = turn - base - q + run_q * middle
    if slope > FLAT:
        s1 = max(s1, rest / slope)
    elif slope < -FLAT:
        s2 = min(s2, rest / slope)
    elif rest > 0.0:
        return s1, s1
    return s1, s2


@njit(cache=True, nogil=True)
def chip_at_border(slices, k, along, across, run_p, run_q, s):
    """Chip (along, across) at ``s`` of slice k: one that runs out along a wall runs with the border."""
    if slices[k, 12] == 0.0:
        return along, across
    turned = 0.5 * (run_p + run_q) * (s - slices[k, 9])
    si = math.sin(turned)
    co = math.cos(turned)
    return along * co + across * si, across * co - along * si


@njit(cache=True, nogil=True)
def load(theta, rows, tooth, piece, slices, lo, hi, teeth, c):
    """Force on the cutter along T, n and the axis [N] and torque [N mm] at one rotation, in closed form where the law
    is linear.
    """
    ft = 0.0
    fn = 0.0
    fa = 0.0
    mt = 0.0
    for r in range(lo, hi):
        p = rows[r, 0]
        q = rows[r, 1]
        sa = rows[r, 2]
        sb = rows[r, 3]
        k = piece[r]
        rate = slices[k, 6]
        base = slices[k, 5] - rate * slices[k, 0]
        first = base + rate * sa
        last = base + rate * sb
        run_p = run_of(slices, k, p)
        run_q = run_of(slices, k, q)
        runs = run_p != 0.0 or run_q != 0.0
        middle = slices[k, 9] if runs else sa
        begin = min(first + run_p * (sa - middle), last + run_p * (sb - middle))
        end = q + max(first + run_q * (sa - middle), last + run_q * (sb - middle))
        one = tooth[r] >= 0
        for i in range(1 if one else teeth):
            j = tooth[r] if one else i
            turn = first_turn(theta, j, teeth, p, begin)
            while turn - TAU >= p + begin:
                turn -= TAU
            while turn <= end:
                along = rows[r, 4]
                across = rows[r, 6]
                if runs:
                    s1, s2 = part_between(turn, base, rate, p, q, run_p, run_q, middle, sa, sb)
                    along, across = chip_at_border(slices, k, along, across, run_p, run_q, 0.5 * (s1 + s2))
                else:
                    s1, s2 = engaged_part(turn, base, rate, p, q, sa, sb)
                ds = s2 - s1
                if ds > 0.0:
                    mid = turn - base - 0.5 * rate * (s1 + s2)
                    half = 0.5 * rate * ds
                    t, n, a, m = edge(mid, half, along, rows[r, 5], across, slices[k, 3], slices[k, 4], c)
                    ft += ds * t
                    fn += ds * n
                    fa += ds * a
                    mt += ds * slices[k, 1] * m
                turn += TAU
    return ft, fn, fa, mt


@njit(cache=True, nogil=True)
def turn_of(start, rows, tooth, piece, slices, theta, teeth, c, out):
    """Loads of every step at every rotation: out (n, m, 4)."""
    for i in range(len(start) - 1):
        for k in range(len(theta)):
            ft, fn, fa, mt = load(theta[k], rows, tooth, piece, slices, start[i], start[i + 1], teeth, c)
            out[i, k, 0] = ft
            out[i, k, 1] = fn
            out[i, k, 2] = fa
            out[i, k, 3] = mt


@njit(cache=True, nogil=True)
def bases_at(start, rows, tooth, piece, slices, theta, teeth, laws, out):
    """Loads of every step at a rotation of its own, for each of some laws: out (n, 4, laws)."""
    for i in range(len(start) - 1):
        for k in range(len(laws)):
            ft, fn, fa, mt = load(theta[i], rows, tooth, piece, slices, start[i], start[i + 1], teeth, laws[k])
            out[i, 0, k] = ft
            out[i, 1, k] = fn
            out[i, 2, k] = fa
            out[i, 3, k] = mt


@njit(cache=True, nogil=True)
def means(start, rows, tooth, piece, slices, teeth, c, out):
    """Loads averaged over a revolution (they do not depend on the lag): out (n, 4)."""
    for i in range(len(start) - 1):
        for r in range(start[i], start[i + 1]):
            k = piece[r]
            half = 0.5 * (rows[r, 1] - rows[r, 0])
            mid = rows[r, 0] + half
            part = (rows[r, 3] - rows[r, 2]) * (1.0 if tooth[r] >= 0 else teeth) * half / PI
            t, n, a, m = edge(mid, half, rows[r, 4], rows[r, 5], rows[r, 6], slices[k, 3], slices[k, 4], c)
            out[i, 0] += part * t
            out[i, 1] += part * n
            out[i, 2] += part * a
            out[i, 3] += part * slices[k, 1] * m


@njit(cache=True, nogil=True)
def size(what, theta, rows, tooth, piece, slices, lo, hi, teeth, c):
    """Quantity ``what`` at a rotation: 0 square of the in-plane resultant, 1 torque, 2 size of the axial force."""
    ft, fn, fa, mt = load(theta, rows, tooth, piece, slices, lo, hi, teeth, c)
    if what == 0:
        return ft * ft + fn * fn
    if what == 1:
        return mt
    return abs(fa)


@njit(cache=True, nogil=True)
def breaks_of(rows, tooth, piece, slices, lo, hi, teeth, period, out):
    """Rotations in [0, period) where a range begins or ends at either end of its s, into ``out``; their number."""
    count = 0
    for r in range(lo, hi):
        one = tooth[r] >= 0
        k = piece[r]
        for i in range(1 if one or period < TAU else teeth):
            j = tooth[r] if one else i
            for e in range(4):
                phi = rows[r, e // 2]
                lag = slices[k, 5] + slices[k, 6] * (rows[r, 2 + e % 2] - slices[k, 0])
                out[count] = (phi + lag + TAU * j / teeth) % period
                count += 1
    return count


@njit(cache=True, nogil=True)
def greatest(start, rows, tooth, piece, slices, teeth, c, step, exact, out):
    """Loads where they are greatest over a revolution: out (n, 5) = T and n force and rotation at the greatest in-plane
    resultant, greatest torque, axial force of greatest size.

    Between the breaks the loads are smooth: each such piece is sampled at most ``step`` apart, both ends included (as
    one-sided limits), and the best sample is refined by golden section between its neighbours. Steps of more than
    ``exact`` rows are sampled as if there were no breaks.
    """
    best = np.empty(3)
    where = np.empty(3)
    left = np.empty(3)
    right = np.empty(3)
    for i in range(len(start) - 1):
        lo = start[i]
        hi = start[i + 1]
        if lo == hi:
            continue
        period = TAU / teeth
        for r in range(lo, hi):
            if tooth[r] >= 0:
                period = TAU
        count = 1
        room = np.zeros(4 * (hi - lo) * teeth + 1 if hi - lo <= exact else 2)
        if hi - lo <= exact:
            count = breaks_of(rows, tooth, piece, slices, lo, hi, teeth, period, room)
            room[:count].sort()
        room[count] = room[0] + period
        best[:] = -1.0
        for b in range(count):
            length = room[b + 1] - room[b]
            if length < 4.0 * BESIDE:
                continue
            first = room[b] + BESIDE
            last = room[b + 1] - BESIDE
            parts = math.ceil((last - first) / step)
            h = (last - first) / parts
            for k in range(parts + 1):
                theta = first + k * h
                ft, fn, fa, mt = load(theta, rows, tooth, piece, slices, lo, hi, teeth, c)
                for what in range(3):
                    value = ft * ft + fn * fn if what == 0 else (mt if what == 1 else abs(fa))
                    if value > best[what]:
                        best[what] = value
                        where[what] = theta
                        left[what] = max(first, theta - h)
                        right[what] = min(last, theta + h)
        for what in range(3):
            a = left[what]
            d = right[what]
            x = d - GOLDEN * (d - a)
            y = a + GOLDEN * (d - a)
            vx = size(what, x, rows, tooth, piece, slices, lo, hi, teeth, c)
            vy = size(what, y, rows, tooth, piece, slices, lo, hi, teeth, c)
            for _ in range(REFINEMENTS):
                if vx > vy:
                    if vx > best[what]:
                        best[what] = vx
                        where[what] = x
                    d = y
                    y = x
                    vy = vx
                    x = d - GOLDEN * (d - a)
                    vx = size(what, x, rows, tooth, piece, slices, lo, hi, teeth, c)
                else:
                    if vy > best[what]:
                        best[what] = vy
                        where[what] = y
                    a = x
                    x = y
                    vx = vy
                    y = a + GOLDEN * (d - a)
                    vy = size(what, y, rows, tooth, piece, slices, lo, hi, teeth, c)
        ft, fn, fa, mt = load(where[0], rows, tooth, piece, slices, lo, hi, teeth, c)
        out[i, 0] = ft
        out[i, 1] = fn
        out[i, 2] = where[0] % TAU
        out[i, 3] = best[1]
        ft, fn, fa, mt = load(where[2], rows, tooth, piece, slices, lo, hi, teeth, c)
        out[i, 4] = fa
