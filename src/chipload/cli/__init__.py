"""The command line. Each command parses its options, calls one function and shows the result.

Exit codes of every command: 0 done, every limit holds; 2 the input is wrong (one line for each error, nothing is
written); 3 done, but a limit is exceeded or unproven; 4 the result cannot be written, finished work is kept; 1 an error
in chipload; 130 stopped by Ctrl-C. Heavy libraries are imported inside the commands so that `--help` is fast.
"""

from __future__ import annotations

import io
import signal
import sys
from collections.abc import Sequence
from copy import copy
from typing import NoReturn

from typer import Typer
from typer.models import CommandInfo

# each of these modules adds its commands to the application
from chipload.cli import chatter as chatter
from chipload.cli import drafts, jobs, mcp, mtconnect, program_filter, programs, results, shipped, sweep, tap, torque  # noqa: F401
from chipload.cli import learn as learn
from chipload.cli import learn_wall as learn_wall
from chipload.cli import next_measurement as next_measurement
from chipload.cli import opcua as opcua
from chipload.cli import watch as watch
from chipload.cli import watch_folder as watch_folder
from chipload.cli.app import app
from chipload.terminal import STOPPED

__all__ = ["app", "main"]

#: the commands in the order of the help
ORDER = (
    "init", "run", "simulate", "check", "watch-folder", "sweep", "convert", "filter", "fit", "spindle", "learn",
    "learn-wall", "next-measurement", "watch", "mtconnect", "opcua", "tap", "chatter", "cuts", "demo", "example",
    "examples", "machines", "materials", "cutters", "view", "mcp", "export", "hal",
)  # fmt: skip


def _name_of(command: CommandInfo) -> str:
    """Return the word that a command is called by."""
    return str(command.name or getattr(command.callback, "__name__", ""))


app.registered_commands.sort(key=lambda c: ORDER.index(_name_of(c)))


def main() -> NoReturn:
    """Run the command ``chipload``."""
    try:
        for name in ("SIGTERM", "SIGHUP", "SIGBREAK"):
            # under nohup a terminal that closes is ignored
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, _stop)
        _escape_foreign_characters()
        _application(sys.argv[1:])()
    except KeyboardInterrupt:
        # before the command began or after it ended
        sys.exit(STOPPED)
    sys.exit(0)


def _application(words: Sequence[str]) -> Typer:
    """Return the application without commands that are not named: their options take longer to read than a check of
    some jobs.
    """
    named = [c for c in app.registered_commands if words and words[0] == _name_of(c)]
    if not named:
        return app
    own = copy(app)
    # one command alone would have no name
    own.registered_commands = [*named, next(c for c in app.registered_commands if c is not named[0])]
    return own


def _escape_foreign_characters() -> None:
    r"""Print a character that the console or the pipe cannot encode, as most on Windows, as its escape, ``\u90e8``."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


def _stop(_number: int, _frame: object) -> NoReturn:
    """Treat SIGTERM, SIGHUP and Ctrl-Break (Windows) as Ctrl-C."""
    raise KeyboardInterrupt
