"""Limit checks: comparison of a limit with the worst value of its column, and the resulting state.

Notation: e relative error of a column, from the resolution of the calculation and from the spread of coefficients; a
value v stands for v - e |v| .. v + e |v|. A limit that lies above this band holds, one below it is exceeded, one inside
it is unproven. Where a limit is the least allowed value (:attr:`Column.least`), the comparison is reversed. A check
names the rows that it covers (:class:`~chipload.result.coverage.Coverage`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.number_text import number_text, percent_text, place_text, worst_text
from chipload.result.budget import ErrorBudget, level_text
from chipload.result.columns import Column, column_of, error_of
from chipload.result.coverage import FAR_BEYOND, WHOLE, Coverage, CoveredRows, coverage_of
from chipload.result.feed_law import FeedLaw
from chipload.result.verdict import Verdict

Columns = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class LimitCheck:
    """Comparison of a limit with the worst value of the column that it bounds.

    Parameters
    ----------
    name : of the limit, as in the job's ``[limits]``
    limit, worst : in the unit of the column; ``worst`` None: nothing is known of it
    state : whether it holds
    track : name of the track; empty: the whole result
    row : of the track's history, from 0; None: not a row of it
    line : of the program's text; 0: none
    place : (x, y, z) [mm] in the workpiece frame
    t_s : time in the track [s]
    resolution_error : relative error of ``worst`` by the resolution of the calculation; None: 0 where the column is
        exact, else it is not stated, and the limit cannot hold
    reason : why it is unproven; empty otherwise
    absolute_error : how much worse a value between the points that are checked may be, in the unit of the column
    coverage : rows of the history that the limit covers
    budget : parts of the error of ``worst``, and the confidence at which the limit is held; None: it is no load
    feed_law : how the column changes with the feed; None: it is not known, or it does not

    Raises
    ------
    ValueError
        A number is not finite, an error is below 0, a value is missing where the state is not unproven, or a limit
        holds although nothing states the error of its column.
    """

    name: str
    limit: float
    worst: float | None
    state: Verdict
    track: str = ""
    row: int | None = None
    line: int = 0
    place: tuple[float, float, float] | None = None
    t_s: float | None = None
    resolution_error: float | None = None
    reason: str = ""
    absolute_error: float = 0.0
    coverage: Coverage = WHOLE
    budget: ErrorBudget | None = None
    feed_law: FeedLaw | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that are not finite, a missing worst value without a reason, and an unknown error."""
        if self.worst is None and self.state is not Verdict.UNPROVEN:
            raise ValueError(f"limit {self.name}: without a value it can only be unproven, not {self.state}")
        if self.resolution_error is None:
            if self.state is Verdict.HOLDS and not math.isfinite(error_of(self.column.name, {})):
                raise ValueError(f"limit {self.name}: holds, but its resolution_error is not stated")
            object.__setattr__(self, "resolution_error", 0.0)
        numbers = [self.limit, self.error, self.absolute_error, *(self.place or ())]
        numbers += [x for x in (self.worst, self.t_s) if x is not None]
        if not all(map(math.isfinite, numbers)):
            raise ValueError(f"limit {self.name}: {numbers} must be finite")
        if self.error < 0.0:
            raise ValueError(f"limit {self.name}: resolution_error = {self.error}: must be at least 0")
        if self.absolute_error < 0.0:
            raise ValueError(f"limit {self.name}: absolute_error = {self.absolute_error}: must be at least 0")

    @property
    def column(self) -> Column:
        """The column that the limit bounds."""
        return column_of(self.name)

    @property
    def error(self) -> float:
        """Relative error of the worst value."""
        return self.resolution_error or 0.0

    @property
    def by_confidence(self) -> bool:
        """Whether the limit is held at a confidence above 0.5, so that its value there counts."""
        held = self.budget is not None and self.budget.confidence > 0.5
        return held and self.worst is not None and self.state is not Verdict.EXCEEDS

    @property
    def factor(self) -> float:
        """What the worst value may be, at the confidence of the limit, over its nominal value."""
        if self.budget is None or self.budget.confidence <= 0.5:
            return 1.0 + self.error
        return self.budget.value(1.0)

    @property
    def value_at_confidence(self) -> float | None:
        """What the worst value may be at the confidence that is shown; None: it has no budget or no value."""
        if self.budget is None or self.worst is None:
            return None
        return self.budget.value(abs(self.worst), self.budget.shown_at, least=self.column.least)

    @property
    def confidence_text(self) -> str:
        """The value at the confidence that is shown, with its parts in falling order; empty where there is none.

        >>> from chipload.result.budget import ErrorPart
        >>> parts = (ErrorPart("resolution", bound=0.02), ErrorPart("coefficients", deviation=0.1))
        >>> check = LimitCheck("force_n", 200.0, 150.0, Verdict.HOLDS, resolution_error=0.02)
        >>> hold_at_confidence(check, ErrorBudget(0.5, parts)).confidence_text
        'at 95 %: force 180 N (coefficients 27, resolution 3)'
        """
        value = self.value_at_confidence
        if value is None or self.budget is None or self.worst is None:
            return ""
        parts = self.budget.parts_text(self.worst)
        text = f"at {level_text(self.budget.shown_at)}: {self.column.label} {number_text(value, 3)}{self._unit}"
        return f"{text} ({parts})" if parts else text

    @property
    def margin(self) -> float | None:
        """How far the worst value, at the confidence of the limit, lies within the limit, over the limit; below 0:
        beyond it; None: it has none.

        >>> LimitCheck("force_n", 500.0, 412.0, Verdict.HOLDS, resolution_error=0.01).margin
        0.176
        """
        if self.worst is None or self.limit == 0.0:
            return None
        worst = abs(self.worst) if self.column.signed else self.worst
        if self.by_confidence and self.budget is not None:
            worst = self.budget.value(worst, least=self.column.least)
        beyond = worst / self.limit - 1.0
        return round(beyond if self.column.least else -beyond, 12)

    @property
    def margin_text(self) -> str:
        """The margin in words; empty where there is none.

        >>> LimitCheck("force_n", 500.0, 812.0, Verdict.EXCEEDS).margin_text
        '62.4 % beyond the limit'
        """
        if self.margin is None:
            return ""
        return (
            f"{percent_text(abs(self.margin))} beyond the limit"
            if self.margin < 0.0
            else (f"margin {percent_text(self.margin)}")
        )

    @property
    def place_text(self) -> str:
        """The place in mm, to 0.01 mm; empty if it is not known.

        >>> LimitCheck("force_n", 500.0, 812.0, Verdict.EXCEEDS, place=(5.7e-17, 2.25, -33.33333)).place_text
        '0, 2.25, -33.33'
        """
        return place_text(self.place or ())

    @property
    def worst_text(self) -> str:
        """The worst value, with as many digits as show on which side of the limit it lies.

        >>> [LimitCheck("force_n", 500.0, f, Verdict.EXCEEDS).worst_text for f in (812.34, 500.04)]
        ['812', '500.04']
        """
        return "not known" if self.worst is None else worst_text(self.worst, self.limit)

    @property
    def where(self) -> str:
        """Line and place, as far as they are known.

        >>> LimitCheck("force_n", 500.0, 812.0, Verdict.EXCEEDS, line=12, place=(1.0, 2.0, 3.0)).where
        'in line 12 at (1, 2, 3)'
        """
        at = f"at ({self.place_text})" if self.place is not None else ""
        return " ".join(text for text in (f"in line {self.line}" if self.line else "", at) if text)

    @property
    def text(self) -> str:
        """The check as a sentence.

        >>> LimitCheck("force_n", 500.0, 812.0, Verdict.EXCEEDS, line=12).text
        'force 812 N exceeds 500 N in line 12'
        >>> LimitCheck("force_n", 500.0, 412.0, Verdict.HOLDS, resolution_error=0.01).text
        'force 412 of 500 N'
        >>> LimitCheck("axial_overrun_mm", 0.0, 0.0, Verdict.HOLDS, resolution_error=0.0).text
        'no cut above the flutes'
        >>> LimitCheck("torque_nm", 3.0, 2.9, Verdict.UNPROVEN, line=7, reason="coarse").text
        'torque 2.9 of 3 N m in line 7, unproven: coarse'
        >>> [LimitCheck("unreached_points", 0.0, n, s).text for n, s in ((0.0, Verdict.HOLDS), (3.0, Verdict.EXCEEDS))]
        ['all contact points reached', '3 contact points not reached']
        """
        if self.worst is None:
            bound = "at least" if self.column.least else "at most"
            return f"{self.column.label} of {bound} {number_text(self.limit, 6)}{self._unit} is unknown: {self.reason}"
        if self.state is Verdict.EXCEEDS and not self._counts_none:
            beyond = "is below" if self.column.least else "exceeds"
            limit, unit = number_text(self.limit, 6), self._unit
            return f"{self.column.label} {self.worst_text}{unit} {beyond} {limit}{unit} {self.where}".rstrip()
        if self.state is Verdict.UNPROVEN:
            return f"{self.value_text} {self.where}".rstrip() + f", unproven: {self.reason}"
        return self.value_text

    @property
    def _counts_none(self) -> bool:
        """Whether the limit allows none of what is counted, so that there is no margin."""
        return self.limit == 0.0 and bool(self.column.none)

    @property
    def value_text(self) -> str:
        """The worst value and the limit, without state and place."""
        label, limit = self.column.label, f"{number_text(self.limit, 6)}{self._unit}"
        if self.worst is None:
            return f"{label} of {limit}"
        worst = self.worst_text
        if self.by_confidence and self.budget is not None:
            more = self.budget.value(abs(self.worst), least=self.column.least) - abs(self.worst)
            worst += f" {'-' if more < 0.0 else '+'} {number_text(abs(more), 2)}"
        text = f"{label} {worst} of {'at least ' if self.column.least else ''}{limit}"
        if self.worst == self.limit == 0.0:
            text = self.column.none or f"no {label}"
        elif self._counts_none:
            text = f"{self.worst_text} {label}"
        elif self.state is Verdict.UNPROVEN and self.margin is not None and self.margin < -FAR_BEYOND:
            text = f"{label} far beyond {limit}"
        return text if self.coverage.whole or self.state is not Verdict.HOLDS else f"{text} in the {self.coverage.name}"

    @property
    def _unit(self) -> str:
        return f" {self.column.unit}" if self.column.unit else ""


