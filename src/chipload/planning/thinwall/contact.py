"""Contact points of a ball, bull-nose or barrel cutter on a side of a wall.

Notation: S(u, v) a point of the side, N its normal out of the wall; tip p, axis A, r the radius of the corner, or of
the flank arc of a barrel, e the radius of the circle that its centres lie on (below 0 on a barrel), C its middle. The
centre of the corner that is nearest to the side is M = C - e m, m the part of N across A as a unit vector (M = C on a
ball). The cutter touches where M - S lies along N and is r long; the clearance is what is left between both, below 0
where the cutter cuts into the side.

The place is found by Newton's method from the nearest point of a grid, kept within 0..1: beyond an edge M - S has a
part along the side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.lazy import scipy

Floats = NDArray[np.float64]
#: points (n, 3) [mm] and unit normals (n, 3) of a side at u (n,) and v (n,)
SideAt = Callable[[Floats, Floats], tuple[Floats, Floats]]

#: points of the grid along and up a side, turns at most, and the change of u and v that ends them
GRID, TURNS, SMALL = (65, 33), 40, 1e-10
#: step in u and v of the differences that Newton's method takes, and the greatest change at once
SLOPE, FARTHEST = 1e-4, 0.05
#: step of the differences that tangents are made from, in u and v
STEP = 1e-6
#: greatest part of M - S along the side [mm] at which the cutter touches it: the allowed distance beyond an edge
ALONG = 0.02


@dataclass(frozen=True, eq=False)
class SideContacts:
    """Nearest point of a side and clearance, at each of n places of the cutter's path.

    Attributes
    ----------
    u, v : (n,) float
    clearance : (n,) float [mm], infinite where the nearest point is one of an edge, or of the foot
    """

    u: Floats
    v: Floats
    clearance: Floats


class ContactFinder:
    """Search for contact points on a side above its foot, a share of v, with a grid of points that is made once."""

    def __init__(self, side: SideAt, cutter: Cutter, foot: float = 0.0) -> None:
        self.side, self.cutter, self.foot = side, cutter, foot
        middle = np.full(2, 0.5)
        height = float(np.linalg.norm(np.diff(side(middle, np.array([foot, 1.0]))[0], axis=0)))
        self.lowest = foot - ALONG * (1.0 - foot) / height
        self.u, self.v = (x.ravel() for x in np.meshgrid(*(np.linspace(0.0, 1.0, n) for n in GRID), indexing="ij"))
        points = side(self.u, self.v)[0]
        self.tree = scipy.spatial.cKDTree(points)
        own = points.reshape(*GRID, 3)
        self.mesh = max(float(np.linalg.norm(np.diff(own, axis=k), axis=-1).max()) for k in (0, 1))

    def contacts(self, tip: Floats, axis: Floats, far: float) -> SideContacts:
        """Nearest points and clearances of the cutter on the side.

        Parameters
        ----------
        tip, axis : (n, 3) float [mm], unit vectors
        far : [mm]; a clearance that is certainly greater is returned as infinite
        """
        r, e, height = self.cutter.finishing_arc
        C = tip + height * axis
        # a barrel's arc lies beside C, along the axis
        reach = r + e if e >= 0.0 else self.cutter.flute_length + self.cutter.diameter
        away, nearest = self.tree.query(C)
        clearance, u, v = np.full(len(C), np.inf), self.u[nearest], self.v[nearest]
        near = np.flatnonzero(away <= reach + far + 2.0 * self.mesh)
        if len(near):
            u[near], v[near], clearance[near] = _nearest(self.side, r, e, C[near], axis[near], u[near], v[near])
        clearance[v < self.lowest] = np.inf
        return SideContacts(u, np.maximum(v, self.foot), clearance)


def _nearest(
    side: SideAt, r: float, e: float, C: Floats, axis: Floats, u: Floats, v: Floats
) -> tuple[Floats, Floats, Floats]:
    """Places and clearances from a first guess."""

    def along_side(a: Floats, b: Floats) -> Floats:
        """(n, 2) parts of M - S along the tangents, times their lengths."""
        point, normal = side(a, b)
        offset = _corner_centre(C, axis, normal, e) - point
        return np.stack([(t * offset).sum(axis=1) for t in tangents(side, a, b)], axis=1)

    for _ in range(TURNS):
        g = along_side(u, v)
        # differences into the side, whose edges are at 0 and 1
        du, dv = (np.where(x > 0.5, -SLOPE, SLOPE) for x in (u, v))
        columns = (along_side(u + du, v) - g) / du[:, None], (along_side(u, v + dv) - g) / dv[:, None]
        change = -np.linalg.solve(np.stack(columns, axis=2), g[..., None])[..., 0].clip(-FARTHEST, FARTHEST)
        before = u, v
        u, v = np.clip(u + change[:, 0], 0.0, 1.0), np.clip(v + change[:, 1], 0.0, 1.0)
        if max(float(np.abs(x - y).max()) for x, y in zip((u, v), before, strict=True)) < SMALL:
            break
    point, normal = side(u, v)
    offset = _corner_centre(C, axis, normal, e) - point
    over = (offset * normal).sum(axis=1)
    lateral = np.linalg.norm(offset - over[:, None] * normal, axis=1)
    return u, v, np.where(lateral <= ALONG, over - r, np.inf)


def _corner_centre(C: Floats, axis: Floats, normal: Floats, e: float) -> Floats:
    """M of corner circles with their middles at C (n, 3)."""
    return C if e == 0.0 else C - e * part_across(normal, axis)


def part_across(normal: Floats, axis: Floats) -> Floats:
    """Part of normals (..., 3) across axes (..., 3) as unit vectors; 0 where both are parallel."""
    part = normal - (normal * axis).sum(axis=-1, keepdims=True) * axis
    size = np.linalg.norm(part, axis=-1, keepdims=True)
    return np.asarray(np.where(size > 1e-12, part / np.where(size > 1e-12, size, 1.0), 0.0))


def tangents(side: SideAt, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Derivatives of S (n, 3) [mm] by u and by v."""
    out = []
    for k in (0, 1):
        ends = [np.clip((u, v)[k] + s * STEP, 0.0, 1.0) for s in (-1.0, 1.0)]
        low, high = (side(*((x, v) if k == 0 else (u, x)))[0] for x in ends)
        out.append((high - low) / (ends[1] - ends[0])[:, None])
    return out[0], out[1]
