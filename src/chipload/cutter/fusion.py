"""Tool libraries of Fusion 360 and HSMWorks: JSON (`.json`), or a ZIP that holds it (`.tools`).

A tool's ``geometry`` has the symbols of ISO 13399 in the tool's own unit: DC diameter, RE corner radius, LCF flute
length, LB length below the holder, SFDM shank, NOF flutes, SIG point, TA taper, HA helix angle [deg], TP pitch.
Read are end mills (flat, ball, bull nose, tapered), face mills, slot mills (T-slot), chamfer mills, drills, reamers as
flat cutters, thread mills with their rows of teeth (NT) on a neck (shoulder-diameter), and circle segment barrels that
do not cut above their widest place: lower-radius corner, profile-radius flank, both tangent, axial-distance height of
the widest place. Taps, other thread mills, dovetail, lollipop and other circle segment mills (lens, oval, taper) are
bodies, whose chips are not simulated. Other shapes are refused.
"""

from __future__ import annotations

import io
import json
import math
import zipfile
from pathlib import Path
from typing import Any

from chipload.cutter.bodies import cylinder, tap_core
from chipload.errors import InputError
from chipload.files import read_regular
from chipload.units import MM_PER

#: type of a tool -> what it is
SHAPES = {
    "flat end mill": "flat", "ball end mill": "ball", "bull nose end mill": "bull", "face mill": "bull",
    "chamfer mill": "cone", "spot drill": "point", "drill": "point", "center drill": "point", "counter sink": "point",
    "tapered mill": "taper", "slot mill": "slot", "tap right hand": "tap", "tap left hand": "tap",
    "thread mill": "thread", "reamer": "flat", "dovetail mill": "body", "lollipop mill": "body",
    "circle segment barrel": "barrel", "circle segment lens": "body", "circle segment oval": "body",
    "circle segment taper": "body",
}  # fmt: skip
#: Young's modulus [GPa] by the material of the body
MODULUS = {"carbide": 580.0, "hss": 210.0}
#: symbol and key of the ``[[cutter]]``
LENGTHS = {"DC": "diameter_mm", "LCF": "flute_length_mm", "LB": "overhang_mm", "SFDM": "shank_diameter_mm"}
_UNITS = {"millimeters": "mm", "inches": "inch"}
_LARGEST_FILE = 50_000_000
_MOST_TOOLS = 100_000


def read_fusion_tool(path: str | Path, tool: int | None) -> dict[str, Any]:
    """Read one tool of a library as keys of a job's ``[[cutter]]``; values that it does not state are left out.

    Parameters
    ----------
    tool : post-process number of the tool; None: the only tool

    Raises
    ------
    InputError
        The file cannot be read, the tool is missing or appears twice, or its shape is not supported.
    """
    label = f"cutter.file {path}"
    tools = [t for t in _tools(path, label) if t.get("type") not in ("holder", "probe")]
    if not tools:
        raise InputError(f"{label}: holds no tool")
    if tool is None:
        if len(tools) > 1:
            raise InputError(f"cutter.tool is missing: {Path(path).name} holds {len(tools)}: state the number of one")
        chosen = tools[0]
    else:
        chosen = _tool_of_number(tools, tool, label)
    return _cutter(chosen, tool, f"{label}: tool {tool if tool is not None else ''}".rstrip())


def read_fusion_library(path: str | Path) -> dict[int, dict[str, Any]]:
    """Read the tools of a library by their post-process numbers, as :func:`read_fusion_tool` does.

    Holders, probes, tools without a number, and numbers that two tools have are left out; so are tools whose shape is
    not supported.

    Raises
    ------
    InputError
        The file cannot be read, or has no tool with a number that can be used.
    """
    label = f"tools {path}"
    tools = [t for t in _tools(path, label) if t.get("type") not in ("holder", "probe")]
    posts = [t.get("post-process") for t in tools]
    numbers = [p.get("number") if isinstance(p, dict) else None for p in posts]
    out: dict[int, dict[str, Any]] = {}
    refused: list[InputError] = []
    for tool, number in zip(tools, numbers, strict=True):
        if not isinstance(number, int) or number < 0 or numbers.count(number) > 1:
            continue
        try:
            out[number] = _cutter(tool, number, f"{label}: tool {number}")
        except InputError as error:
            refused.append(error)
    if not out:
        raise refused[0] if refused else InputError(f"{label}: no tool has a post-process number of its own")
    return out