def hold_at_confidence(check: LimitCheck, budget: ErrorBudget) -> LimitCheck:
    """Return a check with the budget of its load: what holds at the nominal value holds if its value at the confidence
    does, else it is unproven.

    >>> from chipload.result.budget import ErrorPart
    >>> check = LimitCheck("force_n", 200.0, 150.0, Verdict.HOLDS, resolution_error=0.0)
    >>> fit = ErrorPart("coefficients", deviation=0.1, remedy="fit them")
    >>> hold_at_confidence(check, ErrorBudget(0.95, (fit,))).text
    'force 150 + 27 of 200 N'
    >>> hold_at_confidence(check, ErrorBudget(0.999, (fit,))).text
    'force 150 + 54 of 200 N, unproven: at 99.9 % it may be 204 N (coefficients 54), only by coefficients: fit them'
    """
    if check.worst is None:
        return check
    out = replace(check, budget=budget)
    if check.state is not Verdict.HOLDS or budget.confidence <= 0.5:
        return out
    least = check.column.least
    value = budget.value(abs(check.worst), least=least)
    if value >= check.limit if least else value <= check.limit:
        return out
    unit = f" {check.column.unit}" if check.column.unit else ""
    alone, remedy = budget.remedy(abs(check.worst), check.limit, least=least)
    parts = budget.parts_text(check.worst)
    reason = f"at {level_text(budget.confidence)} it may be {number_text(value, 3)}{unit} ({parts})"
    reason += f", only by {alone.name}" if alone is not None else ""
    return replace(out, state=Verdict.UNPROVEN, reason=f"{reason}: {remedy}" if remedy else reason)


