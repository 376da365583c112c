"""Drafts of jobs that cut a thin wall: from sections of a blade, or from a model of one (STEP)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.geometry.sections import read_sections
from chipload.geometry.step_faces import Face, Model
from chipload.geometry.step_patch import patch_of
from chipload.jobs.drafts.cutters import cutter_table
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry, relative
from chipload.jobs.drafts.workpiece_material import elastic_entries
from chipload.number_text import number_text
from chipload.units import MM_PER

#: endings of sections of TurboGrid
ENDINGS = (".curve", ".crv")
#: headings of a table of points
COLUMNS = ("X R*THETA R", "X R THETA_DEG", "X Y Z")
#: endings of tables of points
TABLES = (".txt", ".csv", ".dat", ".xyz", ".asc", ".pts")
#: a blade is at least so large [mm] in the unit that is guessed
LEAST_MM = 15.0
#: diameters of ball noses [mm], and the greatest one over the height of a blade
BALLS, LOW = (8.0, 6.0, 4.0, 3.0, 2.0), 0.25
#: how far the patch of a face may leave it [mm], as a thin wall has it
FIT_MM = 0.001
_NUMBERED = re.compile(r"^(.*?)(\d+)(\D*)$")


def holds_sections(file: Path) -> bool:
    """Return whether a file holds sections of a blade: by its ending, or as a table of points X Y Z, with or without a
    heading and the numbers of the points.
    """
    if file.suffix.lower() in ENDINGS:
        return True
    if file.suffix.lower() not in TABLES:
        return False
    first = _first_words(file)
    return " ".join(first) in COLUMNS or _numbers(first) in (3, 4)


def _first_words(file: Path) -> list[str]:
    """The words of the first line that is no comment, in capitals."""
    text = read_regular(file, file.name, 100_000_000).decode("utf-8-sig", "replace")
    lines = (line for line in text.splitlines()[:40] if line.strip() and not line.lstrip().startswith("#"))
    return next(lines, "").upper().replace(",", " ").split()


def _numbers(words: list[str]) -> int:
    """How many numbers a line has; 0 where one of its words is none."""
    try:
        return len([float(word) for word in words])
    except ValueError:
        return 0


def draft_sections(file: Path, folder: Path, machine: str | None = None) -> Draft:
    """The draft of a thin wall whose shape is lofted through sections; numbered files next to this one belong to it.

    Raises
    ------
    InputError
        The sections cannot be read.
    """
    files = _numbered_files(file)
    columns = "X Y Z" if file.suffix.lower() not in ENDINGS and _numbers(_first_words(file)) else None
    unit = _unit(files, columns)
    points = read_sections(files, unit, columns=columns)
    if len(points) < 2:
        remedy = "" if columns is None else ": of a cloud, the points of each must have one x, y, z or distance from z"
        raise InputError(
            f"{file.name}: {len(points)} section: must be at least 2, from the clamp to the free edge{remedy}"
        )
    size, height = _sizes(points)
    entries = [
        Entry("shape", "sections"),
        Entry("files", [relative(f, folder) for f in files], f"{len(points)} sections"),
        Entry("unit", unit, f"the files name none; the blade is {height:.4g} mm high with it", True),
        *([] if columns is None else [Entry("columns", columns, "the files name none", True)]),
        Entry("edge_share", 0.12, "part left out at each edge", True),
        Entry("span", [0.1, 1.0], "part of the span that is cut", True),
    ]
    return _draft(f"Cut the blade of {file.name} as a thin wall.", entries, size, height, machine)


def draft_blade_model(file: Path, folder: Path, model: Model, machine: str | None = None) -> Draft:
    """The draft of a thin wall whose sides are the two largest faces that are no planes.

    Raises
    ------
    InputError
        The model has no such faces.
    """
    curved = sorted((f for f in model.faces if f.kind not in ("plane", "cylinder")), key=lambda f: -f.area)
    if len(curved) < 2:
        raise InputError(
            f"{file.name}: neither a horizontal plane for a pocket nor two curved faces for a thin wall: "
            "turn the part, or simulate a program with it as [part]"
        )
    front, back = curved[:2]
    try:
        for face in (front, back):
            patch_of(face, "its patch", FIT_MM)
    except InputError as err:
        raise InputError(
            f"{file.name}: the largest curved faces, {front.number} and {back.number}, are not sides of a thin wall: "
            f"{err}; chipload check {file.name} lists all faces: write the job with those of one blade"
        ) from None
    rest: list[Face] = [f for f in model.faces if f not in (front, back)]
    clamp = min(rest, key=lambda f: float(f.low[2]), default=None)
    size = float(np.linalg.norm(front.high - front.low))
    height = float(front.high[2] - front.low[2])
    entries = [
        Entry("shape", "step"),
        Entry("file", relative(file, folder)),
        Entry("front", front.number, f"{front.kind} of {number_text(front.area)} mm2, the largest", True),
        Entry("back", back.number, f"{back.kind} of {number_text(back.area)} mm2, the next", True),
        Entry("clamp", clamp.number if clamp is not None else 1, "the lowest face beside them", True),
        Entry("edge_share", 0.12, "part left out at each edge", True),
    ]
    return _draft(f"Cut the blade of {file.name} as a thin wall.", entries, size, height, machine)


def _numbered_files(file: Path) -> list[Path]:
    """The file, or all files in its folder whose names differ in their last number only."""
    found = _NUMBERED.match(file.stem)
    if file.suffix.lower() in ENDINGS or found is None:
        return [file]
    pattern = re.compile(re.escape(found[1]) + r"(\d+)" + re.escape(found[3]) + re.escape(file.suffix) + "$")
    hits = [(int(hit[1]), path) for path in file.parent.iterdir() if (hit := pattern.match(path.name))]
    return [path for _, path in sorted(hits)]


def _unit(files: Sequence[Path], columns: str | None) -> str:
    """The first unit in which the blade is not tiny."""
    for unit in ("mm", "cm", "inch", "m"):
        size, _ = _sizes(read_sections(files, unit, columns=columns))
        if size >= LEAST_MM:
            return unit
    return next(iter(MM_PER))


def _sizes(points: Sequence[Any]) -> tuple[float, float]:
    """Greatest size of a section [mm], and distance from the first to the last [mm]."""
    size = max(float(np.ptp(p, axis=0).max()) for p in points)
    return size, float(np.linalg.norm(points[-1].mean(axis=0) - points[0].mean(axis=0)))


def _draft(title: str, shape: list[Entry], size: float, height: float, machine: str | None) -> Draft:
    """The draft of a blade of aluminium, cut by a ball nose."""
    d = next((d for d in BALLS if d <= LOW * height), BALLS[-1])
    stock = min(0.3, 0.1 * d)
    wall = (
        *shape,
        Entry("foot_mm", round(max(0.12 * height, 0.6 * d), 3), "height above the clamp that keeps its stock", True),
        Entry("allowance_mm", [stock, stock], "stock on both sides", True),
        Entry("elements", [6, 6]),
    )
    key = "file" if machine is not None and machine.lower().endswith(".toml") else "name"
    own = Entry(key, machine) if machine is not None else Entry("name", "xyzbc-head-table", "five axes", True)
    workpiece = (
        Entry("name", "Al 7075-T6", "the file names no material", True),
        *elastic_entries("of this alloy"),
        Entry("density_kg_m3", 2810.0, "of this alloy", True),
        Entry("yield_mpa", 503.0, "of this alloy", True),
    )
    ball = {
        "diameter_mm": d, "corner_radius_mm": 0.5 * d, "flutes": 4, "flute_length_mm": d, "overhang_mm": 4.0 * d,
    }  # fmt: skip
    stated = cutter_table(1, [{k: (v, "a ball nose of a common size") for k, v in ball.items()}])
    cutter = tuple(Entry(e.key, e.value, e.note, e.key in ball or e.guess, e.example) for e in stated.entries)
    operation = (
        Entry("kind", "thinwall"),
        Entry("cutter", 1),
        Entry("milling", "down"),
        Entry("feed_mm_min", 1200.0, "0.05 mm a tooth", True),
        Entry("speed_rpm", 6000.0, "150 m/min", True),
        Entry("lean_deg", 45.0, "of the axis towards the free edge", True),
        Entry("lead_deg", 0.0),
        Entry("scallop_um", 30.0, "height between rows", True),
        Entry("depth_min_mm", 0.04),
        Entry("depth_max_mm", stock),
        Entry("slope", 0.05),
        Entry("reserve", 0.05),
        Entry("clearance_mm", 1.5),
        Entry("step_mm", round(min(max(size / 10.0, 1.0), 8.0), 2)),
        Entry("chord_mm", 0.02),
        Entry("layer_mm", 0.5),
        Entry("corner_slices", 48),
        Entry("tolerance_mm", 0.005),
    )
    return Draft(
        title,
        (
            DraftTable("wall", wall),
            DraftTable("workpiece", workpiece),
            DraftTable("machine", (own,)),
            DraftTable("material", (Entry("name", "al7075-t6", "the file names no material", True),)),
            DraftTable("cutter", cutter, repeated=True),
            DraftTable("operation", operation, repeated=True),
            DraftTable("limits", (Entry("deflection_workpiece_um", 50.0, "no limit is stated anywhere", True),)),
        ),
    )
