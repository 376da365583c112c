"""Compiled: the forward and backward pass that limit the acceleration along a path."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def limit_change(change: Floats, w: Floats) -> None:
    """Lower ``w`` (n,) = v^2 [mm2/s2] in place until it changes by at most ``change`` = 2 a s over every step.

    ``change`` (n - 1,) [mm2/s2].
    """
    for k in range(len(change)):
        w[k + 1] = min(w[k + 1], w[k] + change[k])
    for k in range(len(change) - 1, -1, -1):
        w[k] = min(w[k], w[k + 1] + change[k])
