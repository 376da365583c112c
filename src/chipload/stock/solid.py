"""Prisms over polygons as one closed triangle mesh, and export of a mesh as glTF.

Notation: a polygon between z0 and z1 [mm] becomes a bottom, a top and walls. Its triangles (constrained Delaunay, whose
vertices are those of the polygon) meet in inner edges; an edge of only one triangle is on the boundary and gets a wall.
A **corner** is a triangle at one of its vertices; corners that meet across inner edges are one vertex of the mesh.
Where two rings touch at a point, the corners on either side remain separate, so that every edge of the mesh has two
faces.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from chipload.lazy import scipy, trimesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def prisms(sections: Sequence[Sequence[Polygon]], bounds: Floats) -> trimesh.Trimesh:
    """Return one closed mesh of the prisms over ``sections[i]`` from ``bounds[i]`` to ``bounds[i + 1]`` [mm].

    Faces between two layers stay, so that its volume is the sum of area times thickness.

    Examples
    --------
    >>> mesh = prisms([[shapely.box(0.0, 0.0, 2.0, 1.0)], []], np.array([0.0, 3.0, 4.0]))
    >>> bool(mesh.is_watertight), len(mesh.faces), float(mesh.volume)
    (True, 12, 6.0)
    """
    points: list[Floats] = []
    faces: list[Ints] = []
    count = 0
    for parts, z0, z1 in zip(sections, bounds[:-1], bounds[1:], strict=True):
        for part in parts:
            p, f = _prism(part, float(z0), float(z1))
            points.append(p)
            faces.append(f + count)
            count += len(p)
    if not points:
        return trimesh.Trimesh()
    return trimesh.Trimesh(np.vstack(points), np.vstack(faces), process=False)


def stepped_body(sections: Sequence[shapely.MultiPolygon], bounds: Floats) -> trimesh.Trimesh:
    """Return the faces of the prisms over ``sections[i]`` from ``bounds[i]`` to ``bounds[i + 1]`` [mm], but for those
    that two layers share: walls, and what of a section has nothing above or below it.

    A ray along z enters and leaves the body by them. They do not meet edge to edge.

    Examples
    --------
    >>> step = [shapely.MultiPolygon([shapely.box(0.0, 0.0, x, 1.0)]) for x in (2.0, 2.0, 1.0)]
    >>> body = stepped_body(step, np.array([0.0, 1.0, 2.0, 3.0]))
    >>> flat = np.abs(body.face_normals[:, 2]) > 0.5
    >>> float(body.area_faces[flat].sum()), float(body.volume)
    (4.0, 5.0)
    """
    none = shapely.MultiPolygon()
    triangles: list[Floats] = []
    for below, above, z in zip([none, *sections], [*sections, none], bounds, strict=True):
        if below is above or shapely.equals_exact(below, above):
            continue
        for shape, up in ((shapely.difference(below, above), True), (shapely.difference(above, below), False)):
            polygons = [p for p in shapely.get_parts(shape) if p.geom_type == "Polygon"]
            parts = shapely.get_parts(shapely.constrained_delaunay_triangles(polygons))
            parts = shapely.get_parts(parts)
            xy = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
            (ux, uy), (vx, vy) = (xy[:, 1] - xy[:, 0]).T, (xy[:, 2] - xy[:, 0]).T
            turned = (ux * vy - uy * vx > 0.0) != up
            xy[turned] = xy[turned][:, ::-1]
            triangles.append(np.dstack([xy, np.full((*xy.shape[:2], 1), z)]))
    for shape, z0, z1 in zip(sections, bounds[:-1], bounds[1:], strict=True):
        polygons = shapely.orient_polygons(shapely.get_parts(shape))
        points, ring = shapely.get_coordinates(shapely.get_rings(polygons), return_index=True)
        same = np.flatnonzero(ring[1:] == ring[:-1])
        a, b = points[same], points[same + 1]
        low, high = (np.full((len(a), 1), z) for z in (z0, z1))
        corners = [np.hstack([p, z]) for p, z in ((a, low), (b, low), (b, high), (a, high))]
        triangles += [np.stack([corners[k] for k in three], axis=1) for three in ((0, 1, 2), (0, 2, 3))]
    every = np.vstack(triangles) if triangles else np.zeros((0, 3, 3))
    return trimesh.Trimesh(every.reshape(-1, 3), np.arange(3 * len(every)).reshape(-1, 3), process=False)


def _prism(part: Polygon, z0: float, z1: float) -> tuple[Floats, Ints]:
    """Vertices (n, 3) and faces (m, 3) of the prism over one polygon, counter-clockwise from outside."""
    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(part))
    xy = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
    (ux, uy), (vx, vy) = (xy[:, 1] - xy[:, 0]).T, (xy[:, 2] - xy[:, 0]).T
    if (ux * vy - uy * vx).sum() < 0.0:
        xy = xy[:, ::-1]
    places, number = np.unique(xy.reshape(-1, 2), axis=0, return_inverse=True)
    tri = number.reshape(-1, 3)
    corner = np.arange(tri.size).reshape(-1, 3)
    # directed edges and the corners at their ends; an inner edge occurs once in each direction
    start, end = tri.ravel(), np.roll(tri, -1, axis=1).ravel()
    at, to = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    n = len(places)
    key, back = start * n + end, end * n + start
    order = np.argsort(key)
    found = np.minimum(np.searchsorted(key[order], back), len(key) - 1)
    inner = key[order][found] == back
    twin = order[found]
    joined = scipy.sparse.coo_array(
        (
            np.ones(2 * int(inner.sum()), dtype=np.int8),
            (np.concatenate([at[inner], to[inner]]), np.concatenate([to[twin[inner]], at[twin[inner]]])),
        ),
        shape=(tri.size, tri.size),
    )
    size, group = scipy.sparse.csgraph.connected_components(joined, directed=False)
    flat = np.empty((size, 2))
    flat[group] = places[tri.ravel()]
    base = group[corner]
    a, b = group[at[~inner]], group[to[~inner]]
    vertices = np.vstack([np.column_stack([flat, np.full(size, z)]) for z in (z0, z1)])
    walls = np.vstack([np.column_stack([a, b, b + size]), np.column_stack([a, b + size, a + size])])
    return vertices, np.vstack([base[:, ::-1], base + size, walls]).astype(np.int64)
