"""A job that runs a program: read for its machine, and with an operation run through the stock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import Material
from chipload.errors import Severity, worst_severity
from chipload.jobs.checks import CHECK_COLUMNS, default_checks, with_checks
from chipload.jobs.program.feeds import Asked, changeable, read_as, straight, watching, with_new_feeds
from chipload.jobs.program.form_error import forming
from chipload.jobs.program.job import ProgramJob
from chipload.jobs.program.limits import spindle_limits
from chipload.jobs.program.outcome import FeedResult, ProgramResult, SimulationResult
from chipload.jobs.program.preparation import bodies_of, material_of, resolution_of, timed
from chipload.jobs.program.speeds import new_speeds, speeds_changeable, stability_of, watch_of
from chipload.jobs.program.stiffness import deflecting, stiffness_of, watched, with_columns
from chipload.jobs.program.tables import LOADS, SimulateTable
from chipload.jobs.program.workpiece import fixture_meshes, insides, stock_body
from chipload.jobs.program.workpiece_compliance import WorkpieceCompliance, with_compliance_error, workpiece_compliance
from chipload.jobs.provenance import provenance_of, sources, title_of, versions
from chipload.jobs.tables import stated
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.program.program import RAPID
from chipload.program.read import ProgramReading, line_times, read_program, read_tools
from chipload.program.setup import Setup
from chipload.progress import Progress, silent
from chipload.result import Provenance
from chipload.simulation.checkpoint import Checkpoint
from chipload.simulation.chips import remove
from chipload.simulation.chunks import remove_in_chunks
from chipload.simulation.estimate import estimate
from chipload.simulation.loads import Cuts
from chipload.simulation.steps import StepBlocks, steps_of
from chipload.simulation.surface import collisions, difference, in_stock
from chipload.stock.layers import LayeredStock
from chipload.units import mm_s_from_mm_min

#: resolution error that new feeds leave room for, over that at the programmed feeds: at the new ones other steps have
#: the worst loads, whose error is not yet known (example feeds: 1.07 % before, 1.51 % after)
SPARE = 2.0
#: of a simulation, what one pass over its steps beside the removal takes
SHARE = 0.2 / 3.0


def run(
    job: ProgramJob, progress: Progress = silent, checkpoint: Checkpoint | None = None, *, simulate: bool = True
) -> ProgramResult:
    """Read the program of a job for its machine; simulate it where the job says so.

    Parameters
    ----------
    checkpoint : the folder that keeps what is finished, from which the run goes on; None: all is kept in memory
    simulate : False: every file is read, nothing is cut

    Raises
    ------
    InputError
        A file cannot be read, the controller would refuse the program, or the stock and the cutters cannot be used.
    """
    machine = machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)
    table = job.table.program
    share = 0.1 if job.simulates else 1.0
    tools = read_tools(job.tools_file) if job.tools_file is not None else None

    def read(text: str | None = None) -> ProgramReading:
        return read_program(
            job.program_file,
            machine,
            dialect=table.dialect,
            tools=tools,
            feed=mm_s_from_mm_min(table.feed_mm_min) if table.feed_mm_min is not None else None,
            tolerance=table.tolerance_mm,
            text=text,
            setup=Setup(table.parameters, table.work_offsets, job.cutters, table.placed_in),
            comments=table.tool_comments,
            progress=lambda done, what: progress(share * done, what) if text is None else None,
        )

    def part_of(a: float, b: float) -> Progress:
        return lambda done, what: progress(a + (b - a) * done, what)

    reading = read()
    lines, seconds = line_times(reading, machine)
    simulated, feeds, speeds = None, None, None
    if job.simulates:
        stock, material, begin, compliance = stock_body(job, reading.program), material_of(job), share, None
        wants_feeds = job.table.operation[0].feeds is not None
        if wants_feeds:
            own = changeable(job.program_file, machine, table.dialect)
            straight(reading.program)
            bodies_of(job, reading, stock, machine, material)
            if simulate:
                compliance = _compliance_of_workpiece(
                    job, reading, stock, machine, material, part_of(share, 0.5 * (1.0 + share))
                )
                share = 0.5 * (1.0 + share) if compliance is not None else share
                begin = 0.5 * (1.0 + share)
                feeds, reading = _new_feeds(
                    job, *own, reading, stock, material, machine, read, float(seconds.sum()), compliance,
                    lambda done, what: progress(share + (begin - share) * done, what),
                )  # fmt: skip
                lines, seconds = line_times(reading, machine)
                stock = stock_body(job, reading.program)
        elif simulate:
            compliance = _compliance_of_workpiece(job, reading, stock, machine, material, part_of(share, 0.6))
            begin = 0.6 if compliance is not None else share
        if job.table.operation[0].speeds is not None:
            own = speeds_changeable(job.program_file, machine, table.dialect)
            straight(reading.program)
            bodies_of(job, reading, stock, machine, material)
            if simulate:
                begin = 0.5 * (1.0 + share)
                speeds, reading = new_speeds(
                    job, *own, reading, stock, material, machine, read, float(seconds.sum()),
                    compliance, lambda done, what: progress(share + (begin - share) * done, what),
                )  # fmt: skip
                lines, seconds = line_times(reading, machine)
                stock = stock_body(job, reading.program)
        if simulate:
            simulated = _simulated(
                job, reading, stock, machine, material, checkpoint, compliance,
                lambda done, what: progress(begin + (1.0 - begin) * done, what),
            )  # fmt: skip
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
    metal = (simulated.material,) if simulated is not None else ()
    provenance = provenance_of(files, job.overrides, machine, metal)
    name = job.program_file.name
    return ProgramResult(
        title_of(job.path), name, reading, lines, seconds, machine, provenance, simulated, feeds, job.cutters, speeds
    )  # fmt: skip


def check(job: ProgramJob) -> tuple[list[str], bool]:
    """What the program and the other files of a job hold, and what its simulation needs; nothing is cut.

    Raises
    ------
    InputError
        As :func:`run`, but for a cut with the spindle at rest, which only the simulation finds.
    """
    done = run(job, simulate=False)
    needs = []
    if job.simulates:
        stock, material = stock_body(job, done.reading.program), material_of(job)
        bodies = bodies_of(job, done.reading, stock, done.machine, material)
        op = job.table.operation[0]
        twice = 2 if op.feeds is not None or op.speeds is not None else 1
        needs = [estimate(twice * bodies.steps, len(done.reading.program))]
    noticed = [str(f) for f in (*done.reading.findings, *done.reading.violations)]
    count = len(done.reading.violations)
    said = f"{count} finding{'s' if count > 1 else ''} exceed the limits" if count else "the limits hold"
    holds = not count and worst_severity(done.reading.findings) < Severity.UNPROVEN
    return [*noticed, f"{job.path.name}: read; {said} of machine {done.machine.name}", *needs], holds


def simulate_read(
    job: ProgramJob,
    reading: ProgramReading,
    machine: Machine,
    material: Material,
    stock: LayeredStock | None,
    provenance: Provenance,
    progress: Progress = silent,
) -> ProgramResult:
    """Run a program that was read already through a stock.

    Parameters
    ----------
    job : its operation, cutters, limits, part, fixtures and stiffness count
    stock : which changes; None: that of the job
    """
    if stock is None:
        stock = stock_body(job, reading.program)
    lines, seconds = line_times(reading, machine)
    done = _simulated(job, reading, stock, machine, material, None, None, progress)
    name = job.program_file.name
    return ProgramResult(
        title_of(job.path), name, reading, lines, seconds, machine, provenance, done, cutters=job.cutters
    )  # fmt: skip


def _new_feeds(
    job: ProgramJob,
    text: str,
    dialect: str,
    reading: ProgramReading,
    stock: LayeredStock,
    material: Material,
    machine: Machine,
    read: Callable[[str], ProgramReading],
    seconds: float,
    compliance: WorkpieceCompliance | None,
    progress: Progress,
) -> tuple[FeedResult, ProgramReading]:
    """The text with new feeds, from what the program cuts of a stock, which changes; and what it does then."""
    op: SimulateTable = job.table.operation[0]
    fine = resolution_of(job, reading.program)
    turning = np.unique(reading.program.spindle[reading.program.motion != RAPID])
    limits = {name: limit for name, limit in job.limits.items() if name in LOADS}
    if "spindle" not in job.table.checks.off:
        limits |= spindle_limits(machine, turning)
    gives = stiffness_of(job.table.stiffness, job.cutters, None if compliance is None else compliance.steps)
    bends = with_checks(job.table.checks, material, deflecting(gives, material))
    checks = default_checks(job.table.checks, job.cutters, material, op.confidence)
    program, times = timed(reading, job, machine)
    # as it is: what its loads are, and how well they are known
    before = remove(
        program, stock, job.cutters, material, fine, interpolation=op.interpolation, times=times, watch=bends,
        engine=op.engine, progress=lambda done, what: progress(0.5 * done, what),
    )  # fmt: skip
    before = with_columns(before, (*watched(gives), *CHECK_COLUMNS))
    more = bends if limits.keys() & {"deflection_um", "deflection_workpiece_um"} else None
    errors = {name: SPARE * error for name, error in before.resolution_error.items()}
    errors = with_compliance_error(errors, before.columns, compliance)  # the compliance does not change with the feed
    before = replace(
        before, resolution_error=with_compliance_error(before.resolution_error, before.columns, compliance)
    )
    asked = Asked(stated(op.feeds, "operation.0.feeds"), limits, fine.rotation, checks, errors, more)
    steps = steps_of(program, op.step_mm, op.tolerance_mm)
    # again, for the greatest feed of each step
    allowed = remove(
        program, stock_body(job, reading.program), job.cutters, material, fine, interpolation=op.interpolation,
        times=times, watch=watching(steps, asked, job.cutters, material, machine, before.columns), accuracy=False,
        engine=op.engine, progress=lambda done, what: progress(0.5 + 0.5 * done, what),
    )  # fmt: skip
    return with_new_feeds(
        text, dialect, reading, steps, before, allowed.columns, asked, job.cutters, machine,
        lambda new: read(read_as(new)), seconds,
    )  # fmt: skip


def _simulated(
    job: ProgramJob,
    reading: ProgramReading,
    stock: LayeredStock,
    machine: Machine,
    material: Material,
    checkpoint: Checkpoint | None,
    compliance: WorkpieceCompliance | None,
    progress: Progress,
) -> SimulationResult:
    """The program, run through the stock of the job; ``compliance``: of the workpiece, None: not known yet."""
    op: SimulateTable = job.table.operation[0]
    bodies = bodies_of(job, reading, stock, machine, material)
    program, times, fine, part = bodies.program, bodies.times, bodies.resolution, bodies.part
    if compliance is None and job.table.workpiece is not None:
        compliance = _compliance_of_workpiece(job, reading, stock, machine, material, progress)
    gives = bodies.stiffness if compliance is None else stiffness_of(job.table.stiffness, job.cutters, compliance.steps)
    points, before, stiffness = bodies.stock_points, insides(stock), job.table.stiffness
    # layers that were cut before lie face on face, which rays do not tell apart
    blank = None if stock.cut.any() else stock.body()
    watches = [with_checks(job.table.checks, material, deflecting(gives, material))]
    steps = StepBlocks(program, op.step_mm, op.tolerance_mm)

    def passing(share: float, what: str) -> Callable[[int], None]:
        return lambda done: progress(share + SHARE * done / bodies.steps, what)

    left, solids = None, dict(bodies.fixtures)
    table = job.table.part
    if part is not None and table is not None:
        left = difference(
            steps, job.cutters, part, before, table.spacing_mm, table.excess_range_mm, op.tolerance_mm,
            passing(0.0, "distances to the part"),
        )  # fmt: skip
        solids["part"] = left.points
    # form error costs as much as the chips, and says little where nothing is known to give way
    made = left if stiffness is not None or compliance is not None or "form_error_um" in job.limits else None
    if made is not None:
        watches.append(forming(made, gives, material))

    stability_watch = watch_of(job, material, compliance)
    if stability_watch is not None:
        watches.append(stability_watch)

    def watch(cuts: Cuts) -> dict[str, NDArray[np.float64]]:
        return {name: values for each in watches for name, values in each(cuts).items()}

    def removing(done: float, what: str) -> None:
        progress(SHARE + 0.8 * done, what)

    if checkpoint is None:
        removal = remove(
            program, stock, job.cutters, material, fine, interpolation=op.interpolation, watch=watch, times=times,
            engine=op.engine, progress=removing,
        )  # fmt: skip
    else:
        formed = None if made is None else (made.points, made.faces, made.distance, made.step)
        removal = remove_in_chunks(
            program, stock, job.cutters, material, fine, checkpoint, interpolation=op.interpolation, watch=watch,
            keeps=stability_watch, times=times, engine=op.engine, progress=removing,
            also=(
                versions(), sources(), repr((stiffness, job.table.workpiece)), repr(job.table.checks), formed,
                None if stability_watch is None else stability_watch.dynamics,
            ),
        )  # fmt: skip
    removal = with_columns(removal, (*watched(gives, formed=made is not None), *CHECK_COLUMNS))
    removal = replace(
        removal, resolution_error=with_compliance_error(removal.resolution_error, removal.columns, compliance)
    )
    if stability_watch is not None:
        removal = with_columns(removal, stability_watch.columns)
    touched = collisions(
        steps, job.cutters, solids, op.tolerance_mm, above_only=frozenset(["part"]),
        progress=passing(0.8 + SHARE, "collisions"),
    )  # fmt: skip
    if points is not None:
        touched += in_stock(
            steps, job.cutters, points, op.tolerance_mm, passing(0.8 + 2.0 * SHARE, "holders in the stock")
        )  # fmt: skip
    settings = {k: v for k, v in op.model_dump().items() if v is not None}
    compared_with = (*solids, *(["stock"] if points is not None else []))
    return SimulationResult(
        removal, stock, machine, material, job.limits, job.unchecked, settings, bodies.checks, left, touched,
        compared_with, _no_holder(job), gives.unknown,
        None if stability_watch is None else stability_of(job, stability_watch, machine), compliance, blank,
        fixture_meshes(job),
    )  # fmt: skip


def _compliance_of_workpiece(
    job: ProgramJob,
    reading: ProgramReading,
    stock: LayeredStock,
    machine: Machine,
    material: Material,
    progress: Progress,
) -> WorkpieceCompliance | None:
    """How the workpiece gives way where the program cuts it; None: no [workpiece] is stated."""
    program, _ = timed(reading, job, machine)
    return workpiece_compliance(job, program, stock, material, resolution_of(job, program), progress)


def _no_holder(job: ProgramJob) -> tuple[int, ...]:
    """Tools whose holder is not stated."""
    return tuple(n for n, c in sorted(job.cutters.items()) if not c.holder)
