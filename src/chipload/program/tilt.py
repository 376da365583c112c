"""Tilted working planes: coordinates whose Z stands along another direction than that of the work offset.

Notation: p in the tilted coordinates, q in those of the work offset [mm]: q = R p + o. Rx, Ry, Rz are right-handed
turns about X, Y and Z.

| controller | angles | R |
|---|---|---|
| Fanuc, Haas: G68.2, G268 with I J K | Euler, about Z, then about the new X, then about the new Z | Rz(I) Rx(J) Rz(K) |
| Heidenhain: PLANE SPATIAL, cycle 19 with SPA SPB SPC | about X, then Y, then Z of the work offset | Rz Ry Rx |
| Heidenhain: PLANE EULER with EULPR EULNU EULROT | as Fanuc's | Rz Rx Rz |
| Sinumerik: CYCLE800, axis by axis in the order of its mode, as X Y Z | each about the axis turned so far | Rx Ry Rz |
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]

#: code and text of the finding on a tilted plane of a machine without rotary axes
NO_ROTARY = "program-no-rotary"
NEEDS_ROTARY = "a tilted plane: the machine has no rotary axis that turns the tool there: name a machine that has"
#: a direction that differs from Z by less is Z
UPRIGHT = 1e-12
#: how far the rows of R may be off unit length and each other's right angle
_EXACT = 1e-9


@dataclass(frozen=True, slots=True)
class Tilt:
    """Coordinates in those of a work offset.

    Parameters
    ----------
    rotation : nine numbers, the rows of R
    origin : o [mm]

    Raises
    ------
    InputError
        A number is not finite, or R is no rotation.

    Examples
    --------
    A plane turned by 90 degrees about X: its Z stands along -Y.

    >>> tilt = tilt_of(turn_matrix("x", (90.0,)), (0.0, 0.0, 5.0))
    >>> (tilt.to_offset(np.array([[1.0, 2.0, 3.0]])).round(9) + 0.0).tolist()
    [[1.0, -3.0, 7.0]]
    """

    rotation: tuple[float, ...]
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        numbers = np.array([*self.rotation, *self.origin])
        if numbers.shape != (12,) or not np.isfinite(numbers).all():
            raise InputError("tilt: must be a rotation of nine finite numbers and an origin of three")
        R = self.matrix
        if np.abs(R @ R.T - np.eye(3)).max() > _EXACT or np.linalg.det(R) < 0.0:
            raise InputError("tilt.rotation: must be a rotation: rows of unit length at right angles, right-handed")

    @property
    def matrix(self) -> Floats:
        """R (3, 3)."""
        return np.array(self.rotation, dtype=np.float64).reshape(3, 3)

    @property
    def direction(self) -> Floats:
        """Z of the tilted coordinates (3,), in those of the work offset."""
        return np.array(self.rotation[2::3], dtype=np.float64)

    @property
    def upright(self) -> bool:
        """Whether only Z is turned about, or nothing."""
        return bool(np.hypot(*self.direction[:2]) < UPRIGHT and self.direction[2] > 0.0)

    def to_offset(self, p: Floats) -> Floats:
        """(n, 3) in the work offset from (n, 3) in the tilted coordinates."""
        out: Floats = p @ self.matrix.T + np.array(self.origin)
        return out

    def from_offset(self, q: Floats) -> Floats:
        """(n, 3) in the tilted coordinates from (n, 3) in the work offset."""
        out: Floats = (q - np.array(self.origin)) @ self.matrix
        return out


def tilt_of(rotation: Floats, origin: tuple[float, ...]) -> Tilt:
    """A tilt of R (3, 3) and o."""
    x, y, z = (float(v) for v in origin)
    return Tilt(tuple(float(v) for v in rotation.ravel()), (x, y, z))


def turn_matrix(axes: str, degrees: tuple[float, ...]) -> Floats:
    """R (3, 3) of turns one after the other, each about an axis as it was turned by those before.

    Parameters
    ----------
    axes : letters of x, y, z
    degrees : an angle for each

    >>> (turn_matrix("zxz", (90.0, 90.0, 0.0)).round(9) + 0.0)[:, 2].tolist()
    [1.0, 0.0, 0.0]
    """
    R = np.eye(3)
    for axis, angle in zip(axes, degrees, strict=True):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        k = "xyz".index(axis)
        one = np.eye(3)
        i, j = (k + 1) % 3, (k + 2) % 3
        one[i, i] = one[j, j] = c
        one[i, j], one[j, i] = -s, s
        R = R @ one
    return R


def spatial(a: float, b: float, c: float) -> Floats:
    """R (3, 3) of Heidenhain's spatial angles [deg]: about X, then about Y, then about Z of the work offset."""
    return turn_matrix("zyx", (c, b, a))


def of_vectors(x: Floats, z: Floats) -> Floats:
    """R (3, 3) with Z along ``z`` and X along what of ``x`` is across it.

    Raises
    ------
    InputError
        They are parallel, or one has no length.
    """
    size = float(np.linalg.norm(z))
    if not size > 0.0:
        raise InputError("tilted plane: its normal has no length")
    z = z / size
    across = x - (x @ z) * z
    if not np.linalg.norm(across) > 1e-6 * np.linalg.norm(x):
        raise InputError("tilted plane: the direction of its X axis is that of its normal, or has no length")
    x = across / np.linalg.norm(across)
    return np.column_stack([x, np.cross(z, x), z])
