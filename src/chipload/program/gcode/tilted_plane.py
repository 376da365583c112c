"""Tilted working planes of a controller: G68.2 and G53.1, G268 and G253, CYCLE800.

Notation: m positions of the machine's axes, nine numbers [mm, deg]. In a tilted plane the rows of the text are rows of
the tip, which the rotary axes carry along with the workpiece; the machine's axes follow from how it is built
(:mod:`chipload.program.swivel`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Severity
from chipload.program.commands import LETTERS, RAPID, Frame
from chipload.program.gcode.state import Datum, Nine, nine
from chipload.program.tilt import NEEDS_ROTARY, NO_ROTARY

if TYPE_CHECKING:
    from chipload.program.gcode.controller import Controller
    from chipload.program.tilt import Tilt

#: a rotary axis that turns less stands [deg]
STILL = 1e-9


def machine_of(c: Controller, datum: Datum, at: Nine) -> Nine:
    """Where the machine's axes stand if the text's position in a datum is ``at``."""
    flat = datum.to_machine(at)
    if datum.tilt is None or c.swivel is None:
        return flat
    p = datum.tilt.to_offset(np.array([at[:3]]))[0]
    return _deg(c.swivel.axes(datum.frame(), _base(c, datum), p, _rad(flat)))


def position_of(c: Controller, datum: Datum, m: Nine) -> Nine:
    """The text's position in a datum where the machine's axes stand at ``m``."""
    at = datum.from_machine(m)
    if datum.tilt is None or c.swivel is None:
        return at
    p = c.swivel.tip(datum.frame(), _base(c, datum), _rad(m))
    x, y, z = datum.tilt.from_offset(p[None, :])[0].tolist()
    return (x, y, z, *at[3:])


def tilt_coordinates(c: Controller, tilt: Tilt) -> bool:
    """Put the program's coordinates into a tilted plane of the work offset; the machine stays where it is.

    Returns
    -------
    False where nothing changes, as the machine is not known or has no rotary axis.
    """
    level(c)
    if not tilt.upright and (c.swivel is None or not c.swivel.turns):
        if c.swivel is not None:
            c.once(NO_ROTARY, NEEDS_ROTARY, Severity.UNPROVEN)
        return False
    c.rebase(replace(c.state.datum, tilt=tilt))
    return True


def level(c: Controller) -> None:
    """Back to the coordinates of the work offset."""
    c.rebase(replace(c.state.datum, tilt=None))


def at_angles(c: Controller, angles: Mapping[str, float]) -> tuple[Nine, NDArray[np.float64]]:
    """Positions m with rotary axes at angles [deg] by their letters, and R (3, 3) of the machine's X, Y and Z there."""
    axes = _rad(c.machine_position())
    for letter, angle in angles.items():
        axes[LETTERS.index(letter)] = math.radians(angle)
    return _deg(axes), np.eye(3) if c.swivel is None else c.swivel.directions(axes)


def align(c: Controller, sign: int = 0) -> None:
    """Turn the rotary axes so that the tool stands along Z of the tilted plane; ``sign`` as in ``Swivel.aligned``."""
    datum = c.state.datum
    if datum.tilt is None or c.swivel is None or not c.swivel.turns:
        return
    now = c.machine_position()
    turn(c, _deg(c.swivel.aligned(datum.tilt.direction, _rad(now), sign)))


def turn(c: Controller, target: Nine) -> None:
    """Turn the rotary axes in a tilted plane to those of ``target``, X Y Z of the machine where they are.

    Where a retraction before it was left out, because its height is not known, Z goes to the end of its travel first.
    """
    datum, now = c.state.datum, c.machine_position()
    if max(abs(a - b) for a, b in zip(now[3:6], target[3:6], strict=True)) < STILL:
        return
    lifted = c.retracted is not None and c.retracted == c.state.at
    height = c.swivel.highest(_base(c, datum)) if lifted and c.swivel is not None else None
    x, y, z = now[:3]
    level(c)
    if height is not None and height > z:
        c.once(
            "nc-machine-retraction",
            "the rotary axes turn behind a retraction that is left out: Z is taken to the end of its travel there",
        )
        z = height
        c.straight(RAPID, c.position((x, y, z, *now[3:])))
    c.straight(RAPID, c.position((x, y, z, *target[3:])))
    c.rebase(replace(c.state.datum, tilt=datum.tilt))


def _base(c: Controller, datum: Datum) -> Frame:
    """The work offset that is placed on the workpiece: the stated one, else the first that was used."""
    number = None if c.swivel is None else c.swivel.placed
    used = c.track.used_frames()
    if number is None:
        found = next((one for one in used if one.number > 0), datum)
    else:
        found = next((one for one in used if one.number == number), None) or Datum(number, *c.work_offset(number))
    return replace(found, tilt=None).frame()


def _rad(m: Nine) -> NDArray[np.float64]:
    out = np.array(m, dtype=np.float64)
    out[3:6] = np.radians(out[3:6])
    return out


def _deg(axes: NDArray[np.float64]) -> Nine:
    return nine([math.degrees(x) if 3 <= k < 6 else x for k, x in enumerate(axes.tolist())])
