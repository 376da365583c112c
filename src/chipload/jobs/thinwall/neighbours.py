"""Collisions of a tool with the part, or with the neighbours of one wall, on all motions including links.

The chips show what the cutting part collides with: a rapid that cuts, or a gouge in the section of any layer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from chipload.checking.workpiece import stock_points
from chipload.jobs.tables import require_stated
from chipload.jobs.thinwall.inputs import WallInputs
from chipload.planning.thinwall.pass_program import PassProgram
from chipload.program.program import Program
from chipload.simulation.steps import steps_of
from chipload.simulation.surface import Collision, collisions, fine, in_stock
from chipload.stock.layers import LayeredStock

#: points of one wall are so far apart [mm]
SPACING = 1.0


def wall_collisions(inputs: WallInputs, pass_programs: Sequence[PassProgram]) -> tuple[Collision, ...]:
    """Collisions of shank and holder with one finished wall, and of the whole tool with its neighbours.

    Raises
    ------
    InputError
        The points of a neighbour would be too many.
    """
    op, shape = inputs.job.operation, inputs.body.shape
    cutters = {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}
    steps = steps_of(Program.join([one.program for one in pass_programs]), op.step_mm, op.tolerance_mm)
    length, height, _ = shape.size()
    parameters = (np.linspace(0.0, 1.0, math.ceil(size / SPACING) + 1) for size in (length, height))
    u, v = np.meshgrid(*parameters, indexing="ij")
    wall = np.concatenate([p.reshape(-1, 3) for p in shape.sides(u, v)])
    return collisions(
        steps, cutters, {"wall": wall, **inputs.neighbours}, op.tolerance_mm, above_only=frozenset(["wall"])
    )


def part_collisions(
    inputs: WallInputs, uncut: LayeredStock, pass_programs: Sequence[PassProgram]
) -> tuple[Collision, ...]:
    """Collisions of shank and holder with the finished part, or with its remaining stock.

    Parameters
    ----------
    uncut : the stock before the first pass

    Raises
    ------
    InputError
        The points of part or stock would be too many.
    """
    op, table = inputs.job.operation, require_stated(inputs.job.table.part, "part")
    cutters = {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}
    steps = steps_of(Program.join([one.program for one in pass_programs]), op.step_mm, op.tolerance_mm)
    solids = {"part": fine(inputs.finished_mesh(), table.spacing_mm, "part")[0]}
    touched = collisions(steps, cutters, solids, op.tolerance_mm, above_only=frozenset(["part"]))
    return touched + in_stock(steps, cutters, stock_points(uncut, table.spacing_mm), op.tolerance_mm)
