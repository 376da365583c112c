"""Undeformed chips on layers: the area that a cutter covers during a move, and the new part of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.engagement.chips.covered import CoveredArea
    from chipload.engagement.chips.move import Move
    from chipload.engagement.chips.ring import Origin, Ring

__all__ = ["CoveredArea", "Move", "Origin", "Ring"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "covered": "CoveredArea",
        "move": "Move",
        "ring": "Origin Ring",
    },
)