def state_of(
    worst: float, limit: float, error: float, reason: str = "", *, least: bool = False, absolute: float = 0.0
) -> tuple[Verdict, str]:
    """Return the state of a value against its limit, and the reason if it is unproven.

    Parameters
    ----------
    error : relative error of ``worst``
    reason : why the value may be worse, whatever its error; empty: it may not
    least : whether the limit is the least value that is allowed
    absolute : how much worse the value may be between the points that are checked

    Raises
    ------
    ValueError
        A number is not finite.

    Examples
    --------
    >>> [state_of(worst, 500.0, 0.05)[0].value for worst in (470.0, 490.0, 600.0)]
    ['holds', 'unproven', 'exceeds']
    """
    if not (math.isfinite(worst) and math.isfinite(limit)) or math.isnan(error) or math.isnan(absolute):
        raise ValueError(f"value {worst} and limit {limit} must be finite, error {error} a number")
    if math.isinf(error) or math.isinf(absolute):
        return Verdict.UNPROVEN, reason or "the resolution of the calculation causes an error of unknown size"
    band = error * abs(worst)
    if least:
        worst, limit = -worst, -limit
    if worst - band > limit:
        return Verdict.EXCEEDS, ""
    if reason:
        return Verdict.UNPROVEN, reason
    if worst + band > limit:
        known = f"known to {percent_text(error)}" if error <= 1.0 else "not known: its error is greater than itself"
        return Verdict.UNPROVEN, f"the value is {known}, and the limit lies within this"
    if worst + band + absolute > limit:
        more = number_text(absolute, 3)
        return Verdict.UNPROVEN, f"between the points that are checked it may be worse by {more}, beyond the limit"
    return Verdict.HOLDS, ""


