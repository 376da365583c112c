"""The command ``chipload tap``, which fits modes to hammer tests."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.number_text import number_text
from chipload.terminal import run_guarded, show


@app.command()
def tap(
    files: Annotated[
        list[Path], typer.Argument(metavar="FRF...", help="receptances (CSV, .frf, .uff), one for each direction")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="the modes (TOML), for [dynamics] file")],
    direction: Annotated[
        list[str] | None,
        typer.Option("--direction", help="x or y of the machine, one for each file in order; repeatable"),
    ] = None,
    unit: Annotated[
        str | None, typer.Option("--unit", help="m/N, mm/N, um/N, m/s/N or m/s2/N, if the file does not state it")
    ] = None,
    tool: Annotated[int | None, typer.Option("--tool", min=0, help="tool number; default: every tool")] = None,
    from_hz: Annotated[float | None, typer.Option("--from-hz", min=0.0, help="lowest frequency of the fit")] = None,
    to_hz: Annotated[float | None, typer.Option("--to-hz", min=0.0, help="highest frequency of the fit")] = None,
    debug: Debug = False,
) -> None:
    """Fit modes to hammer tests at the tip of a tool. A poor fit is refused."""

    def work() -> int:
        from chipload.files import write_whole
        from chipload.jobs.program.tap import modes_text
        from chipload.jobs.program.tap import tap as tapped

        found = tapped(files, direction or (), unit, (from_hz, to_hz))
        write_whole(out, modes_text(found, tool).encode("utf-8"))
        for one in found:
            for f, z, k in zip(one.fit.frequency, one.fit.damping, one.fit.stiffness, strict=True):
                show(f"{one.name} {one.direction}: {f:.5g} Hz, damping {z:.3g}, {number_text(1e-3 * k)} N/um")
            show(f"{one.name} {one.direction}: the fit leaves {number_text(100.0 * one.fit.left, 2)} % of the peak")
        show(f'written: {out}; name it in the job: [dynamics] file = "{out.name}"')
        return 0

    run_guarded(work, debug)
