"""Depth of the check's rays below the surfaces of an impeller: less than the thickness of its blades.

A ray that comes near the other side of a blade meets the cutter that mills there, by as much as that may gouge. It
would count as a gouge as deep as the ray.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import scipy
from chipload.planning.impeller.impeller import Impeller

Floats = NDArray[np.float64]

#: greatest depth of a ray [mm]
MOST = 0.5
#: how far from the other side a ray ends, over the gouge that is allowed
_AWAY = 1.5
#: points of a side along and up, closer together towards its edges; those of the other side
_POINTS, _OTHER = (121, 21), (1201, 61)
#: steps by which the nearest place of the other side is found
_STEPS = 6
#: over the gouge that is allowed, the least depth at which it is recognised
_LEAST = 1.2


def ray_depth(impeller: Impeller, edge: float, gouge: float) -> float:
    """Greatest depth [mm] of rays into the metal that do not come out on its other side.

    Parameters
    ----------
    edge : share of a side that is left out next to its edges
    gouge : that is allowed [mm]

    Raises
    ------
    InputError
        The blades are too thin to distinguish such a gouge from a cutter on their other side.
    """
    least = min(thickness(impeller, index, edge) for index in range(len(impeller.bodies)))
    depth = min(MOST, least - _AWAY * gouge)
    if depth < _LEAST * gouge:
        raise InputError(
            f"operation.0.paths.gouge_mm = {gouge:g}: the metal is {least:.3g} mm thick next to an edge of a blade: "
            f"must be at most {least / (_AWAY + _LEAST):.2g} mm"
        )
    return depth


def thickness(impeller: Impeller, index: int, edge: float) -> float:
    """Least distance [mm] from a side of a body, less its edges, to the other side."""
    body = impeller.bodies[index]
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
