"""Pieces of the stock that a program cuts free, and later cuts in them.

Notation: a column of the height map is there until the step that cuts it through. Two columns are joined if they are
neighbours and both are there. The pieces that stated clamps or fixtures hold after the program are clamped
(:mod:`chipload.simulation.heights.clamped_stock`), where these hold none that with the greatest volume; a column is
attached up to the last step before which a way of neighbours leads from it to one of them. Columns are joined whatever
the heights of their material: an overhang over a step in the bottom of the stock counts as joined.

A cut in a column that is not attached any more is a cut in a loose piece. The cutter that parts a piece still cuts
its border on its way out: the first way of a cutter's diameter after the parting does not count.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import LateModule, trimesh
from chipload.simulation.heights.clamped_stock import find_clamped_stock
from chipload.simulation.heights.height_map import NEVER, HeightMap
from chipload.structure.cells.clamp import Clamp

_lower = LateModule("chipload.simulation.heights._lower")

#: least columns of a cut in a loose piece that counts: fewer are at its border
LEAST = 4


@dataclass(frozen=True)
class LooseStock:
    """A piece that was cut free and is cut again.

    Parameters
    ----------
    freed_line : line that cut it free
    step, line : first step that cuts it after that
    place : of this cut [mm]
    size_mm : of the piece along x and y
    """

    freed_line: int
    step: int
    line: int
    place: tuple[float, float, float]
    size_mm: tuple[float, float]


def find_loose_stock(
    found: HeightMap, diameter: float, clamps: Sequence[Clamp] = (), fixtures: Sequence[trimesh.Trimesh] = ()
) -> tuple[LooseStock, ...]:
    """Return the pieces that a program cuts free and cuts again; O(columns x log).

    Parameters
    ----------
    diameter : of the largest cutter [mm], see the head of this file
    clamps, fixtures : that may hold pieces
    """
    from scipy import ndimage

    there = np.isfinite(found.low)
    stays = there & (found.gone == NEVER)
    if not (there & ~stays).any() or not stays.any():
        return ()
    label, count = ndimage.label(stays)
    volume = ndimage.sum_labels(np.where(stays, found.top - found.low, 0.0), label, np.arange(1, count + 1))
    until = np.full(found.gone.shape, -1.0)
    for k in find_clamped_stock(found, label, clamps, fixtures) or (int(np.argmax(volume)) + 1,):
        i, j = np.argwhere(label == k)[0].tolist()
        _lower.attached_until(found.gone, found.low, i, j, until)
    parted = there & (until < NEVER) & (found.last > until)
    if not parted.any():
        return ()
    steps = np.clip(until, 0.0, len(found.line) - 1).astype(np.int64)
    late = parted & (found.travel[np.maximum(found.last, 0)] - found.travel[steps + 1] > diameter)
    through = found.travel[np.minimum(found.gone, len(found.line))] - found.travel[steps + 1]
    pieces, number = ndimage.label(there & (until < NEVER) & ((found.gone == NEVER) | (through > diameter)))
    out = []
    for k in range(1, number + 1):
        piece = pieces == k
        cut = late & piece
        if int(cut.sum()) < LEAST:
            continue
        at = np.argwhere(cut)[int(np.argmin(found.last[cut]))]
        first, freed = int(found.last[at[0], at[1]]), int(steps[piece].max())
        place = (float(found.x[at[0]]), float(found.y[at[1]]), _height(found, at))
        out.append(LooseStock(int(found.line[freed]), first, int(found.line[first]), place, _size(found, piece)))
    return tuple(sorted(out, key=lambda p: p.step))


def _height(found: HeightMap, at: NDArray[np.int64]) -> float:
    """Height [mm] of what is left of a column, of its bottom where nothing is."""
    top = float(found.top[at[0], at[1]])
    return top if math.isfinite(top) else float(found.low[at[0], at[1]])


def _size(found: HeightMap, piece: NDArray[np.bool_]) -> tuple[float, float]:
    """Length of a piece along x and y [mm]."""
    rows, columns = np.flatnonzero(piece.any(axis=1)), np.flatnonzero(piece.any(axis=0))
    hx, hy = found.x[1] - found.x[0], found.y[1] - found.y[0]
    return float((rows[-1] - rows[0] + 1) * hx), float((columns[-1] - columns[0] + 1) * hy)
