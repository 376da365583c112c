"""Tools of a CAMotics project (`.camotics`): JSON with shape, diameter and length of each tool, in its own unit.

CAMotics has cylindrical, ball nose, conical, snub nose and spheroid tools. Spheroid tools are refused. The diameter of
a conical tool is that of its upper end, and its length is the height of the cone from its point.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.units import MM_PER

_LARGEST_FILE = 10_000_000
_UNITS = {"metric": "mm", "imperial": "inch", "mm": "mm", "inch": "inch"}


def read_project(path: str | Path) -> dict[str, Any]:
    """Read a project file.

    Raises
    ------
    InputError
        It cannot be read, or is no such project.
    """
    label = f"CAMotics project {path}"
    data = read_regular(path, label, _LARGEST_FILE, "not a project")
    try:
        project = json.loads(data.decode("utf-8"))
    except (ValueError, RecursionError):
        raise InputError(f"{label}: not a CAMotics project: must be JSON") from None
    if not isinstance(project, dict) or not isinstance(project.get("tools"), dict):
        raise InputError(f"{label}: not a CAMotics project: must have tools")
    return project


def project_tools(project: dict[str, Any], label: str) -> dict[int, dict[str, Any]]:
    """Return the tools of a project by number, as keys of a job's ``[[cutter]]``.

    Raises
    ------
    InputError
        A number of a tool is missing, of the wrong kind or out of range.

    >>> tool = {"units": "imperial", "shape": "ballnose", "length": 1, "diameter": 0.125}
    >>> project_tools({"tools": {"1": tool}}, "bear")[1]["corner_radius_mm"]
    1.5875
    """
    out: dict[int, dict[str, Any]] = {}
    for key, tool in project["tools"].items():
        if not isinstance(tool, dict) or not str(key).isdecimal():
            raise InputError(f"{label}: tool {str(key)[:20]}: must be a number and its table")
        out[int(key)] = _tool(tool, str(project.get("units", "metric")), f"{label}: tool {key}")
    return out


def _tool(tool: dict[str, Any], units: str, label: str) -> dict[str, Any]:
    unit = _UNITS.get(str(tool.get("units", units)).lower())
    if unit is None:
        raise InputError(f"{label}: units = {tool.get('units')!r}: must be metric or imperial")
    size = {}
    for key in ("diameter", "length"):
        value = tool.get(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value < 1e5:
            raise InputError(f"{label}: {key} = {value!r}: must be a number above 0")
        size[key] = float(value) * MM_PER[unit]
    out: dict[str, Any] = {"diameter_mm": size["diameter"], "flute_length_mm": size["length"]}
    if tool.get("description"):
        out["name"] = str(tool["description"])
    shape = str(tool.get("shape", "cylindrical")).lower().replace(" ", "")
    if shape == "ballnose":
        out["corner_radius_mm"] = 0.5 * size["diameter"]
    elif shape in ("conical", "snubnose"):
        tip = 0.0
        if shape == "snubnose":
            snub = tool.get("snub_diameter", tool.get("snub-diameter", 0.0))
            if isinstance(snub, bool) or not isinstance(snub, (int, float)) or not snub >= 0.0:
                raise InputError(f"{label}: snub_diameter = {snub!r}: must be a number from 0")
            tip = float(snub) * MM_PER[unit]
        # the diameter of a taper counts where bottom and flank meet; a point keeps a flat that can be simulated
        out["diameter_mm"] = max(tip, 0.01)
        out["taper_deg"] = math.degrees(math.atan2(0.5 * (size["diameter"] - tip), size["length"]))
        out["shank_diameter_mm"] = size["diameter"]
    elif shape != "cylindrical":
        raise InputError(f"{label}: shape {shape}: must be cylindrical, ballnose, conical or snubnose")
    return out


def read_camotics_tool(path: str | Path, tool: int) -> dict[str, Any]:
    """Read one tool of a project as keys of a job's ``[[cutter]]``.

    Raises
    ------
    InputError
        As :func:`read_project`; the project has no such tool.
    """
    label = f"cutter.file {path}"
    tools = project_tools(read_project(path), label)
    if tool not in tools:
        raise InputError(
            f"{label}: tool {tool} is not there: must be one of {', '.join(map(str, sorted(tools))) or 'none'}"
        )
    return {"number": tool, **tools[tool]}