def check_limit(
    name: str,
    limit: float,
    columns: Columns,
    *,
    track: str = "",
    rows: CoveredRows | None = None,
    at: int | None = None,
    error: float | None = None,
    absolute: float = 0.0,
    reason: str = "",
) -> LimitCheck:
    """Compare a limit with the greatest value of its column, or with the least if the limit is a least allowed value.

    Parameters
    ----------
    name : of the limit
    columns : (n,) each; the column of the limit and, as far as they are there, ``line``, ``x_mm`` .. ``z_mm``, ``t_s``
    rows : rows that count, with their name; None: all
    at : row with the worst value, for a limit that differs from row to row; None: it is searched
    error : relative error of the column; inf: it is not known; None: 0 where the column is exact, else not known
    absolute : how much worse a value between the points that are checked may be, in the unit of the column
    reason : why the column may be too small; empty: it is not

    Examples
    --------
    >>> force = {"force_n": np.array([100.0, 480.0]), "line": np.array([3, 4])}
    >>> check_limit("force_n", 500.0, force, error=0.01).state, check_limit("force_n", 470.0, force, error=0.0).text
    (<Verdict.HOLDS: 'holds'>, 'force 480 N exceeds 470 N in line 4')
    >>> check_limit("force_n", 500.0, force).text
    'force 480 of 500 N in line 4, unproven: the resolution error of force is not known'
    """
    column = column_of(name)
    if column.name not in columns:
        missing = reason or f"{column.label} was not calculated"
        return LimitCheck(name, limit, None, Verdict.UNPROVEN, track, reason=missing)
    values = np.asarray(columns[column.name], dtype=np.float64)
    size = np.abs(values) if column.signed else values
    worse = -size if column.least else size
    among = np.arange(len(size)) if rows is None else np.flatnonzero(rows.mask)
    covered = WHOLE if rows is None else coverage_of(rows, worse, size, columns)
    if at is not None:
        among = np.array([at])
    if len(among) == 0:
        why = reason or "no step was checked"
        return LimitCheck(name, limit, None, Verdict.UNPROVEN, track, reason=why, coverage=covered)
    if error is None:
        error = error_of(column.name, {})
    if not math.isfinite(error):
        error, reason = 0.0, reason or f"the resolution error of {column.label} is not known"
    k = int(among[np.argmax(worse[among])])
    worst = float(size[k])
    state, why = state_of(worst, limit, error, reason, least=column.least, absolute=absolute)
    place = None
    if {"x_mm", "y_mm", "z_mm"} <= set(columns):
        place = (float(columns["x_mm"][k]), float(columns["y_mm"][k]), float(columns["z_mm"][k]))
    line = int(columns["line"][k]) if "line" in columns else 0
    t = float(columns["t_s"][k]) if "t_s" in columns else None
    return LimitCheck(name, limit, worst, state, track, k, line, place, t, error, why, absolute, covered)
