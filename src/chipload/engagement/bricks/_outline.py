"""Compiled outlines of what moves in bricks swept at a height; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.moves._outline`, whose rings these are.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from chipload.engagement.bricks._index import BY, INDEX, OUTSIDE, brick_of
from chipload.engagement.bricks._sweep import WAIT, swept
from chipload.engagement.moves._outline import HALVINGS, ends_of
from chipload.engagement.moves._uncounted_arrays import borrow_arrays

_F1, _F2, _I1 = types.float64[::1], types.float64[:, ::1], types.int64[::1]


@njit(cache=True, nogil=True)
def sweeper(x, y, z, index, hint, wait):
    """The number of a move that swept a point, ``hint`` is asked first; below 0 where none did, or outside the box."""
    row = brick_of(x, y, z, index[0], index[1], index[2])
    if row < 0:
        return BY - row if row <= BY else row
    count = index[3][row, 1]
    if count < 0:
        return -1 - count
    if hint >= 0 and swept(index[6][hint], index[8][index[7][hint]], x, y, z, wait):
        return hint
    at = index[3][row, 0]
    for k in range(at + count - 1, at - 1, -1):
        e = int(index[4][k])
        if e != hint and swept(index[6][e], index[8][index[7][e]], x, y, z, wait):
            return e
    return -1


@njit(types.void(types.float64, _F1, _F1, INDEX, types.boolean[:, ::1]), cache=True, nogil=True)
def mark_nodes(z, xs, ys, index, inside):
    """Which nodes of a net were swept at a height; the outermost are not."""
    index = borrow_arrays(index)
    wait = np.empty((WAIT, 6))
    inside[:] = False
    for i in range(1, len(xs) - 1):
        hint = -1
        for j in range(1, len(ys) - 1):
            by = sweeper(xs[i], ys[j], z, index, hint, wait)
            inside[i, j] = by >= 0 or by == OUTSIDE
            if by >= 0:
                hint = by


@njit(types.void(types.float64, _F1, _F1, INDEX, types.boolean[:, ::1], _I1, _F2), cache=True, nogil=True)
def place_borders(z, xs, ys, index, inside, sides, points):
    """Where the borders on sides of the net are: ``points`` (n, 2)."""
    index = borrow_arrays(index)
    wait = np.empty((WAIT, 6))
    hint = -1
    for p in range(len(sides)):
        lx, ly, hx, hy, border = ends_of(sides[p], xs, ys, inside)
        for _ in range(0 if border else HALVINGS):
            x = 0.5 * (lx + hx)
            y = 0.5 * (ly + hy)
            by = sweeper(x, y, z, index, hint, wait)
            if by >= 0 or by == OUTSIDE:
                lx = x
                ly = y
            else:
                hx = x
                hy = y
            if by >= 0:
                hint = by
        points[p, 0] = 0.5 * (lx + hx)
        points[p, 1] = 0.5 * (ly + hy)
