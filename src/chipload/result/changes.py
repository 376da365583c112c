"""Changes that would settle a limit that is exceeded or not proven, each with the margin that it would have."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from chipload.number_text import number_text, percent_text
from chipload.result.budget import ErrorBudget, ErrorPart
from chipload.result.coverage import ranges_of
from chipload.result.feed_law import FeedLaw
from chipload.result.limits import Columns, LimitCheck
from chipload.result.track import Track
from chipload.result.verdict import Verdict

#: changes that are listed
MOST = 3
#: margin that a lower feed is to leave, and the least feed that is proposed over the old one
SPARE, SLOWEST = 0.02, 0.2
#: lines that are named one by one
NAMED = 4
#: columns that a lower feed is found from
NEEDED = ("line", "chip_max_mm", "rapid")


class ChangeKind(enum.StrEnum):
    """What is changed."""

    FEED = "feed"
    STATEMENT = "statement"


@dataclass(frozen=True)
class Change:
    """A change that would settle a limit.

    Parameters
    ----------
    kind : what is changed
    text : the change in words
    limit : label of the limit that it settles
    margin : that the limit would then have, over the limit
    error : how far the margin may be from that
    track : name of the track
    factor : new feed over the old one; 1: it stays
    lines : of the program that get it
    """

    kind: ChangeKind
    text: str
    limit: str
    margin: float
    error: float
    track: str
    factor: float = 1.0
    lines: tuple[int, ...] = ()

    @property
    def line_text(self) -> str:
        """The change and what it would lead to.

        >>> Change(ChangeKind.FEED, "feed of line 7 at 80 %", "force", 0.025, 0.01, "program").line_text
        'feed of line 7 at 80 %: force with margin 2.5 % (+- 1 %)'
        """
        more = f" (+- {percent_text(self.error)})" if self.error >= 5e-4 else ""
        return f"{self.text}: {self.limit} with margin {percent_text(self.margin)}{more}"


def propose_changes(track: Track) -> tuple[Change, ...]:
    """Return up to three changes that would settle limits of a track that do not hold, the greatest margin first.

    A lower feed counts for all limits of loads: its lines are those with a value that is too great, and its factor is
    the greatest at which each of their steps is within each limit. A statement takes a part out of the error budget.
    """
    unsettled = [check for check in track.limits if check.state is not Verdict.HOLDS and check.worst is not None]
    out = [change for check in unsettled if (change := statement_change(check, track.name)) is not None]
    if any(check.feed_law is not None for check in unsettled):
        lower = feed_change(track, unsettled)
        out += [lower] if lower is not None else []
    return tuple(sorted(dict.fromkeys(out), key=lambda change: -change.margin)[:MOST])


def statement_change(check: LimitCheck, track: str) -> Change | None:
    """Return the statement that alone would prove a limit; None: none would, or its value exceeds in any case.

    >>> fit = ErrorPart("coefficients", deviation=0.1, remedy="measure the coefficients")
    >>> own = ErrorBudget(0.95, (fit, ErrorPart("turns", deviation=0.015)))
    >>> check = LimitCheck("force_n", 200.0, 180.0, Verdict.UNPROVEN, resolution_error=0.0, reason="x", budget=own)
    >>> statement_change(check, "program").line_text
    'measure the coefficients: force with margin 7.75 %'
    """
    own = check.budget
    if own is None or own.confidence <= 0.5 or check.state is not Verdict.UNPROVEN or check.worst is None:
        return None
    if check.margin is not None and check.margin >= 0.0:
        return None  # the budget leaves room: it is unproven for another reason
    best: tuple[float, ErrorPart] | None = None
    for part in own.parts:
        if not part.remedy:
            continue
        rest = ErrorBudget(own.confidence, tuple(p for p in own.parts if p is not part))
        margin = replace(check, budget=rest).margin
        if margin is not None and margin >= 0.0 and (best is None or margin > best[0]):
            best = (margin, part)
    if best is None:
        return None
    return Change(ChangeKind.STATEMENT, best[1].remedy, check.column.label, best[0], 0.0, track)


def feed_change(track: Track, checks: Sequence[LimitCheck]) -> Change | None:
    """Return the lower feed of the lines whose loads are too great; None: no feed from a fifth on would.

    Parameters
    ----------
    checks : limits of the track that do not hold
    """
    bound = [check for check in checks if check.feed_law is not None and check.limit > 0.0]
    columns = _read_columns(track, {*NEEDED, *(check.column.name for check in bound)})
    if not {"line", "chip_max_mm"} <= set(columns):
        return None
    line = np.asarray(columns["line"], dtype=np.int64)
    sizes = {check.name: _sizes(check, columns) for check in bound if check.column.name in columns}
    # a limit whose values are all within it is not proven for another reason
    bound = [
        check
        for check in bound
        if check.name in sizes and sizes[check.name].max(initial=0.0) * check.factor > check.limit
    ]
    over = np.zeros(len(line), dtype=np.bool_)
    for check in bound:
        over |= sizes[check.name] * check.factor > (1.0 - SPARE) * check.limit
    lines = np.unique(line[over & (line > 0)])
    if not len(lines):
        return None
    own = np.isin(line, lines)
    chip = np.nan_to_num(np.asarray(columns["chip_max_mm"], dtype=np.float64))
    factors: list[tuple[float, LimitCheck, FeedLaw]] = []
    for check in bound:
        law = check.feed_law
        if law is None:
            continue
        most = (1.0 - SPARE) * check.limit
        needed = partial(
            law.greatest_factor, sizes[check.name][own], most, chip[own], SLOWEST, partial(_factor_at, check, chip)
        )
        # where no feed settles it for certain, the one that does by the middle of what is known, with its interval
        k = needed() or needed(sure=False)
        if k is None:
            return None
        factors.append((k, check, law))
    if not factors or min(k for k, *_ in factors) >= 1.0:
        return None
    # one percent is what a person writes
    lowest, check, law = min(factors, key=lambda one: one[0])
    percent, size = math.floor(100.0 * lowest), sizes[check.name]
    rest = check.factor * float(size[~own].max(initial=0.0))

    def ends(feed_share: float) -> tuple[float, float]:
        levels = (check.factor, _factor_at(check, chip, feed_share))
        low, high = (
            max(level * float((size[own] * x).max(initial=0.0)), rest)
            for x, level in zip(law.ratios(feed_share, chip[own]), levels, strict=True)
        )
        return low, high

    while sum(ends(1e-2 * percent)) > 2.0 * check.limit and 1e-2 * percent > SLOWEST:
        percent -= 1
    feed_share = 1e-2 * percent
    low, high = ends(feed_share)
    margin, error = 1.0 - 0.5 * (low + high) / check.limit, 0.5 * (high - low) / check.limit
    if margin < 0.0:
        return None
    text = f"feed of {_line_text(lines)} at {number_text(100.0 * feed_share, 3)} %"
    return Change(
        ChangeKind.FEED, text, check.column.label, margin, error, track.name, feed_share, tuple(lines.tolist())
    )  # fmt: skip


def _factor_at(check: LimitCheck, chip: NDArray[np.float64], factor: float) -> float:
    """What a value may be at another feed, at the confidence of the limit, over its nominal one: what runout adds stays
    while the value falls.
    """
    if check.budget is None or check.budget.confidence <= 0.5 or check.feed_law is None or check.row is None:
        return check.factor
    least, _ = check.feed_law.ratios(factor, chip[check.row : check.row + 1])
    return check.budget.at_feed(float(least[0])).value(1.0)


def _sizes(check: LimitCheck, columns: Columns) -> NDArray[np.float64]:
    """(n,) nominal values that the limit is compared with; 0 where it does not count."""
    size = np.abs(np.nan_to_num(np.asarray(columns[check.column.name], dtype=np.float64)))
    return np.where(check.coverage.mask(len(size)), size, 0.0)


def _read_columns(track: Track, names: Iterable[str]) -> Columns:
    """The columns of these names of the history of a track."""
    wanted, blocks = set(names), list(track.blocks())
    found = [name for name in (blocks[0] if blocks else {}) if name in wanted]
    return {name: np.concatenate([np.asarray(block[name]) for block in blocks]) for name in found}


def _line_text(lines: NDArray[np.int64]) -> str:
    """Lines of a program in words.

    >>> _line_text(np.array([7])), _line_text(np.array([7, 8, 9])), _line_text(np.array([7, 9, 12]))
    ('line 7', 'lines 7 to 9', 'lines 7, 9, 12')
    """
    if len(lines) == 1:
        return f"line {lines[0]}"
    runs = ranges_of(np.isin(np.arange(lines[-1] + 1), lines))
    if len(runs) == 1:
        return f"lines {lines[0]} to {lines[-1]}"
    if len(lines) <= NAMED:
        return f"lines {', '.join(map(str, lines.tolist()))}"
    return f"{len(lines)} lines between {lines[0]} and {lines[-1]}"
