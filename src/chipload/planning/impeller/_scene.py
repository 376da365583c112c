"""Compiled: rows of contact points.

Notation: as in ``scene.py``; E1, E2 tangents, E1 across the normal N and the coordinate axis farthest from it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def form_of(a: Any, K: Any, b: Any) -> float:
    """Value a K b of vectors (3,) and a tensor (3, 3)."""
    total = 0.0
    for i in range(3):
        total += a[i] * (K[i, 0] * b[0] + K[i, 1] * b[1] + K[i, 2] * b[2])
    return total


@njit(cache=True, nogil=True)
def contact_rows(contact: Any, normal: Any, curvature: Any, surface: Any, out: Any) -> None:
    """Rows ``out`` (c, 16): S, N, E1, E2, K in them, the number of the surface."""
    first, second = np.empty(3), np.empty(3)
    for c in range(len(out)):
        N = normal[c]
        k = 0
        for i in range(1, 3):
            if abs(N[i]) < abs(N[k]):
                k = i
        i, j = (k + 1) % 3, (k + 2) % 3
        size = math.sqrt(N[i] * N[i] + N[j] * N[j])
        first[k], first[i], first[j] = 0.0, N[j] / size, -N[i] / size
        for m in range(3):
            a, b = (m + 1) % 3, (m + 2) % 3
            second[m] = N[a] * first[b] - N[b] * first[a]
        out[c, 0:3], out[c, 3:6], out[c, 6:9], out[c, 9:12] = contact[c], N, first, second
        K = curvature[c]
        out[c, 12], out[c, 13] = form_of(first, K, first), form_of(first, K, second)
        out[c, 14], out[c, 15] = form_of(second, K, second), surface[c]
