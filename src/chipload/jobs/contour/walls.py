"""Slender walls beside what a contour job cuts, whose deflection it does not calculate.

The walls are those of the model (.step), or those that the pockets of a drawing leave between and in them. The outline
of the stock of a drawing is not known: what is around its pockets counts as thick.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import Finding, Severity
from chipload.geometry.contour import Contour, Region
from chipload.geometry.mesh import read_mesh
from chipload.jobs.contour.job import ContourJob
from chipload.simulation.heights.height_map import columns_of_mesh
from chipload.simulation.heights.slender_walls import SlenderWall, slender_walls_of

Floats = NDArray[np.float64]

#: columns along the longest side, and chords of contours and models [mm]
COLUMNS, CHORD_MM = 600, 0.05
#: a wall is beside a contour within its thickness and this [mm]
NEAR_MM = 1.0


def find_walls(job: ContourJob, contours: Sequence[Contour]) -> tuple[Finding, ...]:
    """Return the finding that names the most slender wall beside the contours of a job, if the check is on."""
    checks = job.table.checks
    if not checks.slender_walls or not contours:
        return ()
    walls = _walls(job, contours, checks.wall_slenderness)
    if not walls:
        return ()
    wall, more = walls[0], f", the most slender of {len(walls)}" if len(walls) > 1 else ""
    text = (
        f"a wall {wall.height_mm:.3g} mm high and {wall.thickness_mm:.2g} mm thick is beside the cut{more}: the "
        "deflection of the part is not checked: simulate the program in a job with [workpiece], or state a greater "
        f"checks.wall_slenderness than {checks.wall_slenderness:g}"
    )
    return (Finding("slender-wall", 0, text, Severity.UNPROVEN, wall.place),)


def _walls(job: ContourJob, contours: Sequence[Contour], slenderness: float) -> tuple[SlenderWall, ...]:
    """Slender walls beside the contours, in their frame."""
    if job.part_file.suffix.lower() == ".dxf":
        return _walls_of_pockets(job, contours, slenderness)
    mesh = read_mesh(job.part_file, chord_mm=CHORD_MM, key="part.file")
    longest = float(np.ptp(mesh.bounds[:, :2], axis=0).max())
    x, y, low, top = columns_of_mesh(mesh, longest / COLUMNS)
    before = np.full(top.shape, float(mesh.bounds[1, 2]))
    shift = np.array(job.table.part.origin_mm)
    lines = shapely.multilinestrings([shapely.linestrings(c.flatten(CHORD_MM)) for c in contours])
    return tuple(
        wall
        for wall in slender_walls_of(x - shift[0], y - shift[1], low, top, before, slenderness)
        if shapely.distance(shapely.points(*wall.place[:2]), lines) <= wall.thickness_mm + NEAR_MM
    )


def _walls_of_pockets(job: ContourJob, contours: Sequence[Contour], slenderness: float) -> tuple[SlenderWall, ...]:
    """Slender walls between the pockets of a drawing, and of their islands; none where nothing is cleared."""
    depths = [op.depth_mm or op.axial_depth_mm for op in job.operations if op.kind == "pocket"]
    if not depths or not all(c.closed for c in contours):
        return ()
    deep = max(depths)
    area = Region.of(contours).flatten(CHORD_MM)
    shapely.prepare(area)
    # a margin that no wall is as thick as
    margin = 2.0 * deep / slenderness
    low, high = (np.array(area.bounds[k : k + 2]) + s * margin for k, s in ((0, -1.0), (2, 1.0)))
    pitch = float((high - low).max()) / COLUMNS
    x, y = (np.arange(a + 0.5 * pitch, b, pitch) for a, b in zip(low, high, strict=True))
    px, py = np.meshgrid(x, y, indexing="ij")
    cleared = shapely.contains_xy(area, px.ravel(), py.ravel()).reshape(px.shape)
    top = job.table.stock.top_mm
    return slender_walls_of(
        x, y, np.full(px.shape, top - deep - 1.0), np.where(cleared, top - deep, top), np.full(px.shape, top),
        slenderness,
    )  # fmt: skip
