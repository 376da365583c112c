"""The stock as heights over a grid of the plan: contact of shank and holder, rapids, loose stock, slender walls."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.simulation.heights.height_map import HeightMap, follow_heights
    from chipload.simulation.heights.loose_stock import find_loose_stock
    from chipload.simulation.heights.slender_walls import find_slender_walls

__all__ = ["HeightMap", "find_loose_stock", "find_slender_walls", "follow_heights"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "height_map": "HeightMap follow_heights",
        "loose_stock": "find_loose_stock",
        "slender_walls": "find_slender_walls",
    },
)
