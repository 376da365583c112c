"""Kinematics of a machine: from axis positions to the tip and axis of the tool in the work frame, and back.

Notation: q axis positions, columns X Y Z A B C U V W [mm, rad]; d, c direction and pivot of an axis; s, N, L direction
of the spindle, its nose and the tool's length; W, R origin and directions of the work frame. Axes 1 .. m stand in order
from the workpiece to the tool and E_i is the motion of axis i: E_i p = p + q_i d_i, or c_i + R(d_i, q_i)(p - c_i). Then

    tip = R' (E_1 E_2 .. E_m (N - L s) - W),   axis = R' R_1 R_2 .. R_m s

a product of exponentials: every direction and pivot is that of the machine with all axes at zero. In the inverse, the
tool axis determines the rotary axes (two solutions, :func:`~chipload.machine.orientation.two_turns`); for given rotary
axes the tip is linear in X, Y, Z.

The work frame moves with the table; W is the position of its origin with the rotary axes at zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.machine.axis import LETTERS, Axis
from chipload.machine.chain import Chain
from chipload.machine.machine import Machine
from chipload.machine.orientation import angle_between, azimuth, rotate_about, two_turns, wrap_angles

Floats = NDArray[np.float64]

_PARALLEL = 1e-6  # [rad] angle below which two axes count as parallel
_FLAT = 1e-6  # volume below which three unit directions count as coplanar


def forward(
    machine: Machine, axes: ArrayLike, tool_length: ArrayLike = 0.0, work_zero: ArrayLike | None = None
) -> tuple[Floats, Floats]:
    """Tip and axis of the tool in the work frame; O(n m).

    Parameters
    ----------
    axes : (n, 9) float [mm, rad]
        Positions of the machine's axes; columns of axes that it lacks are ignored.
    tool_length : float or (n,) float [mm]
        From the spindle's nose to the tip.
    work_zero : (3,) float [mm]
        Origin of the work frame in the machine's frame, rotary axes at zero; None: that of the machine.

    Returns
    -------
    tip : (n, 3) float [mm], axis : (n, 3) float, unit, from the tip to the spindle.

    Raises
    ------
    InputError
        An array has a wrong shape or a value that is not finite.

    Examples
    --------
    A cradle tilted by A = 90 degrees about its pivot at (0, 0, 77.5), the origin of the work frame. A point that is now
    5 mm from the pivot along Y was 5 mm below it before, and the tool points along Y of the work frame.

    >>> from chipload.machine.machine import machine_named
    >>> axes = np.zeros((1, 9))
    >>> axes[0, 1:4] = 5.0, 77.5, np.pi / 2
    >>> tip, axis = forward(machine_named("cradle-ac"), axes)
    >>> (tip.round(9) + 0.0).tolist(), (axis.round(9) + 0.0).tolist()
    ([[0.0, 0.0, -5.0]], [[0.0, 1.0, 0.0]])
    """
    chain = machine.chain
    q = _columns("axes", axes)
    p, _ = _tip_in_machine(chain, q, tool_length, "")
    a = np.broadcast_to(np.array(chain.spindle), p.shape)
    for axis in reversed(chain.axes):
        if axis.rotary:
            a = rotate_about(np.array(axis.direction), q[:, axis.column], a)
    R = chain.R_machine_work
    return (p - _zero(chain, work_zero)) @ R, a @ R


@dataclass(frozen=True, eq=False)
class Solutions:
    """Axis positions that reach a tip and an axis.

    Parameters
    ----------
    axes : (n, k, 9) float [mm, rad]
        k = 2 solutions where two rotary axes are free, else 1; free angles in (-pi, pi].
    miss : (n,) float [rad]
        Angle by which the tool axis is out of reach; 0: in reach. Where it is above 0, ``axes`` give the nearest
        direction at the same tip.
    pole : (n,) float [rad]
        Angle between the tool axis and the line about which a free rotary axis only spins it; pi/2 where there is no
        such line. 0: singular, the angle of that axis is arbitrary.
    free : tuple of Axis
        The rotary axes that were solved for, from the workpiece to the tool.
    """

    axes: Floats
    miss: Floats
    pole: Floats
    free: tuple[Axis, ...]


def inverse(
    machine: Machine,
    tip: ArrayLike,
    axis: ArrayLike,
    tool_length: ArrayLike = 0.0,
    work_zero: ArrayLike | None = None,
    held: ArrayLike | None = None,
    free: str | None = None,
    pole_tolerance: float = 1e-9,
) -> Solutions:
    """All solutions for the axis positions that bring the tool to a tip and an axis; closed form, O(n m).

    Parameters
    ----------
    tip : (n, 3) float [mm], axis : (n, 3) float, of any length above 0
    tool_length, work_zero : as in ``forward``
    held : (9,) or (n, 9) float [mm, rad]
        Positions of the axes that are not solved for (indexed axes, U, V, W), and of the free angle at a pole. None: 0.
    free : letters of the rotary axes to be solved for; None: all that are not indexed
    pole_tolerance : float [rad]
        Within this angle of the pole the free angle is that of ``held``; the tool axis is then off by at most this
        angle.

    Raises
    ------
    InputError
        A shape or a value is wrong, more than two rotary axes are free, two free axes are parallel, or X, Y, Z do not
        reach every point at some row.

    Examples
    --------
    >>> from chipload.machine.machine import machine_named
    >>> found = inverse(machine_named("xyzac-trunnion"), [[1.0, 2.0, 3.0]], [[0.0, 1.0, 1.0]])
    >>> np.degrees(found.axes[0, :, [3, 5]]).round(6).tolist()
    [[45.0, -45.0], [0.0, 180.0]]
    """
    chain = machine.chain
    p, a = np.asarray(tip, dtype=np.float64), np.asarray(axis, dtype=np.float64)
    n = len(p)
    if p.shape != (n, 3) or a.shape != (n, 3) or not np.isfinite(p).all():
        raise InputError(f"inverse: tip {p.shape} and axis {a.shape}: must be (n, 3) and (n, 3), finite")
    length = np.linalg.norm(a, axis=1)
    if not ((length > 1e-6) & (length < 1e6)).all():
        row = int(np.flatnonzero(~((length > 1e-6) & (length < 1e6)))[0])
        raise InputError(f"inverse: row {row}: axis {a[row].tolist()}: must have a length above 0")
    R = chain.R_machine_work
    q = np.zeros((n, 9)) if held is None else np.array(np.broadcast_to(_columns("held", np.atleast_2d(held)), (n, 9)))
    turning = chain.free(free)
    angles, miss, pole = _orientation(chain, turning, q, (a / length[:, None]) @ R.T, pole_tolerance)
    out = np.repeat(q[:, None, :], angles.shape[1], axis=1)
    for k, one in enumerate(turning):
        out[:, :, one.column] = angles[:, :, k]
    for branch in range(out.shape[1]):
        out[:, branch] = with_tip(machine, out[:, branch], p, tool_length, work_zero)
    return Solutions(out, miss, pole, turning)


def with_tip(
    machine: Machine, axes: ArrayLike, tip: ArrayLike, tool_length: ArrayLike = 0.0, work_zero: ArrayLike | None = None
) -> Floats:
    """Axis positions with X, Y, Z that put the tip at ``tip`` while the other axes stay; O(n m).

    A controller does the same under G43.4, where the program states the tip and the angles.

    Parameters
    ----------
    axes : (n, 9) float [mm, rad]; X, Y, Z are ignored
    tip : (n, 3) float [mm], in the work frame
    tool_length, work_zero : as in ``forward``

    Returns
    -------
    (n, 9) float [mm, rad]

    Raises
    ------
    InputError
        At some row X, Y, Z do not reach every point: their directions lie in a plane.
    """
    chain = machine.chain
    out = np.array(_columns("axes", axes))
    point, columns = _tip_in_machine(chain, out, tool_length, "XYZ")
    flat = np.abs(np.linalg.det(columns)) < _FLAT
    if flat.any():
        row = int(np.flatnonzero(flat)[0])
        raise InputError(
            f"row {row}: the axes X, Y, Z lie in one plane and do not reach every point: hold another angle"
        )
    target = np.asarray(tip, dtype=np.float64) @ chain.R_machine_work.T + _zero(chain, work_zero)
    out[:, :3] = np.linalg.solve(columns, (target - point)[..., None])[..., 0]
    return out


def _orientation(
    chain: Chain, free: tuple[Axis, ...], q: Floats, a: Floats, pole_tolerance: float
) -> tuple[Floats, Floats, Floats]:
    """Free angles (n, k, len(free)) that turn the spindle to a (n, 3) in the machine's frame; miss, pole (n,)."""
    w = np.broadcast_to(np.array(chain.spindle), a.shape)
    turns: list[Floats] = []  # directions of the free axes after the rotations of the fixed axes
    for axis in reversed(chain.rotary):
        d = np.broadcast_to(np.array(axis.direction), a.shape)
        if axis in free:
            turns.insert(0, d)
        else:
            w, *turns = (rotate_about(d, q[:, axis.column], v) for v in (w, *turns))
    if len(free) == 0:
        return np.zeros((len(a), 1, 0)), angle_between(a, w), np.full(len(a), 0.5 * np.pi)
    u = turns[0]
    if len(free) == 1:
        chi, phi = angle_between(a, u), angle_between(w, u)
        angle = wrap_angles(azimuth(u, w, a))[:, None]
        miss = np.abs(chi - phi)
        pole = np.minimum(np.minimum(chi, np.pi - chi), np.minimum(phi, np.pi - phi))
        angles = angle[:, :, None]
    else:
        v = turns[1]
        for one, two, what in ((u, v, free[0].letter), (v, w, "the spindle")):
            between = angle_between(one, two)
            if (np.minimum(between, np.pi - between) < _PARALLEL).any():
                raise InputError(
                    f"inverse: {free[1].letter} turns about the line of {what}: hold it, or mark it indexed"
                )
        q1, q2, miss, pole = two_turns(u, v, w, a)
        angles = np.stack([q1, q2], axis=2)
    at_pole = pole <= pole_tolerance
    angles[at_pole, :, 0] = q[at_pole, free[0].column, None]
    return angles, miss, pole


