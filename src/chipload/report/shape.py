"""Drawn contours as triangles, and the pieces in which a path is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.geometry.contour import Contour, Region

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: how far drawn chords may leave an arc [mm]
CHORD_MM = 0.005
#: rows farther apart than this many usual steps are not joined by a line
JUMP = 8.0


def stretches(history: Mapping[str, NDArray[Any]]) -> Ints:
    """(n,) number of the piece of path that each row belongs to: a new one where the rows jump or the pass changes."""
    p = np.column_stack([np.asarray(history[c], dtype=np.float64) for c in ("x_mm", "y_mm", "z_mm")])
    step = np.linalg.norm(np.diff(p, axis=0), axis=1)
    names = np.asarray(history["pass"]).astype(str)
    typical = float(np.median(step[step > 0.0])) if (step > 0.0).any() else 0.0
    apart = (step > JUMP * typical) | (names[1:] != names[:-1])
    return np.concatenate([[0], np.cumsum(apart)]).astype(np.int64)


def ribbon(contour: Contour, low: float, high: float) -> tuple[Floats, Ints]:
    """Vertices (2 m, 3) [mm] and triangles (2 (m - 1), 3) of the vertical strip over a contour."""
    p = contour.flatten(CHORD_MM)
    m = len(p)
    vertices = np.vstack([np.column_stack([p, np.full(m, z)]) for z in (low, high)])
    a = np.arange(m - 1)
    return vertices, np.vstack([np.column_stack([a, a + 1, a + 1 + m]), np.column_stack([a, a + 1 + m, a + m])])


def cap(contours: Sequence[Contour], z: float) -> tuple[Floats, Ints]:
    """Vertices and triangles of the region between closed contours at the height z [mm], seen from above."""
    flat = shapely.make_valid(Region.of(contours).flatten(CHORD_MM))
    return _triangles(flat, z)


def slab(contours: Sequence[Contour], low: float, high: float) -> tuple[Floats, Ints]:
    """The closed prism over the region between closed contours."""
    bottom, faces = cap(contours, low)
    top, _ = cap(contours, high)
    parts = [(bottom, faces[:, ::-1]), (top, faces)]
    parts += [ribbon(c, low, high) for c in Region.of(contours).contours]
    return merge_meshes(parts)


def merge_meshes(parts: Sequence[tuple[Floats, Ints]]) -> tuple[Floats, Ints]:
    """One mesh from several."""
    if not parts:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    start = np.cumsum([0] + [len(v) for v, _ in parts[:-1]])
    return np.vstack([v for v, _ in parts]), np.vstack([f + k for (_, f), k in zip(parts, start, strict=True)])


def _triangles(flat: object, z: float) -> tuple[Floats, Ints]:
    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(flat))
    if len(parts) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    ring = np.array([shapely.get_coordinates(t)[:3] for t in parts])
    (ux, uy), (vx, vy) = (ring[:, 1] - ring[:, 0]).T, (ring[:, 2] - ring[:, 0]).T
    turn = ux * vy - uy * vx
    ring[turn < 0.0] = ring[turn < 0.0][:, ::-1]
    points, index = np.unique(ring.reshape(-1, 2), axis=0, return_inverse=True)
    return np.column_stack([points, np.full(len(points), z)]), index.reshape(-1, 3).astype(np.int64)
