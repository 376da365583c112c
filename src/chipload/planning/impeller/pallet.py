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

from chipload.lazy import LateModule
from chipload.planning.impeller.scene import Floats, Ints

_pallet = LateModule("chipload.planning.impeller._pallet")

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
    counts = np.array([len(r) for r in joined], dtype=np.int64)
    line = _LineStates.of_ranges(
        np.concatenate([*joined, np.zeros((0, 2))]), np.concatenate([[0], np.cumsum(counts)]), wanted,
        np.full(len(ranges), np.nan) if preferred is None else np.array(preferred, dtype=np.float64),
    )  # fmt: skip
    if widths is not None:
        line.add_paths(widths)
    out: list[Turned] = []
    chosen = np.zeros(len(ranges), dtype=np.int64)
    i = 0
    while i < len(ranges):
        if not counts[i]:
            i += 1
            continue
        last = line.row(length, most, i, chosen)
        out.append(Turned(i, last, line.smooth(chosen[i:last], length, most, i, wanted)))
        i = last
    return tuple(out)


def _join_ends(ranges: Floats) -> Floats:
    """The ranges, the last joined to the first over 2 pi."""
    r = np.asarray(ranges, dtype=np.float64).reshape(-1, 2)
    over = len(r) > 1 and r[0, 0] <= 1e-9 and r[-1, 1] >= math.tau - 1e-9
    return np.vstack([r[1:-1], [[r[-1, 0], r[0, 1] + math.tau]]]) if over else r


@dataclass(frozen=True, eq=False)
class _LineStates:
    """States of a line, point after point: B, cost, number of the range at its point; first state of each point.

    ``ranges`` (k, 2) of all points, ``starts`` (n + 1,) the first of each.
    """

    ranges: Floats
    starts: Ints
    angle: Floats
    cost: Floats
    of: Ints
    first: Ints

    @staticmethod
    def of_ranges(ranges: Floats, starts: Ints, wanted: float, preferred: Floats) -> _LineStates:
        """The states of ranges; ``preferred`` (n,) [rad], nan: none."""
        room = len(ranges) * _MOST
        angle, cost, of = np.empty(room), np.empty(room), np.empty(room, dtype=np.int64)
        first = np.zeros(len(starts), dtype=np.int64)
        count = _pallet.states_of(
            ranges, starts, preferred, wanted, _STEP, _FEWEST, _MOST, _DRAW, angle, cost, of, first
        )
        return _LineStates(ranges, starts, angle[:count], cost[:count], of[:count], first)

    def add_paths(self, widths: Callable[[Ints, Floats], Floats]) -> None:
        """Add to the cost of the states how much longer the path is than with the widest step-over of the point."""
        if not len(self.angle):
            return
        count = np.diff(self.first)
        w = widths(np.repeat(np.arange(len(count)), count), self.angle)
        some = count > 0
        most = np.repeat(np.maximum.reduceat(w, self.first[:-1][some]), count[some])
        wide = most > 0.0
        self.cost[wide] += _WIDE * (most[wide] / np.maximum(w[wide], _LEAST * most[wide]) - 1.0)

    def row(self, length: Floats, most: Floats, begin: int, chosen: Ints) -> int:
        """Write the states from a point on, as far as they go, to ``chosen`` (n,); the point after the last."""
        return int(
            _pallet.cheapest_row(
                self.ranges, self.starts, self.angle, self.cost, self.of, self.first, length, most, _TURN, begin, chosen
            )
        )

    def smooth(self, chosen: Ints, length: Floats, most: Floats, first: int, wanted: float) -> Floats:
        """B without jumps of whole turns, drawn towards the mean of the neighbours, within the ranges and the steps."""
        B = self.angle[chosen]
        out: Floats = B[0] + np.concatenate([[0.0], np.cumsum(_near(np.diff(B)))])
        if len(out) < 3:
            return out
        own = self.ranges[self.starts[first : first + len(out)] + self.of[chosen]] + (out - B)[:, None]
        width = own[:, 1] - own[:, 0]
        inset = np.minimum(np.maximum(_INSET * width, np.minimum(0.5 * wanted, 0.25 * width)), 0.5 * width)
        # a state of the search is never nearer to an end than this
        low, high = np.minimum(own[:, 0] + inset, out), np.maximum(own[:, 1] - inset, out)
        a, b = length[first : first + len(out) - 2], length[first + 1 : first + len(out) - 1]
        share = (a / np.where(a + b > 0.0, a + b, 1.0)).clip(0.0, 1.0)
        _pallet.smooth_angles(out, low, high, share, most[first : first + len(out) - 1], _ROUNDS)
        return out


def _near(angle: Floats) -> Floats:
    """Angles less whole turns, from -pi to pi."""
    out: Floats = angle - math.tau * np.round(angle / math.tau)
    return out
