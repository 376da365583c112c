"""The workpiece as its initial stock less the volumes that moves of a leaning or turning axis swept, in bricks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.engagement.bricks.stock import BrickStock

__all__ = ["BrickStock"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "stock": "BrickStock",
    },
)
