"""The form error of a stated part, step by step: the material that deflection leaves on its surface.

Notation: a point of the part is made by the step whose tool comes nearest to it; the error there is that of
:mod:`chipload.simulation.deflection`, at the moment when an edge makes the point, positive where material is left.

A point counts if it had stock over it, if the rigid tool leaves it within ``NEAR`` of the part (otherwise there is
stock for a later operation, or a gouge), and if it lies on a smooth piece of the surface. Only the cuts in the block of
steps of its nearest step are searched for a point, so that no data of earlier blocks need be kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import trimesh
from numpy.typing import NDArray

from chipload.checking.stiffness import Stiffness
from chipload.cutting.material import Material
from chipload.simulation.deflection import form_error
from chipload.simulation.loads import Cuts
from chipload.simulation.surface import Difference

Floats = NDArray[np.float64]

#: a point that the rigid tool leaves farther from the part [mm] is not finished
NEAR = 0.05
#: greatest angle between the normal at a point and those of the triangles round it: no edge of the part [rad]
SMOOTH = math.radians(15.0)


def forming(left: Difference, stiffness: Stiffness, material: Material) -> Callable[[Cuts], dict[str, Floats]]:
    """Return a watch with the columns ``form_error_um`` (of greatest size, signed) and ``form_points`` (points made).

    Parameters
    ----------
    left : what the rigid tool leaves on the part
    """
    mesh = trimesh.Trimesh(left.points, left.faces, process=False)
    normals = np.asarray(mesh.vertex_normals)
    least, flat = np.ones(len(left.points)), np.asarray(mesh.face_normals)
    for corner in left.faces.T:
        np.minimum.at(least, corner, np.einsum("fj,fj->f", flat, normals[corner]))
    counts = left.over & (np.abs(left.distance) <= NEAR) & (least >= math.cos(SMOOTH))
    at = np.flatnonzero(counts)
    at = at[np.argsort(left.step[at], kind="stable")]
    step = left.step[at]

    def columns(cuts: Cuts) -> dict[str, Floats]:
        error, made = np.zeros(len(cuts)), np.zeros(len(cuts))
        some = at[np.searchsorted(step, cuts.step[0]) : np.searchsorted(step, cuts.step[-1], "right")]
        if len(some):
            work = _work(stiffness, left, some)
            bars = {cuts.tool: stiffness.bars[cuts.tool]}
            found = form_error(
                [cuts], material, left.points[some], normals[some], work=work, bars=bars, near=2.0 * NEAR
            )
            own = np.flatnonzero(found.made & found.at_edge)
            row = np.searchsorted(cuts.step, found.step[own])
            np.add.at(made, row, 1.0)
            order = np.argsort(np.abs(found.error[own]), kind="stable")
            error[row[order]] = 1e3 * found.error[own][order]
        return {"form_error_um": error, "form_points": made}

    return columns


def _work(stiffness: Stiffness, left: Difference, points: NDArray[np.int64]) -> Floats | None:
    """Return the compliance of the work at points of the part: that of the step that makes each, at its height."""
    if stiffness.work is None or isinstance(stiffness.work, float):
        return None if stiffness.work is None else np.full(len(points), stiffness.work)
    return stiffness.work.at_points(left.step[points], left.points[points])
