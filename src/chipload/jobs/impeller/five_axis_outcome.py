"""Outcome of flank passes and point milling on five axes: the checked program, or the reason why there is none."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from chipload.cutter.catalogue import CatalogueCutter
from chipload.jobs.impeller.machine_check import MachineCheck, program_verdict
from chipload.jobs.impeller.program_removal import ProgramRemoval
from chipload.jobs.impeller.read_program import ReadProgram
from chipload.machine.machine import Machine
from chipload.planning.impeller.flank import FlankPass
from chipload.planning.impeller.point_milling import PointPath
from chipload.program.gcode.writer import Repeat
from chipload.program.program import Program
from chipload.result import Verdict
from chipload.simulation.channel.channel import Remainder
from chipload.simulation.channel.gouges import Gouge


@dataclass(frozen=True)
class AllChannels:
    """One program for all channels.

    Parameters
    ----------
    repeat : a loop that offsets the axis that turns the part; None: every channel has its rows
    program : rows of one channel with ``repeat``, of all without
    """

    repeat: Repeat | None
    program: Program


@dataclass(frozen=True, eq=False)
class FiveAxisProgram:
    """Program of a surface with the result of its check.

    Parameters
    ----------
    name : `blade plus`
    machine, cutter : what it is written for
    program : of one channel, to above the beginning of the next
    gouge, left : as of every program
    allowed, most : gouge, and what may be left [mm]
    machine_check : what it does on the machine, and what its text shows
    read : the program as its text was read, which was checked
    every : of all channels; a text why there is none
    removal : from the stock that roughing leaves; None: not simulated
    """

    name: str
    machine: Machine
    cutter: CatalogueCutter
    program: Program
    gouge: Gouge
    left: Remainder
    allowed: float
    most: float
    machine_check: MachineCheck
    read: ReadProgram
    every: AllChannels | str
    removal: ProgramRemoval | None = field(default=None, kw_only=True)

    #: key of the limit on what is left
    limit = "excess_mm"

    @property
    def seconds(self) -> float:
        """Time of one channel [s]."""
        return self.read.seconds

    @property
    def excess(self) -> float:
        """Greatest excess on the surface [mm]."""
        return float(self.left.rest.max())

    @property
    def fails(self) -> tuple[str, ...]:
        """Conditions that do not hold."""
        out = [f"{self.name}: {f}" for f in self.machine_check.fails]
        if self.gouge.bound > self.allowed:
            out.append(f"{self.name}: {self.gouge.message}: gouge_mm = {self.allowed:g} is allowed")
        if self.excess > self.most:
            out.append(f"{self.name}: {self.excess:.4f} mm are left: {self.limit} = {self.most:g} is allowed")
        return tuple(out)

    @property
    def verified(self) -> bool:
        """Whether there is no gouge, no excess above the allowed one, no motion beyond the machine, and its text shows
        nothing that is wrong or unproven.
        """
        return not (self.fails or self.machine_check.doubts)

    @property
    def verdict(self) -> Verdict:
        """Of all its checks, with what it removes."""
        return program_verdict(self.fails, self.machine_check.doubts, self.removal)


@dataclass(frozen=True, eq=False)
class CheckedFlank(FiveAxisProgram):
    """The flank passes of a side; ``passes`` of one channel."""

    passes: tuple[FlankPass, ...]

    @property
    def deviation(self) -> float:
        """Greatest deviation of all passes [mm]."""
        return max(p.deviation for p in self.passes)

    @property
    def length(self) -> float:
        """Length of the path in the cut [mm]."""
        return math.fsum(p.length for p in self.passes)


@dataclass(frozen=True, eq=False)
class CheckedPoints(FiveAxisProgram):
    """Point milling of a surface.

    Parameters
    ----------
    path : of one channel
    along : `u` or `v`, which its lines run along
    slowed : share of the rows in the cut that are fed more slowly, for a rotary axis
    scallop : mean height between its lines [mm]; None: there are no two
    """

    path: PointPath
    along: str
    slowed: float
    scallop: float | None

    limit = "scallop_mm"

    @property
    def length(self) -> float:
        """Length of the path in the cut [mm]."""
        return self.path.length


@dataclass(frozen=True)
class NoFiveAxisPath:
    """A surface that no cutter of the catalogue mills on five axes, and the reason."""

    name: str
    reason: str


def flank_numbers(one: CheckedFlank | NoFiveAxisPath, file: str, channels: int) -> dict[str, Any]:
    """Flank passes of one channel of several in summary.json; ``file`` the name of its program."""
    if isinstance(one, NoFiveAxisPath):
        return _none(one)
    return {
        **_head(one, file),
        "passes": len(one.passes),
        "path_mm": one.length,
        **_times(one, channels),
        "deviation_mm": one.deviation,
        "above_least_mm": max(p.unimproved for p in one.passes),
        "excess_mm": one.excess,
        **_found_numbers(one),
    }


def points_numbers(one: CheckedPoints | NoFiveAxisPath, file: str, channels: int) -> dict[str, Any]:
    """Point milling of one channel of several in summary.json; ``file`` the name of its program."""
    if isinstance(one, NoFiveAxisPath):
        return _none(one)
    return {
        **_head(one, file),
        "lines": one.path.lines,
        "lines_along": one.along,
        "path_mm": one.length,
        **_times(one, channels),
        "axis_turn_deg_mm": math.degrees(one.path.turn),
        "slowed_share": one.slowed,
        "scallop_greatest_mm": one.excess,
        "scallop_mean_share": None if one.scallop is None else one.scallop / one.most,
        **_found_numbers(one),
    }


def _none(one: NoFiveAxisPath) -> dict[str, Any]:
    return {"surface": one.name, "program": None, "verdict": None, "reason": one.reason}


def _head(one: FiveAxisProgram, file: str) -> dict[str, Any]:
    return {
        "surface": one.name,
        "diameter_mm": one.cutter.diameter,
        "corner_radius_mm": one.cutter.corner_radius,
        "taper_deg": math.degrees(one.cutter.taper),
        "barrel_radius_mm": one.cutter.barrel_radius,
        "machine": one.machine.name,
        "program": file,
        "rows": len(one.program),
    }


def _times(one: FiveAxisProgram, channels: int) -> dict[str, Any]:
    return {
        "time_min": one.seconds / 60.0,
        "channels": channels,
        "time_all_channels_min": channels * one.seconds / 60.0,
        "all_channels": one.every if isinstance(one.every, str) else ("loop" if one.every.repeat else "expanded"),
    }


def _found_numbers(one: FiveAxisProgram) -> dict[str, Any]:
    return {
        "gouge_mm": one.gouge.found,
        "gouge_bound_mm": one.gouge.bound if math.isfinite(one.gouge.bound) else None,
        "verdict": one.verdict.value,
        "reason": None,
        "removal": None if one.removal is None else one.removal.numbers(),
    }
