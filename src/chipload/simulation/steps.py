"""A Program in short steps: where the tip and the axis go in each, and how long it takes.

Notation: a step is a straight piece of the tip's path on which the axis turns evenly; p [mm] tip, A unit axis. Arcs
become chords first. Row 0 of a program is where it begins and gives no step, a dwell gives none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.program.motions import is_arc, lengths, radii, spans, starts, straightened
from chipload.program.program import DWELL, RAPID, Program

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


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


def steps_of(program: Program, step_mm: float, chord_mm: float, turn: float = math.radians(3.0)) -> Steps:
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
    for name, value in (("step_mm", step_mm), ("chord_mm", chord_mm), ("turn", turn)):
        if not 0.0 < value < math.inf:
            raise InputError(f"steps: {name} = {value:g}: must be above 0")
    r = radii(program)
    most = np.full(len(program), np.inf)
    bent = is_arc(program) & (r > 0.0)
    most[bent] = np.maximum(2.0 * np.arccos(1.0 - np.minimum(chord_mm / r[bent], 1.0)), 1e-3)
    chords = straightened(program, most)
    p0, p1 = starts(chords), np.asarray(chords.p_work)
    a1 = np.asarray(chords.axis)
    a0 = np.vstack([a1[:1], a1[:-1]])
    length, span = lengths(chords), spans(chords)
    angle = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(a1 - a0, axis=1), 1.0))
    moves = (chords.motion != DWELL) & ((length > 0.0) | (angle > 0.0))
    moves[:1] = False
    row = np.flatnonzero(moves)
    parts = np.maximum(np.ceil(length / step_mm - 1e-9), np.ceil(angle / turn - 1e-9)).astype(np.int64).clip(1)[row]
    at = np.repeat(row, parts)
    k = np.arange(len(at)) - np.repeat(np.cumsum(parts) - parts, parts)
    u0, u1 = k / np.repeat(parts, parts), (k + 1) / np.repeat(parts, parts)
    rapid = chords.motion == RAPID
    with np.errstate(divide="ignore", invalid="ignore"):
        seconds = np.where(rapid, 0.0, span / chords.feed)
    return Steps(
        _line(p0[at], p1[at], u0),
        _line(p0[at], p1[at], u1),
        _turned(a0[at], a1[at], angle[at], u0),
        _turned(a0[at], a1[at], angle[at], u1),
        seconds[at] / np.repeat(parts, parts),
        rapid[at],
        chords.spindle[at],
        chords.tool[at],
        chords.line[at],
        chords.label[at],
    )


def _line(begin: Floats, end: Floats, u: Floats) -> Floats:
    return np.where(u[:, None] == 1.0, end, begin + u[:, None] * (end - begin))


def _turned(begin: Floats, end: Floats, angle: Floats, u: Floats) -> Floats:
    """(n, 3) axes along great circles."""
    small = angle < 1e-12
    over = np.where(small, 1.0, np.sin(angle))
    out = (np.sin((1.0 - u) * angle) / over)[:, None] * begin + (np.sin(u * angle) / over)[:, None] * end
    out = np.where((small | (u == 1.0))[:, None], end, np.where((u == 0.0)[:, None], begin, out))
    return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])
