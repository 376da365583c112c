"""The segments that LinuxCNC's canonical interface hands to its trajectory planner.

Notation: a segment is a row of a program, or several lines that the naive CAM detector has made one. L [mm] length,
v [mm/s] speed, a [mm/s^2] acceleration; of a segment on which only rotary axes move L in rad, v and a with it.

Reference: LinuxCNC 2.9, `emccanon`: straight and arc moves take the least time that every axis allows.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from chipload.machine.machine import Machine
from chipload.program.motions import bases, directions, is_arc, lengths, radii, rises, sweeps
from chipload.program.path_mode import PathControl
from chipload.program.program import DWELL, LINE, RAPID, Program

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: lines that may become one
LONGEST_CHAIN = 101


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments in columns.

    Parameters
    ----------
    row, first : (m,) int, the last and the first row of each in the program
    arc, rapid, turning : (m,) bool, whether it is an arc, a rapid, moves a rotary axis
    ends : (m,) bool, whether the machine waits after it: a dwell, a change of tool or spindle, the end
    length : (m,) float [mm or rad]
    begin, end : (m, 3) float, unit tangents at its ends
    point : (m, 3) float [mm], where it ends
    commanded, speed : (m,) float [mm/s], of the program, and what the axes allow
    acceleration : (m,) float [mm/s^2]
    radius, bend, sweep : (m,) float, radius [mm] of an arc, its effective radius of curvature [mm], its angle [rad]
    centre, normal : (m, 3) float, of an arc
    control, tolerance : (m,) int and (m,) float [mm], how the joint at its end is passed
    """

    row: Ints
    first: Ints
    arc: Bools
    rapid: Bools
    turning: Bools
    ends: Bools
    length: Floats
    begin: Floats
    end: Floats
    point: Floats
    commanded: Floats
    speed: Floats
    acceleration: Floats
    radius: Floats
    bend: Floats
    sweep: Floats
    centre: Floats
    normal: Floats
    control: Ints
    tolerance: Floats

    def __len__(self) -> int:
        return len(self.row)

    def taken(self, which: Ints) -> dict[str, NDArray[np.generic]]:
        """Columns of some of them."""
        return {f.name: getattr(self, f.name)[which] for f in fields(self)}


def segments_of(program: Program, machine: Machine, others: Floats | None = None) -> Segments:
    """Segments of a program whose points are of the machine's X Y Z.

    Parameters
    ----------
    others : (n, 6) float [rad, mm], A B C U V W at the end of each row; None: they stand
    """
    program, others, row = _merge_short(program, np.zeros((len(program), 6)) if others is None else others)
    step = np.diff(others, axis=0, prepend=others[:1])
    length = lengths(program)
    turning = np.abs(step).max(axis=1) > 1e-12
    alone = (length == 0.0) & turning
    slide = np.linalg.norm(step[:, 3:], axis=1)
    length = np.where(alone, np.where(slide > 0.0, slide, np.linalg.norm(step[:, :3], axis=1)), length)
    moves = (length > 0.0) & (program.motion != DWELL)
    moves[:1] = False
    speed, acceleration = _axis_limits(program, machine, step, length)
    speed = np.where(alone, speed, np.minimum(speed, machine.rapid))
    commanded = np.where(program.motion == RAPID, speed, np.minimum(speed, np.minimum(program.feed, machine.feed_max)))
    arc = is_arc(program) & (sweeps(program) != 0.0)
    begin, end = directions(program)
    r = np.where(arc, radii(program), np.inf)
    with np.errstate(invalid="ignore"):
        bend = np.where(arc, r + rises(program) ** 2 / r, np.inf)
    control = program.path_mode[:, 0].astype(np.int64)
    unsaid = (control == PathControl.MACHINE) | (control == PathControl.UNPLACED)
    control = np.where(unsaid, PathControl.CONTINUOUS, control)
    keep = np.flatnonzero(moves)
    first = np.concatenate([[0], row[:-1]]) + 1
    columns = {
        "row": row, "first": first, "arc": arc, "rapid": program.motion == RAPID, "turning": turning,
        "ends": np.zeros(len(row), dtype=bool), "length": length, "begin": begin, "end": end,
        "point": program.p_work, "commanded": commanded, "speed": speed, "acceleration": acceleration, "radius": r,
        "bend": bend, "sweep": np.abs(sweeps(program)), "centre": program.centre, "normal": program.normal,
        "control": control, "tolerance": program.path_mode[:, 1],
    }  # fmt: skip
    columns = {name: column[keep] for name, column in columns.items()}
    columns["ends"] = _waits(program, keep)
    return Segments(**columns)


