"""Nodes that cover a surface: every point of the surface is within a stated bound of a node.

Notation: X(u, v) [mm] a surface, q = X(u_i, v_j) a node, p = X(u_i + a, v_j + b) a point of it nearer to q than to its
neighbours, |a| <= A, |b| <= B. With bounds M of the second derivatives between them p - q = t + e, t = X_u(p) a +
X_v(p) b in the tangent plane at p, |e| <= E = (M_uu A^2 + 2 M_uv A B + M_vv B^2) / 2 and |t| <= |X_u(q) a + X_v(q) b| +
2 E. The bounds of a B-spline are those of the control points of its derivatives (convex hull), for each span of its
knots; they do not depend on samples.

Reference: [Piegl1997] ch. 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.bspline import BSplinePatch, basis
from chipload.geometry.revolve import Revolved

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Nodes:
    """Points of a surface, their unit normals out of the metal (0 where there is none), and the bounds of the covering.

    Parameters
    ----------
    points, normals : (n, 3) float [mm]
    reach, bend : greatest |t| and E of a point of the surface [mm]
    """

    points: Floats
    normals: Floats
    reach: float
    bend: float


def patch_nodes(patch: BSplinePatch, edge: float) -> Nodes:
    """Nodes of a patch at the corners of cells at most ``edge`` [mm] wide.

    >>> from chipload.geometry.bspline import patch_through
    >>> flat = patch_through([[[0, 0, 0], [0, 3, 0]], [[4, 0, 0], [4, 3, 0]]], [0, 1], [0, 1])
    >>> made = patch_nodes(flat, 1.0)
    >>> len(made.points), round(made.reach, 9), made.bend
    (20, 0.707106781, 0.0)
    """
    size = {d: _derivative_bound(patch, *d) for d in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))}
    u, span_u = _parameters_of(patch.knots_u, size[1, 0].max(axis=1), edge)
    v, span_v = _parameters_of(patch.knots_v, size[0, 1].max(axis=0), edge)
    shape = (len(u), len(v))
    X, Xu, Xv = (grid_of(patch, u, v, *d) for d in ((0, 0), (1, 0), (0, 1)))
    A, B = 0.5 * np.diff(u)[:, None], 0.5 * np.diff(v)[None, :]
    cell = np.ix_(span_u, span_v)
    bend = 0.5 * (size[2, 0][cell] * A * A + 2.0 * size[1, 1][cell] * A * B + size[0, 2][cell] * B * B)
    reach = np.zeros(bend.shape)
    for rows in (slice(None, -1), slice(1, None)):
        for columns in (slice(None, -1), slice(1, None)):
            a, b = Xu[rows, columns] * A[..., None], Xv[rows, columns] * B[..., None]
            for sign in (1.0, -1.0):
                np.maximum(reach, np.linalg.norm(a + sign * b, axis=2), out=reach)
    cross = patch.side * np.cross(Xu, Xv)
    length = np.linalg.norm(cross, axis=2, keepdims=True)
    N = np.divide(cross, length, out=np.zeros((*shape, 3)), where=length > 0.0)
    return Nodes(X.reshape(-1, 3), N.reshape(-1, 3), float((reach + 2.0 * bend).max()), float(bend.max()))


def hub_nodes(hub: Revolved, along: tuple[float, float], theta: tuple[float, float], edge: float) -> Nodes:
    """Nodes of a part of a surface of revolution, as :func:`patch_nodes`.

    ``along`` first and last parameter s of its curve, ``theta`` first and last angle [rad].
    """
    knots = np.unique(np.concatenate([along, hub.knots]))
    knots = knots[(knots >= along[0]) & (knots <= along[1])]
    # between knots r'' of a cubic is linear and r' a parabola: both are bounded by their end values and r''
    first, second = (np.linalg.norm(hub.curve(knots, d), axis=1) for d in (1, 2))
    wide = np.diff(knots)
    M2 = np.maximum(second[1:], second[:-1])
    M1 = np.maximum(first[1:], first[:-1]) + 0.5 * M2 * wide
    count = np.maximum(np.ceil(M1 * wide / edge), 1.0).astype(np.int64)
    s, span = _steps_of(knots, count)
    r = hub.curve(s)[:, 0]
    turns = np.maximum(np.ceil(r * (theta[1] - theta[0]) / edge), 1.0).astype(np.int64)
    rows = np.repeat(np.arange(len(s)), turns + 1)
    share = np.concatenate([np.linspace(0.0, 1.0, n + 1) for n in turns.tolist()])
    angle = theta[0] + share * (theta[1] - theta[0])
    A = 0.5 * np.diff(s)
    half = 0.5 * (theta[1] - theta[0]) / turns
    B = np.maximum(half[1:], half[:-1])
    widest = np.maximum(r[1:], r[:-1]) + M1[span] * A
    bend = 0.5 * (M2[span] * A * A + 2.0 * M1[span] * A * B + widest * B * B)
    reach = np.hypot(M1[span] * A, widest * B)
    at = s[rows]
    return Nodes(hub.at(at, angle), hub.normal(at, angle), float(reach.max()), float(bend.max()))


def turn_nodes(nodes: Nodes, angle: float) -> Nodes:
    """The nodes turned about z by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    R = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return Nodes(nodes.points @ R, nodes.normals @ R, nodes.reach, nodes.bend)


