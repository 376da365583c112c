"""Thin walls: allowable forces, depths of cut, passes and five-axis paths."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.thinwall.blank import FinishSurface, WallBlank
    from chipload.planning.thinwall.depth import DepthRange, largest_depths
    from chipload.planning.thinwall.experiments import Proposal, propose_cuts
    from chipload.planning.thinwall.force_table import ForceTable, law_on_stock
    from chipload.planning.thinwall.linking import FineSide, OperationMotion, link_passes
    from chipload.planning.thinwall.pass_program import Margins, PassProgram
    from chipload.planning.thinwall.passes import Plan
    from chipload.planning.thinwall.paths import PassMotion
    from chipload.planning.thinwall.plane_stock import CutterPose
    from chipload.planning.thinwall.table import read_cuts, write_cuts
    from chipload.planning.thinwall.threshold import Experiments, Threshold, calibrated, modelled
    from chipload.planning.thinwall.variants import PlannedVariant

__all__ = [
    "CutterPose",
    "DepthRange",
    "Experiments",
    "FineSide",
    "FinishSurface",
    "ForceTable",
    "Margins",
    "OperationMotion",
    "PassMotion",
    "PassProgram",
    "Plan",
    "PlannedVariant",
    "Proposal",
    "Threshold",
    "WallBlank",
    "calibrated",
    "largest_depths",
    "law_on_stock",
    "link_passes",
    "modelled",
    "propose_cuts",
    "read_cuts",
    "write_cuts",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "blank": "WallBlank FinishSurface",
        "depth": "DepthRange largest_depths",
        "experiments": "Proposal propose_cuts",
        "force_table": "ForceTable law_on_stock",
        "linking": "FineSide OperationMotion link_passes",
        "pass_program": "Margins PassProgram",
        "passes": "Plan",
        "paths": "PassMotion",
        "plane_stock": "CutterPose",
        "table": "read_cuts write_cuts",
        "threshold": "Experiments Threshold calibrated modelled",
        "variants": "PlannedVariant",
    },
)
