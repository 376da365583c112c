"""Allowable torque of a thin wall, for the result and, coarsely, for a check."""

from __future__ import annotations

import numpy as np

from chipload.control.limit import torque_limit
from chipload.control.wall import PathLimit, path_limit
from chipload.cutting.material import Material
from chipload.jobs.torque.allowable import Allowable, allowed_bending, coarser, limit_of, limit_text, thinnest, wall_of
from chipload.jobs.torque.cut import (
    Cut,
    Place,
    cut,
    off_centre,
    resolution_in_stock,
    shell_stock,
    thinner_share,
)
from chipload.jobs.torque.job import TorqueJob
from chipload.jobs.torque.outcome import AllowableTorque, ComplianceComparison, ShellWall, SolidComparison
from chipload.jobs.torque.remedies import remedy_text
from chipload.machine.machine import Machine
from chipload.program.program import Program
from chipload.progress import silent
from chipload.simulation.chips import count_steps
from chipload.stock.layers import LayeredStock
from chipload.stock.rings import surface_off
from chipload.structure.shell import Ritz, compliance, ovalisation
from chipload.structure.wall_solid import normal_compliance, wall_solid

#: elements of the solid for comparison: half round, along, through
MESH = (24, 20, 1)
#: a check simulates the plan if that takes at most so many coarse steps
MOST_PREVIEWED = 3000


def shell_wall(job: TorqueJob, a: Allowable) -> ShellWall:
    """Data of the wall in the result."""
    place = Place(job.shell)
    low, high = _finished_heights(place, a.real)
    return ShellWall(
        shell=wall_of(job),
        thinnest=a.thin.shell.thickness,
        real=a.true.shell.thickness,
        strength=job.shell.strength_mpa,
        tolerance=job.shell.wall_tolerance_mm,
        oval=ovalisation(a.thin, a.thin.shell.length),
        oval_s=a.thin.shell.length,
        solid=_solid_comparison(a.thin, a.width, a.planned),
        surface=surface_off(a.real.stock, place.outer, low, high, job.table.simulation.tolerance_mm),
        stock=a.real.stock,
    )


def shell_torque(job: TorqueJob, a: Allowable, material: Material) -> AllowableTorque:
    """Allowable torque of the wall, in the result."""
    return AllowableTorque(
        limit=a.limit,
        torque=a.torque,
        true_torque=path_limit(a.loads, a.response, *allowed_bending(job)).torque,
        one_tooth=_one_tooth(a.limit, a.planned, material, job),
        remedy="" if a.torque > 0.0 else remedy_text(job, a.thin.shell, a.planned, a.limit, material),
        path=a.path,
    )


def real_shell_stock(job: TorqueJob, program: Program) -> LayeredStock:
    """The real stock before the program. The planned one is made too, to check that it is valid."""
    shell_stock(job, program)
    surprises = job.table.surprise
    return shell_stock(job, program, off_centre(job.shell.stock_mm, surprises), thinner_share(surprises))


def preview_of_shell(job: TorqueJob, program: Program, material: Material, machine: Machine) -> tuple[str, bool]:
    """Torque limit by a coarse simulation of the plan, in a sentence, and whether there is one."""
    rough = coarser(job)
    if count_steps(program, job.cutters, resolution_in_stock(rough, program)) > MOST_PREVIEWED:
        return "the run finds the torque limit", True
    planned = cut(rough, program, shell_stock(rough, program), material, machine.rapid, silent)
    _, limit = limit_of(rough, planned, material)
    where = f"by the wall's {limit.by}, {planned.far[limit.step]:.3g} mm from the clamp"
    if limit.torque <= 0.0:
        shell = thinnest(rough)
        return f"no torque is allowable, {where}: {remedy_text(rough, shell, planned, limit, material)}", False
    return limit_text(planned, limit, where), True


def _one_tooth(limit: PathLimit, planned: Cut, material: Material, job: TorqueJob) -> float:
    """The closed formula of one tooth at the place of the limit."""
    k, c = limit.step, planned.removal.columns
    first = int(np.flatnonzero(~c["rapid"])[0])
    depth = float(planned.far[k] - planned.near[k])
    peak, mean = float(c["torque_nm"][first + k]), float(c["torque_mean_nm"][first + k])
    if material.Krc <= 0.0 or peak <= 0.0 or depth <= 0.0:
        return 0.0
    radius = job.cutters[int(c["tool"][first + k])].radius
    return float(torque_limit(limit.force, radius, depth, material, min(mean / peak, 1.0)).torque)


def _solid_comparison(modes: Ritz, width: float, planned: Cut) -> SolidComparison:
    """The wall by hexahedra, nearest to the free end, in the middle of the rounds and nearest to the clamp."""
    on = np.flatnonzero(planned.makes & (planned.far > planned.near))
    rows = on[np.argsort(planned.far[on], kind="stable")] if len(on) else np.argsort(planned.far)[-1:]
    wall = wall_solid(modes.shell, MESH)
    out = []
    for k in dict.fromkeys((int(rows[-1]), int(rows[len(rows) // 2]), int(rows[0]))):
        a, b = float(planned.near[k]), float(planned.far[k])
        if b <= a:
            continue
        middle, length = 0.5 * (a + b), b - a
        shell = float(compliance(modes, middle, s_point=b, length=length, width=width)[2, 2])
        out.append(ComplianceComparison(b, shell, normal_compliance(wall, middle, b, length, width)))
    return SolidComparison(tuple(out), wall.counts, len(wall.factored.solid.grid.nodes))


def _finished_heights(place: Place, cut_: Cut) -> tuple[float, float]:
    """Heights between which the surface was made [mm]."""
    rows = np.flatnonzero(cut_.makes)
    if not len(rows):
        return 0.0, 0.0
    return float(cut_.points[rows + 1, 2].min()), place.ends[1]
