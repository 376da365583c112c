"""Check of a finished body for gouges: the cutter's path against its points, the stock beside each of them.

Notation: C [mm] the middle of the corner circle's centres, at r_c along the axis from the tip; e radius of that circle,
r corner radius; (h, rho) height over C along the axis and distance from it.

Two methods, both independent of the planning of the path:

* **path**: at both ends and in the middle of every motion, rapids too, the least distance of the body's points to the
  corner (a torus, a sphere where e = 0) and to the flank and shank above it. Points of a grid of spacing s miss the
  nearest by at most s^2 / (8 r) on a flat body.
* **stock**: from each point into the body until there is material (gouge), or out of it until there is none (left): the
  least distance along the normal and 16 directions about it, 8 % too great at most where it is beside them. The stock
  is its initial body less the moves; a gap or a film narrower than the distance may be passed over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.section import distance as profile_distance
from chipload.lazy import scipy, trimesh
from chipload.program.program import Program
from chipload.simulation.initial_stock import StockOfMoves

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: spacing of the balls that stand for flank and shank, over the radius
BALLS = 0.5
#: distance of a barrel from the body [mm] beyond which it is not measured
NEAR = 0.5
#: the flank is checked in one of so many motions
FLANKS = 4
#: distance from a point at which the stock is asked [mm]; first distance of a search [mm], and its halvings
BESIDE, FIRST, HALVINGS = 1e-7, 1e-3, 24
#: directions about a normal, along and across it, in which the distance is searched too
FAN = [
    (math.cos(lean), math.sin(lean) * math.cos(turn), math.sin(lean) * math.sin(turn))
    for lean in (0.25 * math.pi, 0.5 * math.pi)
    for turn in np.arange(8) * (0.25 * math.pi)
]
#: points whose distance is found together
SOME = 32
#: points of a mesh
POINTS = 20_000


@dataclass(frozen=True)
class WallClearance:
    """Least distance [mm] of a cutter to a body, below 0 where it goes in; where (x, y, z) [mm], in which row."""

    distance: float
    at: tuple[float, float, float]
    row: int


@dataclass(frozen=True)
class ShapeDeviation:
    """Greatest depth into a body and height over it [mm], where, and how many of its points were checked."""

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


def shape_deviation(stock: StockOfMoves, points: Floats, normals: Floats, low: float) -> ShapeDeviation:
    """Return the greatest deviation of a stock from a finished body at its points.

    Parameters
    ----------
    points, normals : (p, 3) float [mm] of the body's surface, and out of it; no point lies on an edge
    low : height [mm] above which what is left over the body counts
    """
    cut = ~stock.contains(points - BESIDE * normals)
    over = (points[:, 2] >= low) & ~cut
    over[over] = stock.contains(points[over] + BESIDE * normals[over])
    gouge, worst = _greatest(stock, points[cut], -normals[cut], material=True)
    left, _ = _greatest(stock, points[over], normals[over], material=False)
    at = _place(points[cut][worst]) if cut.any() else (0.0, 0.0, 0.0)
    return ShapeDeviation(gouge, at, left, len(points))


def _greatest(stock: StockOfMoves, points: Floats, along: Floats, *, material: bool) -> tuple[float, int]:
    """Greatest distance [mm] of points (p, 3) from where material begins, or ends, and which point it is.

    The distance of a point is the least along the unit vector ``along`` and :data:`FAN` about it. It is found of the
    points whose distance along the vector is greatest, until no other can be greater.
    """
    far = _depth(stock, points, along, np.full(len(points), np.linalg.norm(stock.high - stock.low)), material)
    order, best, which = np.argsort(-far, kind="stable"), 0.0, 0
    for first in range(0, len(order), SOME):
        some = order[first : first + SOME]
        if far[some[0]] <= best:
            break
        across = np.cross(along[some], np.eye(3)[np.abs(along[some]).argmin(axis=1)])
        across /= np.linalg.norm(across, axis=1)[:, None]
        third, least = np.cross(along[some], across), far[some].copy()
        for a, b, c in FAN:
            least = _depth(stock, points[some], a * along[some] + b * across + c * third, least, material)
        k = int(least.argmax())
        if least[k] > best:
            best, which = float(least[k]), int(some[k])
    return best, which


def _depth(stock: StockOfMoves, points: Floats, along: Floats, most: Floats, material: bool) -> Floats:
    """Distance (p,) [mm] along unit vectors at which material begins, or ends; at most ``most`` (p,)."""
    low, high = np.zeros(len(points)), np.minimum(FIRST, most)

    def reached(some: Ints, far: Floats) -> NDArray[np.bool_]:
        return np.asarray(stock.contains(points[some] + far[:, None] * along[some]) == material)

    waiting = np.arange(len(points))
    while len(waiting):
        waiting = waiting[~reached(waiting, high[waiting])]
        low[waiting] = high[waiting]
        high[waiting] = np.minimum(2.0 * high[waiting], most[waiting])
        waiting = waiting[low[waiting] < most[waiting]]
    some = np.flatnonzero(low < high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low[some] + high[some])
        there = reached(some, middle)
        low[some], high[some] = np.where(there, low[some], middle), np.where(there, middle, high[some])
    return high


def mesh_points(mesh: trimesh.Trimesh, count: int = POINTS) -> tuple[Floats, Floats]:
    """Return about ``count`` points (p, 3) [mm] within the faces of a closed mesh, and their normals."""
    side = math.sqrt(4.0 * float(mesh.area) / count)
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, side, max_iter=30)
    corners = np.asarray(vertices)[np.asarray(faces)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1)
    some = size > 0.0
    return corners[some].mean(axis=1), normals[some] / size[some, None]


def _place(p: Floats) -> tuple[float, float, float]:
    return float(p[0]), float(p[1]), float(p[2])
