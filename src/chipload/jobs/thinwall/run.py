"""Run of a thin-wall job: three variants are planned, written for the machine, and simulated one after another."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import default_checks
from chipload.checking.settings import CheckSettings
from chipload.cutting.material import texts_beyond_range
from chipload.errors import Finding, InputError, Severity
from chipload.jobs.tables import value_of
from chipload.jobs.thinwall.inputs import WallInputs, read_wall
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.kept_proofs import kept_of
from chipload.jobs.thinwall.outcome import (
    PlannedOperation,
    ThinWallResult,
    WallGeometry,
    WallPlanning,
)
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.jobs.thinwall.places import places_of, wall_stock
from chipload.jobs.thinwall.program_text import with_texts_read_back
from chipload.jobs.thinwall.proof import resolution_of
from chipload.jobs.thinwall.tries import Tried, compared_variants, constant_within, unlimited_plan, variable_within
from chipload.jobs.thinwall.wall_operation import WallOperation
from chipload.jobs.thinwall.wall_program import link_pass_programs, on_machine
from chipload.number_text import number_text
from chipload.planning.thinwall.blank import SIDES
from chipload.planning.thinwall.experiments import Proposal, propose_cuts
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.result import Provenance
from chipload.result.provenance import provenance_of, title_of
from chipload.simulation.checkpoint import Checkpoint
from chipload.simulation.chips import count_steps
from chipload.simulation.estimate import estimate

Floats = NDArray[np.float64]

#: of depths that are compared
VARIANTS = 3


def run(job: ThinWallJob, progress: Progress = silent, checkpoint: Checkpoint | None = None) -> ThinWallResult:
    """Plan the three variants of a job, write their programs and simulate them.

    Parameters
    ----------
    checkpoint : keeps the states that were solved and the plans that were simulated

    Raises
    ------
    InputError
        A file cannot be read, values do not go together, or the machine does not reach a place.
    Cancelled
        By ``progress``.
    """
    inputs = read_wall(job)
    _thick_enough(inputs)
    provenance = _provenance(job, inputs)
    keep = kept_of(job, checkpoint, provenance)
    tried = Tried(places_of(inputs, keep), progress, keep)
    free = tried.prove(unlimited_plan(tried.places), 0.25)
    # kept before the next plan begins: a resumed run would simulate this one again for it
    free.find_surfaces()
    constant, corrections = constant_within(tried, free)
    constant.find_surfaces()
    variable = variable_within(tried, corrections, constant)
    made = {"variable": variable, "constant": constant, "unconstrained": free}
    made |= compared_variants(tried, variable, constant)
    body, finished = inputs.stock_mesh(), inputs.finished_mesh()
    text = inputs.finished_threshold()
    settings: dict[str, Any] = {k: v for k, v in job.operation.model_dump().items() if v is not None}
    settings |= {
        "gouge_tolerance_mm": inputs.gouge_tolerance,
        "yield_mpa": job.table.workpiece.yield_mpa,
        "simulated_tries": tried.variable,
    }
    if len(job.table.operation) > 1:
        settings["operations"] = [
            {k: v for k, v in one.model_dump().items() if v is not None} for one in job.table.operation
        ]
    if job.table.neighbour:
        settings["neighbours"] = [one.model_dump(exclude_none=True) for one in job.table.neighbour]
    if inputs.body.part is not None:
        grid = inputs.body.part.grid
        settings["part"] = {
            "cell_mm": grid.widest,
            "order": grid.order,
            "unknowns": inputs.body.part.unknowns,
        }
    if job.table.dynamics is not None:
        settings["dynamics"] = job.table.dynamics.model_dump()
    cutters = {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}
    walled = ThinWallResult(
        title=title_of(job.path),
        geometry=WallGeometry(
            shape=inputs.body.shape,
            allowance=inputs.body.allowance,
            stock=(np.asarray(body.vertices), np.asarray(body.faces)),
            finished=(np.asarray(finished.vertices), np.asarray(finished.faces)),
            neighbours=inputs.neighbour_meshes,
        ),
        planning=WallPlanning(
            operations=tuple(_planned_operation(o) for o in inputs.operations),
            machine=inputs.cut.machine,
            threshold_source=text.source,
            threshold_text=text.text,
        ),
        limits=job.limits,
        unchecked=job.unchecked,
        variants=made,
        findings=_findings(inputs),
        settings=settings,
        checks=default_checks(value_of(CheckSettings, job.table.checks), cutters, inputs.cut.material),
        provenance=provenance,
    )
    found = with_texts_read_back(walled, tried)
    progress(1.0, "proved")
    return found


def _planned_operation(one: WallOperation) -> PlannedOperation:
    """An operation in the result."""
    cut = one.cut
    return PlannedOperation(
        cut.cutter,
        one.leave,
        one.table.reserve,
        abs(cut.step_over),
        cut.posture.feed_per_tooth,
        one.table.rows,
    )


def _thick_enough(inputs: WallInputs) -> None:
    """Refuse a finished wall that is thinner than one depth of cut."""
    greatest = max(o.depths.law.limits.greatest for o in inputs.operations)
    thickness, deepest = inputs.body.shape.size()[2], min(greatest, max(inputs.body.allowance))
    if not thickness >= deepest:
        raise InputError(
            f"wall: {thickness:.4g} mm thick where it is thinnest, thinner than a cut of {deepest:g} mm: state less "
            "operation.0.depth_max_mm, or a thicker wall"
        )


def check(job: ThinWallJob) -> tuple[list[str], bool]:
    """Results of a check of the files of a job: the wall, its finite elements, the greatest threshold, and the steps of
    the first variant, which is laid out but not simulated.

    Raises
    ------
    InputError
        As :func:`run`.
    """
    inputs = read_wall(job)
    _thick_enough(inputs)
    places = places_of(inputs)
    pass_programs = link_pass_programs(inputs, unlimited_plan(places).plan, places.grid)
    program = Program.join([one.program for one in pass_programs])
    on_machine(inputs, program)
    wall_stock(inputs)
    cutters = {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}
    count = count_steps(program, cutters, resolution_of(inputs, program))
    length, height, thickness = inputs.body.shape.size()
    part = inputs.body.part
    if part is None:
        nodes = len(inputs.body.wall.solid.grid.nodes)
        solved = f"{len(inputs.body.wall.solid.grid.elements)} elements, {nodes} nodes"
    else:
        solved = f"cells of {part.grid.widest:.3g} mm, {part.unknowns} unknowns"
    bearing, law = inputs.finished_threshold(), inputs.depths.law
    lines = [
        *map(str, _findings(inputs)),
        f"{job.path.name}: {inputs.body.shape.name}: {length:.4g} mm long, {height:.4g} mm high, at least "
        f"{thickness:.4g} mm thick; {solved}",
        f"threshold of the finished side {_first_side(inputs)}, {bearing.source}: "
        f"{bearing.force.min():.4g} to {number_text(bearing.force.max())} N; normal force "
        f"{number_text(law.forces[0])} N at "
        f"{law.depths[0]:g} mm, {number_text(law.forces[-1])} N at {law.depths[-1]:g} mm",
        f"{VARIANTS} variants or more; the unconstrained one: {estimate(count, 0)}",
    ]
    weak = bearing.force < law.forces[0]
    if weak.any():
        lines.append(
            f"the limit cannot be kept at {int(weak.sum())} of {weak.size} places of the finished side: the normal "
            f"force at the smallest depth, {number_text(law.forces[0])} N at {law.depths[0]:g} mm, is "
            "above their threshold"
        )
    return lines, not weak.any()


def _first_side(inputs: WallInputs) -> str:
    """The first side with stock."""
    shape = inputs.body.shape
    return f"face {shape.each[0].name}" if isinstance(shape, PartShape) else SIDES[inputs.body.side_numbers[0]]


def propose(
    job: ThinWallJob, sites: int, scatter: float, bracket: float, steps: int, repeats: int, progress: Progress = silent
) -> Proposal:
    """Calibration cuts that determine the threshold of the finished wall best: places and depths, around the modelled
    threshold.

    Parameters
    ----------
    sites, scatter, bracket, steps, repeats : as of :func:`chipload.planning.thinwall.experiments.propose_cuts`

    Raises
    ------
    InputError
        A file cannot be read, values do not go together, or a site does not allow even the smallest depth.
    """
    if job.walls:
        raise InputError("wall: calibration cuts are proposed for one [wall] of a shape only")
    if job.operation.contact == "flank":
        raise InputError("operation.0.contact = flank: calibration cuts are proposed for contact = corner only")
    inputs = read_wall(job)
    if len(inputs.operations) > 1:
        raise InputError("operation: calibration cuts are proposed for one operation: state the one to calibrate alone")
    own = inputs.operations[0]
    inputs = replace(inputs, operations=(replace(own, depths=replace(own.depths, experiments=None)),))
    u, v = np.meshgrid(*inputs.body.places, indexing="ij")
    points = inputs.coarse(inputs.body.side_numbers[0]).points.reshape(-1, 3)
    places = np.column_stack([u.ravel(), v.ravel()])
    modelled = inputs.finished_threshold().force.ravel()
    return propose_cuts(
        places, points, modelled, inputs.depths.law, sites, scatter, bracket=bracket, steps=steps, repeats=repeats,
        progress=progress,
    )  # fmt: skip


def _findings(inputs: WallInputs) -> tuple[Finding, ...]:
    """Findings on coefficients used beyond their range, and those of the reader of experiments."""
    texts: list[str] = []
    for one in inputs.operations:
        cut = one.cut
        lean = math.sin(cut.posture.beta) if isinstance(cut.posture, CutterPose) else 1.0
        speed = cut.pass_motion.spindle * cut.cutter.radius * lean
        texts += texts_beyond_range(cut.material, cut.posture.feed_per_tooth, speed)
    beyond_range = (Finding("chip-beyond-coefficients", 0, text, Severity.UNPROVEN) for text in dict.fromkeys(texts))
    return (*beyond_range, *inputs.findings)


def _provenance(job: ThinWallJob, inputs: WallInputs) -> Provenance:
    files: dict[str, Path] = {}
    named = {"machine": job.machine, "material": job.material, "threshold": job.threshold_file}
    files |= {k: v for k, v in named.items() if isinstance(v, Path)}
    files |= {f"section {k}": f for k, f in enumerate(job.section_files)}
    files |= {} if job.part_file is None else {"part": job.part_file}
    files |= {f"neighbour {k}": job.path.parent / one.file for k, one in enumerate(job.table.neighbour)}
    rows = [o.rows for o in job.table.operation]
    files |= {f"rows {k}": job.path.parent / name for k, name in enumerate(rows) if name is not None}
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    return provenance_of(files, job.overrides, inputs.cut.machine, (inputs.cut.material,))
