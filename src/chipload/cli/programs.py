"""The commands ``chipload check`` and ``chipload convert``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import (
    CompensationKind,
    ControlName,
    Debug,
    DialectName,
    FeedIfUnsaid,
    MachineName,
    ParameterValues,
    Sets,
    ToleranceMm,
    Tools,
    ToolsUnit,
    UnitName,
    WorkOffsets,
    app,
)
from chipload.cli.inputs import feed_of, machine_of, setup_of
from chipload.cli.program_check import TOLERANCE_MM, check_program
from chipload.errors import InputError, Severity, group_findings, worst_severity
from chipload.terminal import EXCEEDED, bar, run_guarded, show

#: findings of a machine that do not affect the exit code
HARMLESS = ("machine-singular", "machine-rewind", "machine-offset")


@app.command()
def check(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="a job, any file that a job names, or a folder"),
    ],
    machine: MachineName = None,
    tools: Tools = None,
    dialect: DialectName = None,
    feed_mm_min: FeedIfUnsaid = None,
    tolerance_mm: ToleranceMm = TOLERANCE_MM,
    parameters: ParameterValues = None,
    work_offsets: WorkOffsets = None,
    control: ControlName = None,
    unit: UnitName = None,
    tools_unit: ToolsUnit = None,
    compensation: CompensationKind = None,
    sets: Sets = None,
    debug: Debug = False,
) -> None:
    """Read a job, or any file that a job can name, and list all errors. Nothing is simulated or written.

    FILE is one of these: a job, read with all files that it names; a program, read as its controller reads it (the
    default machine is vmc, or one with the rotary axes that the program needs); a fit; a STEP file, whose faces are
    listed; a drawing, mesh, machine, spindle, material, tool table or modes; or a folder, whose TOML files are listed
    each: the machines, tools, materials and jobs of a cell.
    """

    def work() -> int:
        from chipload.jobs.inspection import BY_ENDING, inspect_file, inspect_folder

        if file.is_dir():
            if sets:
                raise InputError("--set: applies to a job: leave it out for a folder")
            lines, holds = inspect_folder(file)
            for text in lines:
                show(text)
            return 0 if holds else EXCEEDED
        job = file.suffix.lower() == ".toml"
        if sets and not job:
            raise InputError("--set: applies to a job: leave it out for other files")
        if not job and file.suffix.lower() not in BY_ENDING:
            setup = setup_of(parameters or (), work_offsets or (), control, unit, tools_unit, compensation)
            return check_program(file, machine, tools, dialect, feed_mm_min, tolerance_mm, setup)
        for option, value in (
            ("machine", machine),
            ("tools", tools),
            ("dialect", dialect),
            ("feed-mm-min", feed_mm_min),
            ("parameter", parameters or None),
            ("work-offset", work_offsets or None),
            ("control", control),
            ("unit", unit),
            ("tools-unit", tools_unit),
            ("compensation", compensation),
        ):
            if value is not None:
                raise InputError(f"--{option}: applies to a program: in a job, state it in the job file")
        found = inspect_file(file, sets or ())
        lines, holds = found if found is not None else ([], True)
        for text in lines:
            show(text)
        return 0 if holds else EXCEEDED

    run_guarded(work, debug)


@app.command()
def convert(
    source: Annotated[Path, typer.Argument(metavar="PROGRAM", help="NC program or CL data")],
    target: Annotated[
        Path, typer.Argument(metavar="FILE", help="the new file; its extension sets the format: .ngc, .nc, .apt")
    ],
    machine: MachineName = None,
    from_machine: Annotated[
        str | None, typer.Option("--from", metavar="MACHINE", help="machine of the source; default: --machine")
    ] = None,
    tools: Tools = None,
    dialect: DialectName = None,
    feed_mm_min: FeedIfUnsaid = None,
    tolerance_mm: ToleranceMm = TOLERANCE_MM,
    tcp: Annotated[bool, typer.Option("--tcp", help="write positions of the tip (TCP) while rotary axes move")] = False,
    debug: Debug = False,
) -> None:
    """Convert a program for another machine, or to CL data. The new program is not verified."""

    def work() -> int:
        from chipload.files import write_whole
        from chipload.program.convert import convert_program
        from chipload.program.read import read_program, read_tools

        there = machine_of(machine)
        here = machine_of(from_machine) if from_machine is not None else there
        table = read_tools(tools) if tools is not None else None
        lengths = table.lengths() if table is not None else {}
        with bar() as progress:
            reading = read_program(
                source, here, dialect=dialect, tools=table, feed=feed_of(feed_mm_min), tolerance=tolerance_mm,
                progress=progress,
            )  # fmt: skip
            text, findings = convert_program(
                reading.program, reading.findings, there, target.suffix, title=source.name,
                tool_lengths=lengths, tcp=tcp, tolerance=tolerance_mm,
            )  # fmt: skip
            write_whole(target, text.encode("ascii"))
        for _, found in group_findings((*reading.findings, *findings)):
            show(found)
        show(f"written: {target}: {len(text.splitlines())} lines for machine {there.name}, not verified")
        exceeded = any(f.code.startswith("machine-") and f.code not in HARMLESS for f in findings)
        return EXCEEDED if exceeded or worst_severity(reading.findings) >= Severity.UNPROVEN else 0

    run_guarded(work, debug)
