"""Drafts of the jobs of a part with pockets and thin walls: plan, checks in the elastic part, distortion.

A floor of the part gives a job that plans its pockets, and jobs that simulate the programs which that job writes. The
walls are finished level by level in all pockets, while the stock below still stands: roughing leaves
:data:`STOCK` thicknesses of the wall on it, a level is :data:`LEVEL` thicknesses deep.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from chipload.errors import ChiploadError, InputError
from chipload.geometry.mesh import read_mesh
from chipload.geometry.part_walls import Wall, find_walls
from chipload.geometry.pocketed_part import Pocket, find_pockets, slabs_of
from chipload.geometry.step import read_step_face
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry, relative
from chipload.jobs.drafts.drawing import DIAMETERS, cutter_for, machine_of, planned_tables
from chipload.jobs.drafts.folder import RESULTS
from chipload.jobs.drafts.found import CHORD, list_pockets
from chipload.jobs.drafts.part_picture import part_picture
from chipload.jobs.drafts.workpiece_material import elastic_entries
from chipload.lazy import trimesh
from chipload.machine.machine import Machine
from chipload.number_text import number_text
from chipload.report.programs import ENDINGS, program_name

#: least height over thickness of a wall that is thin, as checks.wall_slenderness
SLENDER = 5.0
#: stock that roughing leaves on a thin wall, and depth of a level of its finish, in thicknesses of the wall
STOCK, LEVEL = 2.0, 2.5
#: material [mm] of the finish pass of a wall, and share of the diameter that a corner needs at least
FINISH_MM, CORNER = 0.3, 0.85
#: diameter [mm] of the cutter of sharp corners, which it leaves round
SHARP_MM = 6.0
#: depth over the diameter beyond which the length of a cutter is named
LONG = 5.0
#: [um] limits of a draft: form error of walls, flatness after release
FORM_UM, FLAT_UM = 50.0, 50.0
#: sides of cells over the thinnest wall, of at most 2.5: a frame has 60,000 instead of 80,000 unknowns at 2.0, and its
#: walls are 1.7 % stiffer (benchmarks/frame.py --state 3.6); the check states the error of its cells
CELL = 2.4
#: states that are solved at most: a frame of 120 x 60 x 30 mm needs 46, one before each pass over a place
STATES = 64
#: least share of its box that the outline of a part fills, where the block counts as the outline
FULL = 0.999
#: picture of what was found
PICTURE = "found.svg"
#: a wall or its floor that is listed
LISTED = 8


@dataclass(frozen=True, eq=False)
class FoundPart:
    """A part with thin walls: its mesh, pockets and walls."""

    file: Path
    mesh: trimesh.Trimesh
    pockets: tuple[Pocket, ...]
    walls: tuple[Wall, ...]
    outline_share: float


def find_frame(file: Path) -> FoundPart | None:
    """A model as a part with thin walls beside closed pockets; None: it is none."""
    try:
        mesh = read_mesh(file, chord_mm=CHORD, key="part.file")
    except ChiploadError:
        return None
    slabs = slabs_of(mesh)
    if slabs is None:
        return None
    pockets, walls = find_pockets(mesh), find_walls(slabs, SLENDER)
    if not walls or all(p.open for p in pockets):
        return None
    box = np.ptp(mesh.bounds, axis=0)
    return FoundPart(file, mesh, pockets, walls, float(slabs.whole.area) / float(box[0] * box[1]))


def frame_drafts(found: FoundPart, folder: Path, machine: str | None = None) -> dict[str, Draft]:
    """The jobs of a part by the names of their files, in the order in which they run.

    Raises
    ------
    InputError
        No cutter fits a pocket.
    """
    on = machine_of(machine)
    floors = sorted({round(p.floor_mm, 3) for p in found.pockets if not p.open}, reverse=True)
    out: dict[str, Draft] = {}
    notes, earlier = found_notes(found), ""
    for z in floors:
        plan, cutters = _plan(found, folder, on, machine, z)
        tracks = [str(_stated(t).get("use", "pocket")) for t in plan.tables if t.name == "operation"]
        name = f"{len(out) + 1}-pockets"
        out[name] = replace(plan, notes=(*notes, *plan.notes) if not out else plan.notes)
        common = [t for t in plan.tables if t.name in ("machine", "material")]
        for k, cutter in enumerate(cutters):
            walls = k == len(cutters) - 1
            program = f"{RESULTS}/{name}/{program_name(k, tracks[k])}.{ENDINGS[on.dialect]}"
            check = f"{len(out) + 1}-{'walls' if walls else 'roughing'}"
            out[check] = _check(found, folder, [*common, cutter], program, earlier, walls)
            earlier = f"{RESULTS}/{check}/stock.npz"
    out[f"{len(out) + 1}-distortion"] = _distortion(found, folder)
    first = next(iter(out))
    picture = part_picture(found.mesh, found.pockets, found.walls).encode()
    out[first] = replace(out[first], files={PICTURE: picture})
    return out


def found_notes(found: FoundPart) -> tuple[str, ...]:
    """What was found in a part, in sentences."""
    out = [list_pockets(found.pockets)]
    kinds: dict[tuple[float, float, bool], list[Wall]] = {}
    for wall in found.walls:
        kinds.setdefault((round(wall.thickness_mm, 2), round(wall.height_mm, 2), wall.outer), []).append(wall)
    for (thickness, height, outer), walls in list(kinds.items())[:LISTED]:
        count = f"{len(walls)} walls" if len(walls) > 1 else "1 wall"
        long = number_text(max(w.length_mm for w in walls), 3)
        out.append(
            f"{count} {'at the outside' if outer else 'between pockets'}, {thickness:g} mm thick, {height:g} mm high "
            f"({number_text(height / thickness, 3)} : 1), up to {long} mm long"
        )
    if len(kinds) > LISTED:
        out.append(f"{len(kinds) - LISTED} other kinds of walls")
    for thickness in sorted({round(p.floor_thickness_mm, 2) for p in found.pockets}):
        where = sorted({f"{p.floor_mm:g}" for p in found.pockets if abs(p.floor_thickness_mm - thickness) < 5e-3})
        kind = f"{thickness:g} mm thick" if thickness > 0.0 else "open below"
        out.append(f"floors at z = {', '.join(where)} mm: {kind}")
    out.append("the stress of the plate is not known: the job of the distortion has an example")
    if any(p.open for p in found.pockets):
        out.append("pockets with an open side are not in these drafts: plan them with a DXF that has part.stock_layers")
    if found.outline_share < FULL:
        out.append("the outline of the part is not its box: what stands around it is not in these drafts")
    if below := find_pockets(trimesh.Trimesh(found.mesh.vertices * (1, -1, -1), found.mesh.faces)):
        count = f"{len(below)} pockets are" if len(below) > 1 else "1 pocket is"
        out.append(f"{count} open from below: turn the model over and run init again for that setup")
    return tuple(out)


def _plan(found: FoundPart, folder: Path, on: Machine, named: str | None, z: float) -> tuple[Draft, list[DraftTable]]:
    """The job that plans the pockets with a floor at one height, and its cutters in the order of its programs."""
    contours = read_step_face(found.file, z_mm=z).contours
    if not contours or not all(c.closed for c in contours):
        raise InputError(f"{found.file.name}: the edges of the floor at z = {z:g} mm do not close: draw them as DXF")
    pockets = [p for p in found.pockets if abs(p.floor_mm - z) < 1e-3]
    top = float(found.mesh.bounds[1, 2])
    depth, thin = top - z, min(w.thickness_mm for w in found.walls)
    first, area, narrow = cutter_for(contours)
    corner = min(p.corner_mm for p in pockets)
    own = 2.0 * CORNER * corner if corner > 0.0 else SHARP_MM
    second = max((d for d in DIAMETERS if d <= min(own, first)), default=DIAMETERS[-1])
    stock = round(min(max(STOCK * thin, 1.0), 0.3 * second), 2)
    level = round(min(0.5 * second, max(LEVEL * thin, 1.0)), 2)
    rough = planned_tables(on, named, first, min(0.5 * first, depth), "pocket", narrow=narrow, depth=depth)
    finish = planned_tables(on, named, second, level, "pocket", depth=depth)
    parts = {t.name: t for t in rough}
    roughs = first > second + 1e-9
    reason = (
        f"the largest up to {100.0 * CORNER:g} % of the corners, R {number_text(corner, 2)} mm"
        if corner > 0.0
        else f"corners are sharp in the model: R {0.5 * second:g} mm stays in them"
    )
    cutters = [parts["cutter"]] if roughs else []
    cutters.append(
        _with(
            next(t for t in finish if t.name == "cutter"),
            number=Entry("number", len(cutters) + 1),
            diameter_mm=Entry("diameter_mm", second, reason, True),
        )
    )
    operations = []
    if roughs:
        floor = {"feed_mm_min": _stated(parts["operation"])["feed_mm_min"]}
        floor["speed_rpm"] = _stated(parts["operation"])["speed_rpm"]
        operations.append(
            _with(
                parts["operation"],
                allowance_mm=Entry("allowance_mm", stock, f"{STOCK:g} thicknesses of the wall stand beside it", True),
                floor_allowance_mm=Entry(
                    "floor_allowance_mm", 0.3, "of the floor, finished while the walls are thick", True
                ),
                floor_finish=Entry("floor_finish", floor),
            )
        )
    own_operation = next(t for t in finish if t.name == "operation")
    speed = _stated(own_operation)["speed_rpm"]
    wall = {
        "feed_mm_min": _stated(own_operation)["feed_mm_min"], "speed_rpm": speed, "by_level": True,
    }  # fmt: skip
    operations.append(
        _with(
            own_operation,
            cutter=Entry("cutter", len(cutters)),
            axial_depth_mm=Entry(
                "axial_depth_mm", level, f"greatest of a level: {LEVEL:g} thicknesses of the wall", True
            ),
            allowance_mm=Entry("allowance_mm", FINISH_MM, "that the finish pass of the wall takes", True),
            **({"rest_of": Entry("rest_of", 0)} if roughs else {}),
            wall_finish=Entry("wall_finish", wall, "sides of a wall in turn, level by level"),
        )
    )
    checks = DraftTable(
        "checks", (Entry("slender_walls", False, "the job of the walls simulates them in the elastic part", True),)
    )
    part = DraftTable("part", (Entry("file", relative(found.file, folder)), Entry("face_z_mm", round(z, 6))))
    tables = (
        part,
        DraftTable("stock", (Entry("top_mm", round(top, 6), "the top of the model: solid down to the floor", True),)),
        parts["machine"],
        parts["material"],
        *cutters,
        *operations,
        parts["limits"],
        checks,
    )
    notes = []
    if depth > LONG * second:
        notes.append(
            f"the cutter of {second:g} mm reaches {depth:g} mm deep, {number_text(depth / second, 2)} diameters"
        )
    if corner == 0.0:
        notes.append(f"sharp corners: R {0.5 * second:g} mm stays in them")
    title = (
        f"Pockets of {found.file.name} with the floor at z = {z:g} mm: {number_text(area)} mm2, walls level by level."
    )
    return Draft(title, tables, tuple(notes)), cutters


def _check(
    found: FoundPart, folder: Path, common: Sequence[DraftTable], program: str, earlier: str, walls: bool
) -> Draft:
    """The job that simulates a program in the block, or in what the one before left; walls in the elastic part."""
    low, high = (np.round(v, 6).tolist() for v in found.mesh.bounds)
    stock = (
        DraftTable("stock", (Entry("file", earlier, "what the job before leaves"),))
        if earlier
        else DraftTable(
            "stock", (Entry("low_mm", low, "the box of the model", True), Entry("high_mm", high, "", False))
        )
    )
    spacing = max(1.0, round(float(np.ptp(found.mesh.bounds, axis=0).max()) / 60.0, 1))
    part = DraftTable("part", (Entry("file", relative(found.file, folder)), Entry("spacing_mm", spacing)))
    limits = [Entry("gouge_mm", 0.05, "deepest cut into the part", True)]
    thinnest = min(
        *(w.thickness_mm for w in found.walls),
        *(p.floor_thickness_mm for p in found.pockets if p.floor_thickness_mm > 0.0),
        math.inf,
    )
    elastic: list[DraftTable] = []
    if walls:
        limits.append(Entry("form_error_um", FORM_UM, "of the part, by the deflection of cutter and walls", True))
        elastic = [
            DraftTable(
                "workpiece",
                (
                    *elastic_entries(),
                    Entry("yield_mpa", 430.0, "7075-T6 plate", True),
                    Entry("cell_mm", round(CELL * thinnest, 3), f"{CELL:g} times the thinnest wall or floor", True),
                    Entry("states", STATES, "at most; one before each pass over a place"),
                ),
            ),
            DraftTable(
                "workpiece.clamp", (Entry("face", "z-", "held on its underside, as on a vacuum table", True),), True
            ),
        ]
    operation = DraftTable("operation", (Entry("kind", "simulate"), Entry("step_mm", 1.0 if walls else 2.0)), True)
    what = "Walls: deflection of the part by the program" if walls else "Roughing: the program in the block, gouges"
    return Draft(
        f"{what} {program}.",
        (
            DraftTable("program", (Entry("file", program),)),
            stock,
            part,
            *common,
            *elastic,
            operation,
            DraftTable("limits", tuple(limits)),
        ),
    )


def _distortion(found: FoundPart, folder: Path) -> Draft:
    """The job that predicts how the part springs, by a stress that is only an example."""
    low, high = (np.round(v, 6).tolist() for v in found.mesh.bounds)
    stress = DraftTable(
        "residual_stress",
        (
            Entry("shape", "m", "the form of stretched plate", True),
            Entry("amplitude_mpa", 20.0, "an example: the stress of your plate is not known", True),
            Entry("across_share", 0.6, "an example", True),
            Entry("rolling", "x", "the grain of the plate runs along X", True),
            Entry("source", "an example of chipload init: not measured"),
        ),
    )
    plate = DraftTable(
        "stock", (Entry("low_mm", low), Entry("high_mm", high, "the plate is as thick as the part", True))
    )
    side = Entry("side", "z+")
    return Draft(
        f"Distortion of {found.file.name} after its release.",
        (
            stress,
            DraftTable("part", (Entry("file", relative(found.file, folder)),)),
            plate,
            DraftTable("workpiece", elastic_entries()),
            DraftTable("setup", (side,), True),
            DraftTable(
                "choices",
                (
                    Entry("stock_mm", [1.0], "with and without a release before the faces are finished", True),
                    Entry("flip", True),
                    Entry("first_side", False),
                ),
            ),
            DraftTable("limits", (Entry("flatness_um", FLAT_UM, "of the underside", True),)),
        ),
    )


def _with(table: DraftTable, **entries: Entry) -> DraftTable:
    """A table with other entries, those that it lacks at its end."""
    stated = {e.key for e in table.entries}
    kept = tuple(entries.get(e.key, e) for e in table.entries)
    return replace(table, entries=(*kept, *(e for key, e in entries.items() if key not in stated)))


def _stated(table: DraftTable) -> dict[str, Any]:
    """The values of a table by their keys."""
    return {e.key: e.value for e in table.entries if e.value is not None}
