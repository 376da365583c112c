"""Preparation of a simulation before its first step, the same for a check and a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chipload.checking.clamped import require_clamped
from chipload.checking.default_checks import DefaultChecks, default_checks
from chipload.checking.inputs import CheckInputs
from chipload.checking.program_sequence import ProgramSequence
from chipload.checking.settings import SimulationSettings
from chipload.checking.stiffness import Stiffness, stiffness_of
from chipload.checking.workpiece import default_spacing, stock_points
from chipload.cutter.cutter import Cutter
from chipload.machine.machine import Machine
from chipload.program.joined_rows import join_rows
from chipload.program.program import RAPID, Program
from chipload.program.read import ProgramReading, times_of
from chipload.program.travel import leading_rows
from chipload.simulation.chips import count_steps, require_steps
from chipload.simulation.heights.height_map import require_columns
from chipload.simulation.linear_axes import with_linear_axes
from chipload.simulation.moves import leans
from chipload.simulation.removal import Resolution
from chipload.simulation.surface import require_points
from chipload.stock.layers import LayeredStock

#: slices of a corner radius where none are stated, and how they narrow towards the bottom
CORNER, GRADING = 24, 2.0
#: where the axis leans: length of a slice of the flank in smallest radii, slices of the bottom
LEANING_FLANK, LEANING_BOTTOM = 0.1, 12


@dataclass(frozen=True, eq=False)
class Bodies:
    """Prepared inputs of a simulation besides the stock: program, resolution, fixtures and stiffness.

    Parameters
    ----------
    program, times : from the first tool on, and the time of each row [s]
    resolution : of the simulation
    stock_points : points of the stock with which shank and holder are compared where the axis leans; None: none
    fixtures : their points by name
    stiffness : of cutters, holders, spindle and work
    checks : made by default
    steps : how many there are
    joined : greatest distance of the path from the rows that stand for it [mm], and how many rows they stand for
    """

    program: Program
    times: NDArray[np.float64]
    resolution: Resolution
    stock_points: NDArray[np.float64] | None
    fixtures: dict[str, NDArray[np.float64]]
    stiffness: Stiffness
    checks: DefaultChecks
    steps: int
    joined: tuple[float, int] = (0.0, 0)


def bodies_of(inputs: CheckInputs, reading: ProgramReading | ProgramSequence, stock: LayeredStock) -> Bodies:
    """Prepare the inputs of a simulation and refuse those that it cannot use; check and run begin with it.

    Raises
    ------
    InputError
        A tool has no cutter, there are too many steps or points, or values do not go together.
    """
    op, cutters, machine = inputs.settings, inputs.cutters, inputs.machine
    require_steps(reading.program, op.step_mm)
    checks = default_checks(inputs.checks, cutters, inputs.material)
    stiffness = stiffness_of(inputs.elasticity.stiffness, cutters)
    require_clamped(inputs.elasticity.workpiece, stock)
    program, times = time_rows(reading, cutters, machine, op.interpolation)
    rows = len(program)
    # a workpiece is solved where its rows cut
    join_mm = op.join_mm if inputs.elasticity.workpiece is None else None
    program, times, off = join_rows(program, times, join_mm or 0.0, op.step_mm)
    fine = resolution_of(op, cutters, program)
    count = count_steps(program, cutters, fine)
    points = _points_of_stock(inputs, program, stock)
    part = inputs.surroundings.part
    if part is not None:
        require_points(part.mesh, part.spacing_mm, "part")
    fixtures = inputs.surroundings.fixture_points(machine)
    return Bodies(program, times, fine, points, fixtures, stiffness, checks, count, (off, rows))


def _points_of_stock(inputs: CheckInputs, program: Program, stock: LayeredStock) -> NDArray[np.float64] | None:
    """Return points of the stock where the axis leans and the check is on; refuse too many, or too many columns."""
    spacing = inputs.settings.stock_points_mm
    if not inputs.checks.shank_in_stock:
        return None
    if leans(program).any():
        return stock_points(stock, default_spacing(stock) if spacing is None else spacing)
    if spacing is not None:
        require_columns(stock, spacing)
    return None


def resolution_of(op: SimulationSettings, cutters: Mapping[int, Cutter], program: Program) -> Resolution:
    """Return the resolution of a simulation by its settings, with defaults for the rest.

    By default slices of an upright cutter end where the layers end and are narrow near the bottom. A leaning cutter may
    cut with any slice: it has more of them, of equal angle, whose ends do not depend on the layers.
    """
    smallest = 0.5 * min(c.resolved_diameter for c in cutters.values())
    flank = op.flank_mm or 0.5 * smallest
    if op.corner_slices is not None:
        return Resolution(op.step_mm, op.tolerance_mm, op.corner_slices, flank, estimated=op.resolution_error)
    if (np.asarray(program.axis)[:, 2] > 1.0 - 1e-12).all():
        return Resolution(op.step_mm, op.tolerance_mm, CORNER, flank, grading=GRADING, estimated=op.resolution_error)
    flank = op.flank_mm or LEANING_FLANK * smallest
    return Resolution(
        op.step_mm, op.tolerance_mm, 2 * CORNER, flank, bottom_slices=LEANING_BOTTOM, estimated=op.resolution_error
    )


def time_rows(
    reading: ProgramReading | ProgramSequence,
    cutters: Mapping[int, Cutter],
    machine: Machine,
    interpolation: Literal["slerp", "lerp"] = "slerp",
) -> tuple[Program, NDArray[np.float64]]:
    """Return the program from its first tool on and the time of each row; omitted rows count with the first row. Where
    its axis turns along straight lines, its rows are divided.
    """
    if isinstance(reading, ProgramSequence):
        return reading.program, reading.times
    program, times = with_tool(reading.program, cutters), times_of(reading, machine)
    first = len(times) - len(program)
    times = np.concatenate([[times[: first + 1].sum()], times[first + 1 :]])
    return with_linear_axes(program, times) if interpolation == "lerp" else (program, times)


def with_tool(program: Program, cutters: Mapping[int, Cutter]) -> Program:
    """Return the program without the rapids at its beginning before a tool is in the spindle (T0), and without those
    that end before each of X, Y and Z was sent somewhere, as they come from an unknown place.

    Those without a tool stay if the job states the tool that is in the spindle.
    """
    idle = (program.tool == 0) & (program.motion == RAPID) & (0 not in cutters)
    first = len(program) if idle.all() else int(np.argmin(idle))
    first = max(first - 1, leading_rows(program.path_mode))
    if first < 1:
        return program
    kept = {f.name: getattr(program, f.name)[first:] for f in fields(program) if f.name != "labels"}
    return replace(program, **kept)
