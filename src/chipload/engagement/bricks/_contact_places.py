"""Compiled search for the places of a profile in contact, of a leaning or turning cutter; arrays and scalars.

Notation: as in :mod:`chipload.engagement.bricks._contact`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.cutter.record import BY_LESS_RHO, BY_RHO, BY_Z
from chipload.engagement.bricks._circle import intervals
from chipload.engagement.bricks._index import BY, MANY, SIDE, UNTOUCHED
from chipload.engagement.bricks._sweep import from_profile
from chipload.engagement.moves._circle import ALONG, APART

PI = math.pi
TAU = 2.0 * PI
#: greatest distance of samples of a circle in bricks; it is smaller if a corner has more slices than the second number
BRICKS, SLICES = 2.5, 12.0
#: number of circles of a part that are tested first, and of halvings at a place where the contact changes
LOOKS, HALVINGS = 8, 7
#: a difference of the angles in contact of neighbouring circles above this [rad] may be a jump; it is one if a half of
#: the interval has this share of it
LEAP, SHARE = 0.25, 0.6
#: greatest difference of the angles of constant contact [rad]
ALIKE = 1e-3
#: columns of ``at``: tip, T, N, A, W, u
TIP, ALONG_T, ALONG_N, AXIS, RATE, WAY = 0, 3, 6, 9, 12, 15


@njit(cache=True, nogil=True)
def reach(at, c, index, slack, ranges):
    """Range of each piece of the profile that may be in material where the cutter is, or no farther away than ``slack``
    [mm]: rows (from, to) of its parameter.
    """
    grid, shape, blocks, bricks = index[0], index[1], index[2], index[3]
    ranges[:, 0] = math.inf
    ranges[:, 1] = -math.inf
    r = 0.5 * math.sqrt(grid[3] * grid[3] + grid[4] * grid[4] + grid[5] * grid[5])
    far = SIDE * r + slack
    r += slack
    first = np.empty(3, np.int64)
    last = np.empty(3, np.int64)
    for d in range(3):
        a = at[AXIS + d]
        across = c.wide * math.sqrt(max(1.0 - a * a, 0.0)) + slack + 1e-6
        low = at[TIP + d] + min(c.height * a, 0.0) - across
        high = at[TIP + d] + max(c.height * a, 0.0) + across
        first[d] = max(0, math.floor((low - grid[d]) / grid[3 + d]))
        last[d] = min(shape[d] - 1, math.floor((high - grid[d]) / grid[3 + d]))
        if first[d] > last[d]:
            return
    end = c.count - 1
    flank = c.by[end] == BY_Z
    levels = index[13]
    mesh = len(index[16]) > 0
    for bi in range(first[0] >> 3, (last[0] >> 3) + 1):
        for bj in range(first[1] >> 3, (last[1] >> 3) + 1):
            for bk in range(first[2] >> 3, (last[2] >> 3) + 1):
                block = int(blocks[(bi * shape[4] + bj) * shape[5] + bk])
                if block <= BY or (block >= 0 and index[5][block] == 0):
                    continue
                x = grid[0] + SIDE * (bi + 0.5) * grid[3] - at[TIP]
                y = grid[1] + SIDE * (bj + 0.5) * grid[4] - at[TIP + 1]
                z = grid[2] + SIDE * (bk + 0.5) * grid[5] - at[TIP + 2]
                w = x * at[AXIS] + y * at[AXIS + 1] + z * at[AXIS + 2]
                f, _, _ = from_profile(c, math.sqrt(max(x * x + y * y + z * z - w * w, 0.0)), w)
                if abs(f) >= far:
                    continue
                for i in range(max(SIDE * bi, first[0]), min(SIDE * bi + SIDE, last[0] + 1)):
                    x = grid[0] + (i + 0.5) * grid[3] - at[TIP]
                    for j in range(max(SIDE * bj, first[1]), min(SIDE * bj + SIDE, last[1] + 1)):
                        y = grid[1] + (j + 0.5) * grid[4] - at[TIP + 1]
                        row = block * MANY + ((i & 7) << 6) + ((j & 7) << 3)
                        for k in range(max(SIDE * bk, first[2]), min(SIDE * bk + SIDE, last[2] + 1)):
                            if block != UNTOUCHED and bricks[row + (k & 7), 1] < 0:
                                continue
                            if mesh and grid[2] + k * grid[5] >= levels[i * shape[1] + j, 1]:
                                continue
                            z = grid[2] + (k + 0.5) * grid[5] - at[TIP + 2]
                            w = x * at[AXIS] + y * at[AXIS + 1] + z * at[AXIS + 2]
                            if flank and w - r > c.z[end] and ranges[end, 0] <= w - r and w + r <= ranges[end, 1]:
                                continue
                            rho = math.sqrt(max(x * x + y * y + z * z - w * w, 0.0))
                            widen_ranges(c, rho, w, r, ranges)


@njit(cache=True, nogil=True)
def widen_ranges(c, rho, w, r, ranges):
    """Widen the ranges by what of the profile is within r of a point."""
    for i in range(c.count):
        if c.line[i] > 0:
            if abs((rho - c.rho_to[i]) * c.sin[i] - (w - c.z_to[i]) * c.cos[i]) < r:
                q = w if c.by[i] == BY_Z else (rho if c.by[i] == BY_RHO else -rho)
                if q + r <= c.q[i] or q - r >= c.q_to[i]:
                    continue
                ranges[i, 0] = min(ranges[i, 0], q - r)
                ranges[i, 1] = max(ranges[i, 1], q + r)
        elif c.radius[i] > 0.0:
            vr = rho - c.e[i]
            vw = w - c.f[i]
            size = math.sqrt(vr * vr + vw * vw)
            if abs(size - c.radius[i]) < r:
                wide = math.asin(r / size) if size > r else TAU
                kappa = math.atan2(vr, -vw) if size > 0.0 else 0.0
                ranges[i, 0] = min(ranges[i, 0], kappa - wide)
                ranges[i, 1] = max(ranges[i, 1], kappa + wide)


@njit(cache=True, nogil=True)
def place_of(c, part, s, to):
    """rho, w, sine and cosine of kappa and the length along the profile at a place of a part: ``to`` (5,)."""
    if c.line[part] == 0:
        to[2] = math.sin(s)
        to[3] = math.cos(s)
        to[0] = c.e[part] + c.radius[part] * to[2]
        to[1] = c.f[part] - c.radius[part] * to[3]
        to[4] = c.s[part] + c.radius[part] * (s - c.kappa[part])
        return
    to[2] = c.sin[part]
    to[3] = c.cos[part]
    if c.by[part] == BY_Z:
        to[0] = c.rho[part] + (s - c.z[part]) * c.run[part]
        to[1] = s
        to[4] = c.s[part] + (s - c.z[part]) / c.sin[part]
    else:
        to[0] = -s if c.by[part] == BY_LESS_RHO else s
        to[1] = c.z[part] + (to[0] - c.rho[part]) * c.rise[part]
        to[4] = c.s[part] + abs(to[0] - c.rho[part]) * math.hypot(1.0, c.rise[part])


@njit(cache=True, nogil=True)
def contact(at, c, part, s, index, wait, to, ring, front, spans):
    """Parts in material of the circle at a place of the profile: their number, rows of ``spans`` from the circle's own
    direction; ``front``: along and across of the motion (with T and N), rise, end of the front, own direction, its
    cosine and sine, sum of the spans.
    """
    place_of(c, part, s, to)
    rho = max(to[0], 1e-9)
    w = to[1]
    sk = to[2]
    ck = to[3]
    along = 0.0
    across = 0.0
    rise = 0.0
    whole = 0.0
    for d in range(3):
        v = sk * (at[WAY + d] + w * at[RATE + d]) + ck * rho * at[RATE + d]
        along += v * at[ALONG_T + d]
        across += v * at[ALONG_N + d]
        rise += ck * at[WAY + d] * at[AXIS + d]
        whole += abs(at[WAY + d]) + (abs(w) + rho) * abs(at[RATE + d])
    side = math.sqrt(along * along + across * across)
    front[0] = along
    front[1] = across
    front[2] = rise
    front[7] = 0.0
    if side <= rise + ALONG * whole:
        return 0
    end = PI if rise <= -side else math.acos(rise / side)
    cosine = 1.0
    sine = 0.0
    if side > ALONG * whole:
        cosine = along / side
        sine = across / side
    front[3] = end
    front[4] = math.atan2(sine, cosine)
    front[5] = cosine
    front[6] = sine
    for d in range(3):
        ring[d] = at[TIP + d] + w * at[AXIS + d]
        ring[3 + d] = rho * (cosine * at[ALONG_T + d] + sine * at[ALONG_N + d])
        ring[6 + d] = rho * (cosine * at[ALONG_N + d] - sine * at[ALONG_T + d])
    grid = index[0]
    apart = min(BRICKS * min(grid[3], min(grid[4], grid[5])) / rho, APART) * front[8]
    found = intervals(ring, end, apart, index, wait, spans)
    for i in range(found):
        front[7] += spans[i, 1] - spans[i, 0]
    return found


@njit(cache=True, nogil=True)
def apart_at(at, c, part, a, b, na, nb, ea, eb, guess, index, wait, to, ring, front, spans):
    """Whether the contact jumps between two places of the profile with na, nb spans and the angles ea, eb in contact,
    and where: the number of spans is another, or the angle; then the spans and angles on both sides of it. A ``guess``
    between them is asked for first, just beside it.
    """
    near = (b - a) / 2.0**HALVINGS
    half = 0
    before = a < guess - 0.5 * near
    after = guess + 0.5 * near < b
    while b - a > 1.001 * near:
        s = 0.5 * (a + b)
        if before and a < guess - 0.5 * near < b:
            s = guess - 0.5 * near
        elif after and a < guess + 0.5 * near < b:
            s = guess + 0.5 * near
            after = False
        before = False
        n = contact(at, c, part, s, index, wait, to, ring, front, spans)
        e = front[7]
        change = abs(eb - ea)
        one = abs(e - ea)
        if na != nb:
            left = n != na
        else:
            if half > 0 and n == na and max(one, abs(eb - e)) < SHARE * change:
                return False, 0.0, na, ea, nb, eb
            left = n != na or one > abs(eb - e)
        if left:
            b = s
            nb = n
            eb = e
        else:
            a = s
            na = n
            ea = e
        half += 1
    return True, 0.5 * (a + b), na, ea, nb, eb


@njit(cache=True, nogil=True)
def places(at, c, part, a, b, looks, known, index, wait, to, ring, front, spans, out):
    """Ranges of a part of the profile that are distinguished by where the contact jumps: rows of ``out`` (to, spans and
    angle in contact just before it, spans and angle just after it, by how much the angle differs within); their number.
    Ranges beyond the room of ``out`` are as one. In the first ``known`` rows of ``out`` are those of another instant.
    """
    count = 0
    borders = max(known - 1, 0)
    for k in range(borders):
        out[k, 6] = out[k, 0]
    inset = 1e-6 * (b - a)
    s0 = a
    n0 = np.int64(0)
    e0 = 0.0
    low = math.inf
    high = 0.0
    for i in range(looks + 1):
        s = min(max(a + (b - a) * i / looks, a + inset), b - inset)
        n = contact(at, c, part, s, index, wait, to, ring, front, spans)
        e = front[7]
        if i > 0 and (n != n0 or abs(e - e0) > LEAP) and count < len(out) - 1:
            guess = math.inf
            for k in range(borders):
                if s0 < out[k, 6] < s:
                    guess = out[k, 6]
            jumps, border, na, ea, nb, eb = apart_at(
                at, c, part, s0, s, n0, n, e0, e, guess, index, wait, to, ring, front, spans
            )
            if jumps:
                # the angle beside the border counts: it may change only there
                low = min(low, ea)
                high = max(high, ea)
                out[count, 0] = border
                out[count, 1] = na
                out[count, 2] = ea
                out[count, 3] = nb
                out[count, 4] = eb
                out[count, 5] = high - low
                count += 1
                low = eb
                high = eb
        low = min(low, e)
        high = max(high, e)
        s0 = s
        n0 = n
        e0 = e
    out[count, 0] = b
    out[count, 1] = n0
    out[count, 2] = e0
    out[count, 3] = 0.0
    out[count, 4] = 0.0
    out[count, 5] = high - low
    return count + 1
