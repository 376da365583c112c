"""Time of each row of a program on a machine; all times of the product come from here.

Notation: L [mm] length of a row, v [mm/s] its feed or the rapid rate, a [mm/s^2], u unit direction of travel, theta
[rad] the angle between the end of a row and the start of the next, delta [mm] how far the corner between them may be
rounded off.

A machine under LinuxCNC is judged by its trajectory planner (:mod:`chipload.program.trajectory`). The rule for every
other: a row runs at min(v, sqrt(a_n r)) on an arc of radius r, with the acceleration along the path that its axes
can give together, a = min over axes of a_i / |u_i|, |u_i| the greatest anywhere on an arc; a_n = min of a_i / the share
of axis i in the arc's plane. Rows pass into one another at `corner_speed(theta, a, delta)`: a tangent joint without
slowing, a corner as fast as an arc that rounds it off by delta, and takes at most half of either row, allows. delta is
that of G64 P; without it the machine's corner tolerance; 0 for G61; under G61.1 every joint is a stop. Between a rapid
and a feed, at a dwell, a change of tool or of spindle, and at both ends, the machine stands. To change the tool or to
run up the spindle takes no time.

Where the machine states a jerk j, speeds change with it (:mod:`chipload.program._jerk_limited`): rows whose joints do
not limit the speed are one stretch, and at the ends of a stretch the acceleration is zero. Where it states none, the
acceleration is constant in pieces, and the time is the least that the program can take; the greatest is that of
:func:`slow_machine`.

A control that needs the time t_b for a block runs no row faster than its length / t_b.

Where a rotary axis moves, the rows of a line of the text take together at least what the rates of all axes need, and
what the controller gives them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.lazy import LateModule
from chipload.machine.feed import corner_speed, limited_speed, move_time, row_time_limited
from chipload.machine.machine import Machine
from chipload.machine.trajectory import TrajectoryPlanner
from chipload.program.commands import ARC, PLANE_AXES, Commands, spirals
from chipload.program.motions import bases, directions, is_arc, lengths, radii, sweeps
from chipload.program.path_mode import PathControl, resolve_tolerance
from chipload.program.program import ARC_CCW, ARC_CW, ARC_SKEW_MM, DWELL, LINE, RAPID, Program
from chipload.program.to_work import turning_times
from chipload.program.trajectory import planned_times

_jerk_limited = LateModule("chipload.program._jerk_limited")

#: what the jerk along the path of a milling machine is at least [mm/s^3], where nothing is stated: half of what
#: controls are delivered with. Reference: HEIDENHAIN, Technical Manual MANUALplus 620, 2012, p. 829: default 40 m/s^3;
#: Technical Manual iTNC 530 HSCI, 2013, p. 813: 35 m/s^3 for machining, 70 m/s^3 for rapids.
TYPICAL_JERK = 2e4

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class _Speeds(NamedTuple):
    """Rows that have a length: their numbers, lengths [mm], greatest speeds [mm/s], accelerations along the path
    [mm/s^2], and the greatest speeds at their ends [mm/s], one more than rows: of the joints, and within acceleration.
    """

    row: NDArray[np.int64]
    length: Floats
    most: Floats
    acceleration: Floats
    joints: Floats
    ends: Floats


def slow_machine(machine: Machine) -> Machine | None:
    """The machine with the least jerk that it may have; None: the time of a program on it is known.

    >>> from chipload.machine.machine import machine_named
    >>> slow_machine(machine_named("vmc")).jerk
    20000.0
    """
    if machine.planner is not None or machine.jerk is not None:
        return None
    least = TYPICAL_JERK if machine.jerk_low is None else machine.jerk_low
    return replace(machine, jerk=least, jerk_low=None)


def program_time(program: Program, machine: Machine) -> Floats:
    """Time of each row along the path of the tip.

    Returns
    -------
    (n,) float [s]
        Row 0, rows without length and rapids that send an axis for the first time take none, a dwell its own.

    Examples
    --------
    90 mm at 40 mm/s with 3000 mm/s^2 from rest to rest: 90/40 + 40/3000 s.

    >>> from chipload.machine.machine import machine_named
    >>> from chipload.program.build import plunge, rapid
    >>> p = Program.join([rapid([0, 0, 0], 0, 1, "link"), plunge([90, 0, 0], 40.0, 800.0, 1, "cut")])
    >>> program_time(p, machine_named("vmc")).round(6).tolist()
    [0.0, 2.263333]
    """
    unplaced = program.path_mode[:, 0] == PathControl.UNPLACED
    program = replace(program, path_mode=resolve_tolerance(program.path_mode, machine.corner_tolerance))
    if machine.planner is not None:
        return np.where(unplaced, 0.0, planned_times(program, machine, machine.planner))
    out = np.where(program.motion == DWELL, program.feed, 0.0)
    if (lengths(program) > 0.0).any():
        row, length, most, a, joints, v = _speeds(program, machine)
        if machine.jerk is None:
            out[row] = move_time(length, most, a, v[:-1], v[1:])
        else:
            out[row] = _jerk_limited.jerk_limited(length, most, a, joints, v, machine.jerk)[0]
    return np.where(unplaced, 0.0, out)


def change_time(dv: ArrayLike, acceleration: float, jerk: float | None) -> Floats:
    """Time (n,) [s] of changes of speed by ``dv`` (n,) [mm/s], without acceleration at both ends.

    >>> change_time([100.0, 1.0], 1000.0, 1e4).round(6).tolist()
    [0.2, 0.02]
    """
    d = np.abs(np.asarray(dv, dtype=np.float64))
    if jerk is None:
        return d / acceleration
    short = 2.0 * np.sqrt(d / jerk)
    return np.where(d >= acceleration**2 / jerk, d / acceleration + acceleration / jerk, short)


def time_high(program: Program, machine: Machine, time: float) -> float | None:
    """Time [s] of a program at the least jerk that the machine may have, at least ``time``; None: ``time`` is known."""
    slow = slow_machine(machine)
    return None if slow is None else max(float(program_time(program, slow).sum()), time)


def row_times(
    program: Program, machine: Machine, commands: Commands | None = None, axes: Floats | None = None
) -> Floats:
    """Time of each row on the machine; row k runs from ``cumsum(t)[k - 1]`` to ``cumsum(t)[k]``.

    Parameters
    ----------
    commands, axes : what the machine's axes do for the program, and (m, 9) where they stand after each row of it [mm,
        rad]; needed where rotary axes move. Rows belong together by their line.

    Returns
    -------
    (n,) float [s]
        The rows of a line share what its axes need beyond the path's own time.
    """
    own = program_time(program, machine)
    if commands is None or axes is None or not machine.chain.rotary or len(program) == 0:
        return own
    lines = np.unique(np.concatenate([program.line, commands.line]))
    at = np.searchsorted(lines, program.line)
    whole, count, needed = (np.zeros(len(lines)) for _ in range(3))
    np.add.at(whole, at, own)
    np.add.at(count, at, 1.0)
    if machine.planner is None:
        wanted = turning_times(commands)
        least = np.concatenate([[wanted[0]], row_time_limited(machine, axes, wanted[1:])])[: len(commands)]
    else:
        least = _axis_path_times(commands, machine, machine.planner)
    least = np.where(commands.path_mode[:, 0] == PathControl.UNPLACED, 0.0, least)
    np.add.at(needed, np.searchsorted(lines, commands.line), least)
    total = np.maximum(whole, needed) if machine.planner is None else needed
    share = np.where(whole[at] > 0.0, own / np.where(whole[at] > 0.0, whole[at], 1.0), 1.0 / count[at])
    return np.asarray(own + (total - whole)[at] * share)


def _axis_path_times(commands: Commands, machine: Machine, planner: TrajectoryPlanner) -> Floats:
    """(m,) time of each row of commands as LinuxCNC's planner sees it: a path of X Y Z with angles beside."""
    position = commands.machine()
    arc = (commands.motion == ARC) & ~spirals(commands, ARC_SKEW_MM)
    pair = np.array(PLANE_AXES)[commands.plane]
    shift = position - commands.position
    n = len(commands)
    centre, normal = np.zeros((n, 3)), np.tile([0.0, 0.0, 1.0], (n, 1))
    rows = np.flatnonzero(arc)
    for k in (0, 1):
        centre[rows, pair[rows, k]] = commands.centre[rows, k] + shift[rows, pair[rows, k]]
    normal[rows] = np.eye(3)[pair[rows, 2]]
    motion = np.array([RAPID, LINE, LINE, DWELL, LINE])[commands.motion]
    flat = Program(
        motion=np.where(arc, np.where(commands.turns > 0, ARC_CCW, ARC_CW), motion),
        p_work=position[:, :3], axis=np.tile([0.0, 0.0, 1.0], (n, 1)), centre=centre, normal=normal,
        turns=np.where(arc, np.abs(commands.turns) - 1, 0), feed=commands.feed, spindle=commands.spindle,
        tool=commands.tool, line=commands.line, label=commands.label, labels=commands.labels,
        path_mode=resolve_tolerance(commands.path_mode, machine.corner_tolerance),
    )  # fmt: skip
    return planned_times(flat, machine, planner, position[:, 3:])


