"""Geometry: lines and arcs, offsets, drawings, meshes, surfaces and their files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.geometry.bspline import BSplinePatch
    from chipload.geometry.contour import Contour, Region
    from chipload.geometry.dxf import read_dxf
    from chipload.geometry.mesh import read_mesh
    from chipload.geometry.offset import offset_region
    from chipload.geometry.revolve import Revolved
    from chipload.geometry.sections import Blade, loft, read_meridian, read_sections
    from chipload.geometry.step import read_step_face
    from chipload.geometry.step_faces import read_faces
    from chipload.geometry.thin_wall import ThinWall

__all__ = [
    "BSplinePatch",
    "Blade",
    "Contour",
    "Region",
    "Revolved",
    "ThinWall",
    "loft",
    "offset_region",
    "read_dxf",
    "read_faces",
    "read_meridian",
    "read_mesh",
    "read_sections",
    "read_step_face",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "contour": "Contour Region",
        "bspline": "BSplinePatch",
        "revolve": "Revolved",
        "sections": "Blade loft read_sections read_meridian",
        "dxf": "read_dxf",
        "step": "read_step_face",
        "step_faces": "read_faces",
        "mesh": "read_mesh",
        "offset": "offset_region",
        "thin_wall": "ThinWall",
    },
)
