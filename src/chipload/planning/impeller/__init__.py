"""Impellers on an index table: the largest cutters, table angles, partitions and paths."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.planning.impeller.answer import Answer, Unreachable, largest_cutters
    from chipload.planning.impeller.assignment import Changes
    from chipload.planning.impeller.compare import CutterChoice, Partition, cutter_choices
    from chipload.planning.impeller.costs import ChannelSide, Costs, MeasuredCost, Terms
    from chipload.planning.impeller.covering.covering import Covering
    from chipload.planning.impeller.fillets import with_fillets
    from chipload.planning.impeller.impeller import Impeller
    from chipload.planning.impeller.lines import LineMotion
    from chipload.planning.impeller.links import Link
    from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
    from chipload.planning.impeller.patch import Patch
    from chipload.planning.impeller.paths import PatchFinish
    from chipload.planning.impeller.planned_settings import PlannedSettings
    from chipload.planning.impeller.rough_settings import RoughingSetting
    from chipload.planning.impeller.roughing import RoughingSettings
    from chipload.planning.impeller.settings import CutterSetting, FinishSettings, Milling
    from chipload.planning.impeller.surfaces import ContactSampling, ContactSurface, surface_of
    from chipload.planning.impeller.tables import IndexTable, index_table

__all__ = [
    "Answer",
    "Changes",
    "ChannelSide",
    "ContactSampling",
    "ContactSurface",
    "Costs",
    "Covering",
    "CutterChoice",
    "CutterSetting",
    "FinishSettings",
    "Impeller",
    "ImpellerShape",
    "IndexTable",
    "LineMotion",
    "Link",
    "MeasuredCost",
    "Milling",
    "Partition",
    "Patch",
    "PatchFinish",
    "PlannedSettings",
    "RoughingSetting",
    "RoughingSettings",
    "Terms",
    "Unreachable",
    "cutter_choices",
    "impeller_of",
    "index_table",
    "largest_cutters",
    "surface_of",
    "with_fillets",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "answer": "Answer Unreachable largest_cutters",
        "assignment": "Changes",
        "compare": "CutterChoice Partition cutter_choices",
        "costs": "ChannelSide Costs MeasuredCost Terms",
        "covering.covering": "Covering",
        "fillets": "with_fillets",
        "impeller": "Impeller",
        "lines": "LineMotion",
        "links": "Link",
        "parametric": "ImpellerShape impeller_of",
        "patch": "Patch",
        "paths": "PatchFinish",
        "rough_settings": "RoughingSetting",
        "roughing": "RoughingSettings",
        "planned_settings": "PlannedSettings",
        "settings": "CutterSetting FinishSettings Milling",
        "surfaces": "ContactSampling ContactSurface surface_of",
        "tables": "IndexTable index_table",
    },
)
