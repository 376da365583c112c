"""Compiled: the distance from its path at which the lower outline of a pass is as high as a scallop.

Notation: as in ``scallop_width.py``; c contacts, m slopes phi, x [mm] places across the path.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def reach_on_side(
    x: Any, square: Any, sin: Any, cos: Any, H: Any, bend: Any, scale: Any, trace: Any, scallop: float, radius: float,
    out: Any,
) -> None:  # fmt: skip
    """Distance ``out`` (c,) [mm] at which the outline, less the surface, first is ``scallop`` high; else ``radius``.

    ``x`` (k,) places from 0 outwards, with the sign of the side, and their ``square``; ``sin``, ``cos``, ``H`` (c, m)
    of the slopes; ``bend`` (c,) half the curvature of the surface across the path, ``scale`` (c,) of the outline,
    ``trace`` (c,) its curvature at the path: where it is 0 the distance is 0.
    """
    n = len(x)
    y = np.empty(n)
    for c in range(len(out)):
        out[c] = 0.0
        if not trace[c] > 0.0:
            continue
        y[:] = -math.inf
        for j in range(sin.shape[1]):
            s, h, w = sin[c, j], H[c, j], cos[c, j]
            for i in range(n):
                value = (x[i] * s - h) / w
                y[i] = value if value > y[i] else y[i]
        out[c] = radius
        before = after = (y[0] - bend[c] * square[0]) * scale[c]
        for i in range(n):
            before, after = after, (y[i] - bend[c] * square[i]) * scale[c]
            if after >= scallop:
                k = max(i - 1, 0)
                # between two places the outline is nearly a parabola
                low, high, root = math.sqrt(max(before, 0.0)), math.sqrt(max(after, 0.0)), math.sqrt(scallop)
                share = (root - low) / (high - low) if high > low else 1.0
                a, b = abs(x[k]), abs(x[i])
                out[c] = a + share * (b - a)
                break
