"""FreeCAD tool bits (`.fctb`) of 0.20 and 1.x: JSON with lengths as texts such as `6,0 mm`, `1/4 in` or `0.25 "`.

Read are end mills, ball ends, bull noses (torus), drills and V-bits; taps, reamers, thread mills, dovetail mills and
slitting saws as bodies. Another shape is refused.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from chipload.cutter.tool_bits import SPECIAL, special_shape
from chipload.errors import InputError
from chipload.files import read_regular

#: shape file -> what it is
SHAPES = {"endmill": "flat", "ballend": "ball", "torus": "bull", "bullnose": "bull", **{s: s for s in SPECIAL}}
_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "in": 25.4, "inch": 25.4, '"': 25.4}
_LENGTH = re.compile(r"^([0-9]+(?:[.,][0-9]+)?)(?:\s*/\s*([0-9]+))?\s*([^\s0-9]+)$")
_MIXED = re.compile(r"^([0-9]+)[\s+-]+([0-9]+)\s*/\s*([0-9]+)\s*([^\s0-9]+)$")
_ANGLE = re.compile(r"^([0-9]+(?:[.,][0-9]+)?)\s*(?:°|deg)$")
_LARGEST_FILE = 1_000_000
_LONGEST = 60


def read_fctb(path: str | Path) -> dict[str, Any]:
    """Read a tool bit as keys of a job's ``[[cutter]]``; values that the file does not state are left out.

    Diameter, flutes, cutting edge height, shank diameter, the add-on's stick-out as overhang, the name; by shape corner
    radius, point, taper or body. Not in such a file: number, helix, modulus.

    Raises
    ------
    InputError
        The file cannot be read, is not a tool bit, has another shape, or states a length without a unit.
    """
    path = Path(path)
    label = f"cutter.file {path}"
    text = read_regular(path, label, _LARGEST_FILE, "not a tool bit")
    try:
        data = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError):
        raise InputError(f"{label}: not a FreeCAD tool bit: must be JSON") from None
    if not isinstance(data, dict) or not isinstance(data.get("parameter"), dict) or "shape" not in data:
        raise InputError(f"{label}: not a FreeCAD tool bit: must have shape and parameter")
    shape = str(data["shape"]).lower().rsplit("/", 1)[-1].removesuffix(".fcstd")
    # FreeCAD 1.x names the kind beside the file of the shape, which may be one of the user's own
    kind = SHAPES.get(shape) or SHAPES.get(str(data.get("shape-type", "")).lower())
    if kind is None:
        raise InputError(f"{label}: shape {shape}: must be one of {', '.join(SHAPES)}")
    parameter = data["parameter"]
    more = data.get("attribute")
    attribute: dict[str, Any] = more if isinstance(more, dict) else {}
    out: dict[str, Any] = {}
    if kind in SPECIAL and str(parameter.get("Flutes")) == "0":
        parameter = {k: v for k, v in parameter.items() if k != "Flutes"}
    if isinstance(data.get("name"), str):
        out["name"] = data["name"]
    for source, name, key in (
        (parameter, "Diameter", "diameter_mm"),
        (parameter, "CuttingEdgeHeight", "flute_length_mm"),
        (parameter, "ShankDiameter", "shank_diameter_mm"),
        (attribute, "btl-stickout", "overhang_mm"),
    ):
        if name in source:
            out[key] = _length(f"{label}: {name}", source[name])
    if "Flutes" in parameter:
        out["flutes"] = _count(f"{label}: Flutes", parameter["Flutes"])
    if kind == "ball" and "diameter_mm" in out:
        out["corner_radius_mm"] = 0.5 * out["diameter_mm"]
    if kind == "bull":
        for name in ("TorusRadius", "CornerRadius", "FlatRadius"):
            if name in parameter:
                length = _length(f"{label}: {name}", parameter[name])
                break
        else:
            raise InputError(f"{label}: shape {shape} without TorusRadius, CornerRadius or FlatRadius: give one")
        if name == "FlatRadius":
            if "diameter_mm" not in out:
                raise InputError(f"{label}: FlatRadius without Diameter: give it")
            length = 0.5 * out["diameter_mm"] - length
        out["corner_radius_mm"] = length
    if kind in SPECIAL:
        out |= special_shape(kind, lambda name: _size(label, parameter, name), label)
        if out.get("body_mm"):
            out.pop("flutes", None)
    return out


def _size(label: str, parameter: dict[str, Any], name: str) -> float | None:
    """A length [mm] or an angle [deg] of a tool bit."""
    if name not in parameter:
        return None
    angle = _ANGLE.match(str(parameter[name]).strip()[:_LONGEST])
    return float(angle[1].replace(",", ".")) if angle else _length(f"{label}: {name}", parameter[name])


def _length(label: str, text: object) -> float:
    """A length with its unit in mm."""
    if len(str(text)) > _LONGEST:
        raise InputError(
            f"{label}: {len(str(text))} characters: must be a length with its unit, such as 6,0 mm or 1/4 in"
        )
    plain = str(text).strip().replace("\N{NO-BREAK SPACE}", " ")
    value, unit = None, ""
    if hit := _MIXED.match(plain):
        value, unit = int(hit[1]) + int(hit[2]) / max(int(hit[3]), 1), hit[4]
    elif hit := _LENGTH.match(plain):
        value, unit = float(hit[1].replace(",", ".")) / max(int(hit[2] or 1), 1), hit[3]
    if value is None or unit.lower() not in _MM:
        raise InputError(f"{label} = {text!r}: must be a length with its unit, such as 6,0 mm or 1/4 in")
    return value * _MM[unit.lower()]


def _count(label: str, value: object) -> int:
    """A whole number, as a number or as a text."""
    text = str(value).strip()
    if isinstance(value, bool) or not re.fullmatch(r"[0-9]{1,3}", text):
        raise InputError(f"{label} = {value!r}: must be a whole number")
    return int(text)
