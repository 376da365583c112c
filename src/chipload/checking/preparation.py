"""Preparation of a simulation before its first step, the same for a check and a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from chipload.checking.clamped import require_clamped
from chipload.checking.default_checks import DefaultChecks, default_checks
from chipload.checking.stiffness import Stiffness, stiffness_of
from chipload.checking.workpiece import fixture_points, part_body, stock_points
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material, material_named, read_material
from chipload.jobs.simulation.job import ProgramJob
from chipload.jobs.simulation.tables import SimulateTable
from chipload.jobs.tables import stated
from chipload.machine.machine import Machine
from chipload.program.program import RAPID, Program
from chipload.program.read import ProgramReading, times_of
from chipload.simulation.chips import counted, require_steps
from chipload.simulation.removal import Resolution
from chipload.simulation.surface import require_points
from chipload.simulation.swept_area import require_upright
from chipload.stock.layers import LayeredStock

#: slices of a corner radius where none are stated, and how they narrow towards the bottom
CORNER, GRADING = 24, 2.0
#: where the axis leans: length of a slice of the flank in smallest radii, slices of the bottom
LEANING_FLANK, LEANING_BOTTOM = 0.1, 12


@dataclass(frozen=True, eq=False)
class Bodies:
    """Inputs of a simulation besides the stock: program, resolution, part, fixtures and stiffness.

    Parameters
    ----------
    program, times : from the first tool on, and the time of each row [s]
    resolution : of the simulation
    stock_points : points of the stock with which shank and holder are compared; None: they are not compared
    part : the finished part
    fixtures : their points by name
    stiffness : of cutters, holders, spindle and work
    checks : made by default
    steps : how many there are
    """

    program: Program
    times: NDArray[np.float64]
    resolution: Resolution
    stock_points: NDArray[np.float64] | None
    part: trimesh.Trimesh | None
    fixtures: dict[str, NDArray[np.float64]]
    stiffness: Stiffness
    checks: DefaultChecks
    steps: int


def bodies_of(
    job: ProgramJob, reading: ProgramReading, stock: LayeredStock, machine: Machine, material: Material
) -> Bodies:
    """Read the inputs of a simulation and refuse those that it cannot use; check and run of a job begin with it.

    Raises
    ------
    InputError
        A file cannot be read, a tool has no cutter, there are too many steps or points, or values do not go together.
    """
    op: SimulateTable = job.table.operation[0]
    require_steps(reading.program, op.step_mm)
    checks = default_checks(job.table.checks, job.cutters, material, op.confidence)
    stiffness = stiffness_of(job.table.stiffness, job.cutters)
    require_clamped(job.table.workpiece, stock)
    program, times = timed(reading, job, machine)
    fine = resolution_of(job, program)
    count = counted(program, job.cutters, fine)
    if op.engine == "layers":
        require_upright(program, op.step_mm, op.tolerance_mm, stock, job.cutters, op.interpolation)
    points = stock_points(stock, op.stock_points_mm) if op.stock_points_mm is not None else None
    part = part_body(job)
    if part is not None and job.table.part is not None:
        require_points(part, job.table.part.spacing_mm, "part")
    return Bodies(program, times, fine, points, part, fixture_points(job, machine), stiffness, checks, count)


def material_of(job: ProgramJob) -> Material:
    """Return the force coefficients that the job names."""
    if isinstance(job.material, Path):
        return read_material(job.material)
    return material_named(stated(job.material, "material"))


def resolution_of(job: ProgramJob, program: Program) -> Resolution:
    """Return the resolution that the job states, with defaults for the rest.

    By default slices of an upright cutter end where the layers end and are narrow near the bottom. A leaning cutter may
    cut with any slice: it has more of them, of equal angle, whose ends do not depend on the layers.
    """
    op: SimulateTable = job.table.operation[0]
    smallest = 0.5 * min(c.resolved_diameter for c in job.cutters.values())
    flank = op.flank_mm or 0.5 * smallest
    if op.corner_slices is not None:
        return Resolution(op.step_mm, op.tolerance_mm, op.corner_slices, flank, estimated=op.resolution_error)
    if (np.asarray(program.axis)[:, 2] > 1.0 - 1e-12).all():
        return Resolution(op.step_mm, op.tolerance_mm, CORNER, flank, grading=GRADING, estimated=op.resolution_error)
    flank = op.flank_mm or LEANING_FLANK * smallest
    return Resolution(
        op.step_mm, op.tolerance_mm, 2 * CORNER, flank, bottom_slices=LEANING_BOTTOM, estimated=op.resolution_error
    )


def timed(reading: ProgramReading, job: ProgramJob, machine: Machine) -> tuple[Program, NDArray[np.float64]]:
    """Return the program from its first tool on and the time of each row; omitted rows count with the first row."""
    program, times = with_tool(reading.program, job.cutters), times_of(reading, machine)
    first = len(times) - len(program)
    return program, np.concatenate([[times[: first + 1].sum()], times[first + 1 :]])


def with_tool(program: Program, cutters: Mapping[int, Cutter]) -> Program:
    """Return the program without the rapids at its beginning before a tool is in the spindle (T0).

    They stay if the job states the tool that is in the spindle.
    """
    if 0 in cutters:
        return program
    idle = (program.tool == 0) & (program.motion == RAPID)
    first = len(program) if idle.all() else int(np.argmin(idle))
    if first < 2:
        return program
    kept = {f.name: getattr(program, f.name)[first - 1 :] for f in fields(program) if f.name != "labels"}
    return replace(program, **kept)
