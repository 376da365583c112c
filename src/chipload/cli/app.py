"""The application of the command line and the options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.terminal import show

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Plans and proves CNC milling of the parts that are hard to mill.",
    epilog="Exit codes: 0 every limit holds; 2 wrong input, nothing written; 3 a limit does not hold; 4 the result "
    "cannot be written, kept work stays; 1 our fault.",
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
MachineName = Annotated[
    str | None, typer.Option("--machine", metavar="MACHINE", help="a shipped machine, or a file (.toml, LinuxCNC .ini)")
]
Tools = Annotated[Path | None, typer.Option("--tools", metavar="FILE", help="LinuxCNC tool table (.tbl)")]
DialectName = Annotated[
    str | None,
    typer.Option("--dialect", help="linuxcnc, fanuc, sinumerik, heidenhain or apt; else by the file's ending"),
]
FeedIfUnsaid = Annotated[float | None, typer.Option("--feed-mm-min", help="feed of cuts before the program states one")]
ParameterValues = Annotated[
    list[str] | None,
    typer.Option(
        "--parameter", metavar="NAME=VALUE", help="a value that the controller holds, as Q10=5 or '#100=2'; repeatable"
    ),
]
WorkOffsets = Annotated[
    list[str] | None,
    typer.Option(
        "--work-offset", metavar="CODE=X,Y,Z", help="origin of a work offset in the machine, as G55=80,0,0; repeatable"
    ),
]
ToleranceMm = Annotated[
    float,
    typer.Option("--tolerance-mm", help="how far the tip may leave its path where a move with rotary axes is cut up"),
]
Accept = Annotated[
    bool, typer.Option("--accept", help="take the guesses of a draft as they are; the report lists them")
]
Debug = Annotated[bool, typer.Option("--debug", help="show the traceback of a fault")]


@app.callback(invoke_without_command=True)
def top(version: Annotated[bool, typer.Option("--version", help="show the version and leave")] = False) -> None:
    """Plan and prove CNC milling of the parts that are hard to mill."""
    if version:
        from importlib.metadata import version as installed

        show(f"chipload {installed('chipload')}")
        raise typer.Exit
