"""The compiled loop of a trochoid: what a circle of the centre meets.

Notation: as in ``_kernels``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.planning.pocket._kernels import angle_at
from chipload.stock._kernels import ARCS


@njit(cache=True, nogil=True)
def circle_engagement(xc, yc, rho, n, r, R, limit, grid, head, link, axis, met):
    """Greatest E at n places of a circle that the centre runs counter-clockwise; ``met`` (n,) whether there is any.

    Ends early above the limit.
    """
    arcs = np.empty((ARCS, 2))
    most = 0.0
    for k in range(n):
        a = 2.0 * math.pi * k / n
        c, s = math.cos(a), math.sin(a)
        e = angle_at(xc + rho * c, yc + rho * s, -s, c, r, R, grid, head, link, axis, arcs)
        met[k] = e > 0.0
        most = max(most, e)
        if most > limit:
            return most
    return most
