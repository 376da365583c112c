"""One axis of a machine: its side, direction, travel, speed and acceleration.

Notation: q [mm or rad] the axis's own coordinate, d its unit direction, c [mm] a point that a rotary axis turns about.

Sign convention of all machines (ISO 841): a growing q moves the tool along d, or turns it right-handed about d, **as
the workpiece sees it**. A table axis carries the workpiece, so the table itself moves in the opposite direction. A
rotary table with the standard's sign has d = (0, 0, 1) for C. Where the table itself turns right-handed about +Z for a
growing C, as documented for LinuxCNC's `xyzac-trt-kins` and `xyzbc-trt-kins`, d = (0, 0, -1).

Directions and points are those with every axis at zero, in the machine's frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.errors import InputError

#: letters of axes, in the order of the columns of axis positions: X Y Z U V W in mm, A B C in rad
LETTERS = "XYZABCUVW"

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Axis:
    """An axis of a machine.

    Parameters
    ----------
    letter : one of X Y Z A B C U V W
    head : whether it carries the tool; else it is in the table and carries the workpiece
    direction : d, of any length above 0; stored as a unit vector
    pivot : c [mm] of a rotary axis
    low, high : limits [mm or rad], low < high; -inf and inf: endless
    rate : greatest speed [mm/s or rad/s], > 0
    acceleration : [mm/s^2 or rad/s^2], > 0
    indexed : whether it moves between cuts only
    step : increment of an indexed axis, which stands only at multiples of it [mm or rad]; None: at any position

    Raises
    ------
    InputError
        A number is out of range; the message names it, its value and its limit.

    Examples
    --------
    >>> Axis("C", False, (0.0, 0.0, -2.0)).direction
    (0.0, 0.0, -1.0)
    """

    letter: str
    head: bool
    direction: Vector
    pivot: Vector = (0.0, 0.0, 0.0)
    low: float = -math.inf
    high: float = math.inf
    rate: float = math.inf
    acceleration: float = math.inf
    indexed: bool = False
    step: float | None = None

    def __post_init__(self) -> None:
        if len(self.letter) != 1 or self.letter not in LETTERS:
            raise InputError(f"machine: axis {self.letter!r}: the letter must be one of {' '.join(LETTERS)}")
        mm = "deg" if self.rotary else "mm"
        shown = math.degrees if self.rotary else float
        key = f"machine.axis.{self.letter.lower()}."

        def need(ok: bool, name: str, value: float, limit: str) -> None:
            if not ok:
                raise InputError(f"{key}{name} = {shown(value):g}: {limit}")

        for name, vector in (("direction", self.direction), ("pivot_mm", self.pivot)):
            if len(vector) != 3 or not all(math.isfinite(x) for x in vector):
                raise InputError(f"{key}{name} = {vector}: must be three finite numbers")
        length = math.sqrt(sum(x * x for x in self.direction))
        if not 1e-6 < length < 1e6:
            raise InputError(f"{key}direction = {self.direction}: must have a length above 0")
        object.__setattr__(self, "direction", tuple(x / length + 0.0 for x in self.direction))
        object.__setattr__(self, "pivot", tuple(float(x) for x in self.pivot))
        need(self.low < math.inf, f"min_{mm}", self.low, "must be a finite number")
        need(self.low < self.high, f"max_{mm}", self.high, f"must be above min_{mm} = {shown(self.low):g}")
        need(self.rate > 0.0, f"rate_{mm}_min", self.rate * 60.0, "must be above 0")
        need(self.acceleration > 0.0, f"acceleration_{mm}_s2", self.acceleration, "must be above 0")
        if self.step is not None:
            need(self.indexed, f"step_{mm}", self.step, "must be left out where the axis is not indexed")
            need(0.0 < self.step < math.inf, f"step_{mm}", self.step, "must be above 0")

    @property
    def rotary(self) -> bool:
        """Whether it is rotary (A B C), with positions in rad, or linear (X Y Z U V W), in mm."""
        return self.letter in "ABC"

    @property
    def column(self) -> int:
        """Its column in arrays of axis positions, 0 to 8."""
        return LETTERS.index(self.letter)

    @property
    def endless(self) -> bool:
        """Whether it has no limit on at least one side."""
        return math.isinf(self.low) or math.isinf(self.high)
