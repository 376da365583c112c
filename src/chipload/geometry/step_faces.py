"""The faces of a STEP part: numbered, named by number or by a point on them, and what one is made of.

Notation: a face is a piece of a surface S(u, v) [mm] of the CAD kernel, trimmed by loops of edges; its first loop goes
round it, others are holes. Faces are numbered from 1 in the order of the file. The kernel converts the file's unit to
mm and is imported when a file is read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.step import read_shape

Floats = NDArray[np.float64]

#: a face, by its number or by a point [mm] on it
Name = int | tuple[float, float, float]

#: a point names a face if it is nearer to it than this [mm]
ON = 0.01
_LARGEST_FILE = 500_000_000
_LISTED = 60


@dataclass(frozen=True, eq=False)
class Face:
    """A face.

    Attributes
    ----------
    number : from 1, in the order of the file
    kind : of its surface, as `plane` or `b-spline`
    area : [mm^2]
    low, high : (3,) corners of its box [mm]
    holes, edges : how many
    shape : of the CAD kernel
    """

    number: int
    kind: str
    area: float
    low: Floats
    high: Floats
    holes: int
    edges: int
    shape: Any = field(repr=False)

    def __str__(self) -> str:
        corners = np.stack([self.low, self.high]).round(4) + 0.0
        box = ", ".join(f"{a} {p:.6g} to {q:.6g}" for a, p, q in zip("xyz", *corners, strict=True))
        holes = "" if not self.holes else f", {self.holes} {'hole' if self.holes == 1 else 'holes'}"
        return f"face {self.number}: {self.kind}, {self.area:.5g} mm2, {self.edges} edges{holes}; {box} mm"

    def distance(self, point: Sequence[float]) -> float:
        """From a point [mm]."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
        from OCP.BRepExtrema import BRepExtrema_DistShapeShape
        from OCP.gp import gp_Pnt

        vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*(float(x) for x in point))).Vertex()
        return float(BRepExtrema_DistShapeShape(vertex, self.shape).Value())


@dataclass(frozen=True, eq=False)
class Model:
    """A part with its faces; ``solid``: all of them bound solids, so that their normals look out of the metal."""

    file: Path
    faces: tuple[Face, ...]
    solid: bool

    def face(self, name: Name, key: str) -> Face:
        """The face of a name; ``key`` says who asks.

        Raises
        ------
        InputError
            There is no such face, or the point is on none or on several.
        """
        if isinstance(name, int):
            if not 1 <= name <= len(self.faces):
                raise InputError(
                    f"{key} = {name}: no such face: must be from 1 to {len(self.faces)}: "
                    f"chipload check {self.file.name} lists the faces"
                )
            return self.faces[name - 1]
        said = f"{key} = [{', '.join(f'{x:g}' for x in name)}]"
        p = np.asarray(name, dtype=np.float64)
        near = [f for f in self.faces if (p >= f.low - ON).all() and (p <= f.high + ON).all()]
        away = {f.number: f.distance(name) for f in near}
        on = [number for number, d in away.items() if d <= ON]
        if len(on) == 1:
            return self.faces[on[0] - 1]
        if on:
            faces = " and ".join(str(n) for n in on)
            raise InputError(f"{said}: lies on faces {faces}: take a point within one of them")
        away = {f.number: f.distance(name) for f in self.faces}
        number = min(away, key=lambda n: away[n])
        raise InputError(
            f"{said}: lies {away[number]:.4g} mm off the nearest face, {number}: must be within {ON:g} mm of a face "
            "(mm, in the frame of the file)"
        )

    def lines(self) -> list[str]:
        """What the faces are, a line for each of the first."""
        more = len(self.faces) - _LISTED
        return [
            f"{self.file.name}: {len(self.faces)} faces",
            *(str(f) for f in self.faces[:_LISTED]),
            *([f"and {more} more"] if more > 0 else []),
        ]


def read_faces(path: str | Path, key: str = "part.file") -> Model:
    """The faces of a STEP part.

    Parameters
    ----------
    key : what the file is called in a message

    Raises
    ------
    InputError
        The file is missing or no STEP file, states no unit of length, or has no faces.
    """
    from OCP.Bnd import Bnd_Box
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID, TopAbs_WIRE
    from OCP.TopoDS import TopoDS

    file = Path(path)
    if file.is_file() and file.stat().st_size > _LARGEST_FILE:
        raise InputError(f"{key} = {file.name}: more than {_LARGEST_FILE} bytes: write the part alone")
    shape = read_shape(file, key)
    if b"LENGTH_UNIT" not in file.read_bytes():
        raise InputError(f"{key} = {file.name}: states no unit of length: write it again with its unit")
    out: list[Face] = []
    for k, found in enumerate(_all(shape, TopAbs_FACE), 1):
        face = TopoDS.Face(found)
        properties, box = GProp_GProps(), Bnd_Box()
        BRepGProp.SurfaceProperties_s(face, properties)
        BRepBndLib.AddOptimal_s(face, box, False, False)
        low, high = (np.array([p.X(), p.Y(), p.Z()]) for p in (box.CornerMin(), box.CornerMax()))
        kind = _KINDS.get(BRepAdaptor_Surface(face).GetType().name, "other surface")
        wires, edges = (len(_all(face, what)) for what in (TopAbs_WIRE, TopAbs_EDGE))
        out.append(Face(k, kind, float(properties.Mass()), low, high, wires - 1, edges, face))
    if not out:
        raise InputError(f"{key} = {file.name}: no faces in this STEP file")
    bounding = sum(len(_all(body, TopAbs_FACE)) for body in _all(shape, TopAbs_SOLID))
    return Model(file, tuple(out), bounding == len(out))


def _all(shape: Any, what: Any) -> list[Any]:
    """The parts of a kind, in their order."""
    from OCP.TopExp import TopExp_Explorer

    out: list[Any] = []
    explorer = TopExp_Explorer(shape, what)
    while explorer.More():
        out.append(explorer.Current())
        explorer.Next()
    return out


_KINDS = {
    "GeomAbs_Plane": "plane",
    "GeomAbs_Cylinder": "cylinder",
    "GeomAbs_Cone": "cone",
    "GeomAbs_Sphere": "sphere",
    "GeomAbs_Torus": "torus",
    "GeomAbs_BezierSurface": "Bezier",
    "GeomAbs_BSplineSurface": "b-spline",
    "GeomAbs_SurfaceOfRevolution": "of revolution",
    "GeomAbs_SurfaceOfExtrusion": "of extrusion",
    "GeomAbs_OffsetSurface": "offset",
}
