"""Loads of steps over a revolution of the spindle, in one compiled call.

Notation as in :mod:`chipload.cutting.force`; ``left`` the unit normal of the surface that a step leaves, out of the
cutter, 0 where it leaves none.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.band import mean_basis
from chipload.cutting.force import forces_over_turn, in_work, mean_forces
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.lazy import LateModule

_revolution = LateModule("chipload.cutting._revolution")

Floats = NDArray[np.float64]

#: columns of loads; the mean power is that of the caller, who knows the speed
COLUMNS = 15


def rotations(cutter: Cutter, rotation: float) -> int:
    """Return the number of rotations at most ``rotation`` [rad] apart over a tooth pitch, or over a revolution if teeth
    have runout.
    """
    pitch = math.tau / cutter.flutes if cutter.teeth_alike else math.tau
    return max(math.ceil(pitch / rotation), 8)


def first_greatest(loads: Floats) -> NDArray[np.int64]:
    """Return for each step (n,) the first rotation at which a load (n, m) equals the greatest within rounding.

    >>> first_greatest(np.array([[1.0, 2.0 - 1e-12, 2.0], [0.0, 0.0, -1.0]])).tolist()
    [1, 0]
    """
    most = loads.max(axis=1, keepdims=True)
    return np.asarray((loads >= most - _revolution.ALIKE * np.abs(most)).argmax(axis=1))


def loads_over_turn(
    engagement: ToothEngagement, cutter: Cutter, material: Material, rotation: float, left: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Return (n, 15) mean, greatest and least force x, y, z [N] on the cutter in the frame of the work, greatest size
    of the force, mean and greatest torque [N mm], 0, thickest chip [mm], greatest force against ``left`` [N]; (n, 2)
    rotations [rad] at which the size of the force and the torque are greatest; and (n, 4, 6) the basis of the mean
    loads along T, n and the axis, see :func:`chipload.cutting.band.mean_basis`.

    Parameters
    ----------
    engagement : of n steps, with frames
    left : (n, 3) float
    """
    away = np.ascontiguousarray(left, dtype=np.float64)
    count = rotations(cutter, rotation)
    alike = cutter.teeth_alike
    teeth = cutter.flutes if alike else 1
    basis = mean_basis(engagement, cutter, material)
    if any(material.exponents) or (alike and bool((engagement.tooth >= 0).any())):
        out = _one_by_one(engagement, cutter, material, count, away)
    else:
        out = np.empty((len(engagement), COLUMNS + 2))
        theta = np.arange(count * teeth) * (math.tau / (count * teeth))
        table = np.vstack([np.cos(theta), np.sin(theta)])
        _revolution.over_turn(
            engagement.start, engagement.rows, engagement.tooth, engagement.slice, engagement.slices, table,
            engagement.frames, cutter.flutes, count, alike, np.array(material.law), away, out,
        )  # fmt: skip
        mean = basis @ np.array(material.coefficients)
        out[:, :3] = in_work(mean[:, :3], engagement.frames)
        out[:, 10] = mean[:, 3]
    return out[:, :COLUMNS], out[:, COLUMNS:] * (math.tau / teeth / count), basis


def _one_by_one(engagement: ToothEngagement, cutter: Cutter, material: Material, count: int, left: Floats) -> Floats:
    """(n, 17) the same by the loads at each rotation, for any law; the last two are numbers of rotations."""
    pitch = math.tau / cutter.flutes if cutter.teeth_alike else math.tau
    force, torque = forces_over_turn(engagement, cutter, material, np.arange(count) * (pitch / count))
    mean, torque_mean = mean_forces(engagement, cutter, material)
    turned, size = in_work(force, engagement.frames), np.linalg.norm(force, axis=2)
    return np.column_stack(
        [
            in_work(mean, engagement.frames),
            turned.max(axis=1),
            turned.min(axis=1),
            size.max(axis=1),
            torque_mean,
            torque.max(axis=1),
            np.zeros(len(engagement)),
            engagement.chip_max(),
            -np.einsum("nmi,ni->nm", turned, left).min(axis=1).clip(None, 0.0),
            first_greatest(size),
            first_greatest(torque),
        ]
    )
