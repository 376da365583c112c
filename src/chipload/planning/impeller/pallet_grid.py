"""Largest cutter at each pallet angle of a grid, an estimate before the exact ranges are calculated.

Notation: rho = R - r of one corner radius r; c contact point, t table angle, B pallet angle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from chipload.lazy import LateModule
from chipload.planning.impeller.blocks import BLOCK, in_blocks
from chipload.planning.impeller.scene import Floats, Scene
from chipload.planning.impeller.search import SearchLimits
from chipload.progress import silent

_pallet_grid = LateModule("chipload.planning.impeller._pallet_grid")


def largest_on_grid(
    scene: Scene, found: SearchLimits, pallets: ArrayLike, cut: float = np.inf, workers: int = 1, slack: float = 1e-9
) -> Floats:
    """Largest rho of the cutting part at every contact point, table angle and pallet angle of a grid.

    Parameters
    ----------
    found : largest rho and its bound for every contact point and table angle, of one corner radius
    pallets : pallet angles B [rad]
    cut : height of the cutting part above the corner's centre [mm], the same as in the search for ``found``
    slack : [mm] a value is cut off at this much above the bound

    Returns
    -------
    (c, t, B) float [mm]; -inf where the axis points into the surface or the corner is larger than its curvature.
    """
    B = np.ascontiguousarray(pallets, dtype=np.float64)
    tree, alpha, r = scene.tree, found.tables, found.corner_radius
    out = np.full((*found.rho.shape, len(B)), -np.inf)
    points, own = scene.ordered, scene.own
    cones = np.column_stack([np.sin(alpha), np.cos(alpha)])
    tool = np.array([r, cut, scene.near**2])
    rows = np.ascontiguousarray(scene.rows)
    most = np.where(r * scene.curvature_max[:, None] >= 1.0, -np.inf, np.maximum(found.bound, found.rho) + slack)
    place = np.empty(len(tree.order), dtype=np.int64)
    place[tree.order] = np.arange(len(tree.order))
    hints = np.full((*found.rho.shape, found.blockers.shape[2] + 1), -1, dtype=np.int64)
    hints[:, :, :-1] = np.where(found.blockers >= 0, place[np.maximum(found.blockers, 0)], -1)

    def block(first: int) -> None:
        _pallet_grid.largest_at_pallets(
            points, own, tree.nodes, tree.spans, tree.leaves, rows, cones, tool, B, most, hints, first,
            min(first + BLOCK, len(rows)), out,
        )  # fmt: skip

    in_blocks(block, len(rows), workers, silent, "pallet angles of a grid")
    return out
