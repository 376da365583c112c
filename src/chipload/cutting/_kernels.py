"""Compiled loops of force and wall error; arrays and scalars only.

Notation as in :mod:`chipload.cutting.bites` and :mod:`chipload.cutting.force`: theta [rad] rotation of tooth 0 at the
tip, lag [rad/mm] = tan(helix) / R, c = (Ktc, Krc, Kac, Kte, Kre, Kae), a bite row = (phi from, phi to, z from, z to,
slope, offset). Oracles: slice summation and quadrature in tests/cutting.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.structure._kernels import stepped

PI = math.pi
TAU = 2.0 * math.pi
#: angle beside a break, where the smooth piece is sampled [rad]
BESIDE = 1e-9
GOLDEN = 0.6180339887498949
REFINEMENTS = 14
#: Gauss-Legendre on [-1, 1], five points
NODES = np.array([-0.906179845938664, -0.5384693101056831, 0.0, 0.5384693101056831, 0.906179845938664])
WEIGHTS = np.array(
    [0.23692688505618908, 0.47862867049936647, 0.5688888888888889, 0.47862867049936647, 0.23692688505618908]
)
#: longest piece of immersion that five points integrate to rounding [rad]
PIECE = 0.6


@njit(cache=True, nogil=True)
def runout_bites(ends, feed, radii, depth, sizes, rows, tooth, fill):
    """Bites of every arc for teeth of unlike radii: the lower envelope of N lines in s = sin(phi), where positive.
    First call (fill False) counts into ``sizes``, the second fills ``rows`` and ``tooth``.
    """
    teeth = len(radii)
    at = 0
    for i in range(len(ends)):
        before = at
        for j in range(teeth):
            line = teeth
            low = 0.0
            for m in range(teeth, 0, -1):
                d = radii[j] - radii[(j - m) % teeth]
                if m == teeth:
                    d = 0.0
                if d <= low:
                    low = d
                    line = m
            s = 0.0
            while s < 1.0:
                d = radii[j] - radii[(j - line) % teeth] if line < teeth else 0.0
                end = 1.0
                after = line
                for m in range(1, line):
                    cross = (radii[j] - radii[(j - m) % teeth] - d) / (feed[i] * (line - m))
                    if cross < end:
                        end = cross
                        after = m
                slope = line * feed[i]
                first = max(s, -d / slope)
                if end > first:
                    u = math.asin(first)
                    v = math.asin(end)
                    parts = 1 if end >= 1.0 else 2
                    for part in range(parts):
                        if parts == 1:
                            p, q = u, PI - u
                        elif part == 0:
                            p, q = u, v
                        else:
                            p, q = PI - v, PI - u
                        p = max(p, ends[i, 0])
                        q = min(q, ends[i, 1])
                        if q > p:
                            if fill:
                                rows[at, 0] = p
                                rows[at, 1] = q
                                rows[at, 2] = 0.0
                                rows[at, 3] = depth
                                rows[at, 4] = slope
                                rows[at, 5] = d
                                tooth[at] = j
                            at += 1
                if after == line:
                    break
                s = max(s, end)
                line = after
        sizes[i] = at - before


@njit(cache=True, nogil=True)
def load(theta, rows, tooth, lo, hi, teeth, lag, radius, c):
    """Force on the cutter along T, n and the axis [N] and torque [N mm] at one rotation, in closed form."""
    ft = 0.0
    fn = 0.0
    fa = 0.0
    mt = 0.0
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
                    dz = z2 - z1
                    if dz > 0.0:
                        mid = turn - 0.5 * lag * (z1 + z2)
                        half = 0.5 * lag * dz
                        sinc1 = 1.0
                        sinc2 = 1.0
                        if half > 1e-8:
                            sh = math.sin(half)
                            sinc1 = sh / half
                            sinc2 = sinc1 * math.cos(half)
                        sm = math.sin(mid)
                        cm = math.cos(mid)
                        si = sm * sinc1
                        co = cm * sinc1
                        sc = sm * cm * sinc2
                        ss = 0.5 * (1.0 - (1.0 - 2.0 * sm * sm) * sinc2)
                        at = c[0] * rows[r, 5] + c[3]
                        bt = c[0] * rows[r, 4]
                        ar = c[1] * rows[r, 5] + c[4]
                        br = c[1] * rows[r, 4]
                        ft -= dz * (at * co + bt * sc + ar * si + br * ss)
                        fn += dz * (at * si + bt * ss - ar * co - br * sc)
                        fa -= dz * (c[2] * rows[r, 5] + c[5] + c[2] * rows[r, 4] * si)
                        mt += dz * radius * (at + bt * si)
                turn += TAU
    return ft, fn, fa, mt


@njit(cache=True, nogil=True)
def turn_of(start, rows, tooth, theta, teeth, lag, radius, c, out):
    """Loads of every step at every rotation: out (n, m, 4)."""
    for i in range(len(start) - 1):
        for k in range(len(theta)):
            ft, fn, fa, mt = load(theta[k], rows, tooth, start[i], start[i + 1], teeth, lag, radius, c)
            out[i, k, 0] = ft
            out[i, k, 1] = fn
            out[i, k, 2] = fa
            out[i, k, 3] = mt


@njit(cache=True, nogil=True)
def means(start, rows, tooth, teeth, radius, c, out):
    """Loads averaged over a revolution, in closed form (they do not depend on the helix): out (n, 4)."""
    for i in range(len(start) - 1):
        for r in range(start[i], start[i + 1]):
            p = rows[r, 0]
            q = rows[r, 1]
            dz = (rows[r, 3] - rows[r, 2]) * (1.0 if tooth[r] >= 0 else teeth) / TAU
            co = math.sin(q) - math.sin(p)
            si = math.cos(p) - math.cos(q)
            sc = 0.5 * (math.sin(q) ** 2 - math.sin(p) ** 2)
            ss = 0.5 * (q - p) - 0.25 * (math.sin(2.0 * q) - math.sin(2.0 * p))
            at = c[0] * rows[r, 5] + c[3]
            bt = c[0] * rows[r, 4]
            ar = c[1] * rows[r, 5] + c[4]
            br = c[1] * rows[r, 4]
            out[i, 0] -= dz * (at * co + bt * sc + ar * si + br * ss)
            out[i, 1] += dz * (at * si + bt * ss - ar * co - br * sc)
            out[i, 2] -= dz * ((c[2] * rows[r, 5] + c[5]) * (q - p) + c[2] * rows[r, 4] * si)
            out[i, 3] += dz * radius * (at * (q - p) + bt * si)


@njit(cache=True, nogil=True)
def size(what, theta, rows, tooth, lo, hi, teeth, lag, radius, c):
    """What is made greatest: 0 in-plane resultant squared, 1 torque, 2 size of the axial force."""
    ft, fn, fa, mt = load(theta, rows, tooth, lo, hi, teeth, lag, radius, c)
    if what == 0:
        return ft * ft + fn * fn
    if what == 1:
        return mt
    return abs(fa)


@njit(cache=True, nogil=True)
def breaks_of(rows, tooth, lo, hi, teeth, lag, period, out):
    """Rotations in [0, period) where a bite begins or ends at either end of its height: fills out, returns count."""
    count = 0
    for r in range(lo, hi):
        one = tooth[r] >= 0
        for k in range(1 if one or period < TAU else teeth):
            j = tooth[r] if one else k
            for e in range(4):
                phi = rows[r, e // 2]
                z = rows[r, 2 + e % 2]
                out[count] = (phi + lag * z + TAU * j / teeth) % period
                count += 1
    return count


@njit(cache=True, nogil=True)
def greatest(start, rows, tooth, teeth, lag, radius, c, step, out):
    """Loads where they are greatest over a revolution: out (n, 5) = T and n force and rotation at the greatest in-plane
    resultant, greatest torque, axial force of greatest size.

    Between the breaks the loads are smooth: each such piece is sampled at most ``step`` apart, both ends included (as
    one-sided limits), and the best sample is refined by golden section between its neighbours.
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
        room = np.empty(4 * (hi - lo) * teeth + 1)
        count = breaks_of(rows, tooth, lo, hi, teeth, lag, period, room)
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
                ft, fn, fa, mt = load(theta, rows, tooth, lo, hi, teeth, lag, radius, c)
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
            vx = size(what, x, rows, tooth, lo, hi, teeth, lag, radius, c)
            vy = size(what, y, rows, tooth, lo, hi, teeth, lag, radius, c)
            for _ in range(REFINEMENTS):
                if vx > vy:
                    if vx > best[what]:
                        best[what] = vx
                        where[what] = x
                    d = y
                    y = x
                    vy = vx
                    x = d - GOLDEN * (d - a)
                    vx = size(what, x, rows, tooth, lo, hi, teeth, lag, radius, c)
                else:
                    if vy > best[what]:
                        best[what] = vy
                        where[what] = y
                    a = x
                    x = y
                    vx = vy
                    y = a + GOLDEN * (d - a)
                    vy = size(what, y, rows, tooth, lo, hi, teeth, lag, radius, c)
        ft, fn, fa, mt = load(where[0], rows, tooth, lo, hi, teeth, lag, radius, c)
        out[i, 0] = ft
        out[i, 1] = fn
        out[i, 2] = where[0] % TAU
        out[i, 3] = best[1]
        ft, fn, fa, mt = load(where[2], rows, tooth, lo, hi, teeth, lag, radius, c)
        out[i, 4] = fa


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
                    at = c[0] * rows[r, 5] + c[3]
                    bt = c[0] * rows[r, 4]
                    ar = c[1] * rows[r, 5] + c[4]
                    br = c[1] * rows[r, 4]
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
                                f = (at + bt * s) * s - (ar + br * s) * math.cos(phi)
                                flex = stepped(zz, z, length, fluted, flex_fluted, flex_shank) + work
                                total += 0.5 * h * WEIGHTS[g] * f * flex
                turn += TAU
    return total


