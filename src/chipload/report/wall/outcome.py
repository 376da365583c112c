"""What cutting a thin wall gave: three variants of its passes, each planned, written and simulated.

Notation: F_n [N] greatest force along the normal of the surface that a pass leaves, over a revolution; F_th [N] what
the place bears, limit over normal compliance in the state of that pass; u, v parameters of a side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.geometry.wall import ThinWall
from chipload.machine.machine import Machine
from chipload.program.commands import Commands
from chipload.program.program import Program

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
    """

    side: int
    points: Floats
    u: Floats
    v: Floats
    depth: Floats
    threshold: Floats


@dataclass(frozen=True, eq=False)
class Finish:
    """One finished side.

    Attributes
    ----------
    points : (n, m, 3) float [mm]
    error : (n, m) float [mm], by deflection, positive where material is left
    rigid : (n, m) float [mm], what a rigid cutter leaves: cusps
    made : (n, m) bool, whether a step of the simulation comes to the point
    """

    side: int
    points: Floats
    error: Floats
    rigid: Floats
    made: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Shape:
    """What the simulated stock is beside the finished wall.

    Attributes
    ----------
    gouge : greatest depth into the wall [mm]; 0: none
    left : greatest height over it [mm]
    at : (3,) float [mm], where the gouge is
    points : how many were looked at
    nearest : least distance of the cutter to the finished wall along the path [mm]; below 0: it gouges
    """

    gouge: float
    left: float
    at: tuple[float, float, float]
    points: int
    nearest: float


@dataclass(frozen=True)
class Help:
    """A place that bears not even the smallest depth, and what would make it feasible."""

    side: int
    at: tuple[float, float, float]
    threshold_n: float
    force_n: float
    feed_per_tooth_mm: float | None
    diameter_mm: float | None


@dataclass(frozen=True, eq=False)
class Variant:
    """One variant.

    Attributes
    ----------
    name : ``variable``, ``constant`` or ``unconstrained``
    order : of the sides
    passes_otherwise : passes in the other order, None: one side
    held : deflection [mm] that it was planned under; infinite: none
    maps : a pass each, in the order of cutting
    program : the whole of it
    commands : on the machine
    beyond : what the machine does not give
    seconds : on the machine
    columns : a row a step of the simulation
    finish : a finished side each
    shape : the simulated stock beside the finished wall
    planned_force, planned_deflection : greatest [N], [mm]; None: compliance not known
    infeasible : places that bear nothing
    stress : greatest equivalent stress at the clamp [MPa] under the simulated forces
    """

    name: str
    order: str
    passes_otherwise: int | None
    held: float
    maps: tuple[PassMap, ...]
    program: Program
    commands: Commands
    beyond: tuple[str, ...]
    seconds: float
    columns: Mapping[str, NDArray[Any]]
    finish: tuple[Finish, ...]
    shape: Shape
    planned_force: float
    planned_deflection: float | None
    infeasible: tuple[Help, ...]
    stress: float

    @property
    def over(self) -> NDArray[np.int64]:
        """Steps whose F_n exceeds F_th by more than :data:`OVER`, the worst first."""
        ratio = self.columns["force_over_threshold"]
        bad = np.flatnonzero(ratio > 1.0 + OVER)
        return np.asarray(bad[np.argsort(-ratio[bad], kind="stable")])

    @property
    def deflection(self) -> float:
        """Greatest of the wall [mm]."""
        return float(self.columns["work_mm"].max(initial=0.0))

    @property
    def error(self) -> float:
        """Greatest size of the form error by deflection [mm]."""
        return max((float(np.abs(f.error[f.made]).max(initial=0.0)) for f in self.finish), default=0.0)

    @property
    def force(self) -> float:
        """Greatest F_n [N]."""
        return float(self.columns["force_normal_n"].max(initial=0.0))


@dataclass(frozen=True, eq=False)
class Walled:
    """A thin wall, cut.

    Attributes
    ----------
    title : of the job
    wall : its finished shape
    allowance : [mm] on k- and k+
    stock, finished : (vertices (n, 3), faces (m, 3)) of the workpiece before, and of the finished wall
    cutter, machine : of the operation
    limits, unchecked : stated limits by name, and names of those that are not stated
    threshold_source, threshold_text : ``modelled`` or ``calibrated``, and a sentence
    reserve : share by which the planner kept below the thresholds
    step_over : [mm]
    feed_per_tooth : [mm]
    variants : by name
    findings : what was noticed
    settings, provenance : JSON values
    """

    title: str
    wall: ThinWall
    allowance: tuple[float, float]
    stock: tuple[Floats, NDArray[np.int64]]
    finished: tuple[Floats, NDArray[np.int64]]
    cutter: Cutter
    machine: Machine
    limits: Mapping[str, float]
    unchecked: tuple[str, ...]
    threshold_source: str
    threshold_text: str
    reserve: float
    step_over: float
    feed_per_tooth: float
    variants: Mapping[str, Variant]
    findings: tuple[str, ...]
    settings: Mapping[str, Any]
    provenance: Mapping[str, Any]