def _tip_in_machine(chain: Chain, q: Floats, tool_length: ArrayLike, solved: str) -> tuple[Floats, Floats]:
    """The tip (n, 3) in the machine's frame with the axes ``solved`` at zero, and its motion per unit of each of them
    as the columns of (n, 3, len(solved)).
    """
    n = len(q)
    length = np.asarray(tool_length, dtype=np.float64)
    if length.shape not in ((), (n,)) or not np.isfinite(length).all():
        raise InputError(f"tool_length {length.shape}: must be one finite number or one for each of {n} rows")
    s = np.array(chain.spindle)
    p = np.array(chain.nose) - np.broadcast_to(length, (n,))[:, None] * s
    columns = {letter: np.zeros((n, 3)) for letter in solved}
    for axis in reversed(chain.axes):
        d, value = np.array(axis.direction), q[:, axis.column]
        if axis.rotary:
            c = np.array(axis.pivot)
            p = c + rotate_about(d, value, p - c)
            columns = {letter: rotate_about(d, value, v) for letter, v in columns.items()}
        elif axis.letter in solved:
            columns[axis.letter] = np.broadcast_to(d, (n, 3))
        else:
            p = p + value[:, None] * d
    return p, np.stack([columns[letter] for letter in solved], axis=2) if solved else np.zeros((n, 3, 0))


def _columns(name: str, axes: ArrayLike) -> Floats:
    q = np.asarray(axes, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != 9 or not np.isfinite(q).all():
        raise InputError(f"{name} {q.shape}: must be (n, 9) finite numbers, columns {' '.join(LETTERS)}")
    return q


def _zero(chain: Chain, work_zero: ArrayLike | None) -> Floats:
    zero = np.array(chain.work_zero if work_zero is None else work_zero, dtype=np.float64)
    if zero.shape != (3,) or not np.isfinite(zero).all():
        raise InputError(f"work_zero {zero.tolist()}: must be three finite numbers")
    return zero
