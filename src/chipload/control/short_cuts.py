"""Windows of a program around cuts that are too short to be compared block by block: the whole cut is one mean.

Where a sample is in its line is known to a lag and to a share of the time in the line. A mean over a window that begins
and ends in the air does not depend on that: it contains the whole cut, wherever in the window it was made.

    air |<- margin ->| cut ... cut |<- margin ->| air

Cuts with less air between them than their margins (trochoids, pecks) are one window; windows of more than LONGEST_S are
divided, and what the place leaves open at such a border counts as in a block.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chipload.control.log_alignment import PredictedTorque

Floats = NDArray[np.float64]

#: a cut below so many blocks besides its margins is short
SHORT_BLOCKS = 4.0
#: speeds that differ by less are one
SAME_SPEED = 1e-3
#: longest window [s]
LONGEST_S = 10.0


@dataclass(frozen=True, eq=False)
class CutWindows:
    """Windows of a program, (k,) each, in time of the program [s].

    Parameters
    ----------
    begin, end : rising, without overlap
    cut : when the first cut of the window begins
    late : how far the place may be wrong where its last cut ends
    divided : whether a border is in a cut
    """

    begin: Floats
    end: Floats
    cut: Floats
    late: Floats
    divided: NDArray[np.bool_]

    def at(self, place: float) -> int:
        """Return the window of a time of the program; -1: none.

        >>> one = CutWindows(*(np.array([x]) for x in (1.0, 2.5, 1.3, 0.2)), np.array([False]))
        >>> [one.at(t) for t in (0.9, 1.0, 2.4, 2.5)]
        [-1, 0, 0, -1]
        """
        k = int(np.searchsorted(self.begin, place, side="right")) - 1
        return k if k >= 0 and place < self.end[k] else -1


def short_cuts(predicted: PredictedTorque, block_s: float, lag_s: float, pace: float) -> CutWindows:
    """Return the windows around the short cuts of a program; O(rows).

    Parameters
    ----------
    block_s : length of a block [s]: no window is shorter
    lag_s : how far the line of a sample may be wrong in time [s]
    pace : rate at which a line may run faster or slower than calculated
    """
    start = np.concatenate([[0.0], predicted.time[:-1]])
    load = predicted.cutting + predicted.edge > 0.0
    first = np.flatnonzero(load & ~np.concatenate([[False], load[:-1]]))
    last = np.flatnonzero(load & ~np.concatenate([load[1:], [False]]))
    changes = np.concatenate([[True], np.diff(predicted.line) != 0])
    line_start = start[np.maximum.accumulate(np.where(changes, np.arange(len(start)), 0))]
    began, ended = start[first], predicted.time[last]
    before = lag_s + pace * (began - line_start[first])
    after = lag_s + pace * (ended - line_start[last])
    short = 0.5 * np.maximum(block_s - (ended - began + before + after), 0.0)
    low, high = began - before - short, ended + after + short
    joined = np.concatenate([[False], low[1:] < np.maximum.accumulate(high)[:-1]])[: len(first)]
    windows: list[tuple[float, float, float, float, bool]] = []
    # cuts whose margins overlap
    for own in np.split(np.arange(len(first)), np.flatnonzero(~joined)[1:]):
        if not len(own) or float((ended - began)[own].max()) >= SHORT_BLOCKS * block_s + 2.0 * lag_s:
            continue
        begin, end = max(float(low[own[0]]), 0.0), float(high[own].max())
        rows = slice(*np.searchsorted(predicted.time, [begin, end]) + np.array([0, 1]))
        speed = predicted.speed[rows]
        if np.ptp(speed) > SAME_SPEED * speed.max() or np.ptp(predicted.tool[rows]) > 0:
            continue
        parts = math.ceil((end - begin) / LONGEST_S)
        borders = np.linspace(begin, end, parts + 1)
        windows += [
            (float(a), float(b), float(began[own[0]]) if k == 0 else float(a), float(after[own].max()), parts > 1)
            for k, (a, b) in enumerate(pairwise(borders))
        ]
    columns = np.array(windows, dtype=np.float64).reshape(-1, 5)
    return CutWindows(columns[:, 0], columns[:, 1], columns[:, 2], columns[:, 3], columns[:, 4] > 0.0)
