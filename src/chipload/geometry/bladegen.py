"""The reader of `BladeGen.inf`: which files describe a blade row for TurboGrid, in which unit, about which axis.

Format: a line ``key: value`` each, comments begin with ``!``: ``Axis of Rotation: Z``, ``Number of Blade Sets: 36``,
``Number of Blades Per Set: 1`` (2: main blade and splitter), ``Geometry Units: CM``, ``Hub Data File: hub.curve``,
``Shroud Data File``, ``Profile Data File``. BladeGen, CFturbo and others write it beside the three files of points,
which ``sections.py`` reads.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from chipload.errors import InputError
from chipload.files import read_regular

#: units of length as the file names them, with their keys of ``units.MM_PER``
UNITS = {"M": "m", "CM": "cm", "MM": "mm", "UM": "um", "MICRON": "um", "IN": "inch", "INCH": "inch", "FT": "foot"}
#: keys that every file has
_KEYS = ("Number of Blade Sets", "Geometry Units", "Hub Data File", "Shroud Data File", "Profile Data File")
_LARGEST = 1_000_000


@dataclass(frozen=True)
class BladeRow:
    """A blade row as `BladeGen.inf` describes it.

    Parameters
    ----------
    blades : number of blades, without splitters
    splitter : whether a splitter stands between two blades
    unit : a key of ``units.MM_PER``
    axis : axis of rotation, "x", "y" or "z"
    profile, hub, shroud : files of points
    """

    blades: int
    splitter: bool
    unit: str
    axis: str
    profile: Path
    hub: Path
    shroud: Path


def is_blade_row(path: Path) -> bool:
    """Return whether a file is one: by its ending and its first key."""
    return path.suffix.lower() == ".inf" and _KEYS[0].lower() in _text(path).lower()


def read_blade_row(path: Path) -> BladeRow:
    """The blade row of a file; the files that it names lie beside it.

    Raises
    ------
    InputError
        A key is missing or has a value that is not known, or a file is missing.
    """
    values = {}
    for line in _text(path).splitlines():
        key, colon, value = line.partition(":")
        if colon and not line.lstrip().startswith("!"):
            values[" ".join(key.lower().split())] = value.strip()
    for key in _KEYS:
        if not values.get(key.lower()):
            raise InputError(f"{path}: {key}: missing: must be a line `{key}: value`")
    unit = UNITS.get(values["geometry units"].upper())
    if unit is None:
        raise InputError(f"{path}: Geometry Units: {values['geometry units']}: must be one of {', '.join(UNITS)}")
    axis = values.get("axis of rotation", "Z").lower()
    if axis not in ("x", "y", "z"):
        raise InputError(f"{path}: Axis of Rotation: {axis}: must be X, Y or Z")
    each = _count(path, values, "Number of Blades Per Set", "1")
    if each > 2:
        raise InputError(
            f"{path}: Number of Blades Per Set: {each}: must be 1, or 2 with one splitter between two blades"
        )
    files = [path.parent / Path(values[key.lower()].replace("\\", "/")).name for key in _KEYS[2:]]
    for key, file in zip(_KEYS[2:], files, strict=True):
        if not file.is_file():
            raise InputError(f"{path}: {key}: {file.name}: is not beside it: copy it there")
    hub, shroud, profile = files
    return BladeRow(_count(path, values, _KEYS[0], ""), each == 2, unit, axis, profile, hub, shroud)


def _count(path: Path, values: dict[str, str], key: str, default: str) -> int:
    text = values.get(key.lower(), default)
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= 1000:
        raise InputError(f"{path}: {key}: {text[:20]}: must be a whole number from 1 to 1000")
    return int(text)


def _text(path: Path) -> str:
    return read_regular(path, path.name, _LARGEST, "not a description of a blade row").decode("utf-8-sig", "replace")
