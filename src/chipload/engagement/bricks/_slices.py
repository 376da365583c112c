"""Compiled loops that lay slices on the places of a profile in contact; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.bricks._contact`. ``known`` are the rows of
:func:`chipload.engagement.bricks._contact_places.places`, which at the next instant say where to ask first.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.cutter.record import BOTTOM_LINE, BY_Z, FLANK_LINE
from chipload.engagement.bricks._contact_places import (
    ALIKE,
    ALONG_N,
    ALONG_T,
    AXIS,
    PI,
    TAU,
    contact,
    place_of,
    places,
)


@njit(cache=True, nogil=True)
def add_slice(at, spans, found, ring, front, to, from_s, to_s, rise_w, out):
    """Add what a slice engages to ``out`` of :func:`chipload.engagement.bricks._contact.engage_profile`."""
    rho = to[0]
    sk = to[2]
    ck = to[3]
    ds = to_s - from_s
    side = math.sqrt(front[0] * front[0] + front[1] * front[1])
    end = front[3]
    # half the slice along its profile
    half = 0.5 * abs(rise_w) * abs(at[AXIS + 2]) + 0.5 * ds * ck * math.hypot(at[ALONG_T + 2], at[ALONG_N + 2])
    size = math.hypot(ring[5], ring[8])
    peak = math.atan2(ring[8], ring[5])
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
            if a < peak + TAU * k < b:
                high = ring[2] + size
            if a < peak + PI + TAU * k < b:
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


@njit(cache=True, nogil=True)
def laid(at, c, part, s0, s1, many, nodes, index, work, slices, rows, owner, row_at, out):
    """Lay slices on a range of the profile; False: no room for rows."""
    spans, to, ring, front, wait = work[0], work[1], work[2], work[3], work[6]
    most = len(nodes) - 1
    pieces = (many + most - 1) // most
    order = (many + pieces - 1) // pieces
    row = row_at[0]
    have = row_at[1]
    step = (s1 - s0) / pieces
    for i in range(pieces * order):
        first = s0 + step * (i // order)
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
        add_slice(at, spans, found, ring, front, to, from_s, to_s, to_w - from_w, out)
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
    row_at[0] = row
    row_at[1] = have
    return True


@njit(cache=True, nogil=True)
def slice_part(at, c, part, a, b, looks, flank, known, count, nodes, index, work, slices, rows, owner, row_at, out):
    """Find the ranges of a part of the profile and lay slices on those in contact: their number, below 0 where there is
    no room; ``count`` of them are known from the instant before.
    """
    most = len(nodes) - 1
    count = places(at, c, part, a, b, looks, count, index, work[6], work[1], work[2], work[3], work[0], known)
    s0 = a
    for n in range(count):
        s1 = known[n, 0]
        if known[n, 1] > 0.0 or known[n, 5] > 0.0 or (n > 0 and known[n - 1, 3] > 0.0):
            many = most
            if c.line[part] == FLANK_LINE:
                size = s1 - s0 if c.by[part] != BY_Z else (s1 - s0) / c.sin[part]
                many = math.ceil(size / flank - 1e-9)
                if known[n, 5] > ALIKE:
                    many = max(many, most // 2)
            elif c.line[part] == BOTTOM_LINE:
                many = most // 2
            elif c.radius[part] > c.wide:
                many = max(most, math.ceil((s1 - s0) * c.radius[part] / flank - 1e-9))
            if not laid(at, c, part, s0, s1, max(many, 1), nodes, index, work, slices, rows, owner, row_at, out):
                return -1
        s0 = s1
    return count
