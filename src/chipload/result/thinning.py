"""Reduction of long columns to few points that keep all extremes."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def thin_rows(values: Floats, most: int) -> Ints:
    """Return the (m,) rows of a column to draw, at most about ``most``: extremes of each bucket, first and last row.

    Rows with NaN separate pieces of the curve and are kept.

    >>> thin_rows(np.array([0.0, 1.0, 9.0, 1.0, 0.0, -5.0, 0.0, 2.0]), 4).tolist()
    [0, 2, 5, 7]
    """
    n = len(values)
    if n <= most:
        return np.arange(n)
    buckets = max(1, most // 2)
    edges = np.linspace(0, n, buckets + 1).astype(np.int64)
    low, high = np.where(np.isnan(values), np.inf, values), np.where(np.isnan(values), -np.inf, values)
    keep = [np.array([0, n - 1]), np.flatnonzero(np.isnan(values))]
    for a, b in itertools.pairwise(edges.tolist()):
        keep.append(np.array([a + low[a:b].argmin(), a + high[a:b].argmax()]))
    return np.unique(np.concatenate(keep))
