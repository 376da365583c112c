"""A Program in short steps: where the tip and the axis go in each, and how long it takes.

Notation: a step is a straight piece of the tip's path on which the axis turns evenly; p [mm] tip, A unit axis. Arcs
become chords first. Row 0 of a program is where it begins and gives no step, a dwell gives none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.program.motions import is_arc, lengths, radii, spans, straightened
from chipload.program.program import DWELL, RAPID, Program

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: most that the axis turns in a step [rad]
TURN = math.radians(3.0)
#: steps that are simulated together, and rows of a program that are cut into steps at once
BLOCK, ROWS = 512, 4096


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps in columns.

    Parameters
    ----------
    p0, p1 : (n, 3) float [mm], tip at the start and the end
    a0, a1 : (n, 3) float, unit axis there
    seconds : (n,) float, at the commanded feed; 0 for a rapid
    rapid : (n,) bool
    spindle : (n,) float [rad/s], signed as in the Program
    tool, line, label : (n,) int
    """

    p0: Floats
    p1: Floats
    a0: Floats
    a1: Floats
    seconds: Floats
    rapid: NDArray[np.bool_]
    spindle: Floats
    tool: Ints
    line: Ints
    label: Ints

    def __len__(self) -> int:
        return len(self.tool)


def steps_of(program: Program, step_mm: float, chord_mm: float, turn: float = TURN) -> Steps:
    """Cut a program into steps; O(n).

    Parameters
    ----------
    step_mm : longest step of the tip [mm]
    chord_mm : how far the chords of an arc may leave it [mm]
    turn : most that the axis turns in a step [rad]

    Examples
    --------
    >>> from chipload.program.build import plunge, rapid
    >>> program = Program.join([rapid([0, 0, 0], 0, 1, "link"), plunge([9, 0, 0], 3.0, 800.0, 1, "cut")])
    >>> steps = steps_of(program, 4.0, 0.01)
    >>> steps.p1[:, 0].round(9).tolist(), steps.seconds.round(9).tolist()
    ([3.0, 6.0, 9.0], [1.0, 1.0, 1.0])
    """
    moves = _moves(program, step_mm, chord_mm, turn)
    return _cut(moves, 0, int(moves.end[-1]) if len(moves.end) else 0)


def steps_in_blocks(
    program: Program, step_mm: float, chord_mm: float, turn: float = TURN, size: int = BLOCK, first: int = 0
) -> Iterator[Steps]:
    """The steps of :func:`steps_of` from step ``first`` on, ``size`` at a time and the rest.

    Each block is made when it is asked for: memory does not grow with the program, nor with the length of its rows.
    """
    kept: list[Steps] = []
    count, skip = 0, first
    for row in range(1, len(program), ROWS):
        moves = _moves(_rows(program, row - 1, row + ROWS), step_mm, chord_mm, turn)
        whole = int(moves.end[-1]) if len(moves.end) else 0
        at = min(skip, whole)
        skip -= at
        while at < whole:
            to = min(at + size - count, whole)
            kept.append(_cut(moves, at, to))
            count, at = count + to - at, to
            if count == size:
                yield _joined(kept)
                kept, count = [], 0
    if kept:
        yield _joined(kept)


@dataclass(frozen=True, eq=False)
class StepBlocks:
    """The steps of a program, block after block, as often as they are gone through: see :func:`steps_in_blocks`."""

    program: Program
    step_mm: float
    chord_mm: float
    turn: float = TURN
    size: int = ROWS

    def __iter__(self) -> Iterator[Steps]:
        return steps_in_blocks(self.program, self.step_mm, self.chord_mm, self.turn, self.size)


def blocks_of(steps: Steps | Iterable[Steps]) -> Iterable[Steps]:
    """Blocks of steps, also where all are there."""
    return [steps] if isinstance(steps, Steps) else steps


