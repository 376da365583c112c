"""Largest cutter at each pallet angle of a grid, an estimate before the exact ranges are calculated.

Notation: rho = R - r of one corner radius r; c contact point, t table angle, B pallet angle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from chipload.planning.impeller.blocks import BLOCK, in_blocks
from chipload.planning.impeller.grid import _kernels
from chipload.planning.impeller.scene import Floats, Scene
from chipload.planning.impeller.search import SearchLimits
from chipload.progress import silent


def admitted(
    scene: Scene, found: SearchLimits, pallets: ArrayLike, cut: float = np.inf, workers: int = 1, slack: float = 1e-9
) -> Floats:
    """Largest rho (c, t, B) [mm] of the cutting part at pallet angles [rad], within the limits that were found.

    Parameters
    ----------
    found : of the corner radius, with its table angles; values above bounds and ``slack`` [mm] are alike
    cut : height of the cutting part above the corner's centres [mm], as the limits were found with

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
        _kernels.on_grid(
            points, own, tree.nodes, tree.spans, tree.leaves, rows, cones, tool, B, most, hints, first,
            min(first + BLOCK, len(rows)), out,
        )  # fmt: skip

    in_blocks(block, len(rows), workers, silent, "pallet angles of a grid")
    return out
