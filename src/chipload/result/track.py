"""A track: one program along its path, with its limits, its time and its history.

A result has one track for each strategy of a contour, variant of a thin wall, controller of a torque-controlled
program, or program. Tracks never share rows: their time begins at 0 and rises.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.result.limits import Columns, LimitCheck
from chipload.result.times import Times, times_of
from chipload.result.verdict import Verdict

#: work that differs from that of the volume by this share, beside the error of the loads, leaves them unproven
BALANCE = 0.1
#: units of the limits whose error that is
LOAD_UNITS = ("N", "N m", "W")
#: of the finding that says so
UNBALANCED = "energy-balance"
#: yields the rows of a history, some ten thousand at a time
Blocks = Callable[[], Iterator[Columns]]


class TrackKind(enum.StrEnum):
    """What the tracks of a result compare."""

    STRATEGY = "strategy"
    VARIANT = "variant"
    CONTROLLER = "controller"
    PROGRAM = "program"
    MEASUREMENT = "measurement"


@dataclass(frozen=True, eq=False)
class Track:
    """One program along its path.

    Parameters
    ----------
    name : of the strategy, variant, controller or program; unique in the result
    kind : what the tracks of this result compare
    in_use : whether the verdict stands on it and its program is released
    time_s : of the program on the machine [s]; None: it was not run
    time_high_s : what the program takes at most [s] where the jerk of the machine is not stated; None: ``time_s``
    limits : each limit of the job against this track
    findings : what was found in this track
    programs : names of its program files
    operation : number of its operation
    parameters : what sets it apart beside its name, as ``{"latency_s": 0.1}``
    blocks : its history, one row for each step of the program
    energy_balance : work over the specific energy of the volume removed, less 1, by tool number; empty: not simulated.
        One that the error of the loads does not explain is a finding, and the track unproven at best
    """

    name: str
    kind: TrackKind
    in_use: bool
    time_s: float | None
    limits: tuple[LimitCheck, ...] = ()
    findings: tuple[Finding, ...] = ()
    programs: tuple[str, ...] = ()
    operation: int = 0
    parameters: Mapping[str, float | str] = field(default_factory=dict)
    blocks: Blocks = field(default=lambda: iter(()))
    energy_balance: Mapping[int, float] = field(default_factory=dict)
    time_high_s: float | None = None

    def __post_init__(self) -> None:
        """Refuse a time that is not a number."""
        if self.time_s is not None and not (math.isfinite(self.time_s) and self.time_s >= 0.0):
            raise ValueError(f"track {self.name}: time_s = {self.time_s}: must be a finite number from 0")
        high = self.time_high_s
        if high is not None and not (math.isfinite(high) and high >= (self.time_s or 0.0) * (1.0 - 1e-9)):
            raise ValueError(f"track {self.name}: time_high_s = {high}: must be a finite number from time_s")
        if all(finding.code != UNBALANCED for finding in self.findings):
            object.__setattr__(self, "findings", (*self.findings, *self._balance_findings()))

    def _balance_findings(self) -> Iterator[Finding]:
        loads = (c.error for c in self.limits if c.column.unit in LOAD_UNITS)
        error = max((e for e in loads if math.isfinite(e)), default=0.0)
        for tool, balance in self.energy_balance.items():
            if not abs(balance) <= BALANCE + error:
                side = "below" if balance < 0.0 else "above"
                text = (
                    f"the work of tool {tool} is {abs(balance):.0%} {side} that of the volume that it removes, and the "
                    f"loads are known to {error:.0%}: state shorter steps or thinner layers"
                )
                yield Finding(UNBALANCED, 0, text, Severity.UNPROVEN)

    @property
    def verdict(self) -> Verdict:
        """The worst state of the track's limits and findings."""
        states = [check.state for check in self.limits] + [Verdict.of_finding(f) for f in self.findings]
        return Verdict.worst(states)

    @cached_property
    def times(self) -> Times | None:
        """The time of the program by what the machine does; None: the track has no history with times."""
        return times_of(self.blocks(), self.time_s)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns (n,) of the whole history by name; empty if the track has no history."""
        blocks = list(self.blocks())
        return {name: np.concatenate([b[name] for b in blocks]) for name in (blocks[0] if blocks else ())}


def in_memory(columns: Columns) -> Blocks:
    """Return the blocks of a history that is in memory."""
    return lambda: iter((columns,))
