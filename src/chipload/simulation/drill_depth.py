"""How deep drills go: by their tip, by their full diameter, and through the bottom of the stock.

Notation: the point of a drill is R tan(bottom) long; a hole has its full diameter that far above the tip.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.drilling import is_pointed, point_length
from chipload.errors import Finding, Severity
from chipload.simulation.holes import AXIAL, AXIAL_DEG

#: depths that differ by less are one [mm]
SAME = 1e-3


def drill_depths(
    columns: Mapping[str, NDArray[Any]], cutters: Mapping[int, Cutter], bottom: float
) -> tuple[Finding, ...]:
    """Return a note for each drill that goes down along z: its deepest hole by tip and by full diameter, and whether it
    breaks through.

    Codes: ``drill-depth``, ``drill-breakthrough``, ``drill-point`` (through by the tip alone).

    Parameters
    ----------
    columns : of the removal; ``ramp_deg`` among them, else nothing is found
    bottom : of the stock [mm]
    """
    if "ramp_deg" not in columns:
        return ()
    z, tool = np.asarray(columns["z_mm"]), np.asarray(columns["tool"])
    # a step that breaks through has no material under the axis in its middle
    drills = np.asarray(columns["ramp_deg"]) >= AXIAL_DEG
    upright = np.asarray(columns["axis_z"]) >= AXIAL
    out = []
    for number, cutter in sorted(cutters.items()):
        rows = np.flatnonzero(drills & upright & (tool == number)) if is_pointed(cutter) else ()
        if not len(rows):
            continue
        lines = np.isin(np.asarray(columns["line"]), np.asarray(columns["line"])[rows])
        own = np.flatnonzero(lines & upright & (tool == number) & ~np.asarray(columns["rapid"]))
        row = int(own[np.argmin(z[own])])
        tip, point = float(z[row]), point_length(cutter)
        text = (
            f"tool {number} drills to z = {tip:.4g} with its tip and to z = {tip + point:.4g} with its full diameter: "
            f"its point is {point:.3g} mm long"
        )
        code = "drill-depth"
        if tip < bottom - SAME and tip + point > bottom + SAME:
            code = "drill-point"
            text += f", and the hole has not its full diameter at the bottom of the stock, z = {bottom:.4g}"
        elif tip < bottom - SAME:
            code = "drill-breakthrough"
            text += (
                f". It breaks through the bottom of the stock, z = {bottom:.4g}: from there to the full diameter the "
                "thrust falls and the lips may grab; reduce the feed over the point"
            )
        place = (float(columns["x_mm"][row]), float(columns["y_mm"][row]), tip)
        out.append(Finding(code, int(columns["line"][row]), text, Severity.NOTE, place, row))
    return tuple(out)
