"""How each operation of a thin wall's job cuts: cutter, feed and rows, and what its depths of cut follow from.

Operations follow one another: each but the last leaves stock all over every side, which the next one takes with its own
cutter. Notation: r the reserve of an operation: its planner uses the share 1 - r of a threshold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.jobs.tables import stated
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.tables import WallOperationTable
from chipload.machine.machine import Machine
from chipload.planning.thinwall.depth import DepthRange, Measure
from chipload.planning.thinwall.force_table import ForceTable, law_on_stock
from chipload.planning.thinwall.paths import PassMotion
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.planning.thinwall.threshold import Experiments
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm


@dataclass(frozen=True, eq=False)
class WallCut:
    """How the wall is cut, in mm, s, rad, N; rows leave cusps of ``scallop``, ``measure`` of the force counts."""

    cutter: Cutter
    material: Material
    machine: Machine
    posture: CutterPose
    pass_motion: PassMotion
    step_over: float
    scallop: float
    measure: Measure


@dataclass(frozen=True, eq=False)
class DepthRules:
    """From what the depths of cut follow.

    Attributes
    ----------
    law, even_law : F_n of depths on stock with the slope, and on even stock, both with cusps
    slope : greatest change of depth along the surface
    deflection : that is allowed [mm]
    factor : of the thresholds, at most 1
    experiments : None: thresholds are modelled
    """

    law: ForceTable
    even_law: ForceTable
    slope: float
    deflection: float
    factor: float
    experiments: Experiments | None


@dataclass(frozen=True, eq=False)
class WallOperation:
    """An operation: its keys, how it cuts, and from what its depths follow."""

    table: WallOperationTable
    cut: WallCut
    depths: DepthRules

    @property
    def leave(self) -> float:
        """Stock that it leaves on every side [mm]."""
        return self.table.leave_mm


def wall_operation(
    job: ThinWallJob, number: int, machine: Machine, material: Material, experiments: Experiments | None
) -> WallOperation:
    """An operation of a job.

    Parameters
    ----------
    number : of the operation, in the order of cutting

    Raises
    ------
    InputError
        Values do not go together.
    """
    op = job.table.operation[number]
    cutter = job.cutters[op.cutter]
    feed, spindle = mm_s_from_mm_min(op.feed_mm_min), rad_s_from_rpm(op.speed_rpm)
    step = _step_over(op, number, cutter) * (-1.0 if op.milling == "down" else 1.0)
    posture = CutterPose(
        cutter,
        feed * math.tau / (spindle * cutter.flutes),
        step,
        math.radians(op.lead_deg),
        -math.copysign(math.radians(op.lean_deg), step),
    )
    scallop = _scallop(job, number)
    # the stock has the scallops of the pass before, which may be one of the operation before
    met = max(scallop, _scallop(job, number - 1)) if number else scallop
    limits = DepthRange(op.depth_min_mm, op.depth_max_mm)
    law, even = (
        law_on_stock(posture, material, limits, slope=slope, scallop=met, measure="greatest")
        for slope in (op.slope, 0.0)
    )
    return WallOperation(
        table=op,
        cut=WallCut(
            cutter=cutter,
            material=material,
            machine=machine,
            posture=posture,
            pass_motion=PassMotion(posture, feed, machine.rapid, spindle, op.clearance_mm),
            step_over=step,
            scallop=scallop,
            measure="greatest",
        ),
        depths=DepthRules(
            law=law,
            even_law=even,
            slope=op.slope,
            deflection=job.table.limits.deflection_workpiece_um / 1000.0,
            factor=1.0 - op.reserve,
            experiments=experiments,
        ),
    )


def _scallop(job: ThinWallJob, number: int) -> float:
    """Scallop height between the rows of an operation on a plane [mm]."""
    op = job.table.operation[number]
    cutter = job.cutters[op.cutter]
    return _step_over(op, number, cutter) ** 2 / (8.0 * cutter.corner_radius)


def _step_over(op: WallOperationTable, number: int, cutter: Cutter) -> float:
    """Step-over [mm], stated or from the height h of what two rows leave: 2 sqrt(2 r h - h^2) of a ball on a plane."""
    if op.step_over_mm is not None:
        return op.step_over_mm
    r, h = cutter.corner_radius, stated(op.scallop_um, f"operation.{number}.scallop_um") / 1000.0
    if not math.isclose(2.0 * r, cutter.diameter):
        raise InputError(
            f"operation.{number}.scallop_um: applies to ball-nose cutters only: state step_over_mm for cutter "
            f"{cutter.number} with corner_radius_mm = {r:g}"
        )
    if not h < 0.5 * r:
        raise InputError(
            f"operation.{number}.scallop_um = {op.scallop_um:g}: must be below {500.0 * r:g}, half the radius"
        )
    return 2.0 * math.sqrt(2.0 * r * h - h * h)
