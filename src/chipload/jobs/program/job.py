"""The job that reads a program and, with an operation, simulates it, in one setup or in several."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from chipload.errors import InputError
from chipload.jobs.program.tables import ProgramJobTable, SetupTable
from chipload.jobs.simulation.fixtures import fixture_errors
from chipload.jobs.simulation.job import ProgramJob, missing_keys, note_of_passes, program_job, stock_errors
from chipload.jobs.simulation.values import machine_table_errors
from chipload.stock.turned import turn_matrix

__all__ = ["SetupsJob", "load", "missing_keys", "resume_note"]


@dataclass(frozen=True)
class SetupsJob(ProgramJob):
    """A job with a program and its setups; see :class:`ProgramJob`."""

    table: ProgramJobTable


def load(path: Path, table: ProgramJobTable, overrides: Sequence[str]) -> SetupsJob:
    """Return the job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    return program_job(SetupsJob, path, table, overrides, tuple(_errors_of_setups(table)))


def resume_note(job: SetupsJob) -> str:
    """Return a note on what a stopped job does not resume."""
    changes = job.simulates and job.table.operation[0].speeds is not None
    passes = [*(["new speeds"] if changes else []), *(["setups before the last"] if len(job.table.setup) > 1 else [])]
    return note_of_passes(job, *passes)


def _errors_of_setups(table: ProgramJobTable) -> Iterator[str]:
    """Yield a message for each contradiction between setups, and between them and the rest of the job."""
    if not table.setup:
        return
    for key in ("part", "fixture", "machine_table"):
        if getattr(table, key):
            yield f"{key}: belongs to one setup: state it in its [[setup]]"
    if table.workpiece is not None:
        yield "workpiece: its clamps are those of one setup: run each setup as a job of its own, or leave it out"
    if table.program.placed_in is not None:
        yield "program.placed_in: each [[setup]] states its work_offset: leave it out"
    if table.operation and table.operation[0].speeds is not None:
        yield "operation.0.speeds: are found for one setup at a time: leave it out"
    for k, setup in enumerate(table.setup):
        yield from _errors_of_setup(setup, k)
    used = [(s.file, s.lines, k) for k, s in enumerate(table.setup)]
    for j, (file, lines, k) in enumerate(used):
        for other_file, other, i in used[:j]:
            if file != other_file:
                continue
            if lines is None or other is None:
                yield f"setup.{k}.lines: missing: setup.{i} and setup.{k} run the same program: state those of each"
            elif lines[0] <= other[1] and other[0] <= lines[1]:
                yield f"setup.{k}.lines = {list(lines)}: overlap those of setup.{i}, {list(other)}"


def _errors_of_setup(setup: SetupTable, k: int) -> Iterator[str]:
    key = f"setup.{k}"
    if setup.lines is not None and setup.lines[0] > setup.lines[1]:
        yield f"{key}.lines = {list(setup.lines)}: the first must not be after the last"
    carried = k > 0 and setup.stock is None
    if k == 0 and setup.stock is not None:
        yield f"{key}.stock: the first setup begins with [stock]: leave it out"
    placed = setup.zero is not None or setup.zero_mm is not None
    if setup.zero is not None and setup.zero_mm is not None:
        yield f"{key}: zero and zero_mm: state one of them"
    if not carried and (placed or setup.flip is not None):
        yield f"{key}: flip, zero and zero_mm turn the stock of the setup before, and there is none: leave them out"
    if carried and not placed:
        yield f"{key}.zero: missing: where is the program's zero on the part? state zero or zero_mm"
    if setup.flip is not None:
        try:
            turn_matrix(setup.flip.axis, setup.flip.angle_deg)
        except InputError as err:
            yield f"{key}.{err}"
    yield from (text for j, f in enumerate(setup.fixture) for text in fixture_errors(f, f"{key}.fixture.{j}"))
    yield from (f"{key}.{text}" for text in machine_table_errors(setup.machine_table))
    if k > 0 and setup.stock is not None:
        yield from (f"{key}.{text}" for text in stock_errors(setup.stock))
