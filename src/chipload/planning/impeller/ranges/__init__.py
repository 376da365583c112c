"""Pallet angles at which one whole cutter, with neck, shank and holder, is clear of every check point."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.impeller.ranges.ranges import valid_ranges

__all__ = ["valid_ranges"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "ranges": "valid_ranges",
    },
)
