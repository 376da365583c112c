"""Walls and floors of a part, named by faces of its model: sides that are cut, and the part with stock left on them.

Notation: u in 0..1 along a side, v in 0..1 from the top of its foot to its free edge; w in 0..1 from its lower edge, so
that the foot ends at w = f; N the normal out of the metal, D [mm] stock that is left. The frame is that of the model, z
up.

Stock is a body of its own over each side, from a little inside the metal to D over it: sections join both. The foot
keeps all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.mesh import read_mesh
from chipload.geometry.step_faces import Face, read_faces
from chipload.geometry.step_patch import patch_of
from chipload.geometry.thin_wall import closed_between
from chipload.jobs.tables import FaceName, require_stated
from chipload.jobs.thinwall.job import ThinWallJob
from chipload.jobs.thinwall.part_floor import PartFloor, floor_of
from chipload.jobs.thinwall.tables import FaceWallTable
from chipload.lazy import scipy, trimesh

Floats = NDArray[np.float64]

#: points of a side that its size and its place are found with
FEW = np.linspace(0.0, 1.0, 33)
#: greatest |N_z| of a side: at more it is a floor or a roof
STEEPEST = 0.5
#: how far stock reaches into the metal [mm]: far less than any wall is thick
INSIDE = 0.05
#: |N_z| of a level face
LEVEL = 1.0 - 1e-9
#: the foot ends within this share of the side's height
STEP = 1e-6
#: pieces of the stock of a side, along and up
PIECES = (24, 24)


@dataclass(frozen=True, eq=False)
class PartSide:
    """A side of a wall that is cut.

    Attributes
    ----------
    name : of its face
    patch : u along, w up, both and N right-handed
    foot : f
    wall : number of its wall
    allowance : [mm]
    """

    name: str
    patch: BSplinePatch
    foot: float
    wall: int
    allowance: float

    def at(self, u: Floats, v: Floats) -> Floats:
        """Points (n, 3) [mm] of the side."""
        return np.asarray(self.patch.at(u, np.clip(self.foot + v * (1.0 - self.foot), 0.0, 1.0)))

    def normal(self, u: Floats, v: Floats) -> Floats:
        """Unit normals (n, 3), out of the metal."""
        return np.asarray(self.patch.normal(u, np.clip(self.foot + v * (1.0 - self.foot), 0.0, 1.0)))

    def size(self) -> tuple[float, float]:
        """Length at half height, and height from the lower edge [mm]."""
        along, up = self.patch.at(FEW, 0.5), self.patch.at(0.5, FEW)
        return tuple(float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum()) for p in (along, up))  # type: ignore[return-value]

    def stock(self, places: tuple[Floats, Floats], left: Floats) -> trimesh.Trimesh:
        """Its stock as a closed body.

        Parameters
        ----------
        places : (n,) u, (m,) v
        left : (n, m) D [mm]
        """
        u, v = (
            np.unique(np.concatenate([np.linspace(0.0, 1.0, k + 1), p])) for k, p in zip(PIECES, places, strict=True)
        )
        w = np.concatenate([[0.0, self.foot * (1.0 - STEP)], self.foot + v * (1.0 - self.foot)])
        D = np.asarray(scipy.interpolate.RegularGridInterpolator(places, left)(tuple(np.meshgrid(u, v, indexing="ij"))))
        D = np.hstack([np.full((len(u), 2), self.allowance), D])
        a, b = (x.ravel() for x in np.meshgrid(u, w, indexing="ij"))
        p, N = self.patch.at(a, b), self.patch.normal(a, b)
        return closed_between((p - INSIDE * N).reshape(*D.shape, 3), (p + D.ravel()[:, None] * N).reshape(*D.shape, 3))


@dataclass(frozen=True, eq=False)
class PartShape:
    """The part and the sides of its walls that are cut.

    Attributes
    ----------
    name : what it is, in words
    part : the finished part
    each : its sides or floors, wall by wall
    thickness : [mm] of the thinnest wall or floor that is left
    """

    name: str
    part: trimesh.Trimesh
    each: tuple[PartSide | PartFloor, ...]
    thickness: float = 0.0

    def sides(self, u: ArrayLike, v: ArrayLike) -> tuple[Floats, ...]:
        """Points (..., 3) [mm] of each side."""
        return tuple(self._at(s, u, v, normal=False) for s in self.each)

    def normals(self, u: ArrayLike, v: ArrayLike) -> tuple[Floats, ...]:
        """Unit normals (..., 3) of each side, out of the metal."""
        return tuple(self._at(s, u, v, normal=True) for s in self.each)

    @staticmethod
    def _at(side: PartSide | PartFloor, u: ArrayLike, v: ArrayLike, normal: bool) -> Floats:
        a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64))
        at = side.normal if normal else side.at
        return at(a.ravel(), b.ravel()).reshape(*a.shape, 3)

    @property
    def floors(self) -> bool:
        """Whether its sides are floors: all are, or none is."""
        return isinstance(self.each[0], PartFloor)

    def size(self) -> tuple[float, float, float]:
        """Length of the longest side, height of the highest one, and least thickness [mm]."""
        sizes = np.array([s.size() for s in self.each])
        return float(sizes[:, 0].max()), float(sizes[:, 1].max()), self.thickness

    def levels(self) -> Floats:
        """Heights [mm] of the level faces of the part."""
        level = np.abs(np.asarray(self.part.face_normals)[:, 2]) > LEVEL
        heights = np.asarray(self.part.vertices)[np.asarray(self.part.faces)[level, 0], 2]
        return np.unique(heights.round(6))

    def body(self, places: tuple[Floats, Floats], left: Sequence[Floats]) -> trimesh.Trimesh:
        """The part with stock ``left`` (n, m) [mm] on each side, at places u (n,) and v (m,): bodies that overlap."""
        stock = [s.stock(places, D) for s, D in zip(self.each, left, strict=True)]
        made = trimesh.util.concatenate([self.part, *stock])
        return trimesh.Trimesh(made.vertices, made.faces, process=False)


def part_of_faces(job: ThinWallJob) -> PartShape:
    """The part of a job and the faces of its walls.

    Raises
    ------
    InputError
        The file cannot be read, or a face is no standing side of a wall.
    """
    table, file = require_stated(job.table.part, "part"), require_stated(job.part_file, "part.file")
    model = read_faces(file, "part.file")
    if not model.solid:
        raise InputError(f"part.file = {file.name}: its faces bound no solid: write the part as a solid")
    part = read_mesh(file, chord_mm=table.chord_mm, key="part.file")
    each: list[PartSide | PartFloor] = []
    names: dict[int, str] = {}
    for k, wall in enumerate(job.walls):
        stated_faces: list[tuple[str, FaceName]] = [("face", wall.face)]
        stated_faces += [] if wall.opposite is None else [("opposite", wall.opposite)]
        for (what, name), allowance in zip(stated_faces, wall.allowance_mm, strict=True):
            key = f"wall.{k}.{what}"
            face = model.face(name, key)
            if face.number in names:
                raise InputError(f"{key}: face {face.number} is {names[face.number]} too: state each face once")
            names[face.number] = key
            floor = job.operation.contact == "end"
            each.append(floor_of(face, key, part, k, allowance) if floor else _side(face, key, wall, k, allowance))
    numbers = ", ".join(s.name for s in each)
    count, what = len(job.walls), "floor" if job.operation.contact == "end" else "wall"
    return PartShape(
        f"{count} {what}{'s' if count > 1 else ''} of {model.file.name} (faces {numbers})", part, tuple(each)
    )


def _side(face: Face, key: str, wall: FaceWallTable, number: int, allowance: float) -> PartSide:
    """A face as the side of a wall."""
    patch = _turn_upright(patch_of(face, key, wall.fit_mm).patch, key, face)
    made = PartSide(f"{face.number}", patch, 0.0, number, allowance)
    height = made.size()[1]
    foot = require_stated(wall.foot_mm, f"wall.{number}.foot_mm")
    if not foot < 0.8 * height:
        raise InputError(
            f"wall.{number}.foot_mm = {foot:g}: must be below 0.8 of the height of face {face.number}, "
            f"{height:.4g} mm: the rest is cut"
        )
    up = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(patch.at(0.5, FEW), axis=0), axis=1))])
    return PartSide(made.name, patch, float(np.interp(foot, up, FEW)), number, allowance)


def _turn_upright(patch: BSplinePatch, key: str, face: Face) -> BSplinePatch:
    """The patch with w upwards, right-handed.

    Raises
    ------
    InputError
        It does not stand.
    """
    a, b = (x.ravel() for x in np.meshgrid(FEW, FEW, indexing="ij"))
    flat = float(np.abs(patch.normal(a, b)[:, 2]).max())
    if flat > STEEPEST:
        raise InputError(
            f"{key}: face {face.number} is not upright: its normal is {np.degrees(np.arcsin(flat)):.3g} deg "
            f"off the horizontal, at most {np.degrees(np.arcsin(STEEPEST)):g}: state the side of a wall, z up, or "
            "contact = end, which plans a level floor"
        )
    orientations = [q for p in (patch, patch.swapped()) for q in (p, p.reversed(False, True))]
    patch = max(orientations, key=lambda q: float((q.at(FEW, 1.0) - q.at(FEW, 0.0))[:, 2].mean()))
    return patch if patch.side > 0 else patch.reversed(True, False)
