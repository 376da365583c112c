"""Moments of the material of a layered stock in the cells of a grid, in closed form.

Notation: M_klm the integral of P_k(xi) P_l(eta) P_m(zeta) over the material of a cell, in the cell's local coordinates
-1..1 (so that M_000 of a full cell is 8); k, l, m from 0 to 2 p. A layer is a prism, so its moments are those of its
section in the plane times those of its height. By Green's theorem those of a section are sums over its edges,

    integral P_k(xi) P_l(eta) = - contour integral P_k(xi) (integral of P_l from -1 to eta) d xi,

cut where an edge leaves a cell; an edge also counts for every cell below it. Along a straight piece the integrand is
a polynomial, which Gauss points integrate exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.polynomial import legendre
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from chipload.lazy import LateModule
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.grid import Array, CellGrid

_moments = LateModule("chipload.structure.cells._moments")


@dataclass(frozen=True, eq=False)
class StockRegion:
    """A prism upright in the work frame, to which a stock can be limited.

    Parameters
    ----------
    outline : in the plane [mm]
    low, high : its heights [mm]
    """

    outline: Polygon | MultiPolygon
    low: float
    high: float

    def thickness(self, stock: LayeredStock) -> float:
        """Least side [mm] of the box around it, within that of a stock."""
        x0, y0, x1, y1 = self.outline.bounds
        ends = ((x0, x1, stock.xs), (y0, y1, stock.ys), (self.low, self.high, stock.bounds))
        return min(min(high, float(v[-1])) - max(low, float(v[0])) for low, high, v in ends)


def alike(stock: LayeredStock, layer: int) -> bool:
    """Whether a layer shares its polygons with the one below it."""
    return layer > 0 and all(a is b for a, b in zip(stock.tiles[layer].flat, stock.tiles[layer - 1].flat, strict=True))


def section_moments(shapes: NDArray[np.object_], grid: CellGrid) -> Array:
    """Moments M_kl of the union of polygons that do not overlap, (nx, ny, n, n) float, n = 2 p + 1.

    >>> from chipload.structure.cells.grid import grid_over
    >>> m = section_moments(np.array([shapely.box(1, 0, 4, 2)], dtype=object), grid_over((0, 0, 0), (4, 2, 2), 2.0))
    >>> m[:, 0, 0, 0].round(12).tolist()
    [2.0, 4.0]
    """
    n = 2 * grid.order + 1
    out = np.zeros((grid.counts[0], grid.counts[1], n, n))
    parts = shapely.get_parts(shapes)
    rings, part = shapely.get_rings(parts, return_index=True)
    if not len(rings):
        return out
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    start = np.concatenate([[0], np.cumsum(np.bincount(ring, minlength=len(rings)))]).astype(np.int64)
    x, y = grid.planes[:2]
    points = np.ascontiguousarray(np.clip(xy, grid.low[:2], grid.high[:2]))
    cross = np.append(points[:-1, 0] * points[1:, 1] - points[1:, 0] * points[:-1, 1], 0.0)
    area = np.add.reduceat(np.where(np.append(ring[1:] == ring[:-1], False), cross, 0.0), start[:-1])
    hole = np.append(False, part[1:] == part[:-1])
    sign = np.where(hole, -1.0, 1.0) * np.where(area < 0.0, -1.0, 1.0)
    at, weight = legendre.leggauss(n)
    _moments.ring_moments(points, start, sign, x, y, at, weight, out)
    return out


def height_moments(grid: CellGrid, low: float, high: float) -> tuple[range, Array]:
    """The cells along z that a slice low..high [mm] meets, and (c, n) float its moments M_m in them."""
    n = 2 * grid.order + 1
    z = grid.planes[2]
    near = 1e-12 * (z[-1] - z[0])
    first = max(int(np.searchsorted(z, low + near, side="right")) - 1, 0)
    last = min(int(np.searchsorted(z, high - near, side="left")), grid.counts[2])
    cells = range(first, max(last, first))
    k = np.array(cells, dtype=np.int64)
    ends = [np.clip(2.0 * (v - z[k]) / (z[k + 1] - z[k]) - 1.0, -1.0, 1.0) for v in (low, high)]
    out = np.empty((len(k), n))
    for m in range(n):
        c = legendre.legint(np.eye(n)[m][: m + 1])
        out[:, m] = legendre.legval(ends[1], c) - legendre.legval(ends[0], c)
    return cells, out


def stock_moments(stock: LayeredStock, grid: CellGrid, region: StockRegion | None = None) -> Array:
    """Moments M_klm of a stock in the cells that hold it, (nx, ny, nz, n, n, n) float.

    Parameters
    ----------
    region : only the material within it; None: all
    """
    n = 2 * grid.order + 1
    out = np.zeros((*grid.counts, n, n, n))
    low = 0
    while low < stock.layers:
        # layers that share their polygons are one
        high = low + 1
        while high < stock.layers and alike(stock, high):
            high += 1
        z0, z1 = float(stock.bounds[low]), float(stock.bounds[high])
        shapes = stock.tiles[low].ravel()
        low = high
        if region is not None:
            z0, z1 = max(z0, region.low), min(z1, region.high)
            if z1 <= z0:
                continue
            shapes = shapely.intersection(shapes, region.outline)
        plane = section_moments(shapes, grid)
        cells, height = height_moments(grid, z0, z1)
        out[:, :, cells.start : cells.stop] += np.einsum("xykl,zm->xyzklm", plane, height)
    return out
