"""Rows of the user's own finishing program, from which the passes of a wall are offset.

Notation: u, v place on a side, S its point and N its normal; D [mm] stock that a pass leaves; q = S + D N its contact
points, n the normal of the surface q(u, v); A the axis of the cutter, the same as in the program; t the feed, l to its
left. A row is a part of the program along which the cutter touches the side and u is monotone.

The surface q has the tangents S_u + D_u N + D N_u and S_v + D_v N + D N_v, by differences; D between places by monotone
cubics, as in :mod:`chipload.planning.thinwall.linking`.

Reference: [Yan2018], which offsets the finish path by the depths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import scipy
from chipload.planning.thinwall.contact import SideAt
from chipload.planning.thinwall.flank_stock import Pose
from chipload.planning.thinwall.passes import NOTHING, WallPass
from chipload.planning.thinwall.paths import Rows

Floats = NDArray[np.float64]

#: step in u and v of the differences from which normals are calculated
STEP = 1e-5


@dataclass(frozen=True, eq=False)
class FinishRow:
    """One row of a program over a side.

    Attributes
    ----------
    u, v : (s,) float; u rises or falls throughout
    axis : (s, 3) float, unit vectors
    line : first line of the program in it
    """

    u: Floats
    v: Floats
    axis: Floats
    line: int


@dataclass(frozen=True, eq=False)
class FinishSide:
    """The rows of a program over one side.

    Attributes
    ----------
    at : points and normals of the side
    rows : in the order of the program
    foot : share of v that keeps its stock
    """

    at: SideAt
    rows: tuple[FinishRow, ...]
    foot: float

    def laid(self, p: WallPass, places: tuple[Floats, Floats], posture: Pose) -> tuple[Rows, Floats, Floats]:
        """Rows of a pass, and the parameters (r, s, 2) and the planned depth (r, s) [mm] of their contact points.

        ``posture`` is not used: the axes are those of the program.
        """
        count = np.array([len(row.u) for row in self.rows])
        at = np.minimum(np.arange(count.max()), count[:, None] - 1)
        there = np.arange(count.max()) < count[:, None]
        u, v, axis = (
            np.stack([np.take(getattr(row, name), k, axis=0) for row, k in zip(self.rows, at, strict=True)])
            for name in ("u", "v", "axis")
        )
        low, high = (depth_at(d, places, u.ravel(), v.ravel()).reshape(u.shape) for d in (p.low, p.high))
        contact, normal = self._left(p.low, places, u, v)
        feed = _feeds(contact, normal, count)
        depth = np.where(there, high - low, 0.0)
        return Rows(contact, normal, feed, depth > NOTHING, axis, count), np.stack([u, v], axis=-1), depth

    def _left(self, left: Floats, places: tuple[Floats, Floats], u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Points and unit normals (..., 3) of the surface that a pass leaves."""

        def q(a: Floats, b: Floats) -> Floats:
            point, normal = self.at(a, b)
            return np.asarray(point + depth_at(left, places, a, b)[:, None] * normal)

        a, b = u.ravel(), v.ravel()
        ends_u, ends_v = (
            [np.clip(x + s * STEP, low, 1.0) for s in (-1.0, 1.0)] for x, low in ((a, 0.0), (b, self.foot))
        )
        along, up = q(ends_u[1], b) - q(ends_u[0], b), q(a, ends_v[1]) - q(a, ends_v[0])
        normal = np.cross(along, up)
        normal *= np.sign((normal * self.at(a, b)[1]).sum(axis=1, keepdims=True))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return q(a, b).reshape(*u.shape, 3), normal.reshape(*u.shape, 3)


