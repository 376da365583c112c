"""Limit checks: comparison of a limit with the worst value of its column, and the resulting state.

Notation: e relative error of a column, from the resolution of the calculation and from the spread of coefficients; a
value v stands for v - e |v| .. v + e |v|. A limit that lies above this band holds, one below it is exceeded, one inside
it is unproven. Where a limit is the least allowed value (:attr:`Column.least`), the comparison is reversed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.result.columns import Column, column_of
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
    resolution_error : relative error of ``worst`` by the resolution of the calculation
    reason : why it is unproven; empty otherwise

    Raises
    ------
    ValueError
        A number is not finite, an error is below 0, or a value is missing where the state is not unproven.
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
    resolution_error: float = 0.0
    reason: str = ""

    def __post_init__(self) -> None:
        """Refuse numbers that are not finite, and a missing worst value without a reason."""
        numbers = [self.limit, self.resolution_error, *(self.place or ())]
        numbers += [x for x in (self.worst, self.t_s) if x is not None]
        if not all(map(math.isfinite, numbers)):
            raise ValueError(f"limit {self.name}: {numbers} must be finite")
        if self.resolution_error < 0.0:
            raise ValueError(f"limit {self.name}: resolution_error = {self.resolution_error}: must be at least 0")
        if self.worst is None and self.state is not Verdict.UNPROVEN:
            raise ValueError(f"limit {self.name}: without a value it can only be unproven, not {self.state}")

    @property
    def column(self) -> Column:
        """The column that the limit bounds."""
        return column_of(self.name)

    @property
    def place_text(self) -> str:
        """The place in mm, to 0.1 um; empty if it is not known.

        >>> LimitCheck("force_n", 500.0, 812.0, Verdict.EXCEEDS, place=(5.7e-17, 2.25, -33.33333)).place_text
        '0, 2.25, -33.33'
        """
        return ", ".join(f"{round(x, 4) + 0.0:.4g}" for x in self.place or ())

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
        >>> LimitCheck("force_n", 500.0, 412.0, Verdict.HOLDS).text
        'force 412 of 500 N'
        >>> LimitCheck("torque_nm", 3.0, 2.9, Verdict.UNPROVEN, line=7, reason="coarse").text
        'torque 2.9 of 3 N m in line 7, unproven: coarse'
        """
        unit = f" {self.column.unit}" if self.column.unit else ""
        least = self.column.least
        if self.worst is None:
            bound = "at least" if least else "at most"
            return f"{self.column.label} of {bound} {self.limit:g}{unit} is unknown: {self.reason}"
        if self.state is Verdict.EXCEEDS:
            beyond = "is below" if least else "exceeds"
            return f"{self.column.label} {self.worst:.4g}{unit} {beyond} {self.limit:g}{unit} {self.where}".rstrip()
        text = f"{self.column.label} {self.worst:.4g} of {'at least ' if least else ''}{self.limit:g}{unit}"
        return text if self.state is Verdict.HOLDS else f"{text} {self.where}".rstrip() + f", unproven: {self.reason}"


def state_of(
    worst: float, limit: float, error: float = 0.0, reason: str = "", *, least: bool = False
) -> tuple[Verdict, str]:
    """Return the state of a value against its limit, and the reason if it is unproven.

    Parameters
    ----------
    error : relative error of ``worst``
    reason : why the value may be worse, whatever its error; empty: it may not
    least : whether the limit is the least value that is allowed

    Raises
    ------
    ValueError
        A number is not finite.

    Examples
    --------
    >>> state_of(480.0, 500.0)[0].value, state_of(490.0, 500.0, 0.05)[0].value, state_of(600.0, 500.0, 0.05)[0].value
    ('holds', 'unproven', 'exceeds')
    """
    if not (math.isfinite(worst) and math.isfinite(limit)) or math.isnan(error):
        raise ValueError(f"value {worst} and limit {limit} must be finite, error {error} a number")
    if math.isinf(error):
        return Verdict.UNPROVEN, reason or "the resolution of the calculation causes an error of unknown size"
    band = error * abs(worst)
    if least:
        worst, limit = -worst, -limit
    if worst - band > limit:
        return Verdict.EXCEEDS, ""
    if reason:
        return Verdict.UNPROVEN, reason
    if worst + band > limit:
        return (
            Verdict.UNPROVEN,
            f"the value is known to {100.0 * error:.{0 if error >= 0.1 else 1}f} %, and the limit lies within this",
        )
    return Verdict.HOLDS, ""


def check_limit(
    name: str,
    limit: float,
    columns: Columns,
    *,
    track: str = "",
    rows: NDArray[np.bool_] | None = None,
    error: float = 0.0,
    reason: str = "",
) -> LimitCheck:
    """Compare a limit with the greatest value of its column, or with the least if the limit is a least allowed value.

    Parameters
    ----------
    name : of the limit
    columns : (n,) each; the column of the limit and, as far as they are there, ``line``, ``x_mm`` .. ``z_mm``, ``t_s``
    rows : (n,) rows that count; None: all
    error : relative error of the column; inf: it is not known
    reason : why the column may be too small; empty: it is not

    Examples
    --------
    >>> force = {"force_n": np.array([100.0, 480.0]), "line": np.array([3, 4])}
    >>> check_limit("force_n", 500.0, force).state, check_limit("force_n", 470.0, force).text
    (<Verdict.HOLDS: 'holds'>, 'force 480 N exceeds 470 N in line 4')
    """
    column = column_of(name)
    if not math.isfinite(error):
        error, reason = 0.0, reason or f"the resolution error of {column.label} is not known"
    if column.name not in columns:
        missing = reason or f"{column.label} was not calculated"
        return LimitCheck(name, limit, None, Verdict.UNPROVEN, track, reason=missing)
    values = np.asarray(columns[column.name], dtype=np.float64)
    size = np.abs(values) if column.signed else values
    worse = -size if column.least else size
    among = np.arange(len(size)) if rows is None else np.flatnonzero(rows)
    if len(among) == 0:
        return LimitCheck(name, limit, None, Verdict.UNPROVEN, track, reason=reason or "no step was checked")
    k = int(among[np.argmax(worse[among])])
    worst = float(size[k])
    state, why = state_of(worst, limit, error, reason, least=column.least)
    place = None
    if {"x_mm", "y_mm", "z_mm"} <= set(columns):
        place = (float(columns["x_mm"][k]), float(columns["y_mm"][k]), float(columns["z_mm"][k]))
    line = int(columns["line"][k]) if "line" in columns else 0
    t = float(columns["t_s"][k]) if "t_s" in columns else None
    known = error if math.isfinite(error) else 1.0
    return LimitCheck(name, limit, worst, state, track, k, line, place, t, known, why)
