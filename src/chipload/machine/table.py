"""The table of a machine: the block under the workpiece, which moves with it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.errors import InputError
from chipload.machine.axis import Vector


@dataclass(frozen=True)
class MachineTable:
    """A block in work coordinates, like the travel of the axes; the workpiece lies on its upper face.

    Parameters
    ----------
    low, high : opposite corners [mm], each coordinate of ``low`` below that of ``high``
    spacing : longest side of the triangles whose corners are compared with the tool [mm], > 0

    Raises
    ------
    InputError
        A number is out of range; the message names it, its value and its limit.

    Examples
    --------
    >>> MachineTable((-200.0, -150.0, -80.0), (200.0, 150.0, -30.0)).spacing
    5.0
    >>> MachineTable((0.0, 0.0, 0.0), (200.0, 150.0, 0.0))
    Traceback (most recent call last):
    chipload.errors.InputError: machine.table.low_mm: Z = 0: must be below high_mm, Z = 0
    """

    low: Vector
    high: Vector
    spacing: float = 5.0

    def __post_init__(self) -> None:
        for axis, low, high in zip("XYZ", self.low, self.high, strict=True):
            if not (math.isfinite(low) and math.isfinite(high)):
                wrong, key = (high, "high_mm") if math.isfinite(low) else (low, "low_mm")
                raise InputError(f"machine.table.{key}: {axis} = {wrong:g}: must be a finite number")
            if not low < high:
                raise InputError(f"machine.table.low_mm: {axis} = {low:g}: must be below high_mm, {axis} = {high:g}")
        if not 0.0 < self.spacing < math.inf:
            raise InputError(f"machine.table.spacing_mm = {self.spacing:g}: must be above 0")
