"""Calculation of new spindle speeds from the stability margins of the steps, and of the new S words.

Each tool gets one speed: that with the greatest least margin over the cuts of the tool that are nearest to chatter or
longest in cut. Or each zone gets one, see :mod:`chipload.jobs.program.zones`. The feed per tooth does not change. The
new text is read again and compared with the old program motion by motion: only speeds and feeds may differ, as wanted.
The caller proves the limits by simulating the new program from fresh stock.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from chipload.checking.default_checks import PROGRAM_COLUMNS, with_checks
from chipload.checking.inputs import CheckInputs
from chipload.checking.outcome import SpeedResult, ToolSpeed
from chipload.checking.preparation import resolution_of, time_rows
from chipload.checking.program_text import read_as, rows_that_differ
from chipload.checking.stability import StabilityResult, rounded_rpm, stability_of, watch_of
from chipload.checking.stiffness import deflection_watch, stiffness_of, watched_columns, with_columns
from chipload.checking.workpiece_compliance import WorkpieceCompliance
from chipload.errors import InputError
from chipload.jobs.program.zones import row_speeds, zone_speeds
from chipload.jobs.simulation.job import ProgramJob
from chipload.jobs.simulation.run import read_for, text_to_change
from chipload.jobs.tables import require_stated
from chipload.program.gcode.feed_words import DIGITS
from chipload.program.gcode.speed_words import speed_words, with_speeds
from chipload.program.program import DWELL, RAPID, Program
from chipload.program.read import ProgramReading, line_times
from chipload.progress import Progress
from chipload.simulation.chips import remove
from chipload.simulation.loads import Cuts, Floats
from chipload.simulation.strips import threads_of
from chipload.stock.layers import LayeredStock
from chipload.units import rpm_from_rad_s

#: a speed that gains less than this in margin stays as it is
GAIN = 0.02


def text_with_speeds(
    job: ProgramJob, inputs: CheckInputs, reading: ProgramReading, stock: LayeredStock
) -> tuple[str, str]:
    """Return the text of a program whose speeds can be changed, and its dialect.

    Raises
    ------
    InputError
        They cannot be changed in the text; the message states the remedy.
    """
    text, dialect = text_to_change(job, inputs, reading, stock, "speeds")
    speed_words(text)
    return text, dialect


def new_speeds(
    job: ProgramJob,
    inputs: CheckInputs,
    own: tuple[str, str],
    reading: ProgramReading,
    stock: LayeredStock,
    workpiece: WorkpieceCompliance | None,
    progress: Progress,
    workers: int | None = None,
) -> tuple[SpeedResult, ProgramReading]:
    """Simulate the program in a stock, which changes, and return its text with new speeds and the new program.

    Parameters
    ----------
    own : the text of the program, and its dialect
    workers : threads that share a simulation; None: as :func:`chipload.simulation.strips.threads_of`

    Raises
    ------
    InputError
        The speeds cannot be changed in the text: the line is named.
    """
    op, cutters, material, machine = inputs.settings, inputs.cutters, inputs.material, inputs.machine
    (text, dialect), seconds = own, float(line_times(reading, machine)[1].sum())
    stability = require_stated(watch_of(inputs, workpiece), "dynamics")
    gives = stiffness_of(inputs.elasticity.stiffness, cutters)
    bends = with_checks(inputs.checks, material, deflection_watch(gives, material))
    program, times = time_rows(reading, cutters, machine, op.interpolation)

    def watch(cuts: Cuts) -> dict[str, Floats]:
        return {**bends(cuts), **stability(cuts)}

    before = remove(
        program, stock, cutters, material, resolution_of(op, cutters, reading.program),
        times=times, watch=watch, accuracy=False, workers=threads_of(workers), progress=progress,
    )  # fmt: skip
    before = with_columns(before, (*watched_columns(gives), *PROGRAM_COLUMNS, *stability.columns))
    found = stability_of(inputs, stability)
    table = require_stated(job.table.operation[0].speeds, "operation.0.speeds")
    tools: list[tuple[ToolSpeed, int]] = []
    for one in _advise_speeds(found, reading.program):
        zones = zone_speeds(found, reading.program, before.columns, one.tool) if table.by == "zone" else ()
        tools += zones if len(zones) > 1 else [(one, one.lines[0])]
    tools.sort(key=lambda zone: zone[0].lines)
    words = np.array([w.line for w in speed_words(text)], dtype=np.int64)
    wanted, added = row_speeds(reading.program, tools, words)
    new = _new_text(text, reading.program, wanted, added)
    after = read_for(job, machine, text=read_as(new))
    _same(reading.program, after.program, wanted)
    return SpeedResult(new, dialect, before, seconds, tuple(t for t, _ in tools), found), after


def _advise_speeds(stability: StabilityResult, program: Program) -> tuple[ToolSpeed, ...]:
    """Return the new speed of each tool with known cuts; a tool with one speed that is as good keeps it."""
    out = []
    for tool, quiet in stability.quiet.items():
        moving = (
            (program.tool == tool) & (program.motion != RAPID) & (program.motion != DWELL) & (program.spindle != 0.0)
        )
        own = np.unique(np.abs(program.spindle[moving]))
        if not len(own):
            continue
        speed, margin = quiet.advised(float(own[-1]))
        rpm = rounded_rpm(speed)
        present = float(np.interp(own[-1], quiet.speed, quiet.margin))
        if len(own) == 1 and present >= stability.wanted and margin <= present + GAIN:
            rpm, margin = rpm_from_rad_s(float(own[0])), present
        before = tuple(round(rpm_from_rad_s(float(x)), 6) for x in own)
        line = program.line[moving]
        out.append(ToolSpeed(tool, before, rpm, margin, (int(line.min()), int(line.max()))))
    return tuple(out)


def _new_text(text: str, program: Program, wanted: Floats, added: Mapping[int, float]) -> str:
    """Return the text with the wanted speeds of its rows (n,) [rad/s] (NaN: unchanged) and the ``added`` S words."""
    old = speed_words(text)
    starts = np.array(sorted({w.line for w in old} | set(added)), dtype=np.int64)
    cuts = (program.motion != RAPID) & (program.motion != DWELL) & (program.spindle != 0.0)
    under = np.searchsorted(starts, program.line, side="right") - 1
    changed = cuts & ~np.isnan(wanted)
    speeds: dict[int, float] = {}
    for word in old:
        own = cuts & (under == int(np.searchsorted(starts, word.line)))
        if not (own & changed).any():
            continue
        new = np.unique(np.where(np.isnan(wanted[own]), np.abs(program.spindle[own]), wanted[own]))
        tools = np.unique(program.tool[own])
        if len(tools) > 1:
            named = ", ".join(map(str, tools.tolist()))
            raise InputError(
                f"line {word.line}: S{word.rpm:g} applies to tools {named}: write an S word after each tool change"
            )
        if len(new) > 1:
            raise InputError(
                f"line {word.line}: S{word.rpm:g} applies to two zones of tool {tools[0]}: write an S word between them"
            )
        speeds[word.line] = round(rpm_from_rad_s(float(new[0])), 6)
    if (changed & (under < 0)).any():
        raise InputError(
            f"line {program.line[changed & (under < 0)][0]}: cuts at a speed that no earlier S word states"
        )
    feeds: dict[int, float] = {}
    for row in np.flatnonzero((program.motion != RAPID) & (program.motion != DWELL)).tolist():
        line, speed = int(program.line[row]), abs(float(program.spindle[row]))
        factor = float(wanted[row]) / speed if not np.isnan(wanted[row]) and speed > 0.0 else 1.0
        if feeds.setdefault(line, factor) != factor:
            raise InputError(f"line {line}: moves at two speeds: write each on a separate line")
    scaled = {line: 1.0 if abs(f - 1.0) < 1e-9 else f for line, f in feeds.items()}
    return with_speeds(text, speeds, scaled, added)


def _same(old: Program, new: Program, wanted: Floats) -> None:
    """Refuse a new text that differs from the old program in more than the wanted speeds at the same feed per tooth."""
    wrong, at = len(old) != len(new), 0
    if not wrong:
        off = rows_that_differ(old, new, "motion", "p_work", "axis", "centre", "normal", "turns", "tool", "line")
        off |= (old.motion == DWELL) & (old.feed != new.feed)
        moves = (old.motion != RAPID) & (old.motion != DWELL)
        speed = np.where(np.isnan(wanted), old.spindle, np.sign(old.spindle) * wanted)
        off |= moves & (np.abs(new.spindle - speed) > 1e-9 * np.abs(speed))
        turned = np.abs(old.spindle)
        factor = np.divide(np.abs(speed), turned, out=np.ones(len(old)), where=turned > 0.0)
        rounded = 1.01 * 10.0 ** (1 - DIGITS)
        feed = old.feed * factor
        off |= moves & ((new.feed > feed * (1.0 + 1e-9)) | (new.feed < feed * (1.0 - rounded)))
        wrong, at = bool(off.any()), int(old.line[np.argmax(off)])
    if wrong:
        where = f"line {at}: " if at else ""
        raise InputError(f"{where}its speed cannot be set by its own S word: convert the program first")
