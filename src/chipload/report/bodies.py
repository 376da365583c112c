"""The bodies of a scene.glb for the 3D view. A body of very many triangles is drawn with fewer, and the displacement of
its surface is stated; no body is left out.
"""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import trimesh
from chipload.report.gltf import node_names, select_nodes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: triangles of one body that are drawn; halvings of the width of the cells in which vertices are joined
TRIANGLES, HALVINGS = 400_000, 12
#: nodes of a scene that the view draws itself
OWN = ("path", "rapids", "cutter")
#: kinds of bodies by how their names begin
KINDS = ("stock", "part", "fixture", "wall")
#: name of the table of the machine, a fixture too
MACHINE_TABLE = "machine table"
#: a colour in a legend, and characters of its texts at most
COLOUR, LONGEST = re.compile("#[0-9a-f]{6}"), 80
PLAIN = (168, 176, 186, 255)


@dataclass(frozen=True, eq=False)
class SceneBody:
    """A body of a scene.

    Parameters
    ----------
    name : of its node
    kind : one of :data:`KINDS`, or `body`
    vertices, faces : (v, 3) [mm], (f, 3)
    colours : (4,) sRGB of all, or (v, 4)
    triangles : that the scene has of it
    legend : what the colours mean (:func:`chipload.report.scene.legend`); None: nothing
    moved_mm : how far drawing it with fewer triangles moves its vertices at most
    """

    name: str
    kind: str
    vertices: Floats
    faces: Ints
    colours: NDArray[np.uint8]
    triangles: int
    moved_mm: float = 0.0
    legend: Mapping[str, Any] | None = None

    @property
    def low(self) -> Floats:
        """Lower corner [mm]."""
        return np.asarray(self.vertices.min(axis=0))

    @property
    def high(self) -> Floats:
        """Upper corner [mm]."""
        return np.asarray(self.vertices.max(axis=0))


def scene_bodies(glb: bytes, most: int = TRIANGLES, without: Collection[str] = ()) -> tuple[SceneBody, ...]:
    """The bodies of a scene.glb besides path and cutter, none with more than ``most`` triangles.

    Parameters
    ----------
    without : kinds of bodies that are not read

    Raises
    ------
    Exception
        Of any kind: the file cannot be read.
    """
    names = node_names(glb)
    wanted = [name for name in names if not _drawn_by_view(name) and _kind(name) not in without]
    if not wanted:
        return ()
    # only what is read takes memory: the path of a long program is most of its scene
    glb = glb if len(wanted) == len(names) else select_nodes(glb, frozenset(wanted))
    scene = trimesh.load(io.BytesIO(glb), file_type="glb", force="scene")
    out = []
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces) and not _drawn_by_view(str(node)):
            out.append(_body(str(node), mesh.copy().apply_transform(transform), most))
    return tuple(out)


def bodies_note(bodies: tuple[SceneBody, ...]) -> str:
    """A sentence for each body that is drawn with fewer triangles; empty: none is."""
    return " ".join(
        f"{b.name} has {b.triangles} triangles: drawn with {len(b.faces)}, within {b.moved_mm:.2g} mm."
        for b in bodies
        if len(b.faces) != b.triangles
    )


