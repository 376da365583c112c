"""The first position of a program: where the tool comes from is not known.

A controller moves there, most often in a rapid, from wherever its machine stands. Above the stock, or straight
down beside it from where it was sent in X and Y, nothing is in the way; elsewhere the way may go through the stock.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import Finding, Severity
from chipload.program.program import RAPID, Program
from chipload.program.travel import leading_rows
from chipload.simulation.remaining_stock import Inside, stands_in

Floats = NDArray[np.float64]

#: a tool that is below the top of the stock by less [mm] is above it
TOUCHES = 1e-6


def approach_findings(
    program: Program, cutters: Mapping[int, Cutter], inside: Inside, low: Floats, high: Floats
) -> tuple[Finding, ...]:
    """Return a finding if the first position of a program is in the stock, or may be reached through it only.

    Codes: ``approach-through-stock`` (exceeds), ``approach-unknown`` (unproven).

    Parameters
    ----------
    cutters : by tool
    inside : which points (m, 3) are in the initial stock
    low, high : (3,) float [mm], corners of its box
    """
    row = leading_rows(program.path_mode) if len(program) else 0
    number = int(program.tool[row]) if len(program) else 0
    if number not in cutters:
        return ()
    cutter, line = cutters[number], int(program.line[row])
    tip, axis = np.asarray(program.p_work[row]), np.asarray(program.axis[row])
    x, y, z = place = (float(tip[0]), float(tip[1]), float(tip[2]))
    rapid = program.motion[row] == RAPID
    at = f"the first {'rapid' if rapid else 'motion'} ends at X{x:.6g} Y{y:.6g} Z{z:.6g}"
    if stands_in(inside, cutter, tip, axis):
        if not rapid:
            text = (
                f"{at}, in the stock: where tool {number} comes from is not known: begin with a rapid beside the stock"
            )
            return (Finding("approach-unknown", line, text, Severity.UNPROVEN, place, row),)
        text = f"{at}, in the stock: wherever tool {number} comes from, it goes through material"
        return (Finding("approach-through-stock", line, text, Severity.EXCEEDS, place, row),)
    corners = np.array([[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i, j, k in np.ndindex(2, 2, 2)])
    below = float(((corners - tip) @ axis).max())
    if below <= TOUCHES or (_straight_down(program, row) and _clear_of_box(cutter, tip, axis, low, high)):
        return ()
    text = (
        f"{at}, {below:.4g} mm below the top of the stock: where tool {number} comes from is not known, and its way "
        "may go through the stock: go to a position above the stock first"
    )
    return (Finding("approach-unknown", line, text, Severity.UNPROVEN, place, row),)


def _straight_down(program: Program, row: int) -> bool:
    """Whether a row moves along the tool's axis alone, from where the row before it ends."""
    if row == 0:
        return False
    d = np.asarray(program.p_work[row] - program.p_work[row - 1])
    return bool(np.linalg.norm(np.cross(d, program.axis[row])) <= TOUCHES)


def _clear_of_box(cutter: Cutter, tip: Floats, axis: Floats, low: Floats, high: Floats) -> bool:
    """Whether an upright tool stands beside the box of the stock, with all that is above it."""
    if axis[2] < 1.0 - 1e-9:
        return False
    widest = max(cutter.diameter, cutter.shank_diameter or 0.0, *(d for _, d in cutter.holder), 0.0)
    radius = max(0.5 * widest, float(cutter.radius_at(np.array([cutter.flute_length]))[0]))
    apart = np.maximum(np.maximum(low[:2] - tip[:2], tip[:2] - high[:2]), 0.0)
    return bool(np.hypot(*apart) >= radius - TOUCHES)
