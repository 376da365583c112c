"""Compiled loops over the faces of the initial body; arrays and scalars only.

Notation: a face is a row of nine corners x, y, z and its normal, which is not upright to z; an upright face is a
segment in the plan; cells and levels as in :mod:`chipload.engagement.moves._sweep`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.engagement.moves._sweep import in_solid

#: distance by which the bounds of a face in a cell are widened [mm]
MARGIN = 1e-7


@njit("void(float64[:,::1], float64[::1], int64[::1], int64[::1], int32[::1])", cache=True, nogil=True)
def faces_over_cells(faces, grid, shape, first, ids):
    """Faces whose boxes lie over each cell: ``first`` (cells + 1,) and, where it has room for them, ``ids``."""
    fill = len(ids) > 0
    if not fill:
        first[:] = 0
    for f in range(len(faces)):
        r = faces[f]
        i0 = max(math.floor((min(r[0], r[3], r[6]) - MARGIN - grid[0]) / grid[2]), 0)
        i1 = min(math.floor((max(r[0], r[3], r[6]) + MARGIN - grid[0]) / grid[2]), shape[0] - 1)
        j0 = max(math.floor((min(r[1], r[4], r[7]) - MARGIN - grid[1]) / grid[3]), 0)
        j1 = min(math.floor((max(r[1], r[4], r[7]) + MARGIN - grid[1]) / grid[3]), shape[1] - 1)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                cell = i * shape[1] + j
                if fill:
                    ids[first[cell]] = f
                first[cell] += 1
    if fill:
        # each start was moved to its end
        for cell in range(len(first) - 1, 0, -1):
            first[cell] = first[cell - 1]
        first[0] = 0
        return
    total = 0
    for cell in range(len(first)):
        here = first[cell]
        first[cell] = total
        total += here


@njit("void(float64[:,::1], float64[::1], int64[::1], int64[::1], int32[::1], float64[:,::1])", cache=True, nogil=True)
def levels(faces, grid, shape, first, ids, level):
    """Above ``ceil`` of a cell is air; from ``base`` to ``floor``, where base is the lower, is material.

    The heights of the faces over a cell are ranges; between ranges that do not overlap all points are alike.
    """
    low = np.zeros(3)
    half = np.array([0.5 * grid[2], 0.5 * grid[3]])
    for i in range(shape[0]):
        for j in range(shape[1]):
            cell = i * shape[1] + j
            a = first[cell]
            n = first[cell + 1] - a
            if n == 0:
                level[cell, 0] = -math.inf
                level[cell, 1] = -math.inf
                level[cell, 2] = math.inf
                continue
            x = grid[0] + (i + 0.5) * grid[2]
            y = grid[1] + (j + 0.5) * grid[3]
            bottom = np.empty(n)
            top = np.empty(n)
            for k in range(n):
                r = faces[ids[a + k]]
                middle = r[2] - (r[9] * (x - r[0]) + r[10] * (y - r[1])) / r[11]
                spread = (abs(r[9]) * half[0] + abs(r[10]) * half[1]) / abs(r[11])
                bottom[k] = max(min(r[2], r[5], r[8]), middle - spread) - MARGIN
                top[k] = min(max(r[2], r[5], r[8]), middle + spread) + MARGIN
                if top[k] < bottom[k]:
                    # the plane leaves the cell within the box of the face: the face is not over the cell
                    bottom[k] = math.inf
                    top[k] = -math.inf
            order = np.argsort(top)[::-1]
            ceil = top[order[0]]
            under = bottom[order[0]]
            base = math.inf
            for k in order[1:]:
                if top[k] == -math.inf:
                    break
                if top[k] < under:
                    base = top[k]
                    break
                under = min(under, bottom[k])
            level[cell, 0] = -math.inf
            level[cell, 1] = ceil
            level[cell, 2] = math.inf
            if base < under and in_solid(x, y, 0.5 * (base + under), low, low, first, ids, faces, cell):
                level[cell, 0] = under
                level[cell, 2] = base


@njit("void(float64[:,::1], float64[::1], int64[::1], float64[:,::1])", cache=True, nogil=True)
def mark_upright_faces(walls, grid, shape, level):
    """Withdraw the range of material of each cell that an upright face stands in: beside the face is air.

    Parameters
    ----------
    walls : (m, 4) from x, y to x, y of each upright face
    """
    for w in range(len(walls)):
        x0, y0, x1, y1 = walls[w]
        i0 = max(math.floor((min(x0, x1) - MARGIN - grid[0]) / grid[2]), 0)
        i1 = min(math.floor((max(x0, x1) + MARGIN - grid[0]) / grid[2]), shape[0] - 1)
        j0 = max(math.floor((min(y0, y1) - MARGIN - grid[1]) / grid[3]), 0)
        j1 = min(math.floor((max(y0, y1) + MARGIN - grid[1]) / grid[3]), shape[1] - 1)
        # normal of the segment, as long as it is
        nx = y1 - y0
        ny = x0 - x1
        reach = 0.5 * (abs(nx) * grid[2] + abs(ny) * grid[3]) + MARGIN * math.hypot(nx, ny)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                x = grid[0] + (i + 0.5) * grid[2]
                y = grid[1] + (j + 0.5) * grid[3]
                if abs(nx * (x - x0) + ny * (y - y0)) <= reach:
                    level[i * shape[1] + j, 0] = -math.inf
                    level[i * shape[1] + j, 2] = math.inf
