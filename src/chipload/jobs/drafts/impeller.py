"""Drafts of jobs that plan an impeller: from the files of a blade row (BladeGen.inf), or a table of all sections."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.geometry.blade_thickness import thickness
from chipload.geometry.bladegen import BladeRow, is_blade_row, read_blade_row
from chipload.geometry.section_table import is_blade3d
from chipload.geometry.sections import Blade, check_sections, loft, read_meridian, read_sections
from chipload.jobs.drafts.draft import Draft, DraftTable, Entry, relative
from chipload.lazy import scipy
from chipload.units import rpm_from_rad_s

Floats = NDArray[np.float64]

#: diameters of cutters that a shop has [mm], and corner radii [mm] below and from WIDE on
DIAMETERS, CORNERS, WIDE = (
    (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 32.0),
    (0.5, 1.0, 2.0),
    (3.0, 12.0),
)
#: widest cutter over the narrowest width between two blades, narrowest one over the widest, most cutters
WIDEST, NARROWEST, MOST = 0.8, 0.4, 4
#: a table of all sections does not state how many blades there are: the outer pitch over the length of a blade
PITCH = 0.8
#: outer diameter [mm] that a wheel has at least in the unit that is guessed
LEAST_MM = 30.0
#: cutting speed [m/min] and feed per tooth over the diameter, for aluminium with carbide and two flutes
CUTTING_M_MIN, FEED, FLUTES = 200.0, 0.006, 2
#: greatest gouge [mm], and at most this share of the thickness of the blade at EDGE of its length from its edges
GOUGE, THIN, EDGE = 0.1, 0.33, 0.01
#: ranges of a side and of a floor that are milled at first
ALONG, UP, ACROSS = [0.05, 0.95], [0.2, 0.95], [0.2, 0.8]


def holds_impeller(file: Path) -> bool:
    """Return whether a file describes a blade row, or is a table of all sections of a blade with both sides."""
    if is_blade_row(file):
        return True
    if file.suffix.lower() not in (".csv", ".dat"):
        return False
    head = read_regular(file, file.name, 100_000_000)[:400].decode("utf-8-sig", "replace")
    return head.lower().startswith("span_index") or is_blade3d(head)


@dataclass(frozen=True)
class RowNotes:
    """Where the numbers of a blade row come from.

    Parameters
    ----------
    blades, unit : of the number of blades and of the unit of length; empty: the file states it
    guess : whether the number of blades is a guess
    unit_guess : whether the unit is one
    found : what else was found in the file
    """

    blades: str = ""
    unit: str = ""
    guess: bool = False
    unit_guess: bool = False
    found: tuple[str, ...] = ()


def draft_impeller(file: Path, folder: Path, machine: str | None = None) -> Draft:
    """The draft of an impeller job: both sides of its blades and the floor between them, roughed and finished.

    Raises
    ------
    InputError
        The files cannot be read, or no blade can be lofted through their sections.
    """
    if is_blade_row(file):
        row, notes = read_blade_row(file), RowNotes()
    else:
        row = _row_of_table(file)
        outer = _outer([_body(row, 0)])
        stated = _blades_of_case(file)
        if stated is not None:
            row = replace(row, blades=stated[0])
        why = "the table states none" if stated is None else f"of {stated[1]}"
        notes = RowNotes(why, f"the table names none; the wheel has {outer:.4g} mm", stated is None, unit_guess=True)
    names = {path: relative(path, folder) for path in (row.profile, row.hub, row.shroud)}
    return draft_row(file, row, names, notes, machine)


def draft_row(
    file: Path,
    row: BladeRow,
    names: Mapping[Path, str],
    notes: RowNotes,
    machine: str | None,
    files: Mapping[str, bytes] | None = None,
) -> Draft:
    """The draft of an impeller job for a blade row.

    Parameters
    ----------
    file : the file that the draft is made from
    names : of the files of the row, as the job has them
    files : more files beside the job
    """
    bodies = [_body(row, k) for k in range(2 if row.splitter else 1)]
    outer = _outer(bodies)
    blade = bodies[0][0]
    part = (
        Entry("blades", row.blades, notes.blades, notes.guess),
        Entry("outer_diameter_mm", round(outer, 3), "of the sections"),
    )
    ahead = round(min(0.02 * outer, _ahead(row, blade)), 2)
    profile = names[row.profile]
    sections = (
        Entry("blade", [profile], f"{len(bodies[0][1])} sections"),
        *((Entry("splitter", [profile], "the second blade of the file"),) if row.splitter else ()),
        Entry("hub", names[row.hub]),
        Entry("shroud", names[row.shroud]),
        Entry("unit", row.unit, notes.unit, notes.unit_guess),
        *((Entry("axis", row.axis),) if row.axis != "z" else ()),
        Entry("hub_ahead_mm", ahead, "length of the hub before the blades that is milled", True),
    )
    narrow = _narrowest(blade, row, bodies)
    high = float(
        np.linalg.norm(blade.plus.at([0.0, 0.5, 1.0], 1.0) - blade.plus.at([0.0, 0.5, 1.0], 0.0), axis=1).max()
    )
    size = _sizes(narrow)
    gouge = _gouge([b for b, _ in bodies])
    surfaces = [
        DraftTable("surface", _surface(body, side), repeated=True)
        for body in ("blade", "splitter")[: len(bodies)]
        for side in ("plus", "minus", "floor")
    ]
    key = "file" if machine is not None and machine.lower().endswith(".toml") else "name"
    own = Entry(key, machine) if machine is not None else Entry("name", "horizontal-b", "with an index table", True)
    tables = (
        DraftTable("impeller", part),
        DraftTable("impeller.sections", sections),
        *surfaces,
        DraftTable("catalogue", (Entry("file", "cutters.toml", "cutters that fit between the blades", True),)),
        DraftTable("machine", (own,)),
        *_operation(size, narrow, high, gouge),
    )
    lines = (
        f"{row.blades} blades{', a splitter between two' if row.splitter else ''}, outer diameter {outer:.4g} mm",
        *notes.found,
        f"two blades are {narrow:.3g} mm apart where they are narrowest, and up to {high:.3g} mm high",
        "pallet and fixtures: state [machine_table] and [[fixture]], else nothing below the part is known",
    )
    title = f"Plan the cutters, table angles and programs of the impeller of {file.name}."
    return Draft(title, tables, lines, {**(files or {}), "cutters.toml": _catalogue(size, high).encode()})


def _outer(bodies: list[tuple[Blade, tuple[Floats, ...]]]) -> float:
    """Outer diameter of sections [mm]."""
    return 2.0 * max(float(np.hypot(p[:, 0], p[:, 1]).max()) for _, sections in bodies for p in sections)


def _blades_of_case(file: Path) -> tuple[int, str] | None:
    """Number of blades of a blade3d file by T-Blade3's input of the same case beside it, and its name; None: no input.

    The input, ``3dbgbinput.N.dat``, has the name of the case in its second line.
    """
    if file.suffix.lower() != ".dat":
        return None
    case = file.stem.split(".", 1)[-1].lower()
    for other in sorted(file.parent.glob("3dbgbinput*.dat")):
        lines = read_regular(other, other.name, 10_000_000).decode("utf-8-sig", "replace").splitlines()
        if len(lines) < 2 or lines[1].strip().lower() != case:
            continue
        for title, value in itertools.pairwise(lines):
            if title.strip().lower().startswith("number of blades") and value.strip().isdigit():
                return int(value), other.name
    return None


def _row_of_table(file: Path) -> BladeRow:
    """The row of a table that holds all, with a guessed unit and number of blades."""
    for unit in ("mm", "cm", "inch", "m"):
        sections = read_sections([file], unit)
        outer = 2.0 * max(float(np.hypot(p[:, 0], p[:, 1]).max()) for p in sections)
        if outer >= LEAST_MM:
            break
    blade = loft(check_sections(sections))
    middle = blade.plus.at(np.linspace(0.0, 1.0, 41), 0.5)
    length = float(np.linalg.norm(np.diff(middle, axis=0), axis=1).sum())
    return BladeRow(max(round(np.pi * outer / (PITCH * length)), 3), False, unit, "x", file, file, file)


def _body(row: BladeRow, number: int) -> tuple[Blade, tuple[Floats, ...]]:
    sections = check_sections(read_sections([row.profile], row.unit, axis=_axis(row), body=number))
    return loft(sections), sections


def _axis(row: BladeRow) -> str:
    """A table has its own frame."""
    return "z" if row.profile == row.hub else row.axis


def _ahead(row: BladeRow, blade: Blade) -> float:
    """Length of the hub beyond the edges of the blade, at the shorter end [mm]."""
    hub = read_meridian(row.hub, row.unit, axis=_axis(row))
    foot = blade.plus.at([0.0, 1.0], 0.0)
    r, z = np.hypot(foot[:, 0], foot[:, 1]), foot[:, 2]
    return min(float(np.linalg.norm(hub - (r[k], z[k]), axis=1)[[0, -1]].min()) for k in range(2))


def _narrowest(blade: Blade, row: BladeRow, bodies: list[tuple[Blade, tuple[Floats, ...]]]) -> float:
    """Least distance of the plus side of a blade from the minus side of the next body, above their feet [mm]."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 61), np.linspace(0.25, 1.0, 16), indexing="ij"))
    near = [b.turned(k * 2.0 * np.pi / row.blades) for b, _ in bodies for k in ((1,) if b is blade else (-1, 0, 1))]
    tree = scipy.spatial.cKDTree(np.concatenate([b.minus.at(u, v) for b in near]))
    return float(tree.query(blade.plus.at(u, v))[0].min())


