"""Axis positions along a path: the choice of solution, and of whole turns, at every row.

Notation: free axes are the rotary axes that are solved for, m <= 2; a state at a row is one of the k solutions of
:func:`~chipload.machine.kinematics.inverse` with whole turns added to each free angle; D [rad] is the rotary motion of
a step, the greatest |change| of a free angle. Dynamic programming finds the path through the states with the least sum
of D. A row outside a limit costs more than any motion, so a limit is violated only where no other path exists. Limits
of linear axes, which another work offset may satisfy, are violated before those of rotary axes. Motion of an indexed
axis during a cut costs more still. An axis with a range of more than ``FEW`` turns has too many states: the search
ignores its whole turns. They are added afterwards: the axis takes the shorter direction at each step and unwinds where
it reaches a limit, as late as possible and so the fewest times.

At a pole the angle of the first free axis is arbitrary: it keeps its last value.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import Finding, InputError
from chipload.machine.axis import Axis
from chipload.machine.kinematics import Solutions, inverse, with_tip
from chipload.machine.limits import SLACK, distance_beyond, limit_findings, position_text, text_of_rows
from chipload.machine.machine import Machine
from chipload.machine.orientation import angle_between, wrap_angles

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: greatest range of an axis, in turns, for which the search includes every turn
FEW = 4
#: angle [rad] by which a tool axis may be out of reach and still counts as reached
REACH = 1e-6
#: a free angle that turns more than GAIN times as far as the tool axis, and more than SWING [rad], is reported
GAIN, SWING = 10.0, math.radians(30.0)

#: cost [rad] of a row outside a limit of a linear axis and of a rotary axis; cost of each radian that an indexed axis
#: moves during a cut
_OUTSIDE_LINEAR, _OUTSIDE_ROTARY, _INDEXED_IN_CUT = 1e6, 1e9, 1e12
_STILL = 1e-6  # [rad] motion up to which an axis counts as standing
_TIE = 1e-6  # weight of the sum of all free motions, relative to the greatest
_CHUNK = 1 << 18  # steps in memory at once
_AHEAD = 4096  # rows of look-ahead when the turns of a wide axis are chosen
_TURNS = 1000  # greatest number of whole turns that it unwinds


def follow(
    machine: Machine,
    tip: ArrayLike,
    axis: ArrayLike,
    start: ArrayLike | None = None,
    tool_length: ArrayLike = 0.0,
    work_zero: ArrayLike | None = None,
    free: str | None = None,
    pole_tolerance: float = 1e-9,
    line: ArrayLike | None = None,
    stand: ArrayLike | None = None,
) -> tuple[Floats, tuple[Finding, ...]]:
    """Axis positions for every row of a path: least rotary motion within the limits; O(n S^2) for S states per row.

    Parameters
    ----------
    tip : (n, 3) float [mm], axis : (n, 3) float
        In the work frame, as in ``inverse``.
    start : (9,) float [mm, rad]
        Axis positions before row 0; axes that are not solved for stay there. None: they are at 0.
    tool_length, work_zero, free, pole_tolerance : as in ``inverse``
    line : (n,) int, line of each row in its source; None: 0
    stand : (n,) bool, rows during which indexed axes must stand, such as cuts; None: no such row

    Returns
    -------
    axes : (n, 9) float [mm, rad]
    findings
        ``machine-limit``, ``machine-index``, ``machine-reach`` (a tool axis is out of reach and replaced by the
        nearest direction), ``machine-rewind`` (whole turns back), ``machine-singular`` (rows at a pole; a swing near
        one).

    Raises
    ------
    InputError
        ``start`` is not nine finite numbers, or ``inverse`` refuses the path.

    Examples
    --------
    A tool axis that travels twice around a cone of 45 degrees: C makes two turns, A stays.

    >>> from chipload.machine.machine import machine_named
    >>> t = np.linspace(0.0, 4.0 * np.pi, 9)
    >>> cone = np.column_stack([np.sin(t), np.cos(t), np.ones(9)])
    >>> axes, findings = follow(machine_named("xyzac-trunnion"), np.zeros((9, 3)), cone)
    >>> np.degrees(axes[[0, 8], 5]).round(6).tolist(), np.degrees(axes[[0, 8], 3]).round(6).tolist()
    ([0.0, 720.0], [45.0, 45.0])
    >>> findings
    ()
    """
    begin = None if start is None else np.array(start, dtype=np.float64)
    if begin is not None and (begin.shape != (9,) or not np.isfinite(begin).all()):
        raise InputError("start: must be nine finite numbers")
    found = inverse(machine, tip, axis, tool_length, work_zero, begin, free, pole_tolerance)
    n = len(found.axes)
    lines = np.zeros(n, dtype=np.int64) if line is None else np.asarray(line, dtype=np.int64)
    singular = found.pole <= pole_tolerance
    if n == 0:
        return np.zeros((0, 9)), ()
    axes = np.array(found.axes[:, 0])
    if found.free:
        found = _with_poles(machine, found, singular, begin, tip, tool_length, work_zero)
        wide = [not one.high - one.low <= FEW * math.tau + SLACK for one in found.free]
        values, branch = _shortest(machine, found, wide, begin, stand)
        for k, one in enumerate(found.free):
            if wide[k]:
                values[:, k] = _with_turns(one, values[:, k], None if begin is None else float(begin[one.column]))
        axes = np.take_along_axis(found.axes, branch[:, None, None], axis=1)[:, 0]
        axes[:, [one.column for one in found.free]] = values
    directions = np.asarray(axis, dtype=np.float64)
    findings = [*_reach(found, lines), *_singular(found, singular, axes, directions, lines)]
    return axes, (*findings, *_rewinds(found.free, axes, lines), *limit_findings(machine, axes, lines))


def _with_poles(
    machine: Machine,
    found: Solutions,
    singular: NDArray[np.bool_],
    begin: Floats | None,
    tip: ArrayLike,
    tool_length: ArrayLike,
    work_zero: ArrayLike | None,
) -> Solutions:
    """The solutions with the first free angle at each pole equal to that of the row before, and X Y Z to match."""
    known = np.flatnonzero(~singular)
    last = np.maximum.accumulate(np.where(singular, -1, np.arange(len(singular))))
    if begin is None and len(known):
        last[last < 0] = known[0]
    rows = np.flatnonzero(singular & (last >= 0))
    if len(rows) == 0:
        return found
    axes = found.axes.copy()
    column = found.free[0].column
    axes[rows, :, column] = axes[last[rows], :, column]
    length = np.broadcast_to(np.asarray(tool_length, dtype=np.float64), (len(axes),))[rows]
    points = np.asarray(tip, dtype=np.float64)[rows]
    for branch in range(axes.shape[1]):
        axes[rows, branch] = with_tip(machine, axes[rows, branch], points, length, work_zero)
    return replace(found, axes=axes)


def _shortest(
    machine: Machine, found: Solutions, wide: list[bool], begin: Floats | None, stand: ArrayLike | None
) -> tuple[Floats, Ints]:
    """Values (n, m) of the free angles, without the whole turns of wide axes, and the number (n,) of their solution."""
    angles = found.axes[:, :, [one.column for one in found.free]]
    n, k, m = angles.shape
    states = angles[:, :, None, :]  # (n, k, turns, m)
    for i, one in enumerate(found.free):
        if wide[i]:
            continue
        middle = 0.5 * (one.low + one.high)
        some = math.floor((0.5 * (one.high - one.low) + math.pi) / math.tau + SLACK)
        turns = np.arange(-some, some + 1) * math.tau
        near = middle + wrap_angles(states[..., i] - middle)
        with_turns = np.repeat(states, len(turns), axis=2)
        with_turns[..., i] = (near[..., None] + turns).reshape(n, k, -1)
        states = with_turns
    turned_states = states.shape[2]
    states = states.reshape(n, k * turned_states, m)
    penalty = _cost_outside(machine, found, states, wide)
    loose, indexed = np.array(wide), np.array([one.indexed for one in found.free])
    stands = np.zeros(n) if stand is None else np.where(np.asarray(stand, dtype=np.bool_), _INDEXED_IN_CUT, 0.0)
    count = k * turned_states

    def axis_motion(a: Floats, b: Floats) -> Floats:
        change = np.abs(np.where(loose, wrap_angles(b - a), b - a))
        return np.asarray(change.max(axis=-1) + _TIE * change.sum(axis=-1))

    def indexed_turn(a: Floats, b: Floats) -> Floats:
        change = np.abs(wrap_angles(b - a))
        return np.asarray((np.where(change > _STILL, change, 0.0) * indexed).sum(axis=-1))

    if begin is None:
        cost = penalty[0] + _TIE * axis_motion(np.zeros(m), states[0])
    else:
        cost = penalty[0] + axis_motion(begin[[one.column for one in found.free]], states[0])
    previous = np.zeros((n, count), dtype=np.int64)
    rows = max(1, _CHUNK // (count * count * m))
    for low in range(1, n, rows):
        high = min(low + rows, n)
        steps = axis_motion(states[low - 1 : high - 1, :, None], states[low:high, None, :])
        if stands.any() and indexed.any():
            steps += stands[low:high, None, None] * indexed_turn(
                states[low - 1 : high - 1, :, None], states[low:high, None, :]
            )
        for i in range(low, high):
            total = cost[:, None] + steps[i - low]
            previous[i] = total.argmin(axis=0)
            cost = total[previous[i], np.arange(count)] + penalty[i]
        cost = cost - cost.min()
    chosen = np.empty(n, dtype=np.int64)
    chosen[-1] = int(cost.argmin())
    for i in range(n - 1, 0, -1):
        chosen[i - 1] = previous[i, chosen[i]]
    return states[np.arange(n), chosen], chosen // turned_states


def _cost_outside(machine: Machine, found: Solutions, states: Floats, wide: list[bool]) -> Floats:
    """Cost (n, states) [rad] of positions outside the limits."""
    turned, away = np.zeros(states.shape[:2]), np.zeros(states.shape[:2])
    for i, one in enumerate(found.free):
        if not wide[i]:
            turned += distance_beyond(one, states[..., i])
    turned_states = states.shape[1] // found.axes.shape[1]
    for one in machine.chain.axes:
        if one not in found.free:
            out = turned if one.rotary else away
            out += np.repeat(distance_beyond(one, found.axes[:, :, one.column]), turned_states, axis=1)
    return np.where(turned > SLACK, _OUTSIDE_ROTARY + turned, 0.0) + np.where(away > SLACK, _OUTSIDE_LINEAR + away, 0.0)


def _with_turns(axis: Axis, q: Floats, begin: float | None) -> Floats:
    """Angles (n,) of a wide axis with whole turns added: shortest from row to row, unwound where it reaches a limit."""
    first = 0.0 if begin is None else begin
    path = first + np.cumsum(wrap_angles(np.diff(q, prepend=first)))
    path = q + math.tau * np.round((path - q) / math.tau)  # rounding errors do not accumulate
    out = path.copy()
    i, turn = 0, 0
    while i < len(path):
        seen = path[i : i + _AHEAD]
        most, least = np.maximum.accumulate(seen), np.minimum.accumulate(seen)

        def rows(t: int, most: Floats = most, least: Floats = least) -> int:
            """Number of rows from i on that lie within the limits with t turns added."""
            over = np.searchsorted(most, axis.high + SLACK - math.tau * t, "right")
            under = np.searchsorted(-least, math.tau * t + SLACK - axis.low, "right")
            return int(min(over, under))

        def choice(t: int, turn: int = turn, lasts: Callable[[int], int] = rows) -> tuple[int, int]:
            """Most rows within the limits, then fewest turns back."""
            return lasts(t), -abs(t - turn)

        ahead = rows(turn)
        if ahead == 0 or (i == 0 and ahead < len(seen)):
            low, high = turn - _TURNS, turn + _TURNS
            if math.isfinite(axis.low):
                low = max(low, math.ceil((axis.low - SLACK - path[i]) / math.tau))
            if math.isfinite(axis.high):
                high = min(high, math.floor((axis.high + SLACK - path[i]) / math.tau))
            turn = max(range(low, high + 1), key=choice, default=turn)
            ahead = max(rows(turn), 1)
        out[i : i + ahead] += math.tau * turn
        i += ahead
    return out


def _reach(found: Solutions, lines: Ints) -> list[Finding]:
    rows = np.flatnonzero(found.miss > REACH)
    if len(rows) == 0:
        return []
    worst = int(rows[np.argmax(found.miss[rows])])
    names = " and ".join(one.letter for one in found.free)
    verb = "reaches" if len(found.free) == 1 else "reach"
    means = f"{names} {verb} no nearer one" if found.free else "there is no rotary axis to reach it"
    text = f"the tool's axis is out of reach by {math.degrees(found.miss[worst]):.6g} deg: {means}"
    return [Finding("machine-reach", int(lines[worst]), text_of_rows(rows, worst, text, lines))]


def _singular(
    found: Solutions, singular: NDArray[np.bool_], axes: Floats, directions: Floats, lines: Ints
) -> list[Finding]:
    """Rows at a pole, and steps in which a free axis swings far while the tool axis hardly turns."""
    out = []
    rows = np.flatnonzero(singular)
    if len(rows):
        letter = found.free[0].letter
        text = f"the tool's axis lies along that of {letter}: {letter} is free and stays as it was"
        out.append(Finding("machine-singular", int(lines[rows[0]]), text_of_rows(rows, int(rows[0]), text, lines)))
    turned = angle_between(directions[1:], directions[:-1])
    for one in found.free:
        swing = np.abs(np.diff(axes[:, one.column]))
        rows = np.flatnonzero((swing > SWING) & (swing > GAIN * turned)) + 1
        if len(rows):
            worst = int(rows[np.argmax(swing[rows - 1])])
            text = (
                f"{one.letter} swings by {math.degrees(swing[worst - 1]):.6g} deg while the tool's axis turns by "
                f"{math.degrees(turned[worst - 1]):.6g} deg: retract before it, or go round the pole"
            )
            out.append(Finding("machine-singular", int(lines[worst]), text_of_rows(rows, worst, text, lines)))
    return out


def _rewinds(free: tuple[Axis, ...], axes: Floats, lines: Ints) -> list[Finding]:
    """Steps that are longer than the shortest rotation by whole turns."""
    out = []
    for one in free:
        change = np.diff(axes[:, one.column])
        turns = np.round((change - wrap_angles(change)) / math.tau).astype(np.int64)
        for row in (np.flatnonzero((turns != 0) & (np.abs(change) > math.pi + SLACK)) + 1).tolist():
            a, b = (position_text(one, float(axes[row - k, one.column])) for k in (1, 0))
            text = f"{one.letter} goes back from {a} to {b}: retract before it"
            text = text_of_rows(np.array([row]), row, text, lines)
            out.append(Finding("machine-rewind", int(lines[row]), text))
    return out
