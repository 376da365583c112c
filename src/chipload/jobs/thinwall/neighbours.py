"""Whether shank and holder run into the part while its walls are cut: the floor, other walls, links and stock among it.

What the cutting part runs into is found by the chips: a rapid that cuts, a gouge in the section of any layer.
"""

from __future__ import annotations

from collections.abc import Sequence

from chipload.jobs.simulation.workpiece import stock_points
from chipload.jobs.tables import stated
from chipload.jobs.thinwall.inputs import WallInputs
from chipload.planning.thinwall.linking import PassProgram
from chipload.program.program import Program
from chipload.simulation.steps import steps_of
from chipload.simulation.surface import Collision, collisions, fine, in_stock
from chipload.stock.layers import LayeredStock


def part_collisions(inputs: WallInputs, uncut: LayeredStock, legs: Sequence[PassProgram]) -> tuple[Collision, ...]:
    """Where shank and holder come into the finished part, or into what is still there of its stock.

    Parameters
    ----------
    uncut : the stock before the first pass

    Raises
    ------
    InputError
        The points of part or stock would be too many.
    """
    op, table = inputs.job.operation, stated(inputs.job.table.part, "part")
    cutters = {o.cut.cutter.number: o.cut.cutter for o in inputs.operations}
    steps = steps_of(Program.join([leg.program for leg in legs]), op.step_mm, op.tolerance_mm)
    solids = {"part": fine(inputs.finished_mesh(), table.spacing_mm, "part")[0]}
    touched = collisions(steps, cutters, solids, op.tolerance_mm, above_only=frozenset(["part"]))
    return touched + in_stock(steps, cutters, stock_points(uncut, table.spacing_mm), op.tolerance_mm)
