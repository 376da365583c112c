"""The run of a program job: read the program for its machine and, with an operation, simulate it."""

from __future__ import annotations

from chipload.checking.outcome import ProgramResult
from chipload.checking.preparation import material_of
from chipload.checking.run import (
    check_lines,
    compliance_of_workpiece,
    machine_of,
    program_of,
    read_for,
    require_layers,
    simulated,
)
from chipload.checking.workpiece import stock_body
from chipload.cutting.material import Material
from chipload.jobs.program.outcome import SpeedsProgram
from chipload.jobs.program.speeds import new_speeds, text_with_speeds
from chipload.jobs.simulation.job import ProgramJob
from chipload.machine.machine import Machine
from chipload.program.read import ProgramReading, line_times
from chipload.progress import Progress, part_of, silent
from chipload.result import Provenance
from chipload.result.provenance import title_of
from chipload.simulation.checkpoint import Checkpoint
from chipload.stock.layers import LayeredStock
from chipload.workers import Workers


def run(
    job: ProgramJob, progress: Progress = silent, checkpoint: Checkpoint | None = None, workers: Workers | None = None
) -> ProgramResult:
    """Read the program of a job for its machine; simulate it if the job states an operation, and change its speeds.

    Parameters
    ----------
    checkpoint : folder with finished work, from which a stopped run continues; None: all stays in memory
    workers : processes or a cluster that remove strips of a layered stock; None: as the operation states

    Raises
    ------
    InputError
        A file cannot be read, the controller would refuse the program, or the stock and the cutters cannot be used.
    """
    require_layers(job, workers)
    machine, begin = machine_of(job), 0.1 if job.simulates else 1.0
    reading = read_for(job, machine, part_of(progress, 0.0, begin))
    if not job.simulates:
        return program_of(job, machine, reading)
    stock, material, speeds, own = stock_body(job, reading.program), material_of(job), None, None
    if job.table.operation[0].speeds is not None:
        own = text_with_speeds(job, reading, stock, machine, material)
    compliance = compliance_of_workpiece(job, reading, stock, machine, material, part_of(progress, begin, 0.6))
    begin = 0.6 if compliance is not None else begin
    if own is not None:
        seconds, end = float(line_times(reading, machine)[1].sum()), 0.5 * (1.0 + begin)
        speeds, reading = new_speeds(
            job, *own, reading, stock, material, machine, lambda text: read_for(job, machine, text=text), seconds,
            compliance, part_of(progress, begin, end), workers,
        )  # fmt: skip
        stock, begin = stock_body(job, reading.program), end
    last = part_of(progress, begin, 1.0)
    done = simulated(job, reading, stock, machine, material, checkpoint, compliance, last, workers)
    program = program_of(job, machine, reading, done)
    return program if speeds is None else SpeedsProgram(**vars(program), speeds=speeds)


def check(job: ProgramJob) -> tuple[list[str], bool]:
    """Return lines on the files of a job and on time and memory of its simulation, without simulating it.

    Raises
    ------
    InputError
        As :func:`run`, but for a cut with the spindle at rest, which only the simulation finds.
    """
    machine = machine_of(job)
    reading, passes = read_for(job, machine), 1
    if job.simulates and job.table.operation[0].speeds is not None:
        text_with_speeds(job, reading, stock_body(job, reading.program), machine, material_of(job))
        passes = 2
    return check_lines(job, program_of(job, machine, reading), passes)


def simulate_read(
    job: ProgramJob,
    reading: ProgramReading,
    machine: Machine,
    material: Material,
    stock: LayeredStock | None,
    provenance: Provenance,
    progress: Progress = silent,
) -> ProgramResult:
    """Simulate a program that was already read.

    Parameters
    ----------
    job : its operation, cutters, limits, part, fixtures and stiffness are used
    stock : changes; None: that of the job
    """
    if stock is None:
        stock = stock_body(job, reading.program)
    lines, seconds = line_times(reading, machine)
    done = simulated(job, reading, stock, machine, material, None, None, progress)
    name = job.program_file.name
    return ProgramResult(
        title_of(job.path), name, reading, lines, seconds, machine, provenance, done, cutters=job.cutters
    )  # fmt: skip
