"""scene.glb: wall, stock, cutter and the paths coloured by engagement. Lengths are mm, Z is up, as the extras say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from chipload.report.outcome import Operation, Outcome
from chipload.report.shape import merged, pieces, ribbon, slab

Floats = NDArray[np.float64]

#: shades of engagement on a path
SHADES = 24
WALL, STOCK, TOOL = (86, 96, 112, 255), (214, 170, 110, 110), (178, 186, 196, 255)
#: rows of a history that the scene shows at most
ROWS = 40_000


def engagement_colours(engagement: Floats, highest: float) -> NDArray[np.uint8]:
    """(n, 4) colours from dark (none) to bright (``highest``), in :data:`SHADES` steps.

    >>> engagement_colours(np.array([0.0, 90.0]), 90.0)[:, 0].tolist() == [
    ...     engagement_colours(np.array([0.0]), 90.0)[0, 0], engagement_colours(np.array([90.0]), 90.0)[0, 0]]
    True
    """
    stops = np.array([[48, 36, 92], [53, 96, 141], [34, 168, 132], [155, 217, 60], [251, 182, 26]], dtype=np.float64)
    share = np.clip(np.asarray(engagement) / highest, 0.0, 1.0) if highest > 0.0 else np.zeros(len(engagement))
    share = np.round(share * (SHADES - 1)) / (SHADES - 1)
    rgb = [np.interp(share, np.linspace(0.0, 1.0, len(stops)), stops[:, k]) for k in range(3)]
    return np.column_stack([*rgb, np.full(len(share), 255.0)]).round().astype(np.uint8)


def scene_bytes(outcome: Outcome) -> bytes:
    """scene.glb."""
    scene = trimesh.Scene()
    for k, op in enumerate(outcome.operations):
        _add(scene, f"{k}-", op)
    glb: bytes = scene.export(file_type="glb", extension_webp=False, tree_postprocessor=_say_units)
    return glb


def _say_units(tree: dict[str, Any]) -> None:
    tree["asset"]["extras"] = {"units": "mm", "up": "Z"}


def _add(scene: Any, prefix: str, op: Operation) -> None:
    low, high = op.top - op.depth, op.top
    used = op.result.strategies[op.result.use]
    for name, colour in (("wall", WALL), ("stock", STOCK)):
        contours = used.drawn.get(name, ())
        closed = [c for c in contours if c.closed]
        solid = [slab(closed, low, high)] if name == "stock" and closed else [ribbon(c, low, high) for c in closed]
        vertices, faces = merged(solid + [ribbon(c, low, high) for c in contours if not c.closed])
        if len(faces):
            mesh = trimesh.Trimesh(vertices, faces, process=False)
            mesh.visual.face_colors = np.tile(np.array(colour, dtype=np.uint8), (len(faces), 1))
            scene.add_geometry(mesh, node_name=prefix + name, geom_name=prefix + name)
    highest = max(float(s.history["engagement_deg"].max()) for s in op.result.strategies.values())
    for name, strategy in op.result.strategies.items():
        path = _path(strategy.history, highest)
        scene.add_geometry(path, node_name=f"{prefix}path-{name}", geom_name=f"{prefix}path-{name}")
    c, at = op.cutter, used.history
    tool = trimesh.creation.cylinder(radius=c.radius, height=c.overhang, sections=48)
    tool.apply_translation([at["x_mm"][-1], at["y_mm"][-1], at["z_mm"][-1] + 0.5 * c.overhang])
    tool.visual.face_colors = np.tile(np.array(TOOL, dtype=np.uint8), (len(tool.faces), 1))
    scene.add_geometry(tool, node_name=prefix + "cutter", geom_name=prefix + "cutter")


def _path(history: Mapping[str, NDArray[Any]], highest: float) -> Any:
    """Lines through the rows, broken where it jumps, one entity a run of one shade."""
    n = len(history["x_mm"])
    rows = np.arange(0, n, -(-n // ROWS))
    points = np.column_stack([history[k][rows] for k in ("x_mm", "y_mm", "z_mm")])
    colours = engagement_colours(history["engagement_deg"][rows], highest)
    piece = pieces(history)[rows]
    broken = np.flatnonzero(piece[1:] != piece[:-1]) + 1
    shade = np.flatnonzero((colours[1:] != colours[:-1]).any(axis=1)) + 1
    cuts = np.unique(np.concatenate([[0], broken, shade, [len(rows) - 1]]))
    entities = [
        trimesh.path.entities.Line(np.arange(a, b + (b not in broken)), color=colours[a])
        for a, b in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True)
        if b + (b not in broken) - a >= 2
    ]
    return trimesh.path.Path3D(entities=entities, vertices=points, process=False)