def peak_speed(program: Program, machine: Machine) -> Floats:
    """Greatest speed that each row reaches; a higher feed does not change its time.

    Returns
    -------
    (n,) float [mm/s]
        0 in rows without length. Under LinuxCNC's planner what the row is asked for.

    Examples
    --------
    0.3 mm from rest to rest at 3000 mm/s^2: sqrt(900) mm/s, whatever is asked.

    >>> from chipload.machine.machine import machine_named
    >>> from chipload.program.build import plunge, rapid
    >>> p = Program.join([rapid([0, 0, 0], 0, 1, "link"), plunge([0.3, 0, 0], 90.0, 800.0, 1, "cut")])
    >>> peak_speed(p, machine_named("vmc")).round(6).tolist()
    [0.0, 30.0]
    """
    if machine.planner is not None:
        commanded = np.where(program.motion == RAPID, machine.rapid, np.minimum(program.feed, machine.feed_max))
        return np.where((lengths(program) > 0.0) & (program.motion != DWELL), commanded, 0.0)
    out = np.zeros(len(program))
    if (lengths(program) > 0.0).any():
        row, length, most, a, joints, v = _speeds(program, machine)
        if machine.jerk is not None:
            out[row] = _jerk_limited.jerk_limited(length, most, a, joints, v, machine.jerk)[1]
            return out
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
    along = np.abs(first)
    limit = np.array(machine.acceleration)
    at = np.flatnonzero(arc)
    normal = program.normal[at]
    swing = np.hypot(*bases(normal))
    climb = np.abs((first[at] * normal).sum(axis=1))
    level = np.sqrt(np.maximum(0.0, 1.0 - climb**2))
    along[at] = level[:, None] * swing + climb[:, None] * np.abs(normal)
    with np.errstate(divide="ignore"):
        a = (limit / along).min(axis=1)
        inward = (limit / swing).min(axis=1, initial=np.inf)
        around = np.minimum(speed[at], np.sqrt(inward * radii(program)[at]) / level)
    speed[at] = np.where(sweeps(program)[at] != 0.0, around, speed[at])
    if machine.block_time is not None:
        speed = np.minimum(speed, length / machine.block_time)
    # joints between rows that have a length
    here, there = row[:-1], row[1:]
    cos = (last[here] * first[there]).sum(axis=1)
    sin = np.linalg.norm(np.cross(last[here], first[there]), axis=1)
    mode = resolve_tolerance(program.path_mode, machine.corner_tolerance)[here]
    stated = np.where(mode[:, 1] > 0.0, mode[:, 1], machine.corner_tolerance)
    tolerance = np.where(mode[:, 0] == PathControl.CONTINUOUS, stated, 0.0)
    theta, least = np.arctan2(sin, cos), np.minimum(a[here], a[there])
    joint = corner_speed(theta, least, tolerance)
    half = 0.5 * np.minimum(length[here], length[there])
    with np.errstate(divide="ignore"):
        joint = np.where(joint < np.inf, np.minimum(joint, np.sqrt(least * half / np.tan(0.5 * theta))), joint)
    joint = np.where(mode[:, 0] == PathControl.EXACT_STOP, 0.0, joint)
    joint = np.minimum(joint, np.minimum(speed[here], speed[there]))
    rest = (program.motion[here] == RAPID) != (program.motion[there] == RAPID)
    rest |= (program.tool[here] != program.tool[there]) | (program.spindle[here] != program.spindle[there])
    waits = np.concatenate([[0], np.cumsum(program.motion == DWELL)])
    rest |= waits[here] != waits[there]
    joint = np.where(rest, 0.0, joint)
    ends = np.concatenate([[0.0], joint, [0.0]])
    v, _ = limited_speed(np.concatenate([[0.0], np.cumsum(length[row])]), ends, a[row])
    return _Speeds(row, length[row], speed[row], a[row], ends, v)
