"""Surface maps of an impeller: the largest cutter, its table angle, and the excess after all programs."""

from __future__ import annotations

import numpy as np

from chipload.jobs.impeller.mesh import OFF, grid_faces, surface_mesh
from chipload.jobs.impeller.outcome import ImpellerResult
from chipload.result import SurfaceMap


def maps_of(milled: ImpellerResult) -> tuple[SurfaceMap, ...]:
    """Maps of each surface: its largest diameter and table angle, and, where there are programs, the excess."""
    out = []
    for op in milled.surfaces:
        points, faces = surface_mesh(op)
        reached = op.answer.cutter >= 0
        angle = np.degrees(op.answer.tables[op.answer.table])
        for what, column, values in (
            ("largest cutter", "largest_diameter_mm", op.answer.diameter),
            ("table angle", "table_deg", angle),
        ):
            shown = np.where(reached, values, np.nan)
            out.append(SurfaceMap(f"{op.surface.name}: {what}", column, points, shown, faces))
    for c in milled.covered or ():
        wall = c.left.wall
        points = wall.points + OFF * wall.normals
        out.append(SurfaceMap(f"{c.name}: material left", "scallop_mm", points, c.left.rest, grid_faces(*wall.shape)))
    return tuple(out)
