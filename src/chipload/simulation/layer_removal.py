"""Removal of each step from the layers, and its tooth engagement in the middle of the step.

Notation: as in :mod:`chipload.simulation.chips`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon, box

from chipload.engagement.chips.move import Move
from chipload.engagement.immersion.immersion import Section
from chipload.simulation.loads import StepEngagement, engagement_of_step
from chipload.simulation.removal import ChipAreas, RunSettings, TakenByLayers
from chipload.simulation.shank import axial_overrun
from chipload.simulation.steps import Steps
from chipload.simulation.swept_area import TOGETHER, Plan, swept_ahead
from chipload.stock.layers import LayeredStock
from chipload.stock.tile_grid import polygons

#: a piece of a chip narrower than so many tolerances is a film left by chords, no piece
FILM = 4.0


def removed_by_layers(
    steps: Steps,
    stock: LayeredStock,
    first: int,
    setting: RunSettings,
    best: ChipAreas | None = None,
    own: NDArray[np.bool_] | None = None,
    plan: Plan | None = None,
) -> TakenByLayers:
    """Remove some steps from the stock.

    Parameters
    ----------
    first : number of the first step
    best : the chip of most pieces so far
    own : (n,) steps whose chip and tooth engagement is asked for; the others are only removed. None: all
    plan : x and y of the whole stock [mm], where ``stock`` is a strip of it; see :mod:`chipload.simulation.strips`
    """
    thickness, tolerance = stock.thickness.tolist(), setting.resolution.tolerance
    rank = rank_of(best.chips) if best is not None else (0, 0.0)
    removed, gained = np.zeros((len(steps), 4)), np.zeros(len(steps))
    cutting: list[tuple[int, Move, Section]] = []
    waiting: list[Future[list[StepEngagement]]] = []

    def engaged(those: list[tuple[int, Move, Section]]) -> list[StepEngagement]:
        tools = [int(steps.tool[k]) for k, _, _ in those]
        return [
            engagement_of_step(steps, k, move, setting.cutters[n], setting.profiles[n], there, tolerance)
            for n, (k, move, there) in zip(tools, those, strict=True)
        ]

    ahead = swept_ahead(steps, stock, setting.cutters, setting.interpolation, tolerance, setting.workers, plan)
    with ThreadPoolExecutor(1) as beside:
        for k, swept in ahead:
            met, low, high = swept.met, swept.low[:2], swept.high[:2]
            shapes = [shape for _, shape in met]
            if own is not None and not own[k]:
                stock.remove_many([i for i, _ in met], shapes, 0.5 * tolerance)
                continue
            # a point below the lowest section of the box is held against the section below it
            layers = range(max(swept.layers.start - 1, 0), min(swept.layers.stop + 1, stock.layers))
            there = Section(*stock.edges(layers, low, high))
            # from 0, so that what the step gains does not depend on what was gained before it
            tidied, stock.tidied = stock.tidied, 0.0
            taken = stock.remove_many([i for i, _ in met], shapes, 0.5 * tolerance)
            gained[k], stock.tidied = stock.tidied, tidied + stock.tidied
            volume, most, lost = 0.0 - float(gained[k]), 0, 0
            for i, pieces, area, whole in _chips(met, taken, tolerance):
                volume, lost, most = volume + area * thickness[i], lost + 1, max(most, len(whole))
                if whole and rank < (len(whole), 1.0 / len(whole)) and rank_of(whole) > rank:
                    rank = rank_of(whole)
                    near = polygons(
                        stock.section(i, low, high).union(MultiPolygon(pieces)).intersection(box(*low, *high))
                    )
                    cutter, z = setting.cutters[int(steps.tool[k])], float(stock.heights[i])
                    best = ChipAreas(first + k, swept.move, cutter, z, MultiPolygon(near), tuple(whole))
            removed[k, :3] = volume, most, lost
            if most:
                cutter = setting.cutters[int(steps.tool[k])]
                removed[k, 3] = axial_overrun(stock, cutter, steps.p1[k], steps.a1[k], FILM * tolerance)
            # what is thinner than the tolerance can tell is no cut
            if most and not steps.rapid[k]:
                cutting.append((k, swept.move, there))
            if len(cutting) == TOGETHER:
                waiting.append(beside.submit(engaged, cutting))
                cutting = []
        waiting.append(beside.submit(engaged, cutting))
        return TakenByLayers(removed, gained, [bite for several in waiting for bite in several.result()], best)


def rank_of(whole: Sequence[Polygon]) -> tuple[int, float]:
    """Return the rank of a chip: the number of its pieces, then how equal they are."""
    areas = [p.area for p in whole]
    return len(areas), min(areas) / sum(areas) if areas else 0.0


def _chips(
    met: list[tuple[int, Polygon | MultiPolygon]], taken: list[list[Polygon]], tolerance: float
) -> Iterator[tuple[int, list[Polygon], float, list[Polygon]]]:
    """Of each layer that lost something: its number, the pieces, their area, those that are more than films."""
    flat = [p for pieces in taken for p in pieces]
    area = shapely.area(flat)
    film = (2.0 * area <= FILM * tolerance * shapely.length(flat)).tolist()
    at = 0
    for (i, _), pieces in zip(met, taken, strict=True):
        if pieces:
            a, b = at, at + len(pieces)
            whole = [p for p, thin in zip(pieces, film[a:b], strict=True) if not thin]
            yield i, pieces, float(area[a] if b - a == 1 else area[a:b].sum()), whole
            at = b
