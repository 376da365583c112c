"""The file scene.glb of a torque-controlled program: the remaining stock, and the path coloured by torque over
allowable.
"""

from __future__ import annotations

import numpy as np

from chipload.jobs.torque.outcome import HELD, TorqueResult
from chipload.lazy import trimesh
from chipload.report.scene import engagement_colours

#: rows of the path in the scene
SCENE_ROWS = 4000


def scene_bytes(outcome: TorqueResult) -> bytes:
    """The file scene.glb: the remaining stock, and the path coloured by the torque over the allowable torque."""
    scene = trimesh.Scene()
    stock = outcome.wall.stock.mesh()
    stock.visual.face_colors = (168, 122, 58, 255)
    scene.add_geometry(stock, node_name="stock", geom_name="stock")
    path = outcome.allowable.path
    rows = np.unique(np.linspace(0, len(path.points) - 1, min(len(path.points), SCENE_ROWS)).astype(np.int64))
    share = np.zeros(len(rows))
    if outcome.control.cases:
        o = outcome.control.cases[-1].runs[HELD].outcome
        most = outcome.allowable.torque * path.relief[rows]
        share = np.interp(path.model.s[rows], o.s, o.torque) / most
    colours = engagement_colours(share, max(1.0, float(share.max(initial=0.0))))
    entities = [trimesh.path.entities.Line(np.array([k, k + 1]), color=colours[k + 1]) for k in range(len(rows) - 1)]
    line = trimesh.path.Path3D(entities=entities, vertices=path.points[rows], process=False)
    scene.add_geometry(line, node_name="path", geom_name="path")
    glb: bytes = scene.export(file_type="glb", extension_webp=False)
    return glb
