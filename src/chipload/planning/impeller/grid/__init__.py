"""Largest cutter at each of given pallet angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.impeller.grid.grid import admitted

__all__ = ["admitted"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "grid": "admitted",
    },
)
