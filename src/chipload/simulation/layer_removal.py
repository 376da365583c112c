"""Removal of each step from the layers, and its tooth engagement in the middle of the step.

Notation: as in :mod:`chipload.simulation.chips`.
"""

from __future__ import annotations

import math
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.move import Move
from chipload.engagement.immersion.immersion import Section
from chipload.simulation.loads import StepEngagement, engagement_of_step
from chipload.simulation.removal import RunSettings
from chipload.simulation.shank import AROUND
from chipload.simulation.steps import Steps
from chipload.simulation.swept_area import TOGETHER, swept_ahead
from chipload.stock.layers import LayeredStock
from chipload.stock.tile_rings import TileRings

#: a piece of a chip narrower than so many tolerances is a film left by chords, no piece
FILM = 4.0


def removed_by_layers(
    steps: Steps, stock: LayeredStock, setting: RunSettings
) -> tuple[NDArray[np.float64], list[StepEngagement]]:
    """Remove some steps from the stock.

    Returns
    -------
    (n, 4) volume [mm^3], pieces and layers of each chip, length of the shank in material [mm]; tooth engagement of the
    steps that cut
    """
    thickness, tolerance = stock.thickness, setting.resolution.tolerance
    removed = np.zeros((len(steps), 4))
    cutting: list[tuple[int, Move, Section]] = []
    waiting: list[Future[list[StepEngagement]]] = []

    def engage_steps(those: list[tuple[int, Move, Section]]) -> list[StepEngagement]:
        tools = [int(steps.tool[k]) for k, _, _ in those]
        return [
            engagement_of_step(steps, k, move, setting.cutters[n], setting.profiles[n], there, tolerance)
            for n, (k, move, there) in zip(tools, those, strict=True)
        ]

    tiles = TileRings(stock)
    with ThreadPoolExecutor(1) as executor:
        for k, swept in swept_ahead(steps, stock, setting.cutters, tolerance, setting.workers):
            # a point below the lowest section of the box is held against the section below it
            layers = range(max(swept.layers.start - 1, 0), min(swept.layers.stop + 1, stock.layers))
            there = Section(*tiles.edges(layers, swept.low[:2], swept.high[:2]))
            # from 0, so that what the step gains does not depend on what was gained before it
            tidied, stock.tidied = stock.tidied, 0.0
            removal = tiles.remove(swept.met, swept.shape, swept.areas, FILM * tolerance, 0.5 * tolerance)
            gained, stock.tidied = stock.tidied, tidied + stock.tidied
            most = int(removal.parts.max())
            # exact, so that layers that lose nothing do not change how it is rounded
            removed[k, 0] = math.fsum((removal.area * thickness[swept.met]).tolist()) - gained
            removed[k, 1:3] = most, np.count_nonzero(removal.area)
            if most:
                cutter = setting.cutters[int(steps.tool[k])]
                removed[k, 3] = _axial_overrun(tiles, cutter, steps.p1[k], steps.a1[k], FILM * tolerance)
            # what is thinner than the tolerance can tell is no cut
            if most and not steps.rapid[k]:
                cutting.append((k, swept.move, there))
            if len(cutting) == TOGETHER:
                waiting.append(executor.submit(engage_steps, cutting))
                cutting = []
        waiting.append(executor.submit(engage_steps, cutting))
        tiles.finish()
        return removed, [engaged for several in waiting for engaged in several.result()]


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
