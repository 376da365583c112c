"""The command ``chipload watch-folder``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, MachineName, Sets, Tools, app
from chipload.errors import Cancelled
from chipload.number_text import number_text
from chipload.terminal import run_guarded, show


@app.command("watch-folder")
def watch_folder(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="the folder that programs are posted to, with the folders in it")
    ],
    job: Annotated[
        Path | None,
        typer.Option("--job", metavar="JOB", help="a job (TOML) in which each program replaces program.file"),
    ] = None,
    machine: MachineName = None,
    tools: Tools = None,
    sets: Sets = None,
    once: Annotated[bool, typer.Option("--once", help="end when every program that is there has a verdict")] = False,
    limit_s: Annotated[float, typer.Option("--limit-s", help="seconds after which a program is given up")] = 600.0,
    settle_s: Annotated[
        float, typer.Option("--settle-s", help="seconds without a change after which a program counts as complete")
    ] = 2.0,
    debug: Debug = False,
) -> None:
    """Simulate each program that is new or has changed in a folder, and lay its verdict and report beside it.

    For part.nc these are part.nc.verdict.txt and the folder part.nc-chipload. Without --job a program is simulated with
    the guesses of `init`, so that its verdict is never better than unproven. A program with a verdict is simulated
    again only if it, the job or the options change. Stop with Ctrl-C; the same command continues.
    """

    def work() -> int:
        from chipload.sweep.watched_folder import FINISHED, FolderSettings, result_folder, worst_code
        from chipload.sweep.watched_folder import watch_folder as checked_programs

        settings = FolderSettings(job, machine, tools, tuple(sets or ()), limit_s)
        codes: list[int] = []
        try:
            for one in checked_programs(folder, settings, once=once, settle_s=settle_s):
                codes.append(one.code)
                show(f"{one.program.relative_to(folder)}: {one.line} ({number_text(one.time_s, 3)} s)")
                if one.code in FINISHED:
                    show(f"report: {result_folder(one.program) / 'report.html'}")
        except KeyboardInterrupt:
            raise Cancelled(f"{len(codes)} programs have a new verdict; the same command continues") from None
        return worst_code(codes)

    run_guarded(work, debug)