@njit(cache=True, nogil=True)
def wall_at(z, gen, last, lag, teeth, radii, rows, tooth, lo, hi, c, beam, work):
    """Error of the wall at height z [mm], positive where material is left. ``gen`` the immersion that makes the wall (0
    or pi), ``last`` whether it is the teeth of greatest radius alone that make it.
    """
    sign = 1.0 if gen > 1.0 else -1.0
    inside = gen - sign * BESIDE
    top = np.max(radii)
    least = math.inf
    for j in range(teeth if last else 1):
        if radii[j] < top - 1e-12:
            continue
        theta = inside + lag * z + TAU * j / teeth
        e = sign * push(theta, z, rows, tooth, lo, hi, teeth, lag, c, beam[0], beam[1], beam[2], beam[3], work)
        least = min(least, e - radii[j])
    return least


@njit(cache=True, nogil=True)
def wall_profiles(start, rows, tooth, gen, lag, teeth, radii, c, z, beam, work, made, out):
    """Wall error of every step at the heights z (p,): out (n, p); steps that make no wall stay 0."""
    last = np.max(radii) > np.min(radii)
    for i in range(len(start) - 1):
        if made[i]:
            for k in range(len(z)):
                out[i, k] = wall_at(
                    z[k], gen, last, lag, teeth, radii, rows, tooth, start[i], start[i + 1], c, beam, work
                )


