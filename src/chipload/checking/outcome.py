"""The outcome of a program: its motions on the machine, and its simulation in the stock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import DefaultChecks
from chipload.checking.settings import Limits
from chipload.checking.stability import StabilityResult
from chipload.checking.workpiece_compliance import WorkpieceCompliance
from chipload.cutter.cutter import Cutter
from chipload.errors import Finding
from chipload.lazy import trimesh
from chipload.machine.machine import Machine
from chipload.program.read import ProgramReading
from chipload.result import Provenance
from chipload.simulation.removal import Removal
from chipload.simulation.surface import Collision, Difference
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StockCheck:
    """Findings on the stock as it is at each moment, and what they cannot show.

    Parameters
    ----------
    findings : rapids that cut, loose stock, slender walls
    touched : contacts of shank and holder
    hidden_mm : depth of a contact that the check may miss, and thickness of what it may miss
    unchecked : what was not checked, in sentences
    blank : the stock before the program; None: layers that were cut before
    """

    findings: tuple[Finding, ...] = ()
    touched: tuple[Collision, ...] = ()
    hidden_mm: float = 0.0
    unchecked: tuple[str, ...] = ()
    blank: trimesh.Trimesh | None = None


@dataclass(frozen=True, eq=False)
class CollisionCheck:
    """Collisions of cutter, shank and holder, and the bodies with which they were compared.

    Parameters
    ----------
    found : the collisions
    compared_with : names of the bodies that were compared
    no_holder : tools whose holder is not stated
    fixtures : bodies that no tool may touch, by name
    stock : what was found in the stock as it is at each moment
    """

    found: tuple[Collision, ...] = ()
    compared_with: tuple[str, ...] = ()
    no_holder: tuple[int, ...] = ()
    fixtures: Mapping[str, trimesh.Trimesh] = field(default_factory=dict)
    stock: StockCheck = field(default_factory=StockCheck)


@dataclass(frozen=True, eq=False)
class SimulationResult:
    """Result of the simulation of a program in its stock.

    Parameters
    ----------
    removal : removal and loads of every step
    stock : after the program
    machine : whose spindle supplies torque and power
    stated_limits : limits of loads and part
    settings : the keys of the operation
    checks : made in addition to the stated limits, with the cutters and the material
    collisions : of cutter, shank and holder
    left : differences from the part; None: no part is stated
    rigid : compliant components that are not stated and count as rigid
    stability : margins and quiet speeds; None: no modes are stated
    workpiece : compliance of the workpiece where it is cut; None: no [workpiece] is stated
    skipped : with block delete on, where the program moves otherwise then
    """

    removal: Removal
    stock: LayeredStock
    machine: Machine
    stated_limits: Limits
    settings: Mapping[str, Any]
    checks: DefaultChecks
    collisions: CollisionCheck = field(default_factory=CollisionCheck)
    left: Difference | None = None
    rigid: tuple[str, ...] = ()
    stability: StabilityResult | None = None
    workpiece: WorkpieceCompliance | None = None
    skipped: SimulationResult | None = None

    @property
    def limits(self) -> Mapping[str, float]:
        """Limits that are stated, by name."""
        return self.stated_limits.stated

    @property
    def errors(self) -> Mapping[str, float]:
        """Relative error of columns by the resolution of the simulation."""
        return self.removal.resolution_error


@dataclass(frozen=True, eq=False)
class ChangedText:
    """The text of a program with changed words, and the results of the unchanged program.

    Parameters
    ----------
    text : of the changed program
    dialect : of the text
    before : removal of the unchanged program
    seconds_before : time of the unchanged program [s]
    """

    text: str
    dialect: str
    before: Removal
    seconds_before: float


@dataclass(frozen=True)
class ToolSpeed:
    """A new spindle speed of a tool [1/min], and the least expected margin of its steps at that speed.

    ``lines`` are the first and the last line that cut at it.
    """

    tool: int
    before: tuple[float, ...]
    rpm: float
    margin: float
    lines: tuple[int, int]


@dataclass(frozen=True, eq=False)
class SpeedResult(ChangedText):
    """New spindle speeds of a program; see :class:`ChangedText`.

    Parameters
    ----------
    tools : new speed of each tool or zone
    stability : margins at the programmed speeds
    """

    tools: tuple[ToolSpeed, ...]
    stability: StabilityResult


@dataclass(frozen=True, eq=False)
class ProgramResult:
    """A program that was read for a machine.

    Parameters
    ----------
    title : name of the job
    name : of the program's file
    reading : its motions and findings
    lines, seconds : (m,) lines of the source with motions, and their times [s]
    machine : for which it was read
    provenance : where the numbers come from
    simulated : result of the simulation; None: it was only read
    cutters : by tool number; empty: not known
    """

    title: str
    name: str
    reading: ProgramReading
    lines: NDArray[np.int64]
    seconds: Floats
    machine: Machine
    provenance: Provenance
    simulated: SimulationResult | None = None
    cutters: Mapping[int, Cutter] = field(default_factory=dict)
