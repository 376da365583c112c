"""How long a machine takes for a program, row by row.

Notation: L [mm] length of a row, v [mm/s] its feed or the rapid rate, a [mm/s^2], u unit direction of travel, theta
[rad] the angle between the end of a row and the start of the next, delta [mm] the machine's corner tolerance.

The rule: a row runs at min(v, sqrt(a_n r)) on an arc of radius r, with the acceleration along the path that its axes
can give together, a = min over axes of a_i / |u_i|, |u_i| the greatest anywhere on an arc; a_n = min of a_i / the share
of axis i in the arc's plane. Rows pass into one another at `corner_speed(theta, a, delta)`: a tangent joint without
slowing, a corner as fast as an arc that rounds it off by delta allows. Between a rapid and a feed, at a dwell, a change
of tool or of spindle, and at both ends, the machine stands. Acceleration is constant in pieces (no jerk limit), and to
change the tool or to run up the spindle takes no time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chipload.machine.feed import corner_speed, limited_speed, move_time
from chipload.machine.machine import Machine
from chipload.program.motions import bases, directions, is_arc, lengths, radii, sweeps
from chipload.program.program import DWELL, RAPID, Program

Floats = NDArray[np.float64]


class _Speeds(NamedTuple):
    """Rows that have a length: their numbers, lengths [mm], greatest speeds [mm/s], accelerations along the path
    [mm/s^2], and speeds at their ends [mm/s], one more than rows.
    """

    row: NDArray[np.int64]
    length: Floats
    most: Floats
    acceleration: Floats
    ends: Floats


def program_time(program: Program, machine: Machine) -> Floats:
    """Time of each row.

    Returns
    -------
    (n,) float [s]
        Row 0 and rows without length take none, a dwell its own.

    Examples
    --------
    90 mm at 40 mm/s with 3000 mm/s^2 from rest to rest: 90/40 + 40/3000 s.

    >>> from chipload.machine.machine import machine_named
    >>> from chipload.program.build import plunge, rapid
    >>> p = Program.join([rapid([0, 0, 0], 0, 1, "link"), plunge([90, 0, 0], 40.0, 800.0, 1, "cut")])
    >>> program_time(p, machine_named("vmc")).round(6).tolist()
    [0.0, 2.263333]
    """
    out = np.where(program.motion == DWELL, program.feed, 0.0)
    if (lengths(program) > 0.0).any():
        row, length, most, a, v = _speeds(program, machine)
        out[row] = move_time(length, most, a, v[:-1], v[1:])
    return out


def peak_speed(program: Program, machine: Machine) -> Floats:
    """Greatest speed that each row reaches; what its feed asks beyond that changes no time.

    Returns
    -------
    (n,) float [mm/s]
        0 in rows without length.

    Examples
    --------
    0.3 mm from rest to rest at 3000 mm/s^2: sqrt(900) mm/s, whatever is asked.

    >>> from chipload.machine.machine import machine_named
    >>> from chipload.program.build import plunge, rapid
    >>> p = Program.join([rapid([0, 0, 0], 0, 1, "link"), plunge([0.3, 0, 0], 90.0, 800.0, 1, "cut")])
    >>> peak_speed(p, machine_named("vmc")).round(6).tolist()
    [0.0, 30.0]
    """
    out = np.zeros(len(program))
    if (lengths(program) > 0.0).any():
        row, length, most, a, v = _speeds(program, machine)
        peak = np.minimum(most, np.sqrt(a * length + 0.5 * (v[:-1] ** 2 + v[1:] ** 2)))
        out[row] = np.maximum(peak, np.maximum(v[:-1], v[1:]))
    return out


def _speeds(program: Program, machine: Machine) -> _Speeds:
    """How fast rows may go, and how fast one passes into the next; some row has a length."""
    length = lengths(program)
    row = np.flatnonzero(length > 0.0)
    first, last = directions(program)
    arc = is_arc(program)
    speed = np.where(program.motion == RAPID, machine.rapid, np.minimum(program.feed, machine.feed_max))
    e1, e2 = bases(program.normal)
    climb = np.abs((first * program.normal).sum(axis=1))
    level = np.sqrt(np.maximum(0.0, 1.0 - climb**2))
    swing = np.hypot(e1, e2)
    along = np.abs(first)
    along[arc] = (level[:, None] * swing + climb[:, None] * np.abs(program.normal))[arc]
    limit = np.array(machine.acceleration)
    with np.errstate(divide="ignore"):
        a = (limit / along).min(axis=1)
        inward = (limit / swing).min(axis=1)
    r = np.where(arc, radii(program), np.inf)
    turning = arc & (sweeps(program) != 0.0)
    with np.errstate(divide="ignore"):
        speed = np.where(turning, np.minimum(speed, np.sqrt(inward * r) / level), speed)
    # joints between rows that have a length
    here, there = row[:-1], row[1:]
    cos = (last[here] * first[there]).sum(axis=1)
    sin = np.linalg.norm(np.cross(last[here], first[there]), axis=1)
    joint = corner_speed(np.arctan2(sin, cos), np.minimum(a[here], a[there]), machine.corner_tolerance)
    joint = np.minimum(joint, np.minimum(speed[here], speed[there]))
    rest = (program.motion[here] == RAPID) != (program.motion[there] == RAPID)
    rest |= (program.tool[here] != program.tool[there]) | (program.spindle[here] != program.spindle[there])
    waits = np.concatenate([[0], np.cumsum(program.motion == DWELL)])
    rest |= waits[here] != waits[there]
    joint = np.where(rest, 0.0, joint)
    ends = np.concatenate([[0.0], joint, [0.0]])
    v, _ = limited_speed(np.concatenate([[0.0], np.cumsum(length[row])]), ends, a[row])
    return _Speeds(row, length[row], speed[row], a[row], v)
