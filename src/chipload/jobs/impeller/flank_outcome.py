"""What a flank pass on five axes comes to: its program, what the check finds, or why there is none."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from chipload.cutter.catalogue import CatalogueCutter
from chipload.machine.machine import Machine
from chipload.planning.impeller.flank import FlankPass
from chipload.program.program import Program
from chipload.simulation.channel.channel import Remainder
from chipload.simulation.channel.gouges import Gouge


@dataclass(frozen=True, eq=False)
class CheckedFlank:
    """The flank passes of a side with their program and what the check finds.

    Parameters
    ----------
    name : `blade plus`
    machine, cutter : what it is written for
    passes, program : of one channel
    gouge, left : as of every program
    allowed, most : gouge, and what may be left [mm]
    findings : what the program asks of the machine that it does not give
    seconds : of one channel
    """

    name: str
    machine: Machine
    cutter: CatalogueCutter
    passes: tuple[FlankPass, ...]
    program: Program
    gouge: Gouge
    left: Remainder
    allowed: float
    most: float
    findings: tuple[str, ...]
    seconds: float

    @property
    def deviation(self) -> float:
        """The greatest of all passes [mm]."""
        return max(p.deviation for p in self.passes)

    @property
    def length(self) -> float:
        """Of the path in the cut [mm]."""
        return math.fsum(p.length for p in self.passes)

    @property
    def excess(self) -> float:
        """The most that is left on the side [mm]."""
        return float(self.left.rest.max())

    @property
    def fails(self) -> tuple[str, ...]:
        """What does not hold."""
        out = [f"{self.name}: {f}" for f in self.findings]
        if self.gouge.bound > self.allowed:
            out.append(f"{self.name}: {self.gouge.message}: gouge_mm = {self.allowed:g} is allowed")
        if self.excess > self.most:
            out.append(f"{self.name}: {self.excess:.4f} mm are left: excess_mm = {self.most:g} is allowed")
        return tuple(out)

    @property
    def verified(self) -> bool:
        """No gouge, nothing beyond the machine, no more left than is allowed."""
        return not self.fails


@dataclass(frozen=True)
class NoFlank:
    """A side that no cutter of the catalogue mills by its flank, and why."""

    name: str
    reason: str


def flank_numbers(one: CheckedFlank | NoFlank, file: str) -> dict[str, Any]:
    """A flank pass of one channel in summary.json; ``file`` the name of its program."""
    if isinstance(one, NoFlank):
        return {"surface": one.name, "program": None, "verdict": None, "reason": one.reason}
    return {
        "surface": one.name,
        "diameter_mm": one.cutter.diameter,
        "corner_radius_mm": one.cutter.corner_radius,
        "machine": one.machine.name,
        "program": file,
        "rows": len(one.program),
        "passes": len(one.passes),
        "path_mm": one.length,
        "time_min": one.seconds / 60.0,
        "deviation_mm": one.deviation,
        "above_least_mm": max(p.unimproved for p in one.passes),
        "excess_mm": one.excess,
        "gouge_mm": one.gouge.found,
        "gouge_bound_mm": one.gouge.bound if math.isfinite(one.gouge.bound) else None,
        "verdict": "holds" if one.verified else "exceeds",
        "reason": None,
    }
