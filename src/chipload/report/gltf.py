"""A scene of lines and meshes as a binary glTF file; lengths in mm, z up.

The arrays of a body are converted to those of the file (float32, uint32, uint8) when it is added, and it may then go.
So a scene takes little more memory than its file. Content and order are those that trimesh writes.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FLOAT, BYTE, INDEX = 5126, 5121, 5125
LINES, TRIANGLES = 1, 4
#: first bytes of a file, and of its two chunks
MAGIC, JSON, BIN = 0x46546C67, 0x4E4F534A, 0x004E4942


class GltfScene:
    """Bodies of a scene in the order in which they are added.

    >>> scene = GltfScene()
    >>> scene.add_lines("path", np.eye(3), [(1, 3)], (34, 120, 132, 255))
    >>> [mesh["name"] for mesh in scene.tree["meshes"]], scene.to_bytes()[:4]
    (['path'], b'glTF')
    """

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {
            "scene": 0,
            "scenes": [{}],
            "asset": {"version": "2.0", "generator": "chipload"},
            "accessors": [],
            "meshes": [],
        }
        self._data: list[memoryview] = []

    def add_lines(
        self, name: str, points: Floats, runs: Sequence[tuple[int, int]], colour: tuple[int, int, int, int]
    ) -> None:
        """Add lines in one colour.

        Parameters
        ----------
        points : (n, 3) float [mm]
        runs : (first, past the last) of the points of each line; it begins at the point before its first
        """
        count = sum(b - a for a, b in runs)
        if not count:
            return
        pairs, at = np.empty((count, 2, 3), dtype="<f4"), 0
        for a, b in runs:
            pairs[at : at + b - a, 0], pairs[at : at + b - a, 1] = points[a - 1 : b - 1], points[a:b]
            at += b - a
        self.tree.setdefault(
            "materials",
            [{"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "roughnessFactor": 0}}],
        )
        attributes = {"POSITION": self._points(pairs.reshape(-1, 3)), "COLOR_0": self._colours(colour, 2 * count)}
        primitive = {"attributes": attributes, "mode": LINES, "material": 0}
        self.tree["meshes"].append({"name": name, "primitives": [primitive], "extras": {}})

    def add_mesh(
        self,
        name: str,
        vertices: Floats,
        faces: NDArray[np.int64],
        colour: Sequence[int] | NDArray[np.uint8],
        extras: Mapping[str, Any] | None = None,
    ) -> None:
        """Add a mesh: ``vertices`` (v, 3) float [mm], ``faces`` (f, 3), ``colour`` (4,) of all or (v, 4)."""
        self.add_mesh_of_parts(name, [(vertices, faces)], colour, extras)

    def add_mesh_of_parts(
        self,
        name: str,
        parts: Iterable[tuple[Floats, NDArray[np.int64]]],
        colour: Sequence[int] | NDArray[np.uint8],
        extras: Mapping[str, Any] | None = None,
    ) -> None:
        """Add meshes as one; each is converted before the next is made."""
        points, triangles, count = list[NDArray[np.float32]](), list[NDArray[np.uint32]](), 0
        for vertices, faces in parts:
            points.append(np.asarray(vertices).astype("<f4"))
            triangles.append((np.asarray(faces) + count).astype("<u4"))
            count += len(vertices)
        if not sum(map(len, triangles)):
            return
        index = np.concatenate(triangles)
        triangles.clear()
        at = self._accessor(INDEX, "SCALAR", index, [int(index.max())], [int(index.min())])
        attributes = {"POSITION": self._points(np.concatenate(points)), "COLOR_0": self._colours(colour, count)}
        primitive = {"attributes": attributes, "indices": at, "mode": TRIANGLES}
        self.tree["meshes"].append({"name": name, "extras": dict(extras or {}), "primitives": [primitive]})

    def to_bytes(self) -> bytes:
        """Return the file."""
        views, at = [], 0
        for data in self._data:
            views.append({"buffer": 0, "byteOffset": at, "byteLength": len(data)})
            at += len(data)
        names = [mesh["name"] for mesh in self.tree["meshes"]]
        tree: dict[str, Any] = {**self.tree, "nodes": [{"name": name, "mesh": k} for k, name in enumerate(names)]}
        if names:
            tree |= {
                "scenes": [{"nodes": list(range(len(names)))}],
                "buffers": [{"byteLength": at}],
                "bufferViews": views,
            }
        return b"".join([*_head(tree, at), *self._data])

    def _points(self, points: NDArray[np.float32]) -> int:
        return self._accessor(FLOAT, "VEC3", points, points.max(axis=0).tolist(), points.min(axis=0).tolist())

    def _colours(self, colour: Sequence[int] | NDArray[np.uint8], count: int) -> int:
        colours = np.ascontiguousarray(np.broadcast_to(np.asarray(colour, dtype=np.uint8), (count, 4)))
        return self._accessor(BYTE, "VEC4", colours, colours.max(axis=0).tolist(), colours.min(axis=0).tolist())

    def _accessor(self, kind: int, shape: str, data: NDArray[Any], most: list[Any], least: list[Any]) -> int:
        """Add an array of 4-byte rows or entries; its number."""
        self._data.append(data.data.cast("B"))
        self.tree["accessors"].append(
            {
                "componentType": kind,
                **({"normalized": True} if kind == BYTE else {}),
                "type": shape,
                **({} if kind == INDEX else {"byteOffset": 0}),
                "bufferView": len(self._data) - 1,
                "count": data.size if shape == "SCALAR" else len(data),
                "max": most,
                "min": least,
            }
        )
        return len(self._data) - 1


def _head(tree: Mapping[str, Any], size: int) -> list[bytes]:
    """All of a file before ``size`` bytes of arrays."""
    text = json.dumps(tree, separators=(",", ":"))
    content = (text + (4 - (len(text) + 20) % 4) * " ").encode()
    head = struct.pack("<5I", MAGIC, 2, len(content) + size + 28, len(content), JSON)
    return [head, content, struct.pack("<2I", size, BIN)]


def select_nodes(glb: bytes, wanted: frozenset[str]) -> bytes:
    """A file of glTF with the bodies of some nodes alone: what the others draw is left out of its tree."""
    size = struct.unpack_from("<I", glb, 12)[0]
    tree = json.loads(glb[20 : 20 + size])
    for node in tree.get("nodes", ()):
        if node.get("name") not in wanted:
            node.pop("mesh", None)
    kept = {node["mesh"] for node in tree.get("nodes", ()) if "mesh" in node}
    for k, mesh in enumerate(tree.get("meshes", ())):
        if k not in kept:
            mesh["primitives"] = []
    arrays = memoryview(glb)[28 + size :]
    return b"".join([*_head(tree, len(arrays)), arrays])


def node_names(glb: bytes) -> list[str]:
    """The names of the nodes of a file that draw something."""
    size = struct.unpack_from("<I", glb, 12)[0]
    return [str(n.get("name", "")) for n in json.loads(glb[20 : 20 + size]).get("nodes", ()) if "mesh" in n]
