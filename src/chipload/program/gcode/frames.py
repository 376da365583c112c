"""Turned and shifted coordinates of a program: Fanuc's G68, Sinumerik's TRANS, ATRANS, ROT and AROT about Z.

Notation: p in the coordinates of the program; q = R(turn) p + shift in those of the work offset [mm], which lie in the
machine as the datum says: m = R(r) (q + s) + o. Both together are a datum again: m = R(r + turn) p +
R(r) (shift + s) + o.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

from chipload.program.gcode.controller import Controller
from chipload.program.gcode.state import ZERO, Datum, Nine, nine, rotate_point


@dataclass(frozen=True)
class ProgramFrame:
    """Coordinates within those of the work offset.

    Parameters
    ----------
    turn : about Z [deg]
    shift : (9,) of the origin [mm, deg]
    base : the work offset that they lie in
    """

    turn: float
    shift: Nine
    base: Datum


def place(c: Controller, turn: float, shift: Nine) -> None:
    """Put the program's coordinates in those of the work offset; the machine stays where it is."""
    remove(c)
    if turn == 0.0 and shift == ZERO:
        return
    base = c.state.datum
    moved = [a + b for a, b in zip(shift, base.shift, strict=True)]
    moved[0], moved[1] = rotate_point(moved[0], moved[1], base.rotation)
    offset = nine([a + b for a, b in zip(moved, base.offset, strict=True)])
    c.program_frame = ProgramFrame(turn, shift, base)
    c.rebase(replace(base, offset=offset, rotation=base.rotation + turn, shift=ZERO))


def remove(c: Controller) -> None:
    """Back to the coordinates of the work offset."""
    frame = c.program_frame
    if frame is not None:
        c.program_frame = None
        c.rebase(replace(frame.base, length=c.state.datum.length))


def turn_about(c: Controller, x: float, y: float, degrees: float) -> None:
    """Turn the coordinates of the work offset about a point (x, y) [mm] of it (G68)."""
    a, b = rotate_point(x, y, degrees)
    place(c, degrees, nine([x - a, y - b, *ZERO[2:]]))


def further(c: Controller, turn: float, shift: Nine) -> None:
    """A turn and a shift within the coordinates that there are (ATRANS, AROT)."""
    old_turn, old_shift = current(c)
    moved = list(shift)
    moved[0], moved[1] = rotate_point(moved[0], moved[1], old_turn)
    place(c, old_turn + turn, nine([a + b for a, b in zip(moved, old_shift, strict=True)]))


def current(c: Controller) -> tuple[float, Nine]:
    """Turn and shift that hold."""
    return (0.0, ZERO) if c.program_frame is None else (c.program_frame.turn, c.program_frame.shift)


@contextlib.contextmanager
def without_frame(c: Controller) -> Iterator[None]:
    """The work offset alone, for what changes it; the program's coordinates lie in it again behind."""
    turn, shift = current(c)
    remove(c)
    yield
    place(c, turn, shift)
