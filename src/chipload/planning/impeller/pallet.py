"""Continuous pallet angle along a line, within the valid ranges.

Notation: B [rad] pallet angle, ranges (k, 2) of B at each point of a line, exact (``ranges/``); l [mm] length along the
line. A range is divided into states. A step from state to state is possible where the two ranges overlap, so that every
angle between is valid at one of the two ends, and where the pallet can turn that far in the time of the step. The
states with the least cost are found by dynamic programming, O(n K^2), and then smoothed within their ranges.

The cost of a point has three terms: (1 - depth / wanted)^2 of a state nearer than ``wanted`` to an end of its range, a
share of the angle from the preferred state, and how much longer the path is than with the widest step-over at that
point. The cost of a step is the square of the turn over the length of the step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from chipload.planning.impeller.scene import Floats, Ints

#: widest distance of states of one range, and most of them
_STEP, _MOST, _FEWEST = math.radians(2.0), 60, 5
#: how strongly a preferred angle draws, and a turn of one radian in one millimetre
_DRAW, _TURN = 0.3, 4000.0
#: how strongly a wide step-over draws; a step-over of less than this share of the widest counts as this
_WIDE, _LEAST = 2.0, 0.05
_ROUNDS = 60
_INSET = 0.02  # of its width: a range is not used nearer to its ends


@dataclass(frozen=True, eq=False)
class Turned:
    """Points ``first`` .. ``last`` - 1 of a line without interruption, with their pallet angles B [rad], without jumps
    of 2 pi.
    """

    first: int
    last: int
    pallet: Floats


def pallet_angles(
    ranges: tuple[Floats, ...],
    length: Floats,
    most: Floats,
    wanted: float = math.radians(4.0),
    preferred: Floats | None = None,
    widths: Callable[[Ints, Floats], Floats] | None = None,
) -> tuple[Turned, ...]:
    """Parts of a line with a continuous pallet angle in each.

    Parameters
    ----------
    ranges : of each of the n points; k = 0: not to be reached, the line is split there
    length : (n - 1,) float [mm] between the points
    most : (n - 1,) float [rad], furthest that the pallet goes in each step
    wanted : [rad] to be away from the ends of a range, where it is wide enough
    preferred : (n,) float [rad], B near which to stay, as on the line before; nan: none
    widths : step-overs (k,) [mm] of points (k,) at pallet angles (k,); None: all are alike

    Examples
    --------
    Two points with one range, a third that has none in common with it: two pieces.

    >>> two = (np.array([[0.0, 1.0]]), np.array([[0.5, 1.5]]), np.array([[3.0, 4.0]]))
    >>> [(t.first, t.last) for t in pallet_angles(two, np.ones(2), np.ones(2))]
    [(0, 2), (2, 3)]
    """
    joined = [_join_ends(r) for r in ranges]
    draw = np.full(len(ranges), np.nan) if preferred is None else preferred
    states = [_states(r, wanted, p) for r, p in zip(joined, draw, strict=True)]
    if widths is not None:
        _add_paths(states, widths)
    out: list[Turned] = []
    i = 0
    while i < len(ranges):
        if not len(joined[i]):
            i += 1
            continue
        piece, last = _best(joined, states, length, most, i)
        out.append(Turned(i, last, _smooth(joined, piece, length, most, i, wanted)))
        i = last
    return tuple(out)


def _join_ends(ranges: Floats) -> Floats:
    """The ranges, the last joined to the first over 2 pi."""
    r = np.asarray(ranges, dtype=np.float64).reshape(-1, 2)
    over = len(r) > 1 and r[0, 0] <= 1e-9 and r[-1, 1] >= math.tau - 1e-9
    return np.vstack([r[1:-1], [[r[-1, 0], r[0, 1] + math.tau]]]) if over else r


def _states(ranges: Floats, wanted: float, preferred: float) -> Floats:
    """Rows (K, 3): B, its cost, which range."""
    rows = []
    for k, (low, high) in enumerate(ranges):
        count = int(np.clip(math.ceil((high - low) / _STEP), _FEWEST, _MOST))
        B = low + (high - low) * (np.arange(count) + 0.5) / count
        depth = np.minimum(B - low, high - B) / wanted
        cost = np.clip(1.0 - depth, 0.0, None) ** 2
        if math.isfinite(preferred):
            cost = cost + _DRAW * np.abs(_near(B - preferred))
        rows.append(np.column_stack([B, cost, np.full(count, k)]))
    return np.vstack(rows) if rows else np.zeros((0, 3))


def _add_paths(states: list[Floats], widths: Callable[[Ints, Floats], Floats]) -> None:
    """Adds to the cost of the states how much longer the path is than with the widest step-over of the point."""
    point = np.repeat(np.arange(len(states)), [len(s) for s in states])
    if not len(point):
        return
    w = widths(point, np.concatenate([s[:, 0] for s in states]))
    first = 0
    for s in states:
        own = w[first : first + len(s)]
        first += len(s)
        most = float(own.max(initial=0.0))
        if most > 0.0:
            s[:, 1] += _WIDE * (most / np.maximum(own, _LEAST * most) - 1.0)


def _near(angle: Floats) -> Floats:
    """Angles less whole turns, from -pi to pi."""
    out: Floats = angle - math.tau * np.round(angle / math.tau)
    return out


def _overlap(a: Floats, b: Floats) -> Floats:
    """(k, m) whether the ranges of two neighbours overlap."""
    shift = math.tau * np.round((a.mean(axis=1)[:, None] - b.mean(axis=1)[None]) / math.tau)
    low = np.maximum(a[:, None, 0], b[None, :, 0] + shift)
    high = np.minimum(a[:, None, 1], b[None, :, 1] + shift)
    out: Floats = high > low
    return out


def _best(
    ranges: list[Floats], states: list[Floats], length: Floats, most: Floats, first: int
) -> tuple[tuple[Floats, Ints], int]:
    """States from ``first`` on as far as they go: their B and ranges, and the point after the last."""
    cost = states[first][:, 1]
    came: list[Ints] = []
    i = first
    while i + 1 < len(states) and len(states[i + 1]):
        a, b = states[i], states[i + 1]
        step = np.abs(_near(b[None, :, 0] - a[:, None, 0]))
        goes = _overlap(ranges[i], ranges[i + 1])[a[:, 2].astype(int)][:, b[:, 2].astype(int)]
        goes = goes & (step <= most[i])
        total = np.where(goes, cost[:, None] + _TURN * step**2 / max(length[i], 1e-3) / 1e3, np.inf)
        if not np.isfinite(total).any():
            break
        came.append(total.argmin(axis=0))
        cost = total.min(axis=0) + b[:, 1] * max(length[i], 1e-3)
        i += 1
    at = int(cost.argmin())
    chosen = [at]
    for back in reversed(came):
        at = int(back[at])
        chosen.append(at)
    index = np.array(chosen[::-1])
    rows = np.array([states[first + k][j] for k, j in enumerate(index)])
    return (rows[:, 0], rows[:, 2].astype(np.int64)), i + 1


def _smooth(
    ranges: list[Floats], piece: tuple[Floats, Ints], length: Floats, most: Floats, first: int, wanted: float
) -> Floats:
    """B without jumps of whole turns, drawn towards the mean of the neighbours, within the ranges and the steps."""
    B, which = piece
    out: Floats = B[0] + np.concatenate([[0.0], np.cumsum(_near(np.diff(B)))])
    own = np.array([ranges[first + k][j] for k, j in enumerate(which)])
    own = own + (out - B)[:, None]
    width = own[:, 1] - own[:, 0]
    inset = np.minimum(np.maximum(_INSET * width, np.minimum(0.5 * wanted, 0.25 * width)), 0.5 * width)
    # a state of the search is never nearer to an end than this
    low, high = np.minimum(own[:, 0] + inset, out), np.maximum(own[:, 1] - inset, out)
    if len(out) < 3:
        return out
    a, b = length[first : first + len(out) - 2], length[first + 1 : first + len(out) - 1]
    share = (a / np.where(a + b > 0.0, a + b, 1.0)).clip(0.0, 1.0)
    limit = most[first : first + len(out) - 1]
    for _ in range(_ROUNDS):
        new = out.copy()
        new[1:-1] = 0.5 * out[1:-1] + 0.5 * (out[:-2] * (1.0 - share) + out[2:] * share)
        new = np.clip(new, low, high)
        if (np.abs(np.diff(new)) > limit).any():
            break
        out = new
    return out
