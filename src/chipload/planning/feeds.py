"""The feed of every line of a program, as fast as the loads allow; the path stays.

Notation: a factor is the new feed over the programmed one; the ratio of a step is its worst load over the limit of that
load. What a step removes does not depend on the feed, its loads do: they rise with the factor. A text states one feed a
line: the least of its steps. Feeds of lines are in any one unit.

The greatest factor whose ratio is at most 1 is bracketed and closed in by the Illinois method: where the ratio is
linear in the feed (no size effect, no runout, no edge forces) its first step is exact. What is returned was itself
evaluated and is within its limits; between two evaluations nothing is assumed but that the ratio rises.

Reference: [Dowell1971] for the Illinois method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: evaluations of the ratio at most
MOST_LOOKS = 60
#: the ratio that is aimed at is within (1 - TARGET - CLOSE, 1 - TARGET]: rounding must not lift a load over its limit
TARGET = 1e-6
#: a bracket as narrow as this is closed: a jump of the ratio lies in it
NARROW = 1e-7
#: looks before a bracket is halved, which closes in on a jump
SECANTS = 12


class StepContact(IntEnum):
    """What a step does to the stock."""

    AIR = 0
    FILM = 1  # it removes less than the tolerance resolves: it touches, its loads are not known
    CUT = 2


@dataclass(frozen=True, eq=False)
class LineFeeds:
    """Factors by line.

    Parameters
    ----------
    line : (m,) int, rising
    touch : (m,) int, the most that a step of the line does, :class:`StepContact`
    least, allowed : (m,) float, the least factor that is wanted, the greatest that every step allows
    by : (m,) int, what limits it, as passed to ``line_feeds``; :data:`SLOWEST` where a limit requires less
    """

    line: Ints
    touch: Ints
    least: Floats
    allowed: Floats
    by: Ints


#: codes of what holds a line besides limits, whose codes follow
SLOWEST, KEPT, FASTEST, MACHINE, AIR, LIMITED = -1, -2, 0, 1, 2, 3


def greatest_factor(
    ratio: Callable[[Floats], Floats], slowest: ArrayLike, fastest: ArrayLike, close: float = 1e-4
) -> Floats:
    """Greatest factor (n,) at which each step is within its limits; nan: none from ``slowest`` on.

    Parameters
    ----------
    ratio : of the steps at factors (n,), never falling
    slowest, fastest : (n,) float, 0 < slowest <= fastest
    close : how much of its limit a step that is held by one may leave unused

    >>> greatest_factor(lambda k: np.array([2.0, 9.0, 0.1]) * k, [0.2] * 3, [3.0] * 3).round(4).tolist()
    [0.5, nan, 3.0]
    """
    low, high = (np.array(x, dtype=np.float64) for x in (slowest, fastest))
    if low.ndim != 1 or low.shape != high.shape or not ((low > 0.0) & (low <= high)).all():
        raise InputError("feeds: slowest and fastest must be (n,) with 0 < slowest <= fastest")
    if not 0.0 < close < 1.0:
        raise InputError(f"feeds: close = {close:g}: must be between 0 and 1")
    wanted = 1.0 - TARGET - 0.5 * close
    at_low, at_high = ratio(low) - wanted, ratio(high) - wanted
    over, under = 0.5 * close, -0.5 * close
    none, free = at_low > over, at_high <= over
    out = np.where(free & ~none, high, low)
    active = ~none & ~free & (at_low < under)
    side = np.zeros(len(low))
    for trial in range(MOST_LOOKS):
        active &= high - low > NARROW * high
        if not active.any():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            aim = high - at_high * (high - low) / (at_high - at_low)
        if trial >= SECANTS:
            aim = 0.5 * (low + high)
        x = np.where(active, np.clip(np.where(np.isnan(aim), low, aim), low, high), out)
        y = ratio(x) - wanted
        below = active & (y <= over)
        out = np.where(below, x, out)
        above = active & ~below
        # Illinois: an end that stays twice counts half
        at_high = np.where(below & (side < 0.0), 0.5 * at_high, np.where(above, y, at_high))
        at_low = np.where(above & (side > 0.0), 0.5 * at_low, np.where(below, y, at_low))
        low, high = np.where(below, x, low), np.where(above, x, high)
        side = np.where(below, -1.0, np.where(above, 1.0, side))
        active &= ~(below & (y >= under))
    return np.where(none, np.nan, out)


def line_feeds(line: ArrayLike, touch: ArrayLike, least: ArrayLike, most: ArrayLike, by: ArrayLike) -> LineFeeds:
    """What each line allows: the least of its steps; O(n log n).

    A line that leaves films and nothing else keeps its feed.

    Parameters
    ----------
    line : (n,) int, of each step that moves at a feed
    touch : (n,) int, :class:`StepContact`
    least : (n,) float, the least factor that is wanted of each
    most : (n,) float, the greatest factor of each; nan: a limit requires less than the least
    by : (n,) int, what holds each, at least 0

    >>> found = line_feeds([4, 4, 5], [2, 0, 2], [0.5] * 3, [2.0, 3.0, np.nan], [1, 0, 1])
    >>> found.allowed.tolist(), found.by.tolist(), found.touch.tolist()
    ([2.0, 0.5], [1, -1], [2, 2])
    """
    at, low = np.asarray(line, dtype=np.int64), np.asarray(least, dtype=np.float64)
    high, code = np.asarray(most, dtype=np.float64), np.asarray(by, dtype=np.int64)
    none = np.isnan(high)
    worst = np.where(none, -np.inf, high)
    lines, of = np.unique(at, return_inverse=True)
    order = np.lexsort((worst, at))
    first = order[np.searchsorted(at[order], lines)]
    does, floor = np.zeros(len(lines), dtype=np.int64), np.zeros(len(lines))
    np.maximum.at(does, of, np.asarray(touch, dtype=np.int64))
    np.maximum.at(floor, of, low)
    allowed = np.where(none[first], floor, high[first])
    film = does == StepContact.FILM
    holds = np.where(none[first], SLOWEST, code[first])
    return LineFeeds(lines, does, np.where(film, 1.0, floor), np.where(film, 1.0, allowed), np.where(film, KEPT, holds))


def steady_feeds(allowed: ArrayLike, useful: ArrayLike, least: ArrayLike, old: ArrayLike, share: float) -> Floats:
    """Feeds of lines in their order that do not flicker: a feed stays that of the line before, or the programmed one,
    as long as it is allowed, not below the least, and short of what is useful by at most ``share`` of it.

    Parameters
    ----------
    allowed : (m,) float, above 0
    useful : (m,) float, at most that: what the line reaches
    least : (m,) float
    old : (m,) float, programmed
    share : 0 to below 1

    >>> steady_feeds([5.0, 5.2, 9.0, 5.1], [5.0, 5.2, 9.0, 5.1], [1.0] * 4, [4.0] * 4, 0.1).tolist()
    [5.0, 5.0, 9.0, 5.1]
    """
    if not 0.0 <= share < 1.0:
        raise InputError(f"feeds: share = {share:g}: must be at least 0 and below 1")
    columns = (np.asarray(x, dtype=np.float64).tolist() for x in (allowed, useful, least, old))
    out: list[float] = []
    for most, enough, floor, was in zip(*columns, strict=True):
        low = max((1.0 - share) * enough, min(floor, most))
        stays = next((v for v in (*out[-1:], was) if low <= v <= most), None)
        out.append(max(enough, low) if stays is None else stays)
    return np.array(out)
