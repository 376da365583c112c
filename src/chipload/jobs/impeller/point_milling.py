"""Point milling of the surfaces of an impeller on five simultaneous axes: planned, written, checked.

It is an addition to the programs of the index table: the same surfaces, each in one path with a smooth axis. The cutter
is that of the catalogue with the shortest path, of those that reach the whole surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.jobs.impeller.five_axis import all_channels, five_axis_machine, program_check, surface_points
from chipload.jobs.impeller.five_axis_outcome import CheckedPoints, NoFiveAxisPath
from chipload.jobs.impeller.job import ImpellerJob
from chipload.jobs.impeller.tables import PathsTable, PointMillingTable, SurfaceTable
from chipload.machine.machine import Machine
from chipload.planning.impeller.axis_field import AxisField, AxisLimits, clear_field, directions
from chipload.planning.impeller.coverage import between_lines
from chipload.planning.impeller.five_axis_program import (
    LinkedPath,
    five_axis_program,
    lift_from_end,
    outline_of,
    rotary_share,
)
from chipload.planning.impeller.kept import Keep, PlanTask, anew
from chipload.planning.impeller.lines import stretch_stations
from chipload.planning.impeller.point_milling import PointPath, point_path
from chipload.planning.impeller.settings import FinishSettings
from chipload.planning.impeller.surfaces import BODIES
from chipload.program.program import Program
from chipload.progress import Progress, silent
from chipload.simulation.channel.channel import Remainder, scallop_numbers
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

#: of the gouge that is allowed, what the plan uses at the check points
_SHARE = 0.2
#: cutters of each corner radius whose paths are laid out where they go
_PATHS = 2
#: of how far a barrel cuts to a side, by how much its lines run on
_ASKEW = 0.5
#: distance of the points on which scallops are measured [mm]
_FINE = 0.25


@dataclass(frozen=True, eq=False)
class PlannedPoints:
    """Path of a surface: the cutter, `u` or `v` along which its lines run, and the path with and without its lifts."""

    cutter: CatalogueCutter
    along: str
    path: LinkedPath
    points: PointPath


def checked_points(
    job: ImpellerJob, how: FinishSettings, catalogue: Catalogue, progress: Progress = silent, keep: Keep = anew
) -> tuple[CheckedPoints | NoFiveAxisPath, ...]:
    """Point milling of each surface that the job names, with its check."""
    op, impeller = job.operation, how.impeller
    table, paths = op.point_milling, op.paths
    if table is None or paths is None:
        return ()
    machine = five_axis_machine(job.point_machine, "operation.0.point_milling")
    outline, reachable = outline_of(how.scene, impeller.blades), directions(machine)
    feed = mm_s_from_mm_min(table.feed_mm_min if table.feed_mm_min is not None else op.feed_mm_min)
    spindle = rad_s_from_rpm(table.speed_rpm if table.speed_rpm is not None else op.speed_rpm)
    limits = AxisLimits(math.radians(table.lean_deg), _SHARE * paths.gouge_mm, op.clearance_mm, op.scallop_mm)
    out: list[CheckedPoints | NoFiveAxisPath] = []
    given = (catalogue, table, paths, limits, reachable, outline)
    parts = [PlanTask(("point milling", k), _plan_shortest, (side, *given)) for k, side in enumerate(job.table.surface)]
    keep.ahead(parts, progress)
    for k, side in enumerate(job.table.surface):
        found: PlannedPoints | NoFiveAxisPath = parts[k].of(how, keep)
        if isinstance(found, NoFiveAxisPath):
            out.append(found)
        else:
            program = five_axis_program(
                [found.path], outline, how.link, feed, spindle, k + 1, machine, impeller.pitch
            )  # fmt: skip
            got = program_check(
                how, side, machine, found.cutter, program, paths, surface_points(how, side, _FINE), keep
            )
            out.append(CheckedPoints(
                f"{side.body} {side.side}", machine, found.cutter, program, got.gouge, got.left, paths.gouge_mm,
                op.scallop_mm, got.machine_check, got.read,
                all_channels(program, machine, impeller.blades), found.points, found.along,
                _slow_share(program, machine, feed), _scallop(found, got.left),
            ))  # fmt: skip
        progress((k + 1) / len(job.table.surface), f"point milling of {k + 1} surfaces")
    return tuple(out)


def _plan_shortest(
    how: FinishSettings, side: SurfaceTable, catalogue: Catalogue, table: PointMillingTable, paths: PathsTable,
    limits: AxisLimits, reachable: tuple[NDArray[np.float64], NDArray[np.bool_]], outline: NDArray[np.float64],
) -> PlannedPoints | NoFiveAxisPath:  # fmt: skip
    """The shortest path of all cutters that reach the whole surface."""
    name = f"{side.body} {side.side}"
    surface = how.surface(BODIES.index(side.body), side.side)
    u, v = side.along, side.up
    best: PlannedPoints | None = None
    why: list[str] = []
    for family in catalogue.alike:
        laid = 0
        for cutter in reversed(family):
            over = _overrun(cutter, paths.overrun_mm, limits.scallop)
            box = tuple(
                (float(x[0]), float(x[-1]))
                for x in (stretch_stations(surface, "u", u, v, 2, over), stretch_stations(surface, "v", v, u, 2, over))
            )
            field = clear_field(surface, (box[0], box[1]), how.scene, cutter, reachable, limits)
            if isinstance(field, str):
                why.append(f"{cutter.label}: {field}")
                continue
            found = _path(how, surface, (u, v), field, cutter, limits, paths, outline)
            if isinstance(found, str):
                why.append(f"{cutter.label}: {found}")
            elif best is None or found.points.length < best.points.length:
                best = found
            laid += 1
            if laid >= _PATHS:
                break
    if best is not None:
        return best
    return NoFiveAxisPath(
        name,
        f"{name}: no point milling: none of {len(catalogue.cutters)} cutters reaches all of it with one smooth axis: "
        f"{why[-1]}: state a smaller part of it, a lean_deg below {table.lean_deg:g}, or add smaller or longer cutters",
    )


def _overrun(cutter: CatalogueCutter, stated: float, scallop: float) -> float:
    """How far lines run beyond their surface [mm], the stated way; of a barrel some more.

    A barrel cuts along its flank arc, up to sqrt(2 R h) to either side of its contact. Where the path is askew of it,
    the arc is as much as half of that behind the contact.
    """
    if cutter.barrel_radius is None:
        return stated
    return stated + _ASKEW * math.sqrt(2.0 * cutter.barrel_radius * scallop)


def _path(
    how: FinishSettings, surface: BSplinePatch, box: tuple[tuple[float, float], tuple[float, float]], field: AxisField,
    cutter: CatalogueCutter, limits: AxisLimits, paths: PathsTable, outline: NDArray[np.float64],
) -> PlannedPoints | str:  # fmt: skip
    """The shorter one of lines along u and along v; or why there is none."""
    best: PlannedPoints | None = None
    why = "the cutter cannot leave the surface at the ends of its path"
    for along in sorted("uv", key=lambda x: field.path(surface, x)):
        try:
            points = point_path(surface, along, box, field, cutter, limits.scallop, paths.chord_mm)
        except InputError as err:
            why = str(err)
            continue
        if best is not None and points.length >= best.points.length:
            continue
        begin, end = (
            lift_from_end(points, k, how.scene, outline, cutter, how.link, limits.above) for k in (0, -1)
        )  # fmt: skip
        if begin is not None and end is not None:
            best = PlannedPoints(cutter, along, LinkedPath(points, begin, end), points)
    return why if best is None else best


def _slow_share(program: Program, machine: Machine, feed: float) -> float:
    """Share of the rows in the cut in which a rotary axis is at its greatest rate."""
    cut = np.array([label == "finish" for label in program.labels])[program.label]
    return float((rotary_share(program, machine)[cut] > 1.0 - 1e-6).mean())


def _scallop(found: PlannedPoints, left: Remainder) -> float | None:
    """Mean height [mm] of the scallops between two lines; None: there are none."""
    w = left.wall
    within = between_lines(found.points.each_line, found.along, np.column_stack([w.u, w.v]))
    heights = left.scallops("v" if found.along == "u" else "u", within)
    return scallop_numbers(heights, 1.0)["mean_mm"] if len(heights) else None
