"""The commands ``chipload example``, ``chipload view`` and ``chipload export``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.cli.completion import example_completions
from chipload.errors import InputError
from chipload.terminal import run_guarded, show

#: examples that ``chipload demo`` runs
DEMO = ("contour", "pocket", "chips")


@app.command()
def example(
    name: Annotated[
        str | None,
        typer.Argument(help="name of the example; default: list all", autocompletion=example_completions),
    ] = None,
    folder: Annotated[Path | None, typer.Argument(metavar="DIR", help="folder for the copy")] = None,
    debug: Debug = False,
) -> None:
    """Copy an example; without a name, list them."""

    def work() -> int:
        from chipload.examples import check_name, copy_example, example_titles

        if name is None:
            for key, title in example_titles().items():
                show(f"{key:12} {title}")
            return 0
        check_name(name)
        if folder is None:
            raise InputError(f"example {name}: the folder is missing: use chipload example {name} DIR")
        show(f"copied: chipload run {copy_example(name, folder) / 'job.toml'} --out result")
        return 0

    run_guarded(work, debug)


@app.command()
def demo(
    out: Annotated[Path, typer.Argument(metavar="DIR", help="folder for the results")] = Path("result"),
    debug: Debug = False,
) -> None:
    """Run three examples (contour, pocket, chips) and write their results. Exit code 0: they were run."""

    def work() -> int:
        from importlib import resources

        from chipload.cli.inputs import show_verdict
        from chipload.jobs import load_job, run_job
        from chipload.report.folder import check_target, write_finished
        from chipload.terminal import bar

        for name in DEMO:
            check_target(out / name)
        for name in DEMO:
            with resources.as_file(resources.files("chipload.examples") / name) as folder, bar() as progress:
                done = run_job(load_job(folder / "job.toml"), progress)
                out.mkdir(parents=True, exist_ok=True)
                target = write_finished(done.result, done.presentation, out / name)
            show_verdict(done.result)
            show(f"report: {target / 'report.html'}")
        show(f"the page: chipload view {out}")
        return 0

    run_guarded(work, debug)


@app.command()
def view(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="PATH", help="a result folder, a job, a folder that holds them, or a file that init accepts"
        ),
    ],
    port: Annotated[
        int | None, typer.Option("--port", min=1, max=65535, help="port of the page; default: 8170, or a free port")
    ] = None,
    open_browser: Annotated[bool, typer.Option("--open/--no-open", help="open the page in the browser")] = True,
    debug: Debug = False,
) -> None:
    """Show results and run jobs of a folder in the browser, on this computer only. Stop with Ctrl-C.

    For a program, a drawing or a model the job is written first, into a folder beside it: the page has its questions.
    """

    def work() -> int:
        from chipload.web.serve import serve

        serve(_draft_folder(path), port, open_browser, show)
        return 0

    run_guarded(work, debug)


def _draft_folder(path: Path) -> Path:
    """The folder of the job that is written for a file; a job, a result and a folder as they are."""
    if path.suffix.lower() in (".toml", ".json", ".html") or not path.is_file():
        return path
    from chipload.jobs.drafts.draft import write_draft
    from chipload.jobs.drafts.make import draft_of

    folder = path.with_name(f"{path.stem}-job")
    if (folder / "job.toml").exists():
        show(f"{folder / 'job.toml'}: already there, as it is")
        return folder
    draft = draft_of(path, folder)
    show(f"written: {write_draft(draft, folder)}: {len(draft.guesses)} guesses to confirm")
    for question in draft.questions:
        show(f"question: {question}")
    return folder


@app.command()
def export(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="a result folder of chipload run")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="a new or empty folder for the files")],
    csv: Annotated[
        bool, typer.Option("--csv", help="write history.csv: one row for each step, units in the column names")
    ] = False,
    vtk: Annotated[
        bool, typer.Option("--vtk", help="write paths (.vtp), chips, maps and stock (.vtu), and the stock (.stl)")
    ] = False,
    glb: Annotated[bool, typer.Option("--glb", help="write chips (.glb), one body for each chip")] = False,
    sheet: Annotated[
        bool, typer.Option("--sheet", help="write the setup sheet: setup.html, and setup.pdf with chipload[export]")
    ] = False,
    load_monitor: Annotated[
        str | None,
        typer.Option(
            "--load-monitor",
            metavar="FORMAT",
            help="write reference loads of the spindle; csv: a row for each section; heidenhain: AFC-LOAD of each tool",
        ),
    ] = None,
    spindle: Annotated[
        Path | None,
        typer.Option(
            "--spindle", metavar="FILE", help="file of chipload spindle --power; reference loads are motor power then"
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Export a result as CSV, VTK, GLB and a setup sheet. Without a format option, write all four."""

    def work() -> int:
        from chipload.report.export import KINDS, export_result

        chosen = [kind for kind, wanted in zip(KINDS, (csv, vtk, glb, sheet), strict=True) if wanted]
        kinds = chosen if chosen or load_monitor is not None else KINDS
        for name in export_result(result, out, kinds, load_monitor, spindle):
            show(f"written: {out / name}")
        return 0

    run_guarded(work, debug)
