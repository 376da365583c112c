"""Tooth engagement in a layered workpiece: immersion and chip thickness of each slice of the edge.

Notation: p, A tip [mm] and unit axis at an instant, T, n with T x n = A (n mirrored where the spindle turns
counter-clockwise), phi immersion, u = cos(phi) n + sin(phi) T; a slice of the cutter is a circle of radius rho at the
height z, its surface has the outward normal nu = sin(kappa) u - cos(kappa) A. V [mm], W [rad] what the tip moves and
the axis turns while the spindle turns by one tooth.

A point p + z A + rho u moves by V + W x (z A + rho u) in that time, so that the chip is as thick as its normal part:

    h = sin(kappa) u . (V + z W x A) - rho cos(kappa) u . (A x W) - cos(kappa) V . A,

a sinusoid of phi, f_z sin(phi) for a flank that moves across its axis, the feed per tooth on the bottom of a plunge. A
tooth cuts where h > 0 (by more than rounding: 1e-9 of its way) and the point is in the material that the move before it
has left.

The material is known in layers, each by its section at half its height. A point is compared with the section of its
layer at the place where the cutter's surface, uphill or downhill of the point, has the height of that section: on a
convex cutter both lie on the same front, so that what the cutter left half a step behind is not taken for air, and the
end of a stock at a bound of layers is met exactly. Where the surface has no such place (flat bottom, tip of a ball), or
does not cut there, the section next below the point decides at the point's own x, y.

Reference: [Chips2017] for the layers, [Engin2001] for the slices of a general cutter.
Differs from source: h is to first order in the feed per tooth, the path of a tooth is the circle about the moving axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.slices import Slices
from chipload.errors import InputError
from chipload.stock.layers import LayeredStock
from layer_oracle import _immersion

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Section:
    """Edges of the material in layers that lie on one another.

    Parameters
    ----------
    bounds : (l + 1,) float [mm], ascending
    start : (l + 1,) int; layer i has the edges start[i] .. start[i + 1] - 1
    edges : (m, 4) float [mm], rows x0, y0, x1, y1 of closed rings; edges that no ray along +x from the cutter can
        meet may be left out
    """

    bounds: Floats
    start: Ints
    edges: Floats


def edges_under(stock: LayeredStock, layers: range, low: ArrayLike, high: ArrayLike) -> Section:
    """The edges of neighbouring layers under a rectangle between the corners ``low`` and ``high`` (2,) [mm]; those that
    no ray along +x from the rectangle meets are left out.
    """
    (x0, y0), (_, y1) = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    found = []
    for i in layers:
        rings = shapely.get_rings(shapely.get_parts(stock.section(i, low, high)))
        points, ring = shapely.get_coordinates(rings, return_index=True)
        edges = np.hstack([points[:-1], points[1:]])[ring[1:] == ring[:-1]]
        x, y = edges[:, ::2], edges[:, 1::2]
        found.append(edges[(x.max(axis=1) >= x0) & (y.max(axis=1) >= y0) & (y.min(axis=1) <= y1)])
    start = np.cumsum([0, *(len(e) for e in found)])
    return Section(stock.bounds[layers.start : layers.stop + 1], start, np.concatenate([np.empty((0, 4)), *found]))


@lru_cache(maxsize=64)
def _table(cutter: Slices) -> Floats:
    """(k, 9) s from, s to, rho, z at the middle, sin kappa, cos kappa, z at s from and to, radius of the arc."""
    middle = cutter.z_middle
    half = 0.5 * (cutter.s_to - cutter.s_from)
    bent = cutter.radius > 0.0
    r = np.where(bent, cutter.radius, 1.0)
    kappa = np.arctan2(cutter.sin_kappa, cutter.cos_kappa)
    rest = np.where(bent, r * (cutter.cos_kappa - np.cos(kappa + half / r)), half * cutter.sin_kappa)
    sides = [cutter.sin_kappa, cutter.cos_kappa, cutter.z, middle + rest, cutter.radius]
    out = np.column_stack([cutter.s_from, cutter.s_to, cutter.rho, middle, *sides])
    out.setflags(write=False)
    return out


def engagement_rows(
    tip: ArrayLike,
    frame: ArrayLike,
    feed: ArrayLike,
    turn: ArrayLike,
    cutter: Slices,
    section: Section,
) -> tuple[Floats, Ints]:
    """Return the rows of :class:`chipload.engagement.tooth_engagement.ToothEngagement` of one instant, with slices.

    Parameters
    ----------
    tip : (3,) float [mm]
    frame : (3, 3) rows T, n, A, see :func:`chipload.engagement.tooth_engagement.tool_frame`; A points up: A_z > 0
    feed : V, (3,) float [mm] that the tip moves while the spindle turns by one tooth
    turn : W, (3,) float [rad] that the axis turns in that time
    cutter : its slices
    section : the material before the move, around the cutter; without edges nothing is cut

    Returns
    -------
    rows : (b, 7) float, owner : (b,) int

    Notes
    -----
    O(k m) for k slices and m edges. Upright, nothing is sampled: slices are divided at bounds of layers, and an
    engagement range ends where a circle meets an edge or where h = 0. If the axis leans, 96 immersions per turn are
    sampled and each change is bisected; what is narrower than 3.75 degrees between two of them may be missed.
    """
    R = np.ascontiguousarray(frame, dtype=np.float64)
    if R.shape != (3, 3) or not R[2, 2] > 0.0:
        raise InputError(f"axis z = {R[2, 2]:g}: must be above 0: the spindle stands above the layers")
    table = _table(cutter)
    room = 4 * len(table) + 16
    while True:
        rows, owner = np.empty((room, 7)), np.empty(room, dtype=np.int64)
        count = _immersion.step_engagement(
            np.asarray(tip, dtype=np.float64),
            R,
            np.asarray(feed, dtype=np.float64),
            np.asarray(turn, dtype=np.float64),
            table,
            section.bounds,
            section.start,
            section.edges,
            rows,
            owner,
        )
        if count >= 0:
            return rows[:count], owner[:count]
        room *= 4
