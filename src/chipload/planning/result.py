"""What a planner gives back: a program a strategy, what it costs step by step, and what could not be kept.

Reference: HOUSE rule "what a calculation finds is a status in the result".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True)
class LimitCheck:
    """One limit of the job against the worst value found: ``holds`` is ``worst <= limit``.

    ``at`` is the place (x, y) [mm] of the worst value.
    """

    name: str
    limit: float
    worst: float
    at: tuple[float, float]

    @property
    def holds(self) -> bool:
        """Whether the limit is kept."""
        return self.worst <= self.limit


@dataclass(frozen=True, eq=False)
class StrategyResult:
    """One strategy of one operation.

    Parameters
    ----------
    name : `plain`, `backward`, `feed`, `forward` or `front`
    program : the motions, leads and links included
    history : a row a step; at least `pass`, `x_mm`, `y_mm`, `z_mm`, `s_mm` (path length), `t_s`, `engagement_deg`,
        `feed_mm_min`, `force_x_n`, `force_y_n`, `force_xy_n`, `torque_nm`, `error_um`. `pass` is `semifinish`,
        `finish` or `front`; cutting that belongs to none of them is `lead` (run-on, run-off), `closing` (a closed
        pass meets its own beginning), `link`, `entry`.
    summary : JSON values, as `engagement_deg: {min, max}`; merged into summary.json
    events : in the order of the path
    limits : the job's limits against this strategy
    drawn : contours by name. The check needs `wall` (the part on the right of travel) and `stock before` (closed, what
        the first motion meets); `stock`, `semifinish path`, `finish path`, `leftover` ... are shown
    """

    name: str
    program: Program
    history: Columns
    summary: Mapping[str, Any]
    events: tuple[Event, ...] = ()
    limits: tuple[LimitCheck, ...] = ()
    drawn: Mapping[str, tuple[Contour, ...]] = field(default_factory=dict)

    @property
    def holds(self) -> bool:
        """Whether every limit holds and no event is a failure."""
        return all(x.holds for x in self.limits) and not any(e.failure for e in self.events)


@dataclass(frozen=True, eq=False)
class OperationResult:
    """One operation of a job: its strategies side by side; ``use`` names the one whose program is released."""

    kind: str
    use: str
    strategies: Mapping[str, StrategyResult]
    findings: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether the released strategy holds every limit."""
        return self.strategies[self.use].holds


def worst(columns: Columns, name: str, where: NDArray[np.bool_]) -> tuple[float, tuple[float, float]]:
    """Greatest value of a column among the rows ``where``, and its place (x, y) [mm]."""
    k = int(np.flatnonzero(where)[np.argmax(columns[name][where])])
    return float(columns[name][k]), (float(columns["x_mm"][k]), float(columns["y_mm"][k]))
