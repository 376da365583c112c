"""Strips of a layered stock in processes of their own: each removes what reaches into its strip.

Notation: a strip is a range of neighbouring columns (or rows) of the tiles of the stock; it **owns** the steps whose
box has its middle in them. Its **halo** is the further columns that its own steps reach into. A tile depends on nothing
but the removals from it, in their order. So a process that has the tiles of strip and halo, and makes all steps that
reach into them, has the tiles under its own steps as one process has them, bit for bit: what it finds of its own
steps, chip and tooth engagement, has the same bits too. Where the axis leans, how an area is found depends on material
beyond it (:mod:`chipload.simulation.flute_end`); the halo then also holds what the steps of the halo ask for.

The strips lie along x or along y, as blocks of steps are shared more evenly. Where the halos leave no gain there are
no strips. The caller keeps the order: it takes the steps of a block from all strips, and computes loads and watches.
"""

from __future__ import annotations

import itertools
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import ChiploadError
from chipload.program.program import Program
from chipload.simulation.flute_end import MOST
from chipload.simulation.layer_removal import rank_of, removed_by_layers
from chipload.simulation.removal import ChipAreas, RunSettings, TakenByLayers
from chipload.simulation.steps import BLOCK, ROWS, Steps, steps_in_blocks
from chipload.simulation.swept_area import Plan, near_stock, plan_of
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: blocks of steps that a strip may be ahead of the caller
AHEAD = 8
#: of a step that is only removed, over one whose chip and tooth engagement are found too: its time, an estimate
HALO = 0.8
#: strips are used where the longest is expected to take at most this share of the time of one process
GAIN = 0.85
#: what a box of a step is enlarged by: share of the cutter's radius
MARGIN = 0.02


@dataclass(frozen=True)
class Strip:
    """Columns (axis 0) or rows (axis 1) of tiles: its own, and with its halo; each first and last."""

    axis: int
    own: tuple[int, int]
    whole: tuple[int, int]


@dataclass(frozen=True, eq=False)
class _Task:
    """What the process of a strip begins with; ``stock`` is its part of the stock, ``plan`` that of the whole."""

    strip: Strip
    borders: Floats
    plan: Plan
    stock: LayeredStock
    program: Program
    setting: RunSettings
    size: int
    first: int
    piece: ChipAreas | None