def _tools(path: str | Path, label: str) -> list[dict[str, Any]]:
    data = read_regular(path, label, _LARGEST_FILE, "not a tool library")
    try:
        if data.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                inner = next((i for i in archive.infolist() if i.filename.endswith(".json")), None)
                if inner is None or inner.file_size > _LARGEST_FILE:
                    raise InputError(f"{label}: not a tool library: holds no JSON of at most {_LARGEST_FILE} bytes")
                data = archive.read(inner)
        library = json.loads(data.decode("utf-8"))
    except (ValueError, RecursionError, zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError):
        raise InputError(f"{label}: not a Fusion tool library: must be JSON") from None
    listed = library.get("data", library.get("tools")) if isinstance(library, dict) else library
    if not isinstance(listed, list) or len(listed) > _MOST_TOOLS or not all(isinstance(t, dict) for t in listed):
        raise InputError(f"{label}: not a Fusion tool library: must have a list of tools, data")
    return listed


def _tool_of_number(tools: list[dict[str, Any]], number: int, label: str) -> dict[str, Any]:
    posts = [(t, t.get("post-process")) for t in tools]
    own = [(t, p.get("number")) for t, p in posts if isinstance(p, dict)]
    found = [t for t, n in own if n == number]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(f"{label}: tool {number} appears {len(found)} times: give each its own number in the library")
    known = sorted({n for _, n in own if isinstance(n, int)})
    listed = ", ".join(map(str, known[:20])) or "none"
    raise InputError(f"{label}: tool {number} is not there: must be one of {listed}")


def _cutter(tool: dict[str, Any], number: int | None, label: str) -> dict[str, Any]:
    kind = str(tool.get("type", "")).lower()
    shape = SHAPES.get(kind)
    if shape is None:
        raise InputError(f"{label}: type {kind or 'missing'}: must be one of {', '.join(SHAPES)}")
    unit = _UNITS.get(str(tool.get("unit", "")).lower())
    if unit is None:
        raise InputError(f"{label}: unit = {tool.get('unit')!r}: must be millimeters or inches")
    geometry = tool.get("geometry")
    if not isinstance(geometry, dict):
        raise InputError(f"{label}: geometry is missing")
    mm = MM_PER[unit]
    out: dict[str, Any] = {} if number is None else {"number": number}
    if str(tool.get("description", "")).strip():
        out["name"] = str(tool["description"]).strip()
    for symbol, key in LENGTHS.items():
        value = _number(geometry, symbol, label)
        if value is not None and value > 0.0:
            out[key] = value * mm
    flutes = _number(geometry, "NOF", label)
    if flutes is not None and flutes >= 1.0:
        out["flutes"] = int(flutes)
    helix = _number(geometry, "HA", label)
    if helix is not None:
        out["helix_deg"] = helix
    body = str(tool.get("BMC", "")).lower()
    if body in MODULUS:
        out |= {"modulus_gpa": MODULUS[body], "tool_material": body}
    out |= _tip(shape, geometry, out, mm, label)
    holder = _holder(tool.get("holder"), mm)
    return out | ({"holder_mm": holder} if holder else {})


