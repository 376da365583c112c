"""Moves divided into segments, so that linear motion of the axes stays near the straight path on the workpiece.

Notation: x(t) [mm] tip and a(t) unit axis of the tool in the work frame, q(t) axis positions; h length of a segment as
a fraction of its move, e [mm or rad] greatest deviation of a segment from its part of the move.

A machine interpolates its axes linearly from row to row, and the tip leaves the straight line. To leading order e is
h^2/8 times the second derivative of the tip, so a segment with deviation e is divided into ceil(sqrt(e / tolerance))
parts. This is only an estimate: the deviation of every segment is measured at ``PLACES`` points between its ends, with
a margin for the deviation between these points, and the segment is divided again until it is within the tolerance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import Finding, InputError
from chipload.machine.axis import LETTERS
from chipload.machine.follow import follow
from chipload.machine.kinematics import forward
from chipload.machine.machine import Machine
from chipload.machine.orientation import angle_between

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: points inside a segment at which its deviation is measured
PLACES = 7
#: samples at eighths miss at most 1/64 of the height of a parabola; the rest of the margin is for its skew
_MARGIN = 1.05
_PARTS = 256  # greatest number of parts of a segment in one round
_PARTS_FACTOR = 1.1  # factor on the estimated number of parts, so that one round is mostly enough
_JUMP, _JUMPS = 16, 3  # parts of a segment with over a quarter turn; rounds in which it is divided
_ROUNDS = 12  # greatest number of rounds
_TURN = math.pi / 4.0  # [rad] greatest rotation of an axis in a traced segment
_CHUNK = 1 << 15  # segments that are measured at once
_ROTARY = [LETTERS.index(letter) for letter in "ABC"]


@dataclass(frozen=True, eq=False)
class AxisSegments:
    """Moves divided into segments.

    Parameters
    ----------
    tip : (m, 3) float [mm], axis : (m, 3) float
        Ends of the segments in the work frame; the first row is row 0 of the path.
    axes : (m, 9) float [mm, rad]
        Axis positions at these ends.
    row : (m,) int
        Row of the path at the end of the move to which a segment belongs; never falls.
    part : (m,) float
        Fraction of that move at which the segment ends, in (0, 1]; 1 at the rows of the path.
    """

    tip: Floats
    axis: Floats
    axes: Floats
    row: Ints
    part: Floats


def linearise(
    machine: Machine,
    tip: ArrayLike,
    axis: ArrayLike,
    tolerance: float,
    angle_tolerance: float,
    start: ArrayLike | None = None,
    tool_length: float = 0.0,
    work_zero: ArrayLike | None = None,
    free: str | None = None,
    pole_tolerance: float = 1e-9,
    max_rows: int = 1_000_000,
) -> tuple[AxisSegments, tuple[Finding, ...]]:
    """Divide moves until linear motion of the axes keeps the tip on its line and the tool axis on its great circle.

    From row to row of the path, the tip moves on a straight line and the tool axis on a great circle. O(m) for m
    segments and each round; two or three rounds are usually enough.

    Parameters
    ----------
    tip : (n, 3) float [mm], axis : (n, 3) float
        In the work frame, n >= 1.
    tolerance : float [mm], > 0
        Greatest distance of the tip from the straight line.
    angle_tolerance : float [rad], > 0
        Greatest angle of the tool axis to the plane of the great circle.
    start, work_zero, free, pole_tolerance : as in ``follow``
    tool_length : float [mm]
        From the spindle's nose to the tip.
    max_rows : greatest number of rows of the result

    Returns
    -------
    The segments, and the findings of ``follow`` for their rows. A further finding, ``machine-linear``, is a move in
    which the rotary axes jump, so that no division helps.

    Raises
    ------
    InputError
        A tolerance is not above 0, the axis turns by 180 degrees in a move, or more than ``max_rows`` rows are needed.

    Examples
    --------
    >>> from chipload.machine.machine import machine_named
    >>> tips, axes = [[0.0, 0.0, 0.0], [50.0, 0.0, 0.0]], [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]]
    >>> coarse, _ = linearise(machine_named("xyzac-trunnion"), tips, axes, 0.1, 0.01)
    >>> fine, _ = linearise(machine_named("xyzac-trunnion"), tips, axes, 0.001, 0.01)
    >>> 8.0 < (len(fine.row) - 1) / (len(coarse.row) - 1) < 12.0
    True
    """
    if not (0.0 < tolerance < math.inf and 0.0 < angle_tolerance < math.inf):
        raise InputError(f"linearise: tolerance {tolerance:g}, angle_tolerance {angle_tolerance:g}: must be above 0")
    p, a = np.asarray(tip, dtype=np.float64), np.asarray(axis, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3 or a.shape != p.shape or len(p) == 0:
        raise InputError(f"linearise: tip {p.shape} and axis {a.shape}: must be (n, 3) and (n, 3), n >= 1")
    a = a / np.linalg.norm(a, axis=1)[:, None]
    turn = angle_between(a[1:], a[:-1])
    if (turn > math.pi - 1e-6).any():
        worst = int(turn.argmax()) + 1
        raise InputError(
            f"linearise: row {worst}: the axis turns by 180 deg: must be less, no great circle is the shortest"
        )
    row: Ints = np.arange(len(p), dtype=np.int64)
    part: Floats = np.ones(len(p))
    for count in range(_ROUNDS):
        x, d = _poses_along(p, a, row, part)
        axes, findings = follow(machine, x, d, start, tool_length, work_zero, free, pole_tolerance, None)
        e = np.zeros(len(row) - 1)
        for k in range(0, len(e), _CHUNK):
            some = slice(k, k + _CHUNK + 1)
            e[k : k + _CHUNK] = _deviation(
                machine, axes[some], x[some], d[some], tool_length, work_zero, tolerance, angle_tolerance
            )
        parts = np.where(
            np.isinf(e), _JUMP if count < _JUMPS else 1, np.minimum(np.ceil(np.sqrt(e) * _PARTS_FACTOR), _PARTS)
        )
        parts = np.where(e > 1.0, parts, 1.0).astype(np.int64)
        if (parts == 1).all() or count == _ROUNDS - 1:
            break
        row, part = _divide_segments(row, part, parts, max_rows)
    jumps = sorted(set(row[1:][e > 1.0].tolist()))
    text = "row {}: the rotary axes jump: no piece is short enough for the tolerance: retract before it"
    found = tuple(Finding("machine-linear", 0, text.format(k)) for k in jumps)
    return AxisSegments(x, d, axes, row, part), (*findings, *found)


def trace_path(
    machine: Machine,
    axes: ArrayLike,
    tolerance: float,
    tool_length: float = 0.0,
    work_zero: ArrayLike | None = None,
    max_rows: int = 1_000_000,
) -> AxisSegments:
    """The path in the work frame of a machine that interpolates its axes linearly from row to row.

    The chords of the segments deviate from the path by at most ``tolerance`` (each point is compared with the same
    fraction of its chord); no rotary axis turns by more than 45 degrees in a segment. O(m).

    Parameters
    ----------
    axes : (n, 9) float [mm, rad]
    tolerance : float [mm], > 0
    tool_length, work_zero, max_rows : as in ``linearise``

    Raises
    ------
    InputError
        The tolerance is not above 0, ``axes`` has a wrong shape or a value that is not finite, or more than
        ``max_rows`` rows are needed.

    Examples
    --------
    A quarter turn of a table with the tip 50 mm off its axis: a chord 0.01 mm off its arc spans
    2 acos(1 - 0.01/50) = 2.29 degrees, so at least 39.3 segments are needed.

    >>> from chipload.machine.machine import machine_named
    >>> axes = np.zeros((2, 9))
    >>> axes[:, 0], axes[1, 5] = 50.0, np.pi / 2
    >>> path = trace_path(machine_named("cradle-ac"), axes, 0.01)
    >>> len(path.row) - 1, np.linalg.norm(path.tip[::11, :2], axis=1).round(9).tolist()
    (44, [50.0, 50.0, 50.0, 50.0, 50.0])
    """
    if not 0.0 < tolerance < math.inf:
        raise InputError(f"traced: tolerance {tolerance:g}: must be above 0")
    q = np.asarray(axes, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != 9 or len(q) == 0 or not np.isfinite(q).all():
        raise InputError(f"traced: axes {q.shape}: must be (n, 9) finite numbers, n >= 1")
    row: Ints = np.arange(len(q), dtype=np.int64)
    part: Floats = np.ones(len(q))
    turns = np.abs(np.diff(q[:, _ROTARY], axis=0)).max(axis=1, initial=0.0)
    if turns.sum() / _TURN > max_rows:
        raise InputError(f"traced: more than {max_rows} pieces: raise the tolerance or max_rows")
    parts = np.maximum(np.ceil(turns / _TURN), 1.0).astype(np.int64)
    while True:
        row, part = _divide_segments(row, part, parts, max_rows)
        at = _interpolate_rows(q, row, part)
        x, d = forward(machine, at, tool_length, work_zero)
        e = np.zeros(len(row) - 1)
        for k in range(0, len(e), _CHUNK):
            some = slice(k, k + _CHUNK + 1)
            tips, _, share = _poses_between(machine, at[some], tool_length, work_zero)
            chord = x[some][:-1, None] + share[:, None] * np.diff(x[some], axis=0)[:, None]
            e[k : k + _CHUNK] = _MARGIN * np.linalg.norm(tips - chord, axis=2).max(axis=1) / tolerance
        parts = np.where(e > 1.0, np.minimum(np.ceil(np.sqrt(e) * _PARTS_FACTOR), _PARTS), 1.0).astype(np.int64)
        if (parts == 1).all():
            return AxisSegments(x, d, at, row, part)


def _interpolate_rows(values: Floats, row: Ints, part: Floats) -> Floats:
    """Rows of ``values`` (n, c) interpolated linearly along their moves; exact at the rows themselves."""
    end, begin = values[row], values[np.maximum(row - 1, 0)]
    return np.asarray(np.where(part[:, None] == 1.0, end, begin + part[:, None] * (end - begin)))


def _poses_along(p: Floats, a: Floats, row: Ints, part: Floats) -> tuple[Floats, Floats]:
    """Tips along straight lines, axes along great circles."""
    end, begin = a[row], a[np.maximum(row - 1, 0)]
    turn = angle_between(begin, end)[:, None]
    u = part[:, None]
    small = turn < 1e-12
    over = np.where(small, 1.0, np.sin(turn))
    d = np.where(small, end, (np.sin((1.0 - u) * turn) * begin + np.sin(u * turn) * end) / over)
    return _interpolate_rows(p, row, part), np.where(u == 1.0, end, d)


def _poses_between(
    machine: Machine, axes: Floats, tool_length: float, work_zero: ArrayLike | None
) -> tuple[Floats, Floats, Floats]:
    """Tips and axes (k, PLACES, 3) at points inside k segments of linear axis motion, and their fractions."""
    share = np.arange(1, PLACES + 1) / (PLACES + 1.0)
    q = axes[:-1, None] + share[:, None] * np.diff(axes, axis=0)[:, None]
    tips, directions = forward(machine, q.reshape(-1, 9), tool_length, work_zero)
    shape = (len(axes) - 1, PLACES, 3)
    return tips.reshape(shape), directions.reshape(shape), share


def _deviation(
    machine: Machine,
    axes: Floats,
    x: Floats,
    d: Floats,
    tool_length: float,
    work_zero: ArrayLike | None,
    tolerance: float,
    angle_tolerance: float,
) -> Floats:
    """Deviation (k,) of segments from line and great circle, in tolerances; inf where an axis turns over 90 degrees."""
    tips, directions, _ = _poses_between(machine, axes, tool_length, work_zero)
    chord = np.diff(x, axis=0)
    square = (chord**2).sum(axis=1)
    off = tips - x[:-1, None]
    along = np.clip(np.einsum("kps,ks->kp", off, chord) / np.where(square > 0.0, square, 1.0)[:, None], 0.0, 1.0)
    line = np.linalg.norm(off - along[..., None] * chord[:, None], axis=2).max(axis=1) / tolerance
    normal = np.cross(d[:-1], d[1:])
    size = np.linalg.norm(normal, axis=1)
    still = size < 1e-9
    out = np.abs(np.einsum("kps,ks->kp", directions, normal / np.where(still, 1.0, size)[:, None]))
    leaves = np.where(still[:, None], angle_between(directions, d[:-1, None]), np.arcsin(np.clip(out, 0.0, 1.0)))
    e = _MARGIN * np.maximum(line, leaves.max(axis=1) / angle_tolerance)
    half = np.abs(np.diff(axes[:, _ROTARY], axis=0)).max(axis=1) > 0.5 * math.pi
    return np.asarray(np.where(half, math.inf, e))


def _divide_segments(row: Ints, part: Floats, parts: Ints, max_rows: int) -> tuple[Ints, Floats]:
    """Every segment divided into its number of equal parts."""
    total = int(parts.sum()) + 1
    if total > max_rows:
        raise InputError(f"{total} pieces are more than max_rows = {max_rows}: raise the tolerance or max_rows")
    begin = np.where(row[1:] == row[:-1], part[:-1], 0.0)
    last = np.cumsum(parts)
    k = np.arange(1, total) - np.repeat(last - parts, parts)
    share = k / np.repeat(parts, parts)
    b, e = np.repeat(begin, parts), np.repeat(part[1:], parts)
    cut = np.where(share == 1.0, e, b + share * (e - b))
    return np.concatenate([row[:1], np.repeat(row[1:], parts)]), np.concatenate([part[:1], cut])
