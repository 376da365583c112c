"""Jobs whose shank, holder, rapids, pieces or walls a shop would call wrong, and their neighbours that are right."""

from __future__ import annotations

import math
from typing import Any

import shapely
import trimesh

from adversary.base import Case, Change, Job, changes, cutter, program, replaced, stated

HEAD = "G21 G90 G17 G94\nG54\nT1 M6\nG43 H1\nS6000 M3\n"
END = "G0 Z10\nM5\nM2\n"


def text(*ways: str) -> Change:
    """Replace the program by some ways."""
    return program(HEAD + "\n".join(ways) + "\n" + END)


def slots(*depths: float, y: float = 20.0) -> list[str]:
    """Slots along x, each from beside the block."""
    return [w for z in depths for w in (f"G0 X-40 Y{y} Z10", f"G0 Z{z}", "G1 X100 F900", "G0 Z10")]


def across(*depths: float, x: float = 30.0) -> list[str]:
    """Slots along y."""
    return [w for z in depths for w in (f"G0 X{x} Y-10 Z10", f"G0 Z{z}", "G1 Y50 F900", "G0 Z10")]


def stock(**keys: Any) -> Change:
    """State keys of the stock."""
    return stated("stock", **keys)


def shank(diameter: float, flutes: float = 6.0) -> Change:
    """A slot 15 mm deep in three levels, by a cutter of 10 mm with short flutes."""
    return changes(cutter(flute_length_mm=flutes, shank_diameter_mm=diameter), text(*slots(-5.0, -10.0, -15.0)))


def holder(overhang: float, *parts: tuple[float, float], depth: float = 15.0) -> Change:
    """A slot in levels of 5 mm down to a depth, by a cutter with a holder."""
    levels = [-5.0 * k for k in range(1, int(depth / 5.0) + 1)]
    return changes(
        cutter(flute_length_mm=min(26.0, overhang), overhang_mm=overhang, holder_mm=list(parts)), text(*slots(*levels))
    )


def around(*, tab: float = 0.0, floor: float = 0.0) -> list[str]:
    """A square of 16 mm that is cut out, with a tab of a height or a floor, and then milled on its top."""
    deep = -8.0 if floor == 0.0 else -8.0 + floor
    high = [f"G1 Z{tab - 8.0}", "G1 X26", f"G1 Z{deep}"] if tab else []
    return [
        "G0 X15 Y7 Z10", f"G1 Z{deep} F300", "G1 X41 F900", "G1 Y33", *high, "G1 X15", "G1 Y7", "G0 Z10",
        "G0 X10 Y20", "G0 Z1", "G1 X14 Z-1", "G1 X48 F900",
    ]  # fmt: skip


def _switch(name: str) -> Change:
    return stated("checks", **{name: False})


AFTER = ["G0 X70 Y20 Z10", "G0 Z-5", "G1 X-10 F900"]
#: a block 8 mm high, which is cut through at once
PLATE = stock(low_mm=(0.0, 0.0, -8.0))
RAPID = "G1 X70 F900"

