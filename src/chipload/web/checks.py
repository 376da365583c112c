"""Limits and findings of a track, and the row of its history that each belongs to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.report.colouring import lowest_limit, rows_beyond
from chipload.result import COLUMNS, LimitCheck, Verdict
from chipload.web.result import PageResult, PageTrack, TextColumn

#: findings that are listed
LISTED = 300


@dataclass(frozen=True, eq=False)
class Bound:
    """A limit of a column: ``above`` (n,) rows exceed it, or are below a limit that is a least value.

    ``covers`` names the rows that it covers; empty: all.
    """

    limit: float
    above: NDArray[np.bool_]
    covers: str = ""


@dataclass(frozen=True)
class PageFinding:
    """A finding on the page, and the row that it belongs to; None: none."""

    text: str
    row: int | None
    severity: Severity


def label_and_unit(column: str) -> tuple[str, str]:
    """Label and unit of a column.

    >>> label_and_unit("force_xy_n"), label_and_unit("feed_mm_min"), label_and_unit("s_mm")
    (('force across the axis', 'N'), ('feed', 'mm/min'), ('path', 'mm'))
    """
    known = COLUMNS.get(column)
    return (known.label, known.unit) if known is not None else (column.replace("_", " "), "")


def bound_of(result: PageResult, track: PageTrack, column: str) -> Bound | None:
    """The lowest limit of a column, of the rows that it covers."""
    check = lowest_limit(track.own.limits, column)
    if check is None or column not in result.columns:
        return None
    values = result.column(track, column)
    if isinstance(values, TextColumn):
        return None
    return Bound(check.limit, rows_beyond(values, check), "" if check.coverage.whole else check.coverage.name)


def limits(track: PageTrack) -> list[LimitCheck]:
    """The limits of a track, the worst state first, then the least margin; those whose margin is not known last."""
    order = list(Verdict)
    return sorted(track.own.limits, key=lambda c: (-order.index(c.state), math.inf if c.margin is None else c.margin))


def row_of(track: PageTrack, item: LimitCheck | Finding) -> int | None:
    """The row of a check or a finding: its own, else the nearest to its place on its line."""
    if item.row is not None and item.row < len(track):
        return item.row
    near = np.arange(len(track))
    if item.line and track.line is not None:
        own = np.flatnonzero(track.line == item.line)
        if len(own):
            near = own
        elif item.place is None:
            later = np.flatnonzero(track.line > item.line)
            return int(later[0]) if len(later) else None
    elif item.place is None:
        return None
    if item.place is None:
        return int(near[0])
    return int(near[np.argmin(np.linalg.norm(track.place[near] - np.array(item.place), axis=1))])


def findings(result: PageResult, track: PageTrack) -> list[PageFinding]:
    """What was found in the track and in the whole result, the worst first, then what was not checked."""
    out = [PageFinding(_text(f), row_of(track, f), f.severity) for f in track.own.findings]
    out += [PageFinding(_text(f), row_of(track, f), f.severity) for f in result.result.findings]
    out += [PageFinding(f"not checked: {text}", None, Severity.NOTE) for text in result.result.unchecked]
    if not track.own.in_use:
        out.append(PageFinding(f"{track.own.name} is not in use", None, Severity.NOTE))
    return sorted(dict.fromkeys(out), key=lambda f: -f.severity)[:LISTED]


def _text(f: Finding) -> str:
    return f"line {f.line}: {f.text}" if f.line else f.text
