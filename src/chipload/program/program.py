"""A Program: what the cutter is told to do, motion after motion, in columns.

Every reader ends here and every writer starts here. Positions are of the cutter tip in the work frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.program.path_mode import frozen_column, mode_column

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: values of ``Program.motion``
RAPID, LINE, ARC_CW, ARC_CCW, DWELL = 0, 1, 2, 3, 4
#: the two radii of an arc may differ by as much [mm]
ARC_SKEW_MM = 1e-3
_VECTORS = ("p_work", "axis", "centre", "normal")


def _from_axis(p: Floats, centre: Floats, normal: Floats) -> Floats:
    """(n,) distance of points from the lines through ``centre`` along ``normal`` [mm]."""
    v = p - centre
    return np.asarray(np.linalg.norm(v - (v * normal).sum(axis=1)[:, None] * normal, axis=1))


@dataclass(frozen=True, eq=False)
class Program:
    """Motions in columns; row k goes from ``p_work[k - 1]`` to ``p_work[k]``. Row 0 is a rapid: where it begins.

    Parameters
    ----------
    motion : (n,) int
        RAPID, LINE, ARC_CW, ARC_CCW (clockwise, counter-clockwise about ``normal``, helical where it moves along it)
        or DWELL.
    p_work : (n, 3) float [mm]
        End of the motion.
    axis : (n, 3) float
        Unit vector from the tip to the spindle at the end of the motion.
    centre : (n, 3) float [mm]
        A point of the axis that an arc turns about; 0, 0, 0 elsewhere. Start over end is a full turn.
    normal : (n, 3) float
        Unit vector along that axis, (0, 0, 1) for an arc in the XY plane and for all that is no arc.
    turns : (n,) int
        Whole turns of an arc before the one that it ends in, >= 0.
    feed : (n,) float [mm/s]
        Feed of LINE and ARC, > 0, [rad/s] of the tool's axis where the tip stands; 0 for RAPID; for DWELL the time [s].
    spindle : (n,) float [rad/s]
        Spindle speed, positive clockwise seen from the spindle (M3), 0 stopped.
    tool : (n,) int
        Tool number in the spindle.
    line : (n,) int
        Line of the source that the motion comes from; 0 where there is none.
    label : (n,) int
        Index into ``labels``.
    path_mode : (n, 3) float
        How the joint at the end of the motion is passed, see :mod:`~chipload.program.path_mode`; None: not stated.
    labels : tuple of str
        What the motions belong to, as `finish`, `lead`, `link`.

    Raises
    ------
    InputError
        Columns differ in length, a value is not finite, a cutting motion has no feed, an axis is not a unit
        vector, the radii of an arc at its start and at its end differ by more than ``ARC_SKEW_MM``.
    """

    motion: Ints
    p_work: Floats
    axis: Floats
    centre: Floats
    normal: Floats
    turns: Ints
    feed: Floats
    spindle: Floats
    tool: Ints
    line: Ints
    label: Ints
    labels: tuple[str, ...]
    path_mode: Floats = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        n = len(self.motion)
        object.__setattr__(self, "path_mode", mode_column("program", self.path_mode, n))
        for f in fields(self):
            if f.name in ("labels", "path_mode"):
                continue
            kind = np.float64 if f.name in (*_VECTORS, "feed", "spindle") else np.int64
            column = frozen_column(getattr(self, f.name), kind)
            shape = (n, 3) if f.name in _VECTORS else (n,)
            if column.shape != shape:
                raise InputError(
                    f"program.{f.name}: shape {column.shape}: must be {shape} as program.motion has {n} rows"
                )
            if not np.isfinite(column).all():
                raise InputError(f"program.{f.name}: a value is not a finite number")
            object.__setattr__(self, f.name, column)
        cuts = (self.motion == LINE) | (self.motion == ARC_CW) | (self.motion == ARC_CCW)
        if (self.feed[cuts] <= 0.0).any():
            k = int(np.flatnonzero(cuts & (self.feed <= 0.0))[0])
            raise InputError(f"program row {k}: a cutting motion without a feed: set its feed")
        for name in ("axis", "normal"):
            if n and np.abs(np.linalg.norm(getattr(self, name), axis=1) - 1.0).max() > 1e-9:
                raise InputError(f"program.{name}: must be unit vectors")
        if n and self.turns.min() < 0:
            raise InputError(f"program.turns = {self.turns.min()}: must be at least 0")
        arc = np.flatnonzero((self.motion[1:] == ARC_CW) | (self.motion[1:] == ARC_CCW)) + 1
        r0, r1 = (_from_axis(self.p_work[rows], self.centre[arc], self.normal[arc]) for rows in (arc - 1, arc))
        skew = np.abs(r1 - r0)
        if len(skew) and skew.max() > ARC_SKEW_MM:
            k = int(skew.argmax())
            raise InputError(
                f"program row {arc[k]}: an arc starts {r0[k]:.6g} mm from its centre and ends {r1[k]:.6g} mm from it: "
                f"must agree within {ARC_SKEW_MM:g} mm"
            )

    def __len__(self) -> int:
        return len(self.motion)

    @staticmethod
    def join(parts: Sequence[Program]) -> Program:
        """One program from parts that follow one another; equal labels are merged."""
        names = tuple(dict.fromkeys(name for part in parts for name in part.labels))
        label = [np.array([names.index(x) for x in part.labels], dtype=np.int64)[part.label] for part in parts]
        columns = {
            f.name: np.concatenate([getattr(part, f.name) for part in parts])
            for f in fields(Program)
            if f.name not in ("label", "labels")
        }
        return Program(**columns, label=np.concatenate(label), labels=names)
