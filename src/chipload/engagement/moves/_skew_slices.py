"""Compiled loop from the contact to the tooth engagement; slices on which borders run askew are divided.

Notation: psi [rad] as in :mod:`chipload.engagement.moves._contact`, s [mm] along the profile, kappa the angle of
its normal. The contact of a slice is known at one place of it. Where the slices before and after it are in contact once
each, as it is, its borders go on to theirs: a slice of a corner is divided, and each part has the borders and the
normal of its own middle. Where a border is the end of the front it is that of the part.

Within a part a border goes on too, at a rate that its slice of the tooth engagement states, so that the edge of a
tooth leaves the material bit by bit, as it does, and not a part at a time.
"""

from __future__ import annotations

import math

from numba import njit, types

from chipload.engagement.moves._edge import arc_of
from chipload.engagement.moves._sweep import CUTTERS

#: by how much a border may run over a part [rad], and most parts of a slice
SKEW, PARTS = 0.12, 3
#: most that a border runs within a part [rad]
RUN = 0.5
#: ends of slices that are this near are one [mm], and a border this near to the end of the front is at it [rad]
SAME, NEAR = 1e-9, 1e-6

PI, TAU = math.pi, 2.0 * math.pi

_F1, _F2, _I1 = types.float64[::1], types.float64[:, ::1], types.int64[::1]


@njit(cache=True, nogil=True)
def alone(piece, first, last, r):
    """Whether no other row of first .. last is of the slice of row r."""
    return (r == first or piece[r - 1] != piece[r]) and (r + 1 == last or piece[r + 1] != piece[r])


@njit(cache=True, nogil=True, inline="always")
def place_of(c, bow, slices, k):
    """Place s of the circle of slice k on the arc ``bow``."""
    return c.s[bow] + c.radius[bow] * (math.atan2(slices[k, 4], slices[k, 5]) - c.kappa[bow])


@njit(cache=True, nogil=True)
def follows(c, bow, piece, slices, first, last, r):
    """Whether rows r and r + 1 are the only ones of slices of the arc ``bow`` that follow one another."""
    return (
        first <= r
        and r + 1 < last
        and alone(piece, first, last, r)
        and alone(piece, first, last, r + 1)
        and abs(slices[piece[r], 1] - slices[piece[r + 1], 0]) < SAME
        and arc_of(c, slices[piece[r], 0], slices[piece[r], 1]) == bow
        and arc_of(c, slices[piece[r + 1], 0], slices[piece[r + 1], 1]) == bow
        and abs(place_of(c, bow, slices, piece[r + 1]) - place_of(c, bow, slices, piece[r])) > SAME
    )


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
    table[k, 7:] = 0.0


@njit(cache=True, nogil=True, inline="always")
def let_borders_run(table, k, s0, s1, row, rate_a, rate_b, hand):
    """State of slice k, from s0 to s1, the rates of the borders of its only row: those of psi are ``rate_a`` and
    ``rate_b`` [rad/mm], with which immersion falls where the spindle turns clockwise.
    """
    if s1 <= s0:
        return
    most = RUN / (s1 - s0)
    table[k, 7] = min(max(-rate_b if hand > 0.0 else rate_a, -most), most)
    table[k, 8] = min(max(-rate_a if hand > 0.0 else rate_b, -most), most)
    table[k, 9] = 0.5 * (s0 + s1)
    table[k, 10] = row[0]
    table[k, 11] = row[1] - row[0]


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
            # rates of the borders at the circle of the slice, and half those of these rates: of the parabola through
            # three slices, this one in their middle where it is not the first or the last
            rate_a = rate_b = bend_a = bend_b = 0.0
            bow = arc_of(c, s0, s1)
            at = 0.5 * (s0 + s1)
            if bow >= 0:
                at = place_of(c, bow, slices, k)
                before = follows(c, bow, piece, slices, first, last, r - 1)
                after = follows(c, bow, piece, slices, first, last, r)
                other = r - 1 if before else r + 1
                third = -1
                if before and after:
                    third = r + 1
                elif after and follows(c, bow, piece, slices, first, last, r + 1):
                    third = r + 2
                elif before and follows(c, bow, piece, slices, first, last, r - 2):
                    third = r - 2
                if before or after:
                    x = place_of(c, bow, slices, piece[other]) - at
                    rate_a = (span[other, 0] - a) / x
                    rate_b = (span[other, 1] - b) / x
                if third >= 0:
                    y = place_of(c, bow, slices, piece[third]) - at
                    bend_a = ((span[third, 0] - a) / y - rate_a) / (y - x)
                    bend_b = ((span[third, 1] - b) / y - rate_b) / (y - x)
                    rate_a -= bend_a * x
                    rate_b -= bend_b * x
            most = max(
                abs(rate_a + 2.0 * bend_a * (s0 - at)), abs(rate_a + 2.0 * bend_a * (s1 - at)),
                abs(rate_b + 2.0 * bend_b * (s0 - at)), abs(rate_b + 2.0 * bend_b * (s1 - at)),
            )  # fmt: skip
            parts = min(max(math.ceil(most * (s1 - s0) / SKEW), 1), PARTS)
            if parts == 1:
                add_row(rows, count, a, b, s0, s1, slices[k, 4], slices[k, 5], hand[i], across[i], rise[i])
                if most > 0.0:
                    let_borders_run(table, k, s0, s1, rows[count], rate_a, rate_b, hand[i])
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
                off = 0.5 * (t0 + t1) - at
                low_psi = max(a + off * (rate_a + off * bend_a), -own) if a > NEAR - end else -own
                high_psi = min(b + off * (rate_b + off * bend_b), own) if b < end - NEAR else own
                if not high_psi > low_psi:
                    continue
                add_row(rows, count, low_psi, high_psi, t0, t1, sk, ck, hand[i], across[i], rise[i])
                rows_of[count] = made
                add_slice(
                    table, made, t0, c.e[bow] + c.radius[bow] * sk,
                    c.f[bow] - c.radius[bow] * math.cos(c.kappa[bow] + (t0 - c.s[bow]) / c.radius[bow]), sk, ck, lead,
                )  # fmt: skip
                let_borders_run(
                    table, made, t0, t1, rows[count], rate_a + 2.0 * off * bend_a, rate_b + 2.0 * off * bend_b, hand[i]
                )
                count += 1
                made += 1
    begin[len(entries)] = count
    begin[len(entries) + 1] = made
    return count
