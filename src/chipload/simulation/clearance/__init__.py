"""Least distance of a moving tool from points of a surface, and its depth in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.simulation.clearance.body import above_cutting, cutting_part
    from chipload.simulation.clearance.clearance import LeastDistance

__all__ = ["LeastDistance", "above_cutting", "cutting_part"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "body": "above_cutting cutting_part",
        "clearance": "LeastDistance",
    },
)
