"""The two passes of the speed limit; plain arrays in and out."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def two_passes(step: Floats, acceleration: Floats, w: Floats) -> None:
    """Lower ``w`` (n,) = v^2 in place until no piece ``step`` (n - 1,) climbs or falls by more than 2 a step."""
    for k in range(len(step)):
        w[k + 1] = min(w[k + 1], w[k] + 2.0 * acceleration[k] * step[k])
    for k in range(len(step) - 1, -1, -1):
        w[k] = min(w[k], w[k + 1] + 2.0 * acceleration[k] * step[k])
