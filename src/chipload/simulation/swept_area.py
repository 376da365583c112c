"""Area of each layer that each step covers, calculated ahead of the removal: it does not depend on the stock.

Notation: a step as in :mod:`chipload.simulation.steps`; a layer is known by its section at half its height.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.covered import covered_rings
from chipload.engagement.chips.move import LEAST_AXIS_Z, Move
from chipload.engagement.chips.section import cutter_numbers
from chipload.errors import InputError
from chipload.simulation.flute_end import Tiles, boxes_meet_stock, in_air
from chipload.simulation.reach import reached_layers
from chipload.simulation.steps import Steps, step_boxes
from chipload.stock.areas import PlaneAreas
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: x0, y0, x1, y1 [mm]
Plan = tuple[float, float, float, float]
#: a step, the layers in its box, which of them still have material in its way
Met = tuple[Move, range, NDArray[np.bool_]]
#: steps whose areas are found in one go
TOGETHER = 16


@dataclass(frozen=True, eq=False)
class Swept:
    """Area that a step covers: its bounding box, the layers in it, and the layers that it meets with their areas.

    Parameters
    ----------
    met, shape : (e,) int, layers, and which of ``areas`` the step covers of each
    """

    move: Move
    low: Floats
    high: Floats
    layers: range
    met: Ints
    shape: Ints
    areas: PlaneAreas


def swept_ahead(
    steps: Steps,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    tolerance: float,
    workers: int,
) -> Iterator[tuple[int, Swept]]:
    """Those steps that meet a layer, in their order; found in threads that run ahead of the caller.

    Raises
    ------
    InputError
        Beside or in the stock the axis lies, or looks down.
    """
    low, high, near = near_stock(steps, plan_of(stock), cutters)
    before = stock.tiles.copy()

    def swept(part: range) -> list[tuple[int, Swept]]:
        found: dict[int, Met] = {}
        ranges = {k: stock.layers_between(low[k, 2], high[k, 2]) for k in part if near[k]}
        ranges = {k: layers for k, layers in ranges.items() if layers}
        profiles = list(_profiles(steps, ranges, cutters, stock, before, tolerance))
        for k, left in _layers_left(steps, ranges, low, high, cutters, stock).items():
            # an axis that lies is refused in air too
            if left.any() or min(steps.a0[k, 2], steps.a1[k, 2]) < 2.0 * LEAST_AXIS_Z:
                found[k] = _move(steps, k), ranges[k], left
        out: dict[int, Swept] = {}
        for tool, K, those in profiles:
            own = {k: both for k, both in found.items() if k in those}
            areas = _covered_layers(steps, own, cutters[tool], K, stock, tolerance) if own else []
            for (k, (move, layers, _)), (which, shape, of) in zip(own.items(), areas, strict=True):
                out[k] = Swept(move, low[k], high[k], layers, which, shape, of)
        return sorted(out.items())

    parts = [range(i, min(i + TOGETHER, len(steps))) for i in range(0, len(steps), TOGETHER)]
    with ThreadPoolExecutor(workers) as pool:
        for several in pool.map(swept, parts):
            for k, found in several:
                if len(found.met):
                    yield k, found


def plan_of(stock: LayeredStock) -> Plan:
    """Return x0, y0, x1, y1 of a stock [mm]."""
    return float(stock.xs[0]), float(stock.ys[0]), float(stock.xs[-1]), float(stock.ys[-1])


def near_stock(steps: Steps, plan: Plan, cutters: Mapping[int, Cutter]) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Boxes of the steps, and which of them come over, into or under the plan of the stock."""
    low, high = step_boxes(steps, cutters)
    near = (high[:, 0] >= plan[0]) & (low[:, 0] <= plan[2])
    near &= (high[:, 1] >= plan[1]) & (low[:, 1] <= plan[3])
    near &= ~np.isin(steps.tool, [n for n, c in cutters.items() if c.body])
    return low, high, near