def _gouge(bodies: list[Blade]) -> float:
    """The gouge that is allowed [mm]: rays of the check must not leave a blade through its other side."""
    thick = min(thickness(body, EDGE) for body in bodies)
    return min(GOUGE, max(math.floor(200.0 * THIN * thick) / 200.0, 0.005))


def _sizes(narrow: float) -> list[tuple[float, float]]:
    """Diameters and corner radii of cutters that fit between blades so far apart, the widest first."""
    fit = [d for d in DIAMETERS if d <= WIDEST * narrow]
    if not fit:
        raise InputError(f"two blades are {narrow:.3g} mm apart: must be at least {DIAMETERS[0] / WIDEST:g} mm")
    sizes = [d for d in fit[::-1] if d >= NARROWEST * fit[-1]][:MOST]
    return [(d, CORNERS[sum(d >= w for w in WIDE)]) for d in sizes]


def _surface(body: str, side: str) -> tuple[Entry, ...]:
    return (
        Entry("body", body),
        Entry("side", side),
        Entry("along", ALONG, "without the edges", True),
        Entry("up", ACROSS if side == "floor" else UP, "without the feet", True),
        Entry("points", [10, 5]),
    )


def _catalogue(size: list[tuple[float, float]], high: float) -> str:
    """The catalogue of the draft: cutters with necks as long as the blades are high."""
    rows = []
    for d, r in size:
        neck = max(round(high + 5.0, 1), 3.0 * d)
        rows.append(
            f"  {{ diameter_mm = {d:g}, corner_radius_mm = {r:g}, cutting_length_mm = {2.0 * d:g}, "
            f"neck_diameter_mm = {0.95 * d:.4g}, neck_length_mm = {neck:g}, shank_diameter_mm = {max(d, 6.0):g}, "
            f"reach_mm = {neck + 15.0:g}, holder_diameter_mm = {max(2.0 * d, 22.0):g} }},"
        )
    note = "Guessed: replace it by the cutters of your shop."
    return "\n".join(['name = "draft"', f'note = "{note}"', "cutter = [", *rows, "]"]) + "\n"


