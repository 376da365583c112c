"""Form error of a floor that an upright cutter with a flat bottom makes, by the deflection of the floor.

Notation: q point of the floor; a radius of the flat of the bottom; c centre of the cutter in a step, where it is
nearest to q; w motion of the floor along the normal at q, positive where it is pushed away from the cutter.

An edge passes over q whenever q lies under the flat, |q - c| <= a, at the rotation at which the edge has the direction
of q - c. A floor that is pulled towards the cutter at such a moment is cut too deep there, and no later passage
corrects it; one that is pushed away keeps material, which a later edge may cut again or only rub. The error is
therefore a bound: the deepest of all passages where the floor is pulled, else what the first passages leave, those of
the steps whose front edge comes to q.

Steps that do not cut count as absent. The floor deflects at q as if the force acted there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutting.force import forces_over_turn, in_work
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.simulation.loads import Cuts

Floats = NDArray[np.float64]

#: rotations between which the force is interpolated [rad]
TURN = math.radians(0.5)
#: a point so near to the circle of the flat [mm] lies under it
NEAR = 1e-3
#: square of the length of a step that does not move across its axis [mm^2]
SHORT = 1e-12
#: the front edge comes to a point in a step whose flat ends so near to it, in lengths of the step
FRONT = 1.0


@dataclass(frozen=True, eq=False)
class FloorError:
    """Form error of points of a floor.

    Attributes
    ----------
    error : (p,) float [mm], positive where material is left
    made : (p,) bool, whether a step that cuts passes over the point
    """

    error: Floats
    made: NDArray[np.bool_]


def floor_error(
    all_cuts: Sequence[Cuts], material: Material, points: ArrayLike, motion: ArrayLike, below: float
) -> FloorError:
    """Return the form error of points of a level floor.

    Parameters
    ----------
    all_cuts : of the last pass, upright cutters
    points : (p, 3) float [mm]
    motion : (p, 3) float [mm/N], displacement along the normal at each point under a force of 1 N along x, y and z
    below : steps whose tip is at most so far over the floor [mm] make it

    Raises
    ------
    InputError
        A cutter is not upright, or has no flat bottom.
    """
    q, C = np.asarray(points, dtype=np.float64), np.asarray(motion, dtype=np.float64)
    deepest, left = np.zeros(len(q)), np.zeros(len(q))
    made = np.zeros(len(q), dtype=np.bool_)
    tree = scipy.spatial.cKDTree(q[:, :2])
    for cuts in all_cuts:
        flat = cuts.cutter.flat_radius
        if not flat > 0.0 or float(cuts.ends[:, [8, 11]].min()) < 1.0 - 1e-9:
            raise InputError("floor_error: a cutter leans, or has no flat bottom: only upright end mills make floors")
        pitch = math.tau / cuts.cutter.flutes if cuts.cutter.teeth_alike else math.tau
        count = math.ceil(pitch / TURN)
        theta = np.arange(count) * (pitch / count)
        force = in_work(forces_over_turn(cuts.engagement, cuts.cutter, material, theta)[0], cuts.engagement.frames)
        p0, travel, frame = cuts.ends[:, :3], cuts.ends[:, 3:6] - cuts.ends[:, :3], cuts.engagement.frames
        length = np.linalg.norm(travel[:, :2], axis=1)
        reach = flat + NEAR + 0.5 * length
        for k, near in enumerate(tree.query_ball_point(p0[:, :2] + 0.5 * travel[:, :2], reach)):
            some = np.array(near, dtype=np.int64)
            # the centre of the cutter where it is nearest to each point
            t = np.clip((q[some, :2] - p0[k, :2]) @ travel[k, :2] / max(length[k] ** 2, SHORT), 0.0, 1.0)
            off = q[some] - p0[k] - t[:, None] * travel[k]
            passed = (np.hypot(off[:, 0], off[:, 1]) <= flat + NEAR) & (np.abs(off[:, 2]) <= below)
            some, off = some[passed], off[passed]
            if not len(some):
                continue
            along, across = off @ frame[k, 0], off @ frame[k, 1]
            at = (np.arctan2(along, across) % pitch) / pitch * count
            low = at.astype(np.int64)
            share, low = (at - low)[:, None], low % count
            F = (1.0 - share) * force[k, low] + share * force[k, (low + 1) % count]
            w = (C[some] * F).sum(axis=1)
            deepest[some] = np.minimum(deepest[some], w)
            first = (np.hypot(along, across) >= flat - FRONT * length[k]) & (along >= -NEAR)
            left[some] = np.where(first, np.maximum(left[some], w), left[some])
            made[some] = True
    return FloorError(np.where(-deepest > left, deepest, left), made)
