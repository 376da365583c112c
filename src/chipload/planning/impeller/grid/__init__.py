"""Largest cutter at each of given pallet angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.impeller.grid.grid import largest_on_grid

__all__ = ["largest_on_grid"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "grid": "largest_on_grid",
    },
)
