"""Compiled test of points for material in what moves with leaning axes left; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.bricks._sweep`.
Oracle: distances of points from slots and pockets in closed form, in tests/simulation.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from chipload.engagement.bricks._index import INDEX, what_is
from chipload.engagement.bricks._sweep import WAIT
from chipload.engagement.moves._sweep import MATERIAL
from chipload.engagement.moves._uncounted_arrays import borrow_arrays


@njit(types.void(types.float64[:, ::1], INDEX, types.boolean[::1]), cache=True, nogil=True)
def mark_points(points, index, mask):
    """Which points (n, 3) are in material."""
    # the caller keeps all of them
    index = borrow_arrays(index)
    wait = np.empty((WAIT, 6))
    hint = -1
    for k in range(len(points)):
        by = what_is(points[k, 0], points[k, 1], points[k, 2], index, hint, wait)
        mask[k] = by == MATERIAL
        if by >= 0:
            hint = by
