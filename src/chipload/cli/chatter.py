"""The command ``chipload chatter``: detect chatter in a stream of samples and command the spindle override."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.terminal import run_guarded


@app.command()
def chatter(
    summary: Annotated[Path, typer.Argument(metavar="SUMMARY", help="summary.json of the simulated program")],
    rate_hz: Annotated[float, typer.Option("--rate-hz", help="samples per second")],
    floor: Annotated[
        float, typer.Option("--floor", help="least amplitude of chatter, in units of the signal; measure it in air")
    ],
    rpm: Annotated[
        float | None, typer.Option("--rpm", help="programmed speed; default: that of the step with the least margin")
    ] = None,
    share: Annotated[
        float, typer.Option("--share", help="least share of the alternating power that counts as chatter")
    ] = 0.2,
    window_s: Annotated[float, typer.Option("--window-s", help="length of a window of samples")] = 0.25,
    least: Annotated[float, typer.Option("--least-override", help="least spindle override")] = 0.5,
    most: Annotated[float, typer.Option("--most-override", help="greatest spindle override")] = 1.2,
    halui: Annotated[bool, typer.Option("--halui", help="write commands for halcmd instead of sentences")] = False,
    debug: Debug = False,
) -> None:
    """Detect chatter in samples of torque and speed, and choose a quiet speed from the simulation.

    Each line of the input holds a sample of the torque or the current, and the speed in revolutions per second, as
    halsampler writes them. With --halui the output is input for halcmd:
    halsampler | chipload chatter ... --halui | halcmd -kf
    """

    def work() -> int:
        from chipload.control.chatter import ChatterAnswer, ListeningRules
        from chipload.control.chatter_stream import answers, quiet_speeds_of

        rules = ListeningRules(rate_hz, floor, share, window_s, least=least, most=most)
        programmed, windows = quiet_speeds_of(summary, rpm)
        stopped = False
        for kind, text in answers(sys.stdin, rules, programmed, windows, halui):
            typer.echo(text)
            sys.stdout.flush()
            stopped = kind is ChatterAnswer.STOP
        return 3 if stopped else 0

    run_guarded(work, debug)
