"""One program for all channels: the same rows repeatedly, with the pallet turned by a pitch each time.

Notation: B pallet angle of the part, q position of its axis, B = offset + sense q; pitch = 2 pi / blades. A program
begins and ends above the safe height at any B, so the motion from channel to channel is clear. As the walls of an
impeller are the same after a turn by the pitch, the checks of one channel hold for all.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from chipload.machine.machine import Machine
from chipload.planning.impeller.tables import IndexTable
from chipload.program.gcode.writer import Repeat
from chipload.program.program import Program
from chipload.program.read import times_on
from chipload.program.to_axes import to_axes


def channel_repeat(program: Program, machine: Machine, table: IndexTable, blades: int) -> Repeat | None:
    """Loop over all channels; None: the pallet's axis has a limited range that is too small."""
    axis = machine.chain.axis(table.pallet)
    if math.isfinite(axis.low) or math.isfinite(axis.high):
        commands, _ = to_axes(program, machine)
        q = commands.position[:, axis.column]
        on = table.sense * math.tau * (blades - 1) / blades
        if q.min() + min(on, 0.0) < axis.low or q.max() + max(on, 0.0) > axis.high:
            return None
    return Repeat(table.pallet, blades, 360.0 * table.sense)


def turn_channel(program: Program, angle: float) -> Program:
    """Program of a channel that lies further round the part by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    axis = program.axis @ R.T
    return replace(
        program, p_work=program.p_work @ R.T, axis=axis / np.linalg.norm(axis, axis=1)[:, None],
        centre=program.centre @ R.T, normal=program.normal @ R.T,
    )  # fmt: skip


def between_channels(program: Program, machine: Machine, blades: int) -> float:
    """Time from the end of one channel to the beginning of the next [s]."""
    if len(program) < 2:
        return 0.0
    columns = {
        key: getattr(program, key)
        for key in ("motion", "p_work", "axis", "centre", "normal", "turns", "feed", "spindle", "tool", "line", "label")
    }
    last = {key: value[-1:] for key, value in columns.items()} | {"motion": program.motion[:1], "feed": np.zeros(1)}
    first = {key: getattr(turn_channel(program, math.tau / blades), key)[:1] for key in columns}
    two = Program(**{key: np.concatenate([last[key], first[key]]) for key in columns}, labels=program.labels)
    return float(times_on(two, machine)[1])
