"""Drafts from CAMotics projects: tools, workpiece and the program that the project names."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from chipload.cutter.camotics import project_tools, read_project
from chipload.errors import InputError
from chipload.files import is_file
from chipload.jobs.drafts.comments import Box
from chipload.jobs.drafts.draft import Draft
from chipload.jobs.drafts.program import Known, draft_program
from chipload.program.read import ENDINGS
from chipload.units import MM_PER


def draft_camotics(file: Path, folder: Path, machine: str | None = None) -> Draft:
    """Return the draft of a job that simulates the program of a CAMotics project.

    Raises
    ------
    InputError
        The project or its program cannot be read.
    """
    project = read_project(file)
    tools = {
        number: {key: (value, f"tool {number} of {file.name}") for key, value in tool.items()}
        for number, tool in project_tools(project, file.name).items()
    }
    program = _program(project, file)
    known = Known(
        cutters=tools, stock=_workpiece(project, file), machine=machine, origin=f"{file.name} ({program.name})"
    )
    return draft_program(program, folder, known)


def _program(project: dict[str, Any], file: Path) -> Path:
    """The NC text of the project; of a script (`.tpl`) the text next to it that CAMotics wrote from it."""
    listed = project.get("files", project.get("nc-files", []))
    names = [str(name) for name in (listed if isinstance(listed, list) else [])]
    # a folder, as "/", has no name that could have another ending
    names = [name for name in names if (file.parent / name).name]
    for name in names:
        path = file.parent / name
        if path.suffix.lower() in ENDINGS and is_file(path):
            return path
    for name in (*names, file.name):
        for ending in ENDINGS:
            path = (file.parent / name).with_suffix(ending)
            if is_file(path):
                return path
    scripts = [name for name in names if name.lower().endswith(".tpl")]
    remedy = (
        f"export the NC text of {scripts[0]} from CAMotics, as {file.stem}.nc next to the project"
        if scripts
        else "put it next to the project"
    )
    raise InputError(
        f"{file.name}: none of its files is an NC text that exists ({', '.join(names)[:200] or 'it names none'}): "
        f"{remedy}"
    )


def _workpiece(project: dict[str, Any], file: Path) -> tuple[Box, str] | None:
    """Corners [mm] of the workpiece, unless it is automatic."""
    block = project.get("workpiece")
    if not isinstance(block, dict) or block.get("automatic", False):
        return None
    box = block.get("bounds")
    if not isinstance(box, dict):
        return None
    mm = MM_PER["inch" if str(project.get("units", "metric")).lower() in ("imperial", "inch") else "mm"]
    corners = []
    for key in ("min", "max"):
        values = box.get(key)
        if not (
            isinstance(values, list)
            and len(values) == 3
            and all(isinstance(v, (int, float)) and not isinstance(v, bool) and math.isfinite(v) for v in values)
        ):
            raise InputError(f"{file.name}: workpiece.bounds.{key}: must be three numbers")
        corners.append((float(values[0]) * mm, float(values[1]) * mm, float(values[2]) * mm))
    low, high = corners
    if not all(a < b for a, b in zip(low, high, strict=True)):
        return None
    return (low, high), f"workpiece of {file.name}"
