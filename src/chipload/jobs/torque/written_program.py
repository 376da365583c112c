"""The program of a torque job as it is written: its text is read back, and what was read is simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.checking.preparation import with_tool
from chipload.errors import Finding, InputError, Severity
from chipload.jobs.torque.cut import program_of, read_file
from chipload.jobs.torque.job import TorqueJob
from chipload.machine.machine import Machine
from chipload.program.control import control_named
from chipload.program.gcode.writer import write_commands
from chipload.program.program import RAPID, Program
from chipload.program.read import times_of, times_on
from chipload.program.read_back import no_end, read_back, reading_findings, rows_of_source, unread
from chipload.program.release import NOT_SIMULATED, Release
from chipload.program.to_axes import to_axes
from chipload.report.programs import ENDINGS
from chipload.result.provenance import title_of

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WrittenProgram:
    """The program that takes the override, as its text is read back.

    Parameters
    ----------
    planned : what the text was written from
    text : as it was read
    program : what was read; the lines are those of the file that the job names, or else of the text
    times : (n,) float [s], of its rows on the machine
    whole : with the rows before each axis was sent somewhere; None: the text cannot be read, ``program`` is the plan
    findings : of the text, each of which keeps it from being released
    stops, retractions : lines, as :class:`chipload.simulation.program_findings.ProgramSurroundings`
    """

    planned: Program
    text: str
    program: Program
    times: Floats
    whole: Program | None
    findings: tuple[Finding, ...] = ()
    stops: Sequence[int] = ()
    retractions: Sequence[int] = ()

    @property
    def controlled(self) -> slice:
        """Rows from the first feed to the last, of which a controller sets the override."""
        feeds = np.flatnonzero(self.program.motion != RAPID)
        return slice(int(feeds[0]), int(feeds[-1]) + 1)

    @property
    def approach(self) -> float:
        """Time of the rapids before the first feed [s]."""
        return float(self.times[: self.controlled.start].sum())

    @property
    def retract(self) -> float:
        """Time of the rapids behind the last feed [s]."""
        return float(self.times[self.controlled.stop :].sum())


def written_program(job: TorqueJob, machine: Machine) -> WrittenProgram:
    """Write the program of a job, and read its text back.

    Raises
    ------
    InputError
        As :func:`chipload.jobs.torque.cut.program_of`.
    """
    planned = program_of(job, machine)
    text = override_text(title_of(job.path), planned, machine, NOT_SIMULATED)
    try:
        reading = read_back(text, override_file(machine), machine, job.cutters)
    except InputError as err:
        return _plan(planned, text, machine, (unread(err),))
    findings = (*reading_findings(reading, job.cutters, planned), *no_end(text))
    whole, times = reading.program, times_of(reading, machine)
    stops, retractions = reading.stops, reading.retractions
    if job.program_file is not None:
        file = read_file(job, job.program_file, machine)
        whole = replace(whole, line=planned.line[rows_of_source(planned, reading)])
        stops, retractions = file.stops, file.retractions
    program = with_tool(whole, job.cutters)
    first = len(whole) - len(program)
    # the row at which the program begins comes from an unknown place
    times = np.concatenate([[times[: first + 1].sum()], times[first + 1 :]])
    if any(f.severity is Severity.EXCEEDS for f in findings) and not _can_be_run(program, planned):
        return _plan(planned, text, machine, findings)
    return WrittenProgram(planned, text, program, times, whole, findings, stops, retractions)


def _plan(planned: Program, text: str, machine: Machine, findings: tuple[Finding, ...]) -> WrittenProgram:
    """The plan in place of a text that cannot be simulated."""
    return WrittenProgram(planned, text, planned, times_on(planned, machine), None, findings)


def _can_be_run(program: Program, planned: Program) -> bool:
    """Whether a text has the tools, the spindle and the axis of the plan."""
    return (
        set(program.tool.tolist()) <= set(planned.tool.tolist())
        and set(program.spindle.round(3).tolist()) <= {0.0, *planned.spindle.round(3).tolist()}
        and bool(np.abs(program.axis - (0.0, 0.0, 1.0)).max() <= 1e-9)
    )


def override_file(machine: Machine) -> str:
    """Name of the file of the program that takes the override."""
    return f"0-override.{ENDINGS[machine.dialect]}"


def override_text(title: str, program: Program, machine: Machine, release: Release) -> str:
    """The text of the program with the programmed feeds; its lines do not depend on ``release``."""
    commands, _ = to_axes(program, machine)
    on = control_named(machine.dialect).lines.override_on
    takes = [(0, on)] if on else []
    title = f"{title}, programmed feeds, to be run with chipload hal"
    return write_commands(commands, machine, title=title, release=release, words=takes)
