"""What running a program gives: what it does on the machine, in the stock, and with new feeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.jobs.checks import DefaultChecks
from chipload.jobs.program.stability import StabilityResult
from chipload.jobs.program.workpiece_compliance import WorkpieceCompliance
from chipload.machine.machine import Machine
from chipload.program.read import ProgramReading
from chipload.result import Provenance
from chipload.simulation.removal import Removal
from chipload.simulation.surface import Collision, Difference
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SimulationResult:
    """A program that was run through a stock.

    Parameters
    ----------
    removal : what every step removed and what it cost
    stock : as it is afterwards
    machine : whose spindle has to give torque and power
    material : whose coefficients were used
    limits, unchecked : stated limits by name, and names of those that are not stated
    settings : the keys of the operation
    checks : made beside the stated limits
    left : what is left on the part; None: no part is stated
    collisions : what ran into what
    compared_with : names of what shank and holder were held against
    no_holder : tools whose holder is not stated
    rigid : what was not stated of what gives way, and counts as rigid
    stability : margins and quiet speeds; None: no modes are stated
    workpiece : how far the workpiece gives way where it is cut; None: no [workpiece] is stated
    blank : the stock before
    fixtures : what no tool may touch, by name
    """

    removal: Removal
    stock: LayeredStock
    machine: Machine
    material: Material
    limits: Mapping[str, float]
    unchecked: tuple[str, ...]
    settings: Mapping[str, Any]
    checks: DefaultChecks
    left: Difference | None = None
    collisions: tuple[Collision, ...] = ()
    compared_with: tuple[str, ...] = ()
    no_holder: tuple[int, ...] = ()
    rigid: tuple[str, ...] = ()
    stability: StabilityResult | None = None
    workpiece: WorkpieceCompliance | None = None
    blank: trimesh.Trimesh | None = None
    fixtures: Mapping[str, trimesh.Trimesh] = field(default_factory=dict)

    @property
    def errors(self) -> Mapping[str, float]:
        """Relative error of columns by the resolution of the simulation."""
        return self.removal.resolution_error


@dataclass(frozen=True, eq=False)
class FeedResult:
    """New feeds of a program.

    Parameters
    ----------
    text : the program with them
    dialect : of the text
    line : (m,) int, lines that move at a feed
    factor : (m,) float, the new feed of each over the programmed one
    by : (m,) what holds each: a limit by its name or one of :data:`HELD`
    before : what the program removes at the programmed feeds
    rubs : lines that cut below the least feed per tooth, and their feeds per tooth [mm]
    tooth_feed_least : [mm]; None: none is asked for
    seconds_before : time of the program at the programmed feeds [s]
    """

    text: str
    dialect: str
    line: NDArray[np.int64]
    factor: Floats
    by: tuple[str, ...]
    before: Removal
    rubs: tuple[tuple[int, float], ...]
    tooth_feed_least: float | None
    seconds_before: float


@dataclass(frozen=True)
class ToolSpeed:
    """A new spindle speed of a tool [1/min], and the least margin that its steps are expected to have with it."""

    tool: int
    before: tuple[float, ...]
    rpm: float
    margin: float


@dataclass(frozen=True, eq=False)
class SpeedResult:
    """New spindle speeds of a program.

    Parameters
    ----------
    text : the program with them
    dialect : of the text
    tools : what each tool has
    before : what the program removes at the programmed speeds
    stability : margins there
    seconds_before : time of the program at the programmed speeds [s]
    """

    text: str
    dialect: str
    tools: tuple[ToolSpeed, ...]
    before: Removal
    stability: StabilityResult
    seconds_before: float


@dataclass(frozen=True, eq=False)
class ProgramResult:
    """A program that was read for a machine.

    Parameters
    ----------
    title : name of the job
    name : of the program's file
    reading : what it does
    lines, seconds : (m,) lines of the source that move, and their times [s]
    machine : that it was read for
    provenance : where the numbers come from
    simulated : what the program does to its stock; None: it was only read
    feeds : how it came to its feeds if they are new; None: they are those of the file
    cutters : by tool number; empty: not known
    speeds : how it came to its spindle speeds if they are new; None: they are those of the file
    """

    title: str
    name: str
    reading: ProgramReading
    lines: NDArray[np.int64]
    seconds: Floats
    machine: Machine
    provenance: Provenance
    simulated: SimulationResult | None = None
    feeds: FeedResult | None = None
    cutters: Mapping[int, Cutter] = field(default_factory=dict)
    speeds: SpeedResult | None = None
