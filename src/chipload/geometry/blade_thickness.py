"""Thickness of a blade: the least distance from one of its sides to the other one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.sections import Blade
from chipload.lazy import scipy

Floats = NDArray[np.float64]

#: points of a side along and up, closer together towards its edges; those of the other side
_POINTS, _OTHER = (121, 21), (1201, 61)
#: steps by which the nearest place of the other side is found
_STEPS = 6


def thickness(body: Blade, edge: float) -> float:
    """Least distance [mm] from a side of a blade, less a share ``edge`` of it at its edges, to the other side."""
    out = np.inf
    for own, other in ((body.plus, body.minus), (body.minus, body.plus)):
        U, V = _grid(_OTHER, 0.0)
        u, v = _grid(_POINTS, edge)
        points = own.at(u, v)
        _, k = scipy.spatial.cKDTree(other.at(U, V)).query(points)
        out = min(out, float(_distance(other, points, U[k], V[k]).min()))
    return out


def _distance(patch: BSplinePatch, points: Floats, u: Floats, v: Floats) -> Floats:
    """Distance (n,) [mm] of points from a surface, from the places (u, v) on by Newton's method without curvature."""
    out = np.linalg.norm(points - patch.at(u, v), axis=1)
    for _ in range(_STEPS):
        away = points - patch.at(u, v)
        J = np.stack([patch.at(u, v, 1, 0), patch.at(u, v, 0, 1)], axis=-1)
        A = np.swapaxes(J, 1, 2) @ J + 1e-12 * np.eye(2)
        step = np.linalg.solve(A, np.swapaxes(J, 1, 2) @ away[..., None])[..., 0]
        u, v = np.clip(u + step[:, 0], 0.0, 1.0), np.clip(v + step[:, 1], 0.0, 1.0)
        out = np.minimum(out, np.linalg.norm(points - patch.at(u, v), axis=1))
    least: Floats = out
    return least


def _grid(count: tuple[int, int], edge: float) -> tuple[Floats, Floats]:
    along = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, count[0]))
    u, v = np.meshgrid(edge + (1.0 - 2.0 * edge) * along, np.linspace(0.0, 1.0 - edge, count[1]), indexing="ij")
    return u.ravel(), v.ravel()
