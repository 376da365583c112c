"""The command hal: the torque held on a LinuxCNC that runs."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.terminal import EXCEEDED, guarded, show


@app.command()
def hal(
    file: Annotated[Path, typer.Argument(metavar="HAL", help="the controller (TOML): path, override, spindle")],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="what happened, step by step (CSV)")] = None,
    name: Annotated[str, typer.Option("--name", help="of the component; its pins and signals begin so")] = "chipload",
    python: Annotated[
        str, typer.Option("--python", help="the interpreter that LinuxCNC's modules belong to")
    ] = "/usr/bin/python3",
    debug: Debug = False,
) -> None:
    """Hold the torque on a LinuxCNC that runs: a component in HAL that sends the override; Ctrl-C ends it."""

    def work() -> int:
        from chipload.control.hal import control, load_hal, table_of
        from chipload.control.linuxcnc.hal_client import HalPins
        from chipload.files import write_whole

        job = load_hal(file)
        asked: list[int] = []
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda n, _: asked.append(n))
        with HalPins(name, python) as pins:
            record = control(
                job,
                pins,
                stop=lambda: bool(asked),
                notice=lambda reason, s: typer.echo(
                    f"stopped the machine: {reason} at {s:.4g} mm: it stays stopped until this command ends", err=True
                ),
            )
        if out is not None:
            write_whole(out, table_of(record).encode("ascii"))
        show(
            f"{len(record.rows)} steps, ended: {record.ended}; greatest torque {1e-3 * record.torque_max:.4g} N m, "
            f"limit held {1e-3 * job.override.torque_ref:.4g} N m"
        )
        return 0 if record.ended == "path" else EXCEEDED

    guarded(work, debug)
