"""Division of a line of a program into segments of one feed each, where the allowed feed changes along it.

Notation: stations are places s [mm] along the line at which the allowed feed v [mm/s] is known. A segment begins and
ends at a station or an end of the line, and has the least feed of its stations, both ends included. So the feed between
two stations is allowed at both, and in between too where the load there is between theirs.

A dynamic programme over the ends of the segments minimises

    sum of L_i / v_i + t_i dv_i / (2 max(v_i, v_(i-1))) + PRICE T        t_i, the time of a change of speed dv_i:
    dv / a + a / j where dv >= a^2 / j, else 2 sqrt(dv / j);  dv / a without a limit of the jerk j

with L_i the length of a segment, T the time of the whole line, a [mm/s^2] the acceleration along the path. The second
term is the time that a change of speed loses: the controller looks ahead, so that it slows down before the slower
segment and speeds up behind it. Each segment takes at least the block time of the control, and a change of speed has
room in the faster of its two segments.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.program.time import change_time

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: what a cut costs, over the time of the line: one that gains less is not made
PRICE = 2e-3
#: stations beside a change of the allowed feed that may be ends too, and ends that a segment may pass over at most
BESIDE, PASSED = 2, 400


def line_ends(
    place: ArrayLike,
    feed: ArrayLike,
    length: float,
    acceleration: float,
    block_s: float,
    jerk: float | None = None,
) -> Ints:
    """Return the stations (k,), rising, at which a line is divided; none: it keeps one feed.

    Parameters
    ----------
    place : (n,) float [mm], rising, of the stations, between 0 and ``length``
    feed : (n,) float [mm/s], allowed at each, above 0
    length : of the line [mm]
    acceleration : along the path [mm/s^2], may be inf
    block_s : least time of a segment [s]
    jerk : [mm/s^3]; None: no limit

    Raises
    ------
    InputError
        A value is out of range.

    Examples
    --------
    20 mm of which the second half is slow: the fast segment ends at the last station that allows its feed.

    >>> line_ends(range(1, 20), [20.0] * 10 + [5.0] * 9, 20.0, 3000.0, 0.01).tolist()
    [9]
    """
    s, v = np.asarray(place, dtype=np.float64), np.asarray(feed, dtype=np.float64)
    if s.ndim != 1 or s.shape != v.shape or not (v > 0.0).all() or not (np.diff(s) > 0.0).all():
        raise InputError("feeds: stations of a line must be (n,), rising, with feeds above 0")
    if not (acceleration > 0.0 and block_s >= 0.0):
        raise InputError(f"feeds: acceleration = {acceleration:g}, block_s = {block_s:g}: must be above 0, at least 0")
    none = np.empty(0, dtype=np.int64)
    at = _candidates(v)
    if not len(at):
        return none
    # least feed between neighbouring ends, both included
    bounds = np.concatenate([[0], at, [len(v) - 1]])
    least = np.array([v[a : b + 1].min() for a, b in pairwise(bounds.tolist())])
    where = np.concatenate([[0.0], s[at], [length]])
    price = PRICE * length * float((1.0 / v).mean())
    n = len(where)
    best, before = np.full(n, np.inf), np.zeros(n, dtype=np.int64)
    speed, own = np.zeros(n), np.zeros(n)
    best[0] = 0.0
    for end in range(1, n):
        first = max(0, end - PASSED)
        b = np.arange(first, end)
        low = np.minimum.accumulate(least[first:end][::-1])[::-1]
        if first:  # from the beginning of the line too, so that there always is a way
            b, low = np.append(0, b), np.append(least[:end].min(), low)
        long = where[end] - where[b]
        later, was = b > 0, speed[b]
        fast, dv = np.maximum(low, was), np.abs(low - was)
        t = change_time(dv, acceleration, jerk)
        room = np.where(low >= was, long, own[b])
        fits = (long >= low * block_s) & (~later | (room >= 0.5 * (low + was) * t))
        cost = best[b] + long / low + np.where(later, price + t * dv / (2.0 * fast), 0.0)
        cost = np.where(fits | ((b == 0) & (end == n - 1)), cost, np.inf)
        k = int(np.argmin(cost))
        best[end], before[end], speed[end], own[end] = cost[k], b[k], low[k], long[k]
    out, end = list[int](), int(before[n - 1])
    while end > 0:
        out.append(int(at[end - 1]))
        end = int(before[end])
    return np.array(out[::-1], dtype=np.int64)


def _candidates(v: Floats) -> Ints:
    """Stations (k,) near which the allowed feed changes."""
    changes = np.flatnonzero(np.diff(v) != 0.0)
    beside = (changes[:, None] + np.arange(1 - BESIDE, 1 + BESIDE)).ravel()
    return np.unique(beside[(beside >= 0) & (beside < len(v))]).astype(np.int64)


def segment_feeds(feed: ArrayLike, ends: ArrayLike) -> Floats:
    """Return the feed (k + 1,) of each segment of a line that is divided at stations ``ends`` (k,).

    >>> segment_feeds([4.0, 5.0, 2.0, 3.0], [1]).tolist()
    [4.0, 2.0]
    """
    v = np.asarray(feed, dtype=np.float64)
    bounds = [0, *np.asarray(ends, dtype=np.int64).tolist(), len(v) - 1]
    return np.array([v[a : b + 1].min() for a, b in pairwise(bounds)])
