"""Compliance and modes of the workpiece while it is cut, of the cutter as a beam, and of holder and spindle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.structure.grid import from_map, plate
    from chipload.structure.places import MeshPlaces, normals_of, on_side
    from chipload.structure.shell import Shell
    from chipload.structure.solid import SolidWorkpiece, factorise
    from chipload.structure.spindle import Bar, cutter_bars, tool_bars

__all__ = [
    "Bar",
    "MeshPlaces",
    "Shell",
    "SolidWorkpiece",
    "cutter_bars",
    "factorise",
    "from_map",
    "normals_of",
    "on_side",
    "plate",
    "tool_bars",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "solid": "SolidWorkpiece factorise",
        "shell": "Shell",
        "places": "MeshPlaces normals_of on_side",
        "grid": "from_map plate",
        "spindle": "Bar cutter_bars tool_bars",
    },
)
