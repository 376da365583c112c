"""A job that runs a program: read for its machine, and with an operation run through the stock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import Material, material_named, read_material
from chipload.job import ProgramJob
from chipload.job.tables import LOADS, SimulateTable
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.program.program import RAPID, Program
from chipload.program.read import Reading, line_times, read_program, read_tools
from chipload.progress import Progress, silent
from chipload.report.feeds import Fed
from chipload.report.held import spindle_limits
from chipload.report.reading import Read, verdict
from chipload.report.simulated import Simulated
from chipload.run.bodies import fixture_points, insides, part_body, stock_body, stock_points
from chipload.run.feeds import Asked, changeable, read_as, straight, watching, with_new_feeds
from chipload.run.formed import forming
from chipload.run.provenance import hashes, sources, title_of, versions
from chipload.run.stiffness import deflecting, stiffness_of, watched, with_columns
from chipload.simulation.chips import Resolution, counted, remove
from chipload.simulation.loads import Cuts
from chipload.simulation.pieces import remove_in_pieces
from chipload.simulation.steps import StepBlocks, steps_of
from chipload.simulation.surface import collisions, difference, in_stock
from chipload.simulation.unfinished import Unfinished
from chipload.stock.layers import LayeredStock
from chipload.units import mm_s_from_mm_min

#: of a simulation, what one pass over its steps beside the removal takes
SHARE = 0.2 / 3.0


def run_program(
    job: ProgramJob, progress: Progress = silent, unfinished: Unfinished | None = None, *, simulate: bool = True
) -> Read:
    """Read the program of a job for its machine; simulate it where the job says so.

    Parameters
    ----------
    unfinished : the folder that keeps what is finished, from which the run goes on; None: all is kept in memory
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

    def read(text: str | None = None) -> Reading:
        return read_program(
            job.program_file,
            machine,
            dialect=table.dialect,
            tools=tools,
            feed=mm_s_from_mm_min(table.feed_mm_min) if table.feed_mm_min is not None else None,
            tolerance=table.tolerance_mm,
            text=text,
            progress=lambda done, what: progress(share * done, what) if text is None else None,
        )

    reading = read()
    lines, seconds = line_times(reading, machine)
    simulated, fed = None, None
    if job.simulates:
        stock, material, begin = stock_body(job, reading.program), _material(job), share
        wants_feeds = job.table.operation[0].feeds is not None
        if wants_feeds:
            own = changeable(job.program_file, machine, table.dialect)
            straight(reading.program)
            if simulate:
                begin = 0.5 * (1.0 + share)
                fed, reading = _fed(
                    job, *own, reading, stock, material, machine, read, float(seconds.sum()),
                    lambda done, what: progress(share + (begin - share) * done, what),
                )  # fmt: skip
                lines, seconds = line_times(reading, machine)
                stock = stock_body(job, reading.program)
        if simulate:
            simulated = _simulated(
                job, reading.program, stock, machine, material, unfinished,
                lambda done, what: progress(begin + (1.0 - begin) * done, what),
            )  # fmt: skip
    files: dict[str, Path] = {"job": job.path, "program": job.program_file}
    named = {"machine": job.machine, "tools": job.tools_file, "material": job.material}
    fixtures = {f"fixture {k}": f for k, f in enumerate(job.table.fixture)}
    for name, solid in {"stock": job.table.stock, "part": job.table.part, **fixtures}.items():
        if solid is not None and solid.file is not None:
            named[name] = job.path.parent / solid.file
    files |= {k: v for k, v in named.items() if isinstance(v, Path)}
    files |= {f"cutter {k}": job.path.parent / c.file for k, c in enumerate(job.table.cutter) if c.file is not None}
    provenance = {
        "inputs": hashes(files),
        "overrides": list(job.overrides),
        "machine": f"{machine.name}: {machine.note}" if machine.note else machine.name,
        **({"material": material_provenance(simulated.material)} if simulated is not None else {}),
        "versions": versions(),
    }
    name = job.program_file.name
    return Read(
        title_of(job.path), name, reading, lines, seconds, machine, provenance, simulated, fed, job.cutters
    )  # fmt: skip


def look_at_program(job: ProgramJob) -> tuple[list[str], bool]:
    """What the program and the other files of a job hold; nothing is cut."""
    done = run_program(job, simulate=False)
    noticed = [str(f) for f in (*done.reading.noticed, *done.reading.broken)]
    return [*noticed, f"{job.path.name}: {verdict(done)[1]}"], not done.reading.broken


def simulate_read(
    job: ProgramJob,
    reading: Reading,
    machine: Machine,
    material: Material,
    stock: LayeredStock | None,
    provenance: Mapping[str, Any],
    progress: Progress = silent,
) -> Read:
    """Run a program that was read already through a stock.

    Parameters
    ----------
    job : its operation, cutters, limits, part, fixtures and stiffness count
    stock : which changes; None: that of the job
    """
    if stock is None:
        stock = stock_body(job, reading.program)
    lines, seconds = line_times(reading, machine)
    done = _simulated(job, reading.program, stock, machine, material, None, progress)
    name = job.program_file.name
    return Read(
        title_of(job.path), name, reading, lines, seconds, machine, provenance, done, cutters=job.cutters
    )  # fmt: skip


