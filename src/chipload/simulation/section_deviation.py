"""Check of a finished body for gouges: the cutter's path against its points, the stock against its sections.

Notation: C [mm] the middle of the corner circle's centres, at r_c along the axis from the tip; e radius of that circle,
r corner radius; (h, rho) height over C along the axis and distance from it.

Two methods, both independent of the planning of the path:

* **path**: at both ends and in the middle of every motion, rapids too, the least distance of the body's points to the
  corner (a torus, a sphere where e = 0) and to the flank and shank above it. Points of a grid of spacing s miss the
  nearest by at most s^2 / (8 r) on a flat body.
* **stock**: on every layer, how far the edge of the body's section lies outside the stock's (gouge) or inside it
  (left). In the plane of the layer, hence rather too great where a side leans.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.section import distance as profile_distance
from chipload.geometry.mesh import sections
from chipload.lazy import scipy, trimesh
from chipload.program.program import Program
from chipload.stock.layers import LayeredStock

Floats = NDArray[np.float64]

#: spacing of the balls that stand for flank and shank, over the radius
BALLS = 0.5
#: distance of a barrel from the body [mm] beyond which it is not measured
NEAR = 0.5
#: the flank is checked in one of so many motions
FLANKS = 4


@dataclass(frozen=True)
class WallClearance:
    """Least distance [mm] of a cutter to a body, below 0 where it goes in; where (x, y, z) [mm], in which row."""

    distance: float
    at: tuple[float, float, float]
    row: int


@dataclass(frozen=True)
class SectionDeviation:
    """Greatest depth into a body and height over it [mm], where, and how many points of its sections were checked."""

    gouge: float
    at: tuple[float, float, float]
    left: float
    points: int


def nearest(program: Program, cutter: Cutter, points: ArrayLike) -> WallClearance:
    """Return the least distance of a cutter to a body along a program.

    Parameters
    ----------
    cutter : ball, bull nose or barrel
    points : (p, 3) float [mm] of the body's surface
    """
    cloud = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    tree = scipy.spatial.cKDTree(cloud)
    p, A = np.asarray(program.p_work), np.asarray(program.axis)
    middle = A[1:] + A[:-1]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    tip = np.vstack([p, 0.5 * (p[1:] + p[:-1])])
    axis = np.vstack([A, middle])
    row = np.concatenate([np.arange(len(p)), np.arange(1, len(p))])
    r, e, f = cutter.apt[1:4]
    C = tip + f * axis
    distance, which = tree.query(C)
    if cutter.flank_arc is not None:
        corner, which = _barrel_distances(cutter, tip, axis, cloud, tree)
    elif e == 0.0:
        corner = distance - r
    else:
        corner, which = distance - e - r, which.copy()
        for k in np.flatnonzero(corner < 0.0):
            v = cloud[tree.query_ball_point(C[k], e + r)]
            h = v @ axis[k] - C[k] @ axis[k]
            rho = np.linalg.norm(v - C[k] - h[:, None] * axis[k], axis=1)
            d = np.hypot(np.maximum(rho - e, 0.0), h) - r
            corner[k] = float(d.min())
            which[k] = tree.query(v[int(d.argmin())])[1]
    low = int(corner.argmin())
    best = WallClearance(float(corner[low]), _place(cloud[which[low]]), int(row[low]))
    some = np.arange(0, len(tip), FLANKS)
    # a ball lower than its radius would reach out of the bottom of a bull nose
    first = max(f + BALLS * cutter.radius, cutter.radius)
    if cutter.flank_arc is not None:  # balls would reach out of the arc below them
        first = cutter.flute_length + cutter.radius
    for height in np.arange(first, cutter.overhang, BALLS * cutter.radius):
        thick = float(cutter.radius_at([min(height, cutter.flute_length)])[0])
        if height > cutter.flute_length and cutter.shank_diameter is not None:
            thick = max(thick, 0.5 * cutter.shank_diameter)
        distance, near = tree.query(
            tip[some] + height * axis[some], distance_upper_bound=thick + max(best.distance, 0.0)
        )
        low = int(distance.argmin())
        if distance[low] - thick < best.distance:
            best = WallClearance(float(distance[low] - thick), _place(cloud[near[low]]), int(row[some[low]]))
    return best


def _barrel_distances(
    cutter: Cutter, tip: Floats, axis: Floats, cloud: Floats, tree: scipy.spatial.cKDTree
) -> tuple[Floats, NDArray[np.int64]]:
    """Least distance (n,) of a barrel from a body in each place, as far as it is near, and the point (n,)."""
    half = 0.5 * cutter.flute_length
    reach = float(np.hypot(half, cutter.radius_at([cutter.flute_length])[0])) + NEAR
    least, which = np.full(len(tip), NEAR), np.zeros(len(tip), dtype=np.int64)
    for k, some in enumerate(tree.query_ball_point(tip + half * axis, reach)):
        if some:
            v = cloud[some] - tip[k]
            w = v @ axis[k]
            far = profile_distance(cutter, np.linalg.norm(v - w[:, None] * axis[k], axis=1), w)
            low = int(far.argmin())
            if far[low] < NEAR:
                least[k], which[k] = far[low], some[low]
    return least, which


def section_deviation(stock: LayeredStock, body: trimesh.Trimesh, low: float) -> SectionDeviation:
    """Return the greatest deviation of a stock from the finished body over its sections.

    Parameters
    ----------
    body : closed mesh
    low : height [mm] above which what is left over it counts
    """
    heights = stock.heights
    inside = np.flatnonzero((heights > body.bounds[0][2]) & (heights < body.bounds[1][2]))
    gouge, left, at, count = 0.0, 0.0, (0.0, 0.0, 0.0), 0
    for i, wanted in zip(inside.tolist(), sections(body, heights[inside]), strict=True):
        there = stock.section(i)
        edge = shapely.points(shapely.get_coordinates(wanted))
        apart = shapely.distance(edge, there.boundary)
        within = shapely.intersects(there, edge)
        count += len(edge)
        out = np.where(within, 0.0, apart)
        worst = int(out.argmax())
        if out[worst] > gouge:
            gouge, at = float(out[worst]), (float(edge[worst].x), float(edge[worst].y), float(heights[i]))
        if heights[i] >= low:
            left = max(left, float(np.where(within, apart, 0.0).max()))
    return SectionDeviation(gouge, at, left, count)


def _place(p: Floats) -> tuple[float, float, float]:
    return float(p[0]), float(p[1]), float(p[2])
