"""Largest depth of cut whose force normal to the surface is at most a threshold.

Notation: d [mm] depth of cut; F_n [N] force along the surface normal over a revolution of the spindle, by the force
model with the tooth engagement of :mod:`chipload.planning.thinwall.plane_stock`: its greatest size, or the size of its
mean; F_th [N] threshold; f_z [mm] feed per tooth.

F_n(d) is calculated from d_min to d_max. The result is the greatest d up to which F_n <= F_th everywhere, found to
``tolerance`` by bracketing and false position (Illinois), from below. A place where F_n(d_min) > F_th is infeasible. If
the edge force alone, f_z -> 0, is below F_th there, a smaller feed makes the place feasible; else a smaller cutter may.

Reference: [Yan2018] for the idea; the closed form of a ball upright in a slot, radial terms, is the test.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutting.force import forces_over_turn, mean_forces
from chipload.cutting.material import Material
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError
from chipload.planning.thinwall.end_stock import EndPose
from chipload.planning.thinwall.flank_stock import FlankPose, Pose
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.progress import Progress, silent

Floats = NDArray[np.float64]
Measure = Literal["greatest", "mean"]

#: what limits a depth: values of ``Depths.status``
THRESHOLD, DEEPEST, INFEASIBLE = 0, 1, 2
#: depths at which the force is calculated before the equation is solved
LOOKS = 49
#: ratio to the feed per tooth of a feed at which only the edge force is left
NO_FEED = 1e-6
#: rotations between which the greatest force is searched; the engagement of a flank or an end begins and ends abruptly
STEP_DEG, FLANK_STEP_DEG = 1.0, 0.25
#: factor on the number of nodes on the flank arc of a barrel, of which a row touches a small part (0.7 % of the mean)
BARREL_NODES = 4
#: depths whose tooth engagement is in memory at once
BLOCK = 256


@dataclass(frozen=True)
class DepthRange:
    """Smallest and greatest depth [mm], and the tolerance of the solution [mm]."""

    smallest: float
    greatest: float
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        if not 0.0 < self.smallest < self.greatest < math.inf:
            raise InputError(
                f"depth_min_mm = {self.smallest:g}: must be above 0 and below depth_max_mm = {self.greatest:g}"
            )
        if not self.tolerance > 0.0:
            raise InputError(f"depth tolerance_mm = {self.tolerance:g}: must be above 0")


@dataclass(frozen=True)
class Infeasible:
    """A place whose threshold is exceeded even at the smallest depth.

    Attributes
    ----------
    place : its number
    threshold, force, edge_force : [N], the last two at the smallest depth; the edge alone
    feed_per_tooth : [mm] that would make it feasible; None: none would
    diameter : [mm] of a cutter of the same shape that would; None: not calculated (a feed does), or none would
    """

    place: int
    threshold: float
    force: float
    edge_force: float
    feed_per_tooth: float | None
    diameter: float | None


@dataclass(frozen=True, eq=False)
class Depths:
    """Depths of cut at places, their forces, and what limits them.

    Attributes
    ----------
    depth : (p,) float [mm]; 0 where infeasible
    force : (p,) float [N], F_n there; that of the smallest depth where infeasible
    status : (p,) int, THRESHOLD, DEEPEST or INFEASIBLE
    infeasible : those places, with what would help
    """

    depth: Floats
    force: Floats
    status: NDArray[np.int64]
    infeasible: tuple[Infeasible, ...]


def normal_force(
    posture: Pose,
    material: Material,
    depths: ArrayLike,
    *,
    measure: Measure,
    nodes: int | None = None,
    step_deg: float | None = None,
) -> Floats:
    """Normal force F_n of depths (n,) [mm], (n,) float [N].

    Parameters
    ----------
    measure : ``greatest`` size over the revolution, or the size of the ``mean``
    nodes : as of :func:`chipload.planning.thinwall.plane_stock.engagement_of_depths`; None: 8 of a mean (1e-4 of a
        ball's), 16 of the greatest (1 to 4 % too great: the engagement begins and ends abruptly)
    step_deg : between the rotations at which the greatest is searched; None: 1, of a flank or an end 0.25

    Examples
    --------
    Ball of 5 mm upright in a slot: h = f_z sin(phi) gives N Krc f_z (2 d - d^2 / R) / (2 pi) at d = 0.5,
    4 * 600 * 0.05 * 0.95 / (2 pi). The chips between the paths of its teeth are 2 % thicker.

    >>> from chipload.cutter.cutter import Cutter
    >>> ball = Cutter(10.0, 4, 0.0, 20.0, 30.0, 6e5, corner_radius=5.0)
    >>> plain = Material("plain", 1500.0, 600.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example")
    >>> from chipload.planning.thinwall.plane_stock import CutterPose
    >>> normal_force(CutterPose(ball, 0.05, None), plain, [0.5], measure="mean").round(4).tolist()
    [18.4627]
    >>> round(4 * 600 * 0.05 * 0.95 / math.tau, 4)
    18.1437
    """
    if measure not in ("greatest", "mean"):
        raise InputError(f"measure = {measure!r}: must be greatest or mean")
    d = np.atleast_1d(np.asarray(depths, dtype=np.float64))
    out = np.empty(len(d))
    N = posture.frame[:, 2]
    cutter = posture.cutter
    turn = math.tau / (cutter.flutes if cutter.teeth_alike else 1)
    own = BARREL_NODES if cutter.flank_arc is not None else 1
    apart = step_deg or (STEP_DEG if isinstance(posture, CutterPose) else FLANK_STEP_DEG)
    theta = np.linspace(0.0, turn, max(8, math.ceil(math.degrees(turn) / apart)), endpoint=False)
    for at in range(0, len(d), BLOCK):
        engagement = posture.engagement(d[at : at + BLOCK], nodes or own * (8 if measure == "mean" else 16))
        chips = chips_of_teeth(engagement, cutter)
        if measure == "mean":
            out[at : at + BLOCK] = np.abs(mean_forces(chips, cutter, material)[0] @ N)
        else:
            force = forces_over_turn(chips, cutter, material, theta)[0]
            out[at : at + BLOCK] = np.abs(force @ N).max(axis=1)
    return out


def largest_depths(
    posture: Pose,
    material: Material,
    thresholds: ArrayLike,
    limits: DepthRange,
    *,
    measure: Measure,
    progress: Progress = silent,
) -> Depths:
    """Largest depths of cut at places with thresholds (p,) [N].

    Raises
    ------
    InputError
        A threshold is not above 0, or the greatest depth is beyond the corner of the cutter.
    """
    F_th = np.atleast_1d(np.asarray(thresholds, dtype=np.float64))
    if not ((F_th > 0.0) & np.isfinite(F_th)).all():
        raise InputError("threshold: a place of the wall has no threshold above 0 N")
    if limits.greatest > posture.deepest:
        raise InputError(
            f"depth_max_mm = {limits.greatest:g}: must be at most {posture.deepest:.6g}, {posture.deepest_is}"
        )

    def force(d: Floats) -> Floats:
        return normal_force(posture, material, d, measure=measure)

    looks = np.geomspace(limits.smallest, limits.greatest, LOOKS)
    F = force(looks)
    rising = np.maximum.accumulate(F)
    value, back = np.unique(F_th, return_inverse=True)
    above = np.searchsorted(rising, value, side="right")  # first look whose force is above the threshold
    depth = np.where(above == LOOKS, limits.greatest, 0.0)
    found = np.where(above == LOOKS, F[-1], F[0])
    solve = np.flatnonzero((above > 0) & (above < LOOKS))
    if len(solve):
        k = above[solve]
        depth[solve], found[solve] = _depth_below_crossing(
            force, value[solve], looks[k - 1], looks[k], F[k - 1], F[k], limits.tolerance, progress
        )
    status = np.where(above == LOOKS, DEEPEST, np.where(above == 0, INFEASIBLE, THRESHOLD))
    helped: dict[int, tuple[float, float | None, float | None]] = {
        int(i): _helps(posture, material, float(value[i]), limits.smallest, measure) for i in np.flatnonzero(above == 0)
    }
    infeasible = tuple(
        Infeasible(int(i), float(F_th[i]), float(F[0]), *helped[int(back[i])])
        for i in np.flatnonzero(status[back] == INFEASIBLE)
    )
    return Depths(depth[back], found[back], status[back], infeasible)


def _depth_below_crossing(
    force: Callable[[Floats], Floats],
    target: Floats,
    low: Floats,
    high: Floats,
    F_low: Floats,
    F_high: Floats,
    tolerance: float,
    progress: Progress,
) -> tuple[Floats, Floats]:
    """Depth within ``tolerance`` below the crossing, and the force there; Illinois, many at once."""
    low, high, true_low = low.copy(), high.copy(), F_low.copy()
    a, b = F_low - target, F_high - target
    last = np.zeros(len(low), dtype=np.int64)
    for turn in range(200):
        open_ = np.flatnonzero(high - low > tolerance)
        if not len(open_):
            break
        progress(min(turn / 12.0, 1.0), "depths")
        o = open_
        d = (low[o] * b[o] - high[o] * a[o]) / (b[o] - a[o])
        # towards the end look on either side of the root, so that the bracket shuts from both sides
        d = np.where(last[o] >= 0, d - 0.4 * tolerance, d + 0.4 * tolerance)
        d = np.where((d > low[o]) & (d < high[o]) & (turn % 3 != 2), d, 0.5 * (low[o] + high[o]))
        F = force(d)
        excess = F - target[o]
        under = excess <= 0.0
        u, v = o[under], o[~under]
        low[u], a[u], true_low[u] = d[under], excess[under], F[under]
        high[v], b[v] = d[~under], excess[~under]
        b[u] = np.where(last[u] == -1, 0.5 * b[u], b[u])
        a[v] = np.where(last[v] == 1, 0.5 * a[v], a[v])
        last[u], last[v] = -1, 1
    return low, true_low


def _helps(
    posture: Pose, material: Material, threshold: float, depth: float, measure: Measure
) -> tuple[float, float | None, float | None]:
    """What makes an infeasible place feasible.

    Returns
    -------
    Force [N] of the edge alone at ``depth`` [mm]; feed per tooth [mm] at which the force is the threshold [N], None:
    none; diameter [mm] of a cutter of the same shape at which it is, None: none, or a feed is enough
    """

    def at_feed(feed: float) -> float:
        return float(normal_force(replace(posture, feed_per_tooth=feed), material, [depth], measure=measure)[0])

    least = NO_FEED * posture.feed_per_tooth
    edge = at_feed(least)
    if edge <= threshold:
        return edge, _bisect(at_feed, threshold, least, posture.feed_per_tooth), None

    def at_diameter(diameter: float) -> float:
        return float(normal_force(_scale_pose(posture, diameter), material, [depth], measure=measure)[0])

    ratio = _least_share(posture, depth)
    smallest = 1.001 * ratio * posture.cutter.diameter
    if smallest >= posture.cutter.diameter or at_diameter(smallest) > threshold:
        return edge, None, None
    return edge, None, _bisect(at_diameter, threshold, smallest, posture.cutter.diameter)


def _least_share(posture: Pose, depth: float) -> float:
    """Ratio of the least diameter of a cutter of this shape that can cut the depth and step-over [mm] to its own."""
    if isinstance(posture, FlankPose):
        return depth / posture.deepest
    step, cutter = abs(posture.step or 0.0), posture.cutter
    if isinstance(posture, EndPose):  # the flat of the bottom covers the step-over
        return step / (cutter.diameter - 2.0 * cutter.corner_radius)
    return max(depth / posture.deepest, step / cutter.diameter)


def _scale_pose(posture: Pose, diameter: float) -> Pose:
    """The pose with a cutter of another diameter [mm] and the same shape; a barrel is scaled with its flutes."""
    cutter = posture.cutter
    ratio, barrel = diameter / cutter.diameter, cutter.barrel_radius
    other = replace(
        cutter,
        diameter=diameter,
        corner_radius=ratio * cutter.corner_radius,
        corner_e=None if barrel is None else ratio * cutter.apt[2],
        corner_f=None,
        barrel_radius=None if barrel is None else ratio * barrel,
        flute_length=cutter.flute_length if barrel is None else ratio * cutter.flute_length,
        shank_diameter=None,
    )
    return replace(posture, cutter=other)


def _bisect(function: Callable[[float], float], target: float, low: float, high: float) -> float:
    """Largest value found with function <= target, which holds at ``low`` and does not at ``high``."""
    for _ in range(40):
        if high - low <= 1e-6 * high:
            break
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) <= target else (low, middle)
    return low
