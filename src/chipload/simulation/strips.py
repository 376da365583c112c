"""Division of a layered stock into strips, whose removal runs as tasks in other processes or on a cluster.

Notation: a strip is a range of neighbouring columns (or rows) of the tiles of the stock; it **owns** the steps whose
box has its middle in the range. Its **halo** is the further columns into which its own steps reach. The state of a tile
depends only on the removals from it, in their order. A task that has the tiles of strip and halo, and removes all steps
that reach into them, therefore has the same tiles under its own steps as one process, bit for bit; the chips and the
tooth engagement of its own steps are the same too. Where the axis leans, the calculation of an area depends on material
beyond it (:mod:`chipload.simulation.flute_end`); the halo then also holds the tiles that the steps of the halo need.

A **round** is several blocks of steps, with one task for each strip. The task receives the tiles of the strip and
returns them with its results, so that the task of a killed worker is repeated from the same tiles. While the caller
calculates the loads of one round, the next round is removed. The strips lie along x or along y, whichever divides the
steps more evenly. There are no strips where the halos leave no gain.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import ChiploadError
from chipload.program.program import Program
from chipload.simulation.flute_end import MOST
from chipload.simulation.layer_removal import rank_of, removed_by_layers
from chipload.simulation.removal import ChipAreas, RunSettings, TakenByLayers
from chipload.simulation.steps import BLOCK, ROWS, Steps, number_of_steps, steps_in_blocks
from chipload.simulation.swept_area import Plan, near_stock, plan_of
from chipload.stock.layers import LayeredStock
from chipload.workers import Team, Workers

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: number of blocks of a round; the first round has one, so that the caller does not wait for all strips at the start
ROUND = 8
#: estimated ratio of the time of a step that is only removed to that of one whose chip and tooth engagement are found
HALO = 0.8
#: greatest expected time of the longest strip, as a share of the time of one process, with which strips are used
GAIN = 0.85
#: enlargement of the box of a step, as a share of the cutter's radius
MARGIN = 0.02


@dataclass(frozen=True)
class Strip:
    """Columns or rows of tiles.

    Attributes
    ----------
    axis : 0: columns, 1: rows
    own : first and last of its own
    whole : first and last with its halo
    """

    axis: int
    own: tuple[int, int]
    whole: tuple[int, int]


@dataclass(frozen=True, eq=False)
class _Shared:
    """Data that the tasks of all strips share; ``plan`` is that of the whole stock, ``size`` steps make a block."""

    xs: Floats
    ys: Floats
    plan: Plan
    program: Program
    setting: RunSettings
    size: int


@dataclass(frozen=True, eq=False)
class _State:
    """A strip between two rounds: its part of the stock, and the chip of most pieces before step number ``first``."""

    strip: Strip
    stock: LayeredStock
    piece: ChipAreas | None
    first: int


@dataclass(frozen=True, eq=False)
class _Found:
    """Result of a strip in a block.

    Attributes
    ----------
    own : (k,) numbers of its own steps in the block
    taken : their removal
    piece : number of the tool, and the chip of most pieces, if one of its steps made it; None: none did
    """

    own: Ints
    taken: TakenByLayers
    piece: tuple[int, ChipAreas] | None


#: result of a strip in a block, or the error that ended the strip there
Block = _Found | ChiploadError


def strips_of(
    program: Program, stock: LayeredStock, cutters: Mapping[int, Cutter], step_mm: float, tolerance: float, count: int
) -> list[Strip]:
    """Return ``count`` strips of a stock for a program; none if they would save no time.

    Parameters
    ----------
    cutters : by tool number
    step_mm, tolerance : of the simulation [mm]
    count : number of strips
    """
    plan = plan_of(stock)
    found = [
        _columns_of(steps, stock, plan, cutters, tolerance)
        for steps in steps_in_blocks(program, step_mm, tolerance, size=ROWS)
    ]
    low, middle, high = (np.concatenate([f[i] for f in found], axis=1) for i in range(3))
    near, leans = (np.concatenate([f[i] for f in found]) for i in (3, 4))
    best, least = list[Strip](), GAIN * float(near.sum())
    for axis, borders in enumerate((stock.xs, stock.ys)):
        strips = _divide_columns(axis, len(borders) - 1, low[axis], middle[axis], high[axis], near, leans, count)
        if len(strips) < count:
            continue
        cost = _cost(strips, low[axis], middle[axis], high[axis], near)
        if cost < least:
            best, least = strips, cost
    return best


def _columns_of(
    steps: Steps, stock: LayeredStock, plan: Plan, cutters: Mapping[int, Cutter], tolerance: float
) -> tuple[Ints, Ints, Ints, NDArray[np.bool_], NDArray[np.bool_]]:
    """Tiles that each of n steps needs.

    Returns
    -------
    low, middle, high : (2, n) int, first, middle and last column, and row
    near : (n,) bool, whether the step comes near the stock
    leans : (n,) bool, whether its axis leans
    """
    low, high, near = near_stock(steps, plan, cutters)
    middle = 0.5 * (low[:, :2] + high[:, :2])
    leans = np.minimum(steps.a0[:, 2], steps.a1[:, 2]) < 1.0
    first, last = low[:, :2].copy(), high[:, :2].copy()
    top = float(stock.bounds[-1])
    for tool in np.unique(steps.tool[near]).tolist():
        c, k = cutters[tool], np.flatnonzero(near & (steps.tool == tool))
        # the shank is tested too, and longer flutes where the axis leans
        tall = c.flute_length + MOST * max(float(c.radius_at([c.flute_length])[0]), 1.0)
        wide = max(c.radius, 0.5 * (c.shank_diameter or 0.0), float(c.radius_at([tall if leans[k].any() else 0.0])[0]))
        wide = (1.0 + MARGIN) * wide + tolerance
        a = np.minimum(steps.a0[k, 2], steps.a1[k, 2]).clip(1e-6)
        far = np.where(leans[k], (top - np.minimum(steps.p0[k, 2], steps.p1[k, 2]) + wide) / a, c.flute_length)
        far = np.maximum(far, np.where(leans[k], max(tall, c.overhang), 0.0))[:, None]
        turn = np.linalg.norm(steps.a1[k] - steps.a0[k], axis=1)[:, None]
        reach = wide + (far + wide) * turn
        ends = [
            p[k, :2] + w * axis[k, :2] for p, axis in ((steps.p0, steps.a0), (steps.p1, steps.a1)) for w in (0, far)
        ]
        first[k] = np.minimum(first[k], np.min(ends, axis=0) - reach)
        last[k] = np.maximum(last[k], np.max(ends, axis=0) + reach)
    out = np.empty((3, 2, len(steps)), dtype=np.int64)
    for axis, borders in enumerate((stock.xs, stock.ys)):
        most = len(borders) - 2
        out[0, axis] = np.clip(np.searchsorted(borders, first[:, axis], "left") - 1, 0, most)
        out[1, axis] = column_of(middle[:, axis], borders)
        out[2, axis] = np.clip(np.searchsorted(borders, last[:, axis], "right") - 1, 0, most)
    return out[0], out[1], out[2], near, leans


def column_of(at: Floats, borders: Floats) -> Ints:
    """(n,) columns of tiles in which places lie; beyond the stock the first or the last.

    >>> column_of(np.array([-1.0, 0.5, 3.0]), np.array([0.0, 1.0, 2.0])).tolist()
    [0, 0, 1]
    """
    return np.clip(np.searchsorted(borders, at, "right") - 1, 0, len(borders) - 2)


def _divide_columns(
    axis: int, columns: int, low: Ints, middle: Ints, high: Ints, near: NDArray[np.bool_], leans: NDArray[np.bool_],
    count: int,
) -> list[Strip]:  # fmt: skip
    """Strips with numbers of own steps as equal as the columns allow; none if there are fewer columns than strips.

    low, middle, high, near, leans : (n,) of the steps, see :func:`_columns_of`
    """
    if columns < count or not near.any():
        return []
    before = np.cumsum(np.bincount(middle[near], minlength=columns))
    ends = [int(np.argmin(np.abs(before - before[-1] * (k + 1) / count))) for k in range(count - 1)]
    borders = [-1, *ends, columns - 1]
    strips = []
    for a, b in itertools.pairwise(borders):
        if b <= a:
            return []
        own = near & (middle > a) & (middle <= b)
        first, last = min(a + 1, int(low[own].min(initial=a + 1))), max(b, int(high[own].max(initial=b)))
        while True:
            those = near & leans & (high >= first) & (low <= last)
            more = min(first, int(low[those].min(initial=first))), max(last, int(high[those].max(initial=last)))
            if more == (first, last):
                break
            first, last = more
        strips.append(Strip(axis, (a + 1, b), (first, last)))
    return strips


def _cost(strips: list[Strip], low: Ints, middle: Ints, high: Ints, near: NDArray[np.bool_]) -> float:
    """Number of steps of the busiest strip, summed over rounds; a step of the halo counts ``HALO``."""
    each = []
    for strip in strips:
        own = near & (middle >= strip.own[0]) & (middle <= strip.own[1])
        others = near & ~own & (high >= strip.whole[0]) & (low <= strip.whole[1])
        each.append(own + HALO * others)
    starts = np.arange(0, len(near), ROUND * BLOCK)
    return float(np.add.reduceat(np.array(each), starts, axis=1).max(axis=0).sum()) if len(near) else 0.0


class Strips:
    """Strips of a stock from which a team of workers removes a program.

    Parameters
    ----------
    strips : of :func:`strips_of`, at least one
    executor : of one thread, which waits for the team
    stock : before step ``first``
    size : number of steps of a block
    first : number of the first step
    piece : the chip of most pieces before it

    Attributes
    ----------
    complete : whether the stock of the caller is that after the last block
    """

    def __init__(
        self, strips: list[Strip], team: Team, executor: ThreadPoolExecutor, program: Program, stock: LayeredStock,
        setting: RunSettings, size: int, first: int, piece: ChipAreas | None,
    ) -> None:  # fmt: skip
        self.stock, self.cutters, self.complete = stock, setting.cutters, True
        self._team, self._executor = team, executor
        own = replace(setting, watch=None, moves=None, workers=1, processes=Workers())
        team.share(_Shared(stock.xs, stock.ys, plan_of(stock), program, own, size))
        self._states = [_State(strip, part_of(stock, strip), piece, first) for strip in strips]
        self._total = number_of_steps(program, setting.resolution.step_mm, setting.resolution.tolerance)
        self._blocks = list[tuple[Block, ...]]()
        self._coming = executor.submit(self._remove_round, 1)

    def _remove_round(self, blocks: int) -> list[tuple[list[Block], _State]]:
        """Remove the next blocks of all strips; return their results and the states after them, strip by strip."""
        done = dict(self._team.completed_shared(removed_in_strip, [(state, blocks) for state in self._states]))
        return [done[k] for k in range(len(done))]

    def next(self, steps: Steps, piece: ChipAreas | None) -> TakenByLayers:
        """Return the removal of the next block of steps; ``piece`` is the chip of most pieces before them."""
        if not self._blocks:
            done = self._coming.result()
            self._states = [state for _, state in done]
            # the shortest ends with an error
            self._blocks = list(zip(*(found for found, _ in done), strict=False))
            failed = any(isinstance(one, ChiploadError) for one in self._blocks[-1])
            if not failed and self._states[0].first < self._total:
                self._coming = self._executor.submit(self._remove_round, ROUND)
        removed, gained = np.zeros((len(steps), 4)), np.zeros(len(steps))
        engagement, pieces = [], list[ChipAreas]()
        for each in self._blocks.pop(0):
            if isinstance(each, ChiploadError):
                raise each
            removed[each.own], gained[each.own] = each.taken.removed, each.taken.gained
            engagement += each.taken.engagement
            # of the cutters of the caller, not a copy
            pieces += [] if each.piece is None else [replace(each.piece[1], cutter=self.cutters[each.piece[0]])]
        for one in sorted(pieces, key=lambda p: p.step):
            if piece is None or rank_of(one.chips) > rank_of(piece.chips):
                piece = one
        for more in gained[gained != 0.0].tolist():
            self.stock.tidied += more
        self.complete = not self._blocks
        for state in self._states if self.complete else ():
            self._write_back(state)
        return TakenByLayers(removed, gained, sorted(engagement, key=lambda b: b.step), piece)

    def _write_back(self, state: _State) -> None:
        """Write the tiles of a strip into the stock of the caller."""
        strip, part = state.strip, state.stock
        to = _slice(strip.axis, strip.own)
        at = _slice(strip.axis, (strip.own[0] - strip.whole[0], strip.own[1] - strip.whole[0]))
        self.stock.tiles[to], self.stock.room[to] = part.tiles[at], part.room[at]
        self.stock.cut = self.stock.cut | part.cut


@contextmanager
def strips_for(
    program: Program,
    stock: LayeredStock,
    setting: RunSettings,
    size: int,
    first: int = 0,
    piece: ChipAreas | None = None,
) -> Iterator[Strips | None]:
    """The strips of a run from step ``first`` on; None if it runs by moves, in one process, or without gain."""
    if setting.moves is not None or setting.processes.alone:
        yield None
        return
    fine = setting.resolution
    # the thread ends after the team, which ends what it waits for
    with ThreadPoolExecutor(1) as executor, setting.processes.team() as team:
        strips = strips_of(program, stock, setting.cutters, fine.step_mm, fine.tolerance, team.size)
        yield Strips(strips, team, executor, program, stock, setting, size, first, piece) if strips else None


def _slice(axis: int, columns: tuple[int, int]) -> tuple[slice, slice, slice]:
    those, every = slice(columns[0], columns[1] + 1), slice(None)
    return (every, every, those) if axis == 0 else (every, those, every)


def part_of(stock: LayeredStock, strip: Strip) -> LayeredStock:
    """The tiles of a strip and its halo as a stock of their own."""
    at, (first, last) = _slice(strip.axis, strip.whole), strip.whole
    xs, ys = stock.xs, stock.ys
    xs, ys = (xs[first : last + 2], ys) if strip.axis == 0 else (xs, ys[first : last + 2])
    out = LayeredStock(stock.bounds, xs, ys, stock.tiles[at].copy())
    out.cut, out.room = stock.cut.copy(), stock.room[at].copy()
    return out


def removed_in_strip(run: _Shared, state: _State, blocks: int) -> tuple[list[Block], _State]:
    """Remove the next blocks of a strip; a worker executes this function."""
    # a copy: where the task is done again, it begins as it did
    strip, stock, fine = state.strip, state.stock.copied(), run.setting.resolution
    borders = (run.xs, run.ys)[strip.axis]
    piece, at, out = state.piece, state.first, list[Block]()
    steps_of_all = steps_in_blocks(run.program, fine.step_mm, fine.tolerance, size=run.size, first=at)
    try:
        for steps in itertools.islice(steps_of_all, blocks):
            low, high, near = near_stock(steps, run.plan, run.setting.cutters)
            column = column_of(0.5 * (low[:, strip.axis] + high[:, strip.axis]), borders)
            own = near & (column >= strip.own[0]) & (column <= strip.own[1])
            found = removed_by_layers(steps, stock, at, run.setting, piece, own, run.plan)
            new = found.piece if found.piece is not piece else None
            fresh = None if new is None else (int(steps.tool[new.step - at]), new)
            piece, at = found.piece, at + len(steps)
            which = np.flatnonzero(own)
            part = TakenByLayers(found.removed[which], found.gained[which], found.engagement, None)
            out.append(_Found(which, part, fresh))
    except ChiploadError as error:
        # raised where the caller comes to this block
        out.append(error)
    return out, _State(strip, stock, piece, at)
