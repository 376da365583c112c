"""Representations of the stock during removal: layers, dexels and capsules in the plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.stock.dexel import TriDexel
    from chipload.stock.layers import LayeredStock
    from chipload.stock.planar import PlanarStock
    from chipload.stock.rings import Boss, ring_stock

__all__ = ["Boss", "LayeredStock", "PlanarStock", "TriDexel", "ring_stock"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "layers": "LayeredStock",
        "dexel": "TriDexel",
        "planar": "PlanarStock",
        "rings": "Boss ring_stock",
    },
)
