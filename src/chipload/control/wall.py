"""Deflection of a thin wall under a torque along a path, and the allowable torque at each place of the path.

Notation: k a step of the path; s_k [mm] the middle of its depth of cut along the wall, b_k its length there, f_k the
end of it that is nearer to the wall's free end; C_w [mm/N] the normal displacement of the wall at f_k under a unit
normal force that is spread over b_k and the width of the contact; C_t the compliance of the cutter in the middle of
b_k; g [MPa/N] the greatest equivalent stress of the wall under that force. Both loads of a step have a part of the edge
and a part that goes with the feed per tooth, o the override, w_0 / w the droop of the spindle:

    T(o) = T_e + T_c o w_0 / w      mean torque over a revolution,
    F(o) = F_e + F_c o w_0 / w      greatest force of a revolution on the surface that is left, along its normal.

F is convex in o, so between 0 and 1 the straight line lies above it, never below. The wall deflects by F (C_w + C_t);
its allowable force is F_lim = min(d / (C_w + C_t), S / g), which is reached at o_lim = (F_lim - F_e) / F_c, at a
torque of T(o_lim): the limit of torque is the least of these over the steps where o_lim is at most 1, or where it is
least if it nowhere is. Where a light cut allows less torque than that, so little of the round is cut: its feed is not
limited.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.control.plant import Outcome, TorqueProfile
from chipload.errors import InputError
from chipload.structure.shell import Ritz, compliance, greatest_stress

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: depths of cut that agree within so many mm are one
SAME_MM = 1e-3


@dataclass(frozen=True, eq=False)
class Loads:
    """Torque and force of n steps, each as an edge part and a cutting part, at the programmed feed.

    Parameters
    ----------
    torque_edge, torque_cut : (n,) float [N mm]
    force_edge, force_cut : (n,) float [N]
    """

    torque_edge: Floats
    torque_cut: Floats
    force_edge: Floats
    force_cut: Floats


def two_parts(torque: Floats, force: Floats, little_torque: Floats, little_force: Floats, little: float) -> Loads:
    """Return loads from those of the material and of one whose cutting coefficients are ``little`` times as great.

    A load is E + C with the material and E + little C with the other one, so C is their difference over 1 - little.

    Parameters
    ----------
    torque, little_torque : (n,) float [N mm]; force, little_force : (n,) float [N]
    little : above 0 and below 1

    Examples
    --------
    >>> one = np.array([1.0])
    >>> parts = two_parts(5 * one, 7 * one, 2 * one, 4 * one, 0.25)
    >>> parts.torque_edge.tolist(), parts.torque_cut.tolist(), parts.force_edge.tolist(), parts.force_cut.tolist()
    ([1.0], [4.0], [3.0], [4.0])
    """
    if not 0.0 < little < 1.0:
        raise InputError(f"two_parts: little = {little:g}: must be above 0 and below 1")
    torque_edge, torque_cut = edge_and_cut(torque, little_torque, little)
    return Loads(torque_edge, torque_cut, *edge_and_cut(force, little_force, little))


def edge_and_cut(whole: Floats, less: Floats, little: float) -> tuple[Floats, Floats]:
    """The part of the edge and the part that goes with the feed of something that is linear in both, see two_parts."""
    cut = np.clip((whole - less) / (1.0 - little), 0.0, whole)
    return whole - cut, cut


@dataclass(frozen=True, eq=False)
class UnitResponse:
    """Deflection and stress of a wall under a unit force at n steps; 0 for steps off the wall.

    Parameters
    ----------
    compliance : (n,) float [mm/N], C_w + C_t
    stress : (n,) float [MPa/N], g
    """

    compliance: Floats
    stress: Floats


def unit_response(modes: Ritz, near: Floats, far: Floats, width: float, tool: Floats) -> UnitResponse:
    """Return compliance and stress for depths of cut along a wall.

    Parameters
    ----------
    modes : of the wall, clamped at s = 0
    near, far : (n,) float [mm], s of the two ends of the depth of cut, near <= far; equal: the step is off the wall
    width : of the contact round the wall [mm]
    tool : (n,) float [mm/N], C_t

    Each different depth of cut costs one look at the stress; steps of one depth share it.
    """
    bounds = np.round(np.column_stack([near, far]) / SAME_MM) * SAME_MM
    bounds = np.clip(bounds, 0.0, modes.shell.length)
    some, place = np.unique(bounds, axis=0, return_inverse=True)
    wall, strained = np.zeros(len(some)), np.zeros(len(some))
    for k, (a, b) in enumerate(some.tolist()):
        if b > a:
            middle = 0.5 * (a + b)
            wall[k] = compliance(modes, middle, s_point=b, length=b - a, width=width)[2, 2]
            strained[k] = max(greatest_stress(modes, middle, b - a, width))
    place = place.ravel()
    on = bounds[:, 1] > bounds[:, 0]
    return UnitResponse(np.where(on, wall[place] + tool, 0.0), strained[place])


@dataclass(frozen=True, eq=False)
class LimitedResponse:
    """A limited response of a workpiece in n steps, as an edge part and a part proportional to the feed.

    Parameters
    ----------
    by : its name: ``deflection`` or ``strength``
    edge, cut : (n,) float, at the programmed feed
    most : its limit, in the same unit
    """

    by: str
    edge: Floats
    cut: Floats
    most: float


@dataclass(frozen=True, eq=False)
class PathLimit:
    """The allowable torque along a path.

    Parameters
    ----------
    torque : [N mm]; 0: not attainable, the edge alone is too much somewhere
    by : ``deflection`` or ``strength``, the name of a response
    step : where it is reached
    force : F_lim there [N]
    each : (n,) float [N mm], T(o_lim) of every step; inf where no response limits
    """

    torque: float
    by: str
    step: int
    force: float
    each: Floats


def path_limit(loads: Loads, wall: UnitResponse, deflection: float, stress: float) -> PathLimit:
    """Return the torque limit along a path; see the module.

    Parameters
    ----------
    loads, wall : of the same steps
    deflection, stress : that are allowed [mm], [MPa]

    Raises
    ------
    InputError
        Nothing is cut on the wall.
    """
    responses = (
        LimitedResponse(
            "deflection", wall.compliance * loads.force_edge, wall.compliance * loads.force_cut, deflection
        ),
        LimitedResponse("strength", wall.stress * loads.force_edge, wall.stress * loads.force_cut, stress),
    )
    found = limit_by_responses(loads, responses)
    if found is None:
        raise InputError(
            "torque_control.shell: the program cuts nothing from the wall: check its clamp_z_mm, radius and stock"
        )
    return found


def limit_by_responses(loads: Loads, responses: Sequence[LimitedResponse]) -> PathLimit | None:
    """Return the torque limit at which the first of some responses reaches its limit; None if no response rises.

    Parameters
    ----------
    loads : of the steps; the force is only for information
    responses : of the same steps

    Examples
    --------
    A block of 0.1 um/N under an edge force of 50 N that may deflect by 15 um: 150 N, so twice the 50 N of the feed.

    >>> one = np.array([1.0])
    >>> loads = Loads(100.0 * one, 400.0 * one, 50.0 * one, 50.0 * one)
    >>> bends = LimitedResponse("deflection", 5e-3 * one, 5e-3 * one, 15e-3)
    >>> round(limit_by_responses(loads, [bends]).torque, 6)
    900.0
    """
    each = np.full(len(loads.torque_cut), np.inf)
    override, first = each.copy(), np.zeros(len(each), dtype=np.int64)
    for k, response in enumerate(responses):
        rises = response.cut > 0.0
        own = np.divide(response.most - response.edge, response.cut, out=np.full(len(each), np.inf), where=rises)
        first[own < override] = k
        override = np.minimum(override, own)
    on = np.isfinite(override)
    if not on.any():
        return None
    each[on] = loads.torque_edge[on] + loads.torque_cut[on] * override[on]
    considered = override <= max(1.0, float(override.min()))
    k = int(np.argmin(np.where(considered, each, np.inf)))
    unattainable = float(override.min()) <= 0.0
    if unattainable:
        k = int(np.argmin(override))
    force = float(loads.force_edge[k] + loads.force_cut[k] * override[k])
    return PathLimit(0.0 if unattainable else float(each[k]), responses[first[k]].by, k, force, each)


def row_means(steps: Floats) -> Floats:
    """Return values (n + 1,) at the ends of n steps: the mean of both sides."""
    padded = np.concatenate([steps[:1], steps, steps[-1:]])
    return np.asarray(0.5 * (padded[1:] + padded[:-1]))


@dataclass(frozen=True, eq=False)
class WallPath:
    """Data of a wall along a path.

    Parameters
    ----------
    s : (n + 1,) float [mm], ends of the steps along the path
    edge, cut : (n + 1,) float [N], the two parts of F there; or of a response that is known itself
    compliance : (n,) float [mm/N], C_w + C_t of the steps that make the finished surface, 0 of others; of a response
        that is known itself, 1 and 0
    """

    s: Floats
    edge: Floats
    cut: Floats
    compliance: Floats


def wall_error(path: WallPath, programmed: TorqueProfile, outcome: Outcome, speed: float) -> Floats:
    """Return the total deflection of wall and cutter at each row of an outcome.

    Parameters
    ----------
    path : of the wall
    programmed : its feeds
    outcome : of a run along it
    speed : w_0 [rad/s]

    Returns
    -------
    (k,) float [mm], along the normal of the wall; 0 where no finished surface is made or nothing moves.
    """
    ratio = outcome.feed / np.interp(outcome.s, programmed.s, programmed.feed) * (speed / outcome.speed)
    force = np.interp(outcome.s, path.s, path.edge) + np.interp(outcome.s, path.s, path.cut) * ratio
    step = np.clip(np.searchsorted(path.s, outcome.s, "right") - 1, 0, len(path.compliance) - 1)
    return np.asarray(np.where(outcome.feed > 0.0, force, 0.0) * path.compliance[step])
