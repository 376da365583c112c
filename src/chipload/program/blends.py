"""How LinuxCNC's trajectory planner passes the joints of segments: smooth, through a blend arc, parabolically, at rest.

Notation: joint k lies between segment k and segment k + 1. u1, u2 tangents there, theta half the angle between the two
segments (pi/2 on a straight line), phi = pi - 2 theta by which the path turns, T [mm] tolerance, L1, L2 [mm] what a
blend may take of each segment, R [mm] radius of a blend arc, d [mm] from the corner to its ends; v [mm/s], a [mm/s^2].

A joint is smooth where the change of direction within one servo cycle needs less than a share of the acceleration of
every axis. Else the planner compares three speeds and takes the best: that at which the kink would be smooth, that of
a blend arc with R = d tan(theta) within the tolerance, v = sqrt(a_n R), and half that of a parabolic blend (the next
segment starts while this one slows down, both with half the acceleration).

Reference: LinuxCNC 2.9, `tp.c`, `blendmath.c`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.machine.machine import Machine
from chipload.machine.trajectory import TrajectoryPlanner
from chipload.program.corner_arcs import CornerSide, corner_arcs
from chipload.program.path_mode import PathControl
from chipload.program.segments import Segments

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: how a joint is passed
REST, SMOOTH, PARABOLIC, ARC = 0, 1, 2, 3
#: shares of the acceleration for the direction and for the speed on arcs
NORMAL, TANGENTIAL = math.sqrt(0.75), 0.5
#: a segment takes at least so many servo cycles
LEAST_CYCLES = 1.02
#: tangents that are nearer to opposite [rad] make the machine stop
REVERSAL = math.radians(2.0)
#: of the length of a segment: what a blend may leave the corner by where no tolerance is stated
FREE_TOLERANCE = 0.25
#: half angles of corners of two arcs below which there is no blend arc [rad]
LEAST_BETWEEN_ARCS = math.pi / 12.0
#: times that blend arcs are found, each with what the one before takes of a segment
PASSES = 4
#: share of the acceleration for the angle between a blend arc and what remains of an arc
TANGENT_SHARE = 0.25
_LEAST_ANGLE, _LEAST_ARC = 1e-6, 1e-6


@dataclass(frozen=True, eq=False)
class Joints:
    """Joints in columns; see the head of this file.

    Parameters
    ----------
    kind : (k,) int, REST, SMOOTH, PARABOLIC or ARC
    speed : (k,) float [mm/s], of a smooth joint the greatest, of an arc that along it
    reduction : (k,) float, share of the acceleration that both segments lose to the kink
    trim1, trim2 : (k,) float [mm], what a blend arc takes of the segments
    length : (k,) float [mm], of the blend arc
    acceleration : (k,) float [mm/s^2], in the plane of the blend arc
    """

    kind: Ints
    speed: Floats
    reduction: Floats
    trim1: Floats
    trim2: Floats
    length: Floats
    acceleration: Floats


def joints_of(s: Segments, machine: Machine, planner: TrajectoryPlanner) -> Joints:
    """How the joints of segments are passed."""
    n = max(len(s) - 1, 0)
    a, b = np.arange(n), np.arange(1, n + 1)
    rate, most = _bounds(machine)
    u1, u2 = s.end[a], s.begin[b]
    rest = s.ends[a] | (s.rapid[a] != s.rapid[b]) | (s.control[a] == PathControl.EXACT_STOP)
    whole = s.turning[a] | s.turning[b]
    reverse = ((u1 + u2) ** 2).sum(axis=1) < REVERSAL**2
    kind = np.where(s.control[a] == PathControl.CONTINUOUS, PARABOLIC, REST)
    kind[rest | (reverse & ~whole)] = REST
    considered = ~rest & ~whole & ~reverse & planner.blend_arcs
    least = np.minimum(_reach(s, a, planner), _reach(s, b, planner))
    jolt = least / planner.cycle + s.acceleration[b]
    share = (np.abs(u2 - u1) * jolt[:, None] / most).max(axis=1)
    share = np.where(s.arc[a] | s.arc[b], share / TANGENTIAL, share)
    smooth = share < planner.kink_ratio
    kink = np.where(smooth, least, least * planner.kink_ratio / np.where(share > 0.0, share, 1.0))
    reduction = np.where(considered, np.minimum(share, planner.kink_ratio), 0.0)
    none, one = np.zeros(n), np.ones(n)
    out = Joints(np.where(considered & smooth, SMOOTH, kind), kink, reduction, none, none, none, one)
    chosen = np.flatnonzero(considered & ~smooth & (s.control[a] == PathControl.CONTINUOUS))
    if len(chosen) == 0:
        return out
    taken = np.zeros(len(s))
    for _ in range(PASSES if s.arc.any() else 1):
        best = _best(out, s, chosen, u1[chosen], u2[chosen], planner, (rate, most), taken)
        now = np.concatenate([[0.0], best.trim2])
        if np.array_equal(now, taken):
            break
        taken = now
    return best


def _bounds(machine: Machine) -> tuple[Floats, Floats]:
    """(3,), (3,) greatest speed and acceleration of X, Y and Z."""
    rate, most = np.full(3, np.inf), np.full(3, np.inf)
    for axis in machine.chain.axes:
        if axis.column < 3:
            rate[axis.column], most[axis.column] = axis.rate, axis.acceleration
    return rate, most


def _top(s: Segments, k: Ints, planner: TrajectoryPlanner) -> Floats:
    """Greatest speed of segments whose ends are not known yet."""
    top = np.minimum(s.speed[k], s.length[k] / (planner.cycle * LEAST_CYCLES))
    return np.asarray(np.where(s.arc[k], np.minimum(top, np.sqrt(NORMAL * s.acceleration[k] * s.bend[k])), top))


def _reach(s: Segments, k: Ints, planner: TrajectoryPlanner) -> Floats:
    """Speed that segments may reach at the greatest override."""
    return np.asarray(np.minimum(s.commanded[k] * planner.override, _top(s, k, planner)))


def _bounds_across(normal: Floats, bound: Floats) -> Floats:
    """(k,) what every direction in the planes across ``normal`` (k, 3) can have of axes' bounds (3,)."""
    shadow = np.sqrt(np.maximum(1.0 - normal**2, 0.0))
    with np.errstate(divide="ignore"):
        return np.asarray((bound / shadow).min(axis=1))


