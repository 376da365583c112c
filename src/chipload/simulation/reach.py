"""Selection of the layers of a stock from which a step may remove material.

Notation: p tip, A unit axis, s distance along it from the tip, R greatest radius; a step as in
:mod:`chipload.simulation.steps`; h height of a layer's section; u a direction in the layer. Without what the axis turns
the points q = p(t) + s A, s_0 <= s <= top, fill a parallelogram, and the cutter stays within the balls of R around
them; what it turns, (A_1 - A_0) top / 2 at most, is added to R. The layer meets these balls in a convex figure whose
support is

    max over q of u . q + sqrt(R^2 - (z_q - h)^2),

of a concave function, hence on an edge of the parallelogram, there with m = u . d / d_z for its direction d at
z_q - h = R m / sqrt(1 + m^2), or as near to it as the edge goes. The polygon of these supports lies around the figure:
a layer whose stock it does not touch loses nothing. Stock only gets less, so that this is true whenever it is asked
before the step is cut.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.simulation.steps import Steps
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: directions in the layer
DIRECTIONS = 24
#: how much greater the figure is made [mm]: rounding of what is compared
ROUNDING = 1e-6

_ANGLE = np.arange(DIRECTIONS) * (math.tau / DIRECTIONS)
_U = np.column_stack([np.cos(_ANGLE), np.sin(_ANGLE)])


def reached_layers(
    steps: Steps, some: Sequence[int], layers: Sequence[Ints], cutter: Cutter, stock: LayeredStock
) -> list[Ints]:
    """Return for each of ``some`` steps those of its ``layers`` (numbers) from which it may remove material."""
    if not len(some):
        return []
    k = np.repeat(np.asarray(some), [len(rows) for rows in layers])
    layer = np.concatenate(layers)
    support = _support(steps, k, stock.heights[layer], cutter)
    nonempty = np.flatnonzero(np.isfinite(support).all(axis=1))
    touched = np.zeros(len(k), dtype=np.bool_)
    touched[nonempty] = _touches_layer(support[nonempty], layer[nonempty], stock)
    ends = np.cumsum([len(rows) for rows in layers])[:-1]
    return [rows[on] for rows, on in zip(layers, np.split(touched, ends), strict=True)]


def _support(steps: Steps, k: Ints, height: Floats, cutter: Cutter) -> Floats:
    """(n, DIRECTIONS) [mm]; -inf where the layer is not met."""
    top = cutter.flute_length
    r, bottom, taper = (0.0, 0.0, 1.0) if cutter.shape else (cutter.corner_radius, cutter.bottom, cutter.taper)
    R = max(cutter.radius, float(cutter.radius_at([top])[0]))
    low = min(r, top) if bottom == taper == 0.0 else 0.0
    a0, a1, p0, p1 = steps.a0[k], steps.a1[k], steps.p0[k], steps.p1[k]
    axis = 0.5 * (a0 + a1)
    ball = R + 0.5 * top * np.linalg.norm(a1 - a0, axis=1)
    corners = [p0 + low * axis, p1 + low * axis, p1 + top * axis, p0 + top * axis]
    out = np.full((len(k), DIRECTIONS), -np.inf)
    for a, b in itertools.pairwise([*corners, corners[0]]):
        d = b - a
        z = a[:, 2] - height
        first, last = np.minimum(z, z + d[:, 2]), np.maximum(z, z + d[:, 2])
        first, last = np.maximum(first, -ball), np.minimum(last, ball)
        along = d[:, :2] @ _U.T
        rises = np.abs(d[:, 2]) > 1e-12 * np.abs(d).max(axis=1).clip(1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            m = along / d[:, 2, None]
            best = np.clip(ball[:, None] * m / np.sqrt(1.0 + m * m), first[:, None], last[:, None])
            share = np.where(rises[:, None], (best - z[:, None]) / d[:, 2, None], along > 0.0).clip(0.0, 1.0)
            at = z[:, None] + share * d[:, 2, None]
            value = a[:, :2] @ _U.T + share * along + np.sqrt((ball[:, None] ** 2 - at**2).clip(0.0))
        out = np.where((first <= last)[:, None], np.maximum(out, value), out)
    return out + ROUNDING


def _touches_layer(support: Floats, layer: Ints, stock: LayeredStock) -> NDArray[np.bool_]:
    """Return whether the polygons of these supports touch the remaining stock of their layers."""
    after, u = np.roll(support, -1, axis=1), np.roll(_U, -1, axis=0)
    cross = math.sin(math.tau / DIRECTIONS)
    x = (support * u[:, 1] - after * _U[:, 1]) / cross
    y = (after * _U[:, 0] - support * u[:, 0]) / cross
    shapes = shapely.polygons(np.stack([x, y], axis=-1))
    both = ((stock.xs, x), (stock.ys, y))
    i0, j0 = (np.maximum(np.searchsorted(b, c.min(axis=1), "right") - 1, 0) for b, c in both)
    i1, j1 = (np.minimum(np.searchsorted(b, c.max(axis=1), "left"), len(b) - 1) for b, c in both)
    wide = np.maximum(i1 - i0, 0)
    count = wide * np.maximum(j1 - j0, 0)
    of = np.repeat(np.arange(len(support)), count)
    at = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    tiles = stock.tiles[layer[of], j0[of] + at // wide[of].clip(1), i0[of] + at % wide[of].clip(1)]
    out = np.zeros(len(support), dtype=np.bool_)
    out[of[shapely.intersects(tiles, shapes[of])]] = True
    return out
