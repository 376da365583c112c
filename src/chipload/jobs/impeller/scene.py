"""The file scene.glb of an impeller: the surfaces coloured by their largest diameter, with the other blades and the
hub.

Lengths are mm, Z is up, as the extras state.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.impeller.mesh import OFF, body_meshes, surface_mesh
from chipload.jobs.impeller.outcome import ImpellerResult, Searched
from chipload.jobs.impeller.partitions import patch_grid, shade_of
from chipload.lazy import trimesh
from chipload.planning.impeller.compare import Partition
from chipload.report.scene import engagement_colours, engagement_legend, legend

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MISSED = (179, 38, 30, 255)


def scene_bytes(milled: ImpellerResult) -> bytes:
    """The file scene.glb."""
    scene = trimesh.Scene()
    for name, (points, faces), colour in body_meshes(milled.impeller):
        _add(scene, name, points, faces, np.tile(np.array(colour, dtype=np.uint8), (len(points), 1)))
    most = max(float(op.answer.diameter.max()) for op in milled.surfaces)
    for k, op in enumerate(milled.surfaces):
        points, faces = surface_mesh(op)
        colours = engagement_colours(op.answer.diameter, most)
        colours[op.answer.cutter < 0] = MISSED
        legend = engagement_legend("largest cutter diameter [mm]", most)
        legend["words"] = [["no cutter reaches it", "#b3261e"]] if (op.answer.cutter < 0).any() else []
        _add(scene, f"{k}-largest", points, faces, colours, legend)
        if milled.used is not None:
            _add(
                scene,
                f"{k}-patches",
                points + OFF * op.surface.scene.normal,
                faces,
                _patches(milled, milled.used, op),
                _patch_legend(milled, milled.used, op),
            )
    for k, p in enumerate(milled.programs or (), 1):
        n = len(p.setting.program)
        if n > 1:
            colour = np.array((34, 120, 132, 255), dtype=np.uint8)
            line = trimesh.path.entities.Line(np.arange(n), color=colour)
            path = trimesh.path.Path3D(entities=[line], vertices=p.setting.program.p_work, process=False)
            scene.add_geometry(path, node_name=f"path-{k}", geom_name=f"path-{k}")
    glb: bytes = scene.export(file_type="glb", extension_webp=False, tree_postprocessor=_declare_units)
    return glb


def _patches(milled: ImpellerResult, partition: Partition, op: Searched) -> NDArray[np.uint8]:
    """(c, 4) colours of the contact points by patch."""
    grid = patch_grid(milled, partition, op).ravel()
    out = np.tile(np.array(MISSED, dtype=np.uint8), (len(grid), 1))
    for n, p in enumerate(partition.divided.patches if partition.divided is not None else ()):
        out[grid == n, :3] = shade_of(partition, p)
    return out


def _patch_legend(milled: ImpellerResult, partition: Partition, op: Searched) -> dict[str, Any]:
    """Cutter and table angle of each patch of a surface."""
    numbers = [int(n) for n in np.unique(patch_grid(milled, partition, op)) if n >= 0]
    patches = partition.divided.patches if partition.divided is not None else ()
    cutters = op.answer.catalogue.cutters
    words = {
        f"{cutters[p.cutter].label} mm at {np.degrees(p.table):.6g} deg": shade_of(partition, p)
        for p in (patches[n] for n in numbers)
    }
    return legend("patch: cutter, table angle", [], list(words.items()))


def _add(
    scene: Any, name: str, points: Floats, faces: Ints, colours: NDArray[np.uint8], legend: dict[str, Any] | None = None
) -> None:
    both = np.concatenate([faces, faces[:, ::-1]])
    mesh = trimesh.Trimesh(points, both, vertex_colors=colours, process=False)
    if legend is not None:
        mesh.metadata["legend"] = legend
    scene.add_geometry(mesh, node_name=name, geom_name=name)


def _declare_units(tree: dict[str, Any]) -> None:
    tree["asset"]["extras"] = {"units": "mm", "up": "Z"}
