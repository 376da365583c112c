"""The commands ``chipload run``, ``chipload fit`` and ``chipload cuts``."""

from __future__ import annotations

import math
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Accept, Debug, JobFile, Sets, app
from chipload.cli.inputs import show_verdict
from chipload.errors import Cancelled, InputError, OutputError
from chipload.number_text import number_text
from chipload.terminal import bar, run_guarded, show, write_line

#: [s] between two states of a simulation
KEEP_S = 10.0


@app.command()
def run(
    job: JobFile,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="the result folder; written completely or not at all")
    ],
    sets: Sets = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="discard the checkpoint of a stopped run and start again")
    ] = False,
    keep_s: Annotated[
        float,
        typer.Option(
            "--keep-s",
            help="seconds between two checkpoints of a simulation; 0: as often as possible",
        ),
    ] = KEEP_S,
    accept: Accept = False,
    coarse: Annotated[
        bool,
        typer.Option(
            "--coarse",
            help="use larger steps and thicker layers for a first result; the verdict is never better than unproven",
        ),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            help="number of processes that share an impeller job (without: 1), or of threads that share the simulation "
            "of a program (without: one for each core, at most 4)",
        ),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option("--dask", metavar="ADDRESS", help="address of a Dask scheduler, instead of --workers"),
    ] = None,
    debug: Debug = False,
) -> None:
    """Run a job: plan or read its programs, simulate and check them, and write the result folder.

    The same command continues a simulation or an impeller job that was stopped. Of a folder all jobs with a number run
    in their order, as `chipload init` writes them for a part with thin walls.
    """

    def work() -> int:
        if job.is_dir():
            return _run_folder()
        return _run_one(job, out)

    def _run_folder() -> int:
        from chipload.jobs.drafts.folder import jobs_in, results_of

        if sets:
            raise InputError(f"--set: {job} is a folder of jobs: change their files, or run one of them")
        target, code = results_of(job, out), 0
        target.mkdir(parents=True, exist_ok=True)
        for path in jobs_in(job):
            show(f"{path.name}:")
            code = max(code, _run_one(path, target / path.stem))
        return code

    def _run_one(job: Path, out: Path) -> int:
        from chipload.jobs import load_job, resume_note, run_job

        loaded = load_job(job, sets or ())
        if coarse:
            from chipload.jobs.coarse import coarser, mark_coarse

            loaded = load_job(job, (*(sets or ()), *coarser(loaded)))
        from chipload.report.folder import check_target, checkpoint_folder, write_finished
        from chipload.simulation.checkpoint import Checkpoint
        from chipload.workers import Workers

        where = None if workers is None and dask is None else Workers(1 if workers is None else workers, dask)
        check_target(out)
        failed = list[Exception]()
        if not 0.0 <= keep_s < math.inf:
            raise InputError(f"--keep-s = {keep_s:g}: must be at least 0 s")
        with Checkpoint(checkpoint_folder(out), keep_s, fresh=fresh, notice=write_line) as kept:
            try:
                with ExitStack() as bars:
                    progress = bars.enter_context(bar(resume_note(loaded)))
                    done = run_job(
                        loaded, lambda part, what: progress(0.8 * part, what), kept,
                        accept=accept, workers=where,
                    )  # fmt: skip
                    done = mark_coarse(done) if coarse else done

                    def verdict() -> None:
                        """Show the verdict between two bars; the pictures are made afterwards, also if it was not."""
                        nonlocal progress
                        bars.close()
                        try:
                            show_verdict(done.result, worst=coarse)
                        except (BrokenPipeError, OutputError) as err:
                            failed.append(err)
                        progress = bars.enter_context(bar())

                    target = write_finished(
                        done.result, done.presentation, out,
                        lambda part, what: progress(0.8 + 0.2 * part, what), verdict,
                    )  # fmt: skip
            except (KeyboardInterrupt, Cancelled):
                if not kept.what_is_kept():
                    raise
                raise Cancelled(
                    f"{kept.what_is_kept()} in {kept.folder.name}: the same command continues from there; with "
                    "--fresh it starts from the beginning"
                ) from None
            kept.discard()
        if failed:
            raise failed[0]
        show(f"report: {target / 'report.html'}")
        return done.result.verdict.exit_code

    run_guarded(work, debug)


@app.command()
def fit(
    file: Annotated[Path, typer.Argument(metavar="FIT", help="the fit (TOML): measured cuts, cutter, engagement")],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="the result folder; written completely or not at all")
    ],
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Identify force coefficients from measured forces; write a material and its predictions, with intervals."""

    def work() -> int:
        from chipload.jobs import load_job, run_job

        loaded = load_job(file, sets or ())
        if loaded.capability.name != "fit":
            raise InputError(f"{file.name}: has no [[measurement]]: use chipload run for this job")
        from chipload.report.folder import check_target, write_finished

        check_target(out)
        with bar() as progress:
            done = run_job(loaded, progress)
            target = write_finished(done.result, done.presentation, out)
        for f in done.result.findings:
            show(str(f))
        show_verdict(done.result)
        show(f"report: {target / 'report.html'}")
        return done.result.verdict.exit_code

    run_guarded(work, debug)


@app.command()
def cuts(
    job: JobFile,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="the table (CSV) to fill in with measured values")],
    sites: Annotated[int, typer.Option("--sites", help="number of places on the wall, at least 4")] = 6,
    repeats: Annotated[
        int, typer.Option("--repeats", help="number of places that are cut twice, to find the scatter")
    ] = 2,
    steps: Annotated[
        int, typer.Option("--steps", help="number of depths below the modelled depth, and number above it")
    ] = 2,
    bracket: Annotated[float, typer.Option("--bracket", help="ratio of the forces of consecutive depths")] = 1.25,
    scatter_percent: Annotated[float, typer.Option("--scatter-percent", help="expected scatter of a single cut")] = 5.0,
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Propose calibration cuts that measure the allowable force of a [wall]. Name the table in [threshold]."""

    def work() -> int:
        from chipload.jobs import load_job
        from chipload.jobs.thinwall.job import ThinWallJob

        read = load_job(job, sets or ()).job
        if not isinstance(read, ThinWallJob):
            raise InputError(f"{job.name}: has no [wall]: calibration cuts need a thin-wall job")
        from chipload.jobs.thinwall.run import propose
        from chipload.planning.thinwall.table import write_cuts

        with bar() as progress:
            found = propose(read, sites, scatter_percent / 100.0, bracket, steps, repeats, progress)
        write_cuts(out, found)
        for f in found.findings:
            show(str(f))
        show(
            f"{len(found.site)} cuts at {len(found.sites)} places: error of interpolation "
            f"{number_text(100.0 * found.bias, 2)} %, "
            f"error by scatter {number_text(100.0 * found.noise, 2)} % (root mean square over the wall)"
        )
        show(f'fill in the table and name it in the job: [threshold] file = "{out.name}"')
        return 0

    run_guarded(work, debug)
