"""The remaining stock of an earlier result (`stock.npz`) as the initial stock of a pocket."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely

from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.stock.layers import LayeredStock

#: heights [mm] within this are equal
EQUAL_MM = 1e-6


def read_stock(path: Path) -> LayeredStock:
    """The stock of an earlier result.

    Raises
    ------
    InputError
        The file is missing, damaged, or is no ``stock.npz``.
    """
    if path.suffix.lower() != ".npz":
        raise InputError(f"stock.file = {path.name}: must be the stock.npz of an earlier result")
    return LayeredStock.load(path)


def standing_between(stock: LayeredStock, floor: float, top: float, name: str) -> tuple[Contour, ...]:
    """Closed contours of all material between two heights [mm].

    Raises
    ------
    InputError
        Material stands above ``top``, or a height lies within a layer: what stands on its part in between is not
        known.
    """
    low, high = np.asarray(stock.bounds[:-1]), np.asarray(stock.bounds[1:])
    for k in np.flatnonzero(high > top + EQUAL_MM).tolist():
        if stock.area(k) > 0.0:
            raise InputError(
                f"stock.top_mm = {top:g}: {name} holds material up to {high[stock_top(stock)]:g} mm: state that height"
            )
    inside = np.flatnonzero((low < floor - EQUAL_MM) & (high > floor + EQUAL_MM))
    if len(inside):
        k = int(inside[0])
        raise InputError(
            f"stock.file = {name}: the floor of the pocket at {floor:g} mm lies within its layer from {low[k]:g} to "
            f"{high[k]:g} mm: state the depth that was cut, or simulate with a level at {floor:g}"
        )
    layers = np.flatnonzero((high > floor + EQUAL_MM) & (low < top - EQUAL_MM)).tolist()
    whole = shapely.union_all([stock.section(k) for k in layers])
    rings = [r for part in shapely.get_parts(whole) for r in (part.exterior, *part.interiors)]
    return tuple(Contour.polyline(np.asarray(r.coords)[:-1], closed=True) for r in rings)


def stock_top(stock: LayeredStock) -> int:
    """Number of the highest layer that holds material."""
    return max(k for k in range(stock.layers) if stock.area(k) > 0.0)
