"""Allowable torque of a clamped workpiece, for the result and, coarsely, for a check; and remedies.

Notation as in :mod:`chipload.jobs.torque.workpiece_cut`. Where D_e or W_e alone reaches its limit d no feed is
allowable. A change alone is a remedy where the response of the edge is then at most d / :data:`MARGIN`: a depth of cut
in proportion, an overhang by its cube, a support by the deflection that it removes at the step that bends the workpiece
most, clamps or walls by their stiffness.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from chipload.control.wall import PathLimit
from chipload.cutting.material import Material
from chipload.jobs.tables import require_stated
from chipload.jobs.torque.allowable import coarser, limit_text
from chipload.jobs.torque.cut import resolution_in_stock
from chipload.jobs.torque.job import TorqueJob
from chipload.jobs.torque.outcome import AllowableTorque, ClampedWorkpiece
from chipload.jobs.torque.remedies import MARGIN
from chipload.jobs.torque.workpiece_cut import (
    AllowableWorkpiece,
    WorkpieceCut,
    planned_limit,
    responses_of,
    workpiece_cut,
)
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.program.program import Program
from chipload.simulation.chips import count_steps

#: a check simulates the plan if that takes at most so many coarse steps, in so many states of removal
MOST_PREVIEWED, STATES = 1500, 2


def clamped_workpiece(job: TorqueJob, a: AllowableWorkpiece) -> ClampedWorkpiece:
    """Data of the workpiece in the result."""
    strength = require_stated(require_stated(job.workpiece, "workpiece").yield_mpa, "workpiece.yield_mpa")
    planned, real = a.planned.compliance, a.real.compliance
    return ClampedWorkpiece(planned, real, (a.planned.strained, a.real.strained), strength, a.real.stock)


def allowable_torque(job: TorqueJob, a: AllowableWorkpiece, material: Material) -> AllowableTorque:
    """Allowable torque of the workpiece, in the result."""
    return AllowableTorque(
        limit=a.limit,
        torque=a.torque,
        true_torque=a.true_limit.torque,
        one_tooth=None,
        remedy="" if a.torque > 0.0 else remedy_on_workpiece(job, a.planned, a.limit, material),
        path=a.path,
    )


def preview_on_workpiece(job: TorqueJob, program: Program, material: Material, machine: Machine) -> tuple[str, bool]:
    """Torque limit by a coarse simulation of the plan, in a sentence, and whether there is one."""
    rough = coarser(job)
    few = require_stated(rough.workpiece, "workpiece").model_copy(update={"states": STATES})
    rough = replace(rough, table=rough.table.model_copy(update={"workpiece": few}))
    stock = require_stated(rough.table.stock, "stock")
    if count_steps(program, job.cutters, resolution_in_stock(rough, program)) > MOST_PREVIEWED:
        return "the run finds the torque limit", True
    planned = workpiece_cut(rough, stock, program, material, machine.rapid)
    limit, _ = planned_limit(rough, planned, material)
    line = int(planned.removal.columns["line"][planned.rows][limit.step])
    where = f"by the {limit.by.removeprefix('workpiece ')} of the workpiece in line {line}"
    if limit.torque <= 0.0:
        return f"no torque is allowable, {where}: {remedy_on_workpiece(rough, planned, limit, material)}", False
    return limit_text(planned, limit, where), True


def remedy_on_workpiece(job: TorqueJob, planned: WorkpieceCut, limit: PathLimit, material: Material) -> str:
    """Remedies where no torque is allowable, in a sentence."""
    found = remedies_on_workpiece(job, planned, limit, material)
    if not found:
        return (
            "no feed keeps the limits, and no change of depth of cut, clamp, wall or overhang alone does: state a "
            "sharper cutter or wider limits"
        )
    return f"no feed keeps the limits; one of these changes does: {'; '.join(found)}; or a sharper cutter"


def remedies_on_workpiece(job: TorqueJob, planned: WorkpieceCut, limit: PathLimit, material: Material) -> list[str]:
    """Changes each of which alone would do."""
    k, margins = limit.step, planned_limit(job, planned, material)[1]
    response = next(r for r in responses_of(job, planned, margin=margins) if r.by == limit.by)
    margin = float(margins[k])
    edge, allowed = float(response.edge[k]), response.most / MARGIN
    out = [_depth_text(planned, k, allowed / edge)]
    if limit.by == "strength":
        return out
    work = min((1.0 + margin) * float(planned.work.edge[k]), edge)
    tool = edge - work
    if tool < allowed:
        stiffer = work / (allowed - tool)
        bent = planned.compliance.bent
        if bent is not None and bent.before > 0.0 and work * bent.after / bent.before <= allowed - tool:
            x, y, z = bent.place
            out.append(f"a support near ({x:.3g}, {y:.3g}, {z:.3g}) mm")
        out.append(
            f"clamps or walls with which the workpiece is {number_text(stiffer, 2)} times as stiff there (a wall "
            f"{number_text(stiffer ** (1.0 / 3.0), 2)} times as thick)"
        )
    if work < allowed:
        cutter = job.cutters[int(planned.removal.columns["tool"][planned.rows][k])]
        length = cutter.overhang * ((allowed - work) / tool) ** (1.0 / 3.0)
        out.append(f"an overhang of the cutter of at most {length:.3g} mm (now {cutter.overhang:.3g})")
    return out


def _depth_text(planned: WorkpieceCut, k: int, share: float) -> str:
    """A depth of cut that is less by a share, at a step."""
    steps = planned.compliance.steps
    row = int(np.searchsorted(steps.step, planned.rows.start + k))
    low, high = steps.lines[min(row, len(steps.step) - 1), :, 2]
    depth = abs(float(high - low))
    return f"a depth of cut of at most {share * depth:.2g} mm (now {depth:.3g})"