def _layers_left(
    steps: Steps,
    ranges: Mapping[int, range],
    low: Floats,
    high: Floats,
    cutters: Mapping[int, Cutter],
    stock: LayeredStock,
) -> dict[int, NDArray[np.bool_]]:
    """Which layers of each step still have material where the cutter may come in them: in its box, and where it leans
    in the figure of :mod:`chipload.simulation.reach`.

    Asked ahead of the removal, so that more may be there than when the step comes, never less.
    """
    if not ranges:
        return {}
    of = list(ranges)
    counts = [len(layers) for layers in ranges.values()]
    step, layer = np.repeat(of, counts), np.concatenate([np.array(r) for r in ranges.values()])
    left = boxes_meet_stock(stock.tiles, stock, layer, low[step, :2], high[step, :2])
    out = dict(zip(of, np.split(left, np.cumsum(counts)[:-1]), strict=True))
    for tool in np.unique(steps.tool[of]).tolist():
        lean = [k for k in of if steps.tool[k] == tool and out[k].any() and min(steps.a0[k, 2], steps.a1[k, 2]) < 1.0]
        candidates = [np.array(ranges[k])[out[k]] for k in lean]
        for k, near in zip(lean, reached_layers(steps, lean, candidates, cutters[tool], stock), strict=True):
            out[k] = np.isin(ranges[k], near)
    return out


def _profiles(
    steps: Steps,
    ranges: Mapping[int, range],
    cutters: Mapping[int, Cutter],
    stock: LayeredStock,
    before: Tiles,
    tolerance: float,
) -> Iterator[tuple[int, Floats, set[int]]]:
    """Each tool with the numbers of its cutter, or of a longer one (:mod:`chipload.simulation.flute_end`), and the
    steps that these stand for.

    Parameters
    ----------
    before : tiles of the stock before all steps of the block
    """
    for tool in sorted({int(steps.tool[k]) for k in ranges}):
        own = {k: layers for k, layers in ranges.items() if steps.tool[k] == tool}
        K = cutter_numbers(cutters[tool])
        longer, those = in_air(steps, own, K, stock, before, tolerance)
        yield tool, K, own.keys() - those
        yield tool, longer, those


def _covered_layers(
    steps: Steps, own: Mapping[int, Met], cutter: Cutter, K: Floats, stock: LayeredStock, tolerance: float
) -> list[tuple[Ints, Ints, PlaneAreas]]:
    """Return the layers that steps cover and their areas; layers that an upright flank crosses share one."""
    heights = stock.heights
    section_heights: list[Floats] = []
    of: list[Ints] = []
    for k, (_, layers, left) in own.items():
        z = heights[layers.start : layers.stop]
        flank = _flank(steps, k, cutter, z)
        alone = left & ~flank
        section_heights.append(z[alone])
        rows = np.cumsum(alone) - 1
        if (left & flank).any():
            # the last one asked for stands for all that the flank crosses; which are left does not choose its height
            section_heights[-1] = np.append(section_heights[-1], z[flank][0])
            rows[flank] = len(section_heights[-1]) - 1
        of.append(np.where(left, rows, -1))
    areas = covered_rings([move for move, _, _ in own.values()], K, section_heights, tolerance)
    some = np.append(areas.first[:, 1] > areas.first[:, 0], False)
    out = list[tuple[Ints, Ints, PlaneAreas]]()
    before = 0
    for (_, layers, _), rows, own_heights in zip(own.values(), of, section_heights, strict=True):
        shape = np.where(rows >= 0, rows + before, -1)
        there = some[shape]
        out.append((np.arange(layers.start, layers.stop)[there], shape[there], areas))
        before += len(own_heights)
    return out


def _flank(steps: Steps, k: int, cutter: Cutter, heights: Floats) -> NDArray[np.bool_]:
    """Which layers only the flank of an upright cylinder crosses, in all of the step."""
    if cutter.shape or not (steps.a0[k, 2] == steps.a1[k, 2] == 1.0 and cutter.taper == 0.0):
        return np.zeros(len(heights), dtype=np.bool_)
    _, r, _, f, _, _, top = cutter.apt
    low, high = sorted((steps.p0[k, 2], steps.p1[k, 2]))
    foot = f if r > 0.0 else cutter.radius * math.tan(cutter.bottom)
    if cutter.flank_arc is not None:
        foot = cutter.flank_arc.z_to
    return np.asarray((heights > high + foot) & (heights < low + top))


def _move(steps: Steps, k: int) -> Move:
    if steps.a0[k, 2] == steps.a1[k, 2] == 1.0:
        return Move.upright(steps.p0[k], steps.p1[k])
    try:
        return Move.slerp(steps.p0[k], steps.a0[k], steps.p1[k], steps.a1[k])
    except InputError as err:
        raise InputError(f"line {steps.line[k]}: {err}") from None
