"""Immersion of each slice of a cutter in the layered workpiece, and its chip thickness."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.engagement.immersion.immersion import Section, engagement_rows, tool_frame

__all__ = ["Section", "engagement_rows", "tool_frame"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "immersion": "Section engagement_rows tool_frame",
    },
)
