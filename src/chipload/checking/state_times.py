"""Estimate of the processor time of the states of an elastic workpiece, before they are solved.

Measured on frames of 60,000 to 93,000 unknowns (docs/design/workpiece.md): a state takes 25 to 60 us of each unknown,
and its stock up to 5 ms of each layer. How many states are built is known within bounds only: at least the first ones
with those about the worst step, at most those that are stated, with both about each of the worst steps, and one for
each step whose stress is calculated.
"""

from __future__ import annotations

from chipload.checking.clamped import Workpiece
from chipload.checking.workpiece import FinishedPart
from chipload.checking.workpiece_compliance import STRAINED
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.faces import flat_faces, grid_on_faces
from chipload.structure.cells.states import FIRST, TIGHT
from chipload.structure.cells.thickness import WANTED_MODES, count_modes

#: processor time of a state, least and greatest [s]: of an unknown, and of a layer of its stock
UNKNOWN, LAYER = (25e-6, 60e-6), (0.0, 5e-3)
#: states about the worst step: before and after it, and in wider cells
ABOUT = 3
#: side of the tiles of a part in cells
TILE = 20.0


def state_times(workpiece: Workpiece, stock: LayeredStock, part: FinishedPart | None) -> tuple[float, float]:
    """Return the least and greatest processor time [s] of the states of a workpiece.

    Parameters
    ----------
    stock : before the program
    part : that the program leaves; None: its unknowns are those of the stock
    """
    unknowns = 3 * _most_modes(workpiece, stock, part)
    stated = max(workpiece.states, 2)
    fewest = min(stated, FIRST) + ABOUT
    most = stated + ABOUT * TIGHT + (0 if workpiece.yield_mpa is None else 2 * STRAINED)
    each = [UNKNOWN[k] * unknowns + LAYER[k] * stock.layers for k in (0, 1)]
    return fewest * each[0], most * each[1]


def _most_modes(workpiece: Workpiece, stock: LayeredStock, part: FinishedPart | None) -> int:
    """Return the modes of the stock or of the part in cells of the stated size, whichever has more."""
    cell = workpiece.cell_mm
    if cell is None:
        return WANTED_MODES
    last = stock if part is None else LayeredStock.of_mesh(part.mesh, cell, TILE * cell)
    grid = grid_on_faces(stock, flat_faces(last), cell, workpiece.order)
    return max(count_modes(one, grid) for one in (stock, last))
