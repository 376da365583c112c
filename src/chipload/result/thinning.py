"""Reduction of long columns to few points that keep all extremes."""

from __future__ import annotations

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
    void = np.isnan(values)
    low, high = np.where(void, np.inf, values), np.where(void, -np.inf, values)
    ends = _first_of(low, np.minimum, edges), _first_of(high, np.maximum, edges)
    return np.unique(np.concatenate([[0, n - 1], np.flatnonzero(void), *ends]))


def _first_of(values: Floats, extreme: np.ufunc, edges: Ints) -> Ints:
    """(b,) row of the extreme of each bucket between two edges, the first where several are."""
    most = np.repeat(extreme.reduceat(values, edges[:-1]), np.diff(edges))
    rows = np.flatnonzero(values == most)
    return rows[np.searchsorted(rows, edges[:-1])]
