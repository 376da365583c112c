"""The report of a simulated program."""

from __future__ import annotations

from chipload.jobs.program.outcome import SpeedsProgram
from chipload.jobs.program.result import result_of
from chipload.jobs.simulation.figures import program_presentation
from chipload.jobs.simulation.outcome import ProgramResult
from chipload.jobs.simulation.result import changed_name
from chipload.report.presentation import Presentation


def presentation_of(program: ProgramResult) -> Presentation:
    """The presentation of a program's result."""
    changed = {changed_name(program, "speeds"): program.speeds} if isinstance(program, SpeedsProgram) else {}
    return program_presentation(program, result_of(program), changed)
