"""Chips on a layer: the area that a move covers of the remaining stock.

Notation: chip = covered now, within the section of the stock, less what was covered before. It may be several pieces;
every edge of a piece knows whether it is old surface or new, and which piece of the diagram made it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.engagement.chips.covered import CoveredArea
from chipload.engagement.chips.ring import Origin, Ring, rings_of_polygons

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Chip:
    """One piece of the chip on a layer.

    Parameters
    ----------
    rings : the outer one first, counter-clockwise, then holes, clockwise; ``Origin.STOCK`` where the surface is old
    height : h of the layer [mm]
    """

    rings: tuple[Ring, ...]
    height: float

    @property
    def area(self) -> float:
        """Area within the curves [mm2]."""
        return sum(ring.area for ring in self.rings)

    @property
    def polygon(self) -> shapely.Polygon:
        """The rings as a polygon."""
        return shapely.Polygon(self.rings[0].points, [ring.points for ring in self.rings[1:]])


def chips(
    covered: CoveredArea,
    stock_polygon: shapely.Polygon | shapely.MultiPolygon,
    before: CoveredArea | shapely.Polygon | shapely.MultiPolygon | None = None,
    slivers: bool = False,
) -> tuple[Chip, ...]:
    """Return the pieces of stock that a move removes from a layer, the largest first.

    Parameters
    ----------
    covered : of the move
    stock_polygon : section of the stock with the layer
    before : what was covered before and is not taken off ``stock_polygon`` yet
    slivers : whether pieces are kept that are no wider than the tolerance, as they are between two polygons of the
        same curve

    Returns
    -------
    tuple of Chip, empty where nothing is taken

    Examples
    --------
    >>> from chipload.cutter.cutter import Cutter
    >>> from chipload.engagement.chips.covered import covered as covers
    >>> from chipload.engagement.chips.move import Move
    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> move = Move.lerp([0, 0, 0], [0, 0, 1], [2, 0, 0], [0, 0, 1])
    >>> round(chips(covers(move, mill, 1.0, 1e-4), shapely.box(-9, 0, 99, 99))[0].area, 5)
    49.26991
    """
    old = before.polygon if isinstance(before, CoveredArea) else before
    left = stock_polygon if old is None else shapely.difference(stock_polygon, old)
    cut = shapely.intersection(left, covered.polygon)
    parts = [p for p in shapely.get_parts(cut) if p.geom_type == "Polygon" and not p.is_empty]
    if not slivers:
        parts = [p for p in parts if p.area > covered.tolerance * p.length]
    if not parts:
        return ()
    tables = [_old_edges(stock_polygon)]
    if isinstance(before, CoveredArea):
        tables += [_edges(ring, old=True) for ring in before.rings]
    elif before is not None:
        tables.append(_old_edges(before))
    edges = np.concatenate(tables + [_edges(ring) for ring in covered.rings])
    made = [Chip(rings_of_polygons(p, edges), covered.height) for p in parts]
    return tuple(sorted(made, key=lambda chip: -chip.area))


def _edges(ring: Ring, old: bool = False) -> Floats:
    """Edges (m, 12) of a ring, their curves as parabolas of the same area."""
    p, q = ring.points, np.roll(ring.points, -1, axis=0)
    slope = 6.0 * ring.bulge / ((q - p) ** 2).sum(1)
    out = np.column_stack([p, q, ring.theta, ring.t, ring.end, -slope, slope, ring.origin, ring.bulge])
    if old:
        out[:, 4:8], out[:, 10] = np.nan, Origin.STOCK
    return out


def _old_edges(polygon: shapely.Geometry) -> Floats:
    """Edges (m, 12) of a polygon or several, straight, of old stock."""
    out = []
    for line in shapely.get_parts(shapely.boundary(polygon)):
        p = shapely.get_coordinates(line)
        rows = np.zeros((len(p) - 1, 12))
        rows[:, :2], rows[:, 2:4], rows[:, 4:8], rows[:, 10] = p[:-1], p[1:], np.nan, Origin.STOCK
        out.append(rows)
    return np.concatenate(out) if out else np.empty((0, 12))
