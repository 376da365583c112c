"""The report of a simulated program."""

from __future__ import annotations

from chipload.checking.figures import program_presentation
from chipload.checking.outcome import ProgramResult
from chipload.checking.result import changed_name
from chipload.jobs.program.outcome import SpeedsProgram
from chipload.jobs.program.result import result_of
from chipload.report.presentation import Presentation


def presentation_of(program: ProgramResult) -> Presentation:
    """The presentation of a program's result."""
    changed = {changed_name(program, "speeds"): program.speeds} if isinstance(program, SpeedsProgram) else {}
    return program_presentation(program, result_of(program), changed)
