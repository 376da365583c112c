"""The command ``chipload mtconnect``, which reads an MTConnect agent."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.errors import InputError
from chipload.terminal import run_guarded, show


@app.command()
def mtconnect(
    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help="address of an agent, e.g. http://127.0.0.1:5000, or an XML file")
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help=".toml: a machine file; .csv: a log of the spindle")
    ],
    device: Annotated[str | None, typer.Option("--device", help="name of the device, if there are several")] = None,
    component: Annotated[
        str | None, typer.Option("--component", help="name of the spindle, if several components rotate")
    ] = None,
    debug: Debug = False,
) -> None:
    """Read a machine's limits, or a log of its spindle, from an MTConnect agent.

    The machine file holds the values that the agent states, and a comment to fill in for each value that it does not
    state. The log is input for `chipload spindle`.
    """

    def work() -> int:
        from chipload.files import write_whole
        from chipload.machine.mtconnect import describe_device, document, machine_text, samples

        ending = out.suffix.lower()
        if ending == ".toml":
            if component is not None:
                raise InputError("--component: applies to a log: leave it out, or use --out spindle.csv")
            found = describe_device(document(source, "probe"), device)
            write_whole(out, machine_text(found).encode("utf-8"))
            show(f"{found.name}: axes {', '.join(sorted(found.travel)) or 'none'}; fill in the comments of {out}")
        elif ending == ".csv":
            text, findings = samples(source, device, component)
            write_whole(out, text.encode("ascii"))
            for f in findings:
                show(f.text)
            show(f"{text.count(chr(10)) - 1} rows: {text.splitlines()[0]}")
        else:
            raise InputError(f"--out {out}: must end with .toml (the machine) or .csv (a log of its spindle)")
        return 0

    run_guarded(work, debug)
