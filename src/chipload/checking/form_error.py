"""The form error of a stated part, step by step: the material that deflection leaves on its surface.

Notation: a point of the part is made by the step whose tool comes nearest to it; the error there is that of
:mod:`chipload.simulation.deflection`, at the moment when an edge makes the point, positive where material is left.

A point counts if it had stock over it, if the rigid tool leaves it within ``NEAR`` of the part (otherwise there is
stock for a later operation, or a gouge), and if it lies on a smooth piece of the surface. Only the cuts in the block of
steps of its nearest step are searched for a point, so that no data of earlier blocks need be kept.

Between the points the error may be greater: along the edge it has a corner where another tooth begins or ends to cut,
and it ends where the edge does. In each block it is sought on either side of the points with the greatest errors, along
the axis of the tool as it lies on the surface, within the triangles of the part: at ``FINER`` places, and at as many
beside the greatest of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from chipload.checking.stiffness import Stiffness
from chipload.cutting.material import Material
from chipload.lazy import trimesh
from chipload.simulation.deflection import FormError, form_error
from chipload.simulation.loads import Cuts
from chipload.simulation.surface import Difference

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: a point that the rigid tool leaves farther from the part [mm] is not finished
NEAR = 0.05
#: greatest angle between the normal at a point and those of the triangles round it: no edge of the part [rad]
SMOOTH = math.radians(15.0)
#: the error is sought beside points whose error is at least this share of the greatest of their block, of those that
#: are alike within the second share beside one; 0.85 keeps a wall whose error falls by 15 % over the spacing
NEARLY, ALIKE = 0.85, 0.005
#: places on each side of a point, and points that are refined further
FINER, FURTHER = 8, 4


def form_error_watch(left: Difference, stiffness: Stiffness, material: Material) -> Callable[[Cuts], dict[str, Floats]]:
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
            bars = {cuts.tool: stiffness.bars[cuts.tool]}

            def found_at(points: Floats, own: Ints) -> FormError:
                """Return the form error at points, each beside one of the part."""
                work = _work(stiffness, left, own, points)
                return form_error([cuts], material, points, normals[own], work=work, bars=bars, near=2.0 * NEAR)

            found = found_at(left.points[some], some)
            own = np.flatnonzero(found.made & found.at_edge)
            np.add.at(made, np.searchsorted(cuts.step, found.step[own]), 1.0)
            _keep_greatest(error, cuts, found.step[own], found.error[own])
            top = own[_greatest_apart(np.abs(found.error[own]))]
            row = np.searchsorted(cuts.step, found.step[top])
            lines = _LinesOnPart(left, mesh, some[top], cuts.engagement.frames[row, 2], normals[some[top]])
            for step_of, value in lines.errors(found_at):
                _keep_greatest(error, cuts, step_of, value)
        return {"form_error_um": error, "form_points": made}

    return columns


def _keep_greatest(error: Floats, cuts: Cuts, step: Ints, found: Floats) -> None:
    """Keep the errors [mm] that are greater than those of their steps, in µm."""
    row, found = np.searchsorted(cuts.step, step), 1e3 * found
    order = np.argsort(np.abs(found), kind="stable")
    row, found = row[order], found[order]
    greater = np.abs(found) > np.abs(error[row])
    error[row[greater]] = found[greater]


def _greatest_apart(size: Floats) -> Ints:
    """Return the errors near the greatest: of those that are alike the first.

    >>> _greatest_apart(np.array([1.0, 0.2, 0.999, 0.9])).tolist()
    [0, 3]
    """
    if not len(size) or not size.max() > 0.0:
        return np.zeros(0, dtype=np.int64)
    below = (size.max() - size) / size.max()
    some = np.flatnonzero(below <= 1.0 - NEARLY)
    _, first = np.unique(np.floor(below[some] / ALIKE), return_index=True)
    return np.asarray(some[first])


class _LinesOnPart:
    """Lines through points of the part along the axis of the tool, on both sides up to the border of a triangle."""

    def __init__(self, left: Difference, mesh: trimesh.Trimesh, points: Ints, axis: Floats, normal: Floats) -> None:
        along = axis - np.einsum("pi,pi->p", axis, normal)[:, None] * normal
        length = np.linalg.norm(along, axis=1)
        some = length > 1e-6
        along = along[some] / length[some, None]
        both = np.concatenate([along, -along])
        own = np.concatenate([points[some], points[some]])
        reach = np.array(
            [_reach(left, mesh.vertex_faces[p], p, line) for p, line in zip(own.tolist(), both, strict=True)]
        ).reshape(-1)
        kept = reach > 0.0
        self.own, self.line, self.reach, self.start = own[kept], both[kept], reach[kept], left.points[own[kept]]

    def errors(self, found_at: Callable[[Floats, Ints], FormError]) -> Iterator[tuple[Ints, Floats]]:
        """Yield steps and errors on the lines: at even distances, then about the greatest of some lines."""
        if not len(self.own):
            return
        share = np.tile(np.arange(1, FINER + 1) / FINER, (len(self.own), 1))
        lines = np.arange(len(self.own))
        for again in (True, False):
            points = self.start[lines, None] + (share * self.reach[lines, None])[..., None] * self.line[lines, None]
            found = found_at(points.reshape(-1, 3), np.repeat(self.own[lines], share.shape[1]))
            counts = found.made & found.at_edge & (np.abs(found.rigid) <= NEAR)
            yield found.step[counts], found.error[counts]
            if not again or not counts.any():
                return
            size = np.where(counts, np.abs(found.error), 0.0).reshape(share.shape)
            lines = np.argsort(-size.max(axis=1), kind="stable")[:FURTHER]
            # either side of the greatest on a line, without the places that are known
            middle = share[lines, np.argmax(size[lines], axis=1)]
            off = np.r_[np.arange(-FINER + 1, 0), np.arange(1, FINER)] / FINER**2
            share = np.clip(middle[:, None] + off, 0.0, 1.0)


def _reach(left: Difference, faces: Ints, point: int, line: Floats) -> float:
    """Return how far [mm] a line along the surface from a point of the part stays in the triangle that it enters; 0: it
    enters none.

    With the corners b, c beside the point, line = x (b - p) + y (c - p), x, y >= 0 and it leaves where x + y = 1.
    """
    for face in faces[faces >= 0].tolist():
        b, c = (left.points[k] - left.points[point] for k in left.faces[face] if k != point)
        found, *_ = np.linalg.lstsq(np.column_stack([b, c]), line, rcond=None)
        if found.min() >= -1e-9 and found.sum() > 0.0:
            return float(1.0 / found.sum())
    return 0.0


def _work(stiffness: Stiffness, left: Difference, own: Ints, points: Floats) -> Floats | None:
    """Return the compliance of the work at points beside those of the part: that of the step that makes each."""
    if stiffness.work is None or isinstance(stiffness.work, float):
        return None if stiffness.work is None else np.full(len(points), stiffness.work)
    return stiffness.work.at_points(left.step[own], points)
