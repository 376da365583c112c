"""Table of normal force over depth of cut, for the many places of a wall that one pose of the cutter passes.

Notation: d [mm] depth, F_n [N] force normal to the surface, as in :mod:`chipload.planning.thinwall.depth`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.planning.thinwall.depth import DepthRange, Measure, normal_force
from chipload.planning.thinwall.flank_stock import Pose

Floats = NDArray[np.float64]

#: depths of a table in a decade
A_DECADE = 128


@dataclass(frozen=True, eq=False)
class ForceTable:
    """Normal force F_n(d) in a table over geometrically spaced depths, linear between them.

    Attributes
    ----------
    limits : smallest and greatest depth
    depths, forces : (k,) float [mm], [N]; the force is the greatest up to that depth, so that it rises
    """

    limits: DepthRange
    depths: Floats
    forces: Floats

    def force(self, depth: ArrayLike) -> Floats:
        """Normal force F_n (...) [N]; below the smallest depth linear to 0, which is a little too small."""
        d = np.concatenate([[0.0], self.depths])
        return np.asarray(np.interp(np.asarray(depth, dtype=np.float64), d, np.concatenate([[0.0], self.forces])))

    def depth(self, threshold: ArrayLike) -> Floats:
        """Largest depth (...) [mm] whose force is at most the threshold; 0 where infeasible."""
        F = np.asarray(threshold, dtype=np.float64)
        rising = self.forces + 1e-12 * self.forces[-1] * np.arange(len(self.forces))
        return np.asarray(np.where(rising[0] > F, 0.0, np.interp(F, rising, self.depths)))


def law_of(
    posture: Pose, material: Material, limits: DepthRange, *, measure: Measure, looks: int | None = None
) -> ForceTable:
    """Table of F_n with 128 depths a decade; between them it is within 1e-4 of :func:`normal_force`."""
    if limits.greatest > posture.deepest:
        raise InputError(
            f"depth_max_mm = {limits.greatest:g}: must be at most {posture.deepest:.6g}, {posture.deepest_is}"
        )
    decades = math.log10(limits.greatest / limits.smallest)
    d = np.geomspace(limits.smallest, limits.greatest, looks or math.ceil(A_DECADE * decades) + 2)
    return ForceTable(limits, d, np.maximum.accumulate(normal_force(posture, material, d, measure=measure)))


def law_on_stock(
    posture: Pose, material: Material, limits: DepthRange, *, slope: float, scallop: float, measure: Measure
) -> ForceTable:
    """Table of F_n on uneven stock: deeper beside the contact point, with scallops of the pass before.

    Stock whose slope is at most L and whose scallops are at most c high is nowhere deeper than d + c + L sqrt(2 r (d +
    c)) within the reach sqrt(2 r (d + c)) of the cutter. The force is that of this depth, an upper bound.

    Parameters
    ----------
    slope : L, at least 0
    scallop : c, at least 0 [mm]

    Raises
    ------
    InputError
        The greatest depth, so deepened, is beyond the corner of the cutter.
    """

    def met(d: Floats) -> Floats:
        return np.asarray(d + scallop + slope * np.sqrt(2.0 * posture.meets * (d + scallop)))

    deepest = float(met(np.array(limits.greatest)))
    if deepest > posture.deepest:
        raise InputError(
            f"depth_max_mm = {limits.greatest:g}: the cutter meets stock of {deepest:.4g} mm with scallops of "
            f"{scallop:.3g} mm and a slope of {slope:g}: must be at most {posture.deepest:.4g}, {posture.deepest_is}"
        )
    plane = law_of(posture, material, DepthRange(limits.smallest, deepest, limits.tolerance), measure=measure)
    d = np.geomspace(limits.smallest, limits.greatest, len(plane.depths))
    return ForceTable(limits, d, plane.force(met(d)))


def greatest_law(
    poses: Sequence[Pose],
    material: Material,
    limits: DepthRange,
    *,
    slope: float,
    scallop: float,
    measure: Measure,
) -> tuple[ForceTable, int]:
    """Table of the greatest F_n of several poses, and the number of the pose with the greatest force at the greatest
    depth.

    Parameters
    ----------
    poses : at least one
    slope, scallop, measure : as of :func:`law_on_stock`

    Raises
    ------
    InputError
        As of :func:`law_on_stock`.
    """
    each = [law_on_stock(pose, material, limits, slope=slope, scallop=scallop, measure=measure) for pose in poses]
    worst = int(np.argmax([one.forces[-1] for one in each]))
    return ForceTable(limits, each[0].depths, np.max([one.forces for one in each], axis=0)), worst
