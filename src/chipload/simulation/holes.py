"""Deep holes that are drilled in one motion, and drills that are moved sideways in material.

Chips that do not leave a hole jam in the flutes and break the drill: what it drills between two retractions is bounded
by its diameter. Beside its point a drill has margins that guide it and no cutting edges.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.drilling import is_drill
from chipload.errors import Finding, Severity

#: a hole of at most so many diameters is drilled in one motion: jobber drills are made for 3 to 5
DEEP = 5.0
#: a step goes down the axis if the ramp angle is at least this [deg]
AXIAL_DEG, AXIAL = 90.0 - 1e-3, 1.0 - 1e-9
#: a step is sideways if it leaves the axis by more than this [rad]: points of leaning holes are rounded
SIDEWAYS = math.radians(1.0)
PLACE, AXIS = ("x_mm", "y_mm", "z_mm"), ("axis_x", "axis_y", "axis_z")


def deep_holes(columns: Mapping[str, NDArray[Any]], cutters: Mapping[int, Cutter]) -> tuple[Finding, ...]:
    """Return a finding for each tool that drills deeper in one motion than it is known to: its deepest hole.

    The depth is that between two retractions in which material lies under the centre.

    Parameters
    ----------
    columns : of the removal, one row for each step; ``ramp_deg`` among them
    cutters : by tool
    """
    if "ramp_deg" not in columns or not len(columns["ramp_deg"]):
        return ()
    tool, s_mm = np.asarray(columns["tool"]), np.asarray(columns["s_mm"])
    solid = (np.asarray(columns["ramp_deg"]) >= AXIAL_DEG) & (np.asarray(columns["chip_volume_mm3"]) > 0.0)
    # runs of steps that go down the axis with one tool; by layers some of them meet nothing
    down = down_axis(columns)
    run = np.cumsum(down & ~(np.append(False, down[:-1]) & np.append(False, tool[1:] == tool[:-1])))
    solid &= down
    out = []
    for number, cutter in sorted(cutters.items()):
        rows = np.flatnonzero(solid & (tool == number))
        if not len(rows) or cutter.body:
            continue
        first = rows[np.flatnonzero(np.diff(run[rows], prepend=-1))]
        last = rows[np.flatnonzero(np.diff(run[rows], append=-1))]
        depth = s_mm[last] - np.where(first > 0, s_mm[first - 1], 0.0)
        deepest = int(np.argmax(depth))
        most = DEEP * cutter.diameter if cutter.hole_depth is None else cutter.hole_depth
        if depth[deepest] <= most * (1.0 + 1e-9):
            continue
        row = int(last[deepest])
        ratio = depth[deepest] / cutter.diameter
        known = cutter.hole_depth is not None
        text = (
            f"tool {number} drills {depth[deepest]:.4g} mm, {ratio:.3g} diameters, without a retraction: "
            + (
                f"hole_depth_mm of its [[cutter]] is {most:g}"
                if known
                else "whether its chips leave the hole is not known"
            )
            + ": drill in pecks (G83)"
            + ("" if known else ", or state hole_depth_mm in its [[cutter]]")
        )
        place = (float(columns["x_mm"][row]), float(columns["y_mm"][row]), float(columns["z_mm"][row]))
        severity = Severity.EXCEEDS if known else Severity.UNPROVEN
        out.append(Finding("deep-hole", int(columns["line"][row]), text, severity, place, row))
    return tuple(out)


def sideways_drills(columns: Mapping[str, NDArray[Any]], cutters: Mapping[int, Cutter]) -> tuple[Finding, ...]:
    """Return a finding ``drill-sideways`` for each drill that cuts off its axis: its first such step.

    Parameters
    ----------
    columns : of the removal, one row for each step
    cutters : by tool
    """
    drills = [number for number, cutter in sorted(cutters.items()) if is_drill(cutter)]
    if not drills or not len(columns["line"]):
        return ()
    p, axis = (np.column_stack([columns[name] for name in names]) for names in (PLACE, AXIS))
    d = np.diff(p, axis=0, prepend=p[:1])
    size = np.linalg.norm(d, axis=1)
    aside = np.abs((d * axis).sum(axis=1)) < math.cos(SIDEWAYS) * size
    aside &= (np.asarray(columns["chip_volume_mm3"]) > 0.0) & ~np.asarray(columns["rapid"])
    tool, out = np.asarray(columns["tool"]), []
    for number in drills:
        rows = np.flatnonzero(aside & (tool == number))
        if not len(rows):
            continue
        row, cutter = int(rows[0]), cutters[number]
        known = cutter.web is not None or cutter.hole_depth is not None
        text = f"drill {number} cuts sideways: it has no edges on its side: mill with an end mill" + (
            "" if known else ", or state ramp_angle_deg in its [[cutter]] if it is a mill with a point"
        )
        place = (float(columns["x_mm"][row]), float(columns["y_mm"][row]), float(columns["z_mm"][row]))
        severity = Severity.EXCEEDS if known else Severity.UNPROVEN
        out.append(Finding("drill-sideways", int(columns["line"][row]), text, severity, place, row))
    return tuple(out)


def down_axis(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return which steps feed down the axis of the tool, (n,)."""
    p, axis = (np.column_stack([columns[name] for name in names]) for names in (PLACE, AXIS))
    d = np.diff(p, axis=0, prepend=p[:1])
    size = np.linalg.norm(d, axis=1)
    return np.asarray((-(d * axis).sum(axis=1) >= AXIAL * size) & (size > 0.0) & ~np.asarray(columns["rapid"]))
