"""The job that reads a program and, with an operation, simulates it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from chipload.jobs.program.tables import ProgramJobTable
from chipload.jobs.simulation.job import ProgramJob, missing, note_of_passes, program_job

__all__ = ["load", "missing", "resume_note"]


def load(path: Path, table: ProgramJobTable, overrides: Sequence[str]) -> ProgramJob:
    """Return the job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together.
    """
    return program_job(ProgramJob, path, table, overrides)


def resume_note(job: ProgramJob) -> str:
    """Return a note on what a stopped job does not resume."""
    changes = job.simulates and job.table.operation[0].speeds is not None
    return note_of_passes(job, *(("new speeds",) if changes else ()))
