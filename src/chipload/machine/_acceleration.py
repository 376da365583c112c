"""Compiled: the forward and backward pass that limit the acceleration along a path."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def limit_acceleration(step: Floats, acceleration: Floats, w: Floats) -> None:
    """Lower ``w`` (n,) = v^2 [mm2/s2] in place until it changes by at most 2 a step over every step.

    ``step`` (n - 1,) [mm], ``acceleration`` a (n - 1,) [mm/s2].
    """
    for k in range(len(step)):
        w[k + 1] = min(w[k + 1], w[k] + 2.0 * acceleration[k] * step[k])
    for k in range(len(step) - 1, -1, -1):
        w[k] = min(w[k], w[k + 1] + 2.0 * acceleration[k] * step[k])
