"""Assignment of cutters and table angles to strips in the least total time.

Notation: a side is a grid of cells, one for each contact point; its strips follow each other across u or across v,
forwards or backwards. State: (cutter, table angle). Between two strips the state may change, at the cost of a cutter
change, of a re-indexing of the table, or of both.

Method: dynamic programming over the states, strip after strip, side after side; of the four directions through a side
the cheapest for every state behind it. A strip of which no state of the available cutters mills all cells is milled
cell by cell. With at most m cutters the time of every set of m has a lower bound from its strips without changes. The
sets are solved in the order of their bounds until a bound is not below the best time: exact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.planning.impeller.scene import Floats

_assignment = LateModule("chipload.planning.impeller._assignment")

#: greatest number of sets of cutters
SETS = 300_000
_BATCH = 512  # sets that are solved together


@dataclass(frozen=True)
class Changes:
    """Times [s], >= 0: of a cutter change and of setting the index table to another angle."""

    cutter: float
    table: float

    def __post_init__(self) -> None:
        for name in ("cutter", "table"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise InputError(f"{name}_change_s = {value:g}: must be at least 0")


class Step(NamedTuple):
    """One strip, or one cell of it, in the order of milling; ``order`` 0: across u, 1: across v; ``cell`` -1: all."""

    side: int
    order: int
    strip: int
    cell: int
    cutter: int
    table: int


@dataclass(frozen=True)
class Assignment:
    """The assignment in the least time: its time with changes [s], and its steps."""

    total: float
    steps: tuple[Step, ...]


def assign_cutters(
    sides: Sequence[tuple[Floats, Floats]], changes: Changes, most: int | None = None
) -> Assignment | None:
    """Assignment in the least time over all sides in their order, with at most ``most`` different cutters.

    Parameters
    ----------
    sides : for each side the time (a, b, cutters, tables) [s] of every cell when its strips follow each other across
        u, and (b, a, cutters, tables) across v; inf: the cutter does not go there
    most : None: any number

    Returns
    -------
    None: no set of so many cutters mills all cells.

    Raises
    ------
    InputError
        ``most`` is below 1, or there are more than :data:`SETS` sets.

    Examples
    --------
    Two strips; the second cutter is faster on the second strip by more than a change costs.

    >>> t = np.array([[[[1.0], [5.0]]], [[[9.0], [2.0]]]])
    >>> assign_cutters([(t, t.swapaxes(0, 1))], Changes(3.0, 0.0)).total
    6.0
    """
    if most is not None and most < 1:
        raise InputError(f"most = {most}: must be at least 1 cutter")
    count = sides[0][0].shape[2]
    if most is None:
        return _solve_chosen(sides, np.arange(count), changes)
    bounds, sets = _sets(sides, changes, most)
    best, who = math.inf, -1
    for first in range(0, len(sets), _BATCH):
        if bounds[first] >= best:
            break
        totals = _totals(sides, sets[first : first + _BATCH], changes)
        if totals.min() < best:
            best, who = float(totals.min()), first + int(totals.argmin())
    return None if who < 0 else _solve_chosen(sides, np.unique(sets[who]), changes)


def bound_of_strips(sides: Sequence[tuple[Floats, Floats]], changes: Changes, most: int | None = None) -> float:
    """No time [s] is below this in whatever sequence the strips are milled: each strip its own best of at most ``most``
    cutters, each side in its better order, table angles for nothing, one change for each cutter after the first.
    """  # fmt: skip
    if most is None:
        whole = np.arange(sides[0][0].shape[2])[None]
        return float(_bounds(sides, whole)[0])
    bounds, _ = _sets(sides, changes, most)
    return float(bounds[0]) if len(bounds) else math.inf


def bound_of_cells(sides: Sequence[tuple[Floats, Floats]], changes: Changes, most: int | None = None) -> float:
    """No time [s] is below this whatever the shape of the patches: as :func:`bound_of_strips`, with each cell its own
    best, either way of the paths.
    """  # fmt: skip
    best = [np.minimum(u, v.swapaxes(0, 1)).min(axis=3).reshape(-1, u.shape[2]) for u, v in sides]
    cells = np.concatenate(best)
    if most is None:
        return float(cells.min(axis=1).sum())
    low = math.inf
    for sets, size in _choices(np.flatnonzero(np.isfinite(cells).any(axis=0)), most):
        for first in range(0, len(sets), _BATCH):
            some = cells[:, sets[first : first + _BATCH]].min(axis=2).sum(axis=0)
            low = min(low, float(some.min()) + (size - 1) * changes.cutter)
    return low


class _Leaf(NamedTuple):
    where: tuple[int, int, int, int]
    cost: Floats


class _AssignmentRow(NamedTuple):
    parts: tuple[_Node, ...]


class _Either(NamedTuple):
    parts: tuple[_Node, ...]


_Node = _Leaf | _AssignmentRow | _Either


def _solve_chosen(
    sides: Sequence[tuple[Floats, Floats]], chosen: NDArray[np.int64], changes: Changes
) -> Assignment | None:
    """The least time with the chosen cutters alone."""
    tree = _AssignmentRow(tuple(_side(k, [cost[:, :, chosen] for cost in side]) for k, side in enumerate(sides)))
    start = np.zeros((len(chosen), sides[0][0].shape[3]))
    after, record = _forward(tree, start, changes)
    total = float(after.min())
    if not math.isfinite(total):
        return None
    steps: list[Step] = []
    state = divmod(int(after.argmin()), after.shape[1])
    _backward(tree, record, state, changes, steps)
    given = tuple(s._replace(cutter=int(chosen[s.cutter])) for s in reversed(steps))
    return Assignment(total, given)


def _side(number: int, orders: list[Floats]) -> _Node:
    options: list[_Node] = []
    for order, cost in enumerate(orders):
        strips: list[_Node] = []
        for k, cells in enumerate(cost):
            whole = cells.sum(axis=0)
            if np.isfinite(whole).any():
                strips.append(_Leaf((number, order, k, -1), whole))
            else:
                row = tuple(_Leaf((number, order, k, j), cell) for j, cell in enumerate(cells))
                strips.append(_Either((_AssignmentRow(row), _AssignmentRow(row[::-1]))))
        options += [_AssignmentRow(tuple(strips)), _AssignmentRow(tuple(strips[::-1]))]
    return _Either(tuple(options))


def _forward(node: _Node, before: Floats, changes: Changes) -> tuple[Floats, object]:
    """Least times (cutters, tables) after a node, and the data for the steps back."""
    if isinstance(node, _Leaf):
        return _enter_states(before, changes) + node.cost, before
    records = []
    if isinstance(node, _AssignmentRow):
        for part in node.parts:
            before, record = _forward(part, before, changes)
            records.append(record)
        return before, records
    found = [_forward(part, before, changes) for part in node.parts]
    out: Floats = np.minimum.reduce([after for after, _ in found])
    return out, found


def _backward(
    node: _Node, record: object, state: tuple[int, int], changes: Changes, steps: list[Step]
) -> tuple[int, int]:
    """Adds the steps of a node, last first, that end in ``state``; the state before them."""
    k, t = state
    if isinstance(node, _Leaf):
        assert isinstance(record, np.ndarray)
        steps.append(Step(*node.where, k, t))
        options: list[tuple[float, tuple[int, int]]] = [
            (record[k, t], (k, t)),
            (record[k].min() + changes.table, (k, int(record[k].argmin()))),
            (record[:, t].min() + changes.cutter, (int(record[:, t].argmin()), t)),
            (record.min() + changes.cutter + changes.table, divmod(int(record.argmin()), record.shape[1])),
        ]
        return min(options, key=lambda direction: float(direction[0]))[1]
    assert isinstance(record, list)
    if isinstance(node, _AssignmentRow):
        for part, one in zip(reversed(node.parts), reversed(record), strict=True):
            state = _backward(part, one, state, changes, steps)
        return state
    best = min(range(len(record)), key=lambda j: float(record[j][0][k, t]))
    return _backward(node.parts[best], record[best][1], state, changes, steps)


def _choices(usable: NDArray[np.int64], most: int) -> list[tuple[NDArray[np.int64], int]]:
    sizes = range(1, min(most, len(usable)) + 1)
    number = sum(math.comb(len(usable), size) for size in sizes)
    if number > SETS:
        raise InputError(
            f"{number} sets of {most} of {len(usable)} cutters: must be at most {SETS}: fewer cutters, or any number"
        )
    return [(np.array(list(combinations(usable.tolist(), size))), size) for size in sizes]


def _sets(sides: Sequence[tuple[Floats, Floats]], changes: Changes, most: int) -> tuple[Floats, NDArray[np.int64]]:
    """Bounds below the times of sets of cutters that can mill all cells, ascending; the sets (n, most), the last cutter
    again and again where there are fewer.
    """  # fmt: skip
    usable = np.flatnonzero(np.any([np.isfinite(u).any(axis=(0, 1, 3)) for u, _ in sides], axis=0))
    rows, low = [], []
    for sets, size in _choices(usable, most):
        rows.append(np.concatenate([sets, np.repeat(sets[:, -1:], most - size, axis=1)], axis=1))
        low.append(_bounds(sides, sets) + (size - 1) * changes.cutter)
    if not rows:
        return np.zeros(0), np.zeros((0, most), dtype=np.int64)
    bound, all_sets = np.concatenate(low), np.concatenate(rows)
    order = np.argsort(bound, kind="stable")
    order = order[np.isfinite(bound[order])]
    return bound[order], all_sets[order]


def _bounds(sides: Sequence[tuple[Floats, Floats]], sets: NDArray[np.int64]) -> Floats:
    """(n,) strips without changes."""
    out = np.zeros(len(sets))
    for side in sides:
        options = []
        for cost in side:
            strips, cells = cost.sum(axis=1).min(axis=2), cost.min(axis=3)
            low = np.zeros(len(sets))
            for strip, cell in zip(strips, cells, strict=True):
                best = strip[sets].min(axis=1)
                split = ~np.isfinite(best)
                if split.any():
                    best[split] = cell[:, sets[split]].min(axis=2).sum(axis=0)
                low += best
            options.append(low)
        out += np.minimum(*options)
    return out


def _totals(sides: Sequence[tuple[Floats, Floats]], sets: NDArray[np.int64], changes: Changes) -> Floats:
    """Least times (n,) of many sets, as :func:`_solve_chosen` without the steps; inf: cells are left."""
    state = np.zeros((*sets.shape, sides[0][0].shape[3]))
    for side in sides:
        after = np.full_like(state, np.inf)
        for cost in side:
            cells = np.ascontiguousarray(cost)
            for step in (1, -1):
                _assignment.mill_strips(
                    cells, cells.sum(axis=1), sets, state, step, changes.cutter, changes.table, after
                )
        state = after
    out: Floats = state.min(axis=(1, 2))
    return out


def _enter_states(before: Floats, changes: Changes) -> Floats:
    """Least times (..., cutters, tables) when each state may be come to from every other."""
    table, cutter = before.min(axis=-1, keepdims=True), before.min(axis=-2, keepdims=True)
    out = np.minimum(before, table + changes.table)
    out = np.minimum(out, cutter + changes.cutter)
    least: Floats = np.minimum(out, table.min(axis=-2, keepdims=True) + changes.cutter + changes.table)
    return least
