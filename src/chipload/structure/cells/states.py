"""Compliance of a workpiece where it is cut, in the state of removal in which each step cuts it.

Notation: a state is the stock before a step. Compliance at a place only grows while material is removed, so between
two states it lies between those of both. It is solved in a few states and interpolated between them by the volume
removed, its size by its logarithm. Where a later pass cuts the surface that a step left, its contact line lies in what
is thinner by that pass, and the later state says little of the step's own: so there are states, as few as possible,
that for each step lie between it and the next pass over its place. Then an interval whose two states differ most in
deflection, force times compliance, is halved by volume, until none differs by more than the tolerance times the
greatest deflection or there are enough states.

Some contact lines are solved, at most :data:`LINES`, no nearer to one another than they must be; a step between two of
them takes the mean by distance. Then the step whose deflection may be greatest, by the greater of both states, is
solved in the states just before and after it, until the worst step is one that was solved so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from chipload.progress import Progress, silent
from chipload.structure.cells.grid import Array, Indices
from chipload.structure.cells.workpiece import STATIONS, CellWorkpiece, line_compliances

#: number of contact lines that are solved in addition to those of the worst steps
LINES = 160
#: worst steps that are solved in the states just before and after them: so many pairs of states, and steps with at
#: least this share of the greatest deflection
TIGHT, NEAR = 6, 0.7
#: states that are solved first: before all, at thirds of the volume, after all
FIRST = 4
#: number of worst steps that are reported
WORST = 12


@dataclass(frozen=True, eq=False)
class StepLines:
    """Contact lines and forces of the steps of a program.

    Parameters
    ----------
    step : (c,) int, rising, the steps that cut
    lines : (c, 2, 3) float [mm], lower and upper end of their contact
    force : (c,) float [N], greatest of each
    removed : (c,) float [mm^3] removed before each
    """

    step: Indices
    lines: Array
    force: Array
    removed: Array


@dataclass(frozen=True, eq=False)
class RemovalState:
    """A state of removal that can be built.

    Parameters
    ----------
    step : the first step that is not yet cut
    removed : [mm^3]
    build : makes its workpiece
    """

    step: int
    removed: float
    build: Callable[[], CellWorkpiece]


@dataclass(frozen=True, eq=False)
class StepCompliances:
    """Compliance of the workpiece in the state of each step.

    Attributes
    ----------
    step : (c,) int, rising
    lines : (c, 2, 3) float [mm]
    compliance : (c, s, 3, 3) float [mm/N] at the stations of the line
    uncertainty : (c,) float, greatest relative difference of the compliance of each from that of its own state
    worst : (w,) int, rows that were solved themselves, the greatest deflection first
    after : (w,) int, number of the state that was solved after each of them
    after_compliance : (w, s, 3, 3) float [mm/N] in that state
    states : steps before which a state was solved
    loose : [mm^3] greatest volume without a connection to a clamp
    wanted : number of states of which one lies before each pass over a place; if more than are allowed, none was chosen
        for that
    """

    step: Indices
    lines: Array
    compliance: Array
    uncertainty: Array
    worst: Indices
    after: Indices
    after_compliance: Array
    states: tuple[int, ...]
    loose: float
    wanted: int = 0

    def at(self, steps: Indices) -> Array:
        """Compliance of steps (n, s, 3, 3); a step that is not known takes that of the last known one before it."""
        return np.asarray(self.compliance[self._rows(steps)])

    def at_points(self, steps: Indices, points: Array) -> Array:
        """Compliance of steps at points (n, 3) [mm] near their contact, (n, 3, 3): by a parabola along its line."""
        rows = self._rows(steps)
        low, along = self.lines[rows, 0], self.lines[rows, 1] - self.lines[rows, 0]
        length = np.einsum("ni,ni->n", along, along)
        share = np.einsum("ni,ni->n", points - low, along)
        t = np.clip(np.divide(share, length, out=np.full(len(rows), 0.5), where=length > 0.0), 0.0, 1.0)
        weight = np.stack([(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)], axis=1)
        return np.asarray(np.einsum("ns,nsij->nij", weight, self.compliance[rows]))

    def _rows(self, steps: Indices) -> Indices:
        return np.maximum(np.searchsorted(self.step, steps, side="right") - 1, 0)


def size_of(compliance: Array) -> Array:
    """(...,) greatest displacement per force over the stations of (..., s, 3, 3)."""
    return np.asarray(np.linalg.norm(compliance, ord=2, axis=(-2, -1)).max(axis=-1))


def step_compliances(
    steps: StepLines,
    states: Sequence[RemovalState],
    *,
    tolerance: float,
    most: int,
    spacing: float,
    built: Callable[[int, CellWorkpiece], None] | None = None,
    progress: Progress = silent,
) -> StepCompliances:
    """Compliance in the state of every step that cuts.

    Parameters
    ----------
    states : that can be chosen, by rising step; the first before all, the last after all steps
    tolerance : difference between neighbouring states over the greatest deflection
    most : states at most
    spacing : least distance [mm] of contact lines that are solved
    built : called with each state that is solved, by its number, each time that it is built
    """
    solver = _Solver(steps, states, spaced_rows(steps.lines, spacing, LINES), built)
    wanted = sorted({*_first_states(states), *states_between_passes(steps, solver.samples, states, 4.0 * spacing)})
    chosen, spans = _choose_states(solver, wanted, tolerance, most, progress)
    out, doubt = np.zeros((len(steps.step), len(STATIONS), 3, 3)), np.zeros(len(steps.step))
    for a, b in spans:
        own, rows = solver.rows(a, b), solver.sampled(a, b)
        if not len(own):
            continue
        if not len(rows):
            rows = own[:1]
        ends = [between_rows(steps.lines, own, rows, solver.compliance(k, rows)) for k in (a, b)]
        out[own], doubt[own] = _in_state(steps.removed[own], states[a].removed, states[b].removed, *ends)
    first = [state.step for state in states]
    tight = np.full(len(out), -1, dtype=np.int64)
    later = np.zeros_like(out)
    for turn in range(TIGHT):
        progress(1.0, "worst steps of the workpiece")
        upper = size_of(out) * (1.0 + doubt) * steps.force
        if not len(upper) or tight[int(upper.argmax())] >= 0:
            break
        row = int(upper.argmax())
        b = min(int(np.searchsorted(first, steps.step[row], side="right")), len(states) - 1)
        a = max(b - 1, 0)
        rows = solver.rows(a, b)
        rows = rows[upper[rows] >= NEAR * upper[row]]
        ends = [solver.compliance(k, rows) for k in ((a, b) if turn % 2 == 0 else (b, a))]
        low, high = ends if turn % 2 == 0 else ends[::-1]
        later[rows], tight[rows] = high, b
        out[rows], doubt[rows] = _in_state(steps.removed[rows], states[a].removed, states[b].removed, low, high)
        chosen = sorted({*chosen, a, b})
    worst = np.flatnonzero(tight >= 0)
    worst = worst[np.argsort(-size_of(out[worst]) * steps.force[worst], kind="stable")][:WORST]
    return StepCompliances(
        steps.step, steps.lines, out, doubt, worst, tight[worst], later[worst],
        tuple(states[k].step for k in chosen), solver.loose, len(wanted),
    )  # fmt: skip


class _Solver:
    """Compliances of contact lines in states; ``samples`` are the rows of the steps that are solved.

    Every compliance is kept, the factors only of the state that was used last. ``built`` is called with each state that
    is solved, by its number.
    """

    def __init__(
        self,
        steps: StepLines,
        states: Sequence[RemovalState],
        samples: Indices,
        built: Callable[[int, CellWorkpiece], None] | None = None,
    ) -> None:
        self.steps, self.states, self.samples, self.built = steps, states, samples, built
        self.loose = 0.0
        self._solved: dict[int, CellWorkpiece] = {}
        self._known: dict[tuple[int, int], Array] = {}

    def compliance(self, k: int, rows: Indices) -> Array:
        """(r, s, 3, 3) of contact lines in state k."""
        missing = [r for r in rows.tolist() if (k, r) not in self._known]
        if missing:
            if k not in self._solved:
                self._solved.clear()
                self._solved[k] = self.states[k].build()
                self.loose = max(self.loose, self._solved[k].loose)
                if self.built is not None:
                    self.built(k, self._solved[k])
            work = self._solved[k]
            for r, c in zip(missing, line_compliances(work, self.steps.lines[missing]), strict=True):
                self._known[k, r] = c
        return np.array([self._known[k, r] for r in rows.tolist()]).reshape(-1, len(STATIONS), 3, 3)

    def rows(self, a: int, b: int) -> Indices:
        """Rows of the steps from state a to state b."""
        return np.arange(*np.searchsorted(self.steps.step, [self.states[a].step, self.states[b].step]))

    def sampled(self, a: int, b: int) -> Indices:
        """Those of them that are solved."""
        ends = np.searchsorted(self.steps.step[self.samples], [self.states[a].step, self.states[b].step])
        return self.samples[slice(*ends)]

    def deflection(self, k: int, rows: Indices) -> Array:
        """(r,) [mm] under the forces of the steps, in state k."""
        return np.asarray(size_of(self.compliance(k, rows)) * self.steps.force[rows])

    def difference(self, a: int, b: int) -> float:
        """Greatest difference of deflection between both ends of an interval [mm]."""
        rows = self.sampled(a, b)
        later, earlier = self.deflection(b, rows), self.deflection(a, rows)
        return float(np.abs(later - earlier).max(initial=0.0))


def _choose_states(
    solver: _Solver, wanted: list[int], tolerance: float, most: int, progress: Progress
) -> tuple[list[int], list[tuple[int, int]]]:
    """States that differ by at most ``tolerance`` of the greatest deflection or are ``most``, and their intervals."""
    states = solver.states
    chosen = wanted if len(wanted) <= most else _first_states(states)
    for n, k in enumerate(chosen):
        progress(n / most, "states of the workpiece")
        # the steps on both sides at once, so that no state is built twice
        solver.compliance(k, solver.sampled(chosen[max(n - 1, 0)], chosen[min(n + 1, len(chosen) - 1)]))
    spans = {(a, b): solver.difference(a, b) for a, b in pairwise(chosen)}
    while len(chosen) < most:
        progress(len(chosen) / most, "states of the workpiece")
        top = max(solver.deflection(b, solver.sampled(a, b)).max(initial=0.0) for a, b in spans)
        wide = [(change, a, b) for (a, b), change in spans.items() if change > tolerance * top]
        middle = None
        for _, a, b in sorted(wide, reverse=True):
            volume = 0.5 * (states[a].removed + states[b].removed)
            between = [k for k in range(a + 1, b) if len(solver.sampled(a, k)) and len(solver.sampled(k, b))]
            middle = min(between, key=lambda k: abs(states[k].removed - volume), default=None)
            if middle is not None:
                break
        if middle is None:
            break
        del spans[a, b]
        solver.compliance(middle, solver.sampled(a, b))
        spans[a, middle], spans[middle, b] = solver.difference(a, middle), solver.difference(middle, b)
        chosen = sorted([*chosen, middle])
    return chosen, sorted(spans)


def _first_states(states: Sequence[RemovalState]) -> list[int]:
    """The first, the last, and two between at thirds of the volume."""
    whole = states[-1].removed
    removed = np.array([state.removed for state in states])
    between = [int(np.abs(removed - share * whole).argmin()) for share in (1.0 / 3.0, 2.0 / 3.0)]
    return sorted({0, *between, len(states) - 1})


def states_between_passes(steps: StepLines, rows: Indices, states: Sequence[RemovalState], near: float) -> list[int]:
    """Numbers of the fewest states of which one lies after each step and before the next pass over its place; O(r c).

    A pass is over a place where it comes near in the plan and the heights of both contact lines overlap.

    Parameters
    ----------
    rows : (r,) int, the steps that are looked at
    near : a pass over the place of a step comes so near to its contact line [mm] after it was twice as far away
    """
    middle, ends = steps.lines.mean(axis=1), steps.lines[..., 2]
    first = np.array([state.step for state in states])
    spans = []
    for row in rows.tolist():
        away = np.linalg.norm(middle[row + 1 :, :2] - middle[row, :2], axis=1)
        left = int(np.argmax(away > 2.0 * near)) if (away > 2.0 * near).any() else len(away)
        level = (ends[row + 1 :].min(axis=1) < ends[row].max()) & (ends[row + 1 :].max(axis=1) > ends[row].min())
        again = np.flatnonzero(level[left:] & (away[left:] <= near))
        if not len(again):
            continue
        low = int(np.searchsorted(first, steps.step[row], side="right"))
        high = int(np.searchsorted(first, steps.step[row + 1 + left + again[0]], side="right")) - 1
        if low <= high:
            spans.append((high, low))
    # each span has a state: the last one of the span that ends first is in as many others as any
    out: list[int] = []
    for high, low in sorted(spans):
        if not out or out[-1] < low:
            out.append(high)
    return out


def spaced_rows(lines: Array, spacing: float, most: int) -> Indices:
    """Rows no nearer to the one before than ``spacing`` [mm], which grows until there are at most ``most``."""
    middle = lines.mean(axis=1).tolist()
    while True:
        kept = list(range(min(len(middle), 1)))
        for k in range(1, len(middle)):
            (x, y, z), (a, b, c) = middle[k], middle[kept[-1]]
            if (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2 > spacing * spacing:
                kept.append(k)
        if len(kept) <= most:
            return np.array(kept, dtype=np.int64)
        spacing *= 1.3


def between_rows(lines: Array, own: Indices, rows: Indices, values: Array) -> Array:
    """Values of rows ``own`` from those of some of them, by distance between the two neighbours of each."""
    middle = lines.mean(axis=1)
    before = np.clip(np.searchsorted(rows, own, side="right") - 1, 0, len(rows) - 1)
    after = np.minimum(before + 1, len(rows) - 1)
    a, b = (np.linalg.norm(middle[own] - middle[rows[k]], axis=1) for k in (before, after))
    t = np.divide(a, a + b, out=np.zeros(len(a)), where=a + b > 0.0)
    t = t.reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((1.0 - t) * values[before] + t * values[after])


def _in_state(removed: Array, low: float, high: float, first: Array, last: Array) -> tuple[Array, Array]:
    """Compliance between two states by the volume removed, and its greatest relative error."""
    t = np.clip((removed - low) / (high - low), 0.0, 1.0) if high > low else np.zeros(len(removed))
    a, b = size_of(first), size_of(last)
    size = a ** (1.0 - t) * b**t
    w = t[:, None, None, None]
    mixed = (1.0 - w) * first / a[:, None, None, None] + w * last / b[:, None, None, None]
    mixed *= (size / size_of(mixed))[:, None, None, None]
    return mixed, np.maximum(np.maximum(a, b) - size, size - np.minimum(a, b)) / size
