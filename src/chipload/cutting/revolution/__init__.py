"""Loads over a revolution, with all rotations of a step in one calculation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.cutting.revolution.revolution import loads_over_turn

__all__ = ["loads_over_turn"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "revolution": "loads_over_turn",
    },
)
