"""Report, figures and scene of a result, and the result folder. Only this package draws."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.report.bodies import SceneBody, scene_bodies
    from chipload.report.export import export_result
    from chipload.report.folder import check_target, write_finished, write_result
    from chipload.report.presentation import Blank, Presentation
    from chipload.report.removal import read_removal
    from chipload.report.sheet import figure, table
    from chipload.report.view import Colouring, ViewMark, ViewPath, ViewScene, scene_document

__all__ = [
    "Blank",
    "Colouring",
    "Presentation",
    "SceneBody",
    "ViewMark",
    "ViewPath",
    "ViewScene",
    "check_target",
    "export_result",
    "figure",
    "read_removal",
    "scene_bodies",
    "scene_document",
    "table",
    "write_finished",
    "write_result",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "bodies": "SceneBody scene_bodies",
        "export": "export_result",
        "folder": "check_target write_finished write_result",
        "presentation": "Blank Presentation",
        "removal": "read_removal",
        "sheet": "figure table",
        "view": "Colouring ViewMark ViewPath ViewScene scene_document",
    },
)
