"""The command ``chipload opcua``, which records a log of a spindle from an OPC UA server."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, app
from chipload.errors import InputError
from chipload.terminal import bar, run_guarded, show


@app.command()
def opcua(
    address: Annotated[str, typer.Argument(metavar="ADDRESS", help="of the server, e.g. opc.tcp://192.168.1.10:4840")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help=".csv: a log of the spindle")],
    nodes: Annotated[
        list[str],
        typer.Option(
            "--node",
            metavar="COLUMN=ID",
            help="node of a column, e.g. 'power_w=ns=2;s=Spindle.Power'; columns: speed_rpm, current_a, power_w, "
            "torque_nm, feed_mm_min, line, override; repeatable",
        ),
    ],
    duration_s: Annotated[float, typer.Option("--duration-s", help="length of the log; Ctrl-C ends it early")] = 60.0,
    interval_s: Annotated[float, typer.Option("--interval-s", help="time between two samples of the server")] = 0.05,
    user: Annotated[
        str | None, typer.Option("--user", help="its password is in the variable CHIPLOAD_OPCUA_PASSWORD")
    ] = None,
    security: Annotated[
        str | None,
        typer.Option("--security", metavar="POLICY,MODE,CERTIFICATE,KEY", help="default: no encryption"),
    ] = None,
    debug: Debug = False,
) -> None:
    """Record a log of the spindle from an OPC UA server, for `chipload spindle` and `chipload learn`.

    Needs chipload[opcua]. Nothing is written to the server.
    """

    def work() -> int:
        from chipload.files import write_whole
        from chipload.lazy import require_extra
        from chipload.machine.opcua import OpcUaSource, record_spindle

        require_extra("opcua")
        # what the library notices of the server is no message of this command
        logging.getLogger("asyncua").addHandler(logging.NullHandler())
        if out.suffix.lower() != ".csv":
            raise InputError(f"--out {out}: must end with .csv (a log of the spindle)")
        named = dict(text.partition("=")[::2] for text in nodes)
        if len(named) < len(nodes) or not all(named.values()):
            raise InputError(f"--node {', '.join(nodes)}: each must have the form COLUMN=ID, and a column stands once")
        source = OpcUaSource(address, named, interval_s, user, security)
        with bar() as progress:
            text, findings = record_spindle(source, duration_s, progress)
        write_whole(out, text.encode("ascii"))
        for f in findings:
            show(f.text)
        show(f"{text.count(chr(10)) - 1} rows: {text.splitlines()[0]}")
        return 0

    run_guarded(work, debug)
