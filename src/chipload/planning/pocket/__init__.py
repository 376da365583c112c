"""Planning of pockets that are cleared at constant engagement."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.pocket.plan import check_pocket, plan_pocket
    from chipload.planning.pocket.request import Clearing, LargerCutter

__all__ = ["Clearing", "LargerCutter", "check_pocket", "plan_pocket"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "plan": "check_pocket plan_pocket",
        "request": "Clearing LargerCutter",
    },
)
