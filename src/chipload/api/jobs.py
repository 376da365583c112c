"""Functions that run and check a job, write its result folder and load it again."""

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
    """Run a job of any capability and return its result; no file is written.

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

    return jobs.run_job(_load_any_job(job, overrides, folder), progress)


def check_job(
    job: str | Path | Values, overrides: Sequence[str] = (), *, folder: str | Path = "."
) -> tuple[list[str], bool]:
    """Read every file that a job names, without running it.

    Parameters
    ----------
    job, overrides, folder : as of :func:`run_job`

    Returns
    -------
    Lines on what was read and estimated, and whether the job can run

    Raises
    ------
    InputError
        The job, or a file that it names, cannot be used.

    Examples
    --------
    >>> from importlib.resources import files
    >>> lines, ready = check_job(files("chipload") / "examples" / "contour" / "job.toml")
    >>> ready
    True
    """
    from chipload import jobs

    return jobs.check_job(_load_any_job(job, overrides, folder))


def write_result(job: FinishedJob, out: str | Path) -> Path:
    """Write the result folder of ``chipload run``, completely or not at all.

    Parameters
    ----------
    job : of :func:`run_job` or of a function that plans
    out : the folder; an older result in it is replaced

    Returns
    -------
    The folder

    Raises
    ------
    InputError
        The folder holds something other than an older result.
    OutputError
        The folder cannot be written.
    """
    return job.save(out)


def load_result(folder: str | Path) -> Result:
    """Load a result folder. The history of a track is read on first use.

    Raises
    ------
    InputError
        The folder holds no result that can be read.
    """
    from chipload.result import load

    return load.load_result(folder)


def _load_any_job(job: str | Path | Values, overrides: Sequence[str], folder: str | Path) -> LoadedJob:
    from chipload import jobs

    if isinstance(job, Mapping):
        return jobs.job_of(job, folder, overrides)
    return jobs.load_job(job, overrides)