@njit(cache=True, nogil=True)
def wall_worst(start, rows, tooth, gen, lag, teeth, radii, c, heights, depth, beam, work, made, out):
    """Wall error of greatest size of every step, and its height: out (n, 2). Sampled at ``heights`` equal heights and
    at those where a bite begins or ends as the generating edge passes; then refined by golden section.
    """
    last = np.max(radii) > np.min(radii)
    pitch = TAU / teeth
    for i in range(len(start) - 1):
        if not made[i]:
            continue
        lo = start[i]
        hi = start[i + 1]
        best = -1.0
        for k in range(heights):
            zk = depth * k / (heights - 1)
            e = wall_at(zk, gen, last, lag, teeth, radii, rows, tooth, lo, hi, c, beam, work)
            if abs(e) > best:
                best = abs(e)
                out[i, 0] = e
                out[i, 1] = zk
        room = np.empty(4 * (hi - lo) * teeth)
        count = breaks_of(rows, tooth, lo, hi, teeth, lag, pitch, room) if lag > 0.0 else 0
        for b in range(count):
            zk = ((room[b] - gen) % pitch) / lag
            while zk < depth:
                e = wall_at(zk, gen, last, lag, teeth, radii, rows, tooth, lo, hi, c, beam, work)
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
            ex = wall_at(x, gen, last, lag, teeth, radii, rows, tooth, lo, hi, c, beam, work)
            ey = wall_at(y, gen, last, lag, teeth, radii, rows, tooth, lo, hi, c, beam, work)
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
