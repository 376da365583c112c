"""Division of the lines of a program where the engagement changes, before its feeds are written.

Notation: a station is the middle of a step, where its loads are calculated. A line is divided at stations, see
:mod:`chipload.planning.line_division`; its segments are lines of a new text that moves as the old one did, which is
read again and compared, see :mod:`chipload.jobs.feeds.same_path`. Feeds are found for the lines of this text. An entry
is a step with the line of the new text that it belongs to; a station at which a line is divided belongs to both.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chipload.checking.program_text import has_blocks
from chipload.errors import InputError
from chipload.jobs.feeds.same_path import lines_off_path
from chipload.machine.machine import Machine
from chipload.planning.feeds import AIR, StepContact
from chipload.planning.line_division import line_ends
from chipload.program.commands import ARC, LINE, PLANE_AXES, arc_sweeps, starts
from chipload.program.gcode.line_segments import LineForm, LinePath, line_forms, mismatch, round_point, with_segments
from chipload.program.motions import directions, is_arc, lengths
from chipload.program.path_mode import PathControl
from chipload.program.program import DWELL, RAPID
from chipload.program.read import ProgramReading
from chipload.program.time import peak_speed
from chipload.simulation.steps import Steps

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: decimals of a point [mm] at which a line is divided, at most: finer than what the steps resolve
MOST_DECIMALS = 4
#: how far a cut may move into the faster segment, to a point that can be written: over the distance of stations, [mm]
MOVED, MOVED_MM = 0.4, 0.2
#: how often a text is divided again without lines whose segments do not move as the line did
TRIALS = 3
#: time that a control takes to read a block where its machine does not state it [s]
BLOCK_S = 0.01
#: feeds above this [mm/min] are whole numbers
WHOLE_MM_MIN = 100.0


@dataclass(frozen=True, eq=False)
class Allowed:
    """What the steps of a program allow.

    Parameters
    ----------
    touch : (n,) int, :class:`StepContact`
    least, most : (n,) float, least and greatest feed factor; nan: a limit requires less than the least
    by : (n,) int, code of what limits it
    """

    touch: Ints
    least: Floats
    most: Floats
    by: Ints


@dataclass(frozen=True, eq=False)
class DividedProgram:
    """A program some of whose lines are divided.

    Parameters
    ----------
    text : of the program; feeds as they were
    reading : of this text
    step, line : (e,) int, entries: step of the old program, and line of ``text`` that it belongs to
    allowed : what the steps allow
    segments : lines of ``text`` of each divided line, by the line of the old text
    kept : lines that would be faster in segments but cannot be divided, by the reason
    """

    text: str
    reading: ProgramReading
    step: Ints
    line: Ints
    allowed: Allowed
    segments: Mapping[int, range] = field(default_factory=dict)
    kept: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Motions:
    """Rows of a program and of its commands.

    Parameters
    ----------
    reading : of the program
    begin : (m, 9) where each command starts, in its own coordinates
    sweep : (m,) [rad] of each arc
    length : (n,) [mm] of each row of the program
    acceleration : (n,) [mm/s^2] along the path
    peak : (n,) [mm/s] that a row reaches at the greatest feed of its steps
    """

    reading: ProgramReading
    begin: Floats
    sweep: Floats
    length: Floats
    acceleration: Floats
    peak: Floats


@dataclass(frozen=True, eq=False)
class _Line:
    """A line of one motion: its rows of program and commands, and its steps, which are of one length."""

    row: int
    command: int
    steps: Ints


@dataclass(frozen=True, eq=False)
class _Cuts:
    """Where a line is divided: the points of its path, its steps, and those among them at which it is."""

    path: LinePath
    steps: Ints
    ends: Ints


def undivided_program(text: str, reading: ProgramReading, steps: Steps, allowed: Allowed) -> DividedProgram:
    """Return a program whose lines all keep one feed."""
    at = np.flatnonzero(~steps.rapid)
    return DividedProgram(text, reading, at, steps.line[at], allowed)


def divide_lines(
    text: str,
    dialect: str,
    reading: ProgramReading,
    steps: Steps,
    allowed: Allowed,
    air: Floats,
    machine: Machine,
    read: Callable[[str], ProgramReading],
) -> DividedProgram:
    """Divide lines of a program where that saves time.

    A step of a divided line that cuts nothing is passed at the feed in air or as fast as the fastest cut of the line;
    one that removes only films at the programmed feed or as fast as the slowest cut.

    Parameters
    ----------
    air : (n,) feed factor of steps that cut nothing
    read : function that reads a text
    """
    passed = _passed_factors(steps, allowed, air)
    motions = _motions(reading, machine, steps, passed)
    forms, cuts, kept = _forms(text, dialect), dict[int, _Cuts](), Counter[str]()
    decimals, jerk = min(machine.decimals, MOST_DECIMALS), machine.jerk or machine.jerk_low
    block_s = machine.block_time or (BLOCK_S if machine.planner is None else machine.planner.cycle)
    for line, own, several in _cutting_lines(reading, steps, allowed):
        speed = reading.program.feed[own.row] * passed[own.steps]
        if several:
            kept[several] += speed.min() < speed.max()
            continue
        ends = _ends(own, motions, speed, block_s, jerk)
        if len(ends):
            path = _path(own, motions)
            reason = _reason(own, motions, forms[line]) or mismatch(forms[line], path)
            kept[reason] += 1
            if not reason:
                points = _with_points(path, own, motions, ends, speed, forms[line], decimals)
                cuts[line] = _Cuts(points, own.steps, ends)
    del kept[""]
    for _ in range(TRIALS):
        new, first = with_segments(text, forms, {k: cut.path for k, cut in cuts.items()}, decimals)
        try:
            after = read(new)
        except InputError:
            break
        off = lines_off_path(reading.program, after.program, first, set(cuts), 10.0**-decimals)
        if not off:
            return _divided_entries(new, after, steps, first, cuts, +kept, allowed, passed)
        if not off & cuts.keys():
            break
        for line in off & cuts.keys():
            kept[OTHER_PATH] += 1
            del cuts[line]
    kept[OTHER_PATH] += len(cuts)
    return replace(undivided_program(text, reading, steps, allowed), kept=+kept)


def _forms(text: str, dialect: str) -> dict[int, LineForm]:
    """Return the form of each line, from 1; conversational blocks keep one feed."""
    if has_blocks(dialect):
        return line_forms(text)
    return dict.fromkeys(range(1, text.count("\n") + 2), LineForm("conversational block", True, 1.0, False, ()))


#: why a line is not divided whose segments were read as another path
OTHER_PATH = "other path in segments"


def _passed_factors(steps: Steps, allowed: Allowed, air: Floats) -> Floats:
    """Return the feed factor (n,) of each step in a divided line."""
    factor = np.where(np.isnan(allowed.most), allowed.least, allowed.most)
    cuts = allowed.touch == StepContact.CUT
    size = int(steps.line.max(initial=0)) + 1
    fast, slow = np.zeros(size), np.full(size, np.inf)
    np.maximum.at(fast, steps.line[cuts], factor[cuts])
    np.minimum.at(slow, steps.line[cuts], factor[cuts])
    film = np.maximum(1.0, np.where(np.isfinite(slow), slow, 1.0)[steps.line])
    free = np.maximum(air, fast[steps.line])
    return np.where(cuts, factor, np.where(allowed.touch == StepContact.FILM, film, free))


def _motions(reading: ProgramReading, machine: Machine, steps: Steps, passed: Floats) -> _Motions:
    """Return what the division needs of all rows."""
    program, commands = reading.program, reading.commands
    top = np.ones(int(max(program.line.max(initial=0), steps.line.max(initial=0))) + 1)
    np.maximum.at(top, steps.line[~steps.rapid], passed[~steps.rapid])
    moves = (program.motion != RAPID) & (program.motion != DWELL)
    feed = np.where(moves, program.feed * top[program.line], program.feed)
    along = np.abs(directions(program)[0])
    with np.errstate(divide="ignore"):
        acceleration = (np.array(machine.acceleration) / along).min(axis=1)
    # an arc goes through all directions of its plane
    arc = is_arc(program)
    level = (np.abs(program.normal) < 1.0 - 1e-9) | (along > 1e-9)
    slowest = np.where(level, machine.acceleration, np.inf).min(axis=1)
    return _Motions(
        reading, starts(commands), arc_sweeps(commands), lengths(program),
        np.where(arc, slowest, acceleration), peak_speed(replace(program, feed=feed), machine),
    )  # fmt: skip


def _cutting_lines(reading: ProgramReading, steps: Steps, allowed: Allowed) -> list[tuple[int, _Line, str]]:
    """Return the lines that cut, and why those that are not one motion of X, Y and Z cannot be divided."""
    program, commands = reading.program, reading.commands
    rows, commanded = Counter(program.line.tolist()), Counter(commands.line.tolist())
    row_of = {line: k for k, line in enumerate(program.line.tolist())}
    command_of = {line: k for k, line in enumerate(commands.line.tolist())}
    order = np.argsort(steps.line, kind="stable")
    numbers, at = np.unique(steps.line[order], return_index=True)
    out = []
    for line, own in zip(numbers.tolist(), np.split(order, at[1:]), strict=True):
        cuts = own[~steps.rapid[own]]
        if line <= 0 or not (allowed.touch[cuts] == StepContact.CUT).any():
            continue
        row, command = row_of[line], command_of.get(line, 0)
        reason = ""
        if rows[line] != 1 or commanded[line] != 1 or row == 0 or command == 0 or steps.rapid[own].any():
            reason = "several motions"
        elif commands.motion[command] not in (LINE, ARC) or abs(int(commands.turns[command])) > 1:
            reason = "other words"
        out.append((line, _Line(row, command, cuts), reason))
    return out


def _ends(own: _Line, motions: _Motions, speed: Floats, block_s: float, jerk: float | None) -> Ints:
    """Return the stations at which a line would be divided, from the speeds [mm/s] that its steps allow."""
    length = float(motions.length[own.row])
    if length <= 0.0:
        return np.empty(0, dtype=np.int64)
    written = whole_feeds(60.0 * np.minimum(speed, motions.peak[own.row])) / 60.0
    return line_ends(_stations(own) * length, written, length, float(motions.acceleration[own.row]), block_s, jerk)


def whole_feeds(feed: Floats) -> Floats:
    """Return feeds [mm/min] rounded down to 1 mm/min from ``WHOLE_MM_MIN`` on.

    >>> whole_feeds(np.array([1234.9, 99.5])).tolist()
    [1234.0, 99.5]
    """
    return np.where(feed >= WHOLE_MM_MIN, np.floor(feed + 1e-6), feed)


def _stations(own: _Line) -> Floats:
    """Return the places of the middles of the steps of a line over its length."""
    n = len(own.steps)
    return np.asarray((np.arange(n) + 0.5) / n)


def _path(own: _Line, motions: _Motions) -> LinePath:
    """Return the path of a line, not yet divided."""
    commands, k = motions.reading.commands, own.command
    first, second, _ = PLANE_AXES[int(commands.plane[k])]
    arc = commands.motion[k] == ARC
    return LinePath(
        motions.begin[k, :3], commands.position[k, :3], np.empty((0, 3)),
        (first, second) if arc else None, commands.centre[k] if arc else None,
    )  # fmt: skip


def _reason(own: _Line, motions: _Motions, form: LineForm) -> str:
    """Return why a line keeps one feed though segments would be faster; empty: it can be divided."""
    commands, program = motions.reading.commands, motions.reading.program
    turned = np.abs(commands.position[own.command, 3:] - motions.begin[own.command, 3:]).max() > 0.0
    if turned or not np.array_equal(program.axis[own.row], program.axis[own.row - 1]):
        return "rotary axes"
    if (program.path_mode[own.row - 1 : own.row + 1, 0] == PathControl.EXACT_STOP).any():
        return "exact stop"
    return form.reason


def _with_points(
    path: LinePath, own: _Line, motions: _Motions, ends: Ints, speed: Floats, form: LineForm, decimals: int
) -> LinePath:
    """Return the path of a line with the points at which it is divided."""
    shares, length = _stations(own), float(motions.length[own.row])
    room = min(MOVED / len(shares), MOVED_MM / length)
    bounds = [0, *ends.tolist(), len(speed) - 1]
    least = [float(speed[a : b + 1].min()) for a, b in pairwise(bounds)]
    points = []
    for k, end in enumerate(ends.tolist()):
        towards = -room if least[k] > least[k + 1] else room
        there = (float(shares[end]), float(shares[end]) + towards)
        points.append(round_point(path, there, float(motions.sweep[own.command]), form.unit, decimals))
    return replace(path, points=np.array(points))


def _divided_entries(
    text: str,
    reading: ProgramReading,
    steps: Steps,
    first: Mapping[int, int],
    cuts: Mapping[int, _Cuts],
    kept: Mapping[str, int],
    allowed: Allowed,
    passed: Floats,
) -> DividedProgram:
    """Return the entries of a divided program."""
    of = np.arange(int(steps.line.max(initial=0)) + 1)
    for old, new in first.items():
        if old < len(of):
            of[old] = new
    inside = np.isin(steps.line, list(cuts))
    whole = np.flatnonzero(~steps.rapid & ~inside)
    entries: list[tuple[Ints, Ints]] = [(whole, of[steps.line[whole]])]
    segments: dict[int, range] = {}
    for number, cut in cuts.items():
        bounds = [0, *cut.ends.tolist(), len(cut.steps) - 1]
        segments[number] = range(first[number], first[number] + len(bounds) - 1)
        for segment, a, b in zip(segments[number], bounds[:-1], bounds[1:], strict=True):
            entries.append((cut.steps[a : b + 1], np.full(b + 1 - a, segment)))
    uncut = inside & (allowed.touch != StepContact.CUT)
    return DividedProgram(
        text,
        reading,
        np.concatenate([step for step, _ in entries]),
        np.concatenate([line for _, line in entries]),
        Allowed(
            np.where(inside, StepContact.CUT, allowed.touch),
            np.minimum(allowed.least, np.where(inside, passed, np.inf)),
            np.where(uncut, passed, allowed.most),
            np.where(uncut, AIR, allowed.by),
        ),
        segments,
        kept,
    )
