"""Compiled: states of the pallet angle at the points of a line, the cheapest row of them, and its smoothing.

Notation: as in ``pallet.py``. The ranges (k, 2) [rad] of all points follow one another: those of the point i are
``starts[i]`` to ``starts[i + 1]``; so do the states.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

#: of a step, by how much a range may be wider than whole steps without one more state
ROUNDED = 1e-9


@njit(cache=True, nogil=True)
def near(angle: float) -> float:
    """Angle less whole turns, from -pi to pi."""
    return angle - math.tau * np.rint(angle / math.tau)  # type: ignore[no-any-return]


@njit(cache=True, nogil=True)
def states_of(
    ranges: Any, starts: Any, preferred: Any, wanted: float, step: float, fewest: int, most: int, draw: float,
    angle: Any, cost: Any, of: Any, first: Any,
) -> int:  # fmt: skip
    """Write the states' pallet angle B, cost, and number of their range at the point; ``first`` (n + 1,) of each point.

    The number of states; ``angle``, ``cost`` and ``of`` hold at least ``most`` for each range.
    """
    filled = 0
    for i in range(len(starts) - 1):
        first[i] = filled
        for k in range(starts[i], starts[i + 1]):
            low, high = ranges[k, 0], ranges[k, 1]
            # a window of whole steps has so many states, however its ends are rounded
            count = min(max(math.ceil((high - low) / step - ROUNDED), fewest), most)
            for j in range(count):
                B = low + (high - low) * (j + 0.5) / count
                short = max(1.0 - min(B - low, high - B) / wanted, 0.0) if wanted > 0.0 else 0.0
                angle[filled], of[filled] = B, k - starts[i]
                cost[filled] = short * short
                if math.isfinite(preferred[i]):
                    cost[filled] += draw * abs(near(B - preferred[i]))
                filled += 1
    first[len(starts) - 1] = filled
    return filled


@njit(cache=True, nogil=True)
def cheapest_row(
    ranges: Any, starts: Any, angle: Any, cost: Any, of: Any, first: Any, length: Any, most: Any, turn: float,
    begin: int, out: Any,
) -> int:  # fmt: skip
    """Write the states from the point ``begin`` on, as far as they go, to ``out`` (n,); the point after the last.

    ``turn`` is 1000 times the cost of a turn of one radian in one millimetre.
    """
    came = np.zeros(len(angle), dtype=np.int64)
    total = cost.copy()
    i = begin
    while i + 2 < len(starts) and first[i + 2] > first[i + 1]:
        size = max(length[i], 1e-3)
        goes = False
        for b in range(first[i + 1], first[i + 2]):
            best, at = math.inf, first[i]
            low, high = ranges[starts[i + 1] + of[b], 0], ranges[starts[i + 1] + of[b], 1]
            for a in range(first[i], first[i + 1]):
                step = abs(near(angle[b] - angle[a]))
                if step > most[i]:
                    continue
                low0, high0 = ranges[starts[i] + of[a], 0], ranges[starts[i] + of[a], 1]
                shift = math.tau * np.rint(((low0 + high0) / 2.0 - (low + high) / 2.0) / math.tau)
                if min(high0, high + shift) <= max(low0, low + shift):
                    continue
                value = total[a] + turn * (step * step) / size / 1e3
                if value < best:
                    best, at = value, a
            came[b], total[b] = at, best + cost[b] * size
            goes = goes or best < math.inf
        if not goes:
            break
        i += 1
    at = first[i]
    for b in range(first[i], first[i + 1]):
        if total[b] < total[at]:
            at = b
    for k in range(i, begin - 1, -1):
        out[k] = at
        at = came[at]
    return i + 1


@njit(cache=True, nogil=True)
def smooth_angles(angle: Any, low: Any, high: Any, share: Any, limit: Any, rounds: int) -> None:
    """Draw the angles (n,) towards the mean of their neighbours, within ``low`` to ``high``, ``rounds`` times.

    ``share`` (n - 2,) of the neighbour behind; before a step would be above ``limit`` (n - 1,) it ends.
    """
    n = len(angle)
    new = np.empty(n)
    for _ in range(rounds):
        for i in range(n):
            value = angle[i]
            if 0 < i < n - 1:
                w = share[i - 1]
                value = 0.5 * angle[i] + 0.5 * (angle[i - 1] * (1.0 - w) + angle[i + 1] * w)
            new[i] = min(max(value, low[i]), high[i])
        for i in range(n - 1):
            if abs(new[i + 1] - new[i]) > limit[i]:
                return
        angle[:] = new