def _best(
    joints: Joints, s: Segments, k: Ints, u1: Floats, u2: Floats, planner: TrajectoryPlanner,
    bounds: tuple[Floats, Floats], taken: Floats,
) -> Joints:  # fmt: skip
    """Corners: the fastest of a slow kink, a blend arc and a parabolic blend."""
    a, b = k, k + 1
    theta = 0.5 * np.arccos(np.clip(-(u1 * u2).sum(axis=1), -1.0, 1.0))
    arc = _blend_arcs(s, a, b, u1, u2, theta, planner, bounds, taken[a])
    half = 0.5 * (1.0 - joints.reduction[k])
    parabolic = 0.5 * _parabolic_net(s, a, b, theta, half, planner)
    speeds = np.column_stack([parabolic, joints.speed[k], arc.speed])
    best = np.array([PARABOLIC, SMOOTH, ARC])[np.argmax(speeds, axis=1)]
    columns = {name: np.array(getattr(joints, name)) for name in Joints.__dataclass_fields__}
    columns["kind"][k] = best
    blend = best == ARC
    columns["reduction"][k] = np.where(best == SMOOTH, joints.reduction[k], 0.0)
    columns["speed"][k] = np.where(blend, arc.speed, joints.speed[k])
    for name in ("trim1", "trim2", "length"):
        columns[name][k] = np.where(blend, getattr(arc, name), 0.0)
    columns["acceleration"][k] = np.where(blend, arc.acceleration, 1.0)
    return Joints(**columns)


