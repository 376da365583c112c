"""The run of a simulation: read the program, find the compliance of its workpiece, simulate it in its stock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.checking.default_checks import PROGRAM_COLUMNS, with_checks
from chipload.checking.form_error import forming
from chipload.checking.outcome import CollisionCheck, ProgramResult, SimulationResult
from chipload.checking.preparation import bodies_of, material_of, resolution_of, timed
from chipload.checking.program_text import changeable, straight
from chipload.checking.stability import stability_of, watch_of
from chipload.checking.stiffness import deflecting, stiffness_of, watched, with_columns
from chipload.checking.workpiece import fixture_meshes, insides, stock_body, stock_box
from chipload.checking.workpiece_compliance import (
    WorkpieceCompliance,
    with_compliance_error,
    workpiece_compliance,
)
from chipload.cutting.material import Material
from chipload.errors import Finding, InputError, Severity, grouped, worst_severity
from chipload.jobs.simulation.job import ProgramJob
from chipload.jobs.simulation.tables import SimulateTable
from chipload.machine.ini import read_ini
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.machine.saved_offsets import saved_offsets
from chipload.program.motions import lengths
from chipload.program.program import Program
from chipload.program.read import ProgramReading, line_times, read_program, read_tools
from chipload.program.setup import Setup
from chipload.progress import Progress, silent
from chipload.result.provenance import provenance_of, sources, title_of, versions
from chipload.simulation.checkpoint import Checkpoint, digest
from chipload.simulation.chips import remove
from chipload.simulation.chunks import remove_in_chunks
from chipload.simulation.engagement_samples import EngagementRecorder
from chipload.simulation.estimate import LEANING, QUICK, SLOW, UPRIGHT, estimate, slowest_step
from chipload.simulation.hand import reversed_cuts
from chipload.simulation.kept_pass import KeptPasses
from chipload.simulation.loads import Cuts
from chipload.simulation.moves import leans
from chipload.simulation.steps import StepBlocks
from chipload.simulation.surface import collisions, difference, in_stock
from chipload.simulation.tool_change import changes_in_stock
from chipload.stock.layers import LayeredStock
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm
from chipload.workers import Workers

#: share of a simulation that one pass over its steps besides the removal takes
SHARE = 0.2 / 3.0


def machine_of(job: ProgramJob) -> Machine:
    """Return the machine that the job names."""
    return machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)


def _of_configuration(job: ProgramJob) -> tuple[dict[str, Sequence[float]], tuple[Finding, ...]]:
    """Return the work offsets that the `.ini` of a machine leads to and what it does not state; nothing of others."""
    if not isinstance(job.machine, Path) or job.machine.suffix.lower() != ".ini":
        return {}, ()
    return dict(saved_offsets(job.machine)), read_ini(job.machine)[1]


def read_for(job: ProgramJob, machine: Machine, progress: Progress = silent, text: str | None = None) -> ProgramReading:
    """Read the program of a job for a machine; ``text`` replaces the content of its file."""
    table = job.table.program
    offsets, found = _of_configuration(job)
    reading = read_program(
        job.program_file,
        machine,
        dialect=table.dialect,
        tools=read_tools(job.tools_file) if job.tools_file is not None else None,
        feed=mm_s_from_mm_min(table.feed_mm_min) if table.feed_mm_min is not None else None,
        speed=rad_s_from_rpm(table.speed_rpm) if table.speed_rpm is not None else None,
        tolerance=table.tolerance_mm,
        text=text,
        setup=Setup(table.parameters, {**offsets, **table.work_offsets}, job.cutters, table.placed_in),
        comments=table.tool_comments,
        progress=progress,
    )
    return replace(reading, findings=(*found, *reading.findings)) if found else reading


def program_of(
    job: ProgramJob, machine: Machine, reading: ProgramReading, simulated: SimulationResult | None = None
) -> ProgramResult:
    """Return the program of a job as it was read, with its times and its provenance."""
    lines, seconds = line_times(reading, machine)
    files: dict[str, Path] = {"program": job.program_file}
    named = {"machine": job.machine, "tools": job.tools_file, "material": job.material}
    fixtures = {f"fixture {k}": f for k, f in enumerate(job.table.fixture)}
    if job.table.dynamics is not None and job.table.dynamics.file is not None:
        named["modes"] = job.path.parent / job.table.dynamics.file
    for name, solid in {"stock": job.table.stock, "part": job.table.part, **fixtures}.items():
        if solid is not None and solid.file is not None:
            named[name] = job.path.parent / solid.file
    files |= {k: v for k, v in named.items() if isinstance(v, Path)}
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    metal = (simulated.checks.material,) if simulated is not None else ()
    provenance = provenance_of(files, job.overrides, machine, metal)
    name = job.program_file.name
    return ProgramResult(title_of(job.path), name, reading, lines, seconds, machine, provenance, simulated, job.cutters)


def check_lines(job: ProgramJob, done: ProgramResult, passes: int) -> tuple[list[str], bool]:
    """Return lines on the files of a job and on time and memory of its simulation, and whether the program is valid."""
    needs = []
    if job.simulates:
        stock, material = stock_body(job, done.reading.program), material_of(job)
        bodies = bodies_of(job, done.reading, stock, done.machine, material)
        needs = [estimate(passes * bodies.steps, len(done.reading.program), *_step_times(job, bodies.program, stock))]
    found = [text for _, text in grouped((*done.reading.findings, *done.reading.violations))]
    count = len(done.reading.violations)
    state = f"{count} finding{'s exceed' if count > 1 else ' exceeds'}" if count else "the program stays within"
    holds = not count and worst_severity(done.reading.findings) < Severity.UNPROVEN
    return [*found, f"{job.path.name}: valid; {state} the limits of machine {done.machine.name}", *needs], holds


def _step_times(job: ProgramJob, program: Program, stock: LayeredStock) -> tuple[float, float]:
    """Return the least and greatest processor time of a step [s] by the engine that will simulate most of a program."""
    bodies = any(c.body and n in program.tool for n, c in job.cutters.items())
    if job.table.operation[0].engine == "layers" or stock.cut.any() or bodies:
        return QUICK, SLOW
    if leans(program).any():
        return LEANING
    length = lengths(program)
    share = {n: float(length[program.tool == n].sum()) for n in job.cutters}
    slow = sum(share[n] * slowest_step(c) for n, c in job.cutters.items())
    return UPRIGHT, slow / max(sum(share.values()), np.finfo(float).tiny)


def text_to_change(
    job: ProgramJob, reading: ProgramReading, stock: LayeredStock, machine: Machine, material: Material, key: str
) -> tuple[str, str]:
    """Return the text of a program whose words the key ``key`` of the operation changes, and its dialect.

    Raises
    ------
    InputError
        The text or the simulation cannot be used.
    """
    own = changeable(job.program_file, machine, job.table.program.dialect, f"operation.0.{key}")
    straight(reading.program, key)
    bodies_of(job, reading, stock, machine, material)
    return own


def require_layers(job: ProgramJob, workers: Workers | None) -> None:
    """Refuse processes and a cluster unless the job states that layers are removed."""
    if workers is None:
        return
    if not job.simulates:
        raise InputError("--workers, --dask: the job reads its program and simulates nothing: leave them out")
    if job.table.operation[0].engine != "layers":
        raise InputError('--workers, --dask: share layers only: state engine = "layers" or leave them out')


def simulated(
    job: ProgramJob,
    reading: ProgramReading,
    stock: LayeredStock,
    machine: Machine,
    material: Material,
    checkpoint: Checkpoint | None,
    compliance: WorkpieceCompliance | None,
    progress: Progress,
    workers: Workers | None = None,
) -> SimulationResult:
    """Simulate the program in the stock of the job.

    ``compliance`` is that of the workpiece (None: not known yet); ``workers`` replace those of the operation.
    """
    op: SimulateTable = job.table.operation[0]
    bodies = bodies_of(job, reading, stock, machine, material)
    program, times, fine, part = bodies.program, bodies.times, bodies.resolution, bodies.part
    if compliance is None and job.table.workpiece is not None:
        compliance = compliance_of_workpiece(job, reading, stock, machine, material, progress)
    gives = bodies.stiffness if compliance is None else stiffness_of(job.table.stiffness, job.cutters, compliance.steps)
    points, before, stiffness = bodies.stock_points, insides(stock), job.table.stiffness
    # layers that were cut before lie face on face, which rays do not distinguish
    blank = None if stock.cut.any() else stock.body()
    watches = [with_checks(job.table.checks, material, deflecting(gives, material))]
    steps = StepBlocks(program, op.step_mm, op.tolerance_mm)

    def passing(share: float, what: str) -> Callable[[int], None]:
        return lambda done: progress(share + SHARE * done / bodies.steps, what)

    kept = KeptPasses(checkpoint, passes_key(job, bodies.program) if checkpoint is not None else "")
    left, solids = None, dict(bodies.fixtures)
    table = job.table.part
    if part is not None and table is not None:
        left = difference(
            steps, job.cutters, part, before, table.spacing_mm, table.excess_range_mm, op.tolerance_mm,
            passing(0.0, "distances to the part"), kept,
        )  # fmt: skip
        solids["part"] = left.points
    # form error costs as much as the chips, and means little without stiffness data
    made = left if stiffness is not None or compliance is not None or "form_error_um" in job.limits else None
    if made is not None:
        watches.append(forming(made, gives, material))

    stability_watch, recorder = watch_of(job, material, compliance), EngagementRecorder(material)
    watches += [recorder] if stability_watch is None else [stability_watch, recorder]

    def watch(cuts: Cuts) -> dict[str, NDArray[np.float64]]:
        return {name: values for each in watches for name, values in each(cuts).items()}

    def removing(done: float, what: str) -> None:
        progress(SHARE + 0.8 * done, what)

    if checkpoint is None:
        removal = remove(
            program, stock, job.cutters, material, fine, interpolation=op.interpolation, watch=watch, times=times,
            engine=op.engine, processes=workers or op.workers, progress=removing,
        )  # fmt: skip
    else:
        formed = None if made is None else (made.points, made.faces, made.distance, made.step)
        removal = remove_in_chunks(
            program, stock, job.cutters, material, fine, checkpoint, interpolation=op.interpolation, watch=watch,
            keeps={"engagement": recorder} | ({} if stability_watch is None else {"watch": stability_watch}),
            times=times, engine=op.engine, processes=workers or op.workers, progress=removing,
            also=(
                versions(), sources(), repr((stiffness, job.table.workpiece)), repr(job.table.checks), formed,
                None if stability_watch is None else stability_watch.dynamics,
            ),
        )  # fmt: skip
    removal = with_columns(removal, (*watched(gives, formed=made is not None), *PROGRAM_COLUMNS))
    errors = with_compliance_error(removal.resolution_error, removal.columns, compliance)
    changes = changes_in_stock(program, job.cutters, *stock_box(stock), reading.retractions)
    findings = (*removal.findings, *reversed_cuts(steps, removal.columns, job.cutters), *changes)
    if compliance is not None:
        findings += compliance.jumps(removal.columns, max(c.diameter for c in job.cutters.values()))
    removal = replace(removal, resolution_error=errors, samples=recorder.samples(), findings=findings)
    if stability_watch is not None:
        removal = with_columns(removal, stability_watch.columns)
    watching, above = passing(0.8 + SHARE, "collisions"), frozenset(["part"])
    touched = collisions(steps, job.cutters, solids, op.tolerance_mm, above_only=above, progress=watching, kept=kept)
    if points is not None:
        touched += in_stock(
            steps, job.cutters, points, op.tolerance_mm, passing(0.8 + 2.0 * SHARE, "holders in the stock"), kept
        )  # fmt: skip
    # the result does not depend on how many processes found it
    settings = {k: v for k, v in op.model_dump().items() if v is not None and k != "workers"}
    compared_with = (*solids, *(["stock"] if points is not None else []))
    return SimulationResult(
        removal, stock, machine, job.table.limits, settings, bodies.checks,
        CollisionCheck(touched, compared_with, _no_holder(job), fixture_meshes(job, machine)), left, gives.unknown,
        None if stability_watch is None else stability_of(job, stability_watch, machine), compliance, blank,
    )  # fmt: skip


def passes_key(job: ProgramJob, program: Program) -> str:
    """Return a hash of all inputs on which the passes over the steps of a program depend."""
    op: SimulateTable = job.table.operation[0]
    return digest(program, job.cutters, op.step_mm, op.tolerance_mm, versions(), sources())


def compliance_of_workpiece(
    job: ProgramJob,
    reading: ProgramReading,
    stock: LayeredStock,
    machine: Machine,
    material: Material,
    progress: Progress,
) -> WorkpieceCompliance | None:
    """Return the compliance of the workpiece where the program cuts it; None if no [workpiece] is stated."""
    program, _ = timed(reading, job, machine)
    engine = job.table.operation[0].engine
    return workpiece_compliance(job, program, stock, material, resolution_of(job, program), engine, progress)


def _no_holder(job: ProgramJob) -> tuple[int, ...]:
    """Return the tools whose holder is not stated."""
    return tuple(n for n, c in sorted(job.cutters.items()) if not c.holder)
