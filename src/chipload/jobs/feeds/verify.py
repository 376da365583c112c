"""Verification of a program with new feeds: the same motions, the requested feeds, and no line that rubs."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from chipload.checking.program_text import rows_that_differ
from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.jobs.feeds.division import DividedProgram
from chipload.jobs.feeds.tables import FeedsTable
from chipload.planning.feeds import LineFeeds
from chipload.program.gcode.feed_words import DIGITS
from chipload.program.program import DWELL, RAPID, Program
from chipload.simulation.steps import Steps

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def require_same(old: Program, new: Program, line: Ints, factor: Floats) -> None:
    """Refuse a new text that differs from the old program in more than the wanted feeds, rounded down by one digit.

    Raises
    ------
    InputError
        It is another program: the line is named.
    """
    at, wrong = 0, len(old) != len(new)
    if not wrong:
        off = rows_that_differ(
            old, new, "motion", "p_work", "axis", "centre", "normal", "turns", "spindle", "tool", "line"
        )
        off |= (old.motion == DWELL) & (old.feed != new.feed)
        moves = np.isin(old.line, line) & (old.motion != RAPID) & (old.motion != DWELL)
        wanted = old.feed[moves] * factor[np.searchsorted(line, old.line[moves])]
        rounded = 1.0 - 1.01 * 10.0 ** (1 - DIGITS)
        off[moves] |= (new.feed[moves] > wanted * (1.0 + 1e-9)) | (new.feed[moves] < wanted * rounded)
        wrong, at = bool(off.any()), int(old.line[np.argmax(off)])
    if wrong:
        where = f"line {at}: " if at else ""
        raise InputError(f"{where}its feed cannot be set by its own F word: convert the program first")


def rubbing_lines(
    lines: LineFeeds,
    factor: Floats,
    divided: DividedProgram,
    steps: Steps,
    cuts: NDArray[np.bool_],
    table: FeedsTable,
    cutters: Mapping[int, Cutter],
) -> tuple[tuple[int, float], ...]:
    """Return the lines of the new text that cut below the least feed per tooth, and their feeds per tooth [mm]."""
    if table.tooth_feed_least_mm is None:
        return ()
    at = cuts[divided.step]
    step, line = divided.step[at], divided.line[at]
    new = tooth_feeds(steps, cutters)[step] * factor[np.searchsorted(lines.line, line)]
    low = new < table.tooth_feed_least_mm * (1.0 - 2.0 * 10.0 ** (1 - DIGITS))
    worst: dict[int, float] = {}
    for number, feed in zip(line[low].tolist(), new[low].tolist(), strict=True):
        worst[number] = min(worst.get(number, math.inf), feed)
    return tuple(sorted(worst.items()))


def speeds_of(steps: Steps) -> Floats:
    """Return the speed of the tip (n,) [mm/s]; 0 at rest and in rapids."""
    length = np.linalg.norm(steps.p1 - steps.p0, axis=1)
    moves = steps.seconds > 0.0
    return np.asarray(np.where(moves, length / np.where(moves, steps.seconds, 1.0), 0.0))


def tooth_feeds(steps: Steps, cutters: Mapping[int, Cutter]) -> Floats:
    """Return the feed per tooth (n,) [mm]; inf where the spindle or the tip is at rest."""
    flutes = np.ones(len(steps))
    for number in np.unique(steps.tool).tolist():
        if number in cutters:
            flutes[steps.tool == number] = cutters[number].flutes
    speed = speeds_of(steps)
    turns = (speed > 0.0) & (steps.spindle != 0.0)
    return np.asarray(np.where(turns, math.tau * speed / np.where(turns, flutes * np.abs(steps.spindle), 1.0), np.inf))
