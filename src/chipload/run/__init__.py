"""From a job to its outcome: each kind of job has its file here."""

from collections.abc import Callable, Mapping
from typing import Any

from chipload.job import AnyJob, ImpellerJob, Job, ProgramJob, ShellJob, WallJob
from chipload.progress import Progress, silent
from chipload.report.impeller.outcome import Milled
from chipload.report.outcome import Outcome
from chipload.report.reading import Read
from chipload.report.shell.outcome import ShellOutcome
from chipload.report.wall.outcome import Walled
from chipload.run.impeller import look_at_impeller, run_impeller
from chipload.run.planned import Inputs, look_at_job, prove, read_inputs, run_job
from chipload.run.program import look_at_program, run_program
from chipload.run.shell import look_at_shell, run_shell
from chipload.run.wall import look_at_wall, propose, run_wall
from chipload.simulation.unfinished import Unfinished

#: an outcome of any kind
AnyOutcome = Outcome | Read | Milled | ShellOutcome | Walled
#: kinds of jobs: what runs them, and what reads all that they name and says what it found and whether that holds
KINDS: Mapping[type[AnyJob], tuple[Callable[[Any, Progress], AnyOutcome], Callable[[Any], tuple[list[str], bool]]]] = {
    Job: (run_job, look_at_job),
    ProgramJob: (run_program, look_at_program),
    ImpellerJob: (run_impeller, look_at_impeller),
    ShellJob: (run_shell, look_at_shell),
    WallJob: (run_wall, look_at_wall),
}


def run(job: AnyJob, progress: Progress = silent, unfinished: Unfinished | None = None) -> AnyOutcome:
    """Run a job of any kind; no result is written.

    Parameters
    ----------
    unfinished : the folder that keeps what is finished of a simulated program; other jobs begin at their beginning

    Raises
    ------
    InputError
        A file that it names cannot be used, or its values together.
    Cancelled
        By ``progress``.
    """
    if isinstance(job, ProgramJob):
        return run_program(job, progress, unfinished)
    return KINDS[type(job)][0](job, progress)


def look(job: AnyJob) -> tuple[list[str], bool]:
    """Read all that a job names: a line for each thing found, and whether they hold.

    Raises
    ------
    InputError
        As :func:`run`.
    """
    return KINDS[type(job)][1](job)


__all__ = ["AnyOutcome", "Inputs", "look", "propose", "prove", "read_inputs", "run", "run_job", "run_program"]
