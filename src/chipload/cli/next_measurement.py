"""The command ``chipload next-measurement``: the cut whose log would narrow the deciding load of a job the most."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, Sets, app
from chipload.errors import InputError
from chipload.terminal import bar, run_guarded, show


@app.command("next-measurement")
def next_measurement(
    job: Annotated[Path, typer.Argument(metavar="JOB", help="the job (TOML) of a program")],
    gain_error: Annotated[
        float,
        typer.Option("--efficiency-error", help="relative standard deviation of the efficiency of the spindle"),
    ] = 0.1,
    overrides: Sets = None,
    debug: Debug = False,
) -> None:
    """State which cut to log next: the range of lines, or the test cut of 20 s, that narrows the deciding load most.

    The job is run; of the load that is nearest to its limit at the confidence of the job the share of each coefficient
    in its variance is stated, and what a log of the power would leave of it. Nothing is written.
    """

    def work() -> int:
        from chipload import jobs
        from chipload.checking.outcome import ProgramResult
        from chipload.jobs.next_measurement import next_measurement as measurement_of

        if not 0.0 <= gain_error < 1.0:
            raise InputError(f"--efficiency-error = {gain_error:g}: must be from 0 to below 1")
        loaded = jobs.load_job(job, tuple(overrides or ()))
        with bar() as progress:
            done = jobs.run_job(loaded, progress, accept=True)
        if not isinstance(done.outcome, ProgramResult):
            raise InputError(f"{job}: a job of {loaded.capability.name}: state one that simulates a program")
        for line in measurement_of(done.outcome, done.result, gain_error).texts:
            show(line)
        return 0

    run_guarded(work, debug)
