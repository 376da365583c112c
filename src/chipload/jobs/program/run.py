"""The run of a program job: read the program for its machine and, with an operation, simulate it."""

from __future__ import annotations

from dataclasses import replace

from chipload.checking.outcome import ProgramResult
from chipload.checking.run import compliance_of_workpiece, simulate_program
from chipload.errors import InputError
from chipload.jobs.program.job import SetupsJob
from chipload.jobs.program.outcome import SpeedsProgram
from chipload.jobs.program.setups import jobs_of_setups, reading_of_setup, run_setups
from chipload.jobs.program.speeds import new_speeds, text_with_speeds
from chipload.jobs.simulation.run import (
    check_lines,
    inputs_of,
    machine_of,
    operation_of,
    program_of,
    read_for,
)
from chipload.progress import Progress, part_of, silent
from chipload.simulation.checkpoint import Checkpoint


def run(
    job: SetupsJob, progress: Progress = silent, checkpoint: Checkpoint | None = None, workers: int | None = None
) -> ProgramResult:
    """Read the program of a job for its machine; simulate it if the job states an operation, and change its speeds.

    Parameters
    ----------
    checkpoint : folder with finished work, from which a stopped run continues; None: all stays in memory
    workers : threads that share a simulation; None: as :func:`chipload.simulation.strips.threads_of`

    Raises
    ------
    InputError
        A file cannot be read, the controller would refuse the program, or the stock and the cutters cannot be used.
    """
    if workers is not None and not job.simulates:
        raise InputError(f"--workers = {workers}: nothing is simulated in a job without [[operation]]: leave it out")
    if job.table.setup:
        return run_setups(job, progress, checkpoint, workers)
    machine, begin = machine_of(job), 0.1 if job.simulates else 1.0
    reading = read_for(job, machine, part_of(progress, 0.0, begin))
    if not job.simulates:
        return program_of(job, machine, reading)
    inputs, speeds, own = inputs_of(job, machine), None, None
    stock = inputs.stock.layered(reading.program, inputs.cutters)
    if job.table.operation[0].speeds is not None:
        own = text_with_speeds(job, inputs, reading, stock)
    compliance = compliance_of_workpiece(inputs, reading, stock, part_of(progress, begin, 0.6))
    begin = 0.6 if compliance is not None else begin
    if own is not None:
        end = 0.5 * (1.0 + begin)
        speeds, reading = new_speeds(
            job, inputs, own, reading, stock, compliance, part_of(progress, begin, end), workers
        )  # fmt: skip
        stock, begin = inputs.stock.layered(reading.program, inputs.cutters), end
    done = simulate_program(
        inputs, reading, stock, compliance=compliance, checkpoint=checkpoint, workers=workers,
        progress=part_of(progress, begin, 1.0),
    )  # fmt: skip
    program = program_of(job, machine, reading, replace(done, settings=operation_of(job)))
    return program if speeds is None else SpeedsProgram(**vars(program), speeds=speeds)


def check(job: SetupsJob) -> tuple[list[str], bool]:
    """Return lines on the files of a job and on time and memory of its simulation, without simulating it.

    Raises
    ------
    InputError
        As :func:`run`.
    """
    machine = machine_of(job)
    if job.table.setup:
        return _check_setups(job)
    reading, passes = read_for(job, machine), 1
    if job.simulates and job.table.operation[0].speeds is not None:
        inputs = inputs_of(job, machine)
        text_with_speeds(job, inputs, reading, inputs.stock.layered(reading.program, inputs.cutters))
        passes = 2
    return check_lines(job, program_of(job, machine, reading), passes)


def _check_setups(job: SetupsJob) -> tuple[list[str], bool]:
    """Return lines on each setup; time and memory of the first alone, as the others begin with what it leaves."""
    machine = machine_of(job)
    lines: list[str] = []
    valid = True
    for k, one in enumerate(jobs_of_setups(job)):
        reading = reading_of_setup(job, one, k, machine)
        # only the stock of the first one is known
        shown = one if k == 0 else replace(one, table=one.table.model_copy(update={"operation": ()}))
        own, holds = check_lines(shown, program_of(one, machine, reading), 1)
        lines += [f"setup {k + 1}: {text}" for text in own]
        valid &= holds
    return lines, valid