def strips_of(
    program: Program, stock: LayeredStock, cutters: Mapping[int, Cutter], step_mm: float, tolerance: float, count: int
) -> list[Strip]:
    """``count`` strips of a stock for a program; none where they would gain nothing.

    Parameters
    ----------
    step_mm, tolerance : of the simulation [mm]
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
        strips = _divided(axis, len(borders) - 1, low[axis], middle[axis], high[axis], near, leans, count)
        if len(strips) < count:
            continue
        cost = _cost(strips, low[axis], middle[axis], high[axis], near)
        if cost < least:
            best, least = strips, cost
    return best


def _columns_of(
    steps: Steps, stock: LayeredStock, plan: Plan, cutters: Mapping[int, Cutter], tolerance: float
) -> tuple[Ints, Ints, Ints, NDArray[np.bool_], NDArray[np.bool_]]:
    """(2, n) first, middle and last column and row of tiles that each step asks for; whether it comes near the stock;
    whether its axis leans.
    """
    low, high, near = near_stock(steps, plan, cutters)
    middle = 0.5 * (low[:, :2] + high[:, :2])
    leans = np.minimum(steps.a0[:, 2], steps.a1[:, 2]) < 1.0
    first, last = low[:, :2].copy(), high[:, :2].copy()
    top = float(stock.bounds[-1])
    for tool in np.unique(steps.tool[near]).tolist():
        c, k = cutters[tool], np.flatnonzero(near & (steps.tool == tool))
        # the shank is asked for too, and where the axis leans longer flutes
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


def _divided(
    axis: int, columns: int, low: Ints, middle: Ints, high: Ints, near: NDArray[np.bool_], leans: NDArray[np.bool_],
    count: int,
) -> list[Strip]:  # fmt: skip
    """Strips with as many own steps each as the columns allow, each with at least one column."""
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
    """Steps that the busiest strip makes, summed over what strips may be ahead; those of the halo count less."""
    each = []
    for strip in strips:
        own = near & (middle >= strip.own[0]) & (middle <= strip.own[1])
        others = near & ~own & (high >= strip.whole[0]) & (low <= strip.whole[1])
        each.append(own + HALO * others)
    starts = np.arange(0, len(near), AHEAD * BLOCK)
    return float(np.add.reduceat(np.array(each), starts, axis=1).max(axis=0).sum()) if len(near) else 0.0


class Strips:
    """The processes of some strips, which remove a program; a context manager.

    Parameters
    ----------
    strips : of :func:`strips_of`, at least one
    size : steps of a block
    stock : as it is before step ``first``
    piece : the chip of most pieces before it
    """

    def __init__(
        self, strips: list[Strip], program: Program, stock: LayeredStock, setting: RunSettings, size: int,
        first: int, piece: ChipAreas | None,
    ) -> None:  # fmt: skip
        self.strips, self.stock, self.cutters = strips, stock, setting.cutters
        self.asked, self.complete, self._waits = False, False, False
        own = replace(setting, watch=None, moves=None, workers=1, processes=1)
        self._processes = list[subprocess.Popen[bytes]]()
        self._found = list["queue.Queue[Any]"]()
        for strip in strips:
            borders = (stock.xs, stock.ys)[strip.axis]
            task = _Task(strip, borders, plan_of(stock), part_of(stock, strip), program, own, size, first, piece)
            process = subprocess.Popen(
                # -P: nothing is imported from the folder that the command is given in
                [sys.executable, "-P", "-c", "from chipload.simulation.strips import serve; serve()"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            )  # fmt: skip
            found: queue.Queue[Any] = queue.Queue()
            self._processes.append(process)
            self._found.append(found)
            threading.Thread(target=_read, args=(process, found), daemon=True).start()
            _send(process, task)
            for _ in range(AHEAD):
                _send(process, False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for process in self._processes:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    pipe.close()

    def ask(self) -> None:
        """Ask for the stock: some blocks later it is that of the caller (``complete``)."""
        self.asked = not self._waits
        self._waits = True

    def next(self, steps: Steps, piece: ChipAreas | None) -> TakenByLayers:
        """What the next block of steps takes; ``piece``: the chip of most pieces before them."""
        removed, gained = np.zeros((len(steps), 4)), np.zeros(len(steps))
        bites, pieces, self.complete = [], list[ChipAreas](), False
        for strip, process, found in zip(self.strips, self._processes, self._found, strict=True):
            own, each, taken, tiles = _got(found)
            removed[own], gained[own] = each.removed, each.gained
            bites += each.engagement
            # of the cutters of the caller, not a copy
            pieces += [] if taken is None else [replace(taken[1], cutter=self.cutters[taken[0]])]
            if tiles is not None:
                self._put(strip, tiles)
                self.complete, self._waits = True, False
            _send(process, self.asked)
        self.asked = False
        for each in sorted(pieces, key=lambda p: p.step):
            if piece is None or rank_of(each.chips) > rank_of(piece.chips):
                piece = each
        for more in gained[gained != 0.0].tolist():
            self.stock.tidied += more
        return TakenByLayers(removed, gained, sorted(bites, key=lambda b: b.step), piece)

    def finish(self) -> None:
        """After the last block: the stock of the caller as the strips left it."""
        for strip, process, found in zip(self.strips, self._processes, self._found, strict=True):
            _send(process, None)
            self._put(strip, _got(found))
        self.complete = True

    def _put(self, strip: Strip, tiles: tuple[NDArray[Any], NDArray[np.bool_], Ints]) -> None:
        at = _slice(strip.axis, strip.own)
        self.stock.tiles[at], self.stock.room[at] = tiles[0], tiles[2]
        self.stock.cut = self.stock.cut | tiles[1]


def strips_for(
    program: Program,
    stock: LayeredStock,
    setting: RunSettings,
    size: int,
    first: int = 0,
    piece: ChipAreas | None = None,
) -> AbstractContextManager[Strips | None]:
    """The strips of a run from step ``first`` on; None where it runs by moves, in one process, or they gain nothing."""
    if setting.moves is not None or setting.processes < 2:
        return nullcontext()
    fine = setting.resolution
    strips = strips_of(program, stock, setting.cutters, fine.step_mm, fine.tolerance, setting.processes)
    return Strips(strips, program, stock, setting, size, first, piece) if strips else nullcontext()


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


def _send(process: subprocess.Popen[bytes], message: Any) -> None:
    if process.stdin is None:
        return
    try:
        pickle.dump(message, process.stdin)
        process.stdin.flush()
    except BrokenPipeError:
        # what is read from it says why
        return


def _read(process: subprocess.Popen[bytes], found: queue.Queue[Any]) -> None:
    """Put all that a process sends into a queue."""
    try:
        while process.stdout is not None:
            found.put(pickle.load(process.stdout))
    except Exception:
        # whatever it is, the caller waits for an answer
        found.put(
            ChiploadError("simulation: a process of a strip of the stock ended: free memory, or state workers = 1")
        )


def _got(found: queue.Queue[Any]) -> Any:
    value = found.get()
    if isinstance(value, BaseException):
        raise value
    return value


def serve() -> None:
    """The process of a strip: reads its task from the standard input, then a message for each block of steps (whether
    its tiles are asked for after it), None for the tiles at the end; writes what it finds to the standard output.
    """
    # Ctrl-C is for the caller, which ends this process
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    given, out = sys.stdin.buffer, sys.stdout.buffer
    sys.stdout = sys.stderr
    try:
        _serve(pickle.load(given), given, out)
    except (EOFError, BrokenPipeError):
        # the caller has ended
        return
    except Exception as error:
        pickle.dump(error, out)
        out.flush()


def _serve(task: _Task, given: Any, out: Any) -> None:
    strip, stock, fine = task.strip, task.stock, task.setting.resolution
    inner = (strip.own[0] - strip.whole[0], strip.own[1] - strip.whole[0])
    piece, at = task.piece, task.first

    def tiles() -> tuple[NDArray[Any], NDArray[np.bool_], Ints]:
        where = _slice(strip.axis, inner)
        return stock.tiles[where], stock.cut, stock.room[where]

    for steps in steps_in_blocks(task.program, fine.step_mm, fine.tolerance, size=task.size, first=task.first):
        message = pickle.load(given)
        low, high, near = near_stock(steps, task.plan, task.setting.cutters)
        column = column_of(0.5 * (low[:, strip.axis] + high[:, strip.axis]), task.borders)
        own = near & (column >= strip.own[0]) & (column <= strip.own[1])
        found = removed_by_layers(steps, stock, at, task.setting, piece, own, task.plan)
        new = found.piece if found.piece is not piece else None
        fresh = None if new is None else (int(steps.tool[new.step - at]), new)
        piece, at = found.piece, at + len(steps)
        which = np.flatnonzero(own)
        part = TakenByLayers(found.removed[which], found.gained[which], found.engagement, None)
        pickle.dump((which, part, fresh, tiles() if message else None), out)
        out.flush()
    while pickle.load(given) is not None:
        pass
    pickle.dump(tiles(), out)
    out.flush()
