"""Triangles and lines with colours as a GLB file that three.js shows as they are meant.

Notation: a **shape** has vertices (v, 3) [mm], triangles (f, 3) or lines (f, 2), and one colour for all or one for each
vertex, sRGB 0..255 with its opacity. The file holds linear colours, as glTF asks; nothing in it shines like metal.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FLOAT, UINT, USHORT = 5126, 5125, 5123
ARRAY, ELEMENT = 34962, 34963
LINES, TRIANGLES = 1, 4


@dataclass(frozen=True, eq=False)
class Shape:
    """What is drawn as one: see the module; ``lit`` shapes are shaded by the light, others show their very colour."""

    vertices: Floats
    faces: NDArray[np.int64]
    colours: NDArray[np.uint8]
    lit: bool = True


def glb_bytes(shapes: Sequence[Shape]) -> bytes:
    """The file."""
    blob = bytearray()
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    materials: list[dict[str, Any]] = []

    def put(data: NDArray[Any], target: int, kind: str, component: int, **more: Any) -> int:
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": data.nbytes, "target": target})
        blob.extend(data.tobytes())
        blob.extend(b"\0" * (-len(blob) % 4))
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": component,
                "count": len(data) if kind != "SCALAR" else data.size,
                "type": kind,
                **more,
            }
        )
        return len(accessors) - 1

    for k, shape in enumerate(shapes):
        p = shape.vertices.astype("<f4")
        bounds = {"min": p.min(axis=0).tolist(), "max": p.max(axis=0).tolist()}
        attributes = {"POSITION": put(p, ARRAY, "VEC3", FLOAT, **bounds)}
        each = shape.colours.ndim == 2
        linear = linear_colours(shape.colours)
        if each:
            packed = np.round(linear * 65535.0).astype("<u2")
            attributes["COLOR_0"] = put(packed, ARRAY, "VEC4", USHORT, normalized=True)
        index = put(shape.faces.astype("<u4"), ELEMENT, "SCALAR", UINT)
        base = [1.0, 1.0, 1.0, 1.0] if each else linear.tolist()
        opaque = bool((shape.colours[..., 3] == 255).all())
        materials.append(
            {
                "pbrMetallicRoughness": {"baseColorFactor": base, "metallicFactor": 0.0, "roughnessFactor": 1.0},
                "doubleSided": True,
                "alphaMode": "OPAQUE" if opaque else "BLEND",
                **({} if shape.lit else {"extensions": {"KHR_materials_unlit": {}}}),
            }
        )
        mode = TRIANGLES if shape.faces.shape[1] == 3 else LINES
        meshes.append(
            {"primitives": [{"attributes": attributes, "indices": index, "mode": mode, "material": k}]},
        )
    tree = {
        "asset": {"version": "2.0", "extras": {"units": "mm", "up": "Z"}},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": list(range(len(shapes)))}],
        "nodes": [{"mesh": k} for k in range(len(shapes))],
        "meshes": meshes,
        "materials": materials,
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + bytes(blob)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def linear_colours(colours: NDArray[np.uint8]) -> Floats:
    """(..., 4) linear 0..1 of sRGB 0..255, the opacity as it is.

    >>> linear_colours(np.array([0, 255, 188, 51], dtype=np.uint8)).round(3).tolist()
    [0.0, 1.0, 0.503, 0.2]
    """
    share = colours.astype(np.float64) / 255.0
    out = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    out[..., 3] = share[..., 3]
    return out
