"""The region of the material on the left of an open chain, for tests."""

from __future__ import annotations

import math

import numpy as np

from chipload.geometry.contour import Contour, Region


def material_left_of(chain: Contour, reach_mm: float) -> Region:
    """Return the region on the left of a chain that runs on along its end tangents, within a circle about it."""
    low, high = np.array(chain.bounds).reshape(2, 2)
    centre = 0.5 * (low + high)
    p, t, _ = chain.at([0.0, chain.length])
    first, last = (to_circle(p[0], -t[0], centre, reach_mm), to_circle(p[1], t[1], centre, reach_mm))
    a, b = (math.atan2(q[1] - centre[1], q[0] - centre[0]) for q in (last, first))
    rows = [
        [*first, *p[0], 0.0, 0.0, 0.0],
        *chain.segments,
        [*p[1], *last, 0.0, 0.0, 0.0],
        [*last, *first, *centre, (b - a) % (2.0 * math.pi)],
    ]
    return Region((Contour(np.array(rows)),))


def to_circle(p, direction, centre, radius: float):
    """Return the point where the ray from ``p`` meets the circle."""
    v = p - centre
    along = float(v @ direction)
    return p + direction * (math.sqrt(along**2 + radius**2 - float(v @ v)) - along)
