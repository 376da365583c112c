"""Program of one cutter at one table angle, in the work frame.

Notation: alpha table angle, set before the first motion and kept in all of the program; B pallet angle. On the machine
the table stands at the position that brings the tool's axis to alpha from the pallet's (``tables.py``).
"""

from __future__ import annotations

import math

import numpy as np

from chipload.errors import Finding
from chipload.machine.machine import Machine
from chipload.planning.impeller.links import Moves
from chipload.planning.impeller.scene import Floats
from chipload.program.motions import spans
from chipload.program.program import DWELL, RAPID, Program

_STILL = 1e-9  # [rad] the table angle of a row may differ by so much


def program_of(moves: Moves, spindle: float, tool: int) -> Program:
    """Program of the moves; ``spindle`` [rad/s], ``tool`` number."""
    labels = tuple(dict.fromkeys(moves.label))
    n = len(moves.tip)
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    zero = np.zeros(n, dtype=np.int64)
    return Program(
        motion=np.array(moves.motion), p_work=moves.tip, axis=moves.axis, centre=np.zeros((n, 3)), normal=up,
        turns=zero, feed=moves.feed, spindle=np.full(n, spindle), tool=np.full(n, tool), line=zero,
        label=np.array([labels.index(x) for x in moves.label]), labels=labels,
    )  # fmt: skip


def pallet_rate(machine: Machine) -> float:
    """Greatest rate of the pallet [rad/s]."""
    return next(x.rate for x in machine.chain.rotary if not x.indexed)


def table_stands(program: Program) -> bool:
    """Whether the table angle is the same in every row."""
    return float(np.ptp(np.arccos(np.clip(program.axis[:, 2], -1.0, 1.0)))) < _STILL


def pallet_speed(program: Program) -> Floats:
    """Rate of the pallet [rad/s] in each row at its feed, (n,); 0 for rapids."""
    B = np.unwrap(np.arctan2(program.axis[:, 1], program.axis[:, 0]))
    turn = np.abs(np.diff(B, prepend=B[:1]))
    cut = (program.motion != RAPID) & (program.motion != DWELL)
    span = spans(program)
    seconds = np.where(cut & (span > 0.0), span / np.where(cut, program.feed, 1.0), math.inf)
    return np.where(seconds > 0.0, turn / seconds, 0.0)


def too_fast(program: Program, machine: Machine) -> tuple[Finding, ...]:
    """Finding where the pallet would exceed its greatest rate."""
    speed, most = pallet_speed(program), pallet_rate(machine)
    if not len(speed) or speed.max() <= most * (1.0 + 1e-9):
        return ()
    k = int(speed.argmax())
    needed, greatest = math.degrees(speed[k]), math.degrees(most)
    text = f"row {k}: the pallet turns at {needed:g} deg/s: machine {machine.name} reaches {greatest:g}"
    return (Finding("machine-rate", 0, text),)
