"""The result of a program that was read, simulated, or given new spindle speeds."""

from __future__ import annotations

from collections import Counter

from chipload.checking.outcome import ProgramResult
from chipload.checking.result import (
    changed_name,
    changed_tracks,
    checked_result,
    program_result,
)
from chipload.jobs.program.numbers import speed_numbers
from chipload.jobs.program.outcome import SetupsProgram, SpeedsProgram
from chipload.jobs.program.setups_result import result_of_setups
from chipload.number_text import number_text
from chipload.result import Result, Track


def result_of(program: ProgramResult) -> Result:
    """Return the result of a program."""
    if isinstance(program, SetupsProgram):
        return result_of_setups(program)
    simulation = program.simulated
    if isinstance(program, SpeedsProgram) and simulation is not None and simulation.stability is not None:
        own = program.speeds
        time_s, name = float(program.seconds.sum()), changed_name(program, "speeds")
        numbers = {"speeds": speed_numbers(own, simulation.stability, simulation, time_s, name)}
        tracks: tuple[Track, ...] = changed_tracks(
            program, simulation, own, name, "gouge_mm", "excess_mm", "form_error_um", stability=own.stability
        )
        count = Counter(t.tool for t in own.tools)
        tools = "; ".join(
            f"tool {t.tool} {f'in lines {t.lines[0]} to {t.lines[1]} ' if count[t.tool] > 1 else ''}{t.rpm:g} rpm"
            for t in own.tools
        )
        note = f"The program takes {number_text(time_s)} s instead of {number_text(own.seconds_before)} s; {tools}."
        return program_result("program", program, tracks, numbers, note)
    return checked_result(program)
