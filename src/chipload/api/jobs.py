"""Run and check jobs, write results and read them back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from chipload.api.job_tables import Values
from chipload.progress import Progress, silent

if TYPE_CHECKING:
    from chipload.jobs import FinishedJob, LoadedJob
    from chipload.result import Result


def run_job(
    job: str | Path | Values,
    overrides: Sequence[str] = (),
    *,
    folder: str | Path = ".",
    progress: Progress = silent,
) -> FinishedJob:
    """Run a job of any kind; nothing is written.

    Parameters
    ----------
    job : the job file, or its tables as values
    overrides : ``key.path=value`` texts, as ``--set`` takes them
    folder : that file names in values are relative to; those in a job file are relative to the file

    Raises
    ------
    InputError
        The job, or a file that it names, cannot be used.
    Cancelled
        By ``progress``.
    """
    from chipload import jobs

    return jobs.run_job(_loaded(job, overrides, folder), progress)


def check_job(
    job: str | Path | Values, overrides: Sequence[str] = (), *, folder: str | Path = "."
) -> tuple[list[str], bool]:
    """Read all that a job names without running it: a line for each thing that was found, and whether it holds.

    Parameters and errors are those of :func:`run_job`.
    """
    from chipload import jobs

    return jobs.check_job(_loaded(job, overrides, folder))


def write_result(job: FinishedJob, out: str | Path) -> Path:
    """Write the folder that ``chipload run`` writes, whole or not at all; errors are those of ``FinishedJob.save``."""
    return job.save(out)


def load_result(folder: str | Path) -> Result:
    """Read a result folder back; histories are read when they are asked for.

    Raises
    ------
    InputError
        The folder holds no result that can be read.
    """
    from chipload.result import load

    return load.load_result(folder)


def _loaded(job: str | Path | Values, overrides: Sequence[str], folder: str | Path) -> LoadedJob:
    from chipload import jobs

    if isinstance(job, Mapping):
        return jobs.job_of(job, folder, overrides)
    return jobs.load_job(job, overrides)
