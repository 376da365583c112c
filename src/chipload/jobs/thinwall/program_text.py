"""The texts of the programs of a thin wall, and what keeps them from being released.

Each text is read back and compared with its plan; the one that is released is simulated as it was read.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipload.checking.preparation import time_rows
from chipload.errors import Finding, InputError, Severity
from chipload.jobs.thinwall.outcome import USED, ThinWallResult, Variant
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.jobs.thinwall.tries import Tried
from chipload.program.gcode.writer import write_commands
from chipload.program.read import ProgramReading
from chipload.program.read_back import (
    compared_rows,
    no_end,
    read_back,
    reading_findings,
    rows_of_source,
    unread,
)
from chipload.program.release import NOT_SIMULATED, Release
from chipload.report.programs import ENDINGS, program_name


def program_text(walled: ThinWallResult, one: Variant, release: Release) -> str:
    """The text of the program of a variant for the machine; its lines do not depend on ``release``."""
    cutters = walled.planning.cutters
    comments = [
        f"T{c.number}: D {c.diameter:g} mm, corner {c.corner_radius:g} mm, {c.flutes} flutes, overhang "
        f"{c.overhang:g} mm"
        for c in cutters.values()
    ]
    comments += [f"{_frame(walled)}; machine {walled.planning.machine.name}"]
    comments += [
        f"G43 H{c.number} must be the overhang of {c.overhang:g} mm: the rotary axes turn about it"
        for c in cutters.values()
    ]
    return write_commands(
        one.commands, walled.planning.machine, title=program_title(walled, one), release=release, comments=comments,
        number=100 + list(walled.variants).index(one.name),
    )  # fmt: skip


def program_title(walled: ThinWallResult, one: Variant) -> str:
    """The title of the program of a variant."""
    return f"{walled.title}, operation 0, thinwall, {one.name}"


def program_file(walled: ThinWallResult, one: Variant) -> str:
    """The name of the file of the program of a variant."""
    return f"{program_name(0, one.name)}.{ENDINGS[walled.planning.machine.dialect]}"


def with_texts_read_back(walled: ThinWallResult, tried: Tried) -> ThinWallResult:
    """A result whose variants have the findings of their texts, read back with the machine and compared with their
    plans. The text of the variant in use is simulated as it was read: its history and its checks are those of the text.
    The lines of all histories and findings are those of the texts.
    """
    made, texts = dict[str, Variant](), dict[str, str]()
    for name, one in walled.variants.items():
        text = program_text(walled, one, NOT_SIMULATED)
        reading, found = _read(walled, one, text)
        if name == USED and reading is not None and not any(f.severity is Severity.EXCEEDS for f in found):
            one = _simulated_text(walled, one, reading, tried)
        one = with_lines_of_text(one, reading)
        findings = (*one.beyond, *(f for f in found if f not in one.beyond))
        made[name], texts[name] = replace(one, beyond=findings), text
    return replace(walled, variants=made, texts=texts)


def with_lines_of_text(one: Variant, reading: ProgramReading | None) -> Variant:
    """A variant whose lines are those of its text instead of the numbers of its cutter locations; 0: no line of it.

    ``reading``: the text as it was read; None: it cannot be read, and no line is known.
    """
    program = one.program
    lines = np.zeros(len(program), dtype=np.int64)
    ends = np.full(len(program), -1) if reading is None else compared_rows(program, reading)[1]
    known = np.flatnonzero(ends >= 0)
    if reading is not None and len(known):
        # a motion that the text leaves out belongs to the next one of it
        after = np.minimum(np.searchsorted(known, np.arange(len(program))), len(known) - 1)
        lines = np.asarray(reading.program.line)[ends[known[after]]]

    def of_text(line: NDArray[np.int64]) -> NDArray[np.int64]:
        row = np.searchsorted(program.line, line)
        there = program.line[np.minimum(row, len(program) - 1)] == line
        return np.where(there, lines[np.minimum(row, len(program) - 1)], 0)

    def line_in_text(line: int) -> int:
        return int(of_text(np.array([line]))[0]) if line else 0

    touched = tuple(replace(c, line=line_in_text(c.line)) for c in one.shape.collisions)
    surfaces = replace(one.surfaces, shape=replace(one.shape, collisions=touched))
    return replace(
        one,
        columns={**one.columns, "line": of_text(np.asarray(one.columns["line"], dtype=np.int64))},
        find_surfaces=lambda: surfaces,
        beyond=tuple(replace(f, line=line_in_text(f.line)) for f in one.beyond),
    )


def _read(walled: ThinWallResult, one: Variant, text: str) -> tuple[ProgramReading | None, tuple[Finding, ...]]:
    """The text of a variant as it is read, None if it cannot be; and the findings that keep it from being released."""
    planning = walled.planning
    try:
        reading = read_back(text, program_file(walled, one), planning.machine, planning.cutters, lengths=True)
    except InputError as err:
        return None, (unread(err),)
    return reading, (*reading_findings(reading, planning.cutters, one.program), *no_end(text))


def _simulated_text(walled: ThinWallResult, one: Variant, reading: ProgramReading, tried: Tried) -> Variant:
    """A variant as the simulation of its text finds it, which names the lines of its plan."""
    program, times = time_rows(reading, walled.planning.cutters, walled.planning.machine)
    lines = one.program.line[rows_of_source(one.program, reading)][len(reading.program) - len(program) :]
    return tried.prove_text(one, replace(program, line=lines), times)


def _frame(walled: ThinWallResult) -> str:
    """The coordinates of the program, in words."""
    if isinstance(walled.geometry.shape, PartShape):
        return "coordinates are those of the part's model"
    return "Z 0 is the clamp, X along the wall, its sides towards Y+ and Y-"
