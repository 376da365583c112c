"""Compiled test of points for material in what moves left; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.moves._sweep`.
Oracle: distances of points from slots and pockets in closed form, in tests/simulation.
"""

from __future__ import annotations

from numba import njit, types

from chipload.engagement.moves._contact import INDEX
from chipload.engagement.moves._sweep import MATERIAL, what_is
from chipload.engagement.moves._uncounted_arrays import borrow_arrays


@njit(types.void(types.float64[:, ::1], INDEX, types.boolean[::1]), cache=True, nogil=True)
def mark_points(points, index, mask):
    """Which points (n, 3) are in material."""
    # the caller keeps all of them
    index = borrow_arrays(index)
    hint = -1
    for k in range(len(points)):
        by = what_is(points[k, 0], points[k, 1], points[k, 2], index, hint)
        mask[k] = by == MATERIAL
        if by >= 0:
            hint = by
