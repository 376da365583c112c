"""Removal of each step from the layers, and its tooth engagement in the middle of the step.

Notation: as in :mod:`chipload.simulation.chips`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon, box

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.move import Move
from chipload.engagement.immersion.immersion import Section
from chipload.simulation.loads import StepEngagement, engagement_of_step
from chipload.simulation.removal import ChipAreas, RunSettings, TakenByLayers
from chipload.simulation.shank import AROUND
from chipload.simulation.steps import Steps
from chipload.simulation.swept_area import TOGETHER, Plan, Swept, swept_ahead
from chipload.stock.layers import LayeredStock
from chipload.stock.tile_grid import polygons
from chipload.stock.tile_rings import Taken, TileRings

#: a piece of a chip narrower than so many tolerances is a film left by chords, no piece
FILM = 4.0
#: two chips are equally shared out within this
EQUAL = 1e-9


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
    thickness, tolerance = stock.thickness, setting.resolution.tolerance
    rank = rank_of(best.chips) if best is not None else (0, 0.0)
    removed, gained = np.zeros((len(steps), 4)), np.zeros(len(steps))
    cutting: list[tuple[int, Move, Section]] = []
    waiting: list[Future[list[StepEngagement]]] = []

    def engage_steps(those: list[tuple[int, Move, Section]]) -> list[StepEngagement]:
        tools = [int(steps.tool[k]) for k, _, _ in those]
        return [
            engagement_of_step(steps, k, move, setting.cutters[n], setting.profiles[n], there, tolerance)
            for n, (k, move, there) in zip(tools, those, strict=True)
        ]

    ahead = swept_ahead(steps, stock, setting.cutters, tolerance, setting.workers, plan)
    tiles = TileRings(stock)
    with ThreadPoolExecutor(1) as executor:
        for k, swept in ahead:
            if own is not None and not own[k]:
                tiles.remove(swept.met, swept.shape, swept.areas, FILM * tolerance, 0.5 * tolerance)
                continue
            # a point below the lowest section of the box is held against the section below it
            layers = range(max(swept.layers.start - 1, 0), min(swept.layers.stop + 1, stock.layers))
            there = Section(*tiles.edges(layers, swept.low[:2], swept.high[:2]))
            # from 0, so that what the step gains does not depend on what was gained before it
            tidied, stock.tidied = stock.tidied, 0.0
            removal = tiles.remove(swept.met, swept.shape, swept.areas, FILM * tolerance, 0.5 * tolerance)
            gained[k], stock.tidied = stock.tidied, tidied + stock.tidied
            most = int(removal.parts.max())
            # exact, so that layers that lose nothing do not change how it is rounded
            removed[k, 0] = math.fsum((removal.area * thickness[swept.met]).tolist()) - float(gained[k])
            removed[k, 1:3] = most, np.count_nonzero(removal.area)
            if most:
                cutter = setting.cutters[int(steps.tool[k])]
                found = _most_parts(tiles, removal, swept, rank, first + k, cutter, FILM * tolerance)
                if found is not None:
                    best, rank = found, rank_of(found.chips)
                removed[k, 3] = _axial_overrun(tiles, cutter, steps.p1[k], steps.a1[k], FILM * tolerance)
            # what is thinner than the tolerance can tell is no cut
            if most and not steps.rapid[k]:
                cutting.append((k, swept.move, there))
            if len(cutting) == TOGETHER:
                waiting.append(executor.submit(engage_steps, cutting))
                cutting = []
        waiting.append(executor.submit(engage_steps, cutting))
        tiles.finish()
        return TakenByLayers(removed, gained, [engaged for several in waiting for engaged in several.result()], best)


def rank_of(whole: Sequence[Polygon]) -> tuple[int, float]:
    """Return the rank of a chip: the number of its pieces, then how equal they are."""
    areas = [p.area for p in whole]
    return len(areas), min(areas) / sum(areas) if areas else 0.0


def _most_parts(
    tiles: TileRings, removal: Taken, swept: Swept, rank: tuple[int, float], step: int, cutter: Cutter, film: float
) -> ChipAreas | None:
    """The chip of a step with a higher rank than ``rank``, the highest of its layers; None: it has none."""
    best = None
    share = removal.least / np.where(removal.parts > 0, removal.whole, 1.0)
    for e in np.flatnonzero(
        (removal.parts > rank[0]) | ((removal.parts == rank[0]) & (share > rank[1] + EQUAL))
    ).tolist():
        pieces = tiles.parts_of(e)
        whole = [p for p in pieces if 2.0 * p.area > film * p.length]
        if rank_of(whole) > rank:
            rank, i = rank_of(whole), int(swept.met[e])
            low, high = swept.low[:2], swept.high[:2]
            near = polygons(tiles.section(i, low, high).union(MultiPolygon(pieces)).intersection(box(*low, *high)))
            z = float(tiles.stock.heights[i])
            best = ChipAreas(step, swept.move, cutter, z, MultiPolygon(near), tuple(whole))
    return best


def _axial_overrun(
    tiles: TileRings, cutter: Cutter, tip: NDArray[np.float64], axis: NDArray[np.float64], margin: float
) -> float:
    """Return the length of the shank in material, from the end of the flutes upwards [mm]; 0 if none.

    Parameters
    ----------
    tiles : of the stock, as they are
    tip, axis : (3,) where the cutter is [mm], and its axis, unit
    margin : what the shank may touch [mm]
    """
    stock = tiles.stock
    shank = cutter.diameter if cutter.shank_diameter is None else cutter.shank_diameter
    radius = 0.5 * shank - margin
    low = float(tip[2] + cutter.flute_length * axis[2])
    lean = radius * math.sqrt(max(1.0 - float(axis[2]) ** 2, 0.0))
    first = int(np.searchsorted(stock.heights, low - lean))
    if radius <= 0.0 or first >= stock.layers:
        return 0.0
    turn = np.arange(AROUND) * (math.tau / AROUND)
    across = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    ring = radius * (np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across))
    ring = np.vstack([np.zeros(3), 0.5 * ring, ring])
    height, step = cutter.flute_length, float(stock.thickness[first])
    # the lowest section above the flutes decides where an upright cutter begins
    offset = float(stock.heights[first] - low) if lean < 1e-9 else 0.5 * step
    found = 0.0
    while height + offset < cutter.overhang and tiles.holds(tip + (height + offset) * axis + ring):
        height += step
        found = height - cutter.flute_length
    return found