CASES = (
    Case("shank-20", "a shank of 20 mm rubs 5 mm deep in both walls", shank(20.0), "exceeds", "collision"),
    Case("shank-12", "a shank of 12 mm rubs 1 mm deep", shank(12.0), "exceeds", "collision"),
    Case("shank-10.4", "a shank of 10.4 mm rubs 0.2 mm deep", shank(10.4), "exceeds", "collision"),
    Case("shank-neck", "nothing: a relieved neck of 9 mm", shank(9.0), "holds", ""),
    Case("shank-same", "nothing: a shank as wide as the cutter", shank(10.0), "holds", ""),
    Case("shank-long", "nothing: flutes above the block", shank(20.0, 16.0), "holds", ""),
    Case(
        "shank-off", "the check is switched off", changes(shank(20.0), _switch("shank_in_stock")), "unchecked",
        "check shank_in_stock: switched off by the job",
    ),
    Case("holder-3", "a holder of 50 mm goes 3 mm into the block", holder(12.0, (40.0, 50.0)), "exceeds", "collision"),
    Case(
        "holder-steps", "the second part of a holder goes 2 mm into the block",
        holder(10.0, (3.0, 10.0), (20.0, 40.0)), "exceeds", "collision",
    ),
    Case("holder-above", "nothing: a holder 1 mm above the block", holder(16.0, (40.0, 50.0)), "holds", ""),
    Case("holder-slim", "nothing: a holder that fits into the slot", holder(12.0, (40.0, 10.0)), "holds", ""),
    Case(
        "holder-unknown", "the holder is not stated", lambda job: None, "unchecked", "holders of tools 1: not stated"
    ),
    Case(
        "rapid-0.49", "a rapid 0.49 mm deep", replaced("G0 Z-2\n" + RAPID, "G0 Z-0.49\nG0 X70"), "exceeds", "rapid-cuts"
    ),
    Case(
        "rapid-back", "nothing: a rapid back through the slot", replaced(RAPID, RAPID + "\nG0 X-10"), "holds", ""
    ),
    Case(
        "part-off", "a half of the block is cut free and milled on", text(*across(-8.0, -16.0, -20.0), *AFTER),
        "unproven", "loose-stock",
    ),
    Case(
        "part-off-contour", "a square is cut out of the block, then milled on its top",
        changes(PLATE, text(*around())), "unproven", "loose-stock",
    ),
    Case("part-off-tab", "nothing: a tab of 2 mm holds it", changes(PLATE, text(*around(tab=2.0))), "holds", ""),
    Case("part-off-floor", "nothing: a floor of 0.3 mm", changes(PLATE, text(*around(floor=0.3))), "holds", ""),
    Case("part-off-last", "nothing: cut free at the end", text(*across(-8.0, -16.0, -20.0)), "holds", ""),
    Case(
        "part-off-before", "nothing: milled first, then cut free", text(*AFTER, "G0 Z10", *across(-8.0, -16.0, -20.0)),
        "holds", "",
    ),
    Case(
        "plate-standing", "a plate 3 mm thick stands 60 mm high and is milled on its upper edge",
        stock(low_mm=(0.0, 18.5, -60.0), high_mm=(60.0, 21.5, 0.0)), "unproven", "slender-wall",
    ),
    Case(
        "bar-standing", "nothing: a bar of 20 x 20 mm stands 60 mm high",
        stock(low_mm=(0.0, 10.0, -60.0), high_mm=(20.0, 30.0, 0.0)), "holds", "",
    ),
    Case(
        "slender-wall", "a wall 2 mm thick and 15 mm high is left, which bends",
        text(*slots(-7.5, -15.0, y=14.0), *slots(-7.5, -15.0, y=26.0)), "unproven", "slender-wall",
    ),
    Case(
        "slender-wall-border", "the same at the border of the block", text(*slots(-7.5, -15.0, y=7.0)), "unproven",
        "slender-wall",
    ),
    Case(
        "thick-wall", "nothing: a wall of 4 mm", text(*slots(-7.5, -15.0, y=13.0), *slots(-7.5, -15.0, y=27.0)),
        "holds", "",
    ),
    Case(
        "slender-wall-allowed", "nothing: a slenderness of 10 is allowed",
        changes(
            stated("checks", wall_slenderness=10.0), text(*slots(-7.5, -15.0, y=14.0), *slots(-7.5, -15.0, y=26.0))
        ),
        "holds", "",
    ),
)  # fmt: skip


