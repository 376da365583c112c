"""From a job to the values of its check, and what the jobs of programs share: reading, provenance, refusals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from chipload.checking.inputs import CheckInputs
from chipload.checking.outcome import ProgramResult, SimulationResult
from chipload.checking.preparation import bodies_of
from chipload.checking.program_text import changeable, straight
from chipload.checking.run import simulation_estimate
from chipload.checking.settings import CheckSettings, Limits
from chipload.checking.workpiece import FinishedPart, Stock, Surroundings
from chipload.cutting.material import Material, material_named, read_material
from chipload.errors import Finding, Severity, group_findings, worst_severity
from chipload.jobs.simulation.fixtures import fixtures_of
from chipload.jobs.simulation.job import ProgramJob
from chipload.jobs.simulation.tables import ProgramTable
from chipload.jobs.simulation.values import elasticity_of, machine_table_of, settings_of, stock_of
from chipload.jobs.tables import require_stated, value_of
from chipload.machine.ini import read_ini
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.machine.saved_offsets import saved_offsets
from chipload.program.control import ControlSettings
from chipload.program.read import ProgramReading, line_times, read_program, read_tools
from chipload.program.setup import Setup, StatedControl
from chipload.progress import Progress, silent
from chipload.result.provenance import provenance_of, title_of
from chipload.stock.layers import LayeredStock
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm


def machine_of(job: ProgramJob) -> Machine:
    """Return the machine that the job names."""
    return machine_named(job.machine) if isinstance(job.machine, str) else read_machine(job.machine)


def material_of(job: ProgramJob) -> Material:
    """Return the force coefficients that the job names."""
    if isinstance(job.material, Path):
        return read_material(job.material)
    return material_named(require_stated(job.material, "material"))


def inputs_of(job: ProgramJob, machine: Machine, stock: Stock | None = None) -> CheckInputs:
    """Return the tables of a simulation as values; every file that they name is read.

    Parameters
    ----------
    stock : that an earlier setup left; None: that of the table

    Raises
    ------
    InputError
        A file cannot be read.
    """
    table, folder = job.table, job.path.parent
    op, part = table.operation[0], None
    if (of := table.part) is not None:
        part = FinishedPart.read(
            folder / of.file, of.spacing_mm, of.excess_range_mm, units=of.units, chord_mm=of.chord_mm
        )
    stock = stock_of(require_stated(table.stock, "stock"), folder) if stock is None else stock
    fixtures = [body for k, f in enumerate(table.fixture) for body in fixtures_of(f, k, folder, stock)]
    return CheckInputs(
        cutters=job.cutters,
        material=material_of(job),
        machine=machine,
        stock=stock,
        settings=settings_of(op),
        limits=value_of(Limits, table.limits),
        checks=value_of(CheckSettings, table.checks),
        surroundings=Surroundings(part, tuple(fixtures), machine_table_of(table.machine_table)),
        elasticity=elasticity_of(table, folder),
        speeds_rpm=(None, None) if op.speeds is None else (op.speeds.least_rpm, op.speeds.most_rpm),
    )


def operation_of(job: ProgramJob) -> Mapping[str, Any]:
    """Return the keys of the operation for summary.json; the result does not depend on how many processes found it."""
    return {k: v for k, v in job.table.operation[0].model_dump().items() if v is not None}


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
        setup=Setup(
            table.parameters, {**offsets, **table.work_offsets}, job.cutters, table.placed_in, _stated_control(table)
        ),
        comments=table.tool_comments,
        progress=progress,
    )
    return replace(reading, findings=(*found, *reading.findings)) if found else reading


def _stated_control(table: ProgramTable) -> StatedControl:
    """Return what a job states about the control of its program."""
    settings = ControlSettings(**table.settings.model_dump())
    return StatedControl(table.control, table.unit, table.tools_unit, table.compensation, settings)


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
        inputs = inputs_of(job, done.machine)
        stock = inputs.stock.layered(done.reading.program, inputs.cutters)
        needs = [simulation_estimate(inputs, done.reading, stock, passes)]
    found = [text for _, text in group_findings((*done.reading.findings, *done.reading.violations))]
    count = len(done.reading.violations)
    state = f"{count} finding{'s exceed' if count > 1 else ' exceeds'}" if count else "the program stays within"
    holds = not count and worst_severity(done.reading.findings) < Severity.UNPROVEN
    return [*found, f"{job.path.name}: valid; {state} the limits of machine {done.machine.name}", *needs], holds


def text_to_change(
    job: ProgramJob, inputs: CheckInputs, reading: ProgramReading, stock: LayeredStock, key: str
) -> tuple[str, str]:
    """Return the text of a program whose words the key ``key`` of the operation changes, and its dialect.

    Raises
    ------
    InputError
        The text or the simulation cannot be used.
    """
    read_as = job.table.program.dialect if reading.recognition is None else reading.recognition.control.language
    own = changeable(job.program_file, inputs.machine, read_as, f"operation.0.{key}")
    straight(reading.program, key)
    bodies_of(inputs, reading, stock)
    return own
