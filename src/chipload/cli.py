"""The command line: parse, call one function, show.

Exit codes of every command: 0 done and every limit holds; 2 the input is wrong (one line, nothing written); 3 done, but
a limit or a status does not hold; 1 a fault of ours; 130 stopped by Ctrl-C. Imports are late so that `--help` is quick.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from chipload.errors import Cancelled, InputError

FAULT, WRONG, EXCEEDED, STOPPED = 1, 2, 3, 130

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Plans and proves CNC milling of the parts that are hard to mill.",
    epilog="Exit codes: 0 every limit holds; 2 wrong input, nothing written; 3 a limit does not hold; 1 our fault.",
)

JobFile = Annotated[Path, typer.Argument(metavar="JOB", help="the job file (TOML)")]
Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY.PATH=VALUE",
        help="override a key, as cutter.0.diameter_mm=12; repeatable; files are relative to the job's folder",
    ),
]
Debug = Annotated[bool, typer.Option("--debug", help="show the traceback of a fault")]


@app.command()
def run(
    job: JobFile,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="the result folder; appears whole or not at all")],
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Plan a job, prove its programs, write the result folder."""

    def work() -> int:
        from chipload.job import load_job

        read = load_job(job, sets or ())
        from chipload.report.folder import check_target, write_result
        from chipload.report.outcome import verdict
        from chipload.run import run_job

        check_target(out)
        with _bar() as progress:
            outcome = run_job(read, lambda done, what: progress(0.8 * done, what))
            target = write_result(outcome, out, lambda done, what: progress(0.8 + 0.2 * done, what))
        holds, says = verdict(outcome)
        typer.echo(says)
        typer.echo(f"report: {target / 'report.html'}")
        return 0 if holds else EXCEEDED

    _guarded(work, debug)


@app.command()
def check(job: JobFile, sets: Sets = None, debug: Debug = False) -> None:
    """Read a job and every file that it names; plan nothing, write nothing."""

    def work() -> int:
        from chipload.job import load_job

        read = load_job(job, sets or ())
        from chipload.run import read_inputs

        inputs = read_inputs(read)
        closed = sum(c.closed for c in inputs.contours)
        typer.echo(
            f"{job.name}: right: {closed} closed and {len(inputs.contours) - closed} open contours, "
            f"machine {inputs.machine.name}, material {inputs.material.name}"
        )
        for k, op in enumerate(read.operations):
            typer.echo(f"operation {k}: {op.kind}, cutter {op.cutter} of {read.cutters[op.cutter].diameter:g} mm")
        for text in (*read.findings, *inputs.findings):
            typer.echo(f"finding: {text}")
        if read.unchecked:
            typer.echo(f"not checked, no limit stated: {', '.join(read.unchecked)}")
        return 0

    _guarded(work, debug)


@app.command()
def example(
    name: Annotated[str | None, typer.Argument(help="the example; none: list them")] = None,
    folder: Annotated[Path | None, typer.Argument(metavar="DIR", help="where it is copied to")] = None,
    debug: Debug = False,
) -> None:
    """List the examples, or copy one out."""

    def work() -> int:
        from chipload.examples import copy_example, example_titles

        if name is None:
            for key, title in example_titles().items():
                typer.echo(f"{key:12} {title}")
            return 0
        if folder is None:
            raise InputError(f"example {name}: missing folder: chipload example {name} DIR")
        typer.echo(f"copied: chipload run {copy_example(name, folder) / 'job.toml'} --out result")
        return 0

    _guarded(work, debug)


@app.callback(invoke_without_command=True)
def top(version: Annotated[bool, typer.Option("--version", help="show the version and leave")] = False) -> None:
    """Plan and prove CNC milling of the parts that are hard to mill."""
    if version:
        from importlib.metadata import version as installed

        typer.echo(f"chipload {installed('chipload')}")
        raise typer.Exit


def main() -> NoReturn:
    """Entry of the command ``chipload``."""
    signal.signal(signal.SIGTERM, _stop)
    app()
    sys.exit(0)


def _stop(_number: int, _frame: object) -> NoReturn:
    """A polite kill stops as Ctrl-C does."""
    raise KeyboardInterrupt


def _guarded(work: Callable[[], int], debug: bool) -> NoReturn:
    """Run a command; every way it can end has its exit code and one line."""
    try:
        raise typer.Exit(work())
    except InputError as err:
        _say(str(err))
        code = WRONG
    except (KeyboardInterrupt, Cancelled):
        _say("stopped: nothing was written")
        code = STOPPED
    except (typer.Exit, BrokenPipeError):
        raise
    except Exception as err:
        if debug:
            traceback.print_exc()
        _say(
            f"a fault of chipload: {type(err).__name__}: {err}. Please report it with the job file and the output of "
            "the same command with --debug"
        )
        code = FAULT
    raise typer.Exit(code)


def _say(text: str) -> None:
    typer.echo(f"chipload: {' '.join(text.split())}", err=True)


@contextmanager
def _bar() -> Iterator[Callable[[float, str], None]]:
    """A progress bar on stderr where that is a terminal, else nothing."""
    if not sys.stderr.isatty() or os.environ.get("TERM") == "dumb":
        yield lambda done, what: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=1.0)

        def show(done: float, what: str) -> None:
            bars.update(task, completed=done, description=what)

        yield show
