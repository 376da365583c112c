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
from chipload.engagement.chips.covered import covered_areas
from chipload.engagement.chips.move import Move
from chipload.errors import InputError
from chipload.simulation.steps import Steps
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
Interpolation = Literal["slerp", "lerp"]


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
    some: range,
    stock: LayeredStock,
    cutters: Mapping[int, Cutter],
    interpolation: Interpolation,
    tolerance: float,
) -> Iterator[tuple[int, Swept]]:
    """Those of ``some`` steps that meet a layer, in their order; found in threads that run ahead of the caller.

    Raises
    ------
    InputError
        Beside or in the stock the axis lies, or looks down.
    """

    def swept(k: int) -> Swept | None:
        cutter = cutters[int(steps.tool[k])]
        low, high = _box(steps, k, cutter)
        layers = stock.layers_between(low[2], high[2])
        beside = high[0] < stock.xs[0] or low[0] > stock.xs[-1] or high[1] < stock.ys[0] or low[1] > stock.ys[-1]
        if beside or not layers:
            return None
        try:
            move = _move(steps, k, interpolation)
        except InputError as err:
            raise InputError(f"line {steps.line[k]}: {err}") from None
        return Swept(move, low, high, layers, _covered(steps, k, move, cutter, stock, layers, tolerance))

    with ThreadPoolExecutor(2) as pool:
        for k, found in zip(some, pool.map(swept, some), strict=True):
            if found is not None and found.met:
                yield k, found


def _covered(
    steps: Steps, k: int, move: Move, cutter: Cutter, stock: LayeredStock, layers: range, tolerance: float
) -> list[tuple[int, Polygon | MultiPolygon]]:
    """What a step covers of each layer that it meets; layers that an upright flank crosses share one polygon."""
    heights = stock.heights[layers.start : layers.stop]
    shared = np.zeros(len(heights), dtype=np.bool_)
    if steps.a0[k, 2] == steps.a1[k, 2] == 1.0 and cutter.taper == 0.0:
        _, r, _, f, _, _, top = cutter.apt
        low, high = sorted((steps.p0[k, 2], steps.p1[k, 2]))
        shared = (heights > high + (f if r > 0.0 else cutter.radius * math.tan(cutter.bottom))) & (heights < low + top)
    own = np.flatnonzero(~shared)
    if shared.any():
        own = np.append(own, np.flatnonzero(shared)[0])
    shapes = {int(own[n]): a for n, a in enumerate(covered_areas(move, cutter, heights[own], tolerance))}
    common = shapes[int(own[-1])] if shared.any() else None
    flank = common.polygon if common is not None else None
    out = []
    for n, i in enumerate(layers):
        area = shapes.get(n)
        if shared[n]:
            out.append((i, flank))
        elif area is not None:
            out.append((i, area.polygon))
    return [(i, shape) for i, shape in out if shape is not None]


def _box(steps: Steps, k: int, cutter: Cutter) -> tuple[Floats, Floats]:
    """(3,), (3,) corners of a box that the cutter does not leave during a step, as the axis turns by a few degrees."""
    top = cutter.flute_length
    wide = max(cutter.radius, float(cutter.radius_at([top])[0]))
    ends = np.array([steps.p0[k], steps.p1[k], steps.p0[k] + top * steps.a0[k], steps.p1[k] + top * steps.a1[k]])
    # the top of the cutter leaves its chord by the sagitta of the turn, and each circle reaches R across the axis
    axes = np.array([steps.a0[k], steps.a1[k]])
    turn = float(np.linalg.norm(axes[1] - axes[0]))
    reach = wide * np.minimum(np.sqrt(np.maximum(1.0 - axes.min(axis=0) ** 2, 1.0 - axes.max(axis=0) ** 2)) + turn, 1.0)
    reach = reach + top * turn**2
    return ends.min(axis=0) - reach, ends.max(axis=0) + reach


def _move(steps: Steps, k: int, interpolation: Interpolation) -> Move:
    make = Move.slerp if interpolation == "slerp" else Move.lerp
    return make(steps.p0[k], steps.a0[k], steps.p1[k], steps.a1[k])
