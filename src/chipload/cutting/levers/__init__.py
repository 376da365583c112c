"""Tooth loads multiplied by levers that depend on the height, over a revolution."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.cutting.levers.levers import greatest_height, has_lever_loads, lever_loads

__all__ = ["greatest_height", "has_lever_loads", "lever_loads"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "levers": "greatest_height has_lever_loads lever_loads",
    },
)
