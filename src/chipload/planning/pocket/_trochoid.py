"""Compiled loop of a trochoid: the engagement along a circle of the centre path.

Notation: as in ``_pass_steps``.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.engagement.moves._uncounted_arrays import borrow_arrays
from chipload.planning.pocket._pass_steps import angle_at


@njit(cache=True, nogil=True)
def circle_engagement(xc, yc, rho, n, r, R, limit, grid, head, link, axis, arcs, met):
    """Greatest E at n places of a circle that the centre runs counter-clockwise; ``met`` (n,) whether there is any.

    Ends early above the limit.
    """
    grid, head, link, axis, arcs, met = borrow_arrays((grid, head, link, axis, arcs, met))
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
