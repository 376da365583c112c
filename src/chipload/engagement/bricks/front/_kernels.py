"""Compiled loops of the engaged front of a cutter whose axis leans or turns; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.bricks._kernels`; at an instant T is the direction across the axis A in which
the tip goes, N = A x T, W the rate of the axis. The point p + w A + rho e of a circle with the normal
n = sin(kappa) e - cos(kappa) A moves by

    v.n = (sin(kappa) (u + w W) + cos(kappa) rho W).e - cos(kappa) u.A,

a sinusoid of its direction e, and the front is where that is above 0. The profile has three parts: the bottom (along
rho), the corner (kappa), the flank (w). On each the contact is looked at on circles that are evenly apart; where it
begins, ends or jumps the place is halved. Between these places slices lie at the weights and nodes of Gauss and
Legendre.
Oracles: the upright engine for turned programs, points in the swept volume, in tests/engagement/bricks.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.engagement.bricks._kernels import (
    A0,
    COS_A,
    COS_B,
    LENGTH,
    SIN_A,
    SIN_B,
    THETA,
    B,
    from_profile,
    turn,
)
from chipload.engagement.bricks.circle._kernels import intervals
from chipload.engagement.bricks.index._kernels import INDEX, MANY, SIDE, SWEPT, UNTOUCHED, enter
from chipload.engagement.moves._kernels import CORNER, FLUTE, RHO1, RHO2, TA, TB, WIDE, Z2, E, F
from chipload.engagement.moves.borrowed._kernels import borrowed
from chipload.engagement.moves.front._kernels import ALONG, APART, JUMP, STEADY, parts_of, turns

PI = math.pi
TAU = 2.0 * PI
BOTTOM, ARC, FLANK = 0, 1, 2
#: samples of a circle lie at most so many bricks apart, and closer where a corner is cut into more slices than this
BRICKS, SLICES = 2.5, 12.0
#: circles of a part that are looked at first, and how often a place where the contact changes is halved
LOOKS, HALVINGS = 8, 7
#: angles in contact of two circles beside each other that differ by more than this [rad] may stand for a jump, and do
#: if one half has this share of it
LEAP, SHARE = 0.25, 0.6
#: contact whose angles differ by no more than this is the same all along [rad]
ALIKE = 1e-3
#: columns of ``at``: tip, T, N, A, W, u
TIP, ALONG_T, ALONG_N, AXIS, RATE, WAY = 0, 3, 6, 9, 12, 15


@njit(cache=True, nogil=True)
def instant(m, t, height, at):
    """Where the cutter is at a time and how it moves: ``at`` (18,)."""
    cosine, sine = turn(m, t)
    for d in range(3):
        at[TIP + d] = m[d] + t * m[3 + d]
        at[AXIS + d] = m[A0 + d] * cosine + m[B + d] * sine
        at[RATE + d] = m[THETA] * (m[B + d] * cosine - m[A0 + d] * sine)
        at[WAY + d] = m[3 + d]
    size = math.sqrt(at[AXIS] ** 2 + at[AXIS + 1] ** 2 + at[AXIS + 2] ** 2)
    for d in range(3):
        at[AXIS + d] /= size
    # across the axis: the tip's way, else that of the middle of the flutes, else any
    for k in range(5):
        if k < 2:
            x = at[WAY] if k == 0 else at[WAY] + 0.5 * height * at[RATE]
            y = at[WAY + 1] if k == 0 else at[WAY + 1] + 0.5 * height * at[RATE + 1]
            z = at[WAY + 2] if k == 0 else at[WAY + 2] + 0.5 * height * at[RATE + 2]
        else:
            x = 1.0 if k == 2 else 0.0
            y = 1.0 if k == 3 else 0.0
            z = 1.0 if k == 4 else 0.0
        whole = math.sqrt(x * x + y * y + z * z)
        along = x * at[AXIS] + y * at[AXIS + 1] + z * at[AXIS + 2]
        x -= along * at[AXIS]
        y -= along * at[AXIS + 1]
        z -= along * at[AXIS + 2]
        size = math.sqrt(x * x + y * y + z * z)
        if size > 1e-9 * whole and size > 0.0:
            break
    at[ALONG_T] = x / size
    at[ALONG_T + 1] = y / size
    at[ALONG_T + 2] = z / size
    at[ALONG_N] = at[AXIS + 1] * at[ALONG_T + 2] - at[AXIS + 2] * at[ALONG_T + 1]
    at[ALONG_N + 1] = at[AXIS + 2] * at[ALONG_T] - at[AXIS] * at[ALONG_T + 2]
    at[ALONG_N + 2] = at[AXIS] * at[ALONG_T + 1] - at[AXIS + 1] * at[ALONG_T]


@njit(cache=True, nogil=True)
def reach(at, c, index, ranges):
    """Ranges of the bottom [mm], the corner [rad] and the flank [mm] that may be in material: rows (from, to)."""
    grid, shape, blocks, bricks = index[0], index[1], index[2], index[3]
    ranges[:, 0] = math.inf
    ranges[:, 1] = -math.inf
    r = 0.5 * math.sqrt(grid[3] * grid[3] + grid[4] * grid[4] + grid[5] * grid[5])
    far = SIDE * r
    first = np.empty(3, np.int64)
    last = np.empty(3, np.int64)
    for d in range(3):
        a = at[AXIS + d]
        across = c[WIDE] * math.sqrt(max(1.0 - a * a, 0.0)) + 1e-6
        low = at[TIP + d] + min(c[FLUTE] * a, 0.0) - across
        high = at[TIP + d] + max(c[FLUTE] * a, 0.0) + across
        first[d] = max(0, math.floor((low - grid[d]) / grid[3 + d]))
        last[d] = min(shape[d] - 1, math.floor((high - grid[d]) / grid[3 + d]))
        if first[d] > last[d]:
            return
    levels = index[13]
    mesh = len(index[16]) > 0
    for bi in range(first[0] >> 3, (last[0] >> 3) + 1):
        for bj in range(first[1] >> 3, (last[1] >> 3) + 1):
            for bk in range(first[2] >> 3, (last[2] >> 3) + 1):
                block = int(blocks[(bi * shape[4] + bj) * shape[5] + bk])
                if block == SWEPT:
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
                            rho = math.sqrt(max(x * x + y * y + z * z - w * w, 0.0))
                            reached(c, rho, w, r, ranges)


@njit(cache=True, nogil=True)
def reached(c, rho, w, r, ranges):
    """Widen the ranges by what of the profile is within r of a point."""
    vr = rho - c[E]
    vw = w - c[F]
    corner = c[CORNER]
    if abs(vr * c[COS_B] - vw * c[SIN_B] - corner) < r and w + r > c[Z2]:
        ranges[FLANK, 0] = min(ranges[FLANK, 0], w - r)
        ranges[FLANK, 1] = max(ranges[FLANK, 1], w + r)
    if c[RHO1] > 0.0 and abs(vr * c[SIN_A] - vw * c[COS_A] - corner) < r and rho - r < c[RHO1]:
        ranges[BOTTOM, 0] = min(ranges[BOTTOM, 0], rho - r)
        ranges[BOTTOM, 1] = max(ranges[BOTTOM, 1], rho + r)
    if corner > 0.0:
        size = math.sqrt(vr * vr + vw * vw)
        if abs(size - corner) < r:
            wide = math.asin(r / size) if size > r else TAU
            kappa = math.atan2(vr, -vw) if size > 0.0 else 0.0
            ranges[ARC, 0] = min(ranges[ARC, 0], kappa - wide)
            ranges[ARC, 1] = max(ranges[ARC, 1], kappa + wide)


@njit(cache=True, nogil=True)
def place_of(c, part, s, to):
    """rho, w, sine and cosine of kappa and the length along the profile at a place of a part: ``to`` (5,)."""
    if part == BOTTOM:
        size = math.hypot(1.0, c[TA])
        to[0] = s
        to[1] = s * c[TA]
        to[2] = c[TA] / size
        to[3] = 1.0 / size
        to[4] = (s - c[RHO1]) * size
    elif part == ARC:
        to[2] = math.sin(s)
        to[3] = math.cos(s)
        to[0] = c[E] + c[CORNER] * to[2]
        to[1] = c[F] - c[CORNER] * to[3]
        to[4] = c[CORNER] * (s - math.atan(c[TA]))
    else:
        to[0] = c[RHO2] + (s - c[Z2]) * c[TB]
        to[1] = s
        to[2] = c[COS_B]
        to[3] = c[SIN_B]
        to[4] = c[CORNER] * (0.5 * PI - math.atan(c[TB]) - math.atan(c[TA])) + (s - c[Z2]) / c[COS_B]


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
def apart_at(at, c, part, a, b, na, nb, ea, eb, index, wait, to, ring, front, spans):
    """Whether the contact jumps between two places of the profile with na, nb spans and the angles ea, eb in contact,
    and where: the number of spans is another, or the angle.
    """
    for half in range(HALVINGS):
        s = 0.5 * (a + b)
        n = contact(at, c, part, s, index, wait, to, ring, front, spans)
        e = front[7]
        change = abs(eb - ea)
        one = abs(e - ea)
        if na != nb:
            left = n != na
        else:
            if half > 0 and n == na and max(one, abs(eb - e)) < SHARE * change:
                return False, 0.0
            left = n != na or one > abs(eb - e)
        if left:
            b = s
            nb = n
            eb = e
        else:
            a = s
            na = n
            ea = e
    return True, 0.5 * (a + b)


@njit(cache=True, nogil=True)
def places(at, c, part, a, b, looks, index, wait, to, ring, front, spans, out):
    """Ranges of a part of the profile that are in contact: rows (from, to, by how much the angle in contact differs
    within) of ``out``; their number.
    """
    count = 0
    begin = a
    inset = 1e-6 * (b - a)
    s0 = a
    n0 = 0
    e0 = 0.0
    low = math.inf
    high = 0.0
    for i in range(looks + 1):
        s = min(max(a + (b - a) * i / looks, a + inset), b - inset)
        n = contact(at, c, part, s, index, wait, to, ring, front, spans)
        e = front[7]
        if i > 0 and (n != n0 or abs(e - e0) > LEAP):
            jumps, border = apart_at(at, c, part, s0, s, n0, n, e0, e, index, wait, to, ring, front, spans)
            if jumps and (n0 == 0 or count < len(out)):
                if n0 > 0:
                    out[count, 0] = begin
                    out[count, 1] = border
                    out[count, 2] = high - low
                    count += 1
                begin = border
                low = math.inf
                high = 0.0
        low = min(low, e)
        high = max(high, e)
        s0 = s
        n0 = n
        e0 = e
    if high > 0.0 and count < len(out):
        out[count, 0] = begin
        out[count, 1] = b
        out[count, 2] = high - low
        count += 1
    return count


@njit(cache=True, nogil=True)
def engaged(at, c, nodes, flank, index, work, slices, rows, owner, row_at, out):
    """What is engaged at an instant.

    Spans (psi from, to, from T) go to ``rows`` from ``row_at[0]`` on, their slices to ``slices`` from ``row_at[1]``: s
    from, s to, rho, w from, sin, cos kappa, along, across and rise of the motion. ``out``: volume of the step, pieces,
    least and greatest height, sum of the normals at ends of the front by length (x, y, z), that length, 1 where there
    is material above the flutes, length of the edge. False: no room.
    """
    spans, to, ring, front, ranges, found_at, wait = work[0], work[1], work[2], work[3], work[4], work[5], work[6]
    out[:] = 0.0
    out[2] = math.inf
    out[3] = -math.inf
    reach(at, c, index, ranges)
    # share of the angle between two samples
    front[8] = min(SLICES / (len(nodes) - 1), 1.0)
    row = row_at[0]
    have = row_at[1]
    most = len(nodes) - 1
    for part in range(3):
        a = ranges[part, 0]
        b = ranges[part, 1]
        if part == BOTTOM:
            a = max(a, 0.0)
            b = min(b, c[RHO1])
        elif part == ARC:
            a = max(a, math.atan(c[TA]))
            b = min(b, 0.5 * PI - math.atan(c[TB]))
        else:
            a = max(a, c[Z2])
            b = min(b, c[FLUTE])
        if not a < b:
            continue
        size = (b - a) / c[COS_B] if part == FLANK else (b - a)
        looks = max(LOOKS, 2 * most // 3)
        if part == FLANK:
            looks = max(looks, min(math.ceil(size / flank), 4 * looks))
        for n in range(places(at, c, part, a, b, looks, index, wait, to, ring, front, spans, found_at)):
            s0 = found_at[n, 0]
            s1 = found_at[n, 1]
            many = most
            if part == FLANK:
                many = math.ceil((s1 - s0) / c[COS_B] / flank - 1e-9)
                if found_at[n, 2] > ALIKE:
                    many = max(many, most // 2)
            elif part == BOTTOM:
                many = most // 2
            many = max(many, 1)
            pieces = (many + most - 1) // most
            order = (many + pieces - 1) // pieces
            for i in range(pieces * order):
                first = s0 + (s1 - s0) * (i // order) / pieces
                step = (s1 - s0) / pieces
                k = i % order
                place_of(c, part, first + step * nodes[order, k, 0], to)
                from_s = to[4]
                from_w = to[1]
                place_of(c, part, first + step * nodes[order, k, 1], to)
                to_s = to[4]
                to_w = to[1]
                found = contact(at, c, part, first + step * nodes[order, k, 2], index, wait, to, ring, front, spans)
                if found == 0:
                    continue
                if have == len(slices) or row + found > len(rows):
                    return False
                added(at, spans, found, ring, front, to, from_s, to_s, to_w - from_w, out)
                for j in range(found):
                    rows[row, 0] = spans[j, 0] + front[4]
                    rows[row, 1] = spans[j, 1] + front[4]
                    owner[row] = have
                    row += 1
                slices[have, 0] = from_s
                slices[have, 1] = to_s
                slices[have, 2] = to[0]
                slices[have, 3] = from_w
                slices[have, 4] = to[2]
                slices[have, 5] = to[3]
                slices[have, 6] = front[0]
                slices[have, 7] = front[1]
                slices[have, 8] = front[2]
                have += 1
    # above the flutes
    if ranges[FLANK, 1] >= c[FLUTE] and contact(at, c, FLANK, c[FLUTE], index, wait, to, ring, front, spans) > 0:
        out[8] = 1.0
    total = row - row_at[0]
    if total > 0:
        out[1] = parts_of(rows[row_at[0] :], owner, row_at[0], total, np.empty(total, np.int64))
    row_at[0] = row
    row_at[1] = have
    return True


@njit(cache=True, nogil=True)
def added(at, spans, found, ring, front, to, from_s, to_s, rise_w, out):
    """Add what a slice engages to ``out`` of :func:`engaged`."""
    rho = to[0]
    sk = to[2]
    ck = to[3]
    ds = to_s - from_s
    side = math.sqrt(front[0] * front[0] + front[1] * front[1])
    end = front[3]
    # half the slice along its profile
    half = 0.5 * abs(rise_w) * abs(at[AXIS + 2]) + 0.5 * ds * ck * math.hypot(at[ALONG_T + 2], at[ALONG_N + 2])
    size = math.hypot(ring[5], ring[8])
    crest = math.atan2(ring[8], ring[5])
    for i in range(found):
        a = spans[i, 0]
        b = spans[i, 1]
        out[0] += (side * (math.sin(b) - math.sin(a)) - front[2] * (b - a)) * rho * ds
        low = ring[2] + min(
            ring[5] * math.cos(a) + ring[8] * math.sin(a), ring[5] * math.cos(b) + ring[8] * math.sin(b)
        )
        high = ring[2] + max(
            ring[5] * math.cos(a) + ring[8] * math.sin(a), ring[5] * math.cos(b) + ring[8] * math.sin(b)
        )
        for k in range(-1, 2):
            if a < crest + TAU * k < b:
                high = ring[2] + size
            if a < crest + PI + TAU * k < b:
                low = ring[2] - size
        out[2] = min(out[2], low - half)
        out[3] = max(out[3], high + half)
        for e in (a, b):
            if end < PI and abs(abs(e) - end) < 1e-12:
                for d in range(3):
                    out[4 + d] += ds * (
                        sk * (math.cos(e) * ring[3 + d] + math.sin(e) * ring[6 + d]) / max(rho, 1e-9)
                        - ck * at[AXIS + d]
                    )
                out[7] += ds
    out[9] += ds


_F1, _F2, _F3, _I1, _I2 = (
    types.float64[::1],
    types.float64[:, ::1],
    types.float64[:, :, ::1],
    types.int64[::1],
    types.int64[:, ::1],
)
#: room for :func:`run`: spans, place, ring, front, ranges, places, intervals that wait, instant, rate so far, rows and
#: slices so far
WORK = types.Tuple((_F2, _F1, _F1, _F1, _F2, _F2, _F2, _F1, _F1, _I1))


@njit(
    types.int64(types.int64, _I1, _I1, INDEX, WORK, _F3, _F1, _F2, _F2, _I1, _I2, _F2, _I1),
    cache=True,
    nogil=True,
)
def run(begin, instants, state, index, work, nodes, flank, slices, rows, owner, entry, out, used):
    """Find what each step from ``begin`` on engages at its instants and enter it into the index.

    Parameters
    ----------
    instants : (n,) at how many times a step is looked at, the middles of so many equal parts of it; 0: not at all.
        Steps that do not cut as the one before them, or not alike all along, get more
    state : number of the move that is the first step; 1 where the engagement of step ``begin`` is known; rows, slices
        and entries so far; instants of a step that gets more, and of one that enters or leaves, of each of its parts
    index : see :mod:`chipload.engagement.bricks.index._kernels`; the moves of these steps are in it
    nodes : (N + 1, N, 3) from, to and node of so many parts of 0..1
    flank : longest slice of the flank of each cutter [mm]
    slices, rows, owner, out : see :func:`engaged`; ``out`` has 9 more columns: T, N and A
    entry : (m, 3) step, instant and first row of each instant that cuts
    used : (2,) room taken of lists, and of blocks

    Returns
    -------
    The number of steps, or the one at which room ran out: ``state[1]`` 0: of rows, 1: of lists or blocks.
    """
    # the caller keeps all of them
    index = borrowed(index)
    work = borrowed(work)
    at, rate, row_at = work[7], work[8], work[9]
    instants, state, nodes, flank = borrowed((instants, state, nodes, flank))
    slices, rows, owner = borrowed((slices, rows, owner))
    entry, out, used = borrowed((entry, out, used))
    n = len(instants)
    for k in range(begin, n):
        q = state[0] + k
        m = index[6][q]
        tool = index[7][q]
        c = index[8][tool]
        if state[1] == 0:
            count = instants[k]
            fine = False
            while count > 0:
                row_at[0] = state[2]
                row_at[1] = state[3]
                entries = state[4]
                middle = 0.0
                low = math.inf
                high = -math.inf
                way = m[LENGTH] + m[THETA] * c[FLUTE]
                ends = 1 if not fine and turns(index[6], q, state[0] + n) else 0
                for i in range(count + ends):
                    if entries == len(out):
                        return k
                    t = (i + 0.5) / count if i < count else 1.0 - 0.5 / (count * state[6])
                    instant(m, t, c[FLUTE], at)
                    before = row_at[0]
                    slices_before = row_at[1]
                    if not engaged(at, c, nodes, flank[tool], index, work, slices, rows, owner, row_at, out[entries]):
                        return k
                    now = out[entries, 0] / way
                    if i == count // 2:
                        middle = now
                    low = min(low, now)
                    high = max(high, now)
                    if out[entries, 8] > 0.0:
                        low = -math.inf
                    if i == count:
                        row_at[0] = before
                        row_at[1] = slices_before
                    elif row_at[0] > before or out[entries, 8] > 0.0:
                        for d in range(9):
                            out[entries, 10 + d] = at[ALONG_T + d]
                        entry[entries, 0] = k
                        entry[entries, 1] = i
                        entry[entries, 2] = before
                        entries += 1
                if instants[k] == 1 and not fine:
                    low = min(low, rate[0])
                    high = max(high, rate[0])
                    rate[0] = middle
                if fine or state[6] == 1 or high - low <= STEADY * high:
                    break
                fine = True
                count *= state[5] if high - low < JUMP * high else state[6]
            instants[k] = count
            if count > 0:
                state[2] = row_at[0]
                state[3] = row_at[1]
                state[4] = entries
            state[1] = 1
        if not enter(q, m, c, index, used, work[6]):
            return k
        state[1] = 0
    return n
