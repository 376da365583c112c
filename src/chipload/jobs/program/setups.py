"""Several setups of a part: each runs its program in what the one before leaves, turned and seen from its own zero."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from chipload.checking.outcome import ProgramResult
from chipload.checking.run import simulate_program
from chipload.checking.workpiece import Stock, layer_thickness
from chipload.cutter.cutter import Cutter
from chipload.jobs.program.job import SetupsJob
from chipload.jobs.program.outcome import SetupsProgram
from chipload.jobs.program.tables import SetupTable
from chipload.jobs.simulation.run import inputs_of, machine_of, operation_of, program_of, read_for
from chipload.machine.machine import Machine
from chipload.program.lines_of import Lines, reading_of_lines
from chipload.program.program import Program
from chipload.program.read import ProgramReading
from chipload.progress import Progress, part_of, silent
from chipload.simulation.checkpoint import Checkpoint
from chipload.stock.layers import LayeredStock
from chipload.stock.turned import stock_bounds, turn_matrix, turned_stock


def run_setups(
    job: SetupsJob, progress: Progress = silent, checkpoint: Checkpoint | None = None, workers: int | None = None
) -> SetupsProgram:
    """Read and simulate each setup of a job in what the one before leaves of the stock.

    Parameters
    ----------
    checkpoint : of the last setup; those before it start again
    workers : threads that share a simulation; None: as :func:`chipload.simulation.strips.threads_of`

    Raises
    ------
    InputError
        As the run of one program.
    """
    machine, table = machine_of(job), job.table
    count = len(table.setup)
    done: list[ProgramResult] = []
    left: LayeredStock | None = None
    for k, (setup, one) in enumerate(zip(table.setup, jobs_of_setups(job), strict=True)):
        share = part_of(progress, k / count, (k + 1) / count)
        reading = reading_of_setup(job, one, k, machine, part_of(share, 0.0, 0.1))
        carried = None
        if left is not None and setup.stock is None:
            thick = None if table.stock is None else table.stock.layer_mm
            carried = carried_stock(left, setup, reading.program, job.cutters, thick)
        inputs = inputs_of(one, machine, carried)
        stock = inputs.stock.layered(reading.program, inputs.cutters)
        simulated = simulate_program(
            inputs, reading, stock, checkpoint=checkpoint if k == count - 1 else None,
            workers=workers, progress=part_of(share, 0.1, 1.0),
        )  # fmt: skip
        left = simulated.stock
        done.append(program_of(one, machine, reading, replace(simulated, settings=operation_of(job))))
    return SetupsProgram(**vars(done[-1]), setups=tuple(done))


def jobs_of_setups(job: SetupsJob) -> tuple[SetupsJob, ...]:
    """Return the job of each setup alone: its program, its place, its part and its fixtures."""
    table, out = job.table, []
    for setup in table.setup:
        program = {"placed_in": setup.work_offset} | ({} if setup.file is None else {"file": setup.file})
        own = {name: getattr(setup, name) for name in ("part", "fixture", "machine_table")}
        stock = table.stock if setup.stock is None else setup.stock
        changed = table.model_copy(
            update={**own, "stock": stock, "setup": (), "program": table.program.model_copy(update=program)}
        )
        file = job.program_file if setup.file is None else job.path.parent / setup.file
        out.append(replace(job, table=changed, program_file=file))
    return tuple(out)


def reading_of_setup(
    job: SetupsJob, one: SetupsJob, number: int, machine: Machine, progress: Progress = silent
) -> ProgramReading:
    """Return the motions of a setup: those of its lines.

    Raises
    ------
    InputError
        The program cannot be read, or no motion comes from its lines.
    """
    reading, setups = read_for(one, machine, progress), job.table.setup
    setup = setups[number]
    if setup.lines is None:
        return reading
    others = [s.lines for k, s in enumerate(setups) if k != number and s.file == setup.file]
    return reading_of_lines(reading, setup.lines, cast("Sequence[Lines]", others))


def carried_stock(
    left: LayeredStock, setup: SetupTable, program: Program, cutters: Mapping[int, Cutter], layer_mm: float | None
) -> Stock:
    """Return what a setup leaves, in the coordinates of the next one.

    Parameters
    ----------
    layer_mm : thickness of its layers; None: from the program
    """
    R = np.eye(3) if setup.flip is None else turn_matrix(setup.flip.axis, setup.flip.angle_deg)
    low, high = stock_bounds(left, R)
    zero = _zero(setup, low, high)
    layer = layer_mm or layer_thickness(program, cutters, float(high[2] - zero[2]))
    return Stock(turned_stock(left, R, zero, layer), refined_mm=layer)


def _zero(setup: SetupTable, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """The zero of a setup (3,) in the turned coordinates of the one before [mm]."""
    if setup.zero_mm is not None:
        return np.array(setup.zero_mm)
    sides = {"-": low, "0": 0.5 * (low + high), "+": high}
    return np.array([sides[name[1]][k] for k, name in enumerate(setup.zero or ())])
