"""Time that LinuxCNC's trajectory planner gives a program, row by row.

Notation: as in :mod:`~chipload.program.blends`. A trapezoid of speed on every segment and blend arc; the speed at a
joint is the greatest from which the machine can come to rest at the end of the last segment that is looked ahead.

Reference: LinuxCNC 2.9, `tp.c`. Differs from source: time is continuous but for stops, which end with a servo
cycle; the queue never runs empty.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.machine.feed import limited_speed, move_time
from chipload.machine.machine import Machine
from chipload.machine.trajectory import TrajectoryPlanner
from chipload.program.blends import (
    ARC,
    LEAST_CYCLES,
    NORMAL,
    PARABOLIC,
    REST,
    SMOOTH,
    TANGENTIAL,
    Joints,
    joints_of,
    parabolic_speeds,
)
from chipload.program.program import DWELL, Program
from chipload.program.segments import Segments, segments_of

Floats = NDArray[np.float64]


def planned_times(
    program: Program, machine: Machine, planner: TrajectoryPlanner, others: Floats | None = None
) -> Floats:
    """(n,) time of each row [s], from when the row before is left: a dwell its own, row 0 none.

    Parameters
    ----------
    others : (n, 6) float [rad, mm], A B C U V W of the machine at the end of each row; None: they stand
    """
    out = np.where(program.motion == DWELL, program.feed, 0.0)
    segments = segments_of(program, machine, others)
    if len(segments) == 0:
        return out
    seconds = _segment_times(segments, joints_of(segments, machine, planner), planner)
    share = np.ones(len(program))
    own = np.linalg.norm(np.diff(program.p_work, axis=0, prepend=program.p_work[:1]), axis=1)
    for k in np.flatnonzero(segments.first < segments.row):
        rows = slice(int(segments.first[k]), int(segments.row[k]) + 1)
        share[rows] = own[rows] / own[rows].sum()
    which = np.repeat(np.arange(len(segments)), segments.row - segments.first + 1)
    rows_of = np.concatenate([np.arange(f, r + 1) for f, r in zip(segments.first, segments.row, strict=True)])
    merged = np.isin(rows_of, segments.row) | (share[rows_of] != 1.0)
    out[rows_of[merged]] += (seconds[which] * share[rows_of])[merged]
    return out


def _segment_times(s: Segments, joints: Joints, planner: TrajectoryPlanner) -> Floats:
    """(m,) time of each segment; half of a blend arc counts to either side."""
    m = len(s)
    smooth = np.append(joints.kind == SMOOTH, False)
    blended = np.append(joints.kind == ARC, False)
    parabolic = np.append(joints.kind == PARABOLIC, (s.control == 3)[-1])
    # a segment before a pause keeps its parabolic end: half the acceleration
    parabolic |= s.ends & (s.control == 3)
    # a segment with a rotary axis is never compared with the one before it: it keeps its acceleration
    compared = ~(s.turning[:-1] | s.turning[1:]) & planner.blend_arcs
    before = np.concatenate([[False], parabolic[:-1] & ~s.ends[:-1] & compared])
    loss = np.append(joints.reduction, 0.0)
    scale = 1.0 - np.maximum(loss, np.concatenate([[0.0], loss[:-1]]))
    overall = s.acceleration * scale * np.where(parabolic | before, 0.5, 1.0)
    trim1, trim2 = np.append(joints.trim1, 0.0), np.concatenate([[0.0], joints.trim2])
    length = np.maximum(s.length - trim1 - trim2, 0.0)
    # what a blend arc leaves of a line for a few cycles becomes part of the arc
    eaten = blended & ~s.arc & ~before & (length < planner.gap_cycles * planner.cycle * np.append(joints.speed, 0.0))
    least = np.where(eaten, np.append(joints.length, 0.0), 0.0) + length
    top = np.minimum(s.speed, least / (planner.cycle * LEAST_CYCLES))
    # an arc before a pause is judged before it is known to end parabolically
    judged = np.where(s.ends, s.acceleration, overall)
    bent = np.sqrt(NORMAL * judged * s.bend)
    ratio = np.where(bent < top, TANGENTIAL, np.sqrt(np.maximum(1.0 - (top**2 / (judged * s.bend)) ** 2, 0.0)))
    top = np.where(s.arc, np.minimum(top, bent), top)
    a = np.where(s.arc, overall * ratio, overall)
    wanted = np.minimum(s.commanded, top)
    # the list with blend arcs in it: place of each segment, and of the arc after it
    place = np.arange(m) + np.concatenate([[0], np.cumsum(blended)[:-1]])
    arcs = place[blended] + 1
    count = m + int(blended.sum())
    lengths, speeds, most, rapid = np.zeros(count), np.zeros(count), np.ones(count), np.zeros(count, dtype=bool)
    lengths[place], speeds[place], most[place], rapid[place] = length, wanted, a, s.rapid
    j = np.flatnonzero(joints.kind == ARC)
    lengths[arcs] = joints.length[j]
    speeds[arcs] = np.minimum(joints.speed[j], np.maximum(s.commanded[j], s.commanded[j + 1]))
    whole = joints.length[j] + np.where(eaten[j], length[j], 0.0)
    speeds[arcs] = np.minimum(speeds[arcs], whole / (planner.cycle * LEAST_CYCLES))
    most[arcs] = TANGENTIAL * joints.acceleration[j]
    absorbed = np.flatnonzero(eaten)
    speeds[place[absorbed]], most[place[absorbed]] = speeds[place[absorbed] + 1], most[place[absorbed] + 1]
    limit = np.zeros(count + 1)
    limit[1:-1] = np.minimum(speeds[:-1], speeds[1:])
    at = place + 1
    limit[at[~blended & ~smooth]] = 0.0
    slow = np.flatnonzero(smooth)
    limit[at[slow]] = np.minimum(limit[at[slow]], joints.speed[slow])
    # the last segment before a pause is entered while its end may still be cut: no faster than it stops in its half
    last = np.flatnonzero(s.ends & ~(blended | smooth))
    limit[place[last]] = np.minimum(limit[place[last]], np.sqrt(most[place[last]] * lengths[place[last]]))
    there = np.ones(count, dtype=bool)
    there[place[absorbed]] = False
    limit = _stopping_speeds(limit, lengths, most, there, planner.lookahead)
    v, _ = limited_speed(np.concatenate([[0.0], np.cumsum(lengths)]), limit, most)
    seconds = _times_of_segments(lengths, speeds, most, v, limit, rapid, planner)
    total = seconds[place]
    total[:-1][joints.kind == ARC] += 0.5 * seconds[arcs]
    total[1:][joints.kind == ARC] += 0.5 * seconds[arcs]
    total = total - _overlap(s, joints, length, a, wanted)
    return _whole_cycles(total, np.append(joints.kind == REST, True) | s.ends, planner.cycle)


def _whole_cycles(seconds: Floats, rests: NDArray[np.bool_], cycle: float) -> Floats:
    """Times of segments with every stretch from rest to rest rounded up to whole cycles, at its last segment."""
    last = np.flatnonzero(rests)
    total = np.add.reduceat(seconds, np.concatenate([[0], last[:-1] + 1]))
    out = np.array(seconds)
    out[last] += cycle * np.ceil(total / cycle - 1e-6) - total
    return out


def _stopping_speeds(limit: Floats, length: Floats, a: Floats, there: NDArray[np.bool_], depth: int) -> Floats:
    """Speeds at the joints from which the machine comes to rest within ``depth`` segments that are ``there``."""
    room = np.concatenate([[0.0], np.cumsum(2.0 * a * length)])
    number = np.concatenate([[0], np.cumsum(there)])
    far = np.minimum(np.searchsorted(number, number + depth), len(room) - 1)
    return np.asarray(np.minimum(limit, np.sqrt(room[far] - room)))


def _times_of_segments(
    length: Floats, speed: Floats, a: Floats, v: Floats, limit: Floats, rapid: NDArray[np.bool_],
    planner: TrajectoryPlanner,
) -> Floats:  # fmt: skip
    """Times of segments: a trapezoid, or an even change of speed where they are short and lead on."""
    seconds = move_time(length, speed, a, v[:-1], v[1:])
    total = v[:-1] + v[1:]
    estimate = 2.0 * length / np.where(total > 0.0, v[:-1] + np.minimum(limit[1:], speed), 1.0)
    ramp = (v[1:] > 0.0) & ~rapid & (estimate < 1.0 / planner.ramp_frequency)
    return np.asarray(np.where(ramp, 2.0 * length / np.where(total > 0.0, total, 1.0), seconds))


def _overlap(s: Segments, joints: Joints, length: Floats, a: Floats, wanted: Floats) -> Floats:
    """(m,) time that each segment begins before the one before it ends: parabolic blends."""
    out = np.zeros(len(s))
    k = np.flatnonzero(joints.kind == PARABOLIC)
    if len(k) == 0:
        return out
    theta = 0.5 * np.arccos(np.clip(-(s.end[k] * s.begin[k + 1]).sum(axis=1), -1.0, 1.0))
    v1, _ = parabolic_speeds(
        (a[k], a[k + 1]), (length[k], length[k + 1]), (1.0, 1.0), (wanted[k], wanted[k + 1]), s.tolerance[k], theta
    )
    out[k + 1] = v1 / a[k]
    return out
