"""Drafts of jobs that plan a pocket or a contour: from a drawing (DXF) or from a horizontal face of a model (STEP)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import ChiploadError, InputError
from chipload.geometry.chains import Drawing
from chipload.geometry.contour import Contour
from chipload.geometry.dxf import read_dxf
from chipload.geometry.even_odd import even_odd
from chipload.geometry.step import read_step_face
from chipload.geometry.step_faces import Face, read_faces
from chipload.jobs.drafts.cutters import cutter_table
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry, relative
from chipload.jobs.drafts.found import found_lines
from chipload.jobs.drafts.wheel import draft_wheel
from chipload.machine.machine import Machine, machine_named, read_machine
from chipload.number_text import number_text
from chipload.planning.contour.offsets import centre_paths, walls_of
from chipload.planning.contour.passes import run_on_length
from chipload.units import MM_PER, rpm_from_rad_s

#: kinds of faces that are planes or of revolution
REVOLVED = ("plane", "cylinder", "cone", "sphere", "torus", "of revolution")
#: diameters that a shop has [mm], largest first
DIAMETERS = (20.0, 16.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.5)
#: share of the area that the guessed cutter must reach
REACH = 0.97
#: a channel is narrow below ROOM cutters: each pass takes very little there, and long ones are not possible; it is one
#: if it holds more than CHANNEL diameters squared, which a corner of 15 deg does not, or joins parts of the area
ROOM, CHANNEL = 1.3, 1.0
#: radial depth over the diameter, axial depth over the diameter, feed per tooth over the diameter
RADIAL, AXIAL, FEED = 0.15, 0.5, 0.005
#: axial depth over the diameter of cutters up to SMALL [mm], whose edge forces weigh more
AXIAL_SMALL, SMALL = 0.3, 1.5
#: material left on the wall of a pocket over the diameter
ALLOWANCE = 0.025
#: length of flutes over the diameter, as short end mills have it; least length [mm] between them and the holder
FLUTES, NECK = 1.5, 2.0
#: cutting speed [m/min], for aluminium with carbide
CUTTING_M_MIN = 200.0
#: a wall is thin below this share of the diameter, both sides together
THIN_WALL = 0.2
#: layers that a note names
LISTED = 8
#: points along a contour that the size of the cutter is found on
POINTS = 400
#: what is made of contours within contours
NESTED = "the outermost are walls of pockets, those within them are islands that stay; part.layers chooses others"
#: gaps [mm] of a drawing that are flaws, if they are no greater than this share of its width and height
GAPS, GAP_SHARE = (0.02, 0.05, 0.1, 0.2, 0.5), 0.01
#: of an open contour: largest diameter [mm], what its finish may leave [mm]; radius of the lead-in and depth of the
#: semi-finish pass over the diameter
OPEN_DIAMETER, OPEN_TOLERANCE_MM, LEAD, SEMIFINISH = 10.0, 0.02, 0.3, 0.1


def draft_drawing(file: Path, folder: Path, machine: str | None = None) -> Draft:
    """Return the draft of a pocket if the drawing has closed contours, else of a contour.

    Raises
    ------
    InputError
        The drawing cannot be read, or no cutter fits it.
    """
    on = machine_of(machine)
    drawing, contours, entries = _read_contours(file, on)
    part = DraftTable("part", (Entry("file", relative(file, folder)), *entries, *_origin(contours, on)))
    top = Entry("top_mm", 0.0, "a drawing has no height: its plane is the top", True)
    tables = (part, DraftTable("stock", (top,)))
    notes = tuple(str(f) for f in drawing.findings[:8])
    if all(c.closed for c in contours):
        size, region, narrow = cutter_for(contours)
        rest = planned_tables(on, machine, size, axial_depth(size), "pocket", narrow=narrow)
        if len(contours) > 1:
            notes = (f"{len(contours)} closed contours: {NESTED}", *notes)
        return Draft(
            f"Clear the pocket of {file.name}: {number_text(region)} mm2 at constant engagement.",
            (*tables, *rest),
            notes,
        )
    size, side = _side_of(contours)
    rest = planned_tables(on, machine, size, axial_depth(size), "contour", side)
    return Draft(f"Finish the contours of {file.name} at limited engagement.", (*tables, *rest), notes)


def _read_contours(file: Path, machine: Machine) -> tuple[Drawing, Sequence[Contour], list[Entry]]:
    """The drawing, the contours that are milled, and the entries of the part that choose them."""
    drawing, entries = _read(file, machine)
    layers = sorted(set(drawing.layers))
    whole = [layer for layer in layers if all(c.closed for c in _of_layer(drawing, layer))]
    if len(whole) < len(layers) and whole:
        best = max(whole, key=lambda layer: sum(abs(c.area) for c in _of_layer(drawing, layer)))
        entries.append(Entry("layers", [best], f"the closed contours of those of {_list_names(layers)}", True))
        return drawing, _of_layer(drawing, best), entries
    example = str(layers[:1]).replace("'", '"')
    note = f"layers that are read; the drawing has {_list_names(layers)}"
    entries.append(Entry("layers", note=note, example=example))
    if whole:
        return drawing, drawing.contours, entries
    joined = _join_gaps(file, drawing, {e.key: e.value for e in entries if e.guess})
    if joined is not None:
        gap, drawing = joined
        why = f"ends of its lines are up to {gap:g} mm apart, they meet half-way"
        return drawing, drawing.contours, [*entries, Entry("join_mm", gap, why, True)]
    closed = [c for c in drawing.contours if c.closed]
    if not closed:
        return drawing, drawing.contours, entries
    why = f"{len(drawing.contours) - len(closed)} of {len(drawing.contours)} chains of lines close no contour"
    return drawing, closed, [*entries, Entry("open_chains", "dropped", why, True)]


def _list_names(names: Sequence[str]) -> str:
    """The first names of a list, and how many more there are."""
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more


def _origin(contours: Sequence[Contour], machine: Machine) -> list[Entry]:
    """The middle of a drawing as the origin where it lies beyond the travel of the machine.

    Raises
    ------
    InputError
        It is wider than the travel.
    """
    if machine.chain.rotary:
        return []
    boxes = np.array([c.bounds for c in contours])
    low, high = boxes[:, 0:2].min(axis=0), boxes[:, 2:4].max(axis=0)
    least, most = np.array(machine.limits[:2]).T
    if bool(((low >= least) & (high <= most)).all()):
        return []
    for k, axis in enumerate("XY"):
        if high[k] - low[k] > most[k] - least[k]:
            raise InputError(
                f"the drawing is {high[k] - low[k]:.6g} mm wide in {axis}, machine {machine.name} travels "
                f"{most[k] - least[k]:g} mm: name a larger one (--on of init, --machine of simulate), or check "
                "the unit"
            )
    middle = [round(float(v), 3) for v in 0.5 * (low + high) - 0.5 * (least + most)]
    return [Entry("origin_mm", middle, f"the middle: the drawing lies beyond the travel of {machine.name}", True)]


def _join_gaps(file: Path, drawing: Drawing, unit: dict[str, str]) -> tuple[float, Drawing] | None:
    """The narrowest gap [mm] that closes all contours of a drawing, and it read so; None: none does."""
    size = float(_extent(drawing.contours).sum())
    for gap in (g for g in GAPS if g <= GAP_SHARE * size):
        wider = read_dxf(file, units=unit.get("units"), units_if_unstated=unit.get("units_if_unstated"), join_mm=gap)
        if all(c.closed for c in wider.contours):
            return gap, wider
    return None


def _side_of(contours: Sequence[Contour]) -> tuple[float, str]:
    """Diameter [mm] of the largest common cutter that reaches all of open contours, and their side on which it does.

    Raises
    ------
    InputError
        None does.
    """
    for d in (d for d in DIAMETERS if d <= OPEN_DIAMETER):
        for side in ("left", "right"):
            try:
                walls = walls_of(contours, side, "down", run_on_length(0.5 * d, LEAD * d, 1))
                centre_paths(walls, 0.5 * d, OPEN_TOLERANCE_MM)
            except ChiploadError as err:
                why = err
            else:
                return d, side
    raise InputError(
        f"no cutter from {DIAMETERS[-1]:g} to {OPEN_DIAMETER:g} mm reaches all of the open contours: {why}"
    )


def draft_model(file: Path, folder: Path, machine: str | None = None) -> Draft:
    """Return the draft of a pocket on the floor of a model, or of a thin wall if it has no horizontal plane.

    Raises
    ------
    InputError
        The model cannot be read.
    """
    model = read_faces(file, "part.file")
    # a wheel has curved faces that are none of revolution
    if sum(f.kind not in REVOLVED for f in model.faces) >= 3:
        wheel = draft_wheel(file, folder, machine)
        if wheel is not None:
            return wheel
    planes = [f for f in model.faces if f.kind == "plane" and float(f.high[2] - f.low[2]) < 1e-6]
    if not planes:
        from chipload.jobs.drafts.blade import draft_blade_model

        return draft_blade_model(file, folder, model, machine)
    top = max(float(f.high[2]) for f in model.faces)
    floors = _floors(file, planes, top)
    if not floors:
        raise InputError(f"{file.name}: no horizontal face whose edges close: turn the part, or draw it as DXF")
    level, drawing, size, region, narrow = floors[0]
    axial = min(axial_depth(size), top - level) if top - level > 1e-3 else axial_depth(size)
    others = ", ".join(f"{z:g}" for z in sorted({round(float(f.low[2]), 3) for f in planes}, reverse=True)[:12])
    part = DraftTable(
        "part",
        (
            Entry("file", relative(file, folder)),
            Entry("face_z_mm", round(level, 6), f"the largest floor; planes are at {others} mm", True),
        ),
    )
    depth = top - level if top - level > axial + 1e-3 else 0.0
    stands = "the top of the model" if top > level + 1e-3 else "one depth of cut above the face"
    stock = DraftTable("stock", (Entry("top_mm", round(level + (depth or axial), 6), stands, True),))
    tables = (
        part,
        stock,
        *planned_tables(machine_of(machine), machine, size, axial, "pocket", narrow=narrow, depth=depth),
    )
    notes = (*thin_rings(model.faces), *found_lines(file, level, size), *(str(f) for f in drawing.findings[:8]))
    return Draft(f"Clear the face at z = {level:g} mm of {file.name}: {number_text(region)} mm2.", tables, notes)


def thin_rings(faces: Sequence[Face]) -> tuple[str, ...]:
    """A note where a model is a thin tube or cone about Z, whose wall is milled by a torque job, not by this one.

    Its largest two curved faces are such walls where both have square boxes about one middle, and the sides of the
    boxes differ by less than ``THIN_WALL`` of the outer one.
    """
    curved = sorted((f for f in faces if f.kind in ("cylinder", "cone")), key=lambda f: -f.area)[:2]
    if len(curved) < 2:
        return ()
    sides = [f.high[:2] - f.low[:2] for f in curved]
    middles = [0.5 * (f.low[:2] + f.high[:2]) for f in curved]
    round_z = all(abs(s[0] - s[1]) <= 1e-3 * s[0] for s in sides)
    outer, inner = max(s[0] for s in sides), min(s[0] for s in sides)
    tall = min(float(f.high[2] - f.low[2]) for f in curved)
    if not round_z or float(np.abs(middles[0] - middles[1]).max()) > 1e-3 * outer:
        return ()
    if not 0.0 < outer - inner < THIN_WALL * outer or tall < outer - inner:
        return ()
    kind = "cone" if "cone" in [f.kind for f in curved] else "tube"
    wide = " at its wide end" if kind == "cone" else ""
    return (
        f"the model is a {kind} of {0.25 * (outer + inner):.5g} mm mean radius{wide} with a wall of about "
        f"{0.5 * (outer - inner):.4g} mm: this draft clears its end face; to finish the wall, write a torque job "
        f"([torque_control]), beginning with the example: chipload example {kind}",
    )


def _floors(file: Path, planes: Sequence[Face], top: float) -> list[tuple[float, Drawing, float, float, bool]]:
    """Heights, drawing, cutter, area and whether it is narrow; floors below the top first, large ones first."""
    areas: dict[float, float] = {}
    for face in planes:
        z = round(float(face.low[2]), 3)
        areas[z] = areas.get(z, 0.0) + face.area
    below = sorted((z for z in areas if z < top - 1e-3), key=lambda z: -areas[z])
    bottom = min(areas)
    order = [*(z for z in below if z > bottom), *(z for z in areas if z >= top - 1e-3), bottom]
    for z in dict.fromkeys(order):
        try:
            drawing = read_step_face(file, z_mm=z)
            if drawing.contours and all(c.closed for c in drawing.contours):
                return [(z, drawing, *cutter_for(drawing.contours))]
        except InputError:
            continue
    return []


def _read(file: Path, machine: Machine) -> tuple[Drawing, list[Entry]]:
    """The drawing, and the unit that was taken where it names none, or one by which it is wider than the travel."""
    try:
        drawing = read_dxf(file)
    except InputError as err:
        if "unit" not in str(err):
            raise
        why = "the drawing names no unit"
        return read_dxf(file, units_if_unstated="mm"), [Entry("units_if_unstated", "mm", why, True)]
    wide = _extent(drawing.contours)
    travel = np.ptp(np.array(machine.limits[:2]), axis=1)
    if MM_PER[drawing.units] > 1.0 and bool((wide > travel).any()):
        plain = read_dxf(file, units="mm")
        if bool((_extent(plain.contours) <= travel).all()):
            why = f"by the unit that it states, {drawing.units}, it is {wide[0]:.6g} by {wide[1]:.6g} mm"
            return plain, [Entry("units", "mm", why, True)]
    return drawing, []


def _extent(contours: Sequence[Contour]) -> NDArray[np.float64]:
    """(2,) width of contours in X and Y [mm]."""
    boxes = np.array([c.bounds for c in contours])
    out: NDArray[np.float64] = boxes[:, 2:4].max(axis=0) - boxes[:, 0:2].min(axis=0)
    return out


def _of_layer(drawing: Drawing, layer: str) -> list[Contour]:
    return [c for c, own in zip(drawing.contours, drawing.layers, strict=True) if own == layer]


def cutter_for(contours: Sequence[Contour]) -> tuple[float, float, bool]:
    """Diameter [mm] of the largest cutter that reaches nearly all, with room in its channels if half of it has, the
    area [mm^2], and whether channels are narrow for it all the same.
    """
    area: Any = shapely.Polygon()
    for c in even_odd(contours)[0]:
        points = c.at(np.linspace(0.0, c.length, POINTS, endpoint=False))[0]
        area = area.symmetric_difference(shapely.Polygon(points).buffer(0.0))
    whole = float(area.area)
    if not whole > 0.0:
        raise InputError("the contours enclose no area")
    if not float(_reachable_area(area, DIAMETERS[-1]).area) > 0.0:
        raise InputError(
            f"the contours enclose {number_text(whole, 3)} mm2, too narrow for a cutter of {DIAMETERS[-1]:g} "
            "mm: if the drawing "
            "is in another unit than it states, write the job by hand with part.units"
        )
    able = [d for d in DIAMETERS if float(_reachable_area(area, d).area) >= REACH * whole] or [DIAMETERS[-1]]
    near = [d for d in able if d >= 0.5 * able[0]]
    roomy = next((d for d in near if not _narrow(area, d)), None)
    return (near[-1], whole, True) if roomy is None else (roomy, whole, False)


def _reachable_area(area: Any, d: float) -> Any:
    """Return the part of an area that a cutter of diameter d [mm] reaches."""
    return area.buffer(-0.5 * d).buffer(0.5 * d)


def _narrow(area: Any, d: float) -> bool:
    """Return whether an area has channels that are too narrow for a cutter of diameter d [mm]."""
    wide = ROOM * d
    unreached = shapely.get_parts(_reachable_area(area, d).difference(_reachable_area(area, wide)))
    if max((float(piece.area) for piece in unreached), default=0.0) > CHANNEL * d * d:
        return True
    centres, apart = area.buffer(-0.5 * d), area.buffer(-0.5 * wide)
    return len(shapely.get_parts(apart)) > len(shapely.get_parts(centres))


def axial_depth(d: float) -> float:
    """Axial depth [mm] of a cutter of diameter d [mm]."""
    return (AXIAL if d > SMALL else AXIAL_SMALL) * d


def machine_of(name: str | None) -> Machine:
    """Return the machine of a draft: a shipped one by its name, that of a file, or a usual one."""
    if name is None:
        return machine_named("vmc")
    return read_machine(name) if name.lower().endswith(".toml") else machine_named(name)


def planned_tables(
    machine: Machine,
    named: str | None,
    d: float,
    axial: float,
    kind: str,
    side: str = "left",
    narrow: bool = False,
    depth: float = 0.0,
) -> tuple[DraftTable, ...]:
    """Machine, material, cutter, operation and limits; ``depth`` [mm] of a pocket of several levels."""
    flutes = 2 if d < 4.0 else 3
    least, most = rpm_from_rad_s(machine.spindle_min), rpm_from_rad_s(machine.spindle_max)
    wanted = 1000.0 * CUTTING_M_MIN / (math.pi * d)
    speed = round(min(max(wanted, least), most), -1)
    feed = round(min(FEED * d * flutes * speed, 60.0 * machine.feed_max), 0)
    radial = round(RADIAL * d, 4)
    key = "file" if named is not None and named.lower().endswith(".toml") else "name"
    own = Entry(key, named) if named is not None else Entry("name", "vmc", "chipload machines lists all", True)
    cut = f"{number_text(math.pi * d * speed / 1000.0, 3)} m/min"
    cut += ", carbide in aluminium" if least <= wanted <= most else f", as far as the spindle of {machine.name} turns"
    entries = [
        Entry("kind", kind),
        Entry("cutter", 1),
        Entry("milling", "down"),
        Entry(
            "radial_depth_mm",
            radial if kind == "pocket" else 0.1,
            f"{RADIAL:g} of the diameter" if kind == "pocket" else "of the finish pass",
            True,
        ),
        Entry("axial_depth_mm", round(axial, 4), "greatest of a level" if depth else "one depth of cut", True),
        *([Entry("depth_mm", round(depth, 6), "from the top of the model to the face", True)] if depth else []),
        Entry("feed_mm_min", feed, f"{FEED * d:.3g} mm a tooth", True),
        Entry("speed_rpm", speed, cut, True),
        Entry("step_mm", max(0.02 * d, 0.05)),
        Entry("clearance_mm", 5.0, "height of rapids above the stock", True),
    ]
    if kind == "pocket" and narrow:
        entries += [
            Entry("strategies", ["trochoidal"], "circles: channels are hardly wider than the cutter", True),
            Entry("use", "trochoidal"),
        ]
    if kind == "pocket":
        entries.append(Entry("allowance_mm", round(ALLOWANCE * d, 3), "left on the wall for finishing", True))
        engagement = math.degrees(math.acos(1.0 - 2.0 * RADIAL))
        limit = Entry("engagement_deg", round(1.1 * engagement, 1), "a tenth above that along a straight wall", True)
    else:
        entries += [
            Entry("side", side, "of the contour in its direction; or inside, outside", True),
            Entry("strategies", ["plain", "backward"]),
            Entry("use", "backward"),
            Entry("joint", "sharp"),
            Entry("semifinish_depth_mm", round(SEMIFINISH * d, 3), "radial depth of the pass before", True),
            Entry("tolerance_mm", OPEN_TOLERANCE_MM),
            Entry("lead_mm", round(LEAD * d, 3), "radius of the lead-in", True),
        ]
        limit = Entry("engagement_deg", 30.0, "a finish pass", True)
    limits = [limit]
    if machine.torque is not None:
        limits.append(Entry("torque_nm", machine.torque / 1000.0, f"of the spindle of {machine.name}"))
    limits.append(Entry("force_xy_n", note="across the axis", example="500.0"))
    why = (
        f"the largest that reaches {100.0 * REACH:g} % of the area, less where channels are narrow"
        if kind == "pocket"
        else "a common size"
    )
    flute = round(max(FLUTES * d, max(axial, depth) + 1.0), 3)
    above = f"no file states it; flutes and {'one diameter' if d >= NECK else f'{NECK:g} mm'}"
    cutter = cutter_table(1, [])
    sized = tuple(
        Entry("diameter_mm", d, why, True) if e.key == "diameter_mm"
        else Entry(e.key, flutes, e.note, True) if e.key == "flutes"
        else Entry(e.key, flute, "no file states it; a short one that reaches the floor", True)
        if e.key == "flute_length_mm"
        else Entry(e.key, round(flute + max(d, NECK), 3), above, True) if e.key == "overhang_mm"
        else e
        for e in cutter.entries
    )  # fmt: skip
    material = Entry("name", "al7075-t6", "the file names no material; chipload materials lists all", True)
    return (
        DraftTable("machine", (own,)),
        DraftTable("material", (material,)),
        DraftTable("cutter", sized, repeated=True),
        DraftTable("operation", tuple(entries), repeated=True),
        DraftTable("limits", tuple(limits)),
    )
