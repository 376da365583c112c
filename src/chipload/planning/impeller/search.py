"""Largest cutter of a corner radius at every contact point and table angle, with a proof.

Notation: R cutter radius, r corner radius, rho = R - r; alpha table angle, B pallet angle [rad]. For each contact point
and table angle rho* = max over B of min over the check points of their limit (``closed_form.py``).

Method: a coarse grid of B, then a local search from the best B of the grid. Then the exact arcs of B that the limiting
check points (blockers) forbid to rho* + eps are united. If they cover all B, the blockers prove the bound. If they
leave a range, its middle has a larger cutter or a new blocker. Ranges narrower than ``least`` are not counted: no
machine holds B to that.

Reference: [Wu2019]. Differs from source: the result does not depend on a grid of B; every radius at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.planning.impeller.blocks import BLOCK, in_blocks
from chipload.planning.impeller.scene import Floats, Ints, Scene
from chipload.progress import Progress, silent

_largest_cutter = LateModule("chipload.planning.impeller._largest_cutter")

#: all pallet angles [rad]
FULL = ((0.0, 2.0 * math.pi),)
#: a limiting point of a proof that is no check point but the surface's curvature at the contact
CURVATURE = -2


@dataclass(frozen=True)
class Sampling:
    """Resolution of the search over the pallet angle.

    Parameters
    ----------
    eps : rho* is proved to this [mm], > 0
    step : of the coarse grid of B [rad], > 0; the proof does not depend on it
    least : gaps of B narrower than this [rad] are not counted, > 0
    blockers : most check points in one proof
    """

    eps: float = 1e-3
    step: float = math.radians(15.0)
    least: float = 1e-9
    blockers: int = 128

    def __post_init__(self) -> None:
        for name, unit in (("eps", "mm"), ("step", "rad"), ("least", "rad")):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InputError(f"sampling.{name}_{unit} = {value:g}: must be above 0")
        if self.blockers < 8:
            raise InputError(f"sampling.blockers = {self.blockers}: must be at least 8")


@dataclass(frozen=True, eq=False)
class SearchLimits:
    """Largest rho at each contact point (rows) and table angle (columns), of one corner radius.

    Parameters
    ----------
    corner_radius : r [mm]
    tables : alpha (t,) [rad]
    rho : (c, t) float [mm], reached at ``pallet``; -inf where the table angle never faces the surface
    bound : (c, t) float [mm], no B takes it; at ``cap`` the search ended
    pallet : B (c, t) [rad]
    certified : (c, t) bool, ``bound`` is proved
    blockers : (c, t, k) int, check points whose arcs prove it, padded with -1; :data:`CURVATURE`
    cap : [mm] the search does not look for more
    floor : [mm] below it only the proof was sought that ``floor`` does not fit
    """

    corner_radius: float
    tables: Floats
    rho: Floats
    bound: Floats
    pallet: Floats
    certified: NDArray[np.bool_]
    blockers: Ints
    cap: float
    floor: float

    @property
    def best(self) -> Ints:
        """Table angle (c,) with the largest rho of each contact point."""
        out: Ints = self.rho.argmax(axis=1)
        return out


def limits(
    scene: Scene,
    tables: ArrayLike,
    corner_radius: float,
    cap: float,
    floor: float = 0.0,
    cut: float = math.inf,
    every: bool = True,
    pallets: ArrayLike = FULL,
    sampling: Sampling | None = None,
    workers: int = 1,
    progress: Progress = silent,
    points: ArrayLike | None = None,
) -> SearchLimits:
    """Largest rho of one corner radius at each contact point and table angle.

    Parameters
    ----------
    tables : alpha (t,) [rad], 0 <= alpha <= pi
    corner_radius : r [mm], >= 0
    cap, floor : [mm] largest and smallest rho of interest, 0 <= floor <= cap
    cut : height of the cutting part above the corner's centres [mm]; what is above is not tested
    every : each table angle to its own rho*; else only proved that it takes none larger than the best one
    pallets : (k, 2) [rad], where B may be, ascending, apart, within one turn
    workers : threads
    points : (c,) int, which contact points; None: all. A contact point has the same result in any selection

    Raises
    ------
    InputError
        A number is out of range.
    Cancelled
        By ``progress``.
    """
    how = sampling or Sampling()
    alpha = np.atleast_1d(np.asarray(tables, dtype=np.float64))
    spans = np.ascontiguousarray(np.asarray(pallets, dtype=np.float64).reshape(-1, 2))
    if alpha.ndim != 1 or len(alpha) == 0 or not ((alpha >= 0.0) & (alpha <= math.pi)).all():
        raise InputError("tables: must be angles from 0 to pi, at least one")
    ends = spans.reshape(-1)
    if len(ends) == 0 or (np.diff(ends) < 0.0).any() or ends[-1] - ends[0] > 2.0 * math.pi + 1e-9:
        raise InputError("pallets: must be ascending ranges, apart, within one turn")
    if not 0.0 <= corner_radius < math.inf or not 0.0 <= floor <= cap < math.inf:
        raise InputError(f"corner_radius {corner_radius:g}, floor {floor:g}, cap {cap:g}: must be 0 <= floor <= cap")
    which = np.arange(len(scene.contact)) if points is None else np.asarray(points, dtype=np.int64)
    c, t = len(which), len(alpha)
    rho, bound, pallet = np.full((c, t), -np.inf), np.full((c, t), -np.inf), np.zeros((c, t))
    proved = np.ones((c, t), dtype=np.bool_)
    proof = np.full((c, t, how.blockers), -1, dtype=np.int64)
    round_enough = corner_radius * scene.curvature_max[which] < 1.0
    rows = np.ascontiguousarray(scene.rows[which[round_enough]])
    part = tuple(np.ascontiguousarray(x[round_enough]) for x in (rho, pallet, bound, proved, proof))
    tree = scene.tree
    points, own = scene.ordered, scene.own
    cones = np.column_stack([np.sin(alpha), np.cos(alpha)])
    tool = np.array([corner_radius, cut, scene.near**2])

    def block(first: int) -> None:
        _largest_cutter.search(
            points, own, tree.nodes, tree.spans, tree.leaves, rows, cones, tool, spans, floor, cap, how.eps, how.least,
            how.step, every, first, min(first + BLOCK, len(rows)), *part,
        )  # fmt: skip

    in_blocks(block, len(rows), workers, progress, f"largest cutters, corner radius {corner_radius:g} mm")
    for whole, some in zip((rho, pallet, bound, proved, proof), part, strict=True):
        whole[round_enough] = some
    blockers = np.where(proof >= 0, tree.order[np.maximum(proof, 0)] if len(points) else proof, proof)
    blockers[~round_enough, :, 0] = CURVATURE
    used = max(int((blockers != -1).sum(axis=2).max()), 1)
    return SearchLimits(corner_radius, alpha, rho, bound, pallet, proved, blockers[:, :, :used], cap, floor)
