"""Layered stock of a tube or a cone: rings about Z, with an outer edge that may be eccentric and have bosses.

Notation: r_i(z), r_o(z) [mm] inner and outer radius of a layer at half its height z; c (2,) [mm] centre of the outer
edge; a boss is the sector between two angles, counter-clockwise from +X, out to r_o + b.

A circle is a polygon with its 512 corners on the circle; at a radius of 25 mm the error is below 0.5 um.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Point, Polygon, box

from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from chipload.stock.tile_grid import polygons

Floats = NDArray[np.float64]

#: corners of a quarter circle
QUARTER = 128
#: room around the stock [mm]
ROOM = 1.0


@dataclass(frozen=True)
class Boss:
    """Boss of height ``radial`` [mm] from the angle ``begin`` to ``end`` [rad], begin < end."""

    begin: float
    end: float
    radial: float


def ring_stock(
    bounds: Floats,
    inner: Callable[[Floats], Floats],
    outer: Callable[[Floats], Floats],
    centre: tuple[float, float] = (0.0, 0.0),
    bosses: Sequence[Boss] = (),
    tile_mm: float = 40.0,
) -> LayeredStock:
    """Return a stock of layers of rings.

    Parameters
    ----------
    bounds : (n + 1,) float [mm], ascending heights of the bounds of the layers
    inner, outer : r_i and r_o as functions of the height [mm], both about Z
    centre : c; the inner edge remains centred on Z
    bosses : on the outer edge
    tile_mm : longest side of a tile

    Raises
    ------
    InputError
        A ring has no width at some angle.

    Examples
    --------
    A tube from 9 to 10 mm radius, 2 mm high: 2 pi (100 - 81) mm^3, except for the error of the chords.

    >>> tube = ring_stock(np.array([0.0, 2.0]), lambda z: 0 * z + 9.0, lambda z: 0 * z + 10.0)
    >>> round(tube.volume() / (2.0 * math.pi * 19.0), 4)
    1.0
    """
    bounds = np.asarray(bounds, dtype=np.float64)
    heights = 0.5 * (bounds[:-1] + bounds[1:])
    low, high = inner(heights), outer(heights)
    off = math.hypot(*centre)
    if (high - off <= low).any() or (low <= 0.0).any():
        k = int(np.argmin(high - low))
        raise InputError(
            f"stock: at z = {heights[k]:g} mm a ring from {low[k]:g} to {high[k]:g} mm, {off:g} mm off its centre: "
            "must have a width all round"
        )
    reach = float(high.max()) + off + max((b.radial for b in bosses), default=0.0) + ROOM
    stock = LayeredStock.block((-reach, -reach, bounds[0]), (reach, reach, bounds[-1]), bounds, tile_mm)
    around = box(-reach, -reach, reach, reach)
    shapes = []
    for r, o in zip(low.tolist(), high.tolist(), strict=True):
        whole = Point(*centre).buffer(o, QUARTER)
        for boss in bosses:
            whole = whole.union(_sector(o + boss.radial, boss).difference(Point(0.0, 0.0).buffer(0.5 * (r + o))))
        shapes.append(_parts(around.difference(whole.difference(Point(0.0, 0.0).buffer(r, QUARTER)))))
    stock.remove_many(range(stock.layers), shapes)
    return stock


def surface_off(
    stock: LayeredStock, outer: Callable[[Floats], Floats], low: float, high: float, within: float
) -> tuple[float, float] | None:
    """Least and greatest distance of the outer edges of the layers from ``outer`` between two heights [mm]: below 0 the
    wall is cut into, above 0 stock is left. None: no whole layer lies there.

    A section is closed by a disc first: what the cutter took is wider than the disc and remains as it is; a slit
    between two tiles or two cuts, into which the disc does not go, is not a cut.

    Parameters
    ----------
    within : radius of the disc [mm]: the tolerance of the simulated edges, far below the radius of a cutter
    """
    found = []
    for i in range(stock.layers):
        if stock.bounds[i] < low - 1e-9 or stock.bounds[i + 1] > high + 1e-9:
            continue
        whole = polygons(stock.section(i).buffer(within).buffer(-within))
        edge = np.concatenate([np.asarray(p.exterior.coords)[:, :2] for p in whole])
        off = np.hypot(*edge.T) - float(outer(np.array([stock.heights[i]]))[0])
        found.append((float(off.min()), float(off.max())))
    return (min(a for a, _ in found), max(b for _, b in found)) if found else None


def _sector(radius: float, boss: Boss) -> Polygon:
    corners = max(8, math.ceil((boss.end - boss.begin) / math.tau * 4 * QUARTER))
    a = np.linspace(boss.begin, boss.end, corners + 1)
    if boss.end - boss.begin >= math.tau - 1e-12:
        return Polygon(radius * np.column_stack([np.cos(a), np.sin(a)]))
    return Polygon([(0.0, 0.0), *(radius * np.column_stack([np.cos(a), np.sin(a)]))])


def _parts(shape: object) -> MultiPolygon:
    return MultiPolygon(polygons(shape))
