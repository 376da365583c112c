"""The file scene.glb: wall, stock, cutter, and the paths coloured by engagement. Lengths are mm, Z is up, as the extras
say.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.contour.outcome import ContourResult, Operation
from chipload.jobs.contour.result import track_name
from chipload.lazy import trimesh
from chipload.report.presentation import Blank
from chipload.report.scene import ROWS, STOCK, TOOL, WALL, engagement_colours
from chipload.report.shape import merge_meshes, ribbon, slab, stretches

Floats = NDArray[np.float64]

#: the blank of a pocket is drawn thicker than the pocket is deep by this share of its depth: no job states how thick
FLOOR = 0.5


def scene_bytes(outcome: ContourResult) -> bytes:
    """The file scene.glb."""
    scene = trimesh.Scene()
    for k, op in enumerate(outcome.operations):
        _add(scene, f"{k}-", op)
    glb: bytes = scene.export(file_type="glb", extension_webp=False, tree_postprocessor=_declare_units)
    return glb


def blanks_of(outcome: ContourResult) -> dict[str, Blank]:
    """Initial blank of each strategy: the prism over its stock, or, where it begins in the solid, over a box, which is
    thicker than a pocket is deep.
    """
    out = {}
    for k, op in enumerate(outcome.operations):
        for name, strategy in op.result.strategies.items():
            before = strategy.drawn.get("stock before", ())
            if before:
                vertices, faces = slab(before, op.top - op.depth, op.top)
                mesh = trimesh.Trimesh(vertices, faces, process=True)
            else:
                rows = np.column_stack([strategy.history[x] for x in ("x_mm", "y_mm")])
                low, high = rows.min(axis=0) - 2.0 * op.cutter.radius, rows.max(axis=0) + 2.0 * op.cutter.radius
                has_floor = op.settings.get("kind") == "pocket" and "tabs" not in op.settings
                bottom = op.top - op.depth * (1.0 + FLOOR if has_floor else 1.0)
                mesh = trimesh.creation.box(bounds=[[*low, bottom], [*high, op.top]])
            if mesh.is_watertight:
                out[track_name(outcome, k, name)] = Blank(mesh, {op.cutter.number: op.cutter})
    return out


def _declare_units(tree: dict[str, Any]) -> None:
    tree["asset"]["extras"] = {"units": "mm", "up": "Z"}


def _add(scene: Any, prefix: str, op: Operation) -> None:
    low, high = op.top - op.depth, op.top
    used = op.result.strategies[op.result.use]
    for name, colour in (("wall", WALL), ("stock", STOCK)):
        contours = used.drawn.get(name, ())
        closed = [c for c in contours if c.closed]
        solid = [slab(closed, low, high)] if name == "stock" and closed else [ribbon(c, low, high) for c in closed]
        vertices, faces = merge_meshes(solid + [ribbon(c, low, high) for c in contours if not c.closed])
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
    piece = stretches(history)[rows]
    breaks = np.flatnonzero(piece[1:] != piece[:-1]) + 1
    shade = np.flatnonzero((colours[1:] != colours[:-1]).any(axis=1)) + 1
    cuts = np.unique(np.concatenate([[0], breaks, shade, [len(rows) - 1]]))
    entities = [
        trimesh.path.entities.Line(np.arange(a, b + (b not in breaks)), color=colours[a])
        for a, b in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True)
        if b + (b not in breaks) - a >= 2
    ]
    return trimesh.path.Path3D(entities=entities, vertices=points, process=False)
