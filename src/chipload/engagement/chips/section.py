"""The section of a cutter with a plane layer at an instant, and whether a point lies in it.

Notation: p tip, A = (a, A_z) unit axis, layer z = h. A cutter is a convex solid of revolution: bottom face or cone,
corner circle, flank arc of a barrel, flank, and the plane at the end of the flutes. Its section is convex: x(theta) = c
+ l(theta) M (cos theta, sin theta), M = I + a a' / (A_z (1 + A_z)), c halfway between the ends of the section along a;
l is where the ray leaves the solid, in closed form but at a corner of radius below d / 2 (Newton, to rounding). For a
flank alone c is the centre of the ellipse, l = R and theta its own parameter.

F(x) >= 0 outside, < 0 inside: the greatest of the distances to bottom, flank and top and to the corner's torus.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.move import Move
from chipload.errors import InputError
from chipload.lazy import LateModule

_section = LateModule("chipload.engagement.chips._section")

Floats = NDArray[np.float64]


@lru_cache(maxsize=64)
def cutter_numbers(cutter: Cutter) -> Floats:
    """(17,) e, r, f, sin, cos, tan of alpha, of beta, flank radius at the tip, H, rho(H), of the flank arc of a barrel
    E, R (0: none), F [mm], sin, cos of kappa where the corner ends.
    """
    d, r, e, f, alpha, beta, H = cutter.apt
    arc = cutter.flank_arc
    foot = 0.5 * d * (1.0 - math.tan(alpha) * math.tan(beta))
    bottom = (math.sin(alpha), math.cos(alpha), math.tan(alpha))
    flank = (math.sin(beta), math.cos(beta), math.tan(beta))
    bow = (0.0, 0.0, 0.0) if arc is None else (arc.e, arc.radius, arc.f)
    end = (flank[1], flank[0]) if arc is None else (math.sin(arc.kappa_from), math.cos(arc.kappa_from))
    out = np.array([e, r, f, *bottom, *flank, foot, H, float(cutter.radius_at(H)), *bow, *end])
    out.setflags(write=False)
    return out


@dataclass(frozen=True, eq=False)
class SectionEdge:
    """Points of the edge of a section.

    ``points`` (n, 2) [mm], ``V`` (n,) [mm per unit of t] outward speed of the edge, ``normal`` (n, 2) outward unit,
    ``piece`` (n,): 0 bottom face, 1 bottom cone, 2 corner, 3 flank, 4 top of the flutes, 6 flank
    arc of a barrel.
    """

    theta: Floats
    points: Floats
    V: Floats
    normal: Floats
    piece: NDArray[np.int64]


def section(move: Move, cutter: Cutter, height: float, t: float, theta: ArrayLike) -> SectionEdge | None:
    """The edge of the section at t at the angles theta (n,) [rad]; None where the layer doesn't cut the open cutter.

    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> move = Move.lerp([0, 0, 0], [0, 0, 1], [20, 0, 0], [0, 0, 1])
    >>> section(move, mill, 1.0, 0.5, [0.0]).points.tolist(), section(move, mill, -1.0, 0.5, [0.0])
    ([[15.0, 0.0]], None)
    """
    if not 0.0 <= t <= 1.0:
        raise InputError(f"section: t = {t:g}: must be from 0 to 1")
    K, S, C = cutter_numbers(cutter), np.empty(27), np.empty((8, 5))
    if not _section.instant(move.tip, move.axis, K, float(height), float(t), S, C):
        return None
    angles = np.atleast_1d(np.asarray(theta, dtype=np.float64))
    rows, V = np.empty((len(angles), 7)), np.empty(len(angles))
    for i, angle in enumerate(angles):
        V[i] = _section.point(S, K, angle, rows[i])
    return SectionEdge(angles, rows[:, :2], V, rows[:, 4:6], rows[:, 6].astype(np.int64))


def depth(move: Move, cutter: Cutter, height: float, t: float, points: ArrayLike) -> Floats:
    """F (n,) [mm] of points (n, 2) on the layer at t, from the profile rho(w) of the cutter.

    The same in NumPy as the branch and bound uses; rays and roots know nothing of it.
    """
    x = np.asarray(points, dtype=np.float64)
    p, A = (v[0] for v in move.at([t]))
    X = np.column_stack([x, np.full(len(x), float(height))]) - p
    w = X @ A
    return distance(cutter, np.linalg.norm(X - w[:, None] * A, axis=1), w)


def distance(cutter: Cutter, rho: Floats, w: Floats) -> Floats:
    """F (n,) [mm] of points at distances rho (n,) from the axis and heights w (n,) above the tip, above 0 outside.

    It is the distance from the surface but where the nearest point is a sharp edge.

    >>> barrel = Cutter(12.0, 3, 0.5, 28.0, 50.0, 6e5, corner_radius=2.0, barrel_radius=85.0)
    >>> distance(barrel, np.array([7.0]), np.array([barrel.flank_arc.f])).round(9).tolist()
    [1.0]
    """
    d, r, e, f, alpha, beta, H = cutter.apt
    foot = 0.5 * d * (1.0 - math.tan(alpha) * math.tan(beta))
    u, v = rho - e, f - w
    out = np.maximum(w - H, (rho - foot) * math.cos(beta) - w * math.sin(beta))
    out = np.maximum(out, rho * math.sin(alpha) - w * math.cos(alpha))
    end, arc = cutter.corner_end, cutter.flank_arc
    if r > 0.0 or arc is not None:
        corner = (u * math.cos(alpha) > v * math.sin(alpha)) & (u * math.cos(end) < v * math.sin(end))
        out = np.where(corner, np.maximum(out, np.hypot(u, v) - r), out)
    if arc is not None:
        u, v = rho - arc.e, arc.f - w
        bow = (u * math.cos(end) >= v * math.sin(end)) & (u * math.sin(beta) < v * math.cos(beta))
        out = np.where(bow, np.maximum(out, np.hypot(u, v) - arc.radius), out)
    return np.asarray(out)
