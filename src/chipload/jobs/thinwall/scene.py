"""The file scene.glb of a thin wall: finished wall, workpiece before, neighbours, the cutter, and the contact points of
each variant coloured by depth. Lengths are mm, Z is up, as the extras state.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.thinwall.outcome import USED, ThinWallResult, Variant
from chipload.lazy import trimesh
from chipload.report.scene import FIXTURE, ROWS, STOCK, TOOL, WALL, engagement_colours

Floats = NDArray[np.float64]


def scene_bytes(walled: ThinWallResult) -> bytes:
    """The file scene.glb."""
    scene = trimesh.Scene()
    for (vertices, faces), name, colour in (
        (walled.geometry.finished, "wall", WALL),
        (walled.geometry.stock, "stock", STOCK),
        *((mesh, f"fixture-{name.replace(' ', '-')}", FIXTURE) for name, mesh in walled.geometry.neighbours.items()),
    ):
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        mesh.visual.face_colors = np.tile(np.array(colour, dtype=np.uint8), (len(faces), 1))
        scene.add_geometry(mesh, node_name=f"0-{name}", geom_name=f"0-{name}")
    deepest = max(float(v.columns["depth_mm"].max()) for v in walled.variants.values())
    for name, one in walled.variants.items():
        path = _path(one, deepest)
        if path is not None:
            scene.add_geometry(path, node_name=f"0-path-{name}", geom_name=f"0-path-{name}")
    scene.add_geometry(_tool(walled), node_name="0-cutter", geom_name="0-cutter")
    glb: bytes = scene.export(file_type="glb", extension_webp=False, tree_postprocessor=_declare_units)
    return glb


def _declare_units(tree: dict[str, Any]) -> None:
    tree["asset"]["extras"] = {"units": "mm", "up": "Z"}


def _path(one: Variant, deepest: float) -> Any:
    """Contact points of steps that follow one another, one entity a run of one shade."""
    c = one.columns
    cut = np.flatnonzero(c["force_normal_n"] > 0.0)
    if len(cut) < 2:
        return None
    cut = cut[:: -(-len(cut) // ROWS)]
    points = np.column_stack([np.asarray(c[f"contact_{x}_mm"])[cut] for x in "xyz"])
    colours = engagement_colours(np.asarray(c["depth_mm"])[cut], deepest)
    breaks = np.flatnonzero(np.diff(cut) > 1) + 1
    shade = np.flatnonzero((colours[1:] != colours[:-1]).any(axis=1)) + 1
    ends = np.unique(np.concatenate([[0], breaks, shade, [len(cut) - 1]]))
    entities = [
        trimesh.path.entities.Line(np.arange(a, b + (b not in breaks)), color=colours[a])
        for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
        if b + (b not in breaks) - a >= 2
    ]
    return trimesh.path.Path3D(entities=entities, vertices=points, process=False) if entities else None


def _tool(walled: ThinWallResult) -> Any:
    """The cutter at the first contact point of the variant in use."""
    program = walled.variants[USED].program
    k = int(np.flatnonzero(program.feed > 0.0)[0])
    c = walled.planning.cutters[int(program.tool[k])]
    z = np.linspace(0.0, c.flute_length, 33)
    outline = np.column_stack([c.radius_at(z), z])
    outline = np.vstack([[0.0, 0.0], outline[outline[:, 0] > 0.0], [c.radius, c.overhang], [0.0, c.overhang]])
    tool = trimesh.creation.revolve(outline, sections=40)
    turn = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], program.axis[k])
    turn[:3, 3] = program.p_work[k]
    tool.apply_transform(turn)
    tool.visual.face_colors = np.tile(np.array(TOOL, dtype=np.uint8), (len(tool.faces), 1))
    return tool
