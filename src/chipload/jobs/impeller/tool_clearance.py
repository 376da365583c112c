"""Clearance of the tool along an impeller program, with its table angle and pallet angle: columns of the history.

Notation: a **wall** is a side of a body, a fillet or a floor, as points on a grid. The clearance of a row is the
distance of the nearest point of any wall from the whole tool; in a finishing pass the wall that is milled, which is
the nearest one, does not count. In links every wall counts: there the clearance is 0 where they begin or end on a
wall. Between points of a wall the true distance may be less.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.planning.impeller.clearance import nearest
from chipload.planning.impeller.tree import tree_of
from chipload.result.limits import Columns
from chipload.simulation.channel.channel import SurfacePoints

Floats = NDArray[np.float64]

#: greatest clearance that is calculated [mm]
FAR = 20.0
#: labels of rows that mill a wall, or come to it and leave it along it
CUT = ("finish", "lead")


def clearance_blocks(
    rows: Columns, cutter: CatalogueCutter, walls: Callable[[], Sequence[SurfacePoints]]
) -> Callable[[], Iterator[Columns]]:
    """History of a program with its clearance, calculated once, at its first use.

    Parameters
    ----------
    rows : of its motions, or of the steps of its simulation; none: it has no motion
    """

    @cache
    def columns() -> Columns:
        axis = np.column_stack([rows[f"axis_{x}"] for x in "xyz"]).astype(np.float64)
        tip = np.column_stack([rows[f"{x}_mm"] for x in "xyz"]).astype(np.float64)
        cuts = np.isin(np.asarray(rows["pass"]).astype(str), CUT)
        return {
            **rows,
            "table_deg": np.degrees(np.arccos(np.clip(axis[:, 2], -1.0, 1.0))),
            "pallet_deg": np.degrees(np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))),
            "tool_clearance_mm": tool_clearance(walls(), cutter, tip, axis, cuts),
        }

    return lambda: iter([columns()] if rows else [])


def tool_clearance(
    walls: Sequence[SurfacePoints], cutter: CatalogueCutter, tip: Floats, axis: Floats, cuts: NDArray[np.bool_]
) -> Floats:
    """Distance [mm] of the nearest wall from the whole tool, (n,), at least 0 and at most :data:`FAR`.

    Parameters
    ----------
    tip, axis : (n, 3) [mm], unit
    cuts : (n,) rows that cut a wall: the nearest one does not count

    Examples
    --------
    >>> from chipload.geometry.bspline import patch_through
    >>> from chipload.simulation.channel.channel import wall
    >>> grid, tip = np.linspace(0.0, 1.0, 21), np.array([[5.0, 5.0, 0.0]])
    >>> def side(y):
    ...     patch = patch_through([[[0, y, 0], [0, y, 9]], [[9, y, 0], [9, y, 9]]], [0, 1], [0, 1])
    ...     return wall("side", patch, grid, grid)
    >>> mill, up = CatalogueCutter(6.0, 0.0), np.array([[0.0, 0.0, 1.0]])
    >>> tool_clearance([side(1.5), side(10.0)], mill, tip, up, np.array([False])).round(2).tolist()
    [0.5]
    >>> tool_clearance([side(1.5), side(10.0)], mill, tip, up, np.array([True])).round(2).tolist()
    [2.0]
    """
    stages = cutter.stages(0.0)
    found = np.full((max(len(walls), 2), len(tip)), FAR)
    for k, one in enumerate(walls):
        tree = tree_of(one.points)
        found[k], _ = nearest(np.ascontiguousarray(one.points[tree.order]), tree, cutter, stages, tip, axis, FAR)
    found = np.sort(found, axis=0)
    return np.asarray(np.maximum(np.where(cuts, found[1], found[0]), 0.0))
