"""Run a Program through a stock piece by piece: memory does not grow with it, and a run that was stopped goes on.

Notation: a piece as in :mod:`chipload.simulation.unfinished`. Steps are simulated in blocks; after a block, when some
seconds have passed, the columns since the last time become a piece, the stock and the sums a state. A block needs the
stock and the sums before it and nothing else, both come back from a file bit for bit, and blocks do not depend on when
states were written: so the result has the same bytes however often the run was stopped.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from shapely import MultiPolygon, Polygon

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.chips.move import Move
from chipload.errors import InputError
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.chips import (
    Columns,
    Piece,
    Removal,
    Resolution,
    Sums,
    Watch,
    counted,
    removal_of,
    remove_block,
    setting_of,
    stacked,
)
from chipload.simulation.steps import BLOCK, steps_in_blocks
from chipload.simulation.swept import Interpolation
from chipload.simulation.unfinished import Unfinished, digest
from chipload.stock.layers import LayeredStock
from chipload.stock.shapes import read_shapes, shape_bytes

#: steps whose columns are kept in memory at most
MOST = 128 * BLOCK
#: writing a state takes at most this share of the time
SHARE = 0.05
#: what a file of sums says of itself, and its arrays with their numbers of dimensions
SUMS = "chipload sums of a simulation 1"
ARRAYS = {"numbers": 1, "basis": 2, "rapids": 1, "of": 1, "height": 1, "tip": 2, "axis": 2}


def remove_in_pieces(
    program: Program,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    material: Material,
    resolution: Resolution,
    unfinished: Unfinished,
    *,
    interpolation: Interpolation = "slerp",
    watch: Watch | None = None,
    also: Any = (),
    workers: int = 2,
    progress: Progress = silent,
) -> Removal:
    """What :func:`chipload.simulation.chips.remove` does, with its columns in files and from where it was stopped.

    Parameters
    ----------
    unfinished : the folder of the run; it holds the columns of the result, and stays until it is discarded
    also : values of any kind on which the result depends beside the arguments: versions, what ``watch`` uses

    Returns
    -------
    Removal
        Its columns are :class:`chipload.simulation.unfinished.Stored` where they did not stay in memory.

    Raises
    ------
    InputError
        As :func:`chipload.simulation.chips.remove`, and where the folder cannot be used.
    """
    count = counted(program, cutters, resolution)
    setting = setting_of(cutters, material, resolution, interpolation, watch, workers)
    shape = (stock.bounds, stock.xs, stock.ys, stock.cut, stock.room, stock.tidied, stock.tiles)
    part = None if stock.part is None else (np.asarray(stock.part.vertices), np.asarray(stock.part.faces))
    kept = unfinished.begin(
        digest(program, cutters, material, resolution, shape, part, interpolation, watch is not None, BLOCK, also)
    )
    sums = Sums(stock.volume())
    if kept is not None:
        sums = _read_sums(kept["sums"], cutters)
        stock.restore(LayeredStock.load(kept["stock"]).state())
        unfinished.notice(f"goes on after step {sums.steps} of {count}, kept in {unfinished.folder}")
    done = sums.steps
    since, cost, waiting, columns = time.monotonic(), 0.0, 0, list[Columns]()
    for steps in steps_in_blocks(program, resolution.step_mm, resolution.tolerance, size=BLOCK, first=done):
        progress(sums.steps / count, "removing")
        sums, some, _ = remove_block(steps, stock, sums, setting)
        columns.append(some)
        waiting += len(steps)
        now = time.monotonic()
        due = now - since >= max(unfinished.every_s, cost / SHARE)
        if due or unfinished.every_s == 0.0 or waiting >= MOST:
            unfinished.add(stacked(columns))
            columns, waiting = [], 0
        if due or unfinished.every_s == 0.0:
            unfinished.commit({"stock": stock.to_bytes(), "sums": _sums_bytes(sums, cutters)})
            since = time.monotonic()
            cost = since - now
    if unfinished.parts:
        if columns:
            unfinished.add(stacked(columns))
        if unfinished.safe < count:
            unfinished.commit({"stock": stock.to_bytes(), "sums": _sums_bytes(sums, cutters)})
    progress(1.0, "removed")
    found: Columns = unfinished.columns() if unfinished.parts else stacked(columns)
    return removal_of(program, stock, material, sums, found)


def _sums_bytes(sums: Sums, cutters: Mapping[int, Cutter]) -> bytes:
    piece = sums.piece
    tool = [n for n, c in cutters.items() if piece is not None and c is piece.cutter]
    none = np.zeros((0, 3))
    arrays = {
        "numbers": np.array([sums.before, sums.steps, sums.s_mm, sums.t_s, sums.cut_s]),
        "basis": sums.basis,
        "rapids": np.array(sums.rapids, dtype=np.int64),
        "of": np.array([piece.step, *tool] if piece is not None else [], dtype=np.int64),
        "height": np.array([piece.height] if piece is not None else []),
        "tip": piece.move.tip if piece is not None else none,
        "axis": piece.move.axis if piece is not None else none,
    }
    shapes = np.empty(0 if piece is None else 1 + len(piece.chips), dtype=object)
    shapes[:] = [] if piece is None else [piece.before, *piece.chips]
    return shape_bytes(SUMS, arrays, shapes)


def _read_sums(path: Path, cutters: Mapping[int, Cutter]) -> Sums:
    a, shapes = read_shapes(path, SUMS, ARRAYS)
    if a["numbers"].shape != (5,) or a["basis"].shape != (4, 6) or (len(a["of"]) == 0) != (len(shapes) == 0):
        raise InputError(f"{path}: damaged: remove its folder")
    before, steps, s_mm, t_s, cut_s = a["numbers"].tolist()
    piece = None
    if len(shapes):
        step, tool = a["of"].tolist()
        chips = tuple(p for p in shapes[1:] if isinstance(p, Polygon))
        assert isinstance(shapes[0], MultiPolygon)
        piece = Piece(step, Move(a["tip"], a["axis"]), cutters[tool], float(a["height"][0]), shapes[0], chips)
    return Sums(before, int(steps), s_mm, t_s, cut_s, a["basis"], tuple(a["rapids"].tolist()), piece)
