"""Speed and time of a machine along a path with a wanted speed at every point.

Notation: s [mm] length along the path, v [mm/s] speed, a [mm/s^2] acceleration, kappa [1/mm] curvature, theta [rad]
change of direction at a corner, delta [mm] greatest deviation from the corner.

Between two samples the acceleration is constant, so v^2 is linear in s: v1^2 = v0^2 + 2 a (s1 - s0), and the time
is dt = 2 (s1 - s0) / (v0 + v1). The fastest speed is then the greatest v^2 below wanted^2 whose slope is at most 2 a.
One forward and one backward pass find it.
"""

from __future__ import annotations

import math
import sys

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.machine.machine import Machine

_acceleration = LateModule("chipload.machine._acceleration")

Floats = NDArray[np.float64]

#: places of a path up to which its speeds are found in 20 ms without the compiler, whose start takes 200 ms
INTERPRETED = 50_000

#: change of direction [rad] below which a corner does not limit the speed: a jump of 0.1 mm/s at 100 mm/s
TANGENT = 1e-3


def limited_speed(
    s: ArrayLike,
    wanted: ArrayLike,
    acceleration: ArrayLike,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
    between: ArrayLike | None = None,
) -> tuple[Floats, Floats]:
    """Fastest speed along a path that never exceeds ``wanted`` and whose acceleration stays within the limit.

    v_i^2 = min over j of (wanted_j^2 + 2 a |s_i - s_j|), in two passes, O(n).

    Parameters
    ----------
    s : (n,) float [mm]
        Length along the path, never falling. Two equal values are a jump of ``wanted`` at one point: the lesser
        applies.
    wanted : (n,) float [mm/s]
        Greatest speed at each sample, >= 0 and finite or inf. 0 inside the path is a stop.
    acceleration : float or (n - 1,) float [mm/s^2]
        Greatest |dv/dt|, > 0, of the path or of each interval between samples.
    start_speed, end_speed : float [mm/s]
        Speed at the ends, >= 0; lowered where ``wanted`` or the acceleration does not allow it.
    between : float or (n - 1,) float [mm/s], > 0
        Greatest speed within each interval, whose motion is then that of :func:`move_time`: up from the speed at its
        beginning and down to that at its end. None: the acceleration within an interval is constant.

    Returns
    -------
    v : (n,) float [mm/s], t : (n,) float [s] from 0; without ``between``, inf from the first point that is never
    left (v = 0 at both ends of an interval of length above 0).

    Raises
    ------
    InputError
        A shape, a sign or a value is wrong.

    Examples
    --------
    From rest to rest over 10 mm at 10 mm/s with 100 mm/s^2: 1 s + 0.1 s.

    >>> v, t = limited_speed([0.0, 5.0, 10.0], [10.0, 10.0, 10.0], 100.0)
    >>> v.tolist()
    [0.0, 10.0, 0.0]
    >>> s = np.linspace(0.0, 10.0, 2001)
    >>> round(float(limited_speed(s, np.full(2001, 10.0), 100.0)[1][-1]), 6)
    1.1
    >>> float(limited_speed([0.0, 10.0], [10.0, 10.0], 100.0, between=10.0)[1][-1])
    1.1
    """
    s, wanted = np.asarray(s, dtype=np.float64), np.asarray(wanted, dtype=np.float64)
    n = len(s) if s.ndim == 1 else 0
    if n == 0 or wanted.shape != (n,):
        raise InputError(f"limited_speed: s {s.shape} and wanted {wanted.shape}: must be (n,) and (n,), n >= 1")
    a = np.broadcast_to(np.asarray(acceleration, dtype=np.float64), (n - 1,))
    step = np.diff(s)
    if not np.isfinite(s).all() or (step < 0.0).any():
        raise InputError("limited_speed: s must be finite and never fall")
    if not (wanted >= 0.0).all() or start_speed < 0.0 or end_speed < 0.0:
        raise InputError("limited_speed: a speed is negative or not a number")
    if not ((a > 0.0) & np.isfinite(a)).all():
        raise InputError("limited_speed: acceleration must be finite and above 0 mm/s^2")
    w = wanted**2
    w[0] = min(w[0], start_speed**2)
    w[-1] = min(w[-1], end_speed**2)
    change = 2.0 * a * step
    if n > INTERPRETED or "numba" in sys.modules:
        _acceleration.limit_change(change, w)
    else:
        w = _limit_change(change, w)
    v: Floats = np.sqrt(w)
    total = v[:-1] + v[1:]
    moving = step > 0.0
    with np.errstate(divide="ignore"):
        dt = np.where(moving, 2.0 * step / np.where(moving, total, 1.0), 0.0)
    if between is not None:
        most = np.broadcast_to(np.asarray(between, dtype=np.float64), (n - 1,))
        if not (most > 0.0).all():
            raise InputError("limited_speed: between must be above 0 mm/s")
        dt = np.where(moving, move_time(step, most, a, v[:-1], v[1:]), 0.0)
    return v, np.concatenate([[0.0], np.cumsum(dt)])


def curvature_speed(kappa: ArrayLike, acceleration: float) -> Floats:
    """Speed sqrt(a / |kappa|) [mm/s] at which a curve needs the acceleration a [mm/s^2]; inf on a line.

    >>> curvature_speed([0.1, 0.0], 1000.0).tolist()
    [100.0, inf]
    """
    kappa = np.abs(np.asarray(kappa, dtype=np.float64))
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt(acceleration / kappa))


