"""Distance between two passes of a toroidal cutter that leaves a scallop of a given height.

Notation: N surface normal, T cutter axis, s = sin of the angle between them; r corner radius, rho = R - r; d unit
vector along the path, e = N x d across it; K curvature tensor of the surface, above 0 where it bends towards N; h
vector along the path, e = N x d across it; K curvature tensor of the surface, above 0 where it bends towards N; height
h of the scallop along the normal, w step-over along the surface.
The cutter touches with the tensor C of principal curvatures 1/r, in the plane of N and T, and 1/(r + rho/s). What it
sweeps along d is tangent to the surface along the path and to the cutter along the line where it leaves its trace, so
to second order it bends away from the surface by q = det(C - K) / d.(C - K)d across the path. On a plane 1/q =
r cos^2 + (r + rho/s) sin^2 of the angle from the plane of N and T to e: the radii are mixed, not the curvatures, as
the trace is the outline of the cutter seen along d.

With k = e.K e the surface and with k + q the pass are arcs across the path; two passes meet at the height h where

    sin^2(k w / 4) = k^2 h (2 - h (k + q)) / (4 q (1 - h k)),    on a plane w = 2 sqrt(2 h / q - h^2).

Reference: [Wu2019]. Differs from source: no approximation for small h, and any direction of the path.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from chipload.errors import InputError
from chipload.planning.sectional.scene import Floats


def trace_curvature(
    normal: ArrayLike, axis: ArrayLike, along: ArrayLike, curvature: ArrayLike, rho: float, corner: float
) -> Floats:
    """How much more than the surface the trace of the cutter bends across the path: q.

    Parameters
    ----------
    normal, axis : N, T (c, 3)
    along : (c, 3), any length, in the tangent plane or near it
    curvature : K (c, 3, 3) float [1/mm]
    rho, corner : [mm], >= 0, one of them above 0

    Returns
    -------
    (c,) float [1/mm]; inf: an edge (r = 0) drawn along itself; not above 0 where the cutter does not fit the surface.

    Examples
    --------
    Axis square to the normal, the step towards the axis: the corner alone counts; across it: the whole radius.

    >>> flat = np.zeros((1, 3, 3))
    >>> 1.0 / trace_curvature([[1, 0, 0]], [[0, 0, 1]], [[0, 1, 0]], flat, 8.0, 2.0)
    array([2.])
    >>> 1.0 / trace_curvature([[1, 0, 0]], [[0, 0, 1]], [[0, 0, 1]], flat, 8.0, 2.0)
    array([10.])
    """
    if not (0.0 <= rho < math.inf and 0.0 <= corner < math.inf and rho + corner > 0.0):
        raise InputError(f"rho {rho:g}, corner radius {corner:g} mm: must be at least 0, one of them above 0")
    N, T, D = (np.atleast_2d(np.asarray(x, dtype=np.float64)) for x in (normal, axis, along))
    K = np.asarray(curvature, dtype=np.float64).reshape(-1, 3, 3)
    n = (N * T).sum(axis=1)
    lean = T - n[:, None] * N
    s = np.linalg.norm(lean, axis=1)
    d = _unit(D - (D * N).sum(axis=1)[:, None] * N, "along")
    if not (s > 0.0).all():
        raise InputError(f"axis of contact point {int((s > 0.0).argmin())}: must not stand along the normal")
    e1 = lean / s[:, None]
    e2 = np.cross(N, e1)
    k11, k12, k22 = (np.einsum("ci,cij,cj->c", a, K, b) for a, b in ((e1, e1), (e1, e2), (e2, e2)))
    # C - K times r along e1, so that an edge (r = 0) needs no case
    a = 1.0 - corner * k11
    b = s / (rho + corner * s) - k22
    d1, d2 = (d * e1).sum(axis=1), (d * e2).sum(axis=1)
    det = a * b - corner * k12 * k12
    through = a * d1 * d1 - 2.0 * corner * k12 * d1 * d2 + corner * b * d2 * d2
    fits = (a > 0.0) & (det > 0.0)
    edge = fits & (through <= 0.0)
    out: Floats = np.where(fits & ~edge, det / np.where(through > 0.0, through, 1.0), np.where(edge, np.inf, 0.0))
    return out


def step_over(
    normal: ArrayLike,
    axis: ArrayLike,
    along: ArrayLike,
    curvature: ArrayLike,
    rho: float,
    corner: float,
    scallop: float,
) -> Floats:
    """Step-over w at contact points; arguments as :func:`trace_curvature`.

    Parameters
    ----------
    scallop : h [mm], > 0

    Returns
    -------
    (c,) float [mm], at most the diameter; 0 where the cutter does not fit the curvature of the surface.

    Examples
    --------
    >>> w = step_over([[1, 0, 0]], [[0, 0, 1]], [[0, 0, 1]], np.zeros((1, 3, 3)), 8.0, 2.0, 0.05)
    >>> bool(np.isclose(w[0], 2.0 * np.sqrt(2.0 * 0.05 * 10.0 - 0.05**2)))
    True
    """
    if not 0.0 < scallop < math.inf:
        raise InputError(f"scallop_mm = {scallop:g}: must be above 0")
    q = trace_curvature(normal, axis, along, curvature, rho, corner)
    N, D = (np.atleast_2d(np.asarray(x, dtype=np.float64)) for x in (normal, along))
    K = np.asarray(curvature, dtype=np.float64).reshape(-1, 3, 3)
    e = _unit(np.cross(N, D), "along")
    k = np.broadcast_to(np.einsum("ci,cij,cj->c", e, K, e), q.shape)
    width = 2.0 * (rho + corner)
    some = (q > 0.0) & np.isfinite(q)
    qs = np.where(some, q, 1.0)
    # two passes cannot meet above the widest place of their arcs
    h = np.minimum(scallop, np.where(k + qs > 0.0, 1.0 / np.where(k + qs > 0.0, k + qs, 1.0), math.inf))
    clear = 1.0 - h * k
    open_ = some & (clear > 0.0)
    chord = np.sqrt(np.where(open_, h * (2.0 - h * (k + qs)) / (qs * np.where(open_, clear, 1.0)), 0.0))
    half = np.clip(0.5 * np.abs(k) * chord, 0.0, 1.0)
    bend = np.abs(k) > 0.0
    w = np.where(bend, 4.0 * np.arcsin(half) / np.where(bend, np.abs(k), 1.0), 2.0 * chord)
    # no scallop reaches beyond the centre of a hollow: one pass, as wide as the cutter
    out: Floats = np.where(some & ~open_, width, np.minimum(w, width))
    return out


def _unit(x: Floats, name: str) -> Floats:
    length = np.linalg.norm(x, axis=1)
    if not (length > 0.0).all():
        raise InputError(
            f"{name} of contact point {int((length > 0.0).argmin())}: must have a direction across the normal"
        )
    out: Floats = x / length[:, None]
    return out
