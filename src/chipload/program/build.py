"""Rows of a program from contours and points.

Notation: s [mm] length along a contour. Each function gives the rows that FOLLOW a position: a part has no row for
where it starts, the part before it ends there. :meth:`Program.join` puts parts together; the first must be a rapid.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.geometry.contour import JOIN_MM, Contour
from chipload.program.program import ARC_CCW, ARC_CW, DWELL, LINE, RAPID, Ints, Program

Floats = NDArray[np.float64]

#: an arc that turns by more [rad] is written as two rows, so that no row is near a full turn
LONGEST_ARC = 1.5 * math.pi


def rows(
    motion: ArrayLike,
    points: ArrayLike,
    centre: ArrayLike,
    feed: ArrayLike,
    spindle: float,
    tool: int,
    label: str,
) -> Program:
    """A part with the axis along +Z, one tool, one spindle speed and one label.

    Parameters
    ----------
    motion : (n,) int; points : (n, 3) float [mm]; feed : (n,) or float [mm/s]
    centre : (n, 2) or (2,) float [mm], of arcs in the XY plane
    spindle : [rad/s], negative for counter-clockwise (M4)
    """
    p = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    n = len(p)
    return Program(
        motion=np.broadcast_to(np.asarray(motion, dtype=np.int64), (n,)),
        p_work=p,
        axis=np.tile([0.0, 0.0, 1.0], (n, 1)),
        centre=np.column_stack([np.broadcast_to(np.asarray(centre, dtype=np.float64), (n, 2)), np.zeros(n)]),
        normal=np.tile([0.0, 0.0, 1.0], (n, 1)),
        turns=np.zeros(n, dtype=np.int64),
        feed=np.broadcast_to(np.asarray(feed, dtype=np.float64), (n,)),
        spindle=np.full(n, float(spindle)),
        tool=np.full(n, tool),
        line=np.zeros(n, dtype=np.int64),
        label=np.zeros(n, dtype=np.int64),
        labels=(label,),
    )


def rapid(points: ArrayLike, spindle: float, tool: int, label: str) -> Program:
    """Rapids to ``points`` (n, 3) or (3,) [mm], one after the other."""
    return rows(RAPID, points, (0.0, 0.0), 0.0, spindle, tool, label)


def plunge(points: ArrayLike, feed: ArrayLike, spindle: float, tool: int, label: str) -> Program:
    """Straight feeds to ``points`` (n, 3) or (3,) [mm] at ``feed`` [mm/s], one or (n,)."""
    return rows(LINE, points, (0.0, 0.0), feed, spindle, tool, label)


def retract(point: ArrayLike, spindle: float, tool: int, label: str) -> Program:
    """A rapid up to ``point`` (3,) [mm]."""
    return rapid(point, spindle, tool, label)


def dwell(point: ArrayLike, seconds: float, spindle: float, tool: int, label: str) -> Program:
    """Stay at ``point`` (3,) [mm] for ``seconds`` > 0."""
    if not 0.0 < seconds < math.inf:
        raise InputError(f"dwell = {seconds:g} s: must be above 0")
    return rows(DWELL, point, (0.0, 0.0), seconds, spindle, tool, label)


def follow(
    contour: Contour,
    z: float | tuple[float, float],
    feed: ArrayLike | tuple[ArrayLike, ArrayLike],
    spindle: float,
    tool: int,
    label: str,
) -> Program:
    """The motions along a contour that the cutter stands at the start of.

    Parameters
    ----------
    contour : path of the tip
    z : height [mm]; (z0, z1) falls or rises evenly with the length: a ramp, arcs become helical
    feed : [mm/s]; (n,) one for each segment; or (s, feeds), both (m,): ``feeds[i]`` holds from the length ``s[i]``
        on, s[0] = 0, rising; the contour is cut there
    spindle : [rad/s], negative for counter-clockwise (M4)
    tool : number
    label : what the motions belong to

    Returns
    -------
    Program
        One row a piece; an arc of more than ``LONGEST_ARC`` (a full circle too) is two rows. Each row ends exactly on
        the contour's own ends, where it has one.

    Raises
    ------
    InputError
        The feed is not one for each segment, or s does not start at 0 and rise within the contour.

    Examples
    --------
    >>> part = follow(Contour.circle((0.0, 0.0), 2.0), -1.0, 10.0, 800.0, 1, "finish")
    >>> part.motion.tolist(), part.p_work.round(9).tolist()
    ([3, 3], [[-2.0, 0.0, -1.0], [2.0, 0.0, -1.0]])
    """
    seg, knots = contour.segments, contour.knots
    n = len(seg)
    cut = knots
    if isinstance(feed, tuple):
        at, value = (np.asarray(x, dtype=np.float64).reshape(-1) for x in feed)
        if len(at) != len(value) or len(at) == 0:
            raise InputError(f"feed: {len(at)} lengths and {len(value)} feeds: must be as many, at least one")
        if abs(at[0]) > JOIN_MM or (np.diff(at) <= 0.0).any() or at[-1] > contour.length + JOIN_MM:
            raise InputError(f"feed: the lengths must start at 0 and rise to at most {contour.length:.6g} mm")
        near = np.abs(knots[np.clip(np.searchsorted(knots, at), 0, n)] - at)
        near = np.minimum(near, np.abs(knots[np.clip(np.searchsorted(knots, at) - 1, 0, n)] - at))
        cut = np.union1d(knots, at[near > JOIN_MM])
        cut = cut[(cut == 0.0) | (cut <= contour.length)]
    middle = 0.5 * (cut[:-1] + cut[1:])
    k = np.clip(np.searchsorted(knots, middle, side="right") - 1, 0, n - 1)
    twice = np.abs(seg[k, 6]) * np.diff(cut) / contour.lengths[k] > LONGEST_ARC
    if twice.any():
        cut = np.union1d(cut, middle[twice])
        middle = 0.5 * (cut[:-1] + cut[1:])
        k = np.clip(np.searchsorted(knots, middle, side="right") - 1, 0, n - 1)
    p = contour.at(cut[1:])[0]
    j = np.searchsorted(knots, cut[1:])
    own = knots[np.clip(j, 0, n)] == cut[1:]
    p[own] = seg[np.clip(j[own], 1, n) - 1, 2:4]
    if isinstance(feed, tuple):
        speed = value[np.clip(np.searchsorted(at, middle, side="right") - 1, 0, len(value) - 1)]
    else:
        given = np.asarray(feed, dtype=np.float64)
        if given.shape not in ((), (n,)):
            raise InputError(f"feed: shape {given.shape}: must be one number or one for each of the {n} segments")
        speed = np.broadcast_to(given, (n,))[k]
    z0, z1 = z if isinstance(z, tuple) else (z, z)
    height = z0 + (z1 - z0) * (cut[1:] / contour.length) if z0 != z1 else np.full(len(p), float(z1))
    height[-1] = z1
    sweep = seg[k, 6]
    motion: Ints = np.where(sweep == 0.0, LINE, np.where(sweep > 0.0, ARC_CCW, ARC_CW)).astype(np.int64)
    centre = np.where((sweep != 0.0)[:, None], seg[k, 4:6], 0.0)
    return rows(motion, np.column_stack([p, height]), centre, speed, spindle, tool, label)


def helix(
    start: ArrayLike,
    centre: tuple[float, float],
    z: tuple[float, float],
    pitch: float,
    feed: float,
    spindle: float,
    tool: int,
    label: str,
    sense: int = 1,
    level: bool = True,
) -> Program:
    """A helical entry: whole turns from z[0] down (or up) to z[1] that end over their start, then one level turn.

    Parameters
    ----------
    start : (2,) float [mm]
        Where the cutter stands; its distance from ``centre`` is the radius.
    z : (first, last) height [mm]
    pitch : greatest change of height a turn [mm], > 0; the turns share the height evenly
    sense : +1 counter-clockwise, -1 clockwise
    level : whether a turn at z[1] follows, which leaves a flat floor

    Examples
    --------
    >>> part = helix((5.0, 0.0), (2.0, 0.0), (1.0, -2.0), 2.0, 5.0, 800.0, 1, "entry")
    >>> part.p_work[:, 2].tolist()
    [0.25, -0.5, -1.25, -2.0, -2.0, -2.0]
    """
    x, y = np.asarray(start, dtype=np.float64)
    radius = math.hypot(x - centre[0], y - centre[1])
    if not radius > JOIN_MM:
        raise InputError(f"helix: start ({x:.6g}, {y:.6g}) is the centre: must be a radius away from it")
    if not pitch > 0.0:
        raise InputError(f"helix: pitch = {pitch:g} mm: must be above 0")
    turns = math.ceil(abs(z[1] - z[0]) / pitch - 1e-9)
    halves = 2 * turns
    height = z[0] + (z[1] - z[0]) * np.arange(1, halves + 1) / max(halves, 1)
    if level:
        height = np.concatenate([height, [z[1], z[1]]])
    if len(height) == 0:
        raise InputError("helix: no height and no level turn: nothing to do")
    far = np.arange(len(height)) % 2 == 0
    px = np.where(far, 2.0 * centre[0] - x, x)
    py = np.where(far, 2.0 * centre[1] - y, y)
    motion = ARC_CCW if sense > 0 else ARC_CW
    return rows(motion, np.column_stack([px, py, height]), centre, feed, spindle, tool, label)
