"""Engagement of the steps of a program in its level motions, from the path of the cutter's centre alone.

It is exact on lines and arcs, where steps are chords whose direction differs from that of the path.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.geometry.contour import Region
from chipload.lazy import LateModule
from chipload.program.program import Program
from chipload.simulation.centre_path import LEVEL_MM, flat_motions, motion_rows, rim_engagement
from chipload.simulation.verify import heights_of, levels_of

_centre_path = LateModule("chipload.simulation._centre_path")

Floats = NDArray[np.float64]

#: a step ends on the path within this [mm]: written arcs are rounded, so that their two radii differ
MATCH_MM = 2e-3


def level_engagement(
    program: Program,
    radius: float,
    stock: Region | None,
    stock_top_mm: float,
    points: ArrayLike,
    *,
    workers: int = 1,
) -> Floats:
    """Return the engagement (m,) [deg] at the ends of steps; NaN where the motion rises or descends.

    Parameters
    ----------
    program : motions in the XY plane, at one or more heights; rapids included
    radius : R [mm]
    stock : before row 0 of the program, in the plane; None: solid everywhere
    stock_top_mm : a step at or above this height has no engagement
    points : (m, 3) float [mm], ends of the steps in their order
    workers : threads; the answer does not depend on it
    """
    at = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    out = np.full(len(at), np.nan)
    out[at[:, 2] >= stock_top_mm - LEVEL_MM] = 0.0
    motions = flat_motions(program)
    z0, z1 = heights_of(program)
    k, w = np.zeros(len(at), dtype=np.int64), np.zeros(len(at))
    xy, z = np.ascontiguousarray(at[:, :2]), np.ascontiguousarray(at[:, 2])
    found = int(_centre_path.locate(xy, z, motion_rows(motions), z0, z1, MATCH_MM, LEVEL_MM, k, w))
    for level in levels_of(program, radius, stock, stock_top_mm):
        own = (np.abs(z - level.z) <= LEVEL_MM) & np.isnan(out) & (np.arange(len(at)) < found)
        own &= (np.abs(z1[k] - z0[k]) <= LEVEL_MM) & (level.centre_path.lengths[k] > 0.0)
        rows = np.flatnonzero(own)
        if len(rows):
            out[rows] = np.degrees(rim_engagement(level.centre_path, k[rows], w[rows], workers=workers).angle)
    return out
