"""What a planner gives back: a program a strategy, what it costs step by step, and what could not be kept.

Reference: HOUSE rule "what a calculation finds is a status in the result".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.program.program import Program

#: columns by name, all of one length: float64, or str (object) for names
Columns = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Event:
    """Something that happened at a place and is not hidden: a stop of the pass, an engagement above the limit.

    ``code`` is short and stable (``front-blocked``), ``x, y`` [mm] the cutter's centre, ``text`` a sentence with
    numbers. ``failure`` events make the operation's status fail (exit code 3); others only inform.
    """

    code: str
    x: float
    y: float
    text: str
    failure: bool = False


@dataclass(frozen=True, eq=False)
class StrategyResult:
    """One strategy of one operation.

    Parameters
    ----------
    name : `plain`, `backward`, `feed`, `forward` or `front`
    program : the motions, leads and links included
    history : one row for each step; at least `pass`, `x_mm`, `y_mm`, `z_mm`, `s_mm` (path length), `t_s`,
        `engagement_deg`, `feed_mm_min`, `force_x_n`, `force_y_n`, `force_xy_n`, `torque_nm`, `form_error_um`. `pass` is
        `semifinish`, `finish` or `front`; cutting that belongs to none of them is `lead` (run-on, run-off), `closing`
        (a closed pass meets its own beginning), `link`, `entry`.
    summary : JSON values, as `engagement_deg: {min, max}`; merged into summary.json
    events : in the order of the path
    wall_rows : (n,) rows that make the wall: there the limits of engagement and form error count
    drawn : contours by name. The check needs `wall` (the part on the right of travel) and `stock before` (closed, what
        the first motion meets); `stock`, `semifinish path`, `finish path`, `leftover` ... are shown

    Raises
    ------
    InputError
        A number of the history, the summary or a limit is infinite or NaN.
    """

    name: str
    program: Program
    history: Columns
    summary: Mapping[str, Any]
    events: tuple[Event, ...] = ()
    wall_rows: NDArray[np.bool_] | None = None
    drawn: Mapping[str, tuple[Contour, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for column, values in self.history.items():
            if values.dtype.kind == "f" and not np.isfinite(values).all():
                k = int(np.flatnonzero(~np.isfinite(values))[0])
                x, y = float(self.history["x_mm"][k]), float(self.history["y_mm"][k])
                raise InputError(
                    f"strategy {self.name}: history.{column} = {values[k]} in row {k} at ({x:.6g}, {y:.6g}): must be "
                    "finite: this is a fault of the planner, please report the job"
                )
        _check_finite(f"strategy {self.name}: summary", self.summary)


def _check_finite(name: str, value: object) -> None:
    """Refuse an infinite number or NaN anywhere in a tree of JSON values."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            _check_finite(f"{name}.{key}", inner)
    elif isinstance(value, (list, tuple)):
        for k, inner in enumerate(value):
            _check_finite(f"{name}.{k}", inner)
    elif isinstance(value, (float, np.floating)) and not math.isfinite(value):
        raise InputError(f"{name} = {value}: must be finite: this is a fault of the planner, please report the job")


@dataclass(frozen=True, eq=False)
class OperationResult:
    """One operation of a job: its strategies side by side; ``use`` names the one whose program is released."""

    kind: str
    use: str
    strategies: Mapping[str, StrategyResult]
    findings: tuple[str, ...] = ()
