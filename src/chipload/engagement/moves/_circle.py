"""Compiled search for the material on a circle of the edge; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.moves._contact`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.engagement.moves._border import border, ridge
from chipload.engagement.moves._sweep import AIR, MATERIAL, swept_by, what_is
from chipload.engagement.moves._uncounted_arrays import borrow_arrays

PI = math.pi
#: distance from the end of the front at which the contact is tested [rad]
BESIDE = 1e-4
#: greatest angle between two samples [rad], and least number of intervals between them: the range that is searched is
#: little wider than what may be in material, and an edge of the stock may lie between its ends alone
APART, FEWEST = 0.35, 4
#: least sine of the angle at which the front ends
ALONG = 1e-9


@njit(cache=True, nogil=True)
def intervals(p, T, rho, z, low, high, end, apart, index, out, begin):
    """Find the ranges of psi in material on the circle of a slice.

    Parameters
    ----------
    p : (3,) tip [mm]; T : (2,) unit vector of psi = 0
    rho, z : radius and height of the circle [mm]
    low, high, end : range that is searched; end of the front, near which the contact is tested just inside [rad]
    apart : greatest angle between two samples [rad]
    index : see :func:`chipload.engagement.moves._sweep.what_is`
    out : (m, 2) the ranges (from, to), written from row ``begin`` on

    Returns
    -------
    Number of ranges
    """
    # what a call passes counts again
    index = borrow_arrays(index)
    p, T, out = borrow_arrays((p, T, out))
    count = begin
    first = max(low, BESIDE - end) if end < PI else low
    last = min(high, end - BESIDE) if end < PI else high
    n = max(math.ceil((last - first) / apart), FEWEST) if last > first else -1
    d = (last - first) / n
    c = math.cos(first)
    s = math.sin(first)
    cd = math.cos(d)
    sd = math.sin(d)
    # typed: a literal would compile what it is passed to twice
    before = np.int64(AIR)
    inside = False
    c0 = c
    s0 = s
    x0 = 0.0
    y0 = 0.0
    for i in range(n + 1):
        x = p[0] + rho * (c * T[0] - s * T[1])
        y = p[1] + rho * (c * T[1] + s * T[0])
        f = what_is(x, y, z, index, before)
        # directions of which one is in material, and the borders on both of its sides or on one
        cm = c0 if inside else c
        sm = s0 if inside else s
        borders = 0
        if (f == MATERIAL) != inside:
            if i > 0:
                borders = 1
            else:
                out[count, 0] = -end if first < 2.0 * BESIDE - end else first
                inside = True
        elif i > 0 and f != MATERIAL and f != before:
            # the move that swept one of both places may have swept the other, and all between
            alone = swept_by(f, x0, y0, z, index) if f >= 0 else swept_by(before, x, y, z, index)
            if not alone:
                found, cm, sm = ridge(p[0], p[1], z, rho, T, c0, s0, c, s, before, f, index)
                borders = 2 if found else 0
        for _ in range(borders):
            # towards the sample before, but where the material ends
            back = not inside
            psi = border(
                p[0], p[1], z, rho, T, cm, sm, c0 if back else c, s0 if back else s, before if back else f, index
            )
            if inside:
                out[count, 1] = psi
                count += 1
            else:
                out[count, 0] = psi
            inside = not inside
        x0 = x
        y0 = y
        if f != MATERIAL:
            before = f
        c0 = c
        s0 = s
        c, s = c * cd - s * sd, c * sd + s * cd
    if inside:
        out[count, 1] = end if last > end - 2.0 * BESIDE else last
        count += 1
    return count - begin
