"""Engagement of the cutter with the stock: contact arcs, tooth engagement and chips."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.engagement.chips.covered import covered
    from chipload.engagement.chips.move import Move
    from chipload.engagement.contact import Engagement, StockBoundary
    from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
    from chipload.engagement.tooth_surfaces import chips_of_teeth

__all__ = [
    "Engagement",
    "Move",
    "StockBoundary",
    "ToothEngagement",
    "chips_of_teeth",
    "covered",
    "engagement_of_arcs",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "tooth_engagement": "ToothEngagement engagement_of_arcs",
        "tooth_surfaces": "chips_of_teeth",
        "contact": "Engagement StockBoundary",
        "chips.move": "Move",
        "chips.covered": "covered",
    },
)
