"""The command ``chipload filter``, which LinuxCNC runs on a program before it loads the program."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from chipload.cli.app import Debug, MachineName, Tools, app
from chipload.errors import InputError, Severity
from chipload.terminal import EXCEEDED, plain, run_guarded, write_bytes

#: variables of the environment: the file of the machine that LinuxCNC runs, and whether its screen shows progress
INI, BAR = "INI_FILE_NAME", "AXIS_PROGRESS_BAR"


@app.command("filter")
def filter_program(
    file: Annotated[Path, typer.Argument(metavar="PROGRAM", help="NC program for LinuxCNC")],
    machine: MachineName = None,
    tools: Tools = None,
    allow_unproven: Annotated[
        bool, typer.Option("--allow-unproven", help="also load a program that could not be checked completely")
    ] = False,
    debug: Debug = False,
) -> None:
    """Check a program before LinuxCNC loads it: write it to stdout, or write nothing and end with exit code 3.

    Name this command in [FILTER] of the machine's .ini. It writes findings to stderr, which the screen shows. The
    default machine is the one that LinuxCNC runs. If the folder holds a job of the same name, such as
    part.toml for part.ngc, the command runs it too: the program is not loaded if a limit of the job does not hold,
    and the report is in part-checked.
    """

    def work() -> int:
        from chipload.files import read_regular
        from chipload.program.gcode.reader import LARGEST_FILE

        data = read_regular(file, file.name, LARGEST_FILE)
        name = machine or os.environ.get(INI)
        if not name:
            raise InputError(f"--machine: missing: name the .ini of the machine, or run LinuxCNC, which sets {INI}")
        states = [_read(file, name, tools)]
        if file.with_suffix(".toml").is_file():
            states.append(_run(file))
        if read_regular(file, file.name, LARGEST_FILE) != data:
            raise InputError(f"{file.name}: changed during the check: load it again")
        worst = max(states)
        if worst is Severity.EXCEEDS or (worst is Severity.UNPROVEN and not allow_unproven):
            open_ = "; add `--allow-unproven` in the .ini to load it" if worst is Severity.UNPROVEN else ""
            _print_error(f"{file.name} is not loaded: {_WHY[worst]}{open_}")
            return EXCEEDED
        _progress(1.0, "checked")
        write_bytes(data)
        return 0

    run_guarded(work, debug)


_WHY = {Severity.EXCEEDS: "a limit is exceeded", Severity.UNPROVEN: "something could not be checked"}


def _read(file: Path, name: str, tools: Path | None) -> Severity:
    """Read the program for its machine with the work offsets that LinuxCNC saved, and write the findings.

    Leaving the travel of a machine without rotary axes is reported but does not block the program: it depends on the
    work offset, which may have changed since LinuxCNC saved it, and the screen warns before the cycle starts.
    """
    from chipload.cli.inputs import machine_of
    from chipload.cli.program_check import TOLERANCE_MM, finding_lines
    from chipload.errors import worst_severity
    from chipload.machine.saved_offsets import saved_offsets
    from chipload.program.read import read_program, read_tools
    from chipload.program.setup import Setup

    on = machine_of(name, _print_error)
    offsets = saved_offsets(Path(name)) if name.lower().endswith(".ini") else {}
    reading = read_program(
        file, on, dialect="linuxcnc", tools=read_tools(tools) if tools is not None else None, tolerance=TOLERANCE_MM,
        setup=Setup(work_offsets=offsets), progress=_progress,
    )  # fmt: skip
    for line in (*finding_lines(reading), *(f"not checked: {item}" for item in reading.unchecked)):
        _print_error(line)
    placed = bool(on.chain.rotary)
    if any(placed or f.code != "machine-limit" for f in reading.violations):
        return Severity.EXCEEDS
    return worst_severity(reading.findings)


def _run(file: Path) -> Severity:
    """Run the job of the same name, write its result and its verdict."""
    from chipload.files import is_file
    from chipload.jobs import load_job, run_job
    from chipload.report.folder import check_target, write_finished
    from chipload.result import Verdict

    path, out = file.with_suffix(".toml"), file.with_name(f"{file.stem}-checked")
    loaded = load_job(path)
    named = getattr(loaded.job, "program_file", None)
    if named is None or not is_file(Path(named)) or not Path(named).samefile(file):
        raise InputError(
            f"{path.name}: is not a job of {file.name}: name the program in [program] file, or rename the job"
        )
    check_target(out)
    done = run_job(loaded, _progress)
    target = write_finished(done.result, done.presentation, out)
    _print_error(f"{done.result.message} Report: {target / 'report.html'}")
    states = {Verdict.HOLDS: Severity.NOTE, Verdict.UNPROVEN: Severity.UNPROVEN, Verdict.EXCEEDS: Severity.EXCEEDS}
    return states[done.result.verdict]


def _print_error(text: str) -> None:
    """A line on stderr."""
    print(plain(" ".join(text.split())), file=sys.stderr, flush=True)


def _progress(done: float, what: str) -> None:
    """The progress bar of the screen."""
    if os.environ.get(BAR):
        print(f"FILTER_PROGRESS={round(100.0 * min(max(done, 0.0), 1.0))}", file=sys.stderr, flush=True)
