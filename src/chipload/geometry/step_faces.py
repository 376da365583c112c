"""The faces of a STEP part, named by number or by a point on them.

Notation: a face is a piece of a surface S(u, v) [mm] of the CAD kernel, trimmed by loops of edges; its first loop is
the outer one, the others are holes. Faces are numbered from 1 in the order of the file. The kernel converts the file's
unit to mm. It runs in a separate process: functions whose first parameter is a :class:`Part` are executed there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.files import read_regular
from chipload.geometry.isolated import Isolated
from chipload.geometry.step import LARGEST_FILE, Part, open_step
from chipload.number_text import number_text

Floats = NDArray[np.float64]

#: a face, by its number or by a point [mm] on it
Name = int | tuple[float, float, float]

#: greatest distance of a point from the face that it names [mm]
ON = 0.01


@dataclass(frozen=True, eq=False)
class Face:
    """A face of a STEP part.

    Attributes
    ----------
    number : from 1, in the order of the file
    kind : kind of its surface, such as `plane` or `b-spline`
    area : area [mm^2]
    low, high : (3,) corners of its bounding box [mm]
    holes, edges : numbers of holes and of edges
    part : the process of the CAD kernel that has read the part
    """

    number: int
    kind: str
    area: float
    low: Floats
    high: Floats
    holes: int
    edges: int
    part: Isolated = field(repr=False)

    def __str__(self) -> str:
        corners = np.stack([self.low, self.high]).round(4) + 0.0
        box = ", ".join(f"{a} {p:.6g} to {q:.6g}" for a, p, q in zip("xyz", *corners, strict=True))
        holes = "" if not self.holes else f", {self.holes} {'hole' if self.holes == 1 else 'holes'}"
        return f"face {self.number}: {self.kind}, {number_text(self.area, 5)} mm2, {self.edges} edges{holes}; {box} mm"

    def distance(self, point: Sequence[float]) -> float:
        """Distance [mm] of the face from a point (3,) [mm]."""
        return float(self.part.call("step_faces.distances", [self.number], [float(x) for x in point])[0])


@dataclass(frozen=True, eq=False)
class Model:
    """A part with its faces; ``solid``: all faces bound solids, so that their normals point out of the metal."""

    file: Path
    faces: tuple[Face, ...]
    solid: bool

    def face(self, name: Name, key: str) -> Face:
        """The face with a name; ``key`` is the job key that names it, for messages.

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
        place = f"{key} = [{', '.join(f'{x:g}' for x in name)}]"
        p = np.asarray(name, dtype=np.float64)
        near = [f for f in self.faces if (p >= f.low - ON).all() and (p <= f.high + ON).all()]
        away = self._away(near, name)
        on = [number for number, d in away.items() if d <= ON]
        if len(on) == 1:
            return self.faces[on[0] - 1]
        if on:
            faces = " and ".join(str(n) for n in on)
            raise InputError(f"{place}: lies on faces {faces}: state a point inside one of them")
        away = self._away(self.faces, name)
        number = min(away, key=lambda n: away[n])
        raise InputError(
            f"{place}: lies {away[number]:.4g} mm from the nearest face, {number}: must be within {ON:g} mm of a face "
            "(mm, in the frame of the file)"
        )

    def _away(self, faces: Sequence[Face], point: Sequence[float]) -> dict[int, float]:
        """Distance [mm] of a point from each face, by number."""
        numbers = [f.number for f in faces]
        found = self.faces[0].part.call("step_faces.distances", numbers, [float(x) for x in point]) if numbers else ()
        return dict(zip(numbers, found, strict=True))

    def lines(self) -> list[str]:
        """A heading and one line of text for each face."""
        return [f"{self.file.name}: {len(self.faces)} faces", *(str(f) for f in self.faces)]


def read_faces(path: str | Path, key: str = "part.file") -> Model:
    """The faces of a STEP part.

    Parameters
    ----------
    key : job key that names the file, for messages

    Raises
    ------
    InputError
        The file is missing or not a STEP file, states no unit of length, or has no faces.
    """
    file = Path(path)
    part = open_step(file, key)
    try:
        rows, solid = part.call("step_faces.list_faces")
    except BaseException:
        part.close()
        raise
    if b"LENGTH_UNIT" not in read_regular(file, f"{key} = {file.name}", LARGEST_FILE):
        raise InputError(f"{key} = {file.name}: states no unit of length: export it again with its unit")
    if not rows:
        raise InputError(f"{key} = {file.name}: no faces in this STEP file")
    return Model(file, tuple(Face(*(*row, part)) for row in rows), solid)


# -- in the process of the CAD kernel ---------------------------------------------------------------------------
@dataclass(frozen=True, eq=False)
class KernelFace:
    """A face in the CAD kernel: its number, the kind of its surface, its number of holes, its shape."""

    number: int
    kind: str
    holes: int
    shape: Any


def kernel_face(part: Part, number: int) -> KernelFace:
    """A face by its number."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.TopAbs import TopAbs_WIRE

    shape = part.faces[number - 1]
    kind = _KINDS.get(BRepAdaptor_Surface(shape).GetType().name, "other surface")
    return KernelFace(number, kind, len(_all(shape, TopAbs_WIRE)) - 1, shape)


def list_faces(part: Part) -> tuple[list[list[Any]], bool]:
    """Number, kind, area, corners of the box, holes and edges of each face; whether all faces bound solids."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID

    out: list[list[Any]] = []
    for k, face in enumerate(part.faces, 1):
        properties, box = GProp_GProps(), Bnd_Box()
        BRepGProp.SurfaceProperties_s(face, properties)
        BRepBndLib.AddOptimal_s(face, box, False, False)
        low, high = (np.array([p.X(), p.Y(), p.Z()]) for p in (box.CornerMin(), box.CornerMax()))
        has = kernel_face(part, k)
        out.append([k, has.kind, float(properties.Mass()), low, high, has.holes, len(_all(face, TopAbs_EDGE))])
    bounding = sum(len(_all(body, TopAbs_FACE)) for body in _all(part.shape, TopAbs_SOLID))
    return out, bounding == len(out)


def distances(part: Part, numbers: list[int], point: list[float]) -> list[float]:
    """Distance [mm] of a point from each face."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt

    vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*point)).Vertex()
    return [float(BRepExtrema_DistShapeShape(vertex, part.faces[n - 1]).Value()) for n in numbers]


def _all(shape: Any, what: Any) -> list[Any]:
    """The subshapes of a kind, in the order of the file."""
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
