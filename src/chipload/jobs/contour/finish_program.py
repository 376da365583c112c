"""The finish path of a contour taken from an NC program, and the semi-finish passes written back into its text.

The level lines and arcs of the stated lines of the program are the path of the cutter's centre in the finish pass; the
wall lies R beside it, on the side that the milling says. Semi-finish passes are inserted into the text where the
program was last at a safe height before these lines: after the calls of its tool, under its work offset. All other
lines stay as they are. The new text is read again: every motion of the old one must come back, and the inserted ones
must be those of the plan.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.geometry.offset import offset
from chipload.jobs.contour.semifinish_text import inserted_lines, put_in
from chipload.machine.machine import Machine
from chipload.program.apt.reader import apt_text
from chipload.program.gcode.reader import gcode_text
from chipload.program.heidenhain.reader import heidenhain_text
from chipload.program.program import ARC_CCW, ARC_CW, LINE, RAPID, Program
from chipload.program.read import ENDINGS, Dialect, dialect_of, read_program
from chipload.simulation.centre_path import flat_motions

#: motions are level and places are the same within this [mm]
LEVEL_MM = 1e-6
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
    """The finish pass in its program.

    Parameters
    ----------
    file : of the program
    dialect : of its text
    text : of it
    program : its motions
    first, last : rows of the finish path
    safe : the last row before it at or above the top of the stock
    """

    file: Path
    dialect: Dialect
    text: str
    program: Program
    first: int
    last: int
    safe: int


def is_program(path: Path) -> bool:
    """Whether a file is an NC program or CL data, by its ending."""
    return path.suffix.lower() in ENDINGS


def read_finish(path: Path, machine: Machine, lines: Sequence[int] | None, top: float) -> FinishProgram:
    """The finish path of a program.

    Parameters
    ----------
    lines : first and last line of the text that make the wall; None: all that cut below ``top`` [mm]

    Raises
    ------
    InputError
        The program cannot be read, nothing cuts in these lines, they cut at several heights, or they do not follow one
        another.
    """
    reading = read_program(path, machine)
    p = reading.program
    z = p.p_work[:, 2]
    before = np.concatenate([z[:1], z[:-1]])
    cuts = np.isin(p.motion, (LINE, ARC_CW, ARC_CCW)) & (np.abs(z - before) <= LEVEL_MM) & (z < top - LEVEL_MM)
    cuts &= flat_lengths(p) > LEVEL_MM
    if lines is not None:
        cuts &= (p.line >= lines[0]) & (p.line <= lines[1])
    rows = np.flatnonzero(cuts)
    asked = "" if lines is None else f" in lines {lines[0]} to {lines[1]}"
    if not len(rows):
        raise InputError(f"part.file = {path.name}: no horizontal cut below the stock's top{asked}: state part.lines")
    heights = np.unique(z[rows].round(6))
    if len(heights) > 1:
        raise InputError(
            f"part.file = {path.name}: cuts at {len(heights)} heights{asked}, from {heights[0]:g} to {heights[-1]:g} "
            "mm: state the lines of one of them as part.lines"
        )
    gap = np.flatnonzero(np.diff(rows) > 1)
    if len(gap):
        k = int(rows[gap[0]])
        raise InputError(
            f"part.file = {path.name}: the cut is interrupted after line {int(p.line[k])}: state the lines of one path "
            "as part.lines"
        )
    high = np.flatnonzero(z[: rows[0]] >= top - LEVEL_MM)
    if not len(high):
        raise InputError(
            f"part.file = {path.name}: the tool is never at the height of the stock's top before the cut: "
            "check stock.top_mm"
        )
    dialect = dialect_of(path, machine)
    return FinishProgram(
        path, dialect, TEXTS.get(dialect, gcode_text)(path), p, int(rows[0]), int(rows[-1]), int(high[-1])
    )


def flat_lengths(p: Program) -> NDArray[Any]:
    """(n,) chord of every motion in the plane, or the length of a full turn [mm]."""
    seg = flat_motions(p)
    chord = np.hypot(seg[:, 2] - seg[:, 0], seg[:, 3] - seg[:, 1])
    turn = np.abs(seg[:, 6]) * np.hypot(seg[:, 0] - seg[:, 4], seg[:, 1] - seg[:, 5])
    return np.where(seg[:, 6] == 0.0, chord, turn)


def finish_contours(finish: FinishProgram, cutter: Cutter, milling: str, side: str | None) -> tuple[Contour, ...]:
    """The wall beside the finish path.

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
    right = milling == "down"
    walls = offset([path], -cutter.radius if right else cutter.radius)
    if len(walls) != 1:
        raise InputError(
            f"part.file = {finish.file.name}: the wall beside the path has {len(walls)} parts: must be one"
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


def with_semifinish(finish: FinishProgram, planned: Program, machine: Machine) -> str:
    """The text of the program with the semi-finish passes of a plan inserted.

    Raises
    ------
    InputError
        The text states modes in which the inserted lines would mean something else, or it does not read back.
    """
    found = MODES.get(finish.dialect, _MODES).search(_COMMENT.sub(" ", finish.text))
    if found is not None:
        raise InputError(f"{finish.file.name}: not written back: the text states {found[0]}")
    rows = _semifinish_rows(planned)
    p, k = finish.program, finish.safe
    line = int(p.line[k])
    ending = "\r\n" if "\r\n" in finish.text else "\n"
    new = inserted_lines(finish.dialect, planned, rows, p, k, machine.decimals)
    text = ending.join(put_in(finish.dialect, finish.text.split(ending), line, new))
    _read_back(finish, text, planned, rows, line, len(new), machine)
    return text


def _semifinish_rows(planned: Program) -> NDArray[Any]:
    """Rows of a planned program before its finish pass: a pass begins with a rapid over its start."""
    labels = np.array(planned.labels, dtype=object)[planned.label]
    finish = int(np.flatnonzero(labels == "finish")[0])
    begin = int(np.flatnonzero(planned.motion[:finish] == RAPID)[-1])
    return np.arange(begin)


def _read_back(
    finish: FinishProgram, text: str, planned: Program, rows: NDArray[np.int64], line: int, added: int, machine: Machine
) -> None:
    """Refuse a text whose old motions are not what they were, or whose new ones are not the plan's."""
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


def _rows(p: Program) -> NDArray[Any]:
    """(n, 8) motion, end [mm], middle of an arc in the plane [mm], feed [mm/s], tool.

    The middle, for the centre of a flat arc lies so far off that rounded ends move it.
    """
    seg = flat_motions(p)
    turn, (x, y) = 0.5 * seg[:, 6], (seg[:, 0:2] - seg[:, 4:6]).T
    middle = seg[:, 4:6] + np.column_stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y])
    arc = np.isin(p.motion, (ARC_CW, ARC_CCW))[:, None]
    return np.column_stack([p.motion, p.p_work, np.where(arc, middle, 0.0), p.feed, p.tool])
