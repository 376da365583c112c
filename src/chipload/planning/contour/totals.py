"""Totals of the passes of a contour: their time, and the share of the stock on the walls that they clear."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.contour import Contour, Region
from chipload.planning.contour.offsets import Walls
from chipload.planning.contour.passes import ContourPass, rough_stock
from chipload.planning.result import Columns

#: chords of arcs leave them by this [mm], of the cutter by this part of its radius
CHORD, OF_RADIUS = 2e-4, 64


def cleared_percent(
    stock: Region, walls: Walls, behind: float, depth: float, passes: Sequence[ContourPass], radius: float
) -> float:
    """Share of the area between the rough surface and the walls that the cutter passes over, in percent.

    Of an open wall only what lies beside it counts, not beyond its ends. What a corner that is smaller than the cutter
    keeps is not cleared.

    Parameters
    ----------
    stock : from the rough surface to ``behind`` inside the part, in the planning frame
    behind, depth : [mm]; greatest distance of the rough surface from the walls
    radius : of the cutter [mm]
    """
    import shapely

    def line(contour: Contour) -> shapely.LineString:
        return shapely.LineString(contour.flatten(CHORD))

    part = rough_stock(walls, walls.extended, behind).flatten(CHORD)
    zone = shapely.union_all([shapely.buffer(line(w), 1.01 * depth, cap_style="flat") for w in walls.walls])
    to_clear = shapely.intersection(shapely.difference(stock.flatten(CHORD), part), zone)
    lines = [contour for p in passes for contour in (p.lead_in, p.path, p.lead_out) if contour is not None]
    swept = shapely.union_all([shapely.buffer(line(contour), radius, quad_segs=OF_RADIUS) for contour in lines])
    return float(100.0 * shapely.intersection(to_clear, swept).area / to_clear.area)


def counts(passes: int, history: Columns) -> dict[str, object]:
    """Time [s] by kind of motion, number of passes, and number of retracts between them."""
    linked = elapsed_time(history, history["pass"] == "link")
    return {
        "cutting_s": float(history["t_s"][-1]) - linked,
        "link_s": linked,
        "passes": passes,
        "lifts": passes - 1,
    }


def elapsed_time(history: Columns, where: NDArray[np.bool_]) -> float:
    """Time of the steps that end in a row ``where`` [s]."""
    return float(np.diff(history["t_s"], prepend=0.0)[where].sum())