def _fed(
    job: ProgramJob,
    text: str,
    dialect: str,
    reading: Reading,
    stock: LayeredStock,
    material: Material,
    machine: Machine,
    read: Callable[[str], Reading],
    seconds: float,
    progress: Progress,
) -> tuple[Fed, Reading]:
    """The text with new feeds, from what the program cuts of a stock, which changes; and what it does then."""
    op: SimulateTable = job.table.operation[0]
    assert op.feeds is not None
    fine = _resolution(job)
    turning = np.unique(reading.program.spindle[reading.program.motion != RAPID])
    limits = {name: limit for name, limit in job.limits.items() if name in LOADS} | spindle_limits(machine, turning)
    gives = stiffness_of(job.table.stiffness, job.cutters)
    bends = deflecting(gives, material)
    asked = Asked(op.feeds, limits, fine.rotation, bends if "deflection_um" in limits else None)
    program = _with_tool(reading.program, job)
    steps = steps_of(program, op.step_mm, op.tolerance_mm)
    allowed = watching(steps, asked, job.cutters, material, machine)
    removal = remove(
        program, stock, job.cutters, material, fine, interpolation=op.interpolation,
        watch=lambda cuts: {**allowed(cuts), **bends(cuts)}, progress=progress,
    )  # fmt: skip
    removal = with_columns(removal, watched(gives))
    return with_new_feeds(
        text, dialect, reading, steps, removal, asked, job.cutters, machine, lambda new: read(read_as(new)), seconds
    )


def _resolution(job: ProgramJob) -> Resolution:
    op: SimulateTable = job.table.operation[0]
    smallest = min(c.radius for c in job.cutters.values())
    return Resolution(op.step_mm, op.tolerance_mm, op.corner_slices, op.flank_mm or 0.5 * smallest)


def _simulated(
    job: ProgramJob,
    program: Program,
    stock: LayeredStock,
    machine: Machine,
    material: Material,
    unfinished: Unfinished | None,
    progress: Progress,
) -> Simulated:
    """The program, run through the stock of the job."""
    op: SimulateTable = job.table.operation[0]
    program = _with_tool(program, job)
    fine = _resolution(job)
    points = stock_points(stock, op.stock_points_mm) if op.stock_points_mm is not None else None
    part, fixtures, before = part_body(job), fixture_points(job), insides(stock)
    stiffness = job.table.stiffness
    gives = stiffness_of(stiffness, job.cutters)
    watches = [deflecting(gives, material)]
    steps = StepBlocks(program, op.step_mm, op.tolerance_mm)
    count = counted(program, job.cutters, fine)

    def passing(share: float, what: str) -> Callable[[int], None]:
        return lambda done: progress(share + SHARE * done / count, what)

    left, solids = None, dict(fixtures)
    if part is not None:
        table = job.table.part
        assert table is not None
        left = difference(
            steps, job.cutters, part, before, table.spacing_mm, table.look_mm, op.tolerance_mm,
            passing(0.0, "distances to the part"),
        )  # fmt: skip
        solids["part"] = left.points
    # form error costs as much as the chips, and says little where nothing is known to give way
    made = left if stiffness is not None or "form_error_um" in job.limits else None
    if made is not None:
        watches.append(forming(made, gives, material))

    def watch(cuts: Cuts) -> dict[str, NDArray[np.float64]]:
        return {name: values for each in watches for name, values in each(cuts).items()}

    def removing(done: float, what: str) -> None:
        progress(SHARE + 0.8 * done, what)

    if unfinished is None:
        removal = remove(
            program, stock, job.cutters, material, fine, interpolation=op.interpolation, watch=watch, progress=removing
        )  # fmt: skip
    else:
        formed = None if made is None else (made.points, made.faces, made.distance, made.step)
        removal = remove_in_pieces(
            program, stock, job.cutters, material, fine, unfinished, interpolation=op.interpolation, watch=watch,
            also=(versions(), sources(), repr(stiffness), formed), progress=removing,
        )  # fmt: skip
    removal = with_columns(removal, watched(gives, formed=made is not None))
    touched = collisions(
        steps, job.cutters, solids, op.tolerance_mm, above_only=frozenset(["part"]),
        progress=passing(0.8 + SHARE, "collisions"),
    )  # fmt: skip
    if points is not None:
        touched += in_stock(
            steps, job.cutters, points, op.tolerance_mm, passing(0.8 + 2.0 * SHARE, "holders in the stock")
        )  # fmt: skip
    settings = {k: v for k, v in op.model_dump().items() if v is not None}
    held_against = (*solids, *(["stock"] if points is not None else []))
    return Simulated(
        removal, stock, machine, material, job.limits, job.unchecked, settings, left, touched, held_against,
        _no_holder(job), gives.unknown,
    )  # fmt: skip


def _no_holder(job: ProgramJob) -> tuple[int, ...]:
    """Tools whose holder is not stated."""
    return tuple(n for n, c in sorted(job.cutters.items()) if not c.holder)


def _material(job: ProgramJob) -> Material:
    """The coefficients that the job names."""
    assert job.material is not None
    return material_named(job.material) if isinstance(job.material, str) else read_material(job.material)


def _with_tool(program: Program, job: ProgramJob) -> Program:
    """The program without the rapids at its beginning that are made before a tool is in the spindle (T0), unless the
    job says what is in it.
    """
    if 0 in job.cutters:
        return program
    idle = (program.tool == 0) & (program.motion == RAPID)
    first = len(program) if idle.all() else int(np.argmin(idle))
    if first < 2:
        return program
    kept = {f.name: getattr(program, f.name)[first - 1 :] for f in fields(program) if f.name != "labels"}
    return replace(program, **kept)


def material_provenance(material: Material) -> dict[str, str]:
    """Where the coefficients of a material were published or measured."""
    return {
        "name": material.name,
        "workpiece": material.workpiece,
        "source": material.source,
        "conditions": material.conditions,
    }
