"""Levels of a pocket by what is left of its part (``levels_mm = "limit"``).

For each height at which a level may end, the part is solved in its clamps in the state after that level: all walls of
the pockets above are finished, below stands what the operation before it left beside the walls, or all, where none did.
Other faces of the part count as finished. Its compliance is taken along the edge that cuts at once, at places of all
walls, with its lower end at each candidate of the level.

The deflection of the cutter in its holder and of the part together leave the form error
(:mod:`chipload.cutting.wall_error`). The plan keeps it below the limit less the share ``levels_reserve``. The proof is
the simulation of the written program in a job with `[workpiece]`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.checking.clamped import elastic_of, placed_clamps
from chipload.checking.stiffness import MachineStiffness, stiffness_of
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.mesh import read_mesh
from chipload.jobs.contour.job import ContourJob, left_on_walls
from chipload.jobs.contour.tables import OperationTable
from chipload.jobs.simulation.values import workpiece_of
from chipload.jobs.tables import require_stated, value_of
from chipload.number_text import number_text
from chipload.planning.pocket.wall_levels import LevelCut, WallLevels, fewest_levels
from chipload.progress import Progress, silent
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.thickness import cells_over
from chipload.structure.cells.workpiece import CellWorkpiece, cell_workpiece, line_compliances
from chipload.structure.spindle import chain_compliance, cutter_bars
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

Floats = NDArray[np.float64]

#: share of the limit that levels leave to the error of their simulation, where none is stated
RESERVE = 0.3
#: candidates for the end of a level: their distance in diameters, and most of them
APART, MOST = 0.125, 16
#: places on the walls: their distance in diameters, and most of them
SPACING, PLACES = 0.5, 120
#: chords of the model and of the pockets [mm]; tiles of the stock in cells
CHORD_MM, TILE = 0.05, 16.0


@dataclass(frozen=True, eq=False)
class _Places:
    """Places on the walls: (p, 2) [mm], normals (p, 2), radius (p,) [mm] of inside arcs, inf along straight walls."""

    at: Floats
    normal: Floats
    radius: Floats


def planned_levels(
    job: ContourJob,
    op: OperationTable,
    contours: tuple[Contour, ...],
    top: float,
    material: Material,
    progress: Progress = silent,
) -> WallLevels:
    """The fewest levels of a pocket whose walls keep the form error.

    Raises
    ------
    InputError
        The model or the workpiece cannot be used, or no level keeps the limit.
    """
    cutter, depth = job.cutters[op.cutter], op.depth_mm or op.axial_depth_mm
    kept = 1.0 - (RESERVE if op.levels_reserve is None else op.levels_reserve)
    limit = 1e-3 * job.limits["form_error_um"] * kept
    made = _wall_pass(job, op, cutter, material)
    count = min(MOST, max(1, math.ceil(depth / (APART * cutter.diameter) - 1e-9)))
    heights = np.linspace(top, top - depth, count + 1)
    region = Region.of(contours)
    places = _places_on(region, cutter.diameter)
    engagement = np.array([made.engagement_on_arc(r) for r in places.radius.tolist()])
    work = _States(job, op, region, heights)
    error = np.full((count + 1, count + 1), np.inf)
    for j in range(1, count + 1):
        progress((j - 1) / count, "part in each state")
        state = work.below(float(heights[j]))
        most = np.zeros(len(places.at))
        for i in range(j - 1, -1, -1):
            level = float(heights[i] - heights[j])
            if level > op.axial_depth_mm + 1e-9:
                break
            most = np.maximum(most, _compliance(state, places, float(heights[i + 1]), made.window(level), heights, j))
            found = float(made.errors(level, engagement, most).max())
            if i == j - 1:
                least = found
            if found > limit:
                break
            error[i, j] = found
        if not np.isfinite(error[:, j]).any():
            raise InputError(
                f"operation.levels_mm = 'limit': the level from {heights[j - 1]:.4g} to {heights[j]:.4g} mm has a form "
                f"error of {number_text(1e3 * least, 3)} um by cutter and part: must be at most {1e3 * limit:.4g} um "
                f"({100.0 * kept:g} % of limits.form_error_um): state a smaller feed_mm_min, more "
                "allowance_mm of the operation before, or a stiffer cutter"
            )
    found_levels = fewest_levels(heights.tolist(), error)
    if found_levels is None:
        raise InputError(
            f"operation.levels_mm = 'limit': no levels of at most axial_depth_mm = {op.axial_depth_mm:g} keep a form "
            f"error of {1e3 * limit:.4g} um at all walls: state a smaller feed_mm_min or more allowance_mm before"
        )
    progress(1.0, "part in each state")
    return found_levels


def levels_text(found: WallLevels, limit_um: float) -> str:
    """One sentence on planned levels.

    Examples
    --------
    >>> levels_text(WallLevels(np.array([3.0, 5.0]), np.array([0.02, 0.03]), 3.0, 3), 50.0)
    'levels of 3 and 5 mm, with 20 and 30 um of 50 planned at the walls; constant depth: 3 levels of at most 3 mm'
    """
    depths = _listed([number_text(d, 3) for d in found.depths.tolist()])
    errors = _listed([number_text(1e3 * e, 2) for e in found.errors.tolist()])
    count = found.constant_levels
    constant = f"{count} level{'s' if count > 1 else ''} of at most {number_text(found.constant, 3)} mm"
    even = f"; constant depth: {constant}" if count else ""
    return f"levels of {depths} mm, with {errors} um of {number_text(limit_um, 3)} planned at the walls{even}"


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _wall_pass(job: ContourJob, op: OperationTable, cutter: Cutter, material: Material) -> LevelCut:
    """The pass of an operation that makes its walls."""
    finish = op.wall_finish
    feed, speed = (op.feed_mm_min, op.speed_rpm) if finish is None else (finish.feed_mm_min, finish.speed_rpm)
    radial = op.radial_depth_mm or 0.0
    taken = radial if finish is None else min((op.allowance_mm or 0.0) - finish.allowance_mm, radial)
    stated = None if job.table.stiffness is None else value_of(MachineStiffness, job.table.stiffness)
    bars = stiffness_of(stated, {cutter.number: cutter}).bars[cutter.number]
    own = float(chain_compliance(cutter_bars(cutter), 0.0, 0.0))
    per_tooth = mm_s_from_mm_min(feed) / (rad_s_from_rpm(speed) / math.tau * cutter.flutes)
    most = math.acos(1.0 - radial / cutter.radius)
    holder = max(float(chain_compliance(bars, 0.0, 0.0)) - own, 0.0)
    return LevelCut(cutter, material, per_tooth, taken, op.milling, most, holder)


def _places_on(region: Region, diameter: float) -> _Places:
    """Places on the contours of pockets, whose inside lies on their left."""
    length = sum(c.length for c in region.contours)
    spacing = max(SPACING * diameter, length / PLACES)
    rows = [row for contour in region.contours for row in _on_contour(contour, spacing)]
    return _Places(*(np.array([row[k] for row in rows]) for k in range(3)))


def _on_contour(contour: Contour, spacing: float) -> Iterator[tuple[Floats, Floats, float]]:
    """Places on a contour, at least two a segment: point, normal, radius; 0 beside a sharp inside corner."""
    starts = np.r_[0.0, np.cumsum(contour.lengths)]
    ends = [contour.at(np.clip(np.array([s - 1e-6, s + 1e-6]) % contour.length, 0.0, None))[1] for s in starts]
    turns = [float(t[0][0] * t[1][1] - t[0][1] * t[1][0]) for t in ends]
    for k, (row, long) in enumerate(zip(contour.segments, contour.lengths, strict=True)):
        count = max(2, math.ceil(long / spacing))
        points, tangent = contour.at(starts[k] + (np.arange(count) + 0.5) * long / count)[:2]
        for n in range(count):
            sharp = (n == 0 and turns[k] > 1e-3) or (n == count - 1 and turns[k + 1] > 1e-3)
            radius = 0.0 if sharp else float(contour.radii[k]) if row[6] > 0.0 else math.inf
            yield points[n], np.array([-tangent[n][1], tangent[n][0]]), radius


def _compliance(state: CellWorkpiece, places: _Places, low: float, window: float, heights: Floats, j: int) -> Floats:
    """Greatest compliance (p,) [mm/N] normal to the walls along a window from ``low`` upwards within the stock."""
    top = min(low + window, float(heights[0]))
    low = max(top - window, float(heights[j]))
    lines = np.stack([np.column_stack([places.at, np.full(len(places.at), z)]) for z in (low, top)], axis=1)
    found = line_compliances(state, lines)[..., :2, :2]
    return np.asarray(np.einsum("pi,psij,pj->ps", places.normal, found, places.normal).max(axis=1))


class _States:
    """The part of a job in its clamps, in the state after each level."""

    def __init__(self, job: ContourJob, op: OperationTable, region: Region, heights: Floats) -> None:
        mesh = read_mesh(job.part_file, chord_mm=CHORD_MM, key="part.file")
        mesh.apply_translation([*(-x for x in job.table.part.origin_mm), 0.0])
        low, high = mesh.bounds
        if abs(float(high[2]) - float(heights[0])) > CHORD_MM:
            raise InputError(
                f"operation.levels_mm = 'limit': stock.top_mm = {heights[0]:g}: must be the top of "
                f"{job.part_file.name}, {high[2]:g} mm"
            )
        workpiece = workpiece_of(require_stated(job.table.workpiece, "workpiece"))
        size = 4.0 * job.cutters[op.cutter].diameter if workpiece.cell_mm is None else TILE * workpiece.cell_mm
        below = [float(low[2])] if low[2] < heights[-1] - CHORD_MM else []
        bounds = np.array([*below, *heights[-1:0:-1], float(high[2])])
        self.part = LayeredStock.of_mesh(mesh, bounds, size)
        pockets = shapely.make_valid(region.flatten(CHORD_MM))
        before = None if op.rest_of is None else left_on_walls(job.operations[op.rest_of])
        allowance = pockets if before is None else shapely.difference(pockets, pockets.buffer(-before))
        first = LayeredStock.block(low, high, bounds, size)
        self.outline = shapely.box(*low[:2], *high[:2])
        self.stands = [shapely.union(self.part.section(k), allowance) for k in range(first.layers)]
        for k in range(first.layers):
            solid = shapely.union(self.part.section(k), pockets)
            first.remove(k, _polygons(shapely.difference(self.outline, solid)))
        self.clamps, self.elastic = placed_clamps(workpiece, first), elastic_of(workpiece)
        self.grid = cells_over(first, self.part, workpiece.cell_mm, workpiece.order)[0]
        self.first, self.floor = first, float(heights[-1])

    def below(self, height: float) -> CellWorkpiece:
        """The part with all walls finished above a height."""
        stock = self.first.copied()
        for k, middle in enumerate((0.5 * (stock.bounds[:-1] + stock.bounds[1:])).tolist()):
            stands = self.stands[k] if self.floor < middle < height else self.part.section(k)
            stock.remove(k, _polygons(shapely.difference(self.outline, stands)))
        return cell_workpiece(stock, self.grid, self.elastic, self.clamps)


def _polygons(shape: shapely.Geometry) -> shapely.MultiPolygon:
    """The polygons of a shape."""
    parts = [p for p in shapely.get_parts(shape) if isinstance(p, shapely.Polygon) and p.area > 0.0]
    return shapely.MultiPolygon(parts)