@dataclass(frozen=True, eq=False)
class _Moves:
    """Chords of a program and into how many steps each is cut.

    Parameters
    ----------
    chords : the program with chords for arcs
    row : (m,) int, its rows that move
    parts, end : (m,) int, steps of each, and of all up to it
    angle : (n,) float [rad], by which the axis turns in each row of ``chords``
    span : (n,) float [mm or rad], what the feed of each row is counted along
    """

    chords: Program
    row: Ints
    parts: Ints
    end: Ints
    angle: Floats
    span: Floats


def _moves(program: Program, step_mm: float, chord_mm: float, turn: float) -> _Moves:
    for name, value in (("step_mm", step_mm), ("chord_mm", chord_mm), ("turn", turn)):
        if not 0.0 < value < math.inf:
            raise InputError(f"steps: {name} = {value:g}: must be above 0")
    r = radii(program)
    most = np.full(len(program), np.inf)
    bent = is_arc(program) & (r > 0.0)
    most[bent] = np.maximum(2.0 * np.arccos(1.0 - np.minimum(chord_mm / r[bent], 1.0)), 1e-3)
    chords = straightened(program, most)
    length = lengths(chords)
    angle = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(np.diff(chords.axis, axis=0), axis=1), 1.0))
    angle = np.concatenate([np.zeros(min(len(chords), 1)), angle])
    moving = (chords.motion != DWELL) & ((length > 0.0) | (angle > 0.0))
    moving[:1] = False
    row = np.flatnonzero(moving)
    parts = np.maximum(np.ceil(length / step_mm - 1e-9), np.ceil(angle / turn - 1e-9)).astype(np.int64).clip(1)[row]
    return _Moves(chords, row, parts, np.cumsum(parts), angle, spans(chords))


def _cut(moves: _Moves, first: int, end: int) -> Steps:
    """Steps ``first`` to ``end`` of some moves."""
    chords = moves.chords
    number = np.arange(first, end)
    which = np.searchsorted(moves.end, number, "right")
    at, parts = moves.row[which], moves.parts[which]
    k = number - (moves.end - moves.parts)[which]
    u0, u1 = k / parts, (k + 1) / parts
    p0, p1, a0, a1 = chords.p_work[at - 1], chords.p_work[at], chords.axis[at - 1], chords.axis[at]
    rapid = chords.motion[at] == RAPID
    with np.errstate(divide="ignore", invalid="ignore"):
        seconds = np.where(rapid, 0.0, moves.span[at] / chords.feed[at])
    return Steps(
        _line(p0, p1, u0),
        _line(p0, p1, u1),
        _turned(a0, a1, moves.angle[at], u0),
        _turned(a0, a1, moves.angle[at], u1),
        seconds / parts,
        rapid,
        chords.spindle[at],
        chords.tool[at],
        chords.line[at],
        chords.label[at],
    )


def _rows(program: Program, first: int, end: int) -> Program:
    """Some rows; the first is only where they begin."""
    columns = {f.name: getattr(program, f.name)[first:end] for f in fields(Program) if f.name != "labels"}
    columns["motion"] = np.concatenate([[RAPID], columns["motion"][1:]])
    return Program(**columns, labels=program.labels)


def _joined(some: list[Steps]) -> Steps:
    if len(some) == 1:
        return some[0]
    return Steps(**{f.name: np.concatenate([getattr(s, f.name) for s in some]) for f in fields(Steps)})


def _line(begin: Floats, end: Floats, u: Floats) -> Floats:
    return np.where(u[:, None] == 1.0, end, begin + u[:, None] * (end - begin))


def _turned(begin: Floats, end: Floats, angle: Floats, u: Floats) -> Floats:
    """(n, 3) axes along great circles."""
    small = angle < 1e-12
    over = np.where(small, 1.0, np.sin(angle))
    out = (np.sin((1.0 - u) * angle) / over)[:, None] * begin + (np.sin(u * angle) / over)[:, None] * end
    out = np.where((small | (u == 1.0))[:, None], end, np.where((u == 0.0)[:, None], begin, out))
    return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])
