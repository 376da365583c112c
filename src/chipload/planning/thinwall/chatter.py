"""Stable depths of cut at places of a wall, at a spindle speed and in a state of removal.

Notation: Phi (p, 3, m) [1/sqrt(t)] mode shapes of the wall at its places, as vectors in the frame of the wall. The
cutter has modes of its own, the same in every direction across its axis. All modes count for the distance between
cutter and wall. A depth is stable where the greatest multiplier of the cut, with its force times the required margin,
is below 1. The chip is that of :mod:`chipload.planning.thinwall.plane_stock`; cutter and wall move in three directions.

The search for the stable depth goes from small to large depths. Stability is not monotone in the depth, and a pass cuts
every depth below its own somewhere, so the first depth that chatters ends the search.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.planning.thinwall.depth import DepthRange
from chipload.planning.thinwall.plane_stock import CutterPose, engagement_of_depths
from chipload.stability.cuts import DynamicCuts, dynamic_cuts
from chipload.stability.margin import PER_WAVE, SPARE, STILL, largest_multipliers
from chipload.stability.modes import Modes

Floats = NDArray[np.float64]

#: tested depths, bisections between the last stable depth and the next one, nodes of the chip's profile
LOOKS, HALVINGS, NODES = 8, 4, 4
#: greatest number of places by which a speed is chosen: those at which a mode moves most
WORST = 4


@dataclass(frozen=True, eq=False)
class WallMotion:
    """Modes of the wall at some places in one state.

    Parameters
    ----------
    frequency : (m,) float [Hz]
    shapes : (p, 3, m) float [1/sqrt(t)]
    frames : (p, 3, 3) float, rows: feed, left of it and outward normal of each place
    """

    frequency: Floats
    shapes: Floats
    frames: Floats

    def __len__(self) -> int:
        return len(self.shapes)

    def chosen(self, index: NDArray[np.int64]) -> WallMotion:
        """Some of the places."""
        return WallMotion(self.frequency, self.shapes[index], self.frames[index])

    @property
    def worst(self) -> NDArray[np.int64]:
        """Numbers of the places at which the first modes have the greatest normal displacement."""
        size = np.abs(np.einsum("pj,pjm->pm", self.frames[:, 2], self.shapes))
        return np.unique(size.argmax(axis=0)[:WORST])


@dataclass(frozen=True, eq=False)
class WallCutting:
    """Cutter, material and damping of the cut of a wall, and the required stability margin.

    Parameters
    ----------
    posture : cutter, feed per tooth, step-over, lead and tilt
    material : whose coefficients count
    cutter_modes : each counts in both directions across the axis; None: the cutter is rigid
    damping : damping ratio of the wall's modes
    margin : factor on the cutting force with which the cut must be stable
    """

    posture: CutterPose
    material: Material
    cutter_modes: Modes | None
    damping: float
    margin: float

    def __post_init__(self) -> None:
        if not 0.0 < self.damping < 1.0:
            raise InputError(f"dynamics.damping_ratio = {self.damping:g}: must be above 0 and below 1")
        if not self.margin >= 1.0:
            raise InputError(f"dynamics.margin = {self.margin:g}: must be at least 1")

    def vibrating(self, cuts: DynamicCuts, wall: WallMotion, frames: Floats) -> DynamicCuts:
        """Cuts (p,) with the modes of cutter and wall, one for each place; ``frames`` (p, 3, 3) rows T, n, A."""
        damping, omega, U = [], [], []
        if self.cutter_modes is not None:
            own = self.cutter_modes
            across = np.concatenate(
                [np.eye(3)[:, :1] / np.sqrt(own.mass), np.eye(3)[:, 1:2] / np.sqrt(own.mass)], axis=1
            )
            damping.append(np.tile(own.damping, 2))
            omega.append(np.tile(own.omega, 2))
            U.append(np.tile(across, (len(cuts), 1, 1)))
        damping.append(np.full(len(wall.frequency), self.damping))
        omega.append(math.tau * wall.frequency)
        U.append(np.einsum("paj,pjm->pam", frames, wall.shapes))
        whole = np.tile(np.concatenate(omega), (len(cuts), 1))
        return cuts.with_modes(np.concatenate(damping), whole, np.concatenate(U, axis=2))

    def bare(self, depths: Floats, speed: float) -> DynamicCuts:
        """Cuts of depths on even stock at a speed [rad/s], without modes."""
        pose = self.posture
        met = engagement_of_depths(pose, depths, NODES)
        T, n, A = (np.tile(row, (len(met), 1)) for row in pose.frame)
        return dynamic_cuts(met, pose.cutter, self.material, None, speed, T, n, A=A, directions=3)

    def stable(self, cuts: DynamicCuts, wall: WallMotion) -> NDArray[np.bool_]:
        """Whether the cut at each place is stable at the required margin, (p,) bool."""
        frames = np.einsum("ab,pbj->paj", self.posture.frame, wall.frames)
        some = self.vibrating(cuts, wall, frames)
        most = 2 * len(some.damping) + SPARE
        found = largest_multipliers(some, self.margin, per_wave=PER_WAVE, most=most, still=STILL)
        return np.asarray(np.abs(found) < 1.0)


def stable_depths(
    cutting: WallCutting, walls: Sequence[WallMotion], limits: DepthRange, speed: float, halvings: int = HALVINGS
) -> Floats:
    """Greatest depth (p,) [mm] up to which each place is stable in all states; 0 where the smallest depth chatters.

    Parameters
    ----------
    walls : the same places in several states
    limits : smallest and greatest depth
    speed : of the spindle [rad/s]
    halvings : bisections between two tested depths
    """
    count = len(walls[0])
    looks = np.geomspace(limits.smallest, limits.greatest, LOOKS)
    bare = cutting.bare(looks, speed)
    out, above = np.zeros(count), np.full(count, np.nan)
    alive = np.arange(count)
    for k in range(LOOKS):
        good = _stable_in_all(cutting, walls, bare.chosen(np.full(len(alive), k)), alive)
        above[alive[~good]] = looks[k]
        alive = alive[good]
        out[alive] = looks[k]
        if not len(alive):
            break
    between = np.flatnonzero((out > 0.0) & ~np.isnan(above))
    for _ in range(halvings if len(between) else 0):
        middle = 0.5 * (out[between] + above[between])
        good = _stable_in_all(cutting, walls, cutting.bare(middle, speed), between)
        out[between[good]], above[between[~good]] = middle[good], middle[~good]
    return out


def _stable_in_all(
    cutting: WallCutting, walls: Sequence[WallMotion], cuts: DynamicCuts, places: NDArray[np.int64]
) -> NDArray[np.bool_]:
    good = np.ones(len(places), dtype=np.bool_)
    for wall in walls:
        left = np.flatnonzero(good)
        if len(left):
            good[left] = cutting.stable(cuts.chosen(left), wall.chosen(places[left]))
    return good


def quietest_speed(
    cutting: WallCutting, walls: Sequence[WallMotion], limits: DepthRange, speeds: Floats, present: float
) -> float:
    """Spindle speed [rad/s] at which the least stable depth is greatest. Of equally good speeds it is the nearest to
    the present one. The places are those at which a mode of the wall moves most.
    """
    at = np.unique(np.concatenate([wall.worst for wall in walls]))
    some = [wall.chosen(at) for wall in walls]
    least = np.array([stable_depths(cutting, some, limits, float(s), 0).min() for s in speeds])
    good = np.flatnonzero(least >= least.max() * (1.0 - 1e-9))
    return float(speeds[good[np.argmin(np.abs(speeds[good] - present))]])
