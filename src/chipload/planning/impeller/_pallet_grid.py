"""Compiled: the largest cutter at each pallet angle of a grid.

Notation: as in ``planning/impeller/_largest_cutter.py``.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from chipload.planning.impeller._largest_cutter import largest_at


@njit(cache=True, nogil=True)
def largest_at_pallets(
    points: Any, own: Any, nodes: Any, spans: Any, leaves: int, ccs: Any, cones: Any, tool: Any, pallets: Any,
    most: Any, hints: Any, first: int, last: int, out: Any,
) -> None:  # fmt: skip
    """Fill ``out`` (c, t, B) with the largest rho [mm], at most ``most`` (c, t); -inf where the axis points into the
    surface.

    ``hints`` (c, t, h) points that are tried first, -1: none; the last is overwritten by the limiting point of the
    pallet angle before.
    """
    last_hint = hints.shape[2] - 1
    for c in range(first, last):
        for t in range(len(cones)):
            for j in range(len(pallets)):
                n = ccs[c, 3] * cones[t, 0] * math.cos(pallets[j])
                n += ccs[c, 4] * cones[t, 0] * math.sin(pallets[j]) + ccs[c, 5] * cones[t, 1]
                out[c, t, j] = -math.inf
                if n >= 0.0 and most[c, t] >= 0.0:
                    out[c, t, j], hints[c, t, last_hint] = largest_at(
                        points, own, nodes, spans, leaves, ccs[c], cones[t], tool, pallets[j], most[c, t], -1,
                        hints[c, t], last_hint + 1,
                    )  # fmt: skip
