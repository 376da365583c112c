"""A job that gives a program new feeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from chipload.jobs.feeds.tables import FeedsJobTable, FeedsOperationTable
from chipload.jobs.simulation.job import ProgramJob, missing_keys, note_of_passes, program_job
from chipload.jobs.simulation.tables import LOADS

__all__ = ["FeedsJob", "load", "missing_keys", "resume_note"]


@dataclass(frozen=True)
class FeedsJob(ProgramJob):
    """A job that gives a program new feeds; see :class:`ProgramJob`."""

    table: FeedsJobTable

    @property
    def operation(self) -> FeedsOperationTable:
        """The operation of the job."""
        return self.table.operation[0]


def load(path: Path, table: FeedsJobTable, overrides: Sequence[str]) -> FeedsJob:
    """Return the job of a table that was read.

    Raises
    ------
    InputError
        Keys do not go together, or no limit would hold the feeds.
    """
    return program_job(FeedsJob, path, table, overrides, _contradictions(table))


def _contradictions(table: FeedsJobTable) -> Iterator[str]:
    if table.operation[0].speeds is not None:
        yield "operation.0.speeds: cannot be used with feeds: find speeds first, then feeds for the new program"
    if not any(getattr(table.limits, name) is not None for name in LOADS):
        yield (
            f"operation.0.feeds: no load limit is stated, so nothing would bound the feeds: state at least one of "
            f"{', '.join(LOADS)} in [limits]"
        )


def resume_note(job: FeedsJob) -> str:
    """Return a note on what a stopped job does not resume."""
    return note_of_passes(job, "new feeds")
