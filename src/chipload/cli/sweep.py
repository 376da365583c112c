"""The command ``chipload sweep``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, JobFile, app
from chipload.errors import Cancelled
from chipload.terminal import EXCEEDED, bar, run_guarded, show


@app.command()
def sweep(
    job: JobFile,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="the folder of the sweep; a stopped sweep continues")
    ],
    over: Annotated[
        list[str] | None,
        typer.Option("--over", metavar="KEY.PATH=A,B,C", help="values of a key; repeatable; runs all combinations"),
    ] = None,
    samples: Annotated[
        int,
        typer.Option(
            "--samples", help="samples of force coefficients and modes for each combination; 0: only the stated values"
        ),
    ] = 0,
    seed: Annotated[int, typer.Option("--seed", help="seed of the samples")] = 1,
    confidence: Annotated[
        float, typer.Option("--confidence", help="share of the samples in which a combination must hold")
    ] = 0.95,
    workers: Annotated[int, typer.Option("--workers", help="processes on this computer")] = 1,
    dask: Annotated[
        str | None,
        typer.Option(
            "--dask", metavar="ADDRESS", help="address of a Dask scheduler, e.g. tcp://host:8786, instead of --workers"
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Run a job for all combinations of values, and write a table, a plot and the fastest job that holds."""

    def work() -> int:
        from chipload.sweep.cases import Samples
        from chipload.sweep.run import run_sweep
        from chipload.sweep.table import write_sweep

        try:
            with bar() as progress:
                done = run_sweep(
                    job, over or (), out, samples=Samples(samples, seed), workers=workers, dask=dask,
                    confidence=confidence, progress=progress,
                )  # fmt: skip
        except (KeyboardInterrupt, Cancelled):
            raise Cancelled("finished cases are kept: the same command continues") from None
        for file in write_sweep(done, job, out):
            show(f"written: {file}")
        show(done.message)
        return 0 if done.best is not None else EXCEEDED

    run_guarded(work, debug)
