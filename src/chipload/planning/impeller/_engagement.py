"""Compiled: which points of a cutter's envelope are in material that stands on a surface.

Notation: as in ``engagement.py``.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from chipload.planning.impeller._scallop import distance


@njit(cache=True, nogil=True)
def in_material(
    tip: Any, frame: Any, feed: Any, place: Any, normal: Any, curvature: Any, allowance: float, rho: Any, height: Any,
    sine: Any, cosine: Any, angles: Any, tips: Any, axes: Any, shapes: Any, near: Any, out: Any,
) -> None:  # fmt: skip
    """Whether the point of each slice (k,) at each immersion (p,) cuts, into ``out`` (k, p).

    ``frame`` (3, 3) rows T, n, A; ``tips``, ``axes`` (m, 3) poses of earlier passes, ``shapes`` (m, 2) their rho and
    corner, ``near`` (q,) the numbers of those that are near.
    """
    along, across = 0.0, 0.0
    for j in range(3):
        along += feed[j] * frame[0, j]
        across += feed[j] * frame[2, j]
    last = 0
    for i in range(len(rho)):
        for p in range(len(angles)):
            out[i, p] = False
            s, c = math.sin(angles[p]), math.cos(angles[p])
            if sine[i] * along * s - cosine[i] * across <= 0.0:
                continue
            x = tip[0] + height[i] * frame[2, 0] + rho[i] * (c * frame[1, 0] + s * frame[0, 0])
            y = tip[1] + height[i] * frame[2, 1] + rho[i] * (c * frame[1, 1] + s * frame[0, 1])
            z = tip[2] + height[i] * frame[2, 2] + rho[i] * (c * frame[1, 2] + s * frame[0, 2])
            a, b, d = x - place[0], y - place[1], z - place[2]
            up = a * normal[0] + b * normal[1] + d * normal[2]
            a, b, d = a - up * normal[0], b - up * normal[1], d - up * normal[2]
            bend = (
                a * (curvature[0, 0] * a + curvature[0, 1] * b + curvature[0, 2] * d)
                + b * (curvature[1, 0] * a + curvature[1, 1] * b + curvature[1, 2] * d)
                + d * (curvature[2, 0] * a + curvature[2, 1] * b + curvature[2, 2] * d)
            )
            if up - 0.5 * bend >= allowance:
                continue
            taken = False
            # a neighbour of the point is mostly in the same pose
            for q in range(len(near)):
                k = near[(last + q) % len(near)]
                if distance(x, y, z, tips[k], axes[k], shapes[k, 0], shapes[k, 1]) <= 0.0:
                    taken, last = True, (last + q) % len(near)
                    break
            out[i, p] = not taken
