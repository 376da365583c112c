"""Operations of a thin-wall job: cutter, feed, rows and depth rules of each.

Operations follow one another. Each but the last leaves stock on every side, which the next one removes with its own
cutter. Notation: r the reserve of an operation: its planner uses the share 1 - r of a threshold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.jobs.tables import require_stated
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.program_rows import ProgramRows
from chipload.jobs.thinwall.tables import WallOperationTable, WallTable
from chipload.machine.machine import Machine
from chipload.planning.hand import clockwise_milling, require_hand
from chipload.planning.thinwall.depth import DepthRange, Measure
from chipload.planning.thinwall.end_stock import EndPose
from chipload.planning.thinwall.flank_stock import FlankPose, Pose
from chipload.planning.thinwall.force_table import ForceTable, greatest_law
from chipload.planning.thinwall.paths import PassMotion
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.planning.thinwall.threshold import Experiments
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm


@dataclass(frozen=True, eq=False)
class WallCut:
    """Cutting data of an operation, in mm, s, rad, N; rows leave scallops of height ``scallop``, and ``measure`` of the
    force counts.
    """

    cutter: Cutter
    material: Material
    machine: Machine
    posture: Pose
    pass_motion: PassMotion
    step_over: float
    scallop: float
    measure: Measure


@dataclass(frozen=True, eq=False)
class DepthRules:
    """Depth rules of an operation: force laws, slope, allowed deflection and reserve.

    Attributes
    ----------
    law, even_law : F_n of depths on stock with the slope, and on even stock, both with scallops
    slope : greatest change of depth along the surface
    deflection : allowed deflection [mm]
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
    """An operation: its keys, cutting data, depth rules, and the rows of its program if it names one."""

    table: WallOperationTable
    cut: WallCut
    depths: DepthRules
    rows: ProgramRows | None = None

    @property
    def leave(self) -> float:
        """Stock that it leaves on every side [mm]."""
        return self.table.leave_mm


def wall_operation(
    job: ThinWallJob,
    number: int,
    machine: Machine,
    material: Material,
    experiments: Experiments | None,
    rows: ProgramRows | None = None,
    before: WallOperation | None = None,
) -> WallOperation:
    """An operation of a job.

    Parameters
    ----------
    number : of the operation, in the order of cutting
    rows : of its program; None: they are planned
    before : the operation before it

    Raises
    ------
    InputError
        Values do not go together.
    """
    op = job.table.operation[number]
    cutter = job.cutters[op.cutter]
    require_hand(machine, cutter)
    feed, spindle = mm_s_from_mm_min(op.feed_mm_min), rad_s_from_rpm(op.speed_rpm)
    feed_per_tooth = feed * math.tau / (spindle * cutter.flutes)
    poses: tuple[Pose, ...] = (
        _planned_poses(op, number, cutter, feed_per_tooth) if rows is None else rows.poses(cutter, feed_per_tooth)
    )
    if cutter.flank_arc is not None:
        _check_foot(job, max(pose.below for pose in poses))
    # between rows: an axial depth apart where the flank cuts
    step_over = abs(require_stated(poses[0].step, f"operation.{number}.step_over_mm"))
    # step-over^2 / 8 r of a plane; the stock has the scallops of the pass before, which may be one of the one before
    scallop = 0.0 if op.contact != "corner" else step_over**2 / (8.0 * cutter.finishing_arc[0])
    deepest_scallop = scallop if before is None else max(scallop, before.cut.scallop)
    limits = DepthRange(op.depth_min_mm, op.depth_max_mm)
    # a flank meets the steps of its own rows; an upright cutter at most the depth at its axis
    sloped = (op.slope or 0.0) if op.contact == "corner" else 0.0
    (law, worst), (even, _) = (
        greatest_law(poses, material, limits, slope=slope, scallop=deepest_scallop, measure="greatest")
        for slope in (sloped, 0.0)
    )
    posture = poses[worst]
    return WallOperation(
        table=op,
        cut=WallCut(
            cutter=cutter,
            material=material,
            machine=machine,
            posture=posture,
            pass_motion=PassMotion(posture, feed, machine.rapid, spindle, op.clearance_mm),
            step_over=require_stated(posture.step, f"operation.{number}.step_over_mm"),
            scallop=scallop,
            measure="greatest",
        ),
        depths=DepthRules(
            law=law,
            even_law=even,
            slope=op.slope or 0.0,
            deflection=job.table.limits.deflection_workpiece_um / 1000.0,
            factor=1.0 - op.reserve,
            experiments=experiments,
        ),
        rows=rows,
    )


def _planned_poses(op: WallOperationTable, number: int, cutter: Cutter, feed_per_tooth: float) -> tuple[Pose, ...]:
    """How the cutter stands along planned rows."""
    right = clockwise_milling(require_stated(op.milling, f"operation.{number}.milling"), cutter) == "down"
    clockwise = not cutter.left_hand
    if op.contact == "flank":
        deep = require_stated(op.axial_depth_mm, f"operation.{number}.axial_depth_mm")
        return (FlankPose(cutter, feed_per_tooth, deep if right else -deep, clockwise),)
    if op.contact == "end":
        across = require_stated(op.step_over_mm, f"operation.{number}.step_over_mm")
        return (EndPose(cutter, feed_per_tooth, -across if right else across, clockwise),)
    lean, lead = (require_stated(getattr(op, key), f"operation.{number}.{key}") for key in ("lean_deg", "lead_deg"))
    step = _step_over(op, number, cutter) * (-1.0 if right else 1.0)
    tilt = -math.copysign(math.radians(lean), step)
    return (CutterPose(cutter, feed_per_tooth, step, math.radians(lead), tilt, clockwise),)


def _check_foot(job: ThinWallJob, below: float) -> None:
    """Refuse a barrel that reaches below the foot of a wall."""
    wall = job.table.wall
    feet = [("wall.foot_mm", wall.foot_mm)] if isinstance(wall, WallTable) else [
        (f"wall.{k}.foot_mm", one.foot_mm) for k, one in enumerate(wall)
    ]  # fmt: skip
    for key, foot in feet:
        if foot is not None and foot < below:
            raise InputError(
                f"{key} = {foot:g}: must be at least {below:.4g}: the barrel reaches so far below its last row, "
                "towards the clamp: state that, or touch nearer to the tip by less lean_deg"
            )


def _step_over(op: WallOperationTable, number: int, cutter: Cutter) -> float:
    """Step-over [mm], stated or from the height h of what two rows leave: 2 sqrt(2 r h - h^2) of a ball on a plane, and
    of a barrel's arc that lies across the feed.
    """
    if op.step_over_mm is not None:
        return op.step_over_mm
    r, h = cutter.finishing_arc[0], require_stated(op.scallop_um, f"operation.{number}.scallop_um") / 1000.0
    if cutter.flank_arc is not None and op.lead_deg:
        raise InputError(
            f"operation.{number}.scallop_um: of a barrel only with lead_deg = 0, where its arc lies across the feed: "
            "state step_over_mm"
        )
    if cutter.flank_arc is None and not math.isclose(2.0 * r, cutter.diameter):
        raise InputError(
            f"operation.{number}.scallop_um: applies to ball-nose and barrel cutters only: state step_over_mm for "
            f"cutter {cutter.number} with corner_radius_mm = {r:g}"
        )
    if not h < 0.5 * r:
        raise InputError(
            f"operation.{number}.scallop_um = {op.scallop_um:g}: must be below {500.0 * r:g}, half the radius"
        )
    return 2.0 * math.sqrt(2.0 * r * h - h * h)
