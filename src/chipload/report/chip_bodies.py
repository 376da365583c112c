"""The undeformed chips of a track as bodies: the material removed between two frames of removal.npz.

Notation: as :mod:`chipload.simulation.removal_mesh`; the chip of frame i is the stock of frame i - 1 less that of frame
i. Its surface is the surface of the stock that is gone in frame i, and the new one of frame i turned round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import trimesh
from chipload.report.scene import engagement_colours, engagement_legend
from chipload.result import COLUMNS
from chipload.result.limits import Columns
from chipload.simulation.removal_mesh import RemovalMesh
from chipload.stock.surface_net import STEPS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: columns whose greatest value in the rows of a chip is taken, where the history has them
GREATEST = ("chip_max_mm", "force_n", "torque_nm", "power_w", "deflection_um", "cutter_stress_mpa")
#: columns that colour a chip, the first that a history has
COLOURED = ("force_n", "chip_max_mm", "torque_nm")
#: a column whose sum is taken
SUM = "chip_volume_mm3"


@dataclass(frozen=True, eq=False)
class ChipBodies:
    """Closed surfaces of chips.

    Parameters
    ----------
    points : (p, 3) float [mm]
    faces : (q, 4) int, counter-clockwise from outside of the chip
    chip : (q,) int, the frame whose chip a face belongs to, from 1
    values : (q,) by name, of the rows of the chip
    """

    points: Floats
    faces: Ints
    chip: Ints
    values: dict[str, NDArray[np.generic]]


def chip_bodies(mesh: RemovalMesh, columns: Columns) -> ChipBodies:
    """The chips of a track.

    Parameters
    ----------
    columns : of its history, all rows; of those known here the greatest or the sum is given to each chip, besides
        ``row`` and ``line``, at which the chip is off

    Examples
    --------
    >>> low, high = np.zeros(3), np.array([65535.0, 1.0, 1.0])
    >>> corners, rows = np.zeros((1, 4, 3), np.uint16), np.array([7])
    >>> mesh = RemovalMesh(low, high, corners, np.array([[0, 1]], np.uint16), rows, np.zeros(2), np.ones(3))
    >>> chips = chip_bodies(mesh, {"force_n": np.arange(10.0)})
    >>> chips.chip.tolist(), chips.values["row"].tolist(), chips.values["force_n"].tolist()
    ([1], [7], [7.0])
    """
    frames, first, last = len(mesh.rows), mesh.seen[:, 0].astype(np.int64), mesh.seen[:, 1].astype(np.int64)
    new, removed = (first >= 1) & (first <= frames), (last >= 1) & (last <= frames)
    corners = np.concatenate([mesh.corners[new][:, ::-1], mesh.corners[removed]])
    chip = np.concatenate([first[new], last[removed]])
    order = np.argsort(chip, kind="stable")
    corners, chip = corners[order], chip[order]
    unique, at = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    points = mesh.low + unique * ((mesh.high - mesh.low) / STEPS)
    of_frames = _of_frames(mesh.rows, columns)
    values = {name: value[chip - 1] for name, value in of_frames.items()}
    return ChipBodies(points, at.reshape(-1, 4).astype(np.int64), chip, values)


def chips_scene(chips: ChipBodies) -> bytes:
    """Scene of glTF (GLB): a body for each chip, `chip-12`, coloured by its force, or thickness, with its numbers as
    extras; lengths are mm, Z is up.
    """
    scene = trimesh.Scene()
    numbers, first = np.unique(chips.chip, return_index=True)
    shade = next((name for name in COLOURED if name in chips.values), None)
    values = np.nan_to_num(chips.values[shade][first].astype(np.float64)) if shade is not None else np.zeros(len(first))
    most = float(values.max(initial=0.0))
    colours = engagement_colours(values, most)
    for number, k, colour in zip(numbers.tolist(), first.tolist(), colours, strict=True):
        used, at = np.unique(chips.faces[chips.chip == number], return_inverse=True)
        quads = at.reshape(-1, 4)
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        body = trimesh.Trimesh(chips.points[used], triangles, process=False)
        body.visual.vertex_colors = np.tile(colour, (len(used), 1))
        body.metadata |= {name: float(value[k]) for name, value in chips.values.items() if np.isfinite(value[k])}
        if shade is not None:
            body.metadata["legend"] = engagement_legend(COLUMNS[shade].title, most)
        scene.add_geometry(body, node_name=f"chip-{number}", geom_name=f"chip-{number}")
    glb: bytes = scene.export(file_type="glb", extension_webp=False)
    return glb


def _of_frames(rows: Ints, columns: Columns) -> dict[str, NDArray[np.generic]]:
    """Of each frame from 1: its last row and line, sums and greatest values over its rows."""
    out: dict[str, NDArray[np.generic]] = {"row": np.asarray(rows, dtype=np.int64)}
    if not len(rows):
        return out
    starts, stop = np.concatenate([[0], rows[:-1] + 1]), int(rows[-1]) + 1
    if "line" in columns:
        out["line"] = np.asarray(columns["line"])[rows].astype(np.int64)
    if SUM in columns:
        out[SUM] = np.add.reduceat(np.asarray(columns[SUM], dtype=np.float64)[:stop], starts)
    for name in GREATEST:
        if name in columns:
            out[name] = np.fmax.reduceat(np.asarray(columns[name], dtype=np.float64)[:stop], starts)
    return out
