"""Outcome of a thin-wall job: three variants of its passes, each planned, written and simulated.

Notation: F_n [N] greatest force along the normal of the surface that a pass leaves, over a revolution; F_th [N]
threshold of the place: the limit over the normal compliance in the state of that pass; u, v parameters of a side.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import DefaultChecks
from chipload.cutter.cutter import Cutter
from chipload.errors import Finding
from chipload.geometry.thin_wall import ThinWall
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.machine.machine import Machine
from chipload.program.commands import Commands
from chipload.program.program import Program
from chipload.result import Provenance
from chipload.simulation.surface import Collision

Floats = NDArray[np.float64]
#: share by which a simulated force may exceed its threshold
OVER = 0.01
#: the variant whose program is released
USED = "variable"


@dataclass(frozen=True, eq=False)
class PassMap:
    """One pass on the places of its side.

    Attributes
    ----------
    side : number of the side
    points : (n, m, 3) float [mm], places
    u, v : (n,), (m,) their parameters
    depth : (n, m) float [mm]
    threshold : (n, m) float [N], limit over compliance, or calibrated
    stable : (n, m) float [mm], stable depth; None: it is not calculated
    speed : of the spindle [rad/s]; None: that of the operation
    operation : number of the operation
    """

    side: int
    points: Floats
    u: Floats
    v: Floats
    depth: Floats
    threshold: Floats
    stable: Floats | None = None
    speed: float | None = None
    operation: int = 0


@dataclass(frozen=True, eq=False)
class Finish:
    """One finished side.

    Attributes
    ----------
    points : (n, m, 3) float [mm]
    error : (n, m) float [mm], by deflection, positive where material is left
    rigid : (n, m) float [mm], what a rigid cutter leaves: scallops
    made : (n, m) bool, whether a step of the simulation comes to the point
    unsure : (n, m) float, relative error of the compliance by its mesh
    parameters : (n,), (m,) float, u and v of the points
    """

    side: int
    points: Floats
    error: Floats
    rigid: Floats
    made: NDArray[np.bool_]
    unsure: Floats
    parameters: tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class Shape:
    """Shape of the simulated stock against the finished wall.

    Attributes
    ----------
    gouge : greatest depth into the wall [mm]; 0: none
    left : greatest height over it [mm]
    at : (3,) float [mm], where the gouge is
    points : number of points that were checked
    nearest : least distance of the cutter to the finished wall along the path [mm]; below 0: it gouges
    collisions : of the tool with a part, or with one wall and its neighbours
    """

    gouge: float
    left: float
    at: tuple[float, float, float]
    points: int
    nearest: float
    collisions: tuple[Collision, ...] = ()


@dataclass(frozen=True, eq=False)
class Surfaces:
    """What a simulation leaves.

    Attributes
    ----------
    finish : a finished side each
    shape : the simulated stock against the finished wall
    stress : greatest equivalent stress at the clamp [MPa] under the simulated forces
    """

    finish: tuple[Finish, ...]
    shape: Shape
    stress: float


@dataclass(frozen=True)
class Help:
    """A place where even the smallest depth exceeds the threshold, and the changes that would make it feasible."""

    side: int
    at: tuple[float, float, float]
    force_allowable_n: float
    force_n: float
    feed_per_tooth_mm: float | None
    diameter_mm: float | None


@dataclass(frozen=True, eq=False)
class VariantPlan:
    """The plan of a variant.

    Attributes
    ----------
    order : of the sides
    passes_otherwise : passes in the other order, None: one side
    limit : deflection [mm] that it was planned under; infinite: none
    maps : a pass each, in the order of cutting
    force, deflection : greatest [N], [mm]; None: compliance not known
    infeasible : places where even the smallest depth is too great
    at_confidence : (n,) of the steps, or for all, what a force may be at the confidence of the checks over its nominal
        value
    """

    order: str
    passes_otherwise: int | None
    limit: float
    maps: tuple[PassMap, ...]
    force: float
    deflection: float | None
    infeasible: tuple[Help, ...]
    at_confidence: NDArray[np.float64] | float = 1.0


@dataclass(frozen=True, eq=False)
class Variant:
    """One variant: its plan, program, loads and form error.

    Attributes
    ----------
    name : ``variable``, ``constant``, ``unconstrained``, ``least_error`` or ``compensated``
    program : the whole of it
    commands : on the machine
    beyond : what the machine does not give
    seconds : on the machine
    columns : one row for each step of the simulation
    find_surfaces : calculates ``surfaces`` at its first use: of plans that are only tried they are not needed
    find_load_error : calculates ``load_error`` at its first use
    shift : greatest way [mm] by which the last passes were moved against the form error
    """

    name: str
    plan: VariantPlan
    program: Program
    commands: Commands
    beyond: tuple[Finding, ...]
    seconds: float
    columns: Mapping[str, NDArray[Any]]
    find_surfaces: Callable[[], Surfaces]
    find_load_error: Callable[[], Mapping[str, float]]
    shift: float = 0.0

    @cached_property
    def surfaces(self) -> Surfaces:
        """What the simulation leaves."""
        return self.find_surfaces()

    @property
    def finish(self) -> tuple[Finish, ...]:
        """A finished side each."""
        return self.surfaces.finish

    @property
    def shape(self) -> Shape:
        """The simulated stock against the finished wall."""
        return self.surfaces.shape

    @property
    def stress(self) -> float:
        """Greatest equivalent stress at the clamp [MPa] under the simulated forces."""
        return self.surfaces.stress

    @cached_property
    def load_error(self) -> Mapping[str, float]:
        """Relative error of the greatest load by column, of slices and steps; inf: not known."""
        return self.find_load_error()

    @property
    def over(self) -> NDArray[np.int64]:
        """Steps whose F_n exceeds F_th by more than :data:`OVER`, the worst first."""
        ratio = self.columns["force_over_allowable"]
        bad = np.flatnonzero(ratio > 1.0 + OVER)
        return np.asarray(bad[np.argsort(-ratio[bad], kind="stable")])

    def over_with_error(self, modelled: bool, assumed: float | None = None) -> float:
        """Greatest F_n over F_th at the confidence of the checks with the error of the loads and, where F_th is
        modelled, that of the mesh.

        Parameters
        ----------
        modelled : whether F_th is
        assumed : error of F_n, where its own is not calculated
        """
        c = self.columns
        unsure = c["compliance_error"] if modelled else 0.0
        most = float((c["force_over_allowable"] * self.plan.at_confidence * (1.0 + unsure)).max(initial=0.0))
        return most * (1.0 + (self.load_error["force_normal_n"] if assumed is None else assumed))

    @property
    def deflection(self) -> float:
        """Greatest deflection of the wall [mm]."""
        return 1e-3 * float(self.columns["deflection_workpiece_um"].max(initial=0.0))

    @property
    def error(self) -> float:
        """Greatest size of the form error by deflection [mm]."""
        return max((float(np.abs(f.error[f.made]).max(initial=0.0)) for f in self.finish), default=0.0)

    @property
    def error_rms(self) -> float:
        """Root mean square of the form error by deflection [mm]."""
        known = np.concatenate([f.error[f.made].ravel() for f in self.finish] or [np.zeros(1)])
        return float(np.sqrt(np.mean(known**2))) if len(known) else 0.0

    @property
    def force(self) -> float:
        """Greatest F_n [N]."""
        return float(self.columns["force_normal_n"].max(initial=0.0))


@dataclass(frozen=True, eq=False)
class WallGeometry:
    """The wall of a result.

    Attributes
    ----------
    shape : finished
    allowance : [mm] on k- and k+, or on each side of a part's walls
    stock, finished : (vertices (n, 3), faces (m, 3)) of the workpiece before, and of the finished wall or part
    neighbours : the same of the bodies next to one wall, by name
    """

    shape: ThinWall | PartShape
    allowance: tuple[float, ...]
    stock: tuple[Floats, NDArray[np.int64]]
    finished: tuple[Floats, NDArray[np.int64]]
    neighbours: Mapping[str, tuple[Floats, NDArray[np.int64]]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class PlannedOperation:
    """An operation of the plan.

    Attributes
    ----------
    cutter : its own
    leave : [mm] stock that it leaves on every side
    reserve : share by which the planner kept below the thresholds
    step_over : [mm]
    feed_per_tooth : [mm]
    rows : file of the finishing program that its rows are from; None: they are planned
    """

    cutter: Cutter
    leave: float
    reserve: float
    step_over: float
    feed_per_tooth: float
    rows: str | None = None


@dataclass(frozen=True, eq=False)
class WallPlanning:
    """Data that the plans were made from.

    Attributes
    ----------
    operations : in the order of cutting
    machine : of all
    threshold_source, threshold_text : ``modelled`` or ``calibrated``, and a sentence
    """

    operations: tuple[PlannedOperation, ...]
    machine: Machine
    threshold_source: str
    threshold_text: str

    @property
    def last(self) -> PlannedOperation:
        """The operation that makes the finished surface."""
        return self.operations[-1]

    @property
    def cutters(self) -> dict[int, Cutter]:
        """Cutters by number."""
        return {one.cutter.number: one.cutter for one in self.operations}


@dataclass(frozen=True, eq=False)
class ThinWallResult:
    """Result of a thin-wall job.

    Attributes
    ----------
    title : of the job
    limits, unchecked : stated limits by name, and names of those that are not stated
    variants : by name
    findings : what was found
    settings : JSON values
    checks : checks in addition to the stated limits
    provenance : where the numbers come from
    texts : of the programs of the variants, as they were read back
    """

    title: str
    geometry: WallGeometry
    planning: WallPlanning
    limits: Mapping[str, float]
    unchecked: tuple[str, ...]
    variants: Mapping[str, Variant]
    findings: tuple[Finding, ...]
    settings: Mapping[str, Any]
    checks: DefaultChecks
    provenance: Provenance
    texts: Mapping[str, str] = field(default_factory=dict)


def remedy_text(place: Help) -> str:
    """Changes that would make a place feasible, in words."""
    if place.feed_per_tooth_mm is not None:
        return f"a feed of at most {place.feed_per_tooth_mm:.4g} mm a tooth would do"
    if place.diameter_mm is not None:
        return f"the edge force alone exceeds the limit; a cutter of at most {place.diameter_mm:.4g} mm would do"
    return "neither a smaller feed nor a smaller cutter of this shape would do"
