"""Simulation of a Program in chunks: memory does not grow with the program, and a stopped run continues.

Notation: a chunk as in :mod:`chipload.simulation.checkpoint`. Steps are simulated in blocks. After a block, when some
seconds have passed, the columns since the last state become a chunk, and stock and sums become a state. A block depends
only on the stock and the sums before it, which a file restores bit for bit, and not on when states were written.
Therefore the result has the same bytes however often the run was stopped.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.memory import return_free_memory
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.checkpoint import Checkpoint, digest
from chipload.simulation.chips import (
    block_of,
    count_steps,
    removal_of,
    remove_block,
    runs_of_threads,
    stack_blocks,
    with_accuracy,
    with_moves,
)
from chipload.simulation.moves import MaterialAboveFlutes
from chipload.simulation.removal import Columns, Removal, Resolution, RunningSums, RunSettings, Seen, Watch, unseen
from chipload.simulation.steps import BLOCK, steps_in_blocks
from chipload.simulation.strips import remove_in_strips
from chipload.stock.layers import LayeredStock
from chipload.stock.shapes import read_shapes, shape_bytes

Floats = NDArray[np.float64]

#: steps whose columns are kept in memory at most
MOST = 32 * BLOCK
#: writing a state takes at most this share of the time
SHARE = 0.05
#: what a file of sums says of itself, and its arrays with their numbers of dimensions
SUMS = "chipload sums of a simulation 2"
ARRAYS = {"numbers": 1, "basis": 2, "rapids": 1}


class WatchState(Protocol):
    """State of a watch between steps, which belongs to the state of the run."""

    def to_bytes(self) -> bytes:
        """Return the state as the bytes of an ``.npz`` file."""

    def restore(self, path: Path) -> None:
        """Replace the state by that of a file from :meth:`to_bytes`; InputError if it is another file."""

    def clear(self) -> None:
        """Clear the state: the run begins from the start."""


def remove_in_chunks(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    unfinished: Checkpoint,
    *,
    watch: Watch | None = None,
    keeps: Mapping[str, WatchState] = MappingProxyType({}),
    times: Floats | None = None,
    also: Any = (),
    workers: int = 2,
    seen: Seen = unseen,
    progress: Progress = silent,
) -> Removal:
    """Do what :func:`chipload.simulation.chips.remove` does, with columns in files; continue a stopped run.

    Parameters
    ----------
    unfinished : the folder of the run; it holds the columns of the result, and stays until it is discarded
    keeps : states of ``watch`` beside its columns, by names of files
    times : as of :func:`chipload.simulation.chips.remove`
    seen : as of :func:`chipload.simulation.chips.remove`; what was kept comes first
    also : values of any kind on which the result depends beside the arguments: versions, what ``watch`` uses

    Returns
    -------
    Removal
        Its columns are :class:`chipload.simulation.checkpoint.Stored` where they did not stay in memory.

    Raises
    ------
    InputError
        As :func:`chipload.simulation.chips.remove`, and where the folder cannot be used.
    """
    count = count_steps(program, cutters, resolution)
    setting = RunSettings(cutters, material, resolution, watch, workers)
    shape = (stock.bounds, stock.xs, stock.ys, stock.cut, stock.tiles)
    part = None if stock.part is None else (np.asarray(stock.part.vertices), np.asarray(stock.part.faces))
    depends = (program, cutters, material, resolution, shape, part, watch is not None, BLOCK, times)
    kept = unfinished.begin(digest(*depends, also))
    sums, before = RunningSums(stock.volume()), stock.copied()
    if kept is not None:
        try:
            found_sums = _read_sums(kept["sums"])
            for name, state_of in keeps.items():
                state_of.restore(kept[name])
        except (InputError, KeyError) as err:
            unfinished.set_aside(str(err))
            for state_of in keeps.values():
                state_of.clear()
            kept = None
    sums = sums if kept is None else found_sums
    setting = with_moves(setting, program, stock, shank=sums.shank)
    progress(sums.steps / count, "removing")
    if kept is not None:
        unfinished.notice(f"continues after step {sums.steps} of {count}, kept in {unfinished.folder}")
    try:
        sums, columns = _remove_steps(program, stock, sums, setting, unfinished, count, times, keeps, seen, progress)
    except MaterialAboveFlutes as found:
        unfinished.again(f"starts from the beginning, and asks for the shank in material: line {found.line}: {found}")
        setting = with_moves(setting, program, stock, shank=True)
        sums = RunningSums(stock.volume(), shank=True)
        for state_of in keeps.values():
            state_of.clear()
        sums, columns = _remove_steps(program, stock, sums, setting, unfinished, count, times, keeps, seen, progress)
    setting.run.finish(stock, setting.workers)
    return_free_memory()
    progress(1.0, "removed")
    every: Columns = unfinished.columns() if unfinished.parts else stack_blocks(columns)
    return with_accuracy(removal_of(program, stock, material, sums, every), program, before, setting)


def _remove_steps(
    program: Program,
    stock: LayeredStock,
    sums: RunningSums,
    setting: RunSettings,
    unfinished: Checkpoint,
    count: int,
    times: Floats | None,
    keeps: Mapping[str, WatchState],
    seen: Seen,
    progress: Progress,
) -> tuple[RunningSums, list[Columns]]:
    """Return the sums after all steps, and the columns that are not in files."""
    resolution = setting.resolution

    def state() -> dict[str, bytes]:
        # the moves come from the program again
        return {name: kept.to_bytes() for name, kept in keeps.items()} | {"sums": _sums_bytes(sums)}

    done = sums.steps
    since, cost, waiting, columns = time.monotonic(), 0.0, 0, list[Columns]()
    blocks = steps_in_blocks(
        program, resolution.step_mm, resolution.tolerance, size=block_of(setting), first=done, times=times
    )
    runs = runs_of_threads(program, stock, setting, count)
    if done:
        seen(unfinished.columns())
        with ThreadPoolExecutor(max(len(runs), 1)) as pool:
            list(pool.map(lambda run: run.skip(program, resolution.step_mm, done), runs))
    for steps, moved in remove_in_strips(blocks, setting, runs, done):
        progress(sums.steps / count, "removing")
        sums, some, _ = remove_block(steps, moved, sums, setting)
        seen(some)
        columns.append(some)
        waiting += len(steps)
        now = time.monotonic()
        due = unfinished.every_s == 0.0 or now - since >= max(unfinished.every_s, cost / SHARE)
        if due or waiting >= MOST:
            unfinished.add(stack_blocks(columns))
            columns, waiting = [], 0
            return_free_memory()
        if due:
            unfinished.commit(state())
            since = time.monotonic()
            cost = since - now
    if unfinished.parts:
        if columns:
            unfinished.add(stack_blocks(columns))
        if unfinished.safe < count:
            unfinished.commit(state())
    return sums, columns


def _sums_bytes(sums: RunningSums) -> bytes:
    numbers = np.array([sums.before, sums.steps, sums.s_mm, sums.t_s, sums.cut_s, sums.shank])
    arrays = {"numbers": numbers, "basis": sums.basis, "rapids": np.array(sums.rapids, dtype=np.int64)}
    return shape_bytes(SUMS, arrays, np.empty(0, dtype=object))


def _read_sums(path: Path) -> RunningSums:
    a, _ = read_shapes(path, SUMS, ARRAYS)
    if a["numbers"].shape != (6,) or a["basis"].shape != (4, 6):
        raise InputError(f"{path}: damaged: remove its folder")
    before, steps, s_mm, t_s, cut_s, shank = a["numbers"].tolist()
    rapids = tuple(a["rapids"].tolist())
    return RunningSums(before, int(steps), s_mm, t_s, cut_s, a["basis"], rapids, bool(shank))
