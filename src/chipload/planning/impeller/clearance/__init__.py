"""Clearance of a whole cutter from the check points."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.impeller.clearance.clearance import interpolated_axes, moves_clear, nearest

__all__ = ["interpolated_axes", "moves_clear", "nearest"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "clearance": "interpolated_axes moves_clear nearest",
    },
)
