"""The Typer application, and the options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.completion import control_completions, machine_completions
from chipload.terminal import show

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Simulate, check and plan CNC milling of parts that are hard to mill.",
    epilog="Exit codes: 0 every limit holds; 1 an error in chipload; 2 wrong input, nothing is written; 3 a limit is "
    "exceeded or unproven; 4 the result cannot be written, finished work is kept; 130 stopped.",
)

JobFile = Annotated[
    Path, typer.Argument(metavar="JOB", help="the job file (TOML), or with run a folder of numbered jobs")
]
Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY.PATH=VALUE",
        help="override a key of the job, e.g. cutter.0.diameter_mm=12; repeatable; paths are relative to the job file",
    ),
]
MachineName = Annotated[
    str | None,
    typer.Option(
        "--machine",
        metavar="MACHINE",
        help="a shipped machine, or a file (.toml, LinuxCNC .ini)",
        autocompletion=machine_completions,
    ),
]
Tools = Annotated[
    Path | None,
    typer.Option(
        "--tools",
        metavar="FILE",
        help="LinuxCNC tool table (.tbl); init also takes a tool library of Fusion (.json, .tools)",
    ),
]
DialectName = Annotated[
    str | None,
    typer.Option("--dialect", help="linuxcnc, fanuc, sinumerik, heidenhain or apt; default: by the file extension"),
]
ControlName = Annotated[
    str | None,
    typer.Option(
        "--control",
        help="control of the program, e.g. haas or fanuc; default: by what the program shows",
        autocompletion=control_completions,
    ),
]
UnitName = Annotated[
    str | None, typer.Option("--unit", help="mm or inch: lengths before the program states a unit (G20, G21)")
]
ToolsUnit = Annotated[str | None, typer.Option("--tools-unit", help="mm or inch: unit of the tool table")]
CompensationKind = Annotated[
    str | None,
    typer.Option("--compensation", help="control, wear or off: what the offsets for G41 and G42 hold"),
]
FeedIfUnsaid = Annotated[float | None, typer.Option("--feed-mm-min", help="feed of cuts before the program states one")]
ParameterValues = Annotated[
    list[str] | None,
    typer.Option(
        "--parameter", metavar="NAME=VALUE", help="a variable of the controller, e.g. Q10=5 or '#100=2'; repeatable"
    ),
]
WorkOffsets = Annotated[
    list[str] | None,
    typer.Option(
        "--work-offset",
        metavar="CODE=X,Y,Z",
        help="origin of a work offset in machine coordinates, e.g. G55=80,0,0; repeatable",
    ),
]
ToleranceMm = Annotated[
    float,
    typer.Option("--tolerance-mm", help="greatest deviation of the tip where a move with rotary axes is divided"),
]
Accept = Annotated[
    bool, typer.Option("--accept", help="run with the guesses of a draft; what rests on them is unproven")
]
Debug = Annotated[bool, typer.Option("--debug", help="show the traceback of an error in chipload")]


@app.callback(invoke_without_command=True)
def top(version: Annotated[bool, typer.Option("--version", help="show the version and exit")] = False) -> None:
    """Simulate, check and plan CNC milling of parts that are hard to mill."""
    if version:
        from importlib.metadata import version as installed

        show(f"chipload {installed('chipload')}")
        raise typer.Exit