def grid_of(patch: BSplinePatch, u: Floats, v: Floats, du: int = 0, dv: int = 0) -> Floats:
    """Points or derivatives (a, b, 3) of a patch on the grid of u (a,) and v (b,)."""
    p, q = patch.degrees
    i, N = basis(patch.knots_u, p, u, du)
    j, M = basis(patch.knots_v, q, v, dv)
    first = np.einsum("ak,akmd->amd", N, patch.control[i[:, None] + np.arange(p + 1)])
    out: Floats = np.einsum("bl,abld->abd", M, first[:, j[:, None] + np.arange(q + 1)])
    return out


def _parameters_of(knots: Floats, slope: Floats, edge: float) -> tuple[Floats, NDArray[np.int64]]:
    """Parameters that divide each knot span into equal steps at most ``edge`` [mm] long, and the span of each step."""
    ends = np.unique(knots)
    count = np.maximum(np.ceil(slope * np.diff(ends) / edge), 1.0).astype(np.int64)
    return _steps_of(ends, count)


def _steps_of(ends: Floats, count: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64]]:
    """Parameters that divide each span into ``count`` equal steps, and the span of each step."""
    rows = zip(ends[:-1].tolist(), ends[1:].tolist(), count.tolist(), strict=True)
    parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in rows]
    return np.concatenate([*parts, ends[-1:]]), np.repeat(np.arange(len(count)), count)


def _derivative_bound(patch: BSplinePatch, du: int, dv: int) -> Floats:
    """Bound (spans of u, spans of v) of the length [mm] of the derivative of this order in each span."""
    net, axes = patch.control, []
    for axis, (knots, degree, order) in enumerate(
        zip((patch.knots_u, patch.knots_v), patch.degrees, (du, dv), strict=True)
    ):
        middles = np.unique(knots)
        middles = 0.5 * (middles[1:] + middles[:-1])
        k = knots
        for _ in range(order):
            net, k, degree = _derivative(net, k, degree, axis)
        last = np.searchsorted(k, middles, side="right") - 1
        axes.append(np.clip(last[:, None] - np.arange(degree + 1), 0, net.shape[axis] - 1))
    size = np.linalg.norm(net, axis=2)
    out: Floats = size[axes[0][:, None, :, None], axes[1][None, :, None, :]].max(axis=(2, 3))
    return out


def _derivative(net: Floats, knots: Floats, degree: int, axis: int) -> tuple[Floats, Floats, int]:
    """Control points, knots and degree of the derivative along an axis."""
    if degree == 0:
        return np.zeros_like(net), knots, 0
    width = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    shape = [1, 1, 1]
    shape[axis] = len(width)
    # a basis function over coincident knots is zero
    share = np.divide(degree, width, out=np.zeros(len(width)), where=width > 0.0).reshape(shape)
    return np.diff(net, axis=axis) * share, knots[1:-1], degree - 1