def depth_at(values: Floats, places: tuple[Floats, Floats], u: Floats, v: Floats) -> Floats:
    """Depths (n, m) of places, interpolated at parameters (k,): monotone cubics along u, then along v.

    Examples
    --------
    >>> places = np.array([0.0, 1.0]), np.array([0.0, 1.0])
    >>> depth_at(np.array([[0.0, 1.0], [2.0, 3.0]]), places, np.array([0.5]), np.array([0.25])).tolist()
    [1.25]
    """
    each, which = np.unique(u, return_inverse=True)
    cubics = scipy.interpolate.PchipInterpolator(
        places[1], scipy.interpolate.PchipInterpolator(places[0], values, axis=0)(each), axis=1
    )
    piece = np.clip(np.searchsorted(places[1], v, side="right") - 1, 0, len(places[1]) - 2)
    x = v - places[1][piece]
    c = cubics.c[:, piece, which]
    return np.asarray(((c[0] * x + c[1]) * x + c[2]) * x + c[3])


def _feeds(contact: Floats, normal: Floats, count: NDArray[np.int64]) -> Floats:
    """Directions of travel (r, s, 3) at the points of rows, within the surface; beyond the last point that of it."""
    number = np.arange(contact.shape[1])
    here = np.minimum(number, count[:, None] - 1)
    low, high = np.maximum(here - 1, 0), np.minimum(here + 1, count[:, None] - 1)
    along = np.take_along_axis(contact, high[..., None], axis=1) - np.take_along_axis(contact, low[..., None], axis=1)
    along -= (along * normal).sum(axis=2, keepdims=True) * normal
    return np.asarray(along / np.linalg.norm(along, axis=2, keepdims=True))


@dataclass(frozen=True, eq=False)
class RowFrames:
    """Lead and tilt of the cutter along the rows of a side, at the finished surface.

    Attributes
    ----------
    sign : 1 where the row before lies on the right of the feed, -1 on its left, 0 in the first row
    lead, tilt : (k,) float [rad], of all points of the rows with this sign
    """

    sign: int
    lead: Floats
    tilt: Floats


def row_frames(side: FinishSide) -> tuple[RowFrames, ...]:
    """Leads and tilts of the rows of a side, in two groups: the row before lies on the right, or on the left."""
    found: dict[int, list[tuple[Floats, Floats]]] = {}
    middles = np.array([0.5 * (float(row.v.min()) + float(row.v.max())) for row in side.rows])
    for k, row in enumerate(side.rows):
        point, normal = side.at(row.u, row.v)
        count = np.array([len(row.u)])
        t = _feeds(point[None], normal[None], count)[0]
        left = np.cross(normal, t)
        lead = np.arcsin(np.clip((row.axis * t).sum(axis=1), -1.0, 1.0))
        tilt = np.arctan2((row.axis * left).sum(axis=1), (row.axis * normal).sum(axis=1))
        found.setdefault(_sign(side, middles, k, point, left), []).append((lead, tilt))
    first = found.pop(0, [])
    if not found:
        found[0] = first
    return tuple(
        RowFrames(sign, *(np.concatenate([pair[i] for pair in each]) for i in (0, 1)))
        for sign, each in sorted(found.items())
    )


def _sign(side: FinishSide, middles: Floats, k: int, point: Floats, left: Floats) -> int:
    """On which side of the feed of row k the nearest row lies that was cut before it: 1 its right, -1 its left."""
    if k == 0:
        return 0
    near = side.rows[int(np.abs(middles[:k] - middles[k]).argmin())]
    at = len(point) // 2
    other = int(np.abs(near.u - side.rows[k].u[at]).argmin())
    along = side.at(near.u[other : other + 1], near.v[other : other + 1])[0][0] - point[at]
    return -1 if float(along @ left[at]) > 0.0 else 1


def heights_of(rows: Sequence[FinishRow], u: Floats) -> Floats:
    """Parameter v (r, k) of rows at parameters u (k,); beyond the ends of a row the value at its end."""
    out = []
    for row in rows:
        order = np.argsort(row.u)
        out.append(np.interp(u, row.u[order], row.v[order]))
    return np.array(out)
