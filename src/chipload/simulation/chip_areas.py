"""The chip of a step on the layers of the stock, by the boundary theory of chips (:mod:`chipload.engagement.chips`).

Of the steps whose engaged surface has most pieces, the section of the stock before the step is made from the moves;
the chip is what the step covers of it. It is shown with the diagram of its boundary.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.chips import chips
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import LEAST_AXIS_Z, Move
from chipload.program.program import Program
from chipload.simulation.initial_stock import StockOfMoves
from chipload.simulation.moves import run_by_moves
from chipload.simulation.removal import ChipAreas, Columns, Removal, Resolution
from chipload.simulation.steps import Steps, rows_of_steps, step_boxes, steps_in_blocks
from chipload.stock.layers import LayeredStock
from chipload.stock.tile_grid import polygons

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: steps whose chips are made
CANDIDATES = 8
#: a piece of a chip narrower than so many tolerances is a film left by chords, no piece
FILM = 4.0
#: two chips are equally divided within this
EQUAL = 1e-9


def most_divided_chip(
    program: Program, stock: LayeredStock, cutters: Mapping[int, Cutter], resolution: Resolution, removal: Removal
) -> ChipAreas | None:
    """Return the chip with most pieces on a layer, of those the one whose pieces are most alike; None: there is none.

    Parameters
    ----------
    stock : before the program; it stays
    removal : of the program by moves
    """
    fine, chosen, done = resolution, _candidates(removal.columns), 0
    run = run_by_moves(
        program, stock, cutters, fine.step_mm, fine.tolerance, fine.corner_slices, fine.flank_mm,
        shank=True,
    )  # fmt: skip
    run = replace(run, shank=None)
    best, rank = None, (0, 0.0)
    for block in steps_in_blocks(program, fine.step_mm, fine.tolerance):
        made = 0
        for k in chosen[(chosen >= done) & (chosen < done + len(block))].tolist():
            run.make(rows_of_steps(block, np.arange(made, k - done)), k - done - made)
            made = k - done
            for one in _chips_of_step(k, rows_of_steps(block, np.array([made])), stock, cutters, run.stock, fine):
                own = rank_of(one.chips)
                if own[0] > rank[0] or (own[0] == rank[0] and own[1] > rank[1] + EQUAL):
                    best, rank = one, own
        done += len(block)
        if done > int(chosen.max(initial=-1)):
            break
        run.make(rows_of_steps(block, np.arange(made, len(block))), len(block) - made)
    return best


def rank_of(whole: tuple[Polygon, ...]) -> tuple[int, float]:
    """Return the rank of a chip: the number of its pieces, then how equal they are.

    >>> rank_of((shapely.box(0, 0, 1, 1), shapely.box(3, 0, 6, 1)))
    (2, 0.25)
    """
    areas = [p.area for p in whole]
    return len(areas), min(areas) / sum(areas) if areas else 0.0


def _candidates(columns: Columns) -> Ints:
    """Return the steps whose engaged surface has most pieces, at even distances among those that have as many."""
    pieces = np.where(np.asarray(columns["force_n"]) > 0.0, np.asarray(columns["chip_areas"]), 0)
    most = np.flatnonzero((pieces == pieces.max(initial=0)) & (pieces > 0))
    return (
        most[np.unique(((np.arange(CANDIDATES) + 0.5) / CANDIDATES * len(most)).astype(np.int64))]
        if len(most)
        else most
    )


def _chips_of_step(
    number: int, step: Steps, stock: LayeredStock, cutters: Mapping[int, Cutter], left: StockOfMoves, fine: Resolution
) -> list[ChipAreas]:
    """Return the chips of a step on the layers that it cuts; none where its axis lies."""
    if min(step.a0[0, 2], step.a1[0, 2]) < 2.0 * LEAST_AXIS_Z:
        return []
    move = Move.slerp(step.p0[0], step.a0[0], step.p1[0], step.a1[0])
    cutter, (low, high) = cutters[int(step.tool[0])], (x[0] for x in step_boxes(step, cutters))
    rows = stock.layers_between(low[2], high[2])
    heights, near, out = stock.heights[list(rows)], shapely.box(*low[:2], *high[:2]), list[ChipAreas]()
    for i, area in zip(rows, covered_areas(move, cutter, heights.tolist(), fine.tolerance), strict=True):
        if area is None:
            continue
        z = float(stock.heights[i])
        before = shapely.intersection(stock.section(i, low[:2], high[:2]), near)
        before = MultiPolygon(polygons(shapely.difference(before, left.outlines(z, 0.5 * fine.tolerance))))
        pieces = tuple(c.polygon for c in chips(area, before))
        pieces = tuple(p for p in pieces if 2.0 * p.area > FILM * fine.tolerance * p.length)
        if pieces:
            out.append(ChipAreas(number, move, cutter, z, before, pieces))
    return out