def _tip(shape: str, geometry: dict[str, Any], out: dict[str, Any], mm: float, label: str) -> dict[str, Any]:
    """Return corner, taper, point, neck or body; a body without a stated profile is the cylinder around it."""
    d = out.get("diameter_mm")
    if shape == "ball" and d is not None:
        return {"corner_radius_mm": 0.5 * d}
    if shape == "bull":
        corner = _number(geometry, "RE", label)
        return {"corner_radius_mm": corner * mm} if corner else {}
    if shape == "point":
        angle = _number(geometry, "SIG", label)
        if angle is None or not 0.0 < angle <= 180.0:
            raise InputError(f"{label}: SIG, the point angle: must be above 0 and at most 180 deg")
        return {"bottom_deg": 90.0 - 0.5 * angle}
    if shape == "slot":
        neck = _number(geometry, "shoulder-diameter", label)
        return {"shank_diameter_mm": neck * mm} if neck is not None and neck > 0.0 else {}
    if shape == "taper":
        angle, corner = _number(geometry, "TA", label), _number(geometry, "RE", label) or 0.0
        return {"taper_deg": angle or 0.0} | ({"corner_radius_mm": corner * mm} if corner else {})
    if shape == "barrel" and d is not None and (barrel := _barrel(geometry, d, out, mm, label)):
        return barrel
    if shape == "thread" and (own := _thread_mill(geometry, mm, label)):
        return own
    if shape in ("tap", "thread", "body", "barrel") and d is not None:
        high = out.get("flute_length_mm", out.get("overhang_mm"))
        if high is None:
            raise InputError(f"{label}: LCF, the flute length: must be given and above 0")
        pitch = (_number(geometry, "TP", label) or 0.0) * mm if shape == "tap" else 0.0
        body = tap_core(d, pitch, high) if 0.0 < pitch < 0.5 * d else cylinder(d, high)
        thread = {"thread_pitch_mm": pitch} if pitch > 0.0 else {}
        return {"body_mm": body, "diameter_mm": 2.0 * body[0][0], "flute_length_mm": high, **thread}
    if shape == "cone" and d is not None:
        angle, tip = _number(geometry, "TA", label), _number(geometry, "tip-diameter", label) or 0.0
        if angle is None or not 0.0 < angle < 90.0:
            raise InputError(f"{label}: TA, the taper angle: must be above 0 and below 90 deg")
        return {"diameter_mm": max(tip * mm, 0.01), "taper_deg": angle, "shank_diameter_mm": d}
    return {}


def _thread_mill(geometry: dict[str, Any], mm: float, label: str) -> dict[str, Any]:
    """Pitch, rows of teeth, neck and angle of a thread mill; nothing of one with no rows or no neck."""
    rows, pitch, neck, angle = (
        _number(geometry, key, label) for key in ("NT", "TP", "shoulder-diameter", "thread-profile-angle")
    )
    if not rows or rows != round(rows) or not pitch or not neck:
        return {}
    flank = {} if angle is None else {"flank_deg": 0.5 * angle}
    return {
        "shape": "thread mill", "thread_pitch_mm": pitch * mm, "shank_diameter_mm": neck * mm,
        "flute_length_mm": rows * pitch * mm, "tooth_rows": int(rows), **flank,
    }  # fmt: skip


def _barrel(geometry: dict[str, Any], d: float, out: dict[str, Any], mm: float, label: str) -> dict[str, Any]:
    """Corner and flank arc of a barrel; nothing where they are not stated, or where it cuts above its widest place.

    The corner's centre lies so far from the axis, e = d / 2 - R + sqrt((R - r)^2 - (F - r)^2), that the arc is
    widest at the height F.
    """
    corner, radius, widest = (
        _number(geometry, key, label) for key in ("lower-radius", "profile-radius", "axial-distance")
    )
    high = out.get("flute_length_mm")
    if radius is None or widest is None or high is None or high > widest * mm * (1.0 + 1e-9):
        return {}
    r, R, F = (corner or 0.0) * mm, radius * mm, widest * mm
    square = (R - r) ** 2 - (F - r) ** 2
    e = 0.5 * d - R + math.sqrt(square) if r < R and r < F and square > 0.0 else -1.0
    if e < 0.0:
        raise InputError(
            f"{label}: profile-radius = {R:g} mm with axial-distance = {F:g} mm: its arc meets the axis above the tip: "
            "must reach a flat or rounded tip"
        )
    return {"corner_radius_mm": r, "barrel_radius_mm": R, "corner_e_mm": e}


def _holder(holder: Any, mm: float) -> list[list[float]]:
    """(length, diameter) [mm] of the parts, upwards; a cone counts with its larger end."""
    segments = holder.get("segments") if isinstance(holder, dict) else None
    out = []
    for part in segments if isinstance(segments, list) else ():
        sizes = [part.get(k) for k in ("height", "lower-diameter", "upper-diameter")] if isinstance(part, dict) else []
        if len(sizes) == 3 and all(_is_number(s) for s in sizes):
            height, low, high = (float(str(s)) * mm for s in sizes)
            if height > 0.0 and max(low, high) > 0.0 and math.isfinite(height + low + high):
                out.append([height, max(low, high)])
    return out


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _number(geometry: dict[str, Any], symbol: str, label: str) -> float | None:
    value = geometry.get(symbol)
    if value is None:
        return None
    if not _is_number(value) or not math.isfinite(value):
        raise InputError(f"{label}: {symbol} = {str(value)[:40]!r}: must be a finite number")
    return float(value)
