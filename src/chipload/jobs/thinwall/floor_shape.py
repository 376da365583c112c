"""Check of floors: the path of an upright cutter against the floor and the walls around it, the stock against the part.

The path is compared with sections of the part at all heights that the cutter reaches; the planner keeps the area of its
centres from sections of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.geometry.mesh import sections
from chipload.jobs.thinwall.inputs import WallInputs
from chipload.jobs.thinwall.neighbours import part_collisions
from chipload.jobs.thinwall.outcome import Shape
from chipload.jobs.thinwall.places import Places
from chipload.planning.thinwall.pass_program import PassProgram
from chipload.simulation.initial_stock import initial_stock
from chipload.simulation.shape_deviation import mesh_points, shape_deviation
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]

#: sections of the part are so far apart [mm]; none nearer to a level face than this share of it
APART, BESIDE = 0.5, 0.02


def floor_shape(places: Places, stock: LayeredStock, pass_programs: Sequence[PassProgram]) -> Shape:
    """Path and stock against the finished part."""
    inputs = places.inputs
    gap, at = _nearest(inputs, pass_programs)
    corner = max(o.cut.cutter.corner_radius for o in inputs.operations)
    cutters = {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}
    left = initial_stock(stock, cutters, upright=True)
    found = shape_deviation(left, *mesh_points(inputs.finished_mesh()), inputs.foot_height + corner)
    return Shape(
        found.gouge,
        found.left,
        found.at if found.gouge > -gap else at,
        found.points,
        gap,
        part_collisions(inputs, places.uncut, pass_programs),
    )


def _nearest(inputs: WallInputs, pass_programs: Sequence[PassProgram]) -> tuple[float, tuple[float, float, float]]:
    """Least distance [mm] of the cutter to the part at its own height, across the axis, and where; below 0: into it.

    Right below the cutter the distance to a level floor counts, which the tip may touch.
    """
    part = inputs.finished_mesh()
    levels = np.arange(float(part.bounds[0][2]) + BESIDE * APART, float(part.bounds[1][2]), APART)
    floors = [float(p[0, 2]) for p in inputs.body.shape.sides(np.zeros(1), np.zeros(1))]
    levels = np.unique(np.concatenate([levels, *([z - BESIDE * APART, z + BESIDE * APART] for z in floors)]))
    material = sections(part, levels)
    best, where = np.inf, (0.0, 0.0, 0.0)
    for pass_program in pass_programs:
        cutter = inputs.operations[pass_program.operation].cut.cutter
        p = np.asarray(pass_program.program.p_work)
        low = np.minimum(p[1:, 2], p[:-1, 2])
        lines = shapely.linestrings(np.stack([p[:-1, :2], p[1:, :2]], axis=1))
        for z, there in zip(levels.tolist(), material, strict=True):
            reach = np.flatnonzero((low < z) & (z < low + cutter.overhang))
            if not len(reach) or there.is_empty:
                continue
            radius = np.asarray(cutter.radius_at(np.minimum(z - low[reach], cutter.flute_length)))
            apart = shapely.distance(lines[reach], there) - radius
            k = int(apart.argmin())
            if apart[k] < best:
                x, y = shapely.get_coordinates(shapely.shortest_line(there, lines[reach[k]]))[0]
                best, where = float(apart[k]), (float(x), float(y), z)
    return best, where
