"""Motions that the spindle drives: G33 (one motion) and G33.1 (rigid tapping).

Notation: K [units of the text] is the distance along the path for each revolution of the spindle, S its speed [rpm]:
the feed is K S. Rigid tapping feeds to the end, reverses the spindle there, feeds back to where it began and restores
the spindle; by how much the tool goes past the end until the spindle has stopped is not known and left out.

Reference: LinuxCNC 2.9, "G33 Spindle Synchronized Motion", "G33.1 Rigid Tapping".
"""

from __future__ import annotations

import math

from chipload.errors import InputError
from chipload.program.commands import LINE
from chipload.program.gcode.controller import Controller
from chipload.program.gcode.modal import code_text
from chipload.program.gcode.state import Nine
from chipload.program.gcode.targets import end
from chipload.program.gcode.words import Block


def run_synchronised(c: Controller, block: Block, code: int) -> None:
    """Carry out G33 (330) or G33.1 (331).

    Raises
    ------
    InputError
        K is missing or 0, the spindle does not turn or its speed is not known.
    """
    state, name = c.state, code_text(code)
    c.not_compensated(name)
    if "k" not in block.words:
        raise InputError(f"{name}: K is missing: the distance for each revolution of the spindle")
    if block.words["k"] == 0.0:
        raise InputError(f"{name}: K0: the distance for each revolution must not be 0")
    if state.sense == 0:
        raise InputError(f"{name}: the spindle does not turn: start it by M3 or M4")
    if state.surface or state.speed == 0.0:
        raise InputError(f"{name}: the spindle speed is not known: give S in rpm (G97)")
    start, to = state.at, end(c, block)
    pitch = abs(block.words["k"]) * state.scale
    _feed(c, to, pitch)
    if code == 331:
        sense = state.sense
        state.sense = -sense
        c.changed()
        _feed(c, start, pitch)
        state.sense = sense
        c.changed()
        c.once("nc-tapping", f"{name}: the overrun past the end, until the spindle has stopped, is left out")


def _feed(c: Controller, to: Nine, pitch: float) -> None:
    """LINE to ``to`` at ``pitch`` [mm] for each revolution: as a rate [1/min] over its length [mm]."""
    state = c.state
    length = math.dist(state.at[:3], to[:3])
    if length == 0.0:
        raise InputError("the spindle drives X, Y and Z, and none of them moves: give the end of the motion")
    c.straight(LINE, to, pitch * state.speed / length)
