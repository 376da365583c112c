"""Compiled outlines of what moves swept at a height; arrays and scalars only.

Notation: nodes (i, j) of a net over the plan, the outermost beside the body and not swept; a border lies on the side of
a square between two nodes of which one was swept, at the point where that changes. Side 2 (i m + j) goes from node
(i, j) to (i + 1, j), the one after it to (i, j + 1); m nodes in y. The swept area is left of the outline.
Oracle: shapely unions of the swept sections, in tests/engagement/moves.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from chipload.engagement.moves._contact import INDEX
from chipload.engagement.moves._sweep import AIR, EPS, MATERIAL, grid_height_above, place, swept
from chipload.engagement.moves._uncounted_arrays import borrow_arrays

#: halvings of a side
HALVINGS = 14


@njit(cache=True, nogil=True)
def was_swept(x, y, z, index, tops):
    """Whether a move swept a point of the body's box."""
    cell = place(x, y, index[0], index[1])
    return cell >= 0 and swept_in(cell, x, y, z, index, tops, np.int64(-1)) != MATERIAL


@njit(cache=True, nogil=True)
def swept_in(cell, x, y, z, index, tops, hint):
    """The number of a move that swept a point of a cell, AIR where the level of the cell says that one did, MATERIAL
    where none did; ``hint`` is asked first.
    """
    ceil = index[2][cell, 1]
    if z >= ceil:
        return AIR if ceil < tops[cell] else MATERIAL
    if z < index[2][cell, 0] - EPS:
        # below all that moves swept here
        return MATERIAL
    if hint >= 0 and swept(index[6][hint], index[8][index[7][hint]], x, y, z):
        return hint
    at = index[3][cell, 0]
    high = grid_height_above(z, index[0])
    for k in range(at + index[3][cell, 1] - 1, at - 1, -1):
        e = index[4][k]
        if index[5][k] < high and e != hint and swept(index[6][e], index[8][index[7][e]], x, y, z):
            return e
    return MATERIAL


@njit(cache=True, nogil=True)
def outline_sides(case):
    """Sides (from, to) of a square that its outlines go through: bottom 0, right 1, top 2, left 3; -1: none. Bits of
    ``case``: corners (0, 0), (1, 0), (1, 1), (0, 1).
    """
    a = -1
    b = -1
    c = -1
    d = -1
    if case == 1:
        a, b = 0, 3
    elif case == 2:
        a, b = 1, 0
    elif case == 3:
        a, b = 1, 3
    elif case == 4:
        a, b = 2, 1
    elif case == 5:
        a, b, c, d = 0, 3, 2, 1
    elif case == 6:
        a, b = 2, 0
    elif case == 7:
        a, b = 2, 3
    elif case == 8:
        a, b = 3, 2
    elif case == 9:
        a, b = 0, 2
    elif case == 10:
        a, b, c, d = 1, 0, 3, 2
    elif case == 11:
        a, b = 1, 2
    elif case == 12:
        a, b = 3, 1
    elif case == 13:
        a, b = 0, 1
    elif case == 14:
        a, b = 3, 0
    return a, b, c, d


_F1, _F2, _I1 = types.float64[::1], types.float64[:, ::1], types.int64[::1]


_B2 = types.boolean[:, ::1]


@njit(types.void(types.float64, _F1, _F1, INDEX, _F1, _B2, _B2, _B2), cache=True, nogil=True)
def mark_nodes(z, xs, ys, index, tops, below, above, inside):
    """Which nodes of a net were swept at a height; ``xs``, ``ys``: nodes, the outermost beside the body, not swept.
    ``below``, ``above``: those that were swept at a lower and at a greater height: only what differs is examined.
    """
    # the caller keeps all of them
    index = borrow_arrays(index)
    tops = borrow_arrays(tops)
    inside[:] = False
    grid = index[0]
    n = len(xs)
    m = len(ys)
    # cells of the first row of the index, to which those of the first column are added
    column = np.empty(m, np.int64)
    for j in range(1, m - 1):
        column[j] = place(grid[0], ys[j], grid, index[1])
    for i in range(1, n - 1):
        row = place(xs[i], grid[1], grid, index[1])
        hint = np.int64(AIR)
        for j in range(1, m - 1):
            if below[i, j]:
                inside[i, j] = True
                continue
            if not above[i, j] or row < 0 or column[j] < 0:
                continue
            found = swept_in(row + column[j], xs[i], ys[j], z, index, tops, hint)
            inside[i, j] = found != MATERIAL
            if found >= 0:
                hint = found


@njit(types.int64(_B2, _I1, _I1, _I1), cache=True, nogil=True)
def trace_rings(inside, onward, sides, first):
    """Rings around the marked nodes: the sides that they cross and where each begins; how many, -1 where there is no
    room. ``onward``: room for a number a side.
    """
    n, m = inside.shape
    onward[:] = -1
    for i in range(n - 1):
        for j in range(m - 1):
            case = 1 * inside[i, j] + 2 * inside[i + 1, j] + 4 * inside[i + 1, j + 1] + 8 * inside[i, j + 1]
            if case == 0 or case == 15:
                continue
            side = (2 * (i * m + j), 2 * ((i + 1) * m + j) + 1, 2 * (i * m + j + 1), 2 * (i * m + j) + 1)
            a, b, c, d = outline_sides(case)
            onward[side[a]] = side[b]
            if c >= 0:
                onward[side[c]] = side[d]
    rings = 0
    count = 0
    for begin in range(len(onward)):
        if onward[begin] < 0:
            continue
        if rings + 1 == len(first):
            return -1
        first[rings] = count
        at = begin
        while onward[at] >= 0:
            if count == len(sides):
                return -1
            sides[count] = at
            count += 1
            to = onward[at]
            onward[at] = -1
            at = to
        rings += 1
        first[rings] = count
    return rings


@njit(cache=True, nogil=True)
def ends_of(side, xs, ys, inside):
    """Ends of a side of the net, the one that was swept first, and whether it lies on the border of the net."""
    n, m = inside.shape
    i = side // 2 // m
    j = side // 2 % m
    k = i + 1 - side % 2
    l = j + side % 2
    border = i == 0 or j == 0 or k == n - 1 or l == m - 1
    if inside[k, l]:
        return xs[k], ys[l], xs[i], ys[j], border
    return xs[i], ys[j], xs[k], ys[l], border


@njit(types.void(types.float64, _F1, _F1, INDEX, _F1, _B2, _I1, _F2), cache=True, nogil=True)
def place_borders(z, xs, ys, index, tops, inside, sides, points):
    """Where the borders on sides of the net are: ``points`` (n, 2)."""
    # the caller keeps all of them
    index = borrow_arrays(index)
    tops = borrow_arrays(tops)
    for p in range(len(sides)):
        lx, ly, hx, hy, border = ends_of(sides[p], xs, ys, inside)
        for _ in range(0 if border else HALVINGS):
            x = 0.5 * (lx + hx)
            y = 0.5 * (ly + hy)
            if was_swept(x, y, z, index, tops):
                lx = x
                ly = y
            else:
                hx = x
                hy = y
        points[p, 0] = 0.5 * (lx + hx)
        points[p, 1] = 0.5 * (ly + hy)
