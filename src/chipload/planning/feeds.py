"""The feed of every line of a program, as fast as the loads allow; the path stays.

Notation: a factor is the new feed over the programmed one. What a step removes does not depend on the feed, its loads
do: they are known at some factors, the samples, and rise with the factor. Between two samples a load is taken along the
straight line; the greatest force over a turn is convex in the feed where coefficients do not depend on the chip's
thickness, so that the line lies above it. A text states one feed a line: the least of its steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LineFeeds:
    """Factors by line.

    Parameters
    ----------
    line : (m,) int, rising
    factor : (m,) float, of each line
    by : (m,) what holds it: the name of a limit, `fastest`, or `slowest` where a limit asks for less than that
    """

    line: Ints
    factor: Floats
    by: tuple[str, ...]

    @property
    def beyond(self) -> Ints:
        """Lines that exceed a limit even at the slowest feed allowed."""
        return self.line[np.array([b == "slowest" for b in self.by], dtype=np.bool_)]


def greatest_factor(samples: ArrayLike, loads: ArrayLike, limit: float) -> Floats:
    """Greatest factor (n,) within the samples at which each row's load is at most the limit; nan: none is.

    Parameters
    ----------
    samples : (k,) float, rising factors
    loads : (n, k) float, at each of them

    >>> greatest_factor([0.5, 1.0, 2.0], [[2.0, 3.0, 5.0], [9.0, 9.0, 9.0], [1.0, 1.0, 1.0]], 4.0).tolist()
    [1.5, nan, 2.0]
    """
    x, y = np.asarray(samples, dtype=np.float64), np.asarray(loads, dtype=np.float64)
    if x.ndim != 1 or len(x) < 2 or (np.diff(x) <= 0.0).any() or y.shape[1:] != x.shape:
        raise InputError("feeds: samples must be at least two rising factors, loads a column for each")
    out = np.where(y[:, 0] <= limit, x[0], np.nan)
    for k in range(len(x) - 1):
        low, high = y[:, k], y[:, k + 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(high <= limit, 1.0, (limit - low) / (high - low))
        reached = out == x[k]
        out = np.where(reached & (low <= limit), x[k] + share * (x[k + 1] - x[k]), out)
    return out


def line_feeds(
    line: ArrayLike,
    cuts: ArrayLike,
    samples: ArrayLike,
    loads: Mapping[str, Floats],
    limits: Mapping[str, float],
    fastest: ArrayLike,
) -> LineFeeds:
    """The factor of each line: the greatest at which no step exceeds a limit; O(steps x samples).

    Parameters
    ----------
    line : (n,) int, of each step that moves at a feed
    cuts : (n,) bool, whether the step cuts
    samples : (k,) float, rising factors; the least is the slowest feed allowed
    loads : by limit (n, k), see above
    limits : by name
    fastest : (n,) float, greatest factor of each step that the machine and the user allow
    """
    at, cutting = np.asarray(line, dtype=np.int64), np.asarray(cuts, dtype=np.bool_)
    slowest = float(np.asarray(samples, dtype=np.float64)[0])
    best, by = np.array(np.asarray(fastest, dtype=np.float64), copy=True), np.zeros(len(at), dtype=np.int64)
    names = ["fastest", "slowest", *limits]
    for k, (name, limit) in enumerate(limits.items(), 2):
        found = greatest_factor(samples, loads[name], limit)
        none = cutting & np.isnan(found)
        lower = cutting & ~none & (found < best)
        best, by = np.where(lower, found, best), np.where(lower, k, by)
        best, by = np.where(none, -1.0, best), np.where(none, 1, by)
    lines = np.unique(at)
    order = np.lexsort((best, at))
    first = order[np.searchsorted(at[order], lines)]
    factor = np.where(best[first] < slowest, slowest, best[first])
    return LineFeeds(lines, factor, tuple(names[b] for b in by[first]))