def _blend_arcs(
    s: Segments, a: Ints, b: Ints, u1: Floats, u2: Floats, theta: Floats, planner: TrajectoryPlanner,
    bounds: tuple[Floats, Floats], taken: Floats,
) -> Joints:  # fmt: skip
    """Blend arcs of corners; speed 0 where there can be none. ``taken`` [mm]: of the start of the first segments."""
    binormal = np.cross(u1, u2)
    size = np.linalg.norm(binormal, axis=1)
    binormal /= np.where(size > 0.0, size, 1.0)[:, None]
    fits = (0.5 * math.pi - theta >= _LEAST_ANGLE) & (theta >= _LEAST_ANGLE)
    for segments in (a, b):
        fits &= ~s.arc[segments] | (np.abs((binormal * s.normal[segments]).sum(axis=1)) > 1.0 - 1e-12)
    inner1, used1, w1 = _arc_share(s, a, u2, theta, -1.0, taken)
    inner2, used2, w2 = _arc_share(s, b, u1, theta, 1.0, np.zeros(len(a)))
    angle = theta - 0.25 * np.maximum(np.where(inner1, used1, 0.0), np.where(inner2, used2, 0.0))
    fits &= angle > np.where(s.arc[a] & s.arc[b], LEAST_BETWEEN_ARCS, _LEAST_ANGLE)
    angle = np.where(fits, angle, 0.25 * math.pi)
    phi = math.pi - 2.0 * angle
    share1 = np.where(
        s.arc[a],
        np.where(inner1, np.sin(0.25 * used1) * w1, used1 * w1),
        np.minimum(0.5 * s.length[a], s.length[a] - taken),
    )
    share2 = np.where(s.arc[b], np.where(inner2, np.sin(0.25 * used2) * w2, used2 * w2), 0.5 * s.length[b])
    tolerance = np.minimum(FREE_TOLERANCE * s.length[a], FREE_TOLERANCE * s.length[b])
    for segments in (a, b):
        stated = s.tolerance[segments]
        tolerance = np.where(stated > 0.0, np.minimum(tolerance, stated), tolerance)
    rate, most = bounds
    most_there = _bounds_across(binormal, most)
    goal = np.maximum(_reach(s, a, planner), _reach(s, b, planner))
    goal = np.minimum(goal, np.maximum(_altitude(s, a, b, u1, u2, phi, planner), _bounds_across(binormal, rate)))
    d = np.minimum(np.minimum(share1, share2), np.cos(angle) * tolerance / (1.0 - np.sin(angle)))
    radius = np.tan(angle) * d
    speed = np.minimum(np.sqrt(NORMAL * most_there * radius), goal)
    slow = 0.5 * most_there
    time = np.minimum(np.sqrt(2.0 * slow * d), speed) / slow
    plan = np.maximum(speed**2 / (NORMAL * most_there), np.minimum(time * speed / phi, radius))
    fits &= plan * phi >= _LEAST_ARC
    kink = NORMAL * TANGENT_SHARE * most_there * planner.cycle / np.where(speed > 0.0, speed, 1.0)
    side = np.cross(binormal, u1)
    sides = []
    for k, inner, used, w, corner in ((a, inner1, used1, w1, s.point[a]), (b, inner2, used2, w2, s.point[b - 1])):
        out = s.centre[k] - corner
        centre = (out * u1).sum(axis=1) + 1j * (out * side).sum(axis=1)
        sides.append(CornerSide(s.arc[k], inner, np.where(s.arc[k], centre, 0j), w, used, s.length[k]))
    leaving = (u1 * u2).sum(axis=1) + 1j * (side * u2).sum(axis=1)
    found = corner_arcs(sides[0], sides[1], leaving, plan, tolerance, kink)
    fits &= found.possible
    zero = np.zeros(len(a))
    return Joints(
        kind=np.full(len(a), ARC),
        speed=np.where(fits, speed, 0.0),
        reduction=zero,
        trim1=found.trim1,
        trim2=found.trim2,
        length=found.length,
        acceleration=most_there,
    )


