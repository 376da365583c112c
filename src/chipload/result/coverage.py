"""The rows of a history that a limit covers, and what is left out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.number_text import number_text

Bools = NDArray[np.bool_]
Columns = Mapping[str, NDArray[Any]]
#: name of the rows of a limit that covers the whole program
EVERYTHING = "all cuts"
#: a value so many times its limit is not written as a number where it is not the worst of a check
FAR_BEYOND = 10.0
#: columns that are above 0 where a step cuts, the first that a history has
CUTTING = (
    "chip_volume_mm3", "chip_areas", "engagement_deg", "force_n", "force_xy_n", "force_normal_n", "torque_mean_nm",
    "torque_nm",
)  # fmt: skip


@dataclass(frozen=True)
class CoveredRows:
    """Rows that a limit covers, for a check.

    Parameters
    ----------
    mask : (n,) the rows that count
    name : of these rows, such as ``finish pass``
    reason : why the limit does not count for the other rows
    """

    mask: Bools
    name: str
    reason: str


@dataclass(frozen=True)
class Coverage:
    """The rows of a track's history that a limit check covers.

    Parameters
    ----------
    name : of the covered rows: ``all cuts``, ``finish pass``
    reason : why the limit does not count for the other rows; empty: it counts for all
    ranges : (first, end) of the covered rows, from 0, rising; None: all rows
    excluded_s : time in the cut of the rows that are not covered [s]
    excluded_worst : worst value of the column in the cuts that are not covered; None: there are none

    Raises
    ------
    ValueError
        Ranges do not rise, a number is not finite, or rows are left out without a reason.
    """

    name: str = EVERYTHING
    reason: str = ""
    ranges: tuple[tuple[int, int], ...] | None = None
    excluded_s: float = 0.0
    excluded_worst: float | None = None

    def __post_init__(self) -> None:
        """Refuse ranges that do not rise and rows that are left out without a reason."""
        ends = [end for pair in self.ranges or () for end in pair]
        if ends != sorted(set(ends)) or (ends and ends[0] < 0):
            raise ValueError(f"coverage {self.name}: ranges {self.ranges} must rise from 0")
        if not (math.isfinite(self.excluded_s) and math.isfinite(self.excluded_worst or 0.0)) or self.excluded_s < 0.0:
            raise ValueError(f"coverage {self.name}: excluded_s = {self.excluded_s}: must be finite and at least 0")
        if not self.name or (self.ranges is not None and not self.reason):
            raise ValueError(f"coverage {self.name!r}: rows that are left out need a name and a reason")

    @property
    def whole(self) -> bool:
        """Whether no cut is left out."""
        return self.excluded_worst is None

    def mask(self, n: int) -> Bools:
        """(n,) rows that are covered.

        >>> Coverage("finish pass", "the wall is made there", ((0, 1), (2, 4))).mask(5).tolist()
        [True, False, True, True, False]
        """
        if self.ranges is None:
            return np.ones(n, dtype=np.bool_)
        out = np.zeros(n, dtype=np.bool_)
        for first, end in self.ranges:
            out[first:end] = True
        return out

    @property
    def outside(self) -> str:
        """The time in the cut that is left out, and why.

        >>> Coverage("finish pass", "where the wall is made", ((4, 9),), 12.5, 55.0).outside
        '12.5 s of cuts outside the finish pass (limits count where the wall is made)'
        """
        return f"{number_text(self.excluded_s, 3)} s of cuts outside the {self.name} (limits count {self.reason})"

    def excluded_text(self, label: str, unit: str, limit: float) -> str:
        """The worst value that is left out, in words; empty where no cut is left out.

        >>> Coverage("finish pass", "where the wall is made", ((4, 9),), 12.5, 55.0).excluded_text("force", "N", 50.0)
        'force reaches 55 N'
        """
        if self.excluded_worst is None:
            return ""
        if limit > 0.0 and self.excluded_worst > FAR_BEYOND * limit:
            return f"{label} lies far beyond its limit"
        return f"{label} reaches {number_text(self.excluded_worst)} {unit}".rstrip()


#: of a limit that covers the whole program
WHOLE = Coverage()


def cutting_rows(columns: Columns) -> Bools:
    """(n,) rows that cut; all where no column tells."""
    name = next((name for name in CUTTING if name in columns), None)
    n = len(next(iter(columns.values()))) if columns else 0
    return np.ones(n, dtype=np.bool_) if name is None else np.asarray(columns[name]) > 0


def durations(columns: Columns) -> NDArray[np.float64]:
    """(n,) time of each row [s]; 0 where the history has no time."""
    if "duration_s" in columns:
        return np.asarray(columns["duration_s"], dtype=np.float64)
    if "t_s" in columns:
        return np.diff(np.asarray(columns["t_s"], dtype=np.float64), prepend=0.0)
    return np.zeros(len(next(iter(columns.values()))) if columns else 0)


def ranges_of(mask: Bools) -> tuple[tuple[int, int], ...]:
    """Return the (first, end) of each run of rows that are True.

    >>> ranges_of(np.array([True, False, True, True]))
    ((0, 1), (2, 4))
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], np.asarray(mask, dtype=np.bool_), [False]])))
    return tuple(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def coverage_of(rows: CoveredRows, worse: NDArray[np.float64], size: NDArray[np.float64], columns: Columns) -> Coverage:
    """Return the coverage of a check.

    Parameters
    ----------
    worse : (n,) what is greater where the value is worse
    size : (n,) values as they are compared
    columns : of the history
    """
    mask = np.asarray(rows.mask, dtype=np.bool_)
    left = np.flatnonzero(~mask & cutting_rows(columns) & np.isfinite(worse))
    if mask.all():
        return Coverage(rows.name)
    seconds = float(durations(columns)[left].sum())
    worst = float(size[left[np.argmax(worse[left])]]) if len(left) else None
    return Coverage(rows.name, rows.reason, ranges_of(mask), seconds, worst)
