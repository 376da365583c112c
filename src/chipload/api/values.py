"""Values that functions of the Python interface accept: a cutter by numbers, a material by name or file."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import CutterTable
from chipload.cutting.material import Material, material_named, read_material
from chipload.errors import InputError

#: a cutter by numbers with units in their names, or by its profile
AnyCutter: TypeAlias = CutterTable | Cutter


def cutter_of(cutter: AnyCutter, key: str = "cutter") -> Cutter:
    """Return the cutter that a value states.

    Parameters
    ----------
    key : name of the parameter in messages

    Raises
    ------
    InputError
        The value is no cutter, or one of its numbers is missing or out of range.
    """
    found = cutter.cutter(Path()) if isinstance(cutter, CutterTable) else cutter
    if not isinstance(found, Cutter):
        raise InputError(f"{key}: {type(found).__name__}: give a chipload.Cutter")
    return found


def material_of(material: Material | str | Path) -> Material:
    """Return the material that a value, a shipped name or a file states.

    Raises
    ------
    InputError
        There is none of this name, or the file cannot be read.
    """
    if isinstance(material, Material):
        return material
    is_file = isinstance(material, Path) or material.lower().endswith(".toml")
    return read_material(material) if is_file else material_named(str(material))
