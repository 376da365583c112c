"""Decides the path, the depth, the cutter, the index angle and the feed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.contour.plan import Finishing, plan_contour
    from chipload.planning.impeller.answer import largest_cutters
    from chipload.planning.impeller.impeller import Impeller
    from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
    from chipload.planning.pocket.plan import plan_pocket
    from chipload.planning.pocket.request import Clearing
    from chipload.planning.result import OperationResult, StrategyResult
    from chipload.planning.thinwall.blank import FinishSurface
    from chipload.planning.thinwall.depth import DepthRange
    from chipload.planning.thinwall.force_table import ForceTable

__all__ = [
    "Clearing",
    "DepthRange",
    "FinishSurface",
    "Finishing",
    "ForceTable",
    "Impeller",
    "ImpellerShape",
    "OperationResult",
    "StrategyResult",
    "impeller_of",
    "largest_cutters",
    "plan_contour",
    "plan_pocket",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "contour.plan": "Finishing plan_contour",
        "pocket.plan": "plan_pocket",
        "pocket.request": "Clearing",
        "result": "OperationResult StrategyResult",
        "impeller.impeller": "Impeller",
        "impeller.parametric": "ImpellerShape impeller_of",
        "impeller.answer": "largest_cutters",
        "thinwall.blank": "FinishSurface",
        "thinwall.depth": "DepthRange",
        "thinwall.force_table": "ForceTable",
    },
)
