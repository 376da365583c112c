"""Table angles and pallet angles of a machine with a pallet on an index table.

Notation: alpha table angle between the pallet's axis and the tool [rad]; B pallet angle [rad] in
T(B) = (sin alpha cos B, sin alpha sin B, cos alpha) in the frame of the impeller (work frame), z along the pallet's
axis. q position of the axis that turns the pallet, B = offset + sense q.

Reference: [Wu2019].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.machine.axis import LETTERS
from chipload.machine.kinematics import forward
from chipload.machine.machine import Machine

Floats = NDArray[np.float64]

_SAME = 1e-9  # two unit vectors, two angles [rad] that are one
_STATED = 1e-6  # a stated angle may miss a position of the table by so much [rad]


@dataclass(frozen=True, eq=False)
class IndexTable:
    """Allowed pallet angles of a machine, by table angle.

    Parameters
    ----------
    index, pallet : letters of the axis that is set between cuts and of the one that turns the pallet
    angle : alpha (t,) [rad], ascending
    position : of the index axis (t,) [rad]
    spans : B (k, 2) [rad], where the pallet may stand
    offset, sense : B = offset + sense q
    """

    index: str
    pallet: str
    angle: Floats
    position: Floats
    spans: Floats
    offset: float
    sense: int

    def at(self, angles: ArrayLike) -> IndexTable:
        """The index table with some of its table angles [rad] only.

        Raises
        ------
        InputError
            One is no position of the table.
        """
        requested = np.atleast_1d(np.asarray(angles, dtype=np.float64))
        rows = []
        for a in requested:
            k = int(np.abs(self.angle - a).argmin())
            if abs(self.angle[k] - a) > _STATED:
                near = ", ".join(f"{math.degrees(x):g}" for x in self.angle[max(k - 1, 0) : k + 2])
                raise InputError(
                    f"table angle {math.degrees(a):g} deg: no position of axis {self.index}: the nearest are {near} deg"
                )
            rows.append(k)
        keep = sorted(set(rows))
        return IndexTable(
            self.index, self.pallet, self.angle[keep], self.position[keep], self.spans, self.offset, self.sense
        )


def index_table(machine: Machine) -> IndexTable:
    """Every table angle of a machine, with the pallet angles that its axis reaches.

    Raises
    ------
    InputError
        The machine has no pallet on an index table with steps.

    Examples
    --------
    >>> from chipload.machine.machine import machine_named
    >>> np.degrees(index_table(machine_named("horizontal-b")).angle).round(9).tolist()[:4]
    [20.0, 25.0, 30.0, 35.0]
    """
    turning = [a for a in machine.chain.rotary if not a.indexed]
    indexed = [a for a in machine.chain.rotary if a.indexed]
    need = "must have one pallet axis and one index axis with steps, as horizontal-b"
    if len(turning) != 1 or len(indexed) != 1 or turning[0].head or indexed[0].head:
        raise InputError(f"machine {machine.name}: rotary axes {_letters(machine)}: {need}")
    pallet, index = turning[0], indexed[0]
    if index.step is None or math.isinf(index.low) or math.isinf(index.high):
        raise InputError(f"machine {machine.name}: axis {index.letter}: no steps between two limits: {need}")
    first, last = math.ceil(index.low / index.step - _STATED), math.floor(index.high / index.step + _STATED)
    position = index.step * np.arange(first, last + 1, dtype=np.float64)
    axes = np.zeros((2 * len(position), len(LETTERS)))
    axes[:, index.column] = np.concatenate([position, position])
    axes[len(position) :, pallet.column] = 1.0
    _, T = forward(machine, axes)
    still, turned = T[: len(position)], T[len(position) :]
    sense = 1 if (turned[:, 1] * still[:, 0] - turned[:, 0] * still[:, 1]).sum() > 0.0 else -1
    c, s = math.cos(1.0), sense * math.sin(1.0)
    about_z = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    round_ = np.hypot(still[:, 0], still[:, 1])
    angle = np.arctan2(round_, still[:, 2])
    azimuth = np.arctan2(still[:, 1], still[:, 0])[round_ > _SAME]
    if np.abs(still @ about_z - turned).max() > _SAME or np.ptp(azimuth) > _SAME:
        raise InputError(f"machine {machine.name}: axis {pallet.letter} does not turn about the work's Z: {need}")
    offset = float(azimuth[0]) if len(azimuth) else 0.0
    spans = np.array([[0.0, 2.0 * math.pi]])
    if not pallet.endless and pallet.high - pallet.low < 2.0 * math.pi:
        spans = np.sort(offset + sense * np.array([[pallet.low, pallet.high]]), axis=1)
    order = np.argsort(angle, kind="stable")
    return IndexTable(index.letter, pallet.letter, angle[order], position[order], spans, offset, sense)


def _letters(machine: Machine) -> str:
    return ", ".join(f"{a.letter}{' indexed' if a.indexed else ''}" for a in machine.chain.rotary) or "none"
