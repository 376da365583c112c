"""Closed triangle meshes: reading from STL and STEP, checks, and sections by horizontal planes.

Notation: a **ring** is a closed chain of points in a plane z = h with the solid on its left: counter-clockwise around
solid, clockwise around a hole. A vertex on the plane counts as above it, so that a plane never contains a vertex. Each
face that the plane cuts has one edge that goes down through it, where the chain enters the face, and one that goes up,
where the chain leaves. The rings follow from the topology alone, so they close in spite of rounding.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from chipload.errors import InputError
from chipload.files import is_file
from chipload.geometry.step import step_triangles
from chipload.geometry.stl import read_stl
from chipload.lazy import scipy, trimesh
from chipload.units import MM_PER

#: greatest absolute value of a coordinate [mm]
FARTHEST = 1e6

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def read_mesh(
    path: str | Path, *, unit: str | None = None, chord_mm: float | None = None, key: str = "stock.file"
) -> trimesh.Trimesh:
    """A closed mesh in mm from an STL file or a STEP part.

    Parameters
    ----------
    path : .stl, .stp or .step
    unit : unit of length of an STL file: um, mm, cm, m, inch or foot. STL files do not state it, and it is not guessed;
        STEP files state it
    chord_mm : greatest deviation [mm] of a triangle from the surface of a STEP part
    key : job key that names the file, for messages

    Raises
    ------
    InputError
        The file is missing, of another type or damaged, the unit or ``chord_mm`` is not stated, or the mesh is not
        closed.
    """
    file = Path(path)
    if not is_file(file):
        raise InputError(f"{key} = {file}: no such file")
    kind = file.suffix.lower()
    if kind in (".stp", ".step"):
        if chord_mm is None or not chord_mm > 0.0:
            raise InputError(
                f"{key} = {file.name}: state chord_mm above 0, the greatest deviation of a triangle from a surface"
            )
        vertices, faces = step_triangles(file, chord_mm, key=key)
    elif kind == ".stl":
        if unit not in MM_PER:
            raise InputError(f"{key} = {file.name}: STL has no unit: state unit as one of {', '.join(MM_PER)}")
        corners = read_stl(file, key) * MM_PER[unit]
        vertices, faces = corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int64).reshape(-1, 3)
    else:
        raise InputError(f"{key} = {file.name}: must be .stl, .stp or .step")
    greatest = float(np.abs(vertices).max(initial=0.0))
    if not greatest <= FARTHEST:
        raise InputError(
            f"{key} = {file.name}: a vertex is {greatest:.4g} mm from the origin: must be at most {FARTHEST:g} mm: "
            "check the unit, or export it again"
        )
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    require_closed(mesh, f"{key} = {file.name}")
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


def open_edges(mesh: trimesh.Trimesh) -> int:
    """Number of edges that the faces do not traverse equally often in both directions; four faces may share an edge."""
    edges = np.asarray(mesh.edges)
    along = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    return int(np.count_nonzero(np.bincount(which.ravel(), weights=along)))


def require_closed(mesh: trimesh.Trimesh, name: str) -> None:
    """Refuse a mesh that does not enclose a volume.

    Raises
    ------
    InputError
        The mesh has open edges; the message states how many.
    """
    count = open_edges(mesh)
    if count:
        raise InputError(f"{name}: the mesh is not closed: {count} open edges: repair it in CAD and export it again")


def sections(mesh: trimesh.Trimesh, heights: Sequence[float] | Floats) -> list[MultiPolygon]:
    """Sections of a closed mesh by the planes z = ``heights`` [mm]; for faces in a plane, the section just below it.

    Overlapping bodies are joined; a ring that crosses itself is resolved by the even-odd rule.

    Examples
    --------
    >>> box = trimesh.creation.box((4.0, 3.0, 2.0))
    >>> [section.area for section in sections(box, [0.5, 1.0, 1.5])]
    [12.0, 12.0, 0.0]
    """
    vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    body = _bodies(vertices, faces)
    return [_area_of_bodies(*_rings(vertices, faces, body, float(h))) for h in heights]


def _bodies(vertices: Floats, faces: Ints) -> Ints:
    """(f,) number of the body of each face; -1: of a shell around a cavity, whose volume is below 0."""
    edges = np.vstack([faces[:, :2], faces[:, 1:]])
    graph = scipy.sparse.coo_array((np.ones(len(edges)), edges.T), shape=(len(vertices), len(vertices)))
    shell = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][faces[:, 0]]
    a, b, c = (vertices[faces[:, i]] - vertices.mean(axis=0) for i in range(3))
    volume = np.bincount(shell, (a * np.cross(b, c)).sum(axis=1))
    return np.where(volume[shell] < 0.0, -1, shell)


def _rings(vertices: Floats, faces: Ints, body: Ints, h: float) -> tuple[list[Floats], list[int]]:
    """(k, 2) points of each ring in the plane z = h, and its body."""
    rings, of = list[Floats](), list[int]()
    z = vertices[:, 2]
    for first, last, own in _trace_rings(faces, z, h):
        a, b = vertices[first], vertices[last]
        part = ((h - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None]
        rings.append(a[:, :2] * (1.0 - part) + b[:, :2] * part)
        of.append(int(body[own]))
    return rings, of


def level_rings(faces: Ints, values: Floats, level: float) -> list[tuple[Ints, Ints]]:
    """The rings on which values (n,) at the vertices of a closed mesh have a level.

    Each is both vertices (k,) of the edges that it crosses, in its order.
    """
    return [(first, last) for first, last, _ in _trace_rings(faces, values, level)]


def _trace_rings(faces: Ints, values: Floats, level: float) -> Iterator[tuple[Ints, Ints, int]]:
    """Vertices (k,), (k,) of the edges of each ring, and one of its faces."""
    above = (values >= level)[faces]
    cut = above.any(axis=1) & ~above.all(axis=1)
    f, up = faces[cut], above[cut]
    rows = np.arange(len(f))
    after, up_after = np.roll(f, -1, axis=1), np.roll(up, -1, axis=1)
    enter, leave = np.argmax(up & ~up_after, axis=1), np.argmax(~up & up_after, axis=1)
    first = np.sort(np.column_stack([f[rows, enter], after[rows, enter]]), axis=1)
    last = np.sort(np.column_stack([f[rows, leave], after[rows, leave]]), axis=1)
    # a chain enters the next face by the edge by which it left the last one; four faces at an edge form any two pairs
    onward_of: Ints = np.empty(len(f), dtype=np.int64)
    onward_of[np.lexsort(last.T)] = np.lexsort(first.T)
    numbers = np.flatnonzero(cut)
    onward = onward_of.tolist()
    done = [False] * len(onward)
    for start in range(len(onward)):
        ring: list[int] = []
        at = start
        while not done[at]:
            done[at] = True
            ring.append(at)
            at = onward[at]
        if len(ring) > 2:
            yield first[ring, 0], first[ring, 1], int(numbers[start])


def _area_of_bodies(rings: list[Floats], of: list[int]) -> MultiPolygon:
    """The area that rings of some bodies enclose: that of each body, joined."""
    bodies = sorted({n for n in of if n >= 0})
    if len(bodies) < 2:
        return _area_of_rings(rings)
    each = {n: [r for r, k in zip(rings, of, strict=True) if k == n] for n in bodies}
    for ring in (r for r, k in zip(rings, of, strict=True) if k < 0):
        # the cavity of the least body around it
        around = [n for n in bodies if shapely.contains_xy(_area_of_rings(each[n]), *ring[0])]
        if around:
            each[min(around, key=lambda n: _area_of_rings(each[n]).area)].append(ring)
    return _polygons(shapely.union_all([_area_of_rings(each[n]) for n in bodies]))


def _area_of_rings(rings: list[Floats]) -> MultiPolygon:
    """The area that rings enclose: from the largest to the smallest, solids are added and holes are subtracted."""
    areas = [0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) for x, y in (r.T for r in rings)]
    order = sorted((i for i, area in enumerate(areas) if area != 0.0), key=lambda i: -abs(areas[i]))
    whole = Polygon()
    for solid, group in itertools.groupby(order, key=lambda i: areas[i] > 0.0):
        joined = shapely.union_all([shapely.make_valid(Polygon(rings[i])) for i in group])
        whole = shapely.union(whole, joined) if solid else shapely.difference(whole, joined)
    return _polygons(whole)


def _polygons(shape: shapely.Geometry) -> MultiPolygon:
    """The polygons of a geometry that have an area."""
    parts = shapely.get_parts(shape)
    return MultiPolygon(list(parts[(shapely.get_type_id(parts) == 3) & (shapely.area(parts) > 0.0)]))