def part(
    spacing: float = 100.0, *, scale: float = 1.0, shift: float = 0.0, limit: float | None = 0.05, depth: float = 2.0
) -> Change:
    """The block with a slot 10 mm wide along x at Y20 as finished part, of triangles from corner to corner."""

    def change(job: Job) -> None:
        profile = [(0, -20), (40, -20), (40, 0), (25, 0), (25, -depth), (15, -depth), (15, 0), (0, 0)]
        body = trimesh.creation.extrude_polygon(shapely.Polygon(profile), 60.0)
        # the profile is in Y and Z, the block along X
        body.apply_transform([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
        body.apply_translation([0.0, 0.0, shift])
        body.apply_scale(scale)
        job.files["part.stl"] = body.export(file_type="stl")
        job.tables["part"] = {"file": "part.stl", "units": "mm", "spacing_mm": spacing}
        if limit is not None:
            job.tables["limits"]["gouge_mm"] = limit

    return change


def hole(depth: float, end: str = END) -> Change:
    """The slot, then a plunge into the finished face at (33, 7)."""
    return program(HEAD + "\n".join([*slots(-2.0), "G0 X33 Y7", f"G1 Z{-depth} F100"]) + "\n" + end)


GOUGES = (
    Case("gouge-100", "a plunge 3 mm into the finished face, points 100 mm apart", changes(part(), hole(3.0)),
         "exceeds", "gouge_mm"),
    Case("gouge-20", "the same, points 20 mm apart", changes(part(20.0), hole(3.0)), "exceeds", "gouge_mm"),
    Case("gouge-shallow", "a plunge 0.08 mm deep", changes(part(), hole(0.08)), "exceeds", "gouge_mm"),
    Case("gouge-ball", "a plunge of a ball nose 0.1 mm deep",
         changes(part(depth=1.0), hole(0.1), cutter(corner_radius_mm=5.0)), "exceeds", "gouge_mm"),
    Case("gouge-slot", "the slot is 0.1 mm too deep", changes(part(depth=1.9)), "exceeds", "gouge_mm"),
    Case("gouge-default", "3 mm into the face of a part without a limit on the gouge",
         changes(part(limit=None), hole(3.0)), "exceeds", "gouge_mm"),
    Case("gouge-switched-off", "the same with the check off",
         changes(part(limit=None), hole(3.0), _switch("gouge")), "unchecked", "check gouge: switched off by the job"),
    Case("gouge-none", "nothing: the part as programmed", part(), "holds", ""),
    Case("gouge-0.02", "nothing: 0.02 mm deep at a limit of 0.05", changes(part(), hole(0.02)), "holds", ""),
    Case("gouge-unit", "the part is 25.4 times too small", part(scale=1.0 / 25.4), "unproven", "part-misplaced"),
    Case("gouge-inch", "the part is 25.4 times too large", part(scale=25.4), "exceeds", "gouge_mm"),
    Case("gouge-outside", "the part stands 5 mm out of its stock", part(shift=5.0), "exceeds", "gouge_mm"),
    Case("gouge-under", "the part stands 30 mm under its stock", part(shift=-30.0), "unproven", "part-misplaced"),
)  # fmt: skip
CASES = (*CASES, *GOUGES)


def tilted(shank_mm: float) -> Change:
    """Slots along y with the axis tilted by 20 deg towards x, as cutter locations on a five-axis machine."""

    def change(job: Job) -> None:
        axis = f"{math.sin(math.radians(20.0)):.9f},0,{math.cos(math.radians(20.0)):.9f}"
        rows = ["PARTNO/T", "UNITS/MM", "LOADTL/1", "SPINDL/6000,CLW", "MULTAX/ON", "RAPID", f"GOTO/30,-30,20,{axis}"]
        for z in (-2.0, -4.0):
            rows += ["RAPID", f"GOTO/30,-30,{z},{axis}", "FEDRAT/900,MMPM", f"GOTO/30,70,{z},{axis}"]
            rows += ["RAPID", f"GOTO/30,70,40,{axis}", "RAPID", f"GOTO/30,-30,40,{axis}"]
        job.files["p.apt"] = "\n".join([*rows, "SPINDL/OFF", "FINI"]) + "\n"
        job.tables["program"] = {"file": "p.apt"}
        job.tables["machine"] = {"name": "xyzbc-trunnion"}
        job.cutter.update(flute_length_mm=8.0, shank_diameter_mm=shank_mm)

    return change


CASES = (
    *CASES,
    # its lowest place is at -4 + 8 cos 20 - 20 sin 20 deg = -3.3 mm
    Case("shank-tilted", "a shank of 40 mm, tilted by 20 deg, goes 3 mm below the top", tilted(40.0), "exceeds",
         "collision"),
    Case("shank-tilted-slim", "nothing: a shank as wide as the cutter", tilted(10.0), "holds", ""),
)  # fmt: skip


def fixtures(*bounds: tuple[float, ...]) -> Change:
    """Blocks as fixtures, each by its low and its high corner."""

    def change(job: Job) -> None:
        bodies = job.tables.setdefault("fixture", [])
        for corners in bounds:
            name = f"fixture{len(bodies)}.stl"
            body = trimesh.creation.box(bounds=[corners[:3], corners[3:]])
            job.files[name] = body.export(file_type="stl")
            bodies.append({"file": name, "units": "mm", "spacing_mm": 2.0})

    return change


def jaws(low: float, high: float, away: float = 0.0) -> Change:
    """Two jaws on the long sides between two places along x."""
    return fixtures((low, -10.0, -20.0, high, -away, -10.0), (low, 40.0 + away, -20.0, high, 50.0, -10.0))


def clamps(*places: tuple[float, float], directions: str = "xyz") -> Change:
    """Clamps of the lowest 5 mm between two places along x; the others than the first hold in some directions."""

    def change(job: Job) -> None:
        each = [{"low_mm": (a, 0.0, -20.0), "high_mm": (b, 40.0, -15.0)} for a, b in places]
        each[1:] = [{**clamp, "directions": directions} for clamp in each[1:]]
        job.tables["workpiece"] = {"modulus_gpa": 71.0, "poisson": 0.33, "cell_mm": 10.0, "clamp": each}

    return change


PARTED = text(*across(-8.0, -16.0, -20.0), *AFTER)
CASES = (
    *CASES,
    Case("part-off-vise", "nothing: a vise holds both halves", changes(PARTED, jaws(0, 20), jaws(40, 60)), "holds", ""),
    Case("part-off-half-vise", "a vise holds one half of two", changes(PARTED, jaws(0, 20)), "unproven", "loose-stock"),
    Case("part-off-open-vise", "the jaws stand 1 mm away from one half",
         changes(PARTED, jaws(0, 20), jaws(40, 60, away=1.0)), "unproven", "loose-stock"),
    Case("part-off-parallels", "both halves lie on parallels, without a clamp",
         changes(PARTED, fixtures((0, 0, -30, 20, 40, -20), (40, 0, -30, 60, 40, -20))), "unproven", "loose-stock"),
    Case("part-off-straps", "nothing: a strap on each half",
         changes(PARTED, fixtures((0, 0, 0, 8, 6, 4), (52, 0, 0, 60, 6, 4))), "holds", ""),
    Case("part-off-one-strap", "a strap on one half of two", changes(PARTED, fixtures((0, 0, 0, 8, 6, 4))), "unproven",
         "loose-stock"),
    Case("part-off-clamps", "nothing: a clamp on each half", changes(PARTED, clamps((0, 5), (55, 60))), "holds", ""),
    Case("part-off-one-clamp", "a clamp on one half of two", changes(PARTED, clamps((0, 5))), "unproven",
         "loose-stock"),
    Case("part-off-sliding-clamp", "a clamp that holds one half in height only",
         changes(PARTED, clamps((0, 5), (55, 60), directions="z")), "unproven", "loose-stock"),
)  # fmt: skip


def leaning_slots(*slots: tuple[float, float], degrees: float = 20.0) -> Change:
    """Slots along y with the axis leaning towards x: how far each is from X30 Y20 Z0 across the axis, and its depth
    along the axis.
    """

    def change(job: Job) -> None:
        lean = math.radians(degrees)
        axis = f"{math.sin(lean):.9f},0,{math.cos(lean):.9f}"
        rows = ["PARTNO/T", "UNITS/MM", "LOADTL/1", "SPINDL/6000,CLW", "MULTAX/ON", "RAPID", f"GOTO/30,-30,30,{axis}"]
        for across_mm, deep in slots:
            x, z = (30.0 + across_mm * math.cos(lean) - deep * math.sin(lean),
                    -across_mm * math.sin(lean) - deep * math.cos(lean))  # fmt: skip
            high = f"{x + 40.0 * math.sin(lean):.6f}", f"{z + 40.0 * math.cos(lean):.6f}"
            rows += ["RAPID", f"GOTO/{high[0]},-30,{high[1]},{axis}", "RAPID", f"GOTO/{x:.6f},-30,{z:.6f},{axis}"]
            rows += [
                "FEDRAT/900,MMPM",
                f"GOTO/{x:.6f},70,{z:.6f},{axis}",
                "RAPID",
                f"GOTO/{high[0]},70,{high[1]},{axis}",
            ]
            rows += ["RAPID", f"GOTO/{high[0]},-30,{high[1]},{axis}"]
        job.files["p.apt"] = "\n".join([*rows, "SPINDL/OFF", "FINI"]) + "\n"
        job.tables["program"] = {"file": "p.apt"}
        job.tables["machine"] = {"name": "xyzbc-trunnion"}
        job.cutter.update(shank_diameter_mm=10.0)

    return change


THROUGH = leaning_slots((0.0, 8.0), (0.0, 16.0), (0.0, 26.0), (12.0, 4.0))
DEEP = fixtures((0.0, -10.0, -40.0, 8.0, 0.0, -10.0), (0.0, 40.0, -40.0, 8.0, 50.0, -10.0),
                (48.0, -10.0, -40.0, 60.0, 0.0, -10.0), (48.0, 40.0, -40.0, 60.0, 50.0, -10.0))  # fmt: skip
CASES = (
    *CASES,
    Case("part-off-leaning", "a half is cut free with a leaning axis, then milled on", THROUGH, "unproven",
         "loose-stock"),
    Case("part-off-leaning-vise", "nothing: a vise holds both halves", changes(THROUGH, DEEP), "holds", ""),
    Case("part-off-leaning-floor", "nothing: a floor of 1 mm is left",
         leaning_slots((0.0, 8.0), (0.0, 16.0), (0.0, 18.3), (12.0, 4.0)), "holds", ""),
    Case("wall-leaning", "a wall 1.5 mm thick and 16 mm high between two slots with a leaning axis",
         leaning_slots((-5.75, 8.0), (5.75, 8.0), (-5.75, 16.0), (5.75, 16.0)), "unproven", "slender-wall"),
    Case("wall-leaning-thick", "nothing: the same wall 5 mm thick",
         leaning_slots((-7.5, 8.0), (7.5, 8.0), (-7.5, 16.0), (7.5, 16.0)), "holds", ""),
)  # fmt: skip


def corner(reach_mm: float, step_mm: float, degrees: float = 0.0) -> Change:
    """A slot along y, then a rapid past the upright edge at X60 Y0, which reaches so far into the path of the cutter
    (by less where the axis leans towards x).
    """

    def change(job: Job) -> None:
        lean = math.radians(degrees)
        axis = f"{math.sin(lean):.9f},0,{math.cos(lean):.9f}"
        x, y = 60.0 + math.sqrt(0.5) * (5.0 - reach_mm), -math.sqrt(0.5) * (5.0 - reach_mm)
        # the edge is passed where no instant of a step stands if the instants are 1.2 mm apart
        places = [(x + at * math.sqrt(0.5), y + at * math.sqrt(0.5)) for at in (-40.3, 59.7)]
        z = -2.0 + 5.0 * math.sin(lean)
        rows = ["PARTNO/T", "UNITS/MM", "LOADTL/1", "SPINDL/6000,CLW", "MULTAX/ON", "RAPID", f"GOTO/30,-30,80,{axis}"]
        rows += ["RAPID", f"GOTO/30,-30,{z:.6f},{axis}", "FEDRAT/900,MMPM", f"GOTO/30,70,{z:.6f},{axis}"]
        rows += ["RAPID", f"GOTO/30,70,80,{axis}"]
        for (a, b), heights in zip(places, ((80.0, -8.0), (-8.0, 80.0)), strict=True):
            rows += [line for h in heights for line in ("RAPID", f"GOTO/{a:.6f},{b:.6f},{h},{axis}")]
        job.files["p.apt"] = "\n".join([*rows, "SPINDL/OFF", "FINI"]) + "\n"
        job.tables["program"] = {"file": "p.apt"}
        job.tables["machine"] = {"name": "xyzbc-trunnion"}
        job.tables["operation"][0]["step_mm"] = step_mm

    return change


CASES = (
    *CASES,
    Case("rapid-at-a-corner", "a rapid takes 0.05 mm of an edge of the block, in a step of 100 mm", corner(0.05, 100.0),
         "exceeds", "rapid-cuts"),
    Case("rapid-at-a-corner-leaning", "a rapid takes 0.2 mm of an edge of the block with a leaning axis",
         corner(0.2, 2.0, 20.0), "exceeds", "rapid-cuts"),
    Case("rapid-beside-a-corner", "nothing: a rapid passes 0.1 mm beside the edge", corner(-0.1, 100.0), "holds", ""),
    Case("film-by-tolerance", "a rapid through 0.1 mm of the block with a leaning axis and tolerance_mm = 0.1",
         changes(corner(-1.0, 2.0, 20.0), lambda job: job.tables["operation"][0].update(tolerance_mm=0.1)),
         "unchecked", "rapids that take less than 0.4 mm of material"),
)  # fmt: skip


CASES = (
    *CASES,
    Case("power-of-a-long-step", "493 W at a limit of 300 W, over 10 mm of a step of 100 mm",
         changes(stock(low_mm=(25.0, 0.0, -20.0), high_mm=(35.0, 40.0, 0.0)), stated("limits", power_w=300.0),
                 lambda job: job.tables["operation"][0].update(step_mm=100.0)),
         "unproven", "power_w"),
)  # fmt: skip


#: the axis leans by 0.01 deg, so that the columns of an upright axis do not follow it
DWELL_AND_RAPID = """G21 G90 G17 G94
G54
T1 M6
G43 H1
S6000 M3
G0 X30 Y-30 Z80 B0.01
G0 Z-2
G1 Y70 F900
M5
G0 Z80
G0 X50 Y-30
G0 Z-6
G4 P0.5 G0 Y70
G0 Z80
M2
"""
CASES = (
    *CASES,
    Case("rapid-behind-a-dwell", "a rapid through the block in the line of a dwell, the spindle at rest",
         changes(lambda job: job.tables.update(machine={"name": "xyzbc-trunnion"}), program(DWELL_AND_RAPID)),
         "exceeds", "rapid-cuts"),
)  # fmt: skip
