"""The result of a program that was read, simulated, or given new spindle speeds."""

from __future__ import annotations

from collections import Counter
from typing import Any

from chipload.checking.limits import program_limits
from chipload.checking.outcome import ProgramResult
from chipload.checking.result import (
    APT,
    changed_name,
    changed_tracks,
    exceeding,
    findings_of,
    misplaced,
    program_result,
)
from chipload.checking.rows import motion_rows, step_rows
from chipload.errors import Finding, Severity
from chipload.jobs.program.numbers import speed_numbers
from chipload.jobs.program.outcome import SpeedsProgram
from chipload.result import Result, Track, TrackKind, in_memory

#: name of the track of a program that stays as it is
PROGRAM = "program"


def result_of(program: ProgramResult) -> Result:
    """Return the result of a program."""
    numbers: dict[str, Any] = {}
    simulation = program.simulated
    if isinstance(program, SpeedsProgram) and simulation is not None and simulation.stability is not None:
        own = program.speeds
        time_s, name = float(program.seconds.sum()), changed_name(program, "speeds")
        numbers["speeds"] = speed_numbers(own, simulation.stability, simulation, time_s, name)
        tracks: tuple[Track, ...] = changed_tracks(
            program, simulation, own, name, "gouge_mm", "excess_mm", "form_error_um", stability=own.stability
        )
        count = Counter(t.tool for t in own.tools)
        tools = "; ".join(
            f"tool {t.tool} {f'in lines {t.lines[0]} to {t.lines[1]} ' if count[t.tool] > 1 else ''}{t.rpm:g} rpm"
            for t in own.tools
        )
        note = f"The program takes {time_s:.4g} s instead of {own.seconds_before:.4g} s; {tools}."
        return program_result("program", program, tracks, numbers, note)
    return program_result("program", program, (_track(program),), numbers)


def _track(program: ProgramResult) -> Track:
    """Return the track of the unchanged program."""
    time_s, simulation = float(program.seconds.sum()), program.simulated
    if simulation is None:
        unproven = Finding("not-simulated", 0, "the program was not simulated in its stock", Severity.UNPROVEN)
        findings = (*(exceeding(f) for f in program.reading.violations), unproven)
        blocks = in_memory(motion_rows(program))
        return Track(PROGRAM, TrackKind.PROGRAM, True, time_s, (), findings, (APT,), blocks=blocks)
    limits = program_limits(simulation, simulation.removal.columns, PROGRAM)
    found = (*misplaced(simulation, limits), *findings_of(program, simulation))
    return Track(
        PROGRAM, TrackKind.PROGRAM, True, time_s, limits, found, (APT,),
        energy_balance=simulation.removal.energy_balance, blocks=lambda: step_rows(simulation),
    )  # fmt: skip
