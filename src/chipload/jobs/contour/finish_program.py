"""The finish path of a contour taken from an NC program, and the semi-finish passes written back into its text.

The level lines and arcs of the stated lines of the program are the path of the cutter's centre in the finish pass; the
wall lies R to the side that the milling states. A program may finish a wall at several heights, from above:
each is a level of its own, as deep as it lies below the one before. Semi-finish passes are inserted into the text where
the program was last at a safe height before a level: after the calls of its tool, under its work offset. All other
lines stay as they are. The new text is read again: every motion of the old one must come back, and the inserted ones
must be those of the plan.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.geometry.distance import distance
from chipload.geometry.offset import offset
from chipload.jobs.contour.semifinish_text import inserted_lines, put_in
from chipload.machine.machine import Machine
from chipload.planning.hand import Milling, clockwise_milling
from chipload.program.apt.reader import apt_text
from chipload.program.gcode.reader import gcode_text
from chipload.program.heidenhain.reader import heidenhain_text
from chipload.program.program import ARC_CCW, ARC_CW, LINE, RAPID, Program
from chipload.program.read import ENDINGS, Dialect, dialect_of, read_program
from chipload.simulation.centre_path import flat_motions

#: motions are level and places are the same within this [mm]
LEVEL_MM = 1e-6
#: how far a level may come nearer than R to the wall of one above, the rounding of its text; spacing of checks [mm]
NEAR_MM, APART_MM = 2e-3, 0.1
#: modes in which the inserted lines would mean something else
_MODES = re.compile(r"(?<![A-Za-z_])[gG]\s*0*(20|70|91|90\.1|41|42|41\.1|42\.1|51|68|16)(?![\d.])")
#: the same in conversational text and in CL data
MODES = {
    "heidenhain": re.compile(r"\bR[LR]\b(?!\d)|\bINCH\b|CYCL DEF (?:7|8|10|11|19|26)\b|\bPLANE [A-Z]+|TRANS DATUM"),
    "apt": re.compile(r"UNITS\s*/\s*IN|TRACUT|COPY/|CUTCOM\s*/\s*(?:LEFT|RIGHT)|MULTAX\s*/?\s*ON", re.IGNORECASE),
}
#: what reads the text of a file
TEXTS: Mapping[str, Callable[[Path], str]] = {"apt": apt_text, "heidenhain": heidenhain_text}
_COMMENT = re.compile(r"\([^)\n]*\)|;[^\n]*")


@dataclass(frozen=True, eq=False)
class FinishProgram:
    """The finish pass of one level in its program.

    Parameters
    ----------
    file : of the program
    dialect : of its text
    text : of it
    program : its motions
    first, last : rows of the finish path
    safe : the last row before it at or above the top of the stock
    top, floor : heights [mm] between which it finishes the wall
    """

    file: Path
    dialect: Dialect
    text: str
    program: Program
    first: int
    last: int
    safe: int
    top: float
    floor: float


def is_program(path: Path) -> bool:
    """Whether a file is an NC program or CL data, by its ending."""
    return path.suffix.lower() in ENDINGS


def read_finish(
    path: Path, machine: Machine, lines: Sequence[int], labels: Sequence[str], top: float
) -> tuple[FinishProgram, ...]:
    """The levels of the finish path of a program, from above.

    Parameters
    ----------
    lines : first and last line of the text that make the wall, of one level after the other; none: all that cut below
        ``top`` [mm]
    labels : in place of lines, a text behind which the wall begins, and one before which it ends; with the first alone
        it ends where the cut does

    Raises
    ------
    InputError
        The program cannot be read, nothing cuts in these lines, levels do not lie one below the other, or the cut is
        interrupted.
    """
    p = read_program(path, machine).program
    dialect = dialect_of(path, machine)
    text = TEXTS.get(dialect, gcode_text)(path)
    z = p.p_work[:, 2]
    before = np.concatenate([z[:1], z[:-1]])
    cuts = np.isin(p.motion, (LINE, ARC_CW, ARC_CCW)) & (np.abs(z - before) <= LEVEL_MM) & (z < top - LEVEL_MM)
    cuts &= flat_lengths(p) > LEVEL_MM
    runs: list[NDArray[np.int64]] = []
    if labels:
        ranges = _lines_between_labels(path, text, labels)
    else:
        ranges = list(zip(lines[0::2], lines[1::2], strict=True)) or [(0, int(p.line.max(initial=0)))]
    for first, last in ranges:
        rows = np.flatnonzero(cuts & (p.line >= first) & (p.line <= last))
        if not len(rows):
            line_range = f" in lines {first} to {last}" if lines or labels else ""
            raise InputError(
                f"part.file = {path.name}: no horizontal cut below the stock's top{line_range}: state part.lines"
            )
        ends = np.flatnonzero((np.diff(rows) > 1) | (np.abs(np.diff(z[rows])) > LEVEL_MM)) + 1
        found = np.split(rows, ends)
        runs += found[:1] if len(labels) == 1 else found
    return tuple(
        FinishProgram(path, dialect, text, p, int(run[0]), int(run[-1]), safe, above, floor)
        for run, (safe, above, floor) in zip(runs, _heights(path, p, runs, top), strict=True)
    )


def _heights(path: Path, p: Program, runs: Sequence[NDArray[np.int64]], top: float) -> list[tuple[int, float, float]]:
    """The last row at a safe height before each level, and the heights [mm] between which it cuts."""
    z, above, out = p.p_work[:, 2], top, []
    for k, run in enumerate(runs):
        floor, line = float(z[run[0]]), int(p.line[run[0]])
        if k and abs(floor - above) <= LEVEL_MM:
            raise InputError(
                f"part.file = {path.name}: the cut is interrupted after line {int(p.line[runs[k - 1][-1]])}: state the "
                "lines of one path a level as part.lines"
            )
        if floor > above:
            raise InputError(
                f"part.file = {path.name}: line {line} cuts at {floor:g} mm, above the level before it at {above:g}: "
                "state the lines of one path a level, from above, as part.lines"
            )
        high = np.flatnonzero(z[: run[0]] >= top - LEVEL_MM)
        if not len(high):
            raise InputError(
                f"part.file = {path.name}: the tool is never at the height of the stock's top before the cut: "
                "check stock.top_mm"
            )
        out.append((int(high[-1]), above, floor))
        above = floor
    return out


def _lines_between_labels(path: Path, text: str, labels: Sequence[str]) -> list[tuple[int, int]]:
    """First and last line between each pair of labels; a label is found as a whole word."""
    lines = text.splitlines()
    places = [
        [
            k
            for k, line in enumerate(lines, start=1)
            if re.search(rf"(?<!\w){re.escape(label)}(?!\w)", line, re.IGNORECASE)
        ]
        for label in labels
    ]
    for label, found in zip(labels, places, strict=True):
        if not found:
            raise InputError(f"part.labels: no line of {path.name} holds {label!r}: state a label that stands in it")
    begins = [n for n in places[0] if n not in places[-1] or len(labels) == 1]
    if len(labels) == 1:
        return list(zip(begins, [*(k - 1 for k in begins[1:]), len(lines)], strict=True))
    out = []
    for k, first in enumerate(begins):
        after = [n for n in places[1] if n > first and (k + 1 == len(begins) or n <= begins[k + 1])]
        if not after:
            raise InputError(
                f"part.labels: no line of {path.name} behind line {first} holds {labels[1]!r}: state where the wall "
                "ends"
            )
        out.append((first, after[0]))
    return out


def flat_lengths(p: Program) -> NDArray[Any]:
    """Chord of every motion in the plane, or the length of a full turn, (n,) [mm]."""
    seg = flat_motions(p)
    chord = np.hypot(seg[:, 2] - seg[:, 0], seg[:, 3] - seg[:, 1])
    turn = np.abs(seg[:, 6]) * np.hypot(seg[:, 0] - seg[:, 4], seg[:, 1] - seg[:, 5])
    return np.where(seg[:, 6] == 0.0, chord, turn)


def finish_contours(finish: FinishProgram, cutter: Cutter, milling: Milling, side: str | None) -> tuple[Contour, ...]:
    """The wall next to the finish path.

    Raises
    ------
    InputError
        Another cutter cuts the path, the side is not that of the milling, or the cutter cannot make a wall there.
    """
    p = finish.program
    number = int(p.tool[finish.first])
    if number != cutter.number:
        raise InputError(
            f"part.file = {finish.file.name}: line {int(p.line[finish.first])} is cut by tool {number}, the operation "
            f"has cutter = {cutter.number}: state cutter = {number}"
        )
    path = Contour(flat_motions(p)[finish.first : finish.last + 1])
    right = clockwise_milling(milling, cutter) == "down"
    walls = offset([path], -cutter.radius if right else cutter.radius)
    if len(walls) != 1:
        raise InputError(
            f"part.file = {finish.file.name}: the wall next to the path has {len(walls)} parts: must have one"
        )
    sides = (
        ("left", "right") if not path.closed else ("inside", "outside") if path.area > 0.0 else ("outside", "inside")
    )
    wanted = sides[0 if right else 1]
    if side != wanted:
        raise InputError(
            f"operation.side = {side!r}: the path of {finish.file.name} with milling = {milling!r} is on the {wanted} "
            f"of its wall: state side = {wanted!r}"
        )
    return walls


def require_reached(levels: Sequence[FinishProgram], walls: Sequence[Sequence[Contour]], cutter: Cutter) -> None:
    """Refuse levels that cut into the wall of a level above.

    Raises
    ------
    InputError
        The path of a level comes nearer to such a wall than R.
    """
    for k, level in enumerate(levels):
        path = Contour(flat_motions(level.program)[level.first : level.last + 1])
        points = path.at(np.linspace(0.0, path.length, max(2, int(path.length / APART_MM))))[0]
        for above, wall in zip(levels[:k], walls[:k], strict=True):
            away = distance(np.vstack([c.segments for c in wall]), points)
            at = int(away.argmin())
            if away[at] < cutter.radius - NEAR_MM:
                x, y = points[at].tolist()
                raise InputError(
                    f"part.file = {level.file.name}: at {level.floor:g} mm the cutter comes within {away[at]:.4g} mm "
                    f"of the wall at {above.floor:g} mm, at ({x:.4g}, {y:.4g}): must be its radius, {cutter.radius:g}: "
                    "state the lines of one wall as part.lines"
                )


def with_semifinish(levels: Sequence[FinishProgram], planned: Sequence[Program], machine: Machine) -> str:
    """The text of the program with the semi-finish passes of the plan of each level inserted.

    Raises
    ------
    InputError
        The text states modes in which the inserted lines would mean something else, or it does not read back.
    """
    text, program = levels[0].text, levels[0].program
    for level, plan in reversed(list(zip(levels, planned, strict=True))):  # what stands above keeps its lines and rows
        text, program = _with_level(replace(level, text=text, program=program), plan, machine)
    return text


def _with_level(finish: FinishProgram, planned: Program, machine: Machine) -> tuple[str, Program]:
    """The text with the semi-finish passes of one level, and its motions."""
    found = MODES.get(finish.dialect, _MODES).search(_COMMENT.sub(" ", finish.text))
    if found is not None:
        raise InputError(f"{finish.file.name}: not written back: the program contains {found[0]}")
    rows = _semifinish_rows(planned)
    p, k = finish.program, finish.safe
    line = int(p.line[k])
    ending = "\r\n" if "\r\n" in finish.text else "\n"
    new = inserted_lines(finish.dialect, planned, rows, p, k, machine.decimals)
    text = ending.join(put_in(finish.dialect, finish.text.split(ending), line, new))
    return text, _read_back(finish, text, planned, rows, line, len(new), machine)


def _semifinish_rows(planned: Program) -> NDArray[Any]:
    """Rows of a planned program before its finish pass: a pass begins with a rapid over its start."""
    labels = np.array(planned.labels, dtype=object)[planned.label]
    finish = int(np.flatnonzero(labels == "finish")[0])
    begin = int(np.flatnonzero(planned.motion[:finish] == RAPID)[-1])
    return np.arange(begin)


def _read_back(
    finish: FinishProgram, text: str, planned: Program, rows: NDArray[np.int64], line: int, added: int, machine: Machine
) -> Program:
    """The motions of the new text; refused where old ones are not what they were, or new ones not the plan's."""
    again = read_program(finish.file, machine, text=text).program
    inserted = (again.line > line) & (again.line <= line + added)
    old = finish.program
    kept = _rows(again)[~inserted]
    coarse = 2.0 * 10.0**-machine.decimals
    if len(kept) != len(old) or np.abs(kept - _rows(old)).max(initial=0.0) > coarse:
        raise InputError(f"{finish.file.name}: not written back: its own motions would change")
    new = _rows(again)[inserted]
    wanted = _rows(planned)[rows]
    cutting = new[np.isin(new[:, 0], (LINE, ARC_CW, ARC_CCW))]
    wanted = wanted[wanted[:, 0] != RAPID]
    if len(cutting) < len(wanted) or np.abs(cutting[: len(wanted)] - wanted).max(initial=0.0) > coarse:
        raise InputError(f"{finish.file.name}: not written back: the inserted passes do not read as planned")
    return again


def _rows(p: Program) -> NDArray[Any]:
    """(n, 8) motion, end [mm], middle of an arc in the plane [mm], feed [mm/s], tool.

    The middle, for the centre of a flat arc lies so far off that rounded ends move it.
    """
    seg = flat_motions(p)
    turn, (x, y) = 0.5 * seg[:, 6], (seg[:, 0:2] - seg[:, 4:6]).T
    middle = seg[:, 4:6] + np.column_stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y])
    arc = np.isin(p.motion, (ARC_CW, ARC_CCW))[:, None]
    return np.column_stack([p.motion, p.p_work, np.where(arc, middle, 0.0), p.feed, p.tool])