def corner_speed(theta: ArrayLike, acceleration: ArrayLike, tolerance: ArrayLike) -> Floats:
    """Speed [mm/s] through a corner of angle theta [rad] that is rounded off by at most ``tolerance`` [mm].

    The arc that is tangent to both sides and passes the corner at the distance delta has the radius
    delta cos(theta/2) / (1 - cos(theta/2)), and v = sqrt(a radius). Below ``TANGENT`` there is no corner: inf. A full
    reversal, or a tolerance of 0, gives 0, a stop. ``acceleration`` is in mm/s^2; the arrays broadcast.

    >>> round(float(corner_speed(np.pi / 2, 3000.0, 0.005)), 4)
    6.0177
    """
    theta = np.abs(np.asarray(theta, dtype=np.float64))
    half = np.clip(np.cos(0.5 * theta), 0.0, 1.0)
    smooth = theta < TANGENT
    flare = np.where(smooth, 1.0, 2.0 * np.sin(0.25 * theta) ** 2)
    speed = np.sqrt(np.asarray(acceleration) * np.asarray(tolerance) * half / flare)
    return np.where(smooth, np.inf, np.where(theta >= math.pi - 1e-9, 0.0, speed))


def move_time(length: ArrayLike, speed: ArrayLike, acceleration: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Floats:
    """Time [s] of a move with a trapezoidal speed profile: from v0 up to at most ``speed``, then down to v1.

    The peak is min(speed, sqrt(a L + (v0^2 + v1^2)/2)) for the length L [mm] and acceleration a [mm/s^2]; speeds are in
    mm/s. v0 and v1 must be reachable: |v1^2 - v0^2| <= 2 a L.

    >>> float(move_time(10.0, 10.0, 100.0, 0.0, 0.0)), float(move_time(1.0, 100.0, 100.0, 0.0, 0.0))
    (1.1, 0.2)
    """
    length, a = np.asarray(length, dtype=np.float64), np.asarray(acceleration, dtype=np.float64)
    v0, v1 = np.asarray(v0, dtype=np.float64), np.asarray(v1, dtype=np.float64)
    peak = np.minimum(speed, np.sqrt(a * length + 0.5 * (v0**2 + v1**2)))
    peak = np.maximum(peak, np.maximum(v0, v1))
    still = peak == 0.0
    level = length - (2.0 * peak**2 - v0**2 - v1**2) / (2.0 * a)
    ramps = (2.0 * peak - v0 - v1) / a
    return np.asarray(np.where(still, 0.0, ramps + np.maximum(level, 0.0) / np.where(still, 1.0, peak)))


def row_time_limited(machine: Machine, axes: ArrayLike, time: ArrayLike = 0.0) -> Floats:
    """Least time of each move between rows of axis positions with every axis within its rate; O(n m).

    t = max(time, max over axes of |q1 - q0| / rate); accelerations are ignored.

    Parameters
    ----------
    axes : (n, 9) float [mm, rad], columns X Y Z A B C U V W
    time : float or (n - 1,) float [s], >= 0
        Time at the programmed feed: length of the tip's path over the feed.

    Returns
    -------
    (n - 1,) float [s]

    Raises
    ------
    InputError
        A shape or a value is wrong.

    Examples
    --------
    A turns by 45 degrees at 30 deg/s while X moves by 10 mm at 20 mm/s: 1.5 s, or the 2 s of the programmed feed.

    >>> from chipload.machine.machine import machine_named
    >>> axes = np.zeros((2, 9))
    >>> axes[1, 0], axes[1, 3] = 10.0, np.radians(45.0)
    >>> row_time_limited(machine_named("xyzac-trunnion"), axes).round(9).tolist()
    [1.5]
    >>> row_time_limited(machine_named("xyzac-trunnion"), axes, 2.0).tolist()
    [2.0]
    """
    q = np.asarray(axes, dtype=np.float64)
    feed_time = np.asarray(time, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != 9 or len(q) == 0 or not np.isfinite(q).all():
        raise InputError(f"row_time_limited: axes {q.shape}: must be (n, 9) finite numbers, n >= 1")
    if feed_time.shape not in ((), (len(q) - 1,)) or not (feed_time >= 0.0).all():
        raise InputError(f"row_time_limited: time {feed_time.shape}: must be one number or (n - 1,), >= 0")
    out = np.array(np.broadcast_to(feed_time, (len(q) - 1,)))
    for axis in machine.chain.axes:
        out = np.maximum(out, np.abs(np.diff(q[:, axis.column])) / axis.rate)
    return out


def _limit_change(change: Floats, w: Floats) -> Floats:
    """As :func:`chipload.machine._acceleration.limit_change`, to the same bits, and not in place."""
    squares, most = w.tolist(), change.tolist()
    for k, step in enumerate(most):
        if squares[k + 1] > (reached := squares[k] + step):
            squares[k + 1] = reached
    for k in range(len(most) - 1, -1, -1):
        if squares[k] > (reached := squares[k + 1] + most[k]):
            squares[k] = reached
    return np.array(squares)
