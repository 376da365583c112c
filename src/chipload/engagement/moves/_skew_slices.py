"""Compiled loop from the contact to the tooth engagement; slices on which borders run askew are divided.

Notation: psi [rad] as in :mod:`chipload.engagement.moves._contact`, s [mm] along the profile, kappa the angle of
its normal. The contact of a slice is known at one place of it. Where the slices before and after it are in contact once
each, as it is, its borders go on to theirs: a slice of a corner is divided, and each part has the borders and the
normal of its own middle, so that the edge of a tooth leaves the material bit by bit, as it does, and not a slice at a
time. Where a border is the end of the front it is that of the part.
"""

from __future__ import annotations

import math

from numba import njit, types

from chipload.engagement.moves._sweep import CUTTERS

#: by how much a border may run over a part [rad], and most parts of a slice
SKEW, PARTS = 0.06, 3
#: ends of slices that are this near are one [mm], and a border this near to the end of the front is at it [rad]
SAME, NEAR = 1e-9, 1e-6

PI, TAU = math.pi, 2.0 * math.pi

_F1, _F2, _I1 = types.float64[::1], types.float64[:, ::1], types.int64[::1]


@njit(cache=True, nogil=True)
def alone(piece, first, last, r):
    """Whether no other row of first .. last is of the slice of row r."""
    return (r == first or piece[r - 1] != piece[r]) and (r + 1 == last or piece[r + 1] != piece[r])


@njit(cache=True, nogil=True)
def arc_of(c, s0, s1):
    """The arc of a cutter on which a slice from s0 to s1 lies; -1: none."""
    for i in range(c.count):
        end = c.s[i] + c.radius[i] * (c.kappa_to[i] - c.kappa[i])
        if c.radius[i] > 0.0 and s0 > c.s[i] - SAME and s1 < end + SAME:
            return i
    return -1


@njit(cache=True, nogil=True)
def leading_end(across, rise, sk, ck):
    """Psi at which the front ends, for a motion in the plan and along the axis."""
    side = sk * across
    lift = ck * rise
    if lift >= side:
        return 0.0
    return PI if lift <= -side else math.acos(lift / side)


@njit(cache=True, nogil=True, inline="always")
def add_row(rows, count, a, b, s0, s1, sk, ck, hand, across, rise):
    """Row of the tooth engagement: immersion is counted in the sense of the spindle, ``hand`` above 0 clockwise."""
    low = 0.5 * math.pi - (b if hand > 0.0 else -a)
    low -= TAU * math.floor(low / TAU)
    rows[count, 0] = low
    rows[count, 1] = low + min(max(b - a, 0.0), TAU)
    rows[count, 2] = s0
    rows[count, 3] = s1
    rows[count, 4] = sk * across
    rows[count, 5] = -ck * rise
    rows[count, 6] = 0.0


@njit(cache=True, nogil=True, inline="always")
def add_slice(table, k, s0, rho, z, sk, ck, lead):
    """Slice of the tooth engagement."""
    table[k, 0] = s0
    table[k, 1] = rho
    table[k, 2] = z
    table[k, 3] = sk
    table[k, 4] = ck
    # an arc on the bottom begins at 0 but for rounding
    table[k, 5] = lead * max(z, 0.0)
    table[k, 6] = lead * sk


@njit(
    types.int64(_I1, _I1, _F2, _I1, _F2, CUTTERS, types.float64, _F1, _F1, _F1, _I1, _F2, _I1, _F2),
    cache=True,
    nogil=True,
)
def tooth_rows(entries, start, span, piece, slices, cutters, lead, hand, across, rise, begin, rows, rows_of, table):
    """Rows of the tooth engagement of some entries, and the slice of each; their number.

    Parameters
    ----------
    start, span, piece, slices : of :class:`chipload.engagement.moves.stock.Engaged`, of which ``entries`` are some
    cutters, lead : (1,) the cutter, and lag of its edge [rad/mm]
    hand, across, rise : of each entry the sense of the spindle, motion a tooth in the plan and along the axis [mm]
    begin : (m + 2,) filled: row at which each entry begins, and the number of slices
    rows, rows_of, table : filled: rows and slices of :class:`chipload.engagement.tooth_engagement.ToothEngagement`;
        room for ``PARTS`` of every row; the slices of the parts follow those of ``slices``
    """
    c = cutters[0]
    for k in range(len(slices)):
        add_slice(table, k, slices[k, 0], slices[k, 2], slices[k, 3], slices[k, 4], slices[k, 5], lead)
    count = 0
    made = len(slices)
    for i in range(len(entries)):
        begin[i] = count
        first = start[entries[i]]
        last = start[entries[i] + 1]
        for r in range(first, last):
            k = piece[r]
            s0 = slices[k, 0]
            s1 = slices[k, 1]
            a = span[r, 0]
            b = span[r, 1]
            # by how much the borders run over the slice
            skew_a = 0.0
            skew_b = 0.0
            bow = arc_of(c, s0, s1)
            if bow >= 0 and alone(piece, first, last, r):
                whole = 0.0
                low = r
                high = r
                if r > first and alone(piece, first, last, r - 1) and abs(slices[piece[r - 1], 1] - s0) < SAME:
                    low = r - 1
                    whole += 0.5 * (s1 - slices[piece[low], 0])
                if r + 1 < last and alone(piece, first, last, r + 1) and abs(slices[piece[r + 1], 0] - s1) < SAME:
                    high = r + 1
                    whole += 0.5 * (slices[piece[high], 1] - s0)
                if whole > 0.0:
                    skew_a = (span[high, 0] - span[low, 0]) * (s1 - s0) / whole
                    skew_b = (span[high, 1] - span[low, 1]) * (s1 - s0) / whole
            parts = min(max(math.ceil(max(abs(skew_a), abs(skew_b)) / SKEW), 1), PARTS)
            if parts == 1:
                add_row(rows, count, a, b, s0, s1, slices[k, 4], slices[k, 5], hand[i], across[i], rise[i])
                rows_of[count] = k
                count += 1
                continue
            end = leading_end(across[i], rise[i], slices[k, 4], slices[k, 5])
            for j in range(parts):
                t0 = s0 + (s1 - s0) * j / parts
                t1 = s0 + (s1 - s0) * (j + 1) / parts if j + 1 < parts else s1
                kappa = c.kappa[bow] + (0.5 * (t0 + t1) - c.s[bow]) / c.radius[bow]
                sk = math.sin(kappa)
                ck = math.cos(kappa)
                own = leading_end(across[i], rise[i], sk, ck)
                off = (j + 0.5) / parts - 0.5
                low_psi = max(a + off * skew_a, -own) if a > NEAR - end else -own
                high_psi = min(b + off * skew_b, own) if b < end - NEAR else own
                if not high_psi > low_psi:
                    continue
                add_row(rows, count, low_psi, high_psi, t0, t1, sk, ck, hand[i], across[i], rise[i])
                rows_of[count] = made
                add_slice(
                    table, made, t0, c.e[bow] + c.radius[bow] * sk,
                    c.f[bow] - c.radius[bow] * math.cos(c.kappa[bow] + (t0 - c.s[bow]) / c.radius[bow]), sk, ck, lead,
                )  # fmt: skip
                count += 1
                made += 1
    begin[len(entries)] = count
    begin[len(entries) + 1] = made
    return count
