"""Dwells, program stops, a spindle that is stopped, and the end of a program while the cutter is in the cut.

Where a cutter stands in the cut is stated in :mod:`~chipload.simulation.remaining_stock`. What a canned cycle does
within its own line is meant so: G82 dwells at the bottom, G86 stops the spindle there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.program.program import DWELL, Program
from chipload.simulation.remaining_stock import Inside, Standstill, in_cut, stands_in
from chipload.simulation.steps import StepBlocks
from chipload.simulation.tool_change import retract_needed

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: a dwell of up to so many seconds on the bottom of an axial cut makes the bottom flat
BOTTOM_S = 1.0
#: most places of a program that are looked at for a code
MOST = 500
#: a motion is axial if it goes down the axis by at least this share of its length
AXIAL = 0.999


@dataclass(frozen=True, eq=False)
class _Event:
    """Something that happens behind a row; ``finding`` is made if the cutter stands in the cut."""

    row: int
    finding: Finding


def stop_findings(
    program: Program,
    steps: StepBlocks,
    columns: Mapping[str, NDArray[Any]],
    cutters: Mapping[int, Cutter],
    inside: Inside,
    box: tuple[Floats, Floats],
    stops: Sequence[int] = (),
    retractions: Iterable[int] = (),
    ends: bool = True,
) -> tuple[Finding, ...]:
    """Return findings on what happens while the cutter is in the cut, the first of each code.

    Codes: ``spindle-stopped-in-cut`` and ``ends-in-cut`` (exceeds), ``dwell-in-cut``, ``stop-in-cut`` and
    ``ends-in-stock`` (unproven).

    Parameters
    ----------
    steps : of the program, one for each row of ``columns``
    columns : of the removal
    cutters : by tool
    inside : which points (m, 3) are in the initial stock
    box : its corners, (3,) float [mm] each
    stops : lines at which the program stops (M0, M1)
    retractions : lines that retract to a position of the machine which is not known, and so have no row
    ends : whether the program ends behind its last row
    """
    last = _last_steps(program, steps)
    away = np.unique(np.fromiter(retractions, dtype=np.int64))
    events = [
        *_spindle_stops(program, away),
        *(_end(program) if ends and not (away >= program.line[-1]).any() else ()),
        *_dwells(program),
        *_stops(program, stops, away),
    ]
    places, judged = [], []
    counted: dict[str, int] = {}
    for event in events:
        place, axial = _place(program, columns, cutters, last, event.row)
        code = event.finding.code
        if (
            place is None
            or counted.get(code, 0) >= MOST
            or (code == "dwell-in-cut" and axial and _short(program, event))
        ):
            continue
        counted[code] = counted.get(code, 0) + 1
        places.append(place)
        judged.append(event)
    found: dict[str, Finding] = {}
    for event, cuts in zip(judged, in_cut(places, steps, cutters, inside), strict=True):
        if cuts:
            x, y, z = (float(v) for v in program.p_work[event.row])
            found.setdefault(event.finding.code, replace(event.finding, place=(x, y, z), row=int(last[event.row]) - 1))
    if ends and "ends-in-cut" not in found and not (away >= program.line[-1]).any():
        found |= _in_stock(program, cutters, inside, box)
    return tuple(found.values())


def _last_steps(program: Program, steps: StepBlocks) -> Ints:
    """Number of steps up to the end of each row (n,)."""
    count = np.zeros(len(program), dtype=np.int64)
    rows = replace(steps, program=replace(program, line=np.arange(len(program))))
    for block in rows:
        count += np.bincount(block.line, minlength=len(program))
    return np.cumsum(count)


def _place(
    program: Program,
    columns: Mapping[str, NDArray[Any]],
    cutters: Mapping[int, Cutter],
    last: Ints,
    row: int,
) -> tuple[Standstill | None, bool]:
    """Where the cutter stands behind a row if its last step cut, and whether that went along the axis."""
    k, number = int(last[row]) - 1, int(program.tool[row])
    if k < 0 or number not in cutters or cutters[number].body:
        return None, False
    if columns["rapid"][k] or not columns["chip_volume_mm3"][k] > 0.0 or int(columns["tool"][k]) != number:
        return None, False
    tip, axis = np.asarray(program.p_work[row]), np.asarray(program.axis[row])
    # each step begins where the one before it ends, the first where the program begins
    d = tip - (np.array([columns[f"{x}_mm"][k - 1] for x in "xyz"]) if k > 0 else np.asarray(program.p_work[0]))
    length = float(np.linalg.norm(d))
    if length == 0.0:
        return None, False
    return Standstill(k + 1, tip, axis, cutters[number], d / length), bool(-(d @ axis) >= AXIAL * length)


def _spindle_stops(program: Program, away: Ints) -> list[_Event]:
    """Rows behind which the spindle is stopped, other than within the line of a cycle."""
    stopped = (program.spindle[1:] == 0.0) & (program.spindle[:-1] != 0.0)
    stopped &= (program.line[1:] != program.line[:-1]) | (program.line[1:] == 0)
    text = "the spindle is stopped while the cutter is in the cut: retract it before"
    return [
        _Event(k, Finding("spindle-stopped-in-cut", int(program.line[k]), text, Severity.EXCEEDS))
        for k in np.flatnonzero(stopped).tolist()
        if not _retracts_between(away, program, k)
    ]


def _end(program: Program) -> list[_Event]:
    text = "the program ends while the cutter is in the cut: retract it before the end"
    k = len(program) - 1
    return [_Event(k, Finding("ends-in-cut", int(program.line[k]), text, Severity.EXCEEDS))]


def _in_stock(
    program: Program, cutters: Mapping[int, Cutter], inside: Inside, box: tuple[Floats, Floats]
) -> dict[str, Finding]:
    """The finding that a program ends with its tool where the stock was."""
    number, tip, axis = int(program.tool[-1]), np.asarray(program.p_work[-1]), np.asarray(program.axis[-1])
    if number not in cutters or not stands_in(inside, cutters[number], tip, axis):
        return {}
    by = retract_needed(tip, axis, cutters[number].radius, cutters[number].overhang, *box)
    if by <= 0.0:
        return {}
    x, y, z = (float(v) for v in tip)
    text = (
        f"the program ends with tool {number} at X{x:.6g} Y{y:.6g} Z{z:.6g}, {by:.4g} mm inside the stock along its "
        "axis: what the machine does next is not known: retract it before the end"
    )
    line = int(program.line[-1])
    return {"ends-in-stock": Finding("ends-in-stock", line, text, Severity.UNPROVEN, (x, y, z))}


def _dwells(program: Program) -> list[_Event]:
    """Dwells of a line of their own."""
    rows = np.flatnonzero((program.motion == DWELL) & (program.feed > 0.0))
    out = []
    for k in rows.tolist():
        if k == 0 or (program.line[k] == program.line[k - 1] != 0):
            continue
        text = (
            f"a dwell of {program.feed[k]:g} s in the cut: the edges rub, and a mark is left: retract, or leave it out"
        )
        out.append(_Event(k, Finding("dwell-in-cut", int(program.line[k]), text, Severity.UNPROVEN)))
    return out


def _short(program: Program, event: _Event) -> bool:
    """Whether a dwell only flattens the bottom of an axial cut."""
    return bool(program.feed[event.row] <= BOTTOM_S)


def _stops(program: Program, stops: Sequence[int], away: Ints) -> list[_Event]:
    """Rows behind which the program stops for its operator."""
    out, line = [], np.asarray(program.line)
    text = (
        "the program stops (M0, M1) while the cutter is in the cut: on many machines the spindle stops with it: "
        "retract the cutter before"
    )
    for stop in sorted(set(stops)):
        before = (line <= stop) & (np.append(line[1:], math.inf) > stop)
        out += [
            _Event(k, Finding("stop-in-cut", int(stop), text, Severity.UNPROVEN))
            for k in np.flatnonzero(before).tolist()
            if not ((away >= line[k]) & (away <= stop)).any()
        ]
    return out


def _retracts_between(away: Ints, program: Program, k: int) -> bool:
    """Whether a retraction without a row stands between row k and the next."""
    return bool(((away >= program.line[k]) & (away <= program.line[k + 1])).any())
