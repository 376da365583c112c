"""A Program: what the cutter is told to do, motion after motion, in columns.

Every reader ends here and every writer starts here. Positions are of the cutter tip in the work frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: values of ``Program.motion``
RAPID, LINE, ARC_CW, ARC_CCW, DWELL = 0, 1, 2, 3, 4
#: the two radii of an arc may differ by as much [mm]
ARC_SKEW_MM = 1e-3


@dataclass(frozen=True, eq=False)
class Program:
    """Motions in columns; row k goes from ``p_work[k - 1]`` to ``p_work[k]``. Row 0 is a rapid: where it begins.

    Parameters
    ----------
    motion : (n,) int
        RAPID, LINE, ARC_CW, ARC_CCW (in the XY plane seen from +Z, helical where z changes) or DWELL.
    p_work : (n, 3) float [mm]
        End of the motion.
    axis : (n, 3) float
        Unit vector from the tip to the spindle at the end of the motion.
    centre : (n, 2) float [mm]
        Centre of an arc; 0, 0 elsewhere. Start equal to end is a full turn.
    feed : (n,) float [mm/s]
        Feed of LINE and ARC, > 0; 0 for RAPID; for DWELL the time [s].
    spindle : (n,) float [rad/s]
        Spindle speed, positive clockwise seen from the spindle (M3), 0 stopped.
    tool : (n,) int
        Tool number in the spindle.
    line : (n,) int
        Line of the source that the motion comes from; 0 where there is none.
    label : (n,) int
        Index into ``labels``.
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
    feed: Floats
    spindle: Floats
    tool: Ints
    line: Ints
    label: Ints
    labels: tuple[str, ...]

    def __post_init__(self) -> None:
        n = len(self.motion)
        for f in fields(self):
            if f.name == "labels":
                continue
            kind = np.float64 if f.name in ("p_work", "axis", "centre", "feed", "spindle") else np.int64
            column = np.array(getattr(self, f.name), dtype=kind)
            if len(column) != n:
                raise InputError(f"program.{f.name}: {len(column)} rows: must be {n} as in program.motion")
            if not np.isfinite(column).all():
                raise InputError(f"program.{f.name}: a value is not a finite number")
            column.setflags(write=False)
            object.__setattr__(self, f.name, column)
        cuts = (self.motion == LINE) | (self.motion == ARC_CW) | (self.motion == ARC_CCW)
        if (self.feed[cuts] <= 0.0).any():
            k = int(np.flatnonzero(cuts & (self.feed <= 0.0))[0])
            raise InputError(f"program row {k}: a cutting motion without a feed: set its feed")
        arc = (self.motion[1:] == ARC_CW) | (self.motion[1:] == ARC_CCW)
        r0 = np.hypot(*(self.p_work[:-1, 0:2] - self.centre[1:]).T)
        r1 = np.hypot(*(self.p_work[1:, 0:2] - self.centre[1:]).T)
        skew = np.where(arc, np.abs(r1 - r0), 0.0)
        if len(skew) and skew.max() > ARC_SKEW_MM:
            k = int(skew.argmax())
            raise InputError(
                f"program row {k + 1}: an arc starts {r0[k]:.6g} mm from its centre and ends {r1[k]:.6g} mm from it: "
                f"must agree within {ARC_SKEW_MM:g} mm"
            )
        if n and np.abs(np.linalg.norm(self.axis, axis=1) - 1.0).max() > 1e-9:
            raise InputError("program.axis: must be unit vectors")

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
