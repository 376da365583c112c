"""Comparison of a written program text with the planned program: the text is read as a controller reads it.

Notation: a row of the planned program is found in the text where the tip, its axis, the tool and the spindle are those
at its end. Rows that move less than the text is rounded are missing from it, of whatever kind; further rows may lie
between two that are found (a motion of rotary axes is written in pieces), if they stay near the straight line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, InputError, Severity
from chipload.machine.machine import Machine
from chipload.program.commands import Commands
from chipload.program.control import control_named
from chipload.program.gcode.tools import Tool, ToolTable
from chipload.program.motions import is_arc, lengths
from chipload.program.nc_text import NcText, read_nc
from chipload.program.program import DWELL, RAPID, Program
from chipload.program.read import ProgramReading, read_program
from chipload.program.recognise import Recognition
from chipload.program.setup import Setup
from chipload.program.swivel import Swivel

Floats = NDArray[np.float64]

#: a place is found within so many units of the last written decimal, and within this [mm] where an axis turns
UNITS, TURNED_MM = 4.0, 0.02
#: directions of the axis agree within this [rad]
AXIS_RAD = 1e-3
#: an axis that turns less [rad] stands
STANDS_RAD = 1e-7
#: speeds of the spindle agree within this share
SPEED_SHARE = 1e-3
#: feeds agree within this share, or by less than the text is rounded
FEED_SHARE = 0.01
#: rows of the text among which the end of a planned row is sought first
AHEAD = 400
#: tool lengths along A B C U V W
NO_OFFSET = (0.0,) * 6


def read_back(
    text: str, name: str, machine: Machine, cutters: Mapping[int, Cutter], *, lengths: bool = False
) -> ProgramReading:
    """Read a written text as the controller of a machine reads it.

    Parameters
    ----------
    name : of its file
    cutters : by tool number
    lengths : whether the tools are as long in the tool table as their overhang; else they have no length

    Raises
    ------
    InputError
        The text cannot be read.
    """
    table = _tool_table(cutters, lengths)
    return read_program(
        Path(name), machine, text=text, tools=table, comments=False, strict=True, dialect=machine.dialect
    )


def commands_back(text: str, name: str, machine: Machine, cutters: Mapping[int, Cutter]) -> Commands:
    """Read what a written text sends the axes to, as the controller of a machine does; else as :func:`read_back`."""
    recognition = Recognition(control_named(machine.dialect), True)
    nc = NcText(Path(name), text, recognition, Setup(), _tool_table(cutters, False), False, {}, {})
    return read_nc(nc, None, True, Swivel(machine, None))[0]


def _tool_table(cutters: Mapping[int, Cutter], lengths: bool) -> ToolTable:
    """Tools as long as their overhang, or without a length."""
    return ToolTable(
        {
            n: Tool(n, diameter=c.diameter, offset=(0.0, 0.0, c.overhang if lengths else 0.0, *NO_OFFSET))
            for n, c in cutters.items()
        }
    )


def text_findings(
    text: str, name: str, machine: Machine, cutters: Mapping[int, Cutter], planned: Program, *, lengths: bool = False
) -> tuple[Finding, ...]:
    """Return the findings of a written text that keep it from being released.

    They are what its reader finds that is more than a note, violations of the machine's limits, cuts with the spindle
    turning against the hand of the cutter, the first place that differs from the ``planned`` program, and a missing
    end. For ``name``, ``cutters`` and ``lengths`` see :func:`read_back`.
    """
    try:
        reading = read_back(text, name, machine, cutters, lengths=lengths)
    except InputError as err:
        return (unread(err),)
    return (*reading_findings(reading, cutters, planned), *no_end(text))


def no_end(text: str) -> tuple[Finding, ...]:
    """Return a finding if a text does not end by M2 or M30."""
    lines = [line.strip() for line in text.splitlines()]
    last = next((line for line in reversed(lines) if line and line != "%"), "")
    if last.split()[-1:] in (["M2"], ["M30"]):
        return ()
    return (Finding("text-differs", len(lines), "the written text does not end by M2 or M30", Severity.EXCEEDS),)


def unread(refusal: InputError) -> Finding:
    """Return the finding that a written text is refused."""
    return Finding("text-unread", 0, f"the written text cannot be read back: {refusal}", Severity.EXCEEDS)


def reading_findings(reading: ProgramReading, cutters: Mapping[int, Cutter], planned: Program) -> tuple[Finding, ...]:
    """Return the findings of :func:`text_findings` from the reading of a text."""
    return (
        *(f for f in reading.findings if f.severity > Severity.NOTE),
        *(replace(f, severity=Severity.EXCEEDS) for f in reading.violations if f.code != "machine-offset"),
        *_against_hand(reading, cutters),
        *text_differences(planned, reading),
    )


def _against_hand(reading: ProgramReading, cutters: Mapping[int, Cutter]) -> tuple[Finding, ...]:
    """The first feed motion of each tool that turns against its hand."""
    p, out = reading.program, list[Finding]()
    for number in np.unique(p.tool).tolist():
        if number not in cutters:
            continue
        hand = -1.0 if cutters[number].left_hand else 1.0
        wrong = np.flatnonzero((p.tool == number) & (p.motion != RAPID) & (hand * p.spindle < 0.0))
        if len(wrong):
            side, word = ("left", "M4") if hand < 0.0 else ("right", "M3")
            text = f"tool {number} is a {side}-hand cutter and is not started by {word}"
            out.append(Finding("spindle-reversed", int(p.line[wrong[0]]), text, Severity.EXCEEDS))
    return tuple(out)


def text_differences(planned: Program, reading: ProgramReading) -> tuple[Finding, ...]:
    """Return a finding for the first place where a text differs from the program that was planned; none: it agrees.

    Parameters
    ----------
    planned : the program that was written
    reading : of the text that was written from it
    """
    return compared_rows(planned, reading)[0]


def rows_of_source(planned: Program, reading: ProgramReading) -> NDArray[np.int64]:
    """Row of the planned program (m,) that each row of a text comes from; behind a difference the last that agrees."""
    ends = compared_rows(planned, reading)[1]
    known = np.flatnonzero(ends >= 0)
    if not len(known):
        return np.zeros(len(reading.program), dtype=np.int64)
    at = np.searchsorted(ends[known], np.arange(len(reading.program)))
    return np.asarray(known[np.minimum(at, len(known) - 1)])


def compared_rows(planned: Program, reading: ProgramReading) -> tuple[tuple[Finding, ...], NDArray[np.int64]]:
    """Return the first difference of a text, as :func:`text_differences`, and the row of the text (n,) at which each
    planned row ends; -1: it is not in the text, or behind a difference.
    """
    read = reading.program
    ends = np.full(len(planned), -1)
    turned = bool(np.abs(np.diff(planned.axis, axis=0)).max(initial=0.0) > 0.0)
    rounded = UNITS * 10.0**-reading.machine.decimals
    near = rounded + (TURNED_MM if turned else 0.0)
    still = _stands(planned, rounded)
    wanted, given = _seconds(planned), _seconds(read)
    last, row = -1, -1
    for k in range(len(planned)):
        place = planned.p_work[k]
        if still[k]:
            continue
        found = _next(read, last, planned, k, near)
        if found is None:
            line = int(read.line[min(last + 1, len(read) - 1)])
            return (_difference_finding(line, k, place, read, last),), ends
        off = _away(read, last, found, planned, k) if row >= 0 else 0.0
        if off > near:
            text = f"the written text leaves the planned path by {off:.4g} mm"
            return (Finding("text-differs", int(read.line[found]), text, Severity.EXCEEDS, _place(place), k),), ends
        if row >= 0 and int(planned.motion[k]) not in (RAPID, DWELL):
            seconds = float(given[found + 1] - given[last + 1])
            share = seconds / max(float(wanted[k + 1] - wanted[row + 1]), np.finfo(np.float64).tiny)
            if abs(share - 1.0) > FEED_SHARE and abs(seconds * (1.0 - 1.0 / share)) * planned.feed[k] > near:
                text = f"the written text moves at {1.0 / share:.4g} of the planned feed"
                return (Finding("text-differs", int(read.line[found]), text, Severity.EXCEEDS, _place(place), k),), ends
        last, row, ends[k] = found, k, found
    rest = np.abs(read.p_work[last + 1 :] - read.p_work[last]).max(initial=0.0)
    if rest > near:
        text = f"the written text goes on for {rest:.4g} mm after the end of the planned program"
        return (Finding("text-differs", int(read.line[last + 1]), text, Severity.EXCEEDS),), ends
    return (), ends


def _seconds(program: Program) -> Floats:
    """Time at the programmed feed (n + 1,) [s] before each row, and behind the last; rapids and dwells take none."""
    cuts = (program.motion != RAPID) & (program.motion != DWELL) & (program.feed > 0.0)
    own = np.divide(lengths(program), program.feed, out=np.zeros(len(program)), where=cuts)
    return np.concatenate([[0.0], np.cumsum(own)])


def _stands(program: Program, rounded: float) -> NDArray[np.bool_]:
    """Rows (n,) that do not move, or less than the text is rounded, with the tool and the spindle of the row before."""
    out = np.zeros(len(program), dtype=np.bool_)
    step = np.abs(np.diff(program.p_work, axis=0)).max(axis=1)
    turn = np.abs(np.diff(program.axis, axis=0)).max(axis=1)
    out[1:] = (
        (step <= rounded) & (turn <= STANDS_RAD) & (np.diff(program.tool) == 0) & (np.diff(program.spindle) == 0.0)
    )
    return out & ~is_arc(program)


def _alike(a: Program, i: int, b: Program, j: int) -> bool:
    """Whether two rows have the same tool and spindle, are both rapids or neither, and end with the same axis."""
    same = int(a.tool[i]) == int(b.tool[j]) and (int(a.motion[i]) == RAPID) == (int(b.motion[j]) == RAPID)
    speed = abs(float(a.spindle[i]) - float(b.spindle[j])) <= SPEED_SHARE * abs(float(a.spindle[i]))
    return same and speed and float(np.linalg.norm(a.axis[i] - b.axis[j])) <= AXIS_RAD


def _next(read: Program, last: int, planned: Program, k: int, near: float) -> int | None:
    """The next row of the text that ends where row k of the plan does; None: none does."""
    first = last + 1
    close = first < len(read) and bool(np.abs(read.p_work[first] - planned.p_work[k]).max() <= near)
    if close and _alike(planned, k, read, first):
        return first
    for end in (first + AHEAD, len(read)):
        after = read.p_work[first:end]
        for at in np.flatnonzero(np.abs(after - planned.p_work[k]).max(axis=1) <= near).tolist():
            if _alike(planned, k, read, first + at):
                return first + int(at)
    return None


def _away(read: Program, last: int, found: int, planned: Program, k: int) -> float:
    """How far rows of the text between two places lie off the line between them [mm]; 0 beside an arc."""
    between = read.p_work[last + 1 : found]
    if not len(between) or is_arc(planned)[k]:
        return 0.0
    a, b = read.p_work[last], read.p_work[found]
    along = b - a
    size = float(along @ along)
    share = np.clip((between - a) @ along / size, 0.0, 1.0) if size > 0.0 else np.zeros(len(between))
    return float(np.linalg.norm(between - a - share[:, None] * along, axis=1).max())


def _difference_finding(line: int, k: int, place: Floats, read: Program, last: int) -> Finding:
    at = ", ".join(f"{x:.6g}" for x in place)
    close = np.flatnonzero(np.linalg.norm(read.p_work[last + 1 : last + 1 + AHEAD] - place, axis=1) <= 0.05)
    what = (
        "with another tool, spindle, axis or kind of motion"
        if len(close)
        else "nowhere: the planned program goes there"
    )
    return Finding("text-differs", line, f"the written text reaches ({at}) {what}", Severity.EXCEEDS, _place(place), k)


def _place(place: Floats) -> tuple[float, float, float]:
    return float(place[0]), float(place[1]), float(place[2])
