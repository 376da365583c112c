"""Axes that a program moves and a machine does not have: they are held at zero, and the motions are named.

The rest of the program is read, so that one word of an axis does not cost what all other motions show.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from chipload.errors import Finding, Severity
from chipload.machine.machine import Machine
from chipload.program.commands import LETTERS, Commands

#: code of a finding on such an axis
MISSING_AXIS = "machine-axis-missing"


def hold_missing_axes(commands: Commands, machine: Machine) -> tuple[Commands, tuple[Finding, ...]]:
    """The commands with each axis at rest that the machine does not have, and a finding for each of them; O(n).

    Parameters
    ----------
    commands : (n,) motions, of axes that the machine may not have
    """
    letters = machine.chain.letters
    found = []
    position = commands.position.copy()
    missing = [k for k, letter in enumerate(LETTERS) if letter not in letters]
    for k in missing:
        moved = np.flatnonzero(np.diff(position[:, k], prepend=0.0))
        position[:, k] = 0.0
        if not len(moved):
            continue
        first = int(commands.line[moved[0]])
        count = f"{len(moved)} motions, the first in line {first}" if len(moved) > 1 else "1 motion"
        text = (
            f"{LETTERS[k]} moves: machine {machine.name} has the axes {letters}: {LETTERS[k]} is held at 0 "
            f"({count}), and what is cut from here on is not shown as it is: name a machine that has it"
        )
        found.append(Finding(MISSING_AXIS, first, text, Severity.UNPROVEN))
    if not found:
        return commands, ()
    frames = []
    for frame in commands.frames:
        values = {name: getattr(frame, name).copy() for name in ("offset", "shift", "tool")}
        for value in values.values():
            value[missing] = 0.0
        frames.append(replace(frame, **values))
    columns = {f.name: getattr(commands, f.name) for f in fields(Commands)}
    return Commands(**{**columns, "position": position, "frames": tuple(frames)}), tuple(found)