def fails(walled: Walled, name: str) -> tuple[str, ...]:
    """What does not hold in a variant."""
    one, out = walled.variants[name], []
    if len(one.infeasible):
        worst = min(one.infeasible, key=lambda h: h.threshold_n)
        out.append(
            f"{len(one.infeasible)} places bear not even the smallest depth: at {_at(worst.at)} "
            f"{worst.threshold_n:.4g} N where it takes {worst.force_n:.4g} N: {helps(worst)}"
        )
    if len(one.over):
        k = int(one.over[0])
        c = one.columns
        out.append(
            f"{len(one.over)} of {int((c['force_normal_n'] > 0.0).sum())} contact points exceed their threshold by "
            f"more than {100 * OVER:g} %: most in {c['pass'][k]} at {_at(_where(c, k))}, {c['force_normal_n'][k]:.4g} "
            f"N of {c['threshold_n'][k]:.4g} N"
        )
    for key, value, unit in (
        ("deflection_um", 1000.0 * one.deflection, "um"),
        ("error_um", 1000.0 * one.error, "um"),
        ("torque_nm", float(one.columns["torque_nm"].max(initial=0.0)), "N m"),
    ):
        limit = walled.limits.get(key)
        if limit is not None and value > limit * (1.0 + (OVER if key == "deflection_um" else 0.0)):
            out.append(f"{key.rpartition('_')[0]} {value:.4g} {unit} exceeds {limit:g} {unit}")
    tolerance = float(walled.settings["gouge_tolerance_mm"])
    if one.shape.gouge > tolerance or one.shape.nearest < -tolerance:
        out.append(
            f"gouges the finished wall by {max(one.shape.gouge, -one.shape.nearest):.4g} mm near {_at(one.shape.at)}"
        )
    strength = float(walled.settings["yield_mpa"])
    if one.stress > strength:
        out.append(f"stress {one.stress:.4g} MPa at the clamp exceeds the yield stress {strength:g} MPa: it stays bent")
    missed = sum(int((~f.made).sum()) for f in one.finish)
    if missed:
        out.append(f"{missed} points of the finished surface are not made by any step")
    rapids = int((one.columns["rapid"] & (one.columns["chip_pieces"] > 0)).sum())
    if rapids:
        out.append(f"{rapids} rapids go through material")
    return (*out, *one.beyond)


def helps(place: Help) -> str:
    """What would make a place feasible."""
    if place.feed_per_tooth_mm is not None:
        return f"a feed of at most {place.feed_per_tooth_mm:.4g} mm a tooth would do"
    if place.diameter_mm is not None:
        return f"the edge alone is too much; a cutter of at most {place.diameter_mm:.4g} mm would do"
    return "neither a smaller feed nor a smaller cutter of this shape would do"


def verdict(walled: Walled) -> tuple[bool, str]:
    """Whether the variable plan holds, and one sentence that says it."""
    bad = fails(walled, USED)
    if bad:
        more = f"; and {len(bad) - 1} more" if len(bad) > 1 else ""
        return False, f"Does not hold: {bad[0]}{more}."
    v, c = walled.variants["variable"], walled.variants["constant"]
    share = v.seconds / c.seconds
    beside = f"{1.0 / share:.3g} times faster than" if share < 1.0 else f"{share:.3g} times slower than"
    if fails(walled, "constant"):
        beside += " a constant depth, which does not hold: "
        beside += f"{len(v.maps)} instead of {len(c.maps)} passes"
    else:
        passes = f"{len(v.maps)} instead of {len(c.maps)} passes" if len(v.maps) != len(c.maps) else "as many passes"
        beside += f" a constant depth under the same limit ({passes})"
    if v.deflection > c.deflection * (1.0 + 1e-6):
        beside += f", which bends the wall by {1e3 * c.deflection:.4g} um"
    return True, (
        f"Every contact point stays within 1 % of its threshold in the simulation: deflection {1e3 * v.deflection:.4g} "
        f"of {walled.limits['deflection_um']:g} um, {v.seconds / 60.0:.4g} min, {beside}."
    )


def _where(columns: Mapping[str, NDArray[Any]], k: int) -> tuple[float, float, float]:
    x, y, z = (float(columns[f"contact_{c}_mm"][k]) for c in "xyz")
    return x, y, z


def _at(p: tuple[float, float, float]) -> str:
    return f"({p[0]:.2f}, {p[1]:.2f}, {p[2]:.2f})"
