"""A program with new spindle speeds."""

from __future__ import annotations

from dataclasses import dataclass, field

from chipload.checking.outcome import ProgramResult, SimulationResult, SpeedResult


@dataclass(frozen=True, eq=False)
class SpeedsProgram(ProgramResult):
    """A simulated program with new spindle speeds; ``speeds`` describes the change."""

    simulated: SimulationResult = field(kw_only=True)
    speeds: SpeedResult = field(kw_only=True)
