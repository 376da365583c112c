"""Planning of contours that are finished at constant engagement: the walls, the passes and their times."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.contour.plan import Finishing, check_contour, plan_contour

__all__ = ["Finishing", "check_contour", "plan_contour"]

__getattr__, __dir__ = attach(
    __name__,
    {
        "plan": "Finishing check_contour plan_contour",
    },
)
