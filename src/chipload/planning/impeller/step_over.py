"""Step-over of a toroidal cutter that leaves a scallop of a given height.

Notation: N surface normal, T cutter axis, s = sin of the angle between them; r corner radius, rho = R - r; d unit
vector along the path, e = N x d across it; K curvature tensor of the surface, above 0 where it bends towards N; height
h of the scallop along the normal, w step-over along the surface.

The cutter touches with the tensor C of principal curvatures 1/r, in the plane of N and T, and 1/(r + rho/s). Its swept
surface along d is tangent to the surface along the path, and to the cutter along the line where it leaves its trace. So
to second order it bends away from the surface by q = det(C - K) / d.(C - K)d across the path. On a plane 1/q = r cos^2
+ (r + rho/s) sin^2 of the angle from the plane of N and T to e: the radii are mixed, not the curvatures, as the trace
is the outline of the cutter seen along d.

With k = e.K e the surface and with k + q the pass are arcs across the path; two passes meet at the height h where

    sin^2(k w / 4) = k^2 h (2 - h (k + q)) / (4 q (1 - h k)),    on a plane w = 2 sqrt(2 h / q - h^2).

Exact for a ball; for a toroid of second order in w, within 1 % of the step-over where h is below 1 % of rho s.

Reference: [Wu2019]. Differs from source: no approximation for small h, and any direction of the path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chipload.errors import InputError
from chipload.planning.impeller.scene import Floats


@dataclass(frozen=True, eq=False)
class Contact:
    """Orientation of a cutter's axis and a path at contact points; every array of one shape (...,).

    Parameters
    ----------
    sine : s
    k11, k12, k22 : K in the tangents e1, towards the axis, and e2 = N x e1 [1/mm]
    d1, d2 : the path's direction in them
    across : k, the surface's curvature across the path [1/mm]
    """

    sine: Floats
    k11: Floats
    k12: Floats
    k22: Floats
    d1: Floats
    d2: Floats
    across: Floats


def contact_of(normal: ArrayLike, axis: ArrayLike, along: ArrayLike, curvature: ArrayLike) -> Contact:
    """Contacts of the arrays N, T (..., 3), directions (..., 3) of any length near the tangent plane, K (..., 3, 3).

    Raises
    ------
    InputError
        An axis stands along the normal (flat contact has no trace), a direction has no part across it.
    """
    N, T, D = (np.asarray(x, dtype=np.float64) for x in (normal, axis, along))
    K = np.asarray(curvature, dtype=np.float64)
    lean = T - _dot(N, T)[..., None] * N
    s = np.linalg.norm(lean, axis=-1)
    flat = D - _dot(D, N)[..., None] * N
    length = np.linalg.norm(flat, axis=-1)
    for name, value, text in (
        ("axis", s, "must not stand along the normal"), ("along", length, "must have a direction across the normal"),
    ):  # fmt: skip
        if not (value > 0.0).all():
            raise InputError(f"{name} of contact point {int(np.ravel(value > 0.0).argmin())}: {text}")
    e1, d = lean / s[..., None], flat / length[..., None]
    e2, e = np.cross(N, e1), np.cross(N, d)
    parts = (
        np.einsum("...i,...ij,...j->...", a, K, b) for a, b in ((e1, e1), (e1, e2), (e2, e2))
    )  # fmt: skip
    out = (s, *parts, _dot(d, e1), _dot(d, e2), np.einsum("...i,...ij,...j->...", e, K, e))
    return Contact(*np.broadcast_arrays(*out))


def trace_curvature(contact: Contact, rho: float, corner: float) -> Floats:
    """Curvature q of the cutter's trace across the path, beyond that of the surface.

    Parameters
    ----------
    rho, corner : [mm], corner >= 0, their sum above 0; rho below 0: of the flank arc of a barrel

    Returns
    -------
    (...,) float [1/mm]; inf: an edge (r = 0) drawn along itself; 0 where the cutter does not fit the surface.

    Examples
    --------
    Axis square to the normal, the step towards the axis: the corner alone counts; across it: the whole radius.

    >>> flat = np.zeros((1, 3, 3))
    >>> 1.0 / trace_curvature(contact_of([[1, 0, 0]], [[0, 0, 1]], [[0, 1, 0]], flat), 8.0, 2.0)
    array([2.])
    >>> 1.0 / trace_curvature(contact_of([[1, 0, 0]], [[0, 0, 1]], [[0, 0, 1]], flat), 8.0, 2.0)
    array([10.])
    """
    if not (math.isfinite(rho) and 0.0 <= corner < math.inf and rho + corner > 0.0):
        raise InputError(f"rho {rho:g}, corner radius {corner:g} mm: must be finite, corner at least 0, sum above 0")
    f = contact
    # C - K, along e1 times r, so that an edge (r = 0) needs no case
    a = 1.0 - corner * f.k11
    b = f.sine / (rho + corner * f.sine) - f.k22
    det = a * b - corner * f.k12**2
    through = a * f.d1**2 - 2.0 * corner * f.k12 * f.d1 * f.d2 + corner * b * f.d2**2
    fits = (a > 0.0) & (det > 0.0)
    edge = fits & (through <= 0.0)
    out: Floats = np.where(fits & ~edge, det / np.where(through > 0.0, through, 1.0), np.where(edge, np.inf, 0.0))
    return out


def width(contact: Contact, rho: float, corner: float, scallop: float) -> Floats:
    """Step-over w (...,) [mm] at the height ``scallop`` [mm], > 0; as :func:`step_over`."""
    if not 0.0 < scallop < math.inf:
        raise InputError(f"scallop_mm = {scallop:g}: must be above 0")
    k = contact.across
    w = _ridge_distance(trace_curvature(contact, rho, corner), k, scallop, 2.0 * (rho + corner))
    if rho <= 0.0:
        return w
    # a disc of radius rho lying flat with a ball on either side is the widest
    ball = 1.0 - corner * k
    side = np.where(ball > 0.0, ball, 0.0) / corner if corner > 0.0 else np.full(k.shape, np.inf)
    out: Floats = np.minimum(w, 2.0 * rho + _ridge_distance(side, k, scallop, 2.0 * corner))
    return out


def _ridge_distance(q: Floats, k: Floats, scallop: float, most: float) -> Floats:
    """Distance along the arc k of two arcs k + q whose ridge is so high; at most ``most``; 0 where q is 0."""
    some = (q > 0.0) & np.isfinite(q)
    qs = np.where(some, q, 1.0)
    trace = k + qs
    # two arcs cannot meet above their widest place
    h = np.minimum(scallop, np.where(trace > 0.0, 1.0 / np.where(trace > 0.0, trace, 1.0), math.inf))
    clear = 1.0 - h * k
    meets = some & (clear > 0.0)
    chord = np.sqrt(np.where(meets, h * (2.0 - h * trace) / (qs * np.where(meets, clear, 1.0)), 0.0))
    bend = np.abs(k) > 0.0
    half = np.clip(0.5 * np.abs(k) * chord, 0.0, 1.0)
    w = np.where(bend, 4.0 * np.arcsin(half) / np.where(bend, np.abs(k), 1.0), 2.0 * chord)
    # no ridge reaches beyond the centre of a hollow
    out: Floats = np.where(some & ~meets, most, np.minimum(w, most))
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
    """Step-over w at contact points.

    Parameters
    ----------
    normal, axis : N, T (..., 3)
    along : (..., 3), any length, in the tangent plane or near it
    curvature : K (..., 3, 3) float [1/mm]
    rho, corner : [mm], as of :func:`trace_curvature`
    scallop : h [mm], > 0

    Returns
    -------
    (...,) float [mm], at most that of the cutter lying flat; 0 where the cutter does not fit the
    curvature of the surface.

    Examples
    --------
    >>> w = step_over([[1, 0, 0]], [[0, 0, 1]], [[0, 0, 1]], np.zeros((1, 3, 3)), 8.0, 2.0, 0.05)
    >>> bool(np.isclose(w[0], 2.0 * np.sqrt(2.0 * 0.05 * 10.0 - 0.05**2)))
    True
    """
    return width(contact_of(normal, axis, along, curvature), rho, corner, scallop)


def _dot(a: Floats, b: Floats) -> Floats:
    out: Floats = (a * b).sum(axis=-1)
    return out
