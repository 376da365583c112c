"""How a controller takes the joints of a path: what G61, G61.1 and G64 ask for, as a column of a program.

Notation: a row of the column is (control, tolerance [mm], naive tolerance [mm]). The tolerance bounds how far the
joint at the end of the row may be rounded off; the naive tolerance, how far the straight line that replaces several
short lines may leave their points (the "naive CAM detector" of LinuxCNC).
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]


class PathControl(IntEnum):
    """How the joint at the end of a row is passed."""

    #: the program does not say: as the machine's file says
    MACHINE = 0
    #: a stop at every joint (G61.1)
    EXACT_STOP = 1
    #: the path exactly, without a stop where it is smooth (G61)
    EXACT_PATH = 2
    #: rounded off within the tolerance; tolerance 0: none is stated (G64)
    CONTINUOUS = 3
    #: a rapid that sends an axis for the first time, from where it happens to stand: it takes no time
    UNPLACED = 4


#: rows from which on a column of equal rows is kept as one
LONG = 1024

PathMode = tuple[float, float, float]

#: of programs that do not say
UNSTATED: PathMode = (float(PathControl.MACHINE), 0.0, 0.0)
#: of texts that do not say: as controllers start, G64 without a tolerance
FREE: PathMode = (float(PathControl.CONTINUOUS), 0.0, 0.0)


def frozen_column(value: ArrayLike, kind: type) -> NDArray[Any]:
    """The values as an array that nobody can change: itself where that is so already, else a copy.

    A column of at least ``LONG`` rows that are all the same is kept as one row, which NumPy shows ``n`` times: its
    stride along the first axis is 0, so that it takes no memory and is not contiguous.
    """
    given: NDArray[Any] = np.asarray(value, dtype=kind)
    kept = (given is value or given.base is value) and _unchangeable(given)
    if given.ndim and len(given) >= LONG and _same_rows(given):
        if kept and given.strides[0] == 0:
            return given
        row = given[:1].copy()
        row.setflags(write=False)
        return np.broadcast_to(row, given.shape)
    column = given if kept and given.flags.c_contiguous else np.array(given, order="C")
    column.setflags(write=False)
    return column


def _unchangeable(column: NDArray[Any]) -> bool:
    """Whether neither an array nor one that it is a part of can be written."""
    owner: Any = column
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            return False
        owner = owner.base
    return True


def _same_rows(column: NDArray[Any]) -> bool:
    """Whether all rows are the same, bit for bit; the last row is compared first."""
    if column.strides[0] == 0:
        return True
    bits = column.view(f"u{column.dtype.itemsize}") if column.dtype.kind == "f" else column
    return (
        bool((bits[-1] == bits[0]).all())
        and bool((bits[len(bits) // 2] == bits[0]).all())
        and bool((bits == bits[0]).all())
    )


def mode_column(name: str, values: object, n: int) -> Floats:
    """(n, 3) float, the column of a program of ``n`` rows; None: not stated.

    Raises
    ------
    InputError
        The shape is wrong, a control is unknown, a tolerance is negative or no number.
    """
    column = frozen_column(np.zeros((n, 3)) if values is None else np.asarray(values), float)
    if column.shape != (n, 3):
        raise InputError(f"{name}.path_mode: shape {column.shape}: must be {(n, 3)}")
    if not np.isfinite(column).all() or (column < 0.0).any():
        raise InputError(f"{name}.path_mode: a tolerance must be finite and at least 0 mm")
    if not np.isin(column[:, 0], [float(c) for c in PathControl]).all():
        raise InputError(f"{name}.path_mode: a control is unknown: must be one of PathControl")
    return column


def resolve_tolerance(column: Floats, tolerance: float) -> Floats:
    """(n, 3) the column with the machine's own corner ``tolerance`` [mm] where the program does not say.

    The same as a program that is written for the machine says: G61 for 0, else G64 P.
    """
    control = PathControl.EXACT_PATH if tolerance == 0.0 else PathControl.CONTINUOUS
    return np.where(column[:, :1] == PathControl.MACHINE, (float(control), tolerance, tolerance), column)
