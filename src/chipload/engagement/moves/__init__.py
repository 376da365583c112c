"""The workpiece as its initial stock less the volumes that earlier moves swept: contact without a resolution."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.engagement.moves.stock import Engaged, MoveStock

__all__ = ["Engaged", "MoveStock"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "stock": "Engaged MoveStock",
    },
)
