"""Terminal output of a command: exit code, error lines and progress bar."""

from __future__ import annotations

import contextlib
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NoReturn

import typer

from chipload.errors import Cancelled, InputError, InputErrors, OutputError
from chipload.files import cannot_write, is_full

#: interval of progress lines in a log, and duration from which a run counts as long [s]
LOG_S = 60.0
FAULT, WRONG, EXCEEDED, UNWRITTEN, STOPPED = 1, 2, 3, 4, 130


def run_guarded(work: Callable[[], int], debug: bool) -> NoReturn:
    """Run a command and end with its exit code; write one line for each error."""
    try:
        raise typer.Exit(work())
    except InputErrors as err:
        for text in err.args:
            write_line(str(text))
        code = WRONG
    except InputError as err:
        write_line(str(err))
        code = WRONG
    except OutputError as err:
        write_line(str(err))
        code = UNWRITTEN
    except BrokenPipeError:
        _discard_output()
        code = UNWRITTEN
    except OSError as err:
        if is_full(err):
            write_line(str(cannot_write(err.filename or "the disk", err)))
            code = UNWRITTEN
        else:
            _fault(err, debug)
            code = FAULT
    except MemoryError:
        write_line(
            "the memory is used up: state longer steps (step_mm) or fewer workers, or lift the "
            "limit of the process (ulimit -v); the same command continues"
        )
        code = UNWRITTEN
    except (KeyboardInterrupt, Cancelled) as err:
        write_line(f"stopped: {str(err) or 'nothing was written'}")
        code = STOPPED
    except typer.Exit as end:
        code = end.exit_code if _flush_output() else UNWRITTEN
    except Exception as err:
        _fault(err, debug)
        code = FAULT
    raise typer.Exit(code)


def _fault(err: Exception, debug: bool) -> None:
    if debug:
        traceback.print_exc()
    write_line(
        f"an error in chipload: {type(err).__name__}: {err}. Please report it with the job file and the output of "
        "the same command with --debug"
    )


def write_line(text: str) -> None:
    """Write one line to stderr; ignore a closed stderr."""
    with contextlib.suppress(OSError, ValueError):
        typer.echo(f"chipload: {plain(' '.join(text.split()))}", err=True)


@contextmanager
def _stdout_refused() -> Iterator[None]:
    """Raise an OutputError if stdout is full; a closed stdout stays a BrokenPipeError."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as err:
        _discard_output()
        raise cannot_write("stdout", err) from None


def show(text: str) -> None:
    """Write a line to stdout, with control characters shown as codes.

    Raises
    ------
    OutputError
        Stdout is full.
    BrokenPipeError
        Stdout is closed.
    """
    with _stdout_refused():
        typer.echo(plain(text))


def write_bytes(data: bytes) -> None:
    """Write the bytes of a file to stdout.

    Raises
    ------
    OutputError
        Stdout is full.
    BrokenPipeError
        Stdout is closed.
    """
    with _stdout_refused():
        sys.stdout.flush()
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()


def plain(text: str) -> str:
    r"""The text with control characters, and those that change the direction of writing, replaced by their codes.

    >>> plain("M0 (\x1b[2Jgone\x07)\tend")
    'M0 (\\x1b[2Jgone\\x07)\tend'
    """
    return "".join(c if c in "\n\t" or (c.isprintable() and c not in _TURNING) else _code(c) for c in text)


#: characters that change the direction of writing
_TURNING = frozenset("\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def _code(c: str) -> str:
    if c.isspace():
        return " "
    return f"\\x{ord(c):02x}" if ord(c) < 256 else f"\\u{ord(c):04x}"


def _flush_output() -> bool:
    """Whether all output has left the process."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except (OSError, ValueError):
        _discard_output()
        return False
    return True


def _discard_output() -> None:
    """Discard the rest of the output after stdout was closed, so that the interpreter ends without an error."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def log_lines(clock: Callable[[], float], every_s: float = LOG_S) -> Callable[[float, str], None]:
    """A progress function that writes the share of a run that is done and an estimate of the time left.

    Parameters
    ----------
    clock : time now [s]
    every_s : least time between two lines [s]
    """
    start = last = clock()

    def report(done: float, what: str) -> None:
        nonlocal last
        now = clock()
        if now - last < every_s or not 0.0 < done < 1.0:
            return
        last = now
        left = (now - start) * (1.0 - done) / done
        shown = f"{left / 60.0:.0f} min" if left >= 90.0 else f"{left:.0f} s"
        write_line(f"{100.0 * done:.0f} %, about {shown} left: {what}")

    return report


def with_note(
    report: Callable[[float, str], None], note: str, clock: Callable[[], float]
) -> Callable[[float, str], None]:
    """A progress function that also writes a note, once, if a run is long.

    Parameters
    ----------
    note : the text; empty: nothing is written
    clock : time now [s]
    """
    start, written = clock(), not note

    def report_with_note(done: float, what: str) -> None:
        nonlocal written
        if not written and clock() - start >= LOG_S and done < 1.0:
            write_line(note)
            written = True
        report(done, what)

    return report_with_note


@contextmanager
def bar(note: str = "") -> Iterator[Callable[[float, str], None]]:
    """A progress bar on stderr where that is a terminal, else one line a minute, as in the log of a batch job.

    ``note`` is written once, if the run is long.
    """
    with _bar() as report:
        yield with_note(report, note, time.monotonic)


@contextmanager
def _bar() -> Iterator[Callable[[float, str], None]]:
    """The bar, or progress lines in a log."""
    if not sys.stderr.isatty() or os.environ.get("TERM") == "dumb":
        yield log_lines(time.monotonic)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.table import Column

    columns = (
        BarColumn(bar_width=24),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        # what does not fit into the line ends in dots
        TextColumn("{task.description}", markup=False, table_column=Column(ratio=1, no_wrap=True, overflow="ellipsis")),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True, expand=True) as bars:
        task = bars.add_task("", total=1.0)

        def show(done: float, what: str) -> None:
            bars.update(task, completed=done, description=what)

        yield show
