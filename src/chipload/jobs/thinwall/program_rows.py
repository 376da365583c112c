"""Rows of an operation from the user's own finishing program: its file, and the poses of the cutter along them.

Notation: lead, tilt and step-over b with its sign as in :mod:`chipload.planning.thinwall.plane_stock`. Rows in both
directions have the row before on their right and on their left in turn: each direction has poses of its own. Where the
lean changes along the rows, the poses of least, middle and greatest lean represent all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, InputError
from chipload.geometry.thin_wall import ThinWall
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.part_shape import PartShape
from chipload.machine.machine import Machine
from chipload.planning.thinwall.contact import SideAt
from chipload.planning.thinwall.finish_rows import FinishSide, row_frames
from chipload.planning.thinwall.plane_stock import CutterPose
from chipload.planning.thinwall.read_rows import sides_of_program
from chipload.program.gcode.tools import Tool, ToolTable
from chipload.program.program import RAPID, Program
from chipload.program.read import read_program
from chipload.result.first_lines import located_text

Floats = NDArray[np.float64]

#: a lean that changes by less [rad] is one
SAME_LEAN = math.radians(1.0)
#: greatest lean of an axis from the normal [rad]
STEEPEST = math.radians(89.0)
#: of a tool, along A B C U V W
NO_OFFSET = (0.0,) * 6


@dataclass(frozen=True, eq=False)
class ProgramRows:
    """Rows of a program.

    Attributes
    ----------
    sides : in the order of those with stock
    step_over : greatest distance of neighbouring rows [mm]
    stands : sign of the step-over, lead and tilt [rad] of each pose
    findings : on the text of the program; their lines stand in their texts, as those of the result are of its own
        programs
    """

    sides: tuple[FinishSide, ...]
    step_over: float
    stands: tuple[tuple[int, float, float], ...]
    findings: tuple[Finding, ...] = ()

    def poses(self, cutter: Cutter, feed_per_tooth: float) -> tuple[CutterPose, ...]:
        """Poses of the cutter along the rows."""
        return tuple(
            CutterPose(cutter, feed_per_tooth, (sign or 1) * self.step_over, lead, tilt, clockwise=not cutter.left_hand)
            for sign, lead, tilt in self.stands
        )


def program_rows(
    job: ThinWallJob,
    number: int,
    machine: Machine,
    shape: ThinWall | PartShape,
    side_numbers: Sequence[int],
    foot: float,
) -> ProgramRows | None:
    """The rows of an operation that names a program; None: its rows are planned.

    Parameters
    ----------
    number : of the operation
    side_numbers : of the sides with stock
    foot : share of v that keeps its stock

    Raises
    ------
    InputError
        The file cannot be read, or its rows do not cover the sides.
    """
    op = job.table.operation[number]
    if op.rows is None:
        return None
    if not side_numbers:
        raise InputError("wall.allowance_mm: no side has stock: state stock to cut")
    file = job.path.parent / op.rows
    name, cutter = f"operation.{number}.rows = {op.rows}", job.cutters[op.cutter]
    lengths = ToolTable(
        {n: Tool(n, diameter=c.diameter, offset=(0.0, 0.0, c.overhang, *NO_OFFSET)) for n, c in job.cutters.items()}
    )
    reading = read_program(file, machine, tools=lengths)
    program = reading.program
    tool = _tool_of(program, op.cutter, name)
    at = [side_at(shape, s) for s in side_numbers]
    sides, step_over = sides_of_program(program, cutter, at, foot, op.step_mm, name, tool)
    stands = [one for k, side in enumerate(sides) for one in _stands(side, f"{name}: side {k + 1}")]
    # limits of the machine are checked on the job's own programs, which follow the rows
    found = (replace(f, text=f"{name}: {located_text(f)}", line=0, row=None) for f in reading.findings)
    return ProgramRows(sides, step_over, tuple(dict.fromkeys(stands)), tuple(dict.fromkeys(found)))


def side_at(shape: ThinWall | PartShape, number: int) -> SideAt:
    """Points and normals of a side."""

    def at(u: Floats, v: Floats) -> tuple[Floats, Floats]:
        return shape.sides(u, v)[number], shape.normals(u, v)[number]

    return at


def _tool_of(program: Program, number: int, name: str) -> int | None:
    """The tool whose feed motions count; None: all, as the program has one tool, which it need not number alike.

    Raises
    ------
    InputError
        It has several tools, and none has the cutter's number.
    """
    known = sorted({int(t) for t in program.tool[program.motion != RAPID]})
    if len(known) > 1 and number not in known:
        listed = ", ".join(map(str, known))
        raise InputError(f"{name}: cuts with tools {listed}: must be one tool, or cutter {number} among them")
    return number if len(known) > 1 else None


def _stands(side: FinishSide, where: str) -> list[tuple[int, float, float]]:
    """Poses along the rows of a side.

    Raises
    ------
    InputError
        The cutter cuts with its flank.
    """
    out = []
    for one in row_frames(side):
        lean = np.arccos(np.clip(np.cos(one.lead) * np.cos(one.tilt), -1.0, 1.0))
        if not float(lean.max()) < STEEPEST:
            raise InputError(
                f"{where}: the cutter's axis leans by {math.degrees(float(lean.max())):.3g} deg from the normal of the "
                f"side: must be below {math.degrees(STEEPEST):g}, as its flank would cut: lean it towards the normal"
            )
        order = np.argsort(lean, kind="stable")
        chosen = [order[len(order) // 2]]
        if float(np.ptp(lean)) > SAME_LEAN:
            chosen = [order[0], *chosen, order[-1]]
        out += [(one.sign, round(float(one.lead[k]), 9), round(float(one.tilt[k]), 9)) for k in chosen]
    return out