def _arc_share(
    s: Segments, k: Ints, other: Floats, theta: Floats, sign: float, taken: Floats
) -> tuple[Bools, Floats, Floats]:
    """Of segments that are arcs: whether the other segment lies inside, the angle a blend may take, the radius."""
    arc = s.arc[k]
    corner = s.point[k] if sign < 0.0 else s.point[k - 1]
    out = ((corner - s.centre[k]) * other).sum(axis=1)
    inner = arc & (out * sign >= 0.0)
    most = (s.sweep[k] - taken / s.radius[k]) * (1.0 / 3.0 if sign > 0.0 else 2.0 / 3.0)
    used = np.where(arc, np.minimum(most, np.where(inner, theta, 0.5 * math.pi)), 0.0)
    return inner, used, np.where(arc, s.radius[k], 0.0)


def _altitude(s: Segments, a: Ints, b: Ints, u1: Floats, u2: Floats, phi: Floats, planner: TrajectoryPlanner) -> Floats:
    """Greatest speed while one line's velocity goes over into the other's straight; 0 where one is no line."""
    v1, v2 = _top(s, a, planner), _top(s, b, planner)
    c = np.cos(np.minimum(phi, 0.49 * math.pi))
    w1, w2 = np.minimum(v1, v2 / c), np.minimum(v2, v1 / c)
    base = np.linalg.norm(w2[:, None] * u2 - w1[:, None] * u1, axis=1)
    height = w1 * w2 * np.sin(phi) / np.where(base > 0.0, base, 1.0)
    return np.where(s.arc[a] | s.arc[b], 0.0, height)


def _parabolic_net(s: Segments, a: Ints, b: Ints, theta: Floats, half: Floats, planner: TrajectoryPlanner) -> Floats:
    """Speed along the bisector in a parabolic blend, as the planner estimates it before lengths are final."""
    t1, t2 = (np.where(s.arc[k], TANGENTIAL, 1.0) for k in (a, b))
    v1, v2 = parabolic_speeds(
        (half * t1 * s.acceleration[a], half * t2 * s.acceleration[b]),
        (s.length[a], s.length[b]),
        (0.5, 0.5),
        (_reach(s, a, planner), _reach(s, b, planner)),
        s.tolerance[a],
        theta,
    )
    return np.asarray(np.sin(theta) * 0.5 * (v1 + v2))


def parabolic_speeds(
    acceleration: tuple[Floats, Floats], length: tuple[Floats, Floats], share: tuple[float, float],
    target: tuple[Floats, Floats], tolerance: Floats, theta: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Speeds from which one segment slows down, and to which the next one rises, in a parabolic blend.

    Parameters
    ----------
    acceleration, length, target : of both segments [mm/s^2], [mm], [mm/s]
    share : of the length of each that may be used
    tolerance : T [mm], 0 where none is stated: v = 2 sqrt(a T / cos(theta))
    """
    reach = [np.minimum(np.sqrt(a * u * d), v) for a, d, u, v in zip(acceleration, length, share, target, strict=True)]
    longest = np.minimum(length[0] / reach[0], length[1] / reach[1])
    time = np.minimum(longest, np.maximum(reach[0] / acceleration[0], reach[1] / acceleration[1]))
    v1, v2 = (np.minimum(v, time * a) for v, a in zip(reach, acceleration, strict=True))
    c = np.cos(theta)
    bound = 2.0 * np.sqrt(acceleration[0] * tolerance / np.where(c > _LEAST_ANGLE, c, 1.0))
    bound = np.where((tolerance > 0.0) & (c > _LEAST_ANGLE), bound, np.inf)
    return np.minimum(v1, bound), np.minimum(v2, bound)
