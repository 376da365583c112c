"""Modes of a workpiece, followed through its removal: frequencies and shapes in the state of each step.

A wall that is thinned from its free edge down has a higher natural frequency at first, because mass is removed where it
moves most, and a lower one in the end. Modes are solved in some states of removal and interpolated between them by the
volume removed, frequencies by their logarithm. Modes of neighbouring states belong together by |x_a^T M_b x_b|, never
by their number, since they may cross. The interval in which a frequency changes most is halved until none changes by
more than the tolerance or there are enough states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from chipload.lazy import scipy
from chipload.progress import Progress, silent
from chipload.structure.cells.grid import Array, Indices
from chipload.structure.cells.states import RemovalState, StepLines, between_rows, spaced_rows
from chipload.structure.cells.vibration import VibrationModes, overlap, shapes_along, vibration_modes
from chipload.structure.cells.workpiece import CellWorkpiece

#: number of contact lines at which shapes are evaluated, in each state
PLACES = 600


@dataclass(frozen=True, eq=False)
class FollowedModes:
    """Modes of a workpiece in the state of each step.

    Attributes
    ----------
    step : (c,) int, rising, steps that cut
    frequency : (c, m) float [Hz]; a mode keeps its column
    shapes : (c, 3, m) float [1/sqrt(t)], mean along the contact line
    first : (c, 3, m) float, the same of the state before the first step
    states : (s,) int, steps before which modes were solved
    removed : (s,) float [mm^3] removed in these
    state_frequency : (s, m) float [Hz]
    error : relative, of the frequencies: by the cells, and by interpolation between states
    alike : least |x_a^T M_b x_b| of modes that were matched
    """

    step: Indices
    frequency: Array
    shapes: Array
    first: Array
    states: Indices
    removed: Array
    state_frequency: Array
    error: float
    alike: float

    def at(self, steps: Indices) -> tuple[Array, Array]:
        """Frequencies (n, m) [Hz] and shapes (n, 3, m) of steps; a step that is not known has those of the one before
        it.
        """
        rows = self._rows(steps)
        return self.frequency[rows], self.shapes[rows]

    def at_first(self, steps: Indices) -> tuple[Array, Array]:
        """As :meth:`at`, with the modes of the workpiece before its first cut."""
        rows = self._rows(steps)
        return np.tile(self.state_frequency[0], (len(rows), 1)), self.first[rows]

    def _rows(self, steps: Indices) -> Indices:
        return np.maximum(np.searchsorted(self.step, steps, side="right") - 1, 0)


class ModesOfStates:
    """Modes of states as they are built; given to :func:`chipload.structure.cells.states.step_compliances`.

    Parameters
    ----------
    steps : where the program cuts
    count : modes of each state
    spacing : least distance [mm] of contact lines at which shapes are evaluated
    """

    def __init__(self, steps: StepLines, count: int, spacing: float) -> None:
        self.steps, self.count = steps, count
        self.rows = spaced_rows(steps.lines, spacing, PLACES)
        self.known: dict[int, tuple[VibrationModes, Array]] = {}

    def __call__(self, state: int, work: CellWorkpiece) -> None:
        """Solve the modes of a state, once."""
        if state not in self.known:
            found = vibration_modes(work, self.count)
            self.known[state] = found, shapes_along(work, found, self.steps.lines[self.rows])

    def followed(
        self,
        states: Sequence[RemovalState],
        *,
        tolerance: float,
        most: int,
        error: float = 0.0,
        progress: Progress = silent,
    ) -> FollowedModes:
        """Modes in the state of every step.

        Parameters
        ----------
        states : as of :func:`chipload.structure.cells.states.step_compliances`
        tolerance : relative change of a frequency between two states
        most : states whose modes are solved at most
        error : relative, of the frequencies of a state
        """
        for k in (0, len(states) - 1):
            if k not in self.known:
                self(k, states[k].build())
        while len(self.known) < most:
            progress(len(self.known) / most, "modes of the workpiece")
            order = sorted(self.known)
            wide = [(self._change(a, b), a, b) for a, b in pairwise(order)]
            middle = None
            for change, a, b in sorted(wide, reverse=True):
                if change <= tolerance:
                    break
                volume = 0.5 * (states[a].removed + states[b].removed)
                middle = min(range(a + 1, b), key=lambda k: abs(states[k].removed - volume), default=None)
                if middle is not None:
                    break
            if middle is None:
                break
            self(middle, states[middle].build())
        return self._join_states(states, error)

    def _change(self, a: int, b: int) -> float:
        """Greatest relative change of a frequency from state a to b."""
        first, last = self.known[a][0], self.known[b][0]
        _, column = scipy.optimize.linear_sum_assignment(-np.abs(overlap(first, last)))
        return float(np.abs(np.log(last.frequency[column] / first.frequency)).max())

    def _join_states(self, states: Sequence[RemovalState], error: float) -> FollowedModes:
        """Modes of all states with the same column for the same mode, and between them."""
        order, steps = sorted(self.known), self.steps
        frequency, shapes = [self.known[order[0]][0].frequency], [self.known[order[0]][1]]
        column, sign, alike = np.arange(self.count), np.ones(self.count), 1.0
        for a, b in pairwise(order):
            # modes of a in their columns; those of b follow
            near = overlap(self.known[a][0], self.known[b][0])[column] * sign[:, None]
            _, column = scipy.optimize.linear_sum_assignment(-np.abs(near))
            own = near[np.arange(self.count), column]
            sign = np.where(own < 0.0, -1.0, 1.0)
            alike = min(alike, float(np.abs(own).min()))
            frequency.append(self.known[b][0].frequency[column])
            shapes.append(self.known[b][1][..., column] * sign)
        removed = np.array([states[k].removed for k in order])
        every = np.arange(len(steps.step))
        n = len(every)
        out_f, out_s = np.zeros((n, self.count)), np.zeros((n, 3, self.count))
        first = np.zeros((n, 3, self.count))
        if n:
            first = between_rows(steps.lines, every, self.rows, shapes[0])
            below = np.clip(np.searchsorted(removed, steps.removed, side="right") - 1, 0, len(order) - 2)
            for k in np.unique(below).tolist():
                own = np.flatnonzero(below == k)
                span = removed[k + 1] - removed[k]
                t = np.clip((steps.removed[own] - removed[k]) / span, 0.0, 1.0) if span > 0.0 else np.zeros(len(own))
                out_f[own] = frequency[k] ** (1.0 - t[:, None]) * frequency[k + 1] ** t[:, None]
                ends = [between_rows(steps.lines, own, self.rows, shapes[j]) for j in (k, k + 1)]
                w = t[:, None, None]
                out_s[own] = (1.0 - w) * ends[0] + w * ends[1]
        return FollowedModes(
            steps.step, out_f, out_s, first, np.array([states[k].step for k in order]), removed, np.array(frequency),
            error + _bend(removed, np.log(frequency)), alike,
        )  # fmt: skip


def _bend(x: Array, y: Array) -> float:
    """Greatest error of linear interpolation of y (s, m) over x (s,), from its second differences: h^2 |y''| / 8."""
    h = np.diff(x)
    some = h > 0.0
    h, slope = h[some], np.diff(y, axis=0)[some] / h[some, None]
    if len(h) < 2:
        return 0.0
    bend = np.abs(np.diff(slope, axis=0)) / (0.5 * (h[1:] + h[:-1]))[:, None]
    around = np.maximum(np.vstack([bend[:1], bend]), np.vstack([bend, bend[-1:]]))
    return float((h[:, None] ** 2 * around).max() / 8.0)
