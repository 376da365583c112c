"""Pieces of the stock that stated clamps and fixtures hold.

Notation: a piece is what neighbouring columns of the height map leave joined after the program. A clamp holds it in
its directions where material of the piece remains in the region of the clamp. A fixture touches it where a face of the
fixture lies on a face of the piece, within the distance of two columns beside it and :data:`GAP` on its top.

A piece is held by clamps that together hold it along x, y and z; by a fixture on its top, a strap, which presses it
onto what is below; or by fixtures on two opposite sides, the jaws of a vise. A fixture below it, a table or parallels,
supports it but does not hold it, nor does one on a single side.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.lazy import trimesh
from chipload.simulation.heights.height_map import HeightMap
from chipload.structure.cells.clamp import Clamp

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

#: a fixture touches a top that is within this of it [mm]: the default deviation of the facets of a fixture
GAP = 0.1
#: cosine of the greatest angle between a face and the axis along which it presses: 45 deg
FACING = math.sqrt(0.5)
#: distance of the places on a face that are compared, in distances of the columns, and most of them along a side
SIDE, MOST = 2.0, 1000


def find_clamped_stock(
    found: HeightMap, label: Ints, clamps: Sequence[Clamp] = (), fixtures: Iterable[trimesh.Trimesh] = ()
) -> frozenset[int]:
    """Return the numbers of the pieces that clamps or fixtures hold.

    Parameters
    ----------
    label : (nx, ny) number of the piece of each column, 0 where no material is left
    clamps : on the stock before the program
    fixtures : closed bodies [mm]
    """
    clamped = _clamped_bodies(found, label, clamps)
    side = np.zeros((0, 2))
    number = np.zeros(0, dtype=np.int64)
    for mesh in fixtures:
        middles, normals = _faces(found, mesh)
        clamped |= set(_pressed_bodies(found, label, middles[normals[:, 2] < -FACING]).tolist())
        beside = np.abs(normals[:, 2]) < FACING
        at = _touched_bodies(found, label, middles[beside], normals[beside])
        side = np.concatenate([side, normals[beside][at > 0, :2]])
        number = np.concatenate([number, at[at > 0]])
    clamped |= {k for k in np.unique(number).tolist() if _opposite(side[number == k])}
    return frozenset(clamped)


def _clamped_bodies(found: HeightMap, label: Ints, clamps: Sequence[Clamp]) -> set[int]:
    """Pieces that clamps together hold along x, y and z."""
    x, y = (a.ravel() for a in np.meshgrid(found.x, found.y, indexing="ij"))
    half = 0.5 * max(found.x[1] - found.x[0], found.y[1] - found.y[0]) + 1e-6
    axes: dict[int, NDArray[np.bool_]] = {}
    for clamp in clamps:
        region = clamp.region
        # the slab of a face is thinner than a column is wide
        inside = shapely.contains_xy(region.outline.buffer(half), x, y).reshape(label.shape)
        inside &= (found.top >= region.low) & (found.low <= region.high)
        for k in np.unique(label[inside & (label > 0)]).tolist():
            axes[k] = axes.get(k, np.zeros(3, dtype=np.bool_)) | clamp.directions
    return {k for k, fixed in axes.items() if fixed.all()}


def _faces(found: HeightMap, mesh: trimesh.Trimesh) -> tuple[Floats, Floats]:
    """Places on the faces of a body near the stock, and their outward normals."""
    there = np.isfinite(found.low)
    low = np.array([found.x[0], found.y[0], found.low[there].min()])
    high = np.array([found.x[-1], found.y[-1], found.before[there].max()])
    hx, hy = found.x[1] - found.x[0], found.y[1] - found.y[0]
    room = 2.0 * max(hx, hy) + GAP
    triangles = np.asarray(mesh.triangles, dtype=np.float64)
    near = (triangles.min(axis=1) <= high + room).all(axis=1) & (triangles.max(axis=1) >= low - room).all(axis=1)
    normals = np.asarray(mesh.face_normals, dtype=np.float64)[near]
    out, of = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for corners, normal in zip(triangles[near], normals, strict=True):
        a, b, c = corners
        u, v = b - a, c - a
        n = [min(max(1, math.ceil(float(np.linalg.norm(w)) / (SIDE * max(hx, hy)))), MOST) for w in (u, v)]
        s, t = ((np.arange(k) + 0.5) / k for k in n)
        s, t = (w.ravel() for w in np.meshgrid(s, t, indexing="ij"))
        over = s + t > 1.0
        s, t = np.where(over, 1.0 - s, s), np.where(over, 1.0 - t, t)
        p = a + s[:, None] * u + t[:, None] * v
        p = p[((p >= low - room) & (p <= high + room)).all(axis=1)]
        out.append(p)
        of.append(np.broadcast_to(normal, p.shape))
    return np.concatenate(out), np.concatenate(of)


def _columns_at(found: HeightMap, points: Floats) -> tuple[Ints, Ints, NDArray[np.bool_]]:
    """Column of each point, and whether there is one."""
    hx, hy = found.x[1] - found.x[0], found.y[1] - found.y[0]
    i = np.floor((points[:, 0] - found.x[0]) / hx + 0.5).astype(np.int64)
    j = np.floor((points[:, 1] - found.y[0]) / hy + 0.5).astype(np.int64)
    there = (i >= 0) & (i < len(found.x)) & (j >= 0) & (j < len(found.y))
    return np.clip(i, 0, len(found.x) - 1), np.clip(j, 0, len(found.y) - 1), there


def _pressed_bodies(found: HeightMap, label: Ints, points: Floats) -> Ints:
    """Pieces whose tops lie at points of faces that look down."""
    i, j, there = _columns_at(found, points)
    there &= np.abs(found.top[i, j] - points[:, 2]) <= GAP
    return np.unique(label[i, j][there & (label[i, j] > 0)])


def _touched_bodies(found: HeightMap, label: Ints, points: Floats, normals: Floats) -> Ints:
    """Piece that each point of a side touches, 0 if none."""
    level = normals[:, :2] / np.hypot(normals[:, 0], normals[:, 1])[:, None]
    step = max(found.x[1] - found.x[0], found.y[1] - found.y[0])
    i, j, there = _columns_at(found, points[:, :2] + step * level)
    there &= (found.low[i, j] <= points[:, 2]) & (points[:, 2] <= found.top[i, j])
    return np.where(there, label[i, j], 0)


def _opposite(normals: Floats) -> bool:
    """Whether two of the directions look at each other, within 45 deg."""
    some = np.unique(np.round(np.degrees(np.arctan2(normals[:, 1], normals[:, 0])))) % 360.0
    apart = np.abs((some[:, None] - some[None, :]) % 360.0 - 180.0)
    return bool((apart <= 45.0).any())
