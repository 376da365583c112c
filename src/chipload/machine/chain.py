"""The kinematic chain of a machine: its axes in order from the workpiece to the tool, spindle and work frame.

Notation: s unit direction of the spindle with every axis at zero, from the tip to the spindle; N [mm] the nose of the
spindle, from which tool lengths are measured, in the machine's frame with every axis at zero; W [mm] origin of the work
frame in the same position. The tip is N - L s for a tool of length L.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.machine.axis import LETTERS, Axis, Vector

Floats = NDArray[np.float64]

_SMALL = 1e-9  # greatest component of one unit vector along another at right angles


def _unit(key: str, vector: Vector) -> Vector:
    length = math.sqrt(sum(x * x for x in vector)) if len(vector) == 3 else math.nan
    if not 1e-6 < length < 1e6:
        raise InputError(f"machine.{key} = {vector}: must be three finite numbers, of a length above 0")
    x, y, z = (float(v / length) for v in vector)
    return x, y, z


@dataclass(frozen=True)
class Chain:
    """Axes from the workpiece to the tool.

    Parameters
    ----------
    axes : include X, Y and Z, in independent directions; axes of the table come first
    spindle : s, of any length above 0; stored as a unit vector
    nose : N [mm]
    work_zero : W [mm], unless the job states another
    work_x, work_z : directions of the work frame's X and Z, at right angles, in the machine's frame

    Raises
    ------
    InputError
        An axis is missing, appears twice or is in the wrong place, directions are not independent, or a vector is not
        finite.
    """

    axes: tuple[Axis, ...]
    spindle: Vector = (0.0, 0.0, 1.0)
    nose: Vector = (0.0, 0.0, 0.0)
    work_zero: Vector = (0.0, 0.0, 0.0)
    work_x: Vector = (1.0, 0.0, 0.0)
    work_z: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        letters = "".join(axis.letter for axis in self.axes)
        for letter in letters:
            if letters.count(letter) > 1:
                raise InputError(f"machine.chain = {letters}: {letter} appears twice: must appear once")
        for letter in "XYZ":
            if letter not in letters:
                raise InputError(f"machine.chain = {letters}: {letter} is missing: must have X, Y and Z")
        for first, second in zip(self.axes, self.axes[1:], strict=False):
            if first.head and not second.head:
                text = f"{second.letter} in the table after {first.letter} in the head"
                raise InputError(f"machine.chain = {letters}: {text}: must go from the workpiece to the tool")
        sides = abs(np.linalg.det(np.array([self.axis(letter).direction for letter in "XYZ"])))
        if sides < 1e-3:
            raise InputError("machine.chain: directions of X, Y and Z: must not lie in a plane")
        for name, point in (("nose_mm", self.nose), ("work.zero_mm", self.work_zero)):
            if len(point) != 3 or not all(math.isfinite(v) for v in point):
                raise InputError(f"machine.{name} = {point}: must be three finite numbers")
        for name, key in (("spindle", "spindle.direction"), ("work_x", "work.x_axis"), ("work_z", "work.z_axis")):
            object.__setattr__(self, name, _unit(key, getattr(self, name)))
        if abs(np.dot(self.work_x, self.work_z)) > _SMALL:
            raise InputError("machine.work.x_axis: must be at right angles to z_axis")

    @property
    def letters(self) -> str:
        """Letters of the axes, from the workpiece to the tool."""
        return "".join(axis.letter for axis in self.axes)

    def axis(self, letter: str) -> Axis:
        """The axis of that letter."""
        return next(axis for axis in self.axes if axis.letter == letter)

    @property
    def rotary(self) -> tuple[Axis, ...]:
        """Its rotary axes, from the workpiece to the tool."""
        return tuple(axis for axis in self.axes if axis.rotary)

    @property
    def R_machine_work(self) -> Floats:
        """Rotation (3, 3) from the work frame to the machine's frame; columns: directions of the work frame."""
        x, z = np.array(self.work_x), np.array(self.work_z)
        return np.column_stack([x, np.cross(z, x), z])

    def free(self, letters: str | None = None) -> tuple[Axis, ...]:
        """Rotary axes to be solved for, at most two: those of ``letters``; None: all that are not indexed.

        Raises
        ------
        InputError
            A letter is not that of a rotary axis of the chain, or there are more than two axes.
        """
        for letter in letters or "":
            if letter not in LETTERS or letter not in "".join(axis.letter for axis in self.rotary):
                raise InputError(f"free = {letters!r}: {letter} is no rotary axis: must be of {self.letters}")
        found = tuple(a for a in self.rotary if (not a.indexed if letters is None else a.letter in letters))
        names = " and ".join(axis.letter for axis in found)
        if len(found) > 2:
            raise InputError(f"rotary axes {names} move in a cut: must be at most two: mark others indexed")
        return found
