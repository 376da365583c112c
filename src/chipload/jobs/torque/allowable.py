"""The torque limit along a program: planned and true cut, and the path for the controllers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from chipload.control.linuxcnc.path import ToolPath, tool_path
from chipload.control.wall import Loads, PathLimit, UnitResponse, WallPath, path_limit, row_means, unit_response
from chipload.cutting.material import Material
from chipload.jobs.torque.confidence import limit_at_confidence
from chipload.jobs.torque.cut import (
    Cut,
    CutSteps,
    Place,
    contact_width,
    cut,
    off_centre,
    shell_stock,
    thinner_share,
    true_loads,
)
from chipload.jobs.torque.job import TorqueJob
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.program.program import Program
from chipload.progress import Progress, part_of, silent
from chipload.structure.shell import Ritz, Shell, ritz
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]

#: a check simulates the plan with steps and layers so many times as long
COARSER, COARSER_LAYERS = 4.0, 2.0
#: the torque that is allowed anywhere is at most so many times the limit
RELIEF_MOST = 3.0
#: the allowable torque is the least of so many steps on both sides
NEAR = 2


@dataclass(frozen=True, eq=False)
class Allowable:
    """Planned cut, real cut, and the allowable torque of the wall.

    Parameters
    ----------
    planned, real : what is cut
    loads : of the real cut, with a worn cutter and hard spots
    thin, true : the wall that the limit is made for, and the real one
    width : of the contact round the wall [mm]
    limit : of torque, from the wall alone
    torque : the limit that is kept [N mm], the least of that and the stated one; 0: not attainable
    response : of the real wall, one row for each step of the real cut
    path : with what is planned and what is true
    """

    planned: Cut
    real: Cut
    loads: Loads
    thin: Ritz
    true: Ritz
    width: float
    limit: PathLimit
    torque: float
    response: UnitResponse
    path: ToolPath

    @property
    def walls(self) -> tuple[WallPath, WallPath, WallPath]:
        """For the error (of the finished surface), for the stress and for the deflection (everywhere), per newton."""
        force = (row_means(self.loads.force_edge), row_means(self.loads.force_cut))
        s, soft = self.path.model.s, self.response.compliance
        error = WallPath(s, *force, np.where(self.real.makes, soft, 0.0))
        return error, WallPath(s, *force, self.response.stress), WallPath(s, *force, soft)


def allowable(
    job: TorqueJob, program: Program, material: Material, machine: Machine, progress: Progress = silent
) -> Allowable:
    """Simulate the cut in the planned and in the real stock, and find the torque limit.

    Raises
    ------
    InputError
        As :func:`chipload.jobs.torque.cut.cut`; nothing is cut on the wall.
    """
    surprises, place = job.table.surprise, Place(job.shell)
    thinner = thinner_share(surprises)
    planned = cut(job, program, shell_stock(job, program), material, machine.rapid, part_of(progress, 0.0, 0.5))
    real = cut(
        job, program, shell_stock(job, program, off_centre(job.shell.stock_mm, surprises), thinner), material,
        machine.rapid, part_of(progress, 0.5, 1.0), accuracy=True,
    )  # fmt: skip
    loads = true_loads(real.loads, real.points, place, surprises)
    shell = wall_of(job)
    width = contact_width(job.shell.stock_mm, job.cutters)
    thin, limit = limit_of(job, planned, material)
    thickness = shell.thickness * (1.0 - thinner)
    true = thin if thin.shell.thickness == thickness else ritz(replace(shell, thickness=thickness))
    stated = job.table.limits.torque_nm
    torque = limit.torque if stated is None else min(limit.torque, 1e3 * stated)
    return Allowable(
        planned, real, loads, thin, true, width, limit, torque,
        unit_response(true, real.near, real.far, width, real.tool),
        path_of(planned, loads, relief_of(limit, torque)),
    )  # fmt: skip


def wall_of(job: TorqueJob) -> Shell:
    """The finished wall as planned."""
    t = job.shell
    return Shell(t.mean_radius_mm, t.length_mm, t.wall_mm, 1e3 * t.modulus_gpa, t.poisson, math.radians(t.angle_deg))


def thinnest(job: TorqueJob) -> Shell:
    """Wall for which the limit is calculated: as thin as its tolerance allows."""
    shell = wall_of(job)
    return replace(shell, thickness=shell.thickness - job.shell.wall_tolerance_mm)


def limit_of(job: TorqueJob, planned: Cut, material: Material) -> tuple[Ritz, PathLimit]:
    """The thinnest wall and the allowable torque along the plan, with the forces at the confidence of the checks."""
    thin = ritz(thinnest(job))
    width = contact_width(job.shell.stock_mm, job.cutters)
    wall = unit_response(thin, planned.near, planned.far, width, planned.tool)

    def limit(factors: Floats) -> PathLimit:
        more = UnitResponse(factors * wall.compliance, factors * wall.stress)
        return path_limit(planned.loads, more, *allowed_bending(job))

    return thin, limit_at_confidence(job, planned, material, limit)[0]


def allowed_bending(job: TorqueJob) -> tuple[float, float]:
    """Allowed deflection [mm] and stress [MPa]."""
    limits = job.table.limits
    return 1e-3 * limits.form_error_um, limits.strength_share * job.shell.strength_mpa


def feed_at(planned: CutSteps, limit: PathLimit, k: int) -> float:
    """Feed at which a step reaches its allowable force [mm/min]."""
    loads = planned.loads
    override = (limit.each[k] - loads.torque_edge[k]) / loads.torque_cut[k]
    return float(mm_min_from_mm_s(float(planned.feed[k])) * override)


def relief_of(limit: PathLimit, torque: float) -> Floats:
    """Allowable torque at the ends of the steps over the limit, (n + 1,): the least of the steps near."""
    if torque <= 0.0:
        return np.ones(len(limit.each) + 1)
    # a stated limit holds everywhere
    each = np.clip(limit.each / torque, 1.0, RELIEF_MOST if torque >= limit.torque else 1.0)
    padded = np.concatenate([np.repeat(each[:1], NEAR + 1), each, np.repeat(each[-1:], NEAR + 1)])
    return np.asarray(sliding_window_view(padded, 2 * NEAR + 2).min(axis=1)[: len(each) + 1])


def path_of(planned: CutSteps, true: Loads, relief: Floats) -> ToolPath:
    """Path of the controllers, with the planned and the real cut."""
    believed = np.column_stack([row_means(planned.loads.torque_edge), row_means(planned.loads.torque_cut)])
    real = np.column_stack([row_means(true.torque_edge), row_means(true.torque_cut)])
    return tool_path(planned.points, np.append(planned.feed, planned.feed[-1]), believed, real, relief)


def coarser(job: TorqueJob) -> TorqueJob:
    """The same job with longer steps and thicker layers."""
    fine = job.table.simulation
    coarse = fine.model_copy(
        update={
            "step_mm": min(COARSER * fine.step_mm, 10.0),
            "layer_mm": min(COARSER_LAYERS * fine.layer_mm, 10.0),
            "tolerance_mm": max(fine.tolerance_mm, 0.02),
        }
    )
    return replace(job, table=job.table.model_copy(update={"simulation": coarse}))


def limit_text(planned: CutSteps, limit: PathLimit, where: str) -> str:
    """The limit of a coarse simulation, in a sentence."""
    feed, programmed = feed_at(planned, limit, limit.step), mm_min_from_mm_s(float(planned.feed[limit.step]))
    own = f"{number_text(programmed)} mm/min are programmed"
    return (
        f"a coarse simulation gives a torque limit of about {number_text(1e-3 * limit.torque, 2)} N m, "
        f"{where}; the feed there "
        f"must be at most {number_text(feed, 4)} mm/min, {own}"
        if feed < programmed * (1.0 - 1e-3)
        else f"a coarse simulation gives a torque limit of about {number_text(1e-3 * limit.torque, 2)} N m, {where}; "
        f"{own} there, which is within it"
    )
