"""Findings on a whole program besides its loads: what its machine, cutters, stock and operator would make of it.

Every capability that runs a program through a stock asks for them, by whatever engine it removes material.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.program.motions import bounds
from chipload.program.program import DWELL, Program
from chipload.program.tapping import tapping_findings
from chipload.program.thread_milling import thread_milling_findings
from chipload.simulation.approach import approach_findings
from chipload.simulation.drill_depth import drill_depths
from chipload.simulation.holes import deep_holes, sideways_drills
from chipload.simulation.steps import StepBlocks
from chipload.simulation.stops import stop_findings
from chipload.simulation.tool_change import changes_in_stock
from chipload.units import rpm_from_rad_s

Floats = NDArray[np.float64]

#: a tool that is below the bottom of the stock by less [mm] ends there
TOUCHES = 1e-3


@dataclass(frozen=True, eq=False)
class ProgramSurroundings:
    """What a program is run in, and what its text states besides motions.

    Parameters
    ----------
    contains : which points (m, 3) [mm] are in the initial stock
    low, high : (3,) float [mm], corners of its box
    bodies_below : whether the table, or a fixture, that lies below the stock is stated
    stops : lines at which the program stops for its operator
    retractions : lines that retract to a position of the machine which is not known, and so have no row
    text : the program of a text from its first row on, which begins from an unknown place and ends behind its last row;
        None: the first row of the program is where the tool stands, and other motions may follow the last
    """

    contains: Callable[[Floats], NDArray[np.bool_]]
    low: Floats
    high: Floats
    bodies_below: bool = False
    stops: Sequence[int] = ()
    retractions: Sequence[int] = ()
    text: Program | None = None


def program_findings(
    program: Program,
    steps: StepBlocks,
    columns: Mapping[str, NDArray[Any]],
    cutters: Mapping[int, Cutter],
    around: ProgramSurroundings,
) -> tuple[Finding, ...]:
    """Return findings on tool changes, first position, stops, end, holes, spindle speeds and what lies below the stock.

    Parameters
    ----------
    steps : of the program, one for each row of ``columns``
    columns : of its removal
    cutters : by tool
    """
    box = around.low, around.high
    return (
        *changes_in_stock(program, cutters, *box, around.retractions),
        *(() if around.text is None else approach_findings(around.text, cutters, around.contains, *box)),
        *stop_findings(
            program,
            steps,
            columns,
            cutters,
            around.contains,
            box,
            around.stops,
            around.retractions,
            around.text is not None,
        ),
        *(tapping_findings(program, cutters) if around.text is None else ()),
        *thread_milling_findings(program, cutters),
        *deep_holes(columns, cutters),
        *sideways_drills(columns, cutters),
        *drill_depths(columns, cutters, float(around.low[2])),
        *speed_findings(program, cutters),
        *(() if around.bodies_below else below_stock(program, cutters, *box)),
    )


def speed_findings(program: Program, cutters: Mapping[int, Cutter]) -> tuple[Finding, ...]:
    """Return a finding ``cutter-speed`` for each cutter that is turned faster than it may be."""
    speed, out = np.abs(np.asarray(program.spindle)), []
    for number, cutter in sorted(cutters.items()):
        if cutter.max_speed is None:
            continue
        own = np.where(program.tool == number, speed, 0.0)
        k = int(np.argmax(own)) if len(own) else 0
        if len(own) and own[k] > cutter.max_speed * (1.0 + 1e-9):
            per = rpm_from_rad_s(1.0)
            text = (
                f"tool {number} turns at {per * own[k]:.6g} rpm: max_rpm of its [[cutter]] is "
                f"{per * cutter.max_speed:.6g}"
            )
            out.append(Finding("cutter-speed", int(program.line[k]), text, Severity.EXCEEDS))
    return tuple(out)


def below_stock(program: Program, cutters: Mapping[int, Cutter], low: Floats, high: Floats) -> tuple[Finding, ...]:
    """Return a finding ``below-stock`` at the deepest motion below the bottom of the stock, under or beside it.

    What lies there is not stated: the table, parallels, a vice.

    Parameters
    ----------
    low, high : (3,) float [mm], corners of the box of the stock
    """
    below, above = bounds(program)
    radius = np.zeros(len(program))
    for number, cutter in cutters.items():
        radius[program.tool == number] = cutter.radius
    lean = radius * np.sqrt(np.maximum(1.0 - np.asarray(program.axis)[:, 2] ** 2, 0.0))
    near = (below[:, :2] - radius[:, None] < high[:2]).all(axis=1) & (above[:, :2] + radius[:, None] > low[:2]).all(
        axis=1
    )
    known = np.isin(program.tool, list(cutters)) & (program.motion != DWELL)
    depth = np.where(near & known, low[2] - (below[:, 2] - lean), 0.0)
    k = int(np.argmax(depth)) if len(depth) else 0
    if not len(depth) or depth[k] <= TOUCHES:
        return ()
    x, y, z = (float(v) for v in program.p_work[k])
    text = (
        f"tool {int(program.tool[k])} goes {depth[k]:.4g} mm below the bottom of the stock: what lies there is not "
        "stated: state the table ([machine_table]) or what is below ([[fixture]])"
    )
    return (Finding("below-stock", int(program.line[k]), text, Severity.UNPROVEN, (x, y, z)),)
