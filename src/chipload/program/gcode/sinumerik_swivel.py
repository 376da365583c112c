"""CYCLE800 of a Sinumerik: retraction, swivelled plane, rotary axes.

Notation: the arguments are FR, TC, ST, MODE, X0 Y0 Z0, A B C, X1 Y1 Z1, DIR, FR_I. The plane is moved by X0 Y0 Z0 [mm],
turned by A, B and C [deg] about the axes that MODE names, each as it was turned by those before, and moved by X1 Y1 Z1
along its own axes. MODE axis by axis holds a digit of two bits for each turn: 1 X, 2 Y, 3 Z, the first lowest; its bits
6 and 7 are 0. If both are 1, A and B are the angles of rotary axes 1 and 2 of the swivel data set: those of the head,
then those of the table.

Reference: Siemens, SINUMERIK 840D sl Programming Manual Cycles, "Swivel plane CYCLE800".
"""

from __future__ import annotations

import numpy as np

from chipload.errors import InputError
from chipload.program.commands import RAPID
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.dialect import go_on, leave_out
from chipload.program.gcode.expression import integer_of
from chipload.program.gcode.frames import remove
from chipload.program.gcode.state import Nine, put
from chipload.program.gcode.tilted_plane import align, at_angles, level, tilt_coordinates, turn
from chipload.program.tilt import tilt_of, turn_matrix

FR, ST, MODE, X0, A, X1, DIR, FR_I = 0, 2, 3, 4, 7, 10, 13, 14
#: retractions along Z to a position of the machine, and along the tool to the end of the travel
TO_MACHINE = (1, 2, 4)
#: by FR_I along the tool
INCREMENTAL = 5
#: bits of MODE that say how the angles are given; 0: axis by axis
KIND = 0xC0


def order_of(mode: int) -> str:
    """Axes of the three turns, in their order; empty: MODE names none or one twice.

    >>> order_of(57), order_of(27), order_of(54), order_of(192)
    ('xyz', 'zyx', 'yxz', '')
    """
    axes = "".join(" xyz"[mode >> shift & 3] for shift in (0, 2, 4))
    return axes if not mode & KIND and sorted(axes) == list("xyz") else ""


def swivel(c: Controller, values: list[float]) -> None:
    """Carry it out; ``values`` are its arguments, 0 for those that are left out."""
    given = [*values, *[0.0] * (FR_I + 1 - len(values))]
    shift, angles, moved = given[X0 : X0 + 3], given[A : A + 3], given[X1 : X1 + 3]
    retract, status, mode = (
        integer_of(given[k], f"CYCLE800: {name}") for k, name in ((FR, "FR"), (ST, "ST"), (MODE, "MODE"))
    )
    if retract in TO_MACHINE:
        c.retracted = c.state.at
        c.note("nc-machine-retraction", "CYCLE800: a retraction to a position of the machine is left out")
    elif retract == INCREMENTAL and given[FR_I] > 0.0:
        c.straight(RAPID, put(c.state.at, {2: c.state.at[2] + given[FR_I] * c.state.scale}))
    order = order_of(mode) or ("" if any(angles) else "xyz")
    target: Nine | None = None
    direct = mode & KIND == KIND
    if direct and c.swivel is not None and c.swivel.turns:
        target, turns = at_angles(c, dict(zip(c.swivel.numbered(), angles, strict=False)))
    elif order:
        turns = turn_matrix(order, (angles[0], angles[1], angles[2]))
    else:
        leave_out(c, f"CYCLE800: MODE {mode}: a swivelled plane by solid or projected angles")
        return
    before = c.state.datum.tilt
    if status % 10 == 1 and before is not None:
        R, origin = before.matrix, np.array(before.origin)
    else:
        R, origin = np.eye(3), np.zeros(3)
    origin = origin + R @ shift * c.state.scale
    R = R @ turns
    origin = origin + R @ moved * c.state.scale
    remove(c)
    plane = tilt_of(R, tuple(origin.tolist()))
    if not tilt_coordinates(c, plane):
        leave_out(c, "CYCLE800: a swivelled plane, and no machine with rotary axes")
        return
    go_on(c)
    if target is not None:
        turn(c, target)
    elif given[DIR] != 0.0:
        _align(c, 1 if given[DIR] > 0.0 else -1)
    if np.allclose(R, np.eye(3), atol=1e-12) and not origin.any():
        level(c)
        if before is None:
            c.once("nc-ignored", "CYCLE800: a plane that is not swivelled")


def _align(c: Controller, sign: int) -> None:
    """Turn the rotary axes, to the side that DIR prefers where they reach it there."""
    try:
        align(c, sign)
    except InputError:
        align(c)
