"""A program with new spindle speeds, and a part that is cut in several setups."""

from __future__ import annotations

from dataclasses import dataclass, field

from chipload.checking.outcome import ProgramResult, SimulationResult, SpeedResult


@dataclass(frozen=True, eq=False)
class SpeedsProgram(ProgramResult):
    """A simulated program with new spindle speeds; ``speeds`` describes the change."""

    simulated: SimulationResult = field(kw_only=True)
    speeds: SpeedResult = field(kw_only=True)


@dataclass(frozen=True, eq=False)
class SetupsProgram(ProgramResult):
    """The last of several setups of a part; ``setups`` are all of them in their order."""

    setups: tuple[ProgramResult, ...] = field(kw_only=True)
