"""The surface of the part: its points, its flat faces, the setup that makes each, and their deviations.

Notation: e [mm] displacement of a point from where it was made, n its unit normal. The best place of the part is the
rigid motion t + omega x (x - c) that makes the sum of the squares of n . (e - t - omega x (x - c)) over the area least.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.pocketed_part import LEVEL
from chipload.jobs.distortion.shapes import OFF
from chipload.lazy import trimesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: least share of the surface of a flat face whose flatness is listed, and their number
LEAST_FACE, LISTED = 0.01, 24


@dataclass(frozen=True, eq=False)
class FlatFace:
    """A flat face: its name, normal (3,), middle (3,) [mm], area [mm^2] and triangles."""

    name: str
    normal: Floats
    middle: Floats
    area: float
    triangles: Ints


@dataclass(frozen=True, eq=False)
class PartSurface:
    """Triangles of the part; each has its own corners.

    Attributes
    ----------
    points : (3 m, 3) float [mm]
    corner : (3 m,) int, which of the different points each is
    normals : (m, 3) float
    areas : (m,) float [mm^2]
    faces : flat ones, the largest first; the underside is the first of them that looks down at the lowest height
    """

    points: Floats
    corner: Ints
    normals: Floats
    areas: Floats
    faces: tuple[FlatFace, ...]

    @property
    def underside(self) -> FlatFace | None:
        """The largest flat face at the lowest height; None: the part has none."""
        return next((f for f in self.faces if f.name == UNDERSIDE), None)

    def middles(self) -> Floats:
        """Middles of the triangles (m, 3) [mm]."""
        return np.asarray(self.points.reshape(-1, 3, 3).mean(axis=1))

    def made_by(self, left: Sequence[Callable[[Floats], NDArray[np.bool_]]]) -> Ints:
        """The first state of removal (m,) in which a triangle is free; as many as there are: in none."""
        off = self.middles() + OFF * self.normals
        out = np.full(len(off), len(left), dtype=np.int64)
        for k, contains in reversed(list(enumerate(left))):
            out[~contains(off)] = k
        return out

    def deviations(self, e: Floats) -> Floats:
        """Deviations along the normals (3 m,) [mm] of displacements (3 m, 3), over the best place of the part."""
        return np.asarray(np.einsum("ij,ij->i", np.repeat(self.normals, 3, axis=0), self.relative_motion(e)))

    def relative_motion(self, e: Floats) -> Floats:
        """Displacements (3 m, 3) [mm] less those of the best place of the part."""
        n, w = np.repeat(self.normals, 3, axis=0), np.sqrt(np.repeat(self.areas, 3))
        size = float(np.ptp(self.points, axis=0).max())
        c = (self.points - self.points.mean(axis=0)) / size
        A = np.column_stack([n, np.cross(c, n)])
        x = np.linalg.lstsq(A * w[:, None], np.einsum("ij,ij->i", n, e) * w, rcond=1e-9)[0]
        return np.asarray(e - x[:3] - np.cross(x[3:], c))

    def flatness(self, face: FlatFace, e: Floats) -> float:
        """Width [mm] of a flat face about its least squares plane, displaced by (3 m, 3)."""
        rows = (3 * face.triangles[:, None] + np.arange(3)).ravel()
        x = self.points[rows] - face.middle
        A = np.column_stack([np.ones(len(x)), x - np.outer(x @ face.normal, face.normal)])
        h = e[rows] @ face.normal
        h = h - A @ np.linalg.lstsq(A, h, rcond=1e-9)[0]
        return float(np.ptp(h))


#: name of the face that a part stands on
UNDERSIDE = "underside"


def part_surface(mesh: trimesh.Trimesh, spacing: float) -> PartSurface:
    """The surface of a part in triangles whose sides are at most ``spacing`` [mm]."""
    points, faces, of = trimesh.remesh.subdivide_to_size(
        mesh.vertices, mesh.faces, spacing, max_iter=20, return_index=True
    )
    corners = np.asarray(points[faces], dtype=np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.asarray(mesh.face_normals[of], dtype=np.float64)
    areas = 0.5 * np.linalg.norm(across, axis=1)
    corner = np.asarray(faces, dtype=np.int64).ravel()
    return PartSurface(corners.reshape(-1, 3), corner, normals, areas, _flat_faces(mesh, of, corners, areas))


def _flat_faces(mesh: trimesh.Trimesh, of: Ints, corners: Floats, areas: Floats) -> tuple[FlatFace, ...]:
    """Flat faces of a mesh whose triangles were divided: ``of`` (m,) the first triangle of each."""
    group = np.full(len(mesh.faces), -1, dtype=np.int64)
    for k, facet in enumerate(mesh.facets):
        group[facet] = k
    mine = group[of]
    total, out, names = float(areas.sum()), list[FlatFace](), set[str]()
    bottom = float(mesh.bounds[0, 2])
    size = np.bincount(mine[mine >= 0], areas[mine >= 0], minlength=len(mesh.facets))
    for k in np.argsort(-size, kind="stable")[:LISTED].tolist():
        if size[k] < LEAST_FACE * total:
            break
        rows = np.flatnonzero(mine == k)
        middle = np.average(corners[rows].mean(axis=1), axis=0, weights=areas[rows])
        normal = np.asarray(mesh.facets_normal[k], dtype=np.float64)
        low = normal[2] < -1.0 + LEVEL and abs(middle[2] - bottom) < LEVEL * max(1.0, abs(bottom))
        name = UNDERSIDE if low and UNDERSIDE not in names else _face_name(normal, middle)
        while name in names:
            name += " '"
        names.add(name)
        out.append(FlatFace(name, normal, middle, float(size[k]), rows))
    return tuple(out)


def _face_name(normal: Floats, middle: Floats) -> str:
    """Direction and place of a face, such as "z+ at 2 mm"."""
    axis = int(np.abs(normal).argmax())
    if abs(normal[axis]) < 1.0 - LEVEL:
        return "slanted at " + ", ".join(f"{v:.4g}" for v in middle) + " mm"
    along = ", ".join(f"{'xyz'[d]} {middle[d]:.4g}" for d in range(3) if d != axis)
    return f"{'xyz'[axis]}{'+' if normal[axis] > 0.0 else '-'} at {middle[axis]:.4g} mm ({along})"
