"""Commands for what a user has before there is a job: init and simulate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, MachineName, Sets, Tools, app
from chipload.errors import InputError
from chipload.terminal import bar, guarded, show

File = Annotated[
    Path,
    typer.Argument(
        metavar="FILE", help="NC text, CL data, CAMotics project, DXF, STEP, FreeCAD document, or sections of a blade"
    ),
]


@app.command()
def init(
    file: File,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="where job.toml is written")],
    machine: MachineName = None,
    tools: Tools = None,
    debug: Debug = False,
) -> None:
    """Write a job for a file: what the file states, and guesses for the rest, which you confirm.

    A job that is there is not overwritten.
    """

    def work() -> int:
        from chipload.jobs.drafts.draft import write_draft
        from chipload.jobs.drafts.make import draft_of

        if (folder / "job.toml").exists():
            raise InputError(f"{folder / 'job.toml'}: is there already and is not overwritten: name another folder")
        draft = draft_of(file, folder, machine=machine, tools=tools)
        job = write_draft(draft, folder)
        show(draft.title)
        for note in draft.notes:
            show(f"noticed: {note}")
        for guess in draft.guesses:
            show(f"guess: {guess}")
        show(f"written: {job}: {len(draft.guesses)} guesses to confirm; then chipload run {job} --out result")
        return 0

    guarded(work, debug)


@app.command()
def simulate(
    file: File,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="the result folder; none: the verdict alone")
    ] = None,
    machine: MachineName = None,
    tools: Tools = None,
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """A first look at a file without a job: what `init` guesses is taken as it is, so that nothing is proven."""

    def work() -> int:
        from tempfile import TemporaryDirectory

        from chipload.errors import Severity
        from chipload.jobs import load_job, run_job
        from chipload.jobs.drafts.draft import write_draft
        from chipload.jobs.drafts.make import draft_of
        from chipload.report.folder import check_target, write_finished

        if out is not None:
            check_target(out)
        with TemporaryDirectory(prefix="chipload-") as above:
            folder = Path(above) / (file.stem or "draft")
            draft = draft_of(file, folder, machine=machine, tools=tools)
            loaded = load_job(write_draft(draft, folder), sets or ())
            show(draft.title)
            for guess in loaded.guesses:
                show(f"guess: {guess.rpartition(' (line')[0]}")
            with bar() as progress:
                done = run_job(loaded, progress, guesses=Severity.UNPROVEN)
                target = write_finished(done.result, done.presentation, out) if out is not None else None
        show(done.result.message)
        show(f"{done.result.verdict.value}: a first look; chipload init {file} DIR writes the job")
        if target is not None:
            show(f"report: {target / 'report.html'}")
        return done.result.verdict.exit_code

    guarded(work, debug)