def _waits(program: Program, keep: Ints) -> Bools:
    """(m,) whether the queue of motions runs empty after each segment."""
    here, there = keep[:-1], keep[1:]
    waits = np.cumsum(program.motion == DWELL)
    out = (program.tool[here] != program.tool[there]) | (program.spindle[here] != program.spindle[there])
    out |= waits[here] != waits[there]
    return np.concatenate([out, np.ones(min(len(keep), 1), dtype=bool)])


def _axis_limits(program: Program, machine: Machine, step: Floats, length: Floats) -> tuple[Floats, Floats]:
    """(n,), (n,) greatest speed and acceleration along each row that every axis allows."""
    rate, most = np.full(9, np.inf), np.full(9, np.inf)
    for axis in machine.chain.axes:
        rate[axis.column], most[axis.column] = axis.rate, axis.acceleration
    xyz = np.abs(program.p_work - np.vstack([program.p_work[:1], program.p_work[:-1]]))
    arc = is_arc(program)
    e1, e2 = bases(program.normal)
    swing, rise = np.hypot(e1, e2), np.abs(rises(program))[:, None] * np.abs(program.normal)
    around = (radii(program) * np.abs(sweeps(program)))[:, None] * np.where(swing > 1e-9, swing, 0.0)
    travel = np.hstack([np.where(arc[:, None], np.maximum(around, rise), xyz), np.abs(step)])
    out = []
    for limit in (rate, most):
        least = (travel / limit).max(axis=1)
        out.append(np.where(least > 0.0, length / np.where(least > 0.0, least, 1.0), np.inf))
    return out[0], out[1]


def _merge_short(program: Program, others: Floats) -> tuple[Program, Floats, Ints]:
    """The program with short lines that the naive CAM detector joins as one, and the last row of each.

    Lines of one feed are joined while the straight line to the last point passes every point between within the naive
    tolerance, at most ``LONGEST_CHAIN`` of them.
    """
    mode = program.path_mode
    able = (program.motion == LINE) & (mode[:, 0] == PathControl.CONTINUOUS) & (mode[:, 2] > 0.0)
    able &= np.abs(np.diff(others, axis=0, prepend=others[:1])).max(axis=1) <= 0.0
    able[:1] = False
    same = np.zeros(len(program), dtype=bool)
    for name in ("feed", "spindle", "tool"):
        column = getattr(program, name)
        same[1:] |= column[1:] != column[:-1]
    same[1:] |= (mode[1:] != mode[:-1]).any(axis=1)
    joins = able & ~same
    joins[1:] &= able[:-1]
    keep = np.ones(len(program), dtype=bool)
    p = program.p_work
    start, last = -1, -1  # the row before the chain; the row looked at before
    for k in np.flatnonzero(joins).tolist():
        start = start if last == k - 1 else k - 2
        last = k
        if k - 1 - start < LONGEST_CHAIN and _lie_on_line(p[start], p[k], p[start + 1 : k], mode[k, 2]):
            keep[k - 1] = False
        else:
            start = k - 1
    rows = np.flatnonzero(keep)
    if keep.all():
        return program, others, rows
    columns = {f.name: getattr(program, f.name)[rows] for f in fields(Program) if f.name != "labels"}
    return Program(**columns, labels=program.labels), others[rows], rows


def _lie_on_line(begin: Floats, end: Floats, points: Floats, tolerance: float) -> bool:
    """Whether points lie within the tolerance of the line from ``begin`` to ``end``."""
    d = end - begin
    square = float(d @ d)
    if square == 0.0:
        return False
    share = ((points - begin) @ d / square).clip(0.0, 1.0)
    return bool(np.linalg.norm(points - begin - share[:, None] * d, axis=1).max() <= tolerance)
