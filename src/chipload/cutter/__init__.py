"""Cutters: their shape, their material, and the files that describe them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.cutter.camotics import read_camotics_tool
    from chipload.cutter.catalogue import Catalogue, CatalogueCutter, catalogue_named, read_catalogue
    from chipload.cutter.cutter import Cutter
    from chipload.cutter.fctb import read_fctb
    from chipload.cutter.fusion import read_fusion_library, read_fusion_tool
    from chipload.cutter.iso13399 import read_iso13399
    from chipload.cutter.slices import Slices
    from chipload.cutter.strength import ToolMaterial, ToolStrength
    from chipload.cutter.table import CutterTable, cutter_from_table
    from chipload.cutter.tooltable import read_tool_table

__all__ = [
    "Catalogue",
    "CatalogueCutter",
    "Cutter",
    "CutterTable",
    "Slices",
    "ToolMaterial",
    "ToolStrength",
    "catalogue_named",
    "cutter_from_table",
    "read_camotics_tool",
    "read_catalogue",
    "read_fctb",
    "read_fusion_library",
    "read_fusion_tool",
    "read_iso13399",
    "read_tool_table",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "cutter": "Cutter",
        "table": "CutterTable cutter_from_table",
        "catalogue": "Catalogue CatalogueCutter catalogue_named read_catalogue",
        "slices": "Slices",
        "strength": "ToolMaterial ToolStrength",
        "camotics": "read_camotics_tool",
        "fctb": "read_fctb",
        "fusion": "read_fusion_library read_fusion_tool",
        "iso13399": "read_iso13399",
        "tooltable": "read_tool_table",
    },
)
