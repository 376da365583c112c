"""The nearest material of a layered stock to points in space.

A force acts on material. Where a step has cut and a later state of the stock has none left, the nearest place that is
left takes the force. Films thinner than :data:`FILM` carry nothing.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.stock.layers import LayeredStock
from chipload.structure.cells.grid import Array
from chipload.structure.cells.moments import alike

#: [mm] least thickness of material on which a force acts
FILM = 0.1
#: [mm] distance below which two corners of a section are one: their edge has no direction
SAME = 1e-6


class StockSections:
    """Sections of a stock without films; layers that share their polygons share a section."""

    def __init__(self, stock: LayeredStock) -> None:
        self.low, self.high, self.shapes = list[float](), list[float](), list[shapely.Geometry]()
        for i in range(stock.layers):
            if alike(stock, i):
                if self.high and self.high[-1] == stock.bounds[i]:
                    self.high[-1] = float(stock.bounds[i + 1])
                continue
            whole = stock.section(i).simplify(0.1 * FILM)
            thinner = whole.buffer(-0.5 * FILM, join_style="mitre").simplify(SAME)
            shape = thinner.buffer(0.5 * FILM, join_style="mitre")
            if not shape.is_empty:
                shapely.prepare(shape)
                self.low.append(float(stock.bounds[i]))
                self.high.append(float(stock.bounds[i + 1]))
                self.shapes.append(shape)

    def nearest(self, points: Array) -> Array:
        """Nearest point of the material to each of (n, 3), (n, 3) float [mm]; a point in the material is its own.

        >>> stock = LayeredStock.block((0, 0, 0), (4, 4, 2), 1.0, 4.0)
        >>> StockSections(stock).nearest(np.array([[1.0, 2.0, 1.5], [5.0, 2.0, 3.0]])).tolist()
        [[1.0, 2.0, 1.5], [4.0, 2.0, 2.0]]
        """
        best = np.full(len(points), np.inf)
        z = points[:, 2]
        level = np.zeros(len(points), dtype=np.int64)
        flat = shapely.points(points[:, :2])
        low, high = np.array(self.low), np.array(self.high)
        off = np.maximum(np.maximum(low[:, None] - z, z - high[:, None]), 0.0)
        for k in np.argsort(off.min(axis=1, initial=np.inf), kind="stable").tolist():
            some = np.flatnonzero(off[k] < best)
            if len(some):
                d = np.hypot(shapely.distance(self.shapes[k], flat[some]), off[k, some])
                nearer = d < best[some] - 1e-9
                best[some[nearer]], level[some[nearer]] = d[nearer], k
        out = points.copy()
        for k in np.unique(level[best > 0.0]).tolist():
            some = np.flatnonzero((level == k) & (best > 0.0))
            ends: NDArray[np.object_] = shapely.shortest_line(self.shapes[k], flat[some])
            out[some, :2] = shapely.get_coordinates(ends).reshape(-1, 2, 2)[:, 0]
            out[some, 2] = np.clip(z[some], low[k], high[k])
        return out
