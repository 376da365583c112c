"""What each step covers of each layer: found ahead of the removal, for it does not depend on the stock.

Notation: a step as in :mod:`chipload.simulation.steps`; a layer is known by its section at half its height.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.covered import covered_polygons
from chipload.engagement.chips.move import Move
from chipload.errors import InputError
from chipload.simulation.reach import reached
from chipload.simulation.steps import Steps
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
Interpolation = Literal["slerp", "lerp"]

#: steps whose areas are found in one go
TOGETHER = 16


@dataclass(frozen=True, eq=False)
class Swept:
    """What a step covers: the box that it does not leave, the layers in it, those met with their areas."""

    move: Move
    low: Floats
    high: Floats
    layers: range
    met: list[tuple[int, Polygon | MultiPolygon]]


def swept_ahead(
    steps: Steps,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    interpolation: Interpolation,
    tolerance: float,
    workers: int,
) -> Iterator[tuple[int, Swept]]:
    """Those steps that meet a layer, in their order; found in threads that run ahead of the caller.

    Raises
    ------
    InputError
        Beside or in the stock the axis lies, or looks down.
    """
    low, high = _boxes(steps, cutters)
    near = (high[:, 0] >= stock.xs[0]) & (low[:, 0] <= stock.xs[-1])
    near &= (high[:, 1] >= stock.ys[0]) & (low[:, 1] <= stock.ys[-1])

    def swept(part: range) -> list[tuple[int, Swept]]:
        found: dict[int, tuple[Move, range]] = {}
        for k in part:
            layers = stock.layers_between(low[k, 2], high[k, 2]) if near[k] else range(0)
            if layers:
                try:
                    found[k] = _move(steps, k, interpolation), layers
                except InputError as err:
                    raise InputError(f"line {steps.line[k]}: {err}") from None
        out: dict[int, Swept] = {}
        for tool in sorted({int(steps.tool[k]) for k in found}):
            own = {k: both for k, both in found.items() if steps.tool[k] == tool}
            for (k, (move, layers)), met in zip(
                own.items(), _covered(steps, own, cutters[tool], stock, tolerance), strict=True
            ):
                out[k] = Swept(move, low[k], high[k], layers, met)
        return sorted(out.items())

    parts = [range(i, min(i + TOGETHER, len(steps))) for i in range(0, len(steps), TOGETHER)]
    with ThreadPoolExecutor(workers) as pool:
        for several in pool.map(swept, parts):
            for k, found in several:
                if found.met:
                    yield k, found


def _covered(
    steps: Steps, own: Mapping[int, tuple[Move, range]], cutter: Cutter, stock: LayeredStock, tolerance: float
) -> list[list[tuple[int, Polygon | MultiPolygon]]]:
    """What steps cover of each layer that they meet; layers that an upright flank crosses share one polygon."""
    heights = stock.heights
    asked: list[Floats] = []
    of: list[NDArray[np.int64]] = []
    near = _near(steps, own, cutter, stock)
    for k, layers in near.items():
        z = heights[layers]
        rows = np.arange(len(z))
        flank = _flank(steps, k, cutter, z)
        if flank.any():
            # the last one asked for stands for all that the flank crosses
            shared = int(np.flatnonzero(~flank).size)
            asked.append(np.append(z[~flank], z[flank][0]))
            rows[~flank], rows[flank] = np.arange(shared), shared
        else:
            asked.append(z)
        of.append(rows)
    shapes = covered_polygons([move for move, _ in own.values()], cutter, asked, tolerance)
    return [
        [(i, shape) for i, n in zip(layers.tolist(), rows.tolist(), strict=True) if (shape := found[n]) is not None]
        for layers, rows, found in zip(near.values(), of, shapes, strict=True)
    ]


def _near(
    steps: Steps, own: Mapping[int, tuple[Move, range]], cutter: Cutter, stock: LayeredStock
) -> dict[int, NDArray[np.int64]]:
    """Layers that steps may take anything from; of upright cutters, whose layers cost little, all that they reach."""
    out = {k: np.arange(layers.start, layers.stop) for k, (_, layers) in own.items()}
    leaning = [k for k in own if min(steps.a0[k, 2], steps.a1[k, 2]) < 1.0]
    return out | dict(zip(leaning, reached(steps, leaning, [out[k] for k in leaning], cutter, stock), strict=True))


def _flank(steps: Steps, k: int, cutter: Cutter, heights: Floats) -> NDArray[np.bool_]:
    """Which layers only the flank of an upright cylinder crosses, in all of the step."""
    if not (steps.a0[k, 2] == steps.a1[k, 2] == 1.0 and cutter.taper == 0.0):
        return np.zeros(len(heights), dtype=np.bool_)
    _, r, _, f, _, _, top = cutter.apt
    low, high = sorted((steps.p0[k, 2], steps.p1[k, 2]))
    return np.asarray(
        (heights > high + (f if r > 0.0 else cutter.radius * math.tan(cutter.bottom))) & (heights < low + top)
    )


def _boxes(steps: Steps, cutters: Mapping[int, Cutter]) -> tuple[Floats, Floats]:
    """(n, 3), (n, 3) corners of boxes that the cutter does not leave, as the axis turns by a few degrees in a step."""
    p0, p1, a0, a1, tools = steps.p0, steps.p1, steps.a0, steps.a1, steps.tool
    top, wide = np.empty((len(steps), 1)), np.empty((len(steps), 1))
    for tool in np.unique(tools).tolist():
        c = cutters[tool]
        top[tools == tool] = c.flute_length
        wide[tools == tool] = max(c.radius, float(c.radius_at([c.flute_length])[0]))
    ends = np.array([p0, p1, p0 + top * a0, p1 + top * a1])
    # the top of the cutter leaves its chord by the sagitta of the turn, and each circle reaches R across the axis
    turn = np.linalg.norm(a1 - a0, axis=1)[:, None]
    lean = np.sqrt(np.maximum(1.0 - np.minimum(a0, a1) ** 2, 1.0 - np.maximum(a0, a1) ** 2))
    reach = wide * np.minimum(lean + turn, 1.0) + top * turn**2
    return np.asarray(ends.min(axis=0) - reach), np.asarray(ends.max(axis=0) + reach)


def _move(steps: Steps, k: int, interpolation: Interpolation) -> Move:
    make = Move.slerp if interpolation == "slerp" else Move.lerp
    return make(steps.p0[k], steps.a0[k], steps.p1[k], steps.a1[k])
