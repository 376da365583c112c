"""Clearance of the whole cutter from the check points, at a pose or over a whole move.

Notation: p [mm] tip, T unit axis; D distance of the nearest check point from the cutter, negative if one is inside. On
a move the tip goes straight and the axis turns at a constant rate from T0 to T1. No point of the cutter within L of the
tip travels farther than |p1 - p0| + L angle(T0, T1). D at the middle less half of that is therefore a lower bound of D
on the whole move; the move is halved until the bound decides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from chipload.cutter.catalogue import CatalogueCutter
from chipload.lazy import LateModule
from chipload.planning.impeller.profile import profile_numbers
from chipload.planning.impeller.scene import Floats, Ints, Scene
from chipload.planning.impeller.tree import Tree

_clearance = LateModule("chipload.planning.impeller._clearance")

#: number of times that a move is halved before it counts as not clear
_DEPTH = 14


def clearance(
    scene: Scene, cutter: CatalogueCutter, tips: ArrayLike, axes: ArrayLike, cap: float, above: float = 0.0
) -> tuple[Floats, Ints]:
    """Distance of the nearest check point from the cutter at each pose.

    Parameters
    ----------
    tips, axes : (n, 3) [mm], unit
    cap : [mm] greatest distance that is returned
    above : [mm] by which neck, shank and holder are enlarged

    Returns
    -------
    (n,) float [mm], (n,) int the nearest check point, -1: none within ``cap``
    """
    tree = scene.tree
    out, which = nearest(scene.ordered, tree, cutter, cutter.stages(above), tips, axes, cap)
    return out, np.where(which >= 0, tree.order[np.maximum(which, 0)] if len(tree.order) else which, which)


def nearest(
    ordered: Floats, tree: Tree, cutter: CatalogueCutter, stages: Floats, tips: ArrayLike, axes: ArrayLike, cap: float
) -> tuple[Floats, Ints]:
    """As :func:`clearance`, of points ``ordered`` (m, 3) [mm] in the order of their tree, with the parts ``stages``.

    The nearest point is its position in that order.
    """
    p = np.ascontiguousarray(tips, dtype=np.float64).reshape(-1, 3)
    a = np.ascontiguousarray(axes, dtype=np.float64).reshape(-1, 3)
    out, which = np.empty(len(p)), np.empty(len(p), dtype=np.int64)
    search = ordered, tree.nodes, tree.spans, tree.leaves, p, a
    if cutter.straight:
        _clearance.nearest(*search, cutter.rho, cutter.corner_radius, stages, cap, out, which)
    else:
        _clearance.nearest_to_profile(*search, profile_numbers(cutter), stages, cap, out, which)
    return out, which


def interpolated_axes(axes0: Floats, axes1: Floats, share: Floats) -> Floats:
    """Unit axes (n, 3), the turn from ``axes0`` to ``axes1`` (n, 3) at the ``share`` (n,) of its angle."""
    dot = np.clip((axes0 * axes1).sum(axis=1), -1.0, 1.0)
    angle = np.arccos(dot)
    flat = angle < 1e-7
    sine = np.where(flat, 1.0, np.sin(angle))
    a = np.where(flat, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
    b = np.where(flat, share, np.sin(share * angle) / sine)
    out = a[:, None] * axes0 + b[:, None] * axes1
    unit: Floats = out / np.linalg.norm(out, axis=1)[:, None]
    return unit


def moves_clear(
    scene: Scene, cutter: CatalogueCutter, tips: ArrayLike, axes: ArrayLike, margin: float, above: float = 0.0
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether it is proved that the cutter stays ``margin`` [mm] from every check point on each of the n - 1 moves.

    Parameters
    ----------
    tips, axes : (n, 3) [mm], unit: successive poses
    above : [mm] by which neck, shank and holder are enlarged
    """
    p = np.asarray(tips, dtype=np.float64).reshape(-1, 3)
    a = np.asarray(axes, dtype=np.float64).reshape(-1, 3)
    ok = np.ones(len(p) - 1, dtype=np.bool_)
    row, low, high = np.arange(len(p) - 1), np.zeros(len(p) - 1), np.ones(len(p) - 1)
    turn = np.arccos(np.clip((a[1:] * a[:-1]).sum(axis=1), -1.0, 1.0))
    travel = np.linalg.norm(np.diff(p, axis=0), axis=1)
    centre, radius = scene.tree.nodes[0, :3], max(float(scene.tree.nodes[0, 3]), 0.0)
    lever = np.maximum(np.linalg.norm(p[1:] - centre, axis=1), np.linalg.norm(p[:-1] - centre, axis=1)) + radius
    reach = travel + lever * turn
    for _ in range(_DEPTH):
        if not len(row):
            return ok
        mid = 0.5 * (low + high)
        tip = p[row] + mid[:, None] * (p[row + 1] - p[row])
        half = 0.5 * (high - low) * reach[row]
        distance, _ = clearance(
            scene, cutter, tip, interpolated_axes(a[row], a[row + 1], mid), margin + float(half.max()), above
        )
        bad = distance < margin
        ok[row[bad]] = False
        undecided = ok[row] & (distance < margin + half)
        row, low, mid, high = row[undecided], low[undecided], mid[undecided], high[undecided]
        row, low, high = np.tile(row, 2), np.concatenate([low, mid]), np.concatenate([mid, high])
    ok[row] = False
    return ok
