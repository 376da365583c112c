"""Compiled search for the pieces of a flank between whose ends the contact is one; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.moves._contact`. The slices of the flank end at the level floors around it.
Other floors, those of ramps and of round corners, and faces of a mesh are not known beforehand. Where the contact of
two slices differs, the height between them is therefore searched at which it changes: at the end of a slice, then at
the floor of the move that swept the upper circle, then by halving.
Oracle: closed forms of flank cuts, in tests/engagement/moves.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from chipload.engagement.moves._circle import APART, intervals
from chipload.engagement.moves._edge import FLANK, add_slice
from chipload.engagement.moves._sweep import AIR, from_track, profile, what_is
from chipload.engagement.moves._uncounted_arrays import borrow_arrays

PI = math.pi
#: borders of two circles are alike within this share of the greatest range in contact, and this angle more [rad]
SHARE, ANGLE = 0.1, 1e-3
#: half the height within which a change of the contact is found, over the radius of the cutter
BESIDE = 2.5e-4
#: greatest number of heights that are searched at one instant: between two circles in contact, and between any
BETWEEN, SEARCHES = 40, 60
#: columns of a sample of the flank: height, first range and number of ranges, slice
HEIGHT, FIRST, RANGES, SLICE = range(4)
#: columns of a piece of the flank, beside those of a slice: first range, number of ranges
BEGIN, COUNT = 7, 8


@njit(cache=True, nogil=True)
def alike(spans, a, many, b, others):
    """Whether two circles with the ranges from rows a and b on are in contact at the same angles."""
    if many != others:
        return False
    wide = 0.0
    for i in range(many):
        wide = max(wide, spans[a + i, 1] - spans[a + i, 0], spans[b + i, 1] - spans[b + i, 0])
    near = SHARE * wide + ANGLE
    for i in range(many):
        if abs(spans[a + i, 0] - spans[b + i, 0]) > near or abs(spans[a + i, 1] - spans[b + i, 1]) > near:
            return False
    return True


@njit(cache=True, nogil=True)
def floor_between(p, T, rho, z, spans, a, many, b, others, index):
    """Height above the tip of the surface that a level move left below a circle at the height z, in the ranges from row
    a on that are not among those of the circle, from row b on; infinite where there is none.
    """
    # what a call passes counts again
    index = borrow_arrays(index)
    spans = borrow_arrays(spans)
    for i in range(many):
        for k in range(1, 8, 3):
            psi = spans[a + i, 0] + 0.125 * k * (spans[a + i, 1] - spans[a + i, 0])
            inside = False
            for j in range(others):
                if spans[b + j, 0] <= psi <= spans[b + j, 1]:
                    inside = True
            if inside:
                continue
            x = p[0] + rho * (math.cos(psi) * T[0] - math.sin(psi) * T[1])
            y = p[1] + rho * (math.cos(psi) * T[1] + math.sin(psi) * T[0])
            e = what_is(x, y, p[2] + z, index, AIR)
            if e >= 0 and index[6][e, 5] == 0.0:
                distance = math.sqrt(from_track(index[6][e], 0.0, 1.0, x, y))
                return index[6][e, 2] - p[2] + profile(index[8][index[7][e]], distance)
    return math.inf


@njit(cache=True, nogil=True)
def divide_flank(p, T, c, first, last, end, askew, scratch, index, spans, held):
    """Divide the slices first .. last - 1 of the flank where their contact changes; the number of pieces.

    Parameters
    ----------
    p : (3,) tip [mm]; T : (2,) unit vector of psi = 0; c : cutter
    end : of the front [rad]
    askew : whether the contact may change between the slices and the ends of the flank
    scratch : slices, see :func:`chipload.engagement.moves._edge.add_slice`
    index : see :func:`chipload.engagement.moves._sweep.what_is`
    spans : written: ranges of the circles that were tested
    held : (m, 12) written: the pieces, in the columns of a slice but for ``BEGIN`` and ``COUNT``; room for
        ``SEARCHES`` more than there are slices, and as many samples behind them
    """
    index = borrow_arrays(index)
    p, T, scratch, spans, held = borrow_arrays((p, T, scratch, spans, held))
    sk = scratch[first, 4]
    ck = scratch[first, 5]
    apart = 2.5 * min(index[0][2], index[0][3])
    # the flank is the last line of the profile
    line = c.count - 1
    along = c.s[line]
    # typed: a literal would compile what it is passed to twice
    made: Any = np.int64(0)
    used: Any = np.int64(0)
    searches = 0
    # samples that wait above the one below, the next of them last
    top = len(held)
    k = first
    low = scratch[first, 3]
    high = 2.0 * scratch[last - 1, 6] - scratch[last - 1, 3]
    # near the ends of the flank, within it where it is thinner
    near = min(BESIDE * c.wide, 0.25 * (high - low))
    ask = low + near if askew else math.inf
    at_top = askew
    below = -1.0
    begin: Any = np.int64(0)
    many: Any = np.int64(0)
    own = first
    middle = False
    while True:
        if ask < math.inf or top == len(held):
            # a sample more
            if ask < math.inf:
                z = ask
                at = own
                if own + 1 < last and z >= scratch[own + 1, 3]:
                    at = own + 1
                searches += 1
            elif k < last:
                z = scratch[k, 6]
                at = k
                k += 1
            elif at_top:
                z = high - near
                at = last - 1
                at_top = False
            else:
                break
            rho = c.rho[line] + (z - c.z[line]) * c.run[line]
            a = max(scratch[at, 9], -end)
            b = min(scratch[at, 10], end)
            found = 0
            if a < b:
                found = intervals(p, T, rho, p[2] + z, a, b, end, min(apart / rho, APART), index, spans, used)
            top -= 1
            held[top, HEIGHT] = z
            held[top, FIRST] = used
            held[top, RANGES] = found
            held[top, SLICE] = at
            used += found
            ask = math.inf
        z = held[top, HEIGHT]
        start = int(held[top, FIRST])
        found = int(held[top, RANGES])
        at = int(held[top, SLICE])
        border = math.inf
        if below < 0.0:
            pass
        elif alike(spans, begin, many, start, found):
            if at == own:
                # the sample in the middle of a slice stands for all of the piece
                below = z
                if not middle and z == scratch[at, 6]:
                    begin = start
                    middle = True
                top += 1
                continue
            border = scratch[at, 3]
        elif z - below <= 2.1 * near or searches >= (BETWEEN if found > 0 and many > 0 else SEARCHES):
            border = 0.5 * (below + z)
            if at != own and not z - below <= 2.1 * near:
                border = scratch[at, 3]
        else:
            guess = math.inf
            if at != own and scratch[at, FLANK] > 0.0:
                guess = scratch[at, 3]
            else:
                rho = c.rho[line] + (z - c.z[line]) * c.run[line]
                guess = floor_between(p, T, rho, z, spans, begin, many, start, found, index)
            if below + 0.1 * near < guess - near < z:
                ask = guess - near
            elif below < guess + near < z - 0.1 * near:
                ask = guess + near
            else:
                ask = 0.5 * (below + z)
            continue
        if below >= 0.0:
            made = add_part(c, along, sk, ck, low, border, begin, many, made, held)
            low = border
        below = z
        begin = start
        many = found
        own = at
        middle = z == scratch[at, 6]
        top += 1
    return add_part(c, along, sk, ck, low, high, begin, many, made, held)


@njit(cache=True, nogil=True)
def add_part(c, along, sk, ck, low, high, begin, many, made, held):
    """Write the piece of the flank between two heights, if it is in contact; the number of pieces with it."""
    if many == 0 or high <= low:
        return made
    z = 0.5 * (low + high)
    line = c.count - 1
    foot = c.z[line]
    rho = c.rho[line] + (z - foot) * c.run[line]
    add_slice(
        held, made, along + (low - foot) / sk, along + (high - foot) / sk, rho, low, sk, ck, z, float(begin),
        float(many),
    )  # fmt: skip
    return made + 1
