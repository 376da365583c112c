"""Division of a Program into short steps, with tip, axis and time of each.

Notation: a step is a straight piece of the tip's path on which the axis turns evenly; p [mm] tip, A unit axis. Arcs
become chords first. Row 0 of a program is where it begins and gives no step, a dwell gives none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.program.motions import is_arc, lengths, radii, spans, straighten_arcs
from chipload.program.path_mode import PathControl
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
    seconds : (n,) float, at the commanded feed; 0 for a rapid. What chips and loads go by
    rapid : (n,) bool; so counts a feed with the spindle at rest, which goes through material without a chip
    spindle : (n,) float [rad/s], signed as in the Program
    tool, line, label : (n,) int
    duration : (n,) float [s], on the machine: rapids, accelerations and, in the step before it, a dwell included; None:
        as ``seconds``
    wait : (n,) float [s], what of the duration the machine stands after the step, as in a dwell; None: nothing
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
    duration: Floats = None  # type: ignore[assignment]
    wait: Floats = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.duration is None:
            object.__setattr__(self, "duration", self.seconds)
        if self.wait is None:
            object.__setattr__(self, "wait", np.zeros(len(self.seconds)))

    def __len__(self) -> int:
        return len(self.tool)


def steps_of(
    program: Program, step_mm: float, chord_mm: float, turn: float = TURN, times: Floats | None = None
) -> Steps:
    """Divide a program into steps; O(n).

    Parameters
    ----------
    step_mm : longest step of the tip [mm]
    chord_mm : how far the chords of an arc may leave it [mm]
    turn : most that the axis turns in a step [rad]
    times : (n,) float [s], time of each row on the machine, which its steps share by length; None: at
        the commanded feed

    Examples
    --------
    >>> from chipload.program.build import plunge, rapid
    >>> program = Program.join([rapid([0, 0, 0], 0, 1, "link"), plunge([9, 0, 0], 3.0, 800.0, 1, "cut")])
    >>> steps = steps_of(program, 4.0, 0.01)
    >>> steps.p1[:, 0].round(9).tolist(), steps.seconds.round(9).tolist()
    ([3.0, 6.0, 9.0], [1.0, 1.0, 1.0])
    """
    moves = _moves(program, step_mm, chord_mm, turn, None if times is None else _on_moves(program, times))
    return _cut(moves, 0, int(moves.end[-1]) if len(moves.end) else 0)


def steps_in_blocks(
    program: Program,
    step_mm: float,
    chord_mm: float,
    turn: float = TURN,
    size: int = BLOCK,
    first: int = 0,
    times: Floats | None = None,
) -> Iterator[Steps]:
    """Yield the steps of :func:`steps_of` from step ``first`` on in blocks of ``size``.

    Each block is made when it is asked for: memory does not grow with the program, nor with the length of its rows.
    """
    kept: list[Steps] = []
    count, skip = 0, first
    timed = None if times is None else _on_moves(program, times)
    for row in range(1, len(program), ROWS):
        part = None if timed is None else timed[row - 1 : row + ROWS]
        moves = _moves(_rows(program, row - 1, row + ROWS), step_mm, chord_mm, turn, part)
        whole = int(moves.end[-1]) if len(moves.end) else 0
        at = min(skip, whole)
        skip -= at
        while at < whole:
            to = min(at + size - count, whole)
            kept.append(_cut(moves, at, to))
            count, at = count + to - at, to
            if count == size:
                yield _join_steps(kept)
                kept, count = [], 0
    if kept:
        yield _join_steps(kept)


def number_of_steps(program: Program, step_mm: float, chord_mm: float, turn: float = TURN) -> int:
    """Return the number of steps of :func:`steps_of` without making them; O(rows)."""
    return sum(
        int(_moves(_rows(program, row - 1, row + ROWS), step_mm, chord_mm, turn, None).parts.sum())
        for row in range(1, len(program), ROWS)
    )


@dataclass(frozen=True, eq=False)
class StepBlocks:
    """The steps of a program in blocks, which can be iterated several times: see :func:`steps_in_blocks`."""

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
    """Chords of a program and the number of steps of each.

    Parameters
    ----------
    chords : the program with chords for arcs
    row : (m,) int, its rows that move
    parts, end : (m,) int, steps of each, and of all up to it
    angle : (n,) float [rad], by which the axis turns in each row of ``chords``
    span : (n,) float [mm or rad], what the feed of each row is counted along
    timed : (n, 2) float [s], time of each row of ``chords`` on the machine and the wait after it; None: not known
    """

    chords: Program
    row: Ints
    parts: Ints
    end: Ints
    angle: Floats
    span: Floats
    timed: Floats | None


def _on_moves(program: Program, times: Floats) -> Floats:
    """(n, 2) times of rows that move, and waits after them: times of rows that do not go to the row before.

    Where there is none they go to the first that moves.
    """
    if times.shape != (len(program),):
        raise InputError(f"steps: times {times.shape}: must be ({len(program)},), one for each row of the program")
    moving = moving_rows(program)
    where = np.flatnonzero(moving)
    out = np.zeros((len(program), 2))
    if len(where):
        out[where, 0] = times[where]
        idle = np.flatnonzero(~moving)
        to = where[np.maximum(np.searchsorted(where, idle) - 1, 0)]
        np.add.at(out[:, 1], to, times[idle])
    return out


def moving_rows(program: Program) -> NDArray[np.bool_]:
    """Return a mask (n,) of the rows of a program that have steps; one from an unknown place has none."""
    moving = (program.motion != DWELL) & ((lengths(program) > 0.0) | (_angles(program) > 0.0))
    moving &= np.asarray(program.path_mode)[:, 0] != PathControl.UNPLACED
    moving[:1] = False
    return np.asarray(moving)


def _angles(program: Program) -> Floats:
    """Return the angle (n,) by which the axis turns in each row [rad]."""
    angle = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(np.diff(program.axis, axis=0), axis=1), 1.0))
    return np.concatenate([np.zeros(min(len(program), 1)), angle])


def _chord_times(program: Program, chords: Program, most: Floats, timed: Floats) -> Floats:
    """(m, 2) times and waits of chords, from those of the rows (n, 2) that they are of."""
    row = straighten_arcs(replace(program, line=np.arange(len(program))), most).line
    span, turned = lengths(chords), _angles(chords)
    weight = np.where(np.bincount(row, span, len(program))[row] > 0.0, span, turned)
    whole = np.bincount(row, weight, len(program))[row]
    last = np.append(row[1:] != row[:-1], True)
    share = np.where(whole > 0.0, weight / np.where(whole > 0.0, whole, 1.0), 0.0)
    return np.column_stack([timed[row, 0] * share, np.where(last, timed[row, 1], 0.0)])


def _moves(program: Program, step_mm: float, chord_mm: float, turn: float, timed: Floats | None) -> _Moves:
    for name, value in (("step_mm", step_mm), ("chord_mm", chord_mm), ("turn", turn)):
        if not 0.0 < value < math.inf:
            raise InputError(f"steps: {name} = {value:g}: must be above 0")
    r = radii(program)
    most = np.full(len(program), np.inf)
    bent = is_arc(program) & (r > 0.0)
    most[bent] = np.maximum(2.0 * np.arccos(1.0 - np.minimum(chord_mm / r[bent], 1.0)), 1e-3)
    chords = straighten_arcs(program, most)
    length, angle = lengths(chords), _angles(chords)
    row = np.flatnonzero(moving_rows(chords))
    if timed is not None:
        timed = _chord_times(program, chords, most, timed)
    parts = np.maximum(np.ceil(length / step_mm - 1e-9), np.ceil(angle / turn - 1e-9)).astype(np.int64).clip(1)[row]
    return _Moves(chords, row, parts, np.cumsum(parts), angle, spans(chords), timed)


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
    duration, wait = seconds / parts, np.zeros(len(at))
    if moves.timed is not None:
        wait = np.where(k == parts - 1, moves.timed[at, 1], 0.0)
        duration = moves.timed[at, 0] / parts + wait
    return Steps(
        _line(p0, p1, u0),
        _line(p0, p1, u1),
        _turn_axes(a0, a1, moves.angle[at], u0),
        _turn_axes(a0, a1, moves.angle[at], u1),
        seconds / parts,
        rapid | (chords.spindle[at] == 0.0),
        chords.spindle[at],
        chords.tool[at],
        chords.line[at],
        chords.label[at],
        duration,
        wait,
    )


def _rows(program: Program, first: int, end: int) -> Program:
    """Some rows; the first is only where they begin."""
    columns = {f.name: getattr(program, f.name)[first:end] for f in fields(Program) if f.name != "labels"}
    columns["motion"] = np.concatenate([[RAPID], columns["motion"][1:]])
    return Program(**columns, labels=program.labels)


def _join_steps(some: list[Steps]) -> Steps:
    if len(some) == 1:
        return some[0]
    return Steps(**{f.name: np.concatenate([getattr(s, f.name) for s in some]) for f in fields(Steps)})


def _line(begin: Floats, end: Floats, u: Floats) -> Floats:
    return np.where(u[:, None] == 1.0, end, begin + u[:, None] * (end - begin))


def _turn_axes(begin: Floats, end: Floats, angle: Floats, u: Floats) -> Floats:
    """Return axes (n, 3) along great circles."""
    if not angle.any():
        return np.asarray(end / np.linalg.norm(end, axis=1)[:, None])
    small = angle < 1e-12
    over = np.where(small, 1.0, np.sin(angle))
    out = (np.sin((1.0 - u) * angle) / over)[:, None] * begin + (np.sin(u * angle) / over)[:, None] * end
    out = np.where((small | (u == 1.0))[:, None], end, np.where((u == 0.0)[:, None], begin, out))
    return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])


def step_boxes(steps: Steps, cutters: Mapping[int, Cutter]) -> tuple[Floats, Floats]:
    """(n, 3), (n, 3) corners of boxes that the cutter does not leave, as the axis turns by a few degrees in a step."""
    p0, p1, a0, a1, tools = steps.p0, steps.p1, steps.a0, steps.a1, steps.tool
    top, wide = np.empty((len(steps), 1)), np.empty((len(steps), 1))
    for tool in np.unique(tools).tolist():
        c = cutters[tool]
        top[tools == tool] = c.flute_length
        wide[tools == tool] = max(c.radius, float(c.radius_at([c.flute_length])[0]))
    ends = np.array([p0, p1, p0 + top * a0, p1 + top * a1])
    # the top of the cutter leaves its chord by the sagitta of the turn, and each circle reaches R across the axis
    turn = np.linalg.norm(a1 - a0, axis=1)[:, None]
    lean = np.sqrt(np.maximum(1.0 - np.minimum(a0, a1) ** 2, 1.0 - np.maximum(a0, a1) ** 2))
    reach = wide * np.minimum(lean + turn, 1.0) + top * turn**2
    return np.asarray(ends.min(axis=0) - reach), np.asarray(ends.max(axis=0) + reach)


def rows_of_steps(steps: Steps, rows: Ints) -> Steps:
    """Return some of the steps."""
    return Steps(**{f.name: getattr(steps, f.name)[rows] for f in fields(Steps)})