def fewer_triangles(
    vertices: Floats, faces: Ints, colours: NDArray[np.uint8], most: int
) -> tuple[Floats, Ints, NDArray[np.uint8], float]:
    """At most ``most`` triangles of a mesh: vertices in one cell of a grid become their mean; the last value is how far
    a vertex moves at most [mm].
    """
    low, size = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    wide, narrow, best = size, 0.0, None
    for _ in range(HALVINGS):
        cell = 0.5 * (wide + narrow)
        key = np.floor((vertices - low) / max(cell, 1e-9)).astype(np.int64)
        _, number = np.unique(_row_numbers(key), return_inverse=True)
        joined = number.ravel()[faces]
        solid = (joined[:, 0] != joined[:, 1]) & (joined[:, 1] != joined[:, 2]) & (joined[:, 2] != joined[:, 0])
        # two triangles of the same corners cover each other
        kept = np.unique(_row_numbers(np.sort(joined[solid], axis=1)), return_index=True)[1]
        if len(kept) <= most:
            wide, best = cell, (number.ravel(), joined[solid][np.sort(kept)])
        else:
            narrow = cell
    if best is None:
        return vertices, faces, colours, 0.0
    number, index = best
    count = np.bincount(number).astype(np.float64)
    mean = np.stack([np.bincount(number, vertices[:, i]) / count for i in range(3)], axis=1)
    first = np.unique(number, return_index=True)[1]
    moved = float(np.linalg.norm(mean[number] - vertices, axis=1).max())
    return mean, index, colours if colours.ndim == 1 else colours[first], moved


def _row_numbers(rows: Ints) -> Ints:
    """(n,) numbers that are equal and in order where rows (n, 3) of numbers from 0 on are.

    >>> _row_numbers(np.array([[0, 0, 2], [0, 1, 0], [0, 0, 2]])).argsort(kind="stable").tolist()
    [0, 2, 1]
    """
    if len(rows) and int(rows.max()) >= 1 << 21:
        return np.asarray(np.unique(rows, axis=0, return_inverse=True)[1], dtype=np.int64).ravel()
    return np.asarray((rows[:, 0] << 42) | (rows[:, 1] << 21) | rows[:, 2])


def _body(name: str, mesh: trimesh.Trimesh, most: int) -> SceneBody:
    visual = mesh.visual
    colours = np.asarray(visual.to_color().vertex_colors if visual.kind == "texture" else visual.vertex_colors)
    each = colours.reshape(-1, 4).astype(np.uint8)
    if len(each) != len(mesh.vertices):
        each = np.tile(np.array([PLAIN], dtype=np.uint8), (len(mesh.vertices), 1))
    vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    painted, triangles, moved = (each[0] if (each == each[0]).all() else each), len(faces), 0.0
    if triangles > most:
        vertices, faces, painted, moved = fewer_triangles(vertices, faces, painted, most)
    return SceneBody(name, _kind(name), vertices, faces, painted, triangles, moved, _legend(mesh.metadata))


def _legend(metadata: Mapping[str, Any]) -> dict[str, Any] | None:
    """The legend of a mesh, where the file has a sound one."""
    found: Any = metadata.get("legend")
    try:
        title = str(found["title"])[:LONGEST]
        values, texts = [float(v) for v, _ in found["stops"]], [str(w)[:LONGEST] for w, _ in found["words"]]
        colours = [str(c) for _, c in (*found["stops"], *found["words"])]
    except (TypeError, KeyError, ValueError):
        return None
    if not (np.isfinite(values).all() and all(map(COLOUR.fullmatch, colours))):
        return None
    stops = [list(pair) for pair in zip(values, colours, strict=False)]
    words = [list(pair) for pair in zip(texts, colours[len(values) :], strict=True)]
    return {"title": title, "stops": stops, "words": words}


def _plain(name: str) -> str:
    """A node's name without the number of its operation."""
    head, _, tail = name.partition("-")
    return tail if head.isdigit() and tail else name


def _kind(name: str) -> str:
    """The kind of the body of a node.

    >>> _kind("0-stock"), _kind("hub")
    ('stock', 'body')
    """
    plain = _plain(name)
    return "fixture" if plain == MACHINE_TABLE else next((k for k in KINDS if plain.startswith(k)), "body")


def _drawn_by_view(name: str) -> bool:
    """Return whether the view draws a node itself.

    >>> [_drawn_by_view(n) for n in ("0-path-plain", "rapids", "0-wall", "stock", "1-cutter")]
    [True, True, False, False, True]
    """
    return _plain(name).startswith(OWN)
