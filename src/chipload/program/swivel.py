"""How a machine turns its tool along the Z axis of a tilted working plane, and where the tip then stands.

Notation: **axes** are positions of the machine's own axes (9,) [mm, rad]; p [mm] a position of the tip in the
coordinates of a frame without its tilt, as if the rotary axes stood at zero. A workpiece on a rotary table takes these
coordinates along.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.machine.axis import Axis
from chipload.machine.kinematics import forward, inverse, with_tip
from chipload.machine.machine import Machine
from chipload.machine.orientation import rotate_about
from chipload.program.commands import Frame
from chipload.program.to_work import tool_length, work_zero

Floats = NDArray[np.float64]

#: a direction that is missed by more is out of reach [rad]
REACH = 1e-6
#: beyond a limit of an axis by at most this is within it [rad]
SLACK = 1e-9


@dataclass(frozen=True)
class Swivel:
    """A machine, for readers of programs with tilted working planes.

    Parameters
    ----------
    machine : that the program is read for
    placed : number of the work offset whose coordinates are those of the workpiece; None: the first that is used
    """

    machine: Machine
    placed: int | None = None

    @property
    def turns(self) -> bool:
        """Whether the machine has a rotary axis."""
        return bool(self.machine.chain.rotary)

    def tip(self, frame: Frame, base: Frame, axes: Floats) -> Floats:
        """Position p (3,) of the tip where the axes stand.

        Parameters
        ----------
        frame : coordinates and tool
        base : the work offset that is placed on the workpiece
        """
        zero, shift = work_zero(self.machine, base, bool(base.offset.any()))
        at = (axes + shift)[None, :]
        tip, _ = forward(self.machine, at, tool_length(self.machine, frame), zero)
        p = at.copy()
        p[:, :3] = tip
        return _without_tool(frame).from_machine(_work_offset(base).to_machine(p))[0, :3]

    def axes(self, frame: Frame, base: Frame, p: Floats, rotary: Floats) -> Floats:
        """(9,) the axes that bring the tip to p (3,), with the rotary ones and U V W as in ``rotary`` (9,)."""
        zero, shift = work_zero(self.machine, base, bool(base.offset.any()))
        whole = np.array(rotary)[None, :]
        whole[:, :3] = p
        flat = _work_offset(base).from_machine(_without_tool(frame).to_machine(whole))[:, :3]
        at = (np.array(rotary) + shift)[None, :]
        found: Floats = with_tip(self.machine, at, flat, tool_length(self.machine, frame), zero)[0] - shift
        found[3:] = rotary[3:]
        return found

    def directions(self, axes: Floats) -> Floats:
        """R (3, 3) whose columns are X, Y and Z of the machine, turned with the rotary axes, in the work offset."""
        chain = self.machine.chain
        out = np.eye(3)
        for axis in reversed(chain.axes):
            if axis.rotary:
                out = rotate_about(np.array(axis.direction), np.full(3, axes[axis.column]), out)
        found: Floats = (out @ chain.R_machine_work).T @ chain.R_machine_work
        return found

    def numbered(self) -> str:
        """Letters of the rotary axes as a swivel data set numbers them: those of the head, then those of the table."""
        rotary = self.machine.chain.rotary
        return "".join(a.letter for a in (*(a for a in rotary if a.head), *(a for a in reversed(rotary) if not a.head)))

    def highest(self, base: Frame) -> float | None:
        """The upper end of Z's travel, in the coordinates of ``Frame.to_machine``; None: it has none [mm]."""
        _, shift = work_zero(self.machine, base, bool(base.offset.any()))
        high = next((axis.high for axis in self.machine.chain.axes if axis.letter == "Z"), math.inf)
        return high - float(shift[2]) if math.isfinite(high) else None

    def aligned(self, direction: Floats, now: Floats, sign: int = 0) -> Floats:
        """(9,) the axes ``now`` with the rotary ones turned so that the tool stands along a direction of the workpiece.

        Of the ways to reach it, one within the limits of the axes is taken, and of these the one that turns them least.

        Parameters
        ----------
        direction : (3,) float, in the work offset
        now : (9,) float [mm, rad]
        sign : +1 or -1: of the last rotary axis from the workpiece that is not parallel to the tool; 0: any

        Raises
        ------
        InputError
            No angles of the rotary axes turn the tool there, or none within their limits.
        """
        chain = self.machine.chain
        tilting = "".join(axis.letter for axis in chain.rotary)
        found = inverse(self.machine, np.zeros((1, 3)), direction[None, :], held=now, free=tilting)
        if float(found.miss[0]) > REACH:
            raise InputError(
                f"tilted plane: its normal {_direction_text(direction)} is {math.degrees(found.miss[0]):.3g} deg out "
                f"of reach of the rotary axes {' and '.join(tilting)} of {self.machine.name}"
            )
        if self._stands(direction, now) and sign == 0:
            return np.array(now)
        best: Floats | None = None
        least = math.inf
        for solution in found.axes[0]:
            for angles in itertools.product(
                *(_with_whole_turns(axis, solution[axis.column], now) for axis in found.free)
            ):
                q = np.array(now)
                for axis, angle in zip(found.free, angles, strict=True):
                    q[axis.column] = angle
                if sign and sign * q[self._master(found.free).column] < -SLACK:
                    continue
                travel = float(np.abs(q - now).sum())
                if travel < least - SLACK:
                    best, least = q, travel
        if best is None:
            raise InputError(
                f"tilted plane: its normal {_direction_text(direction)} is out of the limits of the rotary axes "
                f"{' and '.join(tilting)} of {self.machine.name}{_sign_text(sign)}"
            )
        return best

    def _stands(self, direction: Floats, now: Floats) -> bool:
        _, axis = forward(self.machine, now[None, :])
        unit = axis[0] / np.linalg.norm(axis[0])
        return float(np.linalg.norm(np.cross(unit, direction))) < REACH and float(unit @ direction) > 0.0

    def _master(self, free: tuple[Axis, ...]) -> Axis:
        """The rotary axis nearest to the tool that is not parallel to it."""
        spindle = np.array(self.machine.chain.spindle)
        across = [a for a in free if np.linalg.norm(np.cross(a.direction, spindle)) > REACH]
        return (across or list(free))[-1]


def _without_tool(frame: Frame) -> Frame:
    """The coordinates alone."""
    return replace(frame, tool=np.zeros(9), tilt=None)


def _work_offset(base: Frame) -> Frame:
    return replace(base, shift=np.zeros(9), tool=np.zeros(9), tilt=None)


def _with_whole_turns(axis: Axis, angle: float, now: Floats) -> Iterator[float]:
    """An angle with whole turns added: within the limits, nearest to where the axis stands first and beside it."""
    turn = round((now[axis.column] - angle) / math.tau)
    for k in (turn, turn - 1, turn + 1):
        q = angle + math.tau * k
        if axis.low - SLACK <= q <= axis.high + SLACK:
            yield q


def _direction_text(direction: Floats) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in direction) + ")"


def _sign_text(sign: int) -> str:
    return f" with a {'positive' if sign > 0 else 'negative'} angle" if sign else ""
