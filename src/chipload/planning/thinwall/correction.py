"""Corrections of the force law for the next plan: simulated force over force by the law, at each place.

Notation: u, v parameters of a side; c as in :mod:`chipload.planning.thinwall.passes`.

A place takes the greatest ratio of the contact points around it: up to its neighbours along u, and half way to them
along v, where the places are the rows of the cutter. So every point that the depth of the place affects is counted. The
law is accurate to a few percent in even stock. It does not know that the row at the free edge finds half of the stock,
nor how steep the stock is within the cutter's reach.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

#: rows whose parameters differ by this share of their distance from a place belong to it
ROW = 0.75


def greatest_ratios(places: tuple[Floats, Floats], u: ArrayLike, v: ArrayLike, ratio: ArrayLike) -> Floats:
    """Greatest ratio of the contact points around each place, (n, m) float; NaN where no point is near.

    Parameters
    ----------
    places : (n,), (m,) float, rising
    u, v, ratio : (p,) float of contact points

    Examples
    --------
    >>> import numpy as np
    >>> places = np.array([0.0, 0.5, 1.0]), np.array([0.0, 1.0])
    >>> greatest_ratios(places, [0.25, 0.75], [1.0, 1.0], [0.6, 0.9]).tolist()
    [[nan, 0.6], [nan, 0.9], [nan, 0.9]]
    """
    a, b = places
    x, y, r = (np.asarray(values, dtype=np.float64) for values in (u, v, ratio))
    low, high = np.r_[a[0], a[:-1]], np.r_[a[1:], a[-1]]
    below, above = np.r_[0.0, np.diff(b)], np.r_[np.diff(b), 0.0]
    out = np.full((len(a), len(b)), np.nan)
    for j in range(len(b)):
        row = (y >= b[j] - ROW * below[j]) & (y <= b[j] + ROW * above[j])
        for i in range(len(a)):
            near = r[row & (x >= low[i]) & (x <= high[i])]
            out[i, j] = near.max() if len(near) else np.nan
    return out
