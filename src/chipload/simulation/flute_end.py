"""Replacement of a cutter by one with longer flutes in steps whose flute end is in air: equal removal, less time.

Where the axis leans, a layer cuts through the end of the flutes, a plane, and the edge of the section has corners; what
the step covers is then bounded by more than two grazing curves and costs ten times as much
(:mod:`chipload.engagement.chips.covered`). A longer cutter covers what the cutter covers and what its further length
does. Where no material is in the way of that, both take the same.

Notation: p tip, A = (a, A_z) unit axis, s = |a|; H length of the flutes, w height above the tip along the axis, R
greatest radius of the longer cutter; h height of a layer's section. A point of the further length has w >= H, and w <=
(h - p_z + R s) / A_z in the layer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.engagement.chips.section import lengthen_flutes
from chipload.simulation.steps import Steps
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Tiles = NDArray[np.object_]

#: the longer cutter ends so far above the highest layer that is asked for [mm]
ABOVE = 1.0
#: most that a cutter is lengthened by, in radii
MOST = 20.0


def in_air(
    steps: Steps, layers: Mapping[int, range], K: Floats, stock: LayeredStock, tiles: Tiles, tolerance: float
) -> tuple[Floats, set[int]]:
    """The numbers of a longer cutter, and the steps that it stands for: those in which a layer meets the end of the
    flutes and no material is in the way of the further length.

    Parameters
    ----------
    layers : that each step may come to, at least one
    K : of :func:`chipload.engagement.chips.section.cutter_numbers`
    tiles : of the stock before all of these steps: less is left when they are cut, so that the answer holds then, and
        does not depend on when it is asked for
    tolerance : of the stock's edges [mm], by which they may grow
    """
    k = np.array([n for n, rows in layers.items() if min(steps.a0[n, 2], steps.a1[n, 2]) < 1.0], dtype=np.int64)
    if not len(k):
        return K, set()
    H, R = float(K[10]), float(K[11])
    highest = stock.heights[[layers[n].stop - 1 for n in k.tolist()]]
    p0, p1, a0, a1 = steps.p0[k], steps.p1[k], steps.a0[k], steps.a1[k]
    low, az = np.minimum(p0[:, 2], p1[:, 2]), np.minimum(a0[:, 2], a1[:, 2])
    s = np.sqrt(np.maximum(1.0 - az * az, 0.0))
    meets = highest > low + H * az - R * s
    # H A_z - (flank at w = 0 + H tan beta) s is the lowest point of the end over the tip
    rise = az - float(K[8]) * s
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = np.where(rise > 0.0, (highest + ABOVE - low + float(K[9]) * s) / rise, math.inf)
    k_of = np.flatnonzero(meets & (needed <= H + MOST * max(R, 1.0)))
    if not len(k_of):
        return K, set()
    longer = lengthen_flutes(K, float(needed[k_of].max()))
    return longer, _clear(steps, k[k_of], layers, (H, float(max(R, longer[11]))), stock, tiles, tolerance)


def _clear(
    steps: Steps,
    some: Ints,
    layers: Mapping[int, range],
    size: tuple[float, float],
    stock: LayeredStock,
    tiles: Tiles,
    tolerance: float,
) -> set[int]:
    """Those of ``some`` steps whose further length, of ``size`` (H, R), meets no material in any of their layers."""
    H, R = size
    row = np.concatenate([np.array(layers[n]) for n in some.tolist()])
    of = np.repeat(np.arange(len(some)), [len(layers[n]) for n in some.tolist()])
    k, h = some[of], stock.heights[row]
    p0, p1, a0, a1 = steps.p0[k], steps.p1[k], steps.a0[k], steps.a1[k]
    az = np.minimum(a0[:, 2], a1[:, 2])
    s = np.sqrt(np.maximum(1.0 - az * az, 0.0))
    far = (h - np.minimum(p0[:, 2], p1[:, 2]) + R * s) / az
    ask = np.flatnonzero(far >= H)
    if not len(ask):
        return set(some.tolist())
    p0, p1, a0, a1, far = p0[ask], p1[ask], a0[ask], a1[ask], far[ask, None]
    ends = np.array([p + w * a for p, a in ((p0, a0), (p1, a1)) for w in (H, far)])[..., :2]
    # the circle reaches R sqrt(1 - a_x^2) along x; between its ends the axis leaves its chord by its sagitta at most
    lean = np.sqrt(1.0 - np.minimum(np.abs(a0[:, :2]), np.abs(a1[:, :2])) ** 2)
    reach = R * lean + tolerance + (far + R) * np.linalg.norm(a1 - a0, axis=1)[:, None] ** 2
    hit = boxes_meet_stock(tiles, stock, row[ask], ends.min(axis=0) - reach, ends.max(axis=0) + reach)
    return set(some.tolist()) - set(k[ask[hit]].tolist())


def boxes_meet_stock(tiles: Tiles, stock: LayeredStock, layer: Ints, low: Floats, high: Floats) -> NDArray[np.bool_]:
    """Return whether boxes (n, 2), (n, 2), each in its layer, meet the remaining stock there.

    Parameters
    ----------
    tiles : of the stock, as they are or as they were
    """
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    i0, j0 = np.searchsorted(stock.xs, low[:, 0], "right"), np.searchsorted(stock.ys, low[:, 1], "right")
    i1, j1 = np.searchsorted(stock.xs, high[:, 0], "left"), np.searchsorted(stock.ys, high[:, 1], "left")
    i0, j0 = np.maximum(i0 - 1, 0), np.maximum(j0 - 1, 0)
    i1, j1 = np.minimum(i1, len(stock.xs) - 1), np.minimum(j1, len(stock.ys) - 1)
    out = np.zeros(len(layer), dtype=np.bool_)
    for dj in range(int((j1 - j0).max(initial=0))):
        for di in range(int((i1 - i0).max(initial=0))):
            ask = np.flatnonzero(~out & (j0 + dj < j1) & (i0 + di < i1))
            out[ask] = shapely.intersects(boxes[ask], tiles[layer[ask], j0[ask] + dj, i0[ask] + di])
    return out