def _operation(size: list[tuple[float, float]], narrow: float, high: float, gouge: float) -> tuple[DraftTable, ...]:
    d = size[0][0]
    speed = round(rpm_from_rad_s(2.0 * CUTTING_M_MIN * 1000.0 / 60.0 / d), -2)
    feed = round(FEED * d * FLUTES * speed, -1)
    check = round(min(max(narrow / 12.0, 0.75), 3.0), 2)
    operation = (
        Entry("kind", "impeller"),
        Entry("check_mm", check),
        Entry("tolerance_mm", gouge),
        Entry("near_mm", round(0.7 * check, 2)),
        Entry("clearance_mm", 0.5, "of neck, shank and holder", True),
        Entry("scallop_mm", 0.1, "height between passes", True),
        Entry("feed_mm_min", feed, f"{FEED * d:.3g} mm a tooth with {FLUTES} teeth", True),
        Entry("speed_rpm", speed, f"{CUTTING_M_MIN:g} m/min with D {d:g}, aluminium", True),
        Entry("most_cutters", 1, "plans with fewer are compared", True),
        Entry("cutter_change_s", 60.0, "of a changer", True),
        Entry("table_change_s", 30.0, "with clamping", True),
    )
    paths = (
        Entry("check_mm", round(0.6 * check, 2)),
        Entry("chord_mm", round(0.5 * gouge, 4)),
        Entry("overrun_mm", 0.5),
        Entry("lift_mm", 3.0),
        Entry("lead_mm", 1.0),
        Entry("margin_mm", 0.1),
        Entry("touch_mm", round(0.2 * gouge, 4)),
        Entry("near_mm", 6.0),
        Entry("above_mm", 5.0),
        Entry("link_feed_mm_min", max(3000.0, feed), "beside the part", True),
        Entry(
            "gouge_mm", gouge, "greatest gouge; thin edges allow no more" if gouge < GOUGE else "greatest gouge", True
        ),
    )
    rough = (
        Entry("depth_mm", round(min(d, 0.5 * high), 2), "of a layer", True),
        Entry("step_mm", round(0.6 * d, 2), "between rows", True),
        Entry("blades_mm", 0.5, "allowance", True),
        Entry("hub_mm", 0.5, "allowance", True),
        Entry("over_mm", 1.0, "height of the blank above the shroud", True),
        Entry("feed_mm_min", feed, "as in finishing", True),
        Entry("speed_rpm", speed, "as in finishing", True),
        Entry("check_mm", check),
        Entry("grid_mm", round(min(max(d / 10.0, 0.5), 1.5), 2)),
        Entry("touch_mm3", 2.0),
    )
    return (
        DraftTable("operation", operation, repeated=True),
        DraftTable("operation.paths", paths),
        DraftTable("operation.rough", rough),
    )
