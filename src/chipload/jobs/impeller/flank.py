"""Flank passes of the sides of an impeller, on a machine with five simultaneous axes: planned, written, checked.

They are an addition to the programs of the index table: the same sides, each in one pass, with the largest cutter of
the catalogue that is clear of all walls and keeps the deviation.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import Catalogue, CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.jobs.impeller.five_axis import all_channels, five_axis_machine, program_check
from chipload.jobs.impeller.five_axis_outcome import CheckedFlank, NoFiveAxisPath
from chipload.jobs.impeller.job import ImpellerJob
from chipload.jobs.impeller.tables import FlankTable, PathsTable, SurfaceTable
from chipload.planning.impeller.clearance import clearance
from chipload.planning.impeller.five_axis_program import LinkedPath, five_axis_program, lift_from_end, outline_of
from chipload.planning.impeller.flank import FlankPass, flank_pass, offset_pass
from chipload.planning.impeller.kept import Keep, PlanTask, anew
from chipload.planning.impeller.settings import FinishSettings
from chipload.planning.impeller.surfaces import BODIES
from chipload.progress import Progress, silent
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

Floats = NDArray[np.float64]

#: share of the allowed gouge that the plan may use
_SHARE = 0.8
#: a cutter that comes deeper into a wall beside the two offset points than this over the gouge is not tried [mm]
_ROUGHLY = 0.5
#: how often a pass is made longer so that it reaches its ends at all heights
_LONGER = 3
#: nor one whose axis through these points deviates by more than so many times what is allowed
_MOST = 4.0
#: kinds of surfaces that have rulings
SIDES = ("plus", "minus")


def checked_flanks(
    job: ImpellerJob, how: FinishSettings, catalogue: Catalogue, progress: Progress = silent, keep: Keep = anew
) -> tuple[CheckedFlank | NoFiveAxisPath, ...]:
    """Flank passes of each side that the job names, with their check."""
    op, impeller = job.operation, how.impeller
    table, paths = op.flank, op.paths
    if table is None or paths is None:
        return ()
    machine = five_axis_machine(job.flank_machine, "operation.0.flank")
    sides = [s for s in job.table.surface if s.side in SIDES]
    outline = outline_of(how.scene, impeller.blades)
    out: list[CheckedFlank | NoFiveAxisPath] = []
    parts = [
        PlanTask(("flank", k), _plan_fewest_passes, (side, catalogue, table, paths, outline))
        for k, side in enumerate(sides)
    ]
    keep.ahead(parts, progress)
    for k, side in enumerate(sides):
        found: tuple[CatalogueCutter, list[LinkedPath]] | NoFiveAxisPath = parts[k].of(how, keep)
        if isinstance(found, NoFiveAxisPath):
            out.append(found)
        else:
            feed = mm_s_from_mm_min(table.feed_mm_min if table.feed_mm_min is not None else op.feed_mm_min)
            spindle = rad_s_from_rpm(table.speed_rpm if table.speed_rpm is not None else op.speed_rpm)
            cutter, passes = found
            program = five_axis_program(
                passes, outline, how.link, feed, spindle, k + 1, machine, impeller.pitch
            )  # fmt: skip
            got = program_check(how, side, machine, cutter, program, paths, keep=keep)
            own = tuple(one.path for one in passes if isinstance(one.path, FlankPass))
            out.append(CheckedFlank(
                f"{side.body} {side.side}", machine, cutter, program, got.gouge, got.left, paths.gouge_mm,
                table.excess_mm, got.machine_check, got.read,
                all_channels(program, machine, impeller.blades), own,
            ))  # fmt: skip
        progress((k + 1) / len(sides), f"flank passes of {k + 1} sides")
    return tuple(out)


def _plan_fewest_passes(
    how: FinishSettings,
    side: SurfaceTable,
    catalogue: Catalogue,
    table: FlankTable,
    paths: PathsTable,
    outline: Floats,
) -> tuple[CatalogueCutter, list[LinkedPath]] | NoFiveAxisPath:
    """The fewest passes up the side, with the largest cutter that is clear in them and keeps the deviation."""
    surface = how.surface(BODIES.index(side.body), side.side)
    least = math.inf
    tried: set[CatalogueCutter] = set()
    cutters = sorted(catalogue.cutters, key=lambda c: (-c.diameter, c.corner_radius))
    for count in range(1, table.most_passes + 1):
        edges = np.linspace(*side.up, count + 1).tolist()
        bands = [(a, b) for a, b in itertools.pairwise(edges)]
        for cutter in cutters:
            found = []
            for band in bands:
                one, deviation = _pass(how, surface, side.along, band, cutter, table, paths, outline)
                if one is None:
                    if deviation is None:
                        tried.add(cutter)
                    else:
                        least = min(least, deviation)
                    break
                found.append(one)
            if len(found) == count:
                return cutter, found
    why = f"{len(tried)} meet a wall or are too short"
    if math.isfinite(least):
        why += f", the others deviate by {least:.4f} mm and more"
    return NoFiveAxisPath(
        f"{side.body} {side.side}",
        f"{side.body} {side.side}: no flank passes: of {len(cutters)} cutters {why} with up to {table.most_passes} "
        "passes: mill it by points, raise most_passes, excess_mm or gouge_mm, or add thinner or longer cutters",
    )


def _pass(
    how: FinishSettings, surface: BSplinePatch, wanted: tuple[float, float], band: tuple[float, float],
    cutter: CatalogueCutter, table: FlankTable, paths: PathsTable, outline: Floats,
) -> tuple[LinkedPath | None, float | None]:  # fmt: skip
    """The pass of a cutter on a band of a side; None and its deviation, None where it meets a wall or is too short."""
    scene, above = how.scene, how.how.motion.clearance
    deep = _SHARE * paths.gouge_mm
    limit = max(table.excess_mm, deep)
    along = _overrun(surface.at(np.linspace(*wanted, 65), 0.5 * sum(band)), wanted, paths.overrun_mm)
    tips, axes, rough = offset_pass(surface, along, band, cutter)
    if rough > _MOST * limit:
        return None, rough / _MOST
    got, _ = clearance(scene, cutter, tips, axes, 1.0, above)
    if got.min() < -paths.gouge_mm - _ROUGHLY:
        return None, None
    try:
        path = flank_pass(surface, along, band, cutter, paths.chord_mm)
        for _ in range(_LONGER):
            # the cutter may come nearest to some heights before the end of the pass, which continues to reach them all
            first = along[0] - max(float(path.touches[0, 1]) - wanted[0], 0.0)
            last = along[1] + max(wanted[1] - float(path.touches[-1, 0]), 0.0)
            longer = max(first, 0.0), min(last, 1.0)
            if longer == along:
                break
            along = longer
            path = flank_pass(surface, along, band, cutter, paths.chord_mm)
    except InputError:
        return None, None
    if path.left.max() > table.excess_mm or -path.gouge.min() > deep:
        return None, path.deviation
    got, _ = clearance(scene, cutter, path.tip, path.axis, 1.0, above)
    begin, end = (lift_from_end(path, k, scene, outline, cutter, how.link, above) for k in (0, -1))
    if got.min() < -deep or begin is None or end is None:
        return None, None
    return LinkedPath(path, begin, end), path.deviation


def _overrun(line: Floats, along: tuple[float, float], mm: float) -> tuple[float, float]:
    """The range, on either side longer by so much of a line (n, 3) over it, within 0 to 1."""
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    more = mm * (along[1] - along[0]) / length
    return max(along[0] - more, 0.0), min(along[1] + more, 1.0)
