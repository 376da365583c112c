"""How a command ends and what it shows meanwhile: an exit code, one line where it fails, a bar while it runs."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NoReturn

import typer

from chipload.errors import Cancelled, InputError

FAULT, WRONG, EXCEEDED, STOPPED = 1, 2, 3, 130


def guarded(work: Callable[[], int], debug: bool) -> NoReturn:
    """Run a command; every way it can end has its exit code and one line."""
    try:
        raise typer.Exit(work())
    except InputError as err:
        say(str(err))
        code = WRONG
    except (KeyboardInterrupt, Cancelled) as err:
        say(f"stopped: {str(err) or 'nothing was written'}")
        code = STOPPED
    except (typer.Exit, BrokenPipeError):
        raise
    except Exception as err:
        if debug:
            traceback.print_exc()
        say(
            f"a fault of chipload: {type(err).__name__}: {err}. Please report it with the job file and the output of "
            "the same command with --debug"
        )
        code = FAULT
    raise typer.Exit(code)


def say(text: str) -> None:
    """One line on stderr."""
    typer.echo(f"chipload: {' '.join(text.split())}", err=True)


@contextmanager
def bar() -> Iterator[Callable[[float, str], None]]:
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
