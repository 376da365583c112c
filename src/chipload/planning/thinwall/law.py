"""Force and depth of cut in a table, for the many places of a wall that one posture of the cutter passes.

Notation: d [mm] depth, F_n [N] force normal to the surface, as in :mod:`chipload.planning.thinwall.depth`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.planning.thinwall.depth import Limits, Measure, normal_force
from chipload.planning.thinwall.engaged import Posture

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Law:
    """F_n(d) in a table, for the many places of a wall: straight between depths in a geometric row.

    Attributes
    ----------
    limits : smallest and greatest depth
    depths, forces : (k,) float [mm], [N]; the force is the greatest up to that depth, so that it rises
    """

    limits: Limits
    depths: Floats
    forces: Floats

    def force(self, depth: ArrayLike) -> Floats:
        """F_n (...) [N]; below the smallest depth straight to 0 (rather too small)."""
        d = np.concatenate([[0.0], self.depths])
        return np.asarray(np.interp(np.asarray(depth, dtype=np.float64), d, np.concatenate([[0.0], self.forces])))

    def depth(self, threshold: ArrayLike) -> Floats:
        """Largest depth (...) [mm] whose force is at most the threshold; 0 where infeasible."""
        F = np.asarray(threshold, dtype=np.float64)
        rising = self.forces + 1e-12 * self.forces[-1] * np.arange(len(self.forces))
        return np.asarray(np.where(rising[0] > F, 0.0, np.interp(F, rising, self.depths)))


def law_of(posture: Posture, material: Material, limits: Limits, *, measure: Measure, looks: int = 257) -> Law:
    """Table of F_n; between 257 depths over two decades it is right to 1e-4 of what :func:`normal_force` says."""
    if limits.greatest > posture.deepest:
        raise InputError(
            f"depth_max_mm = {limits.greatest:g}: must be at most {posture.deepest:.6g}, where the flank begins to cut"
        )
    d = np.geomspace(limits.smallest, limits.greatest, looks)
    return Law(limits, d, np.maximum.accumulate(normal_force(posture, material, d, measure=measure)))
