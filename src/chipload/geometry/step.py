"""The reader of STEP parts: contours of a planar horizontal face, and triangles of the whole part.

Notation: z [mm] the height of a face whose normal is along Z. Lines and circles are retained, other edges become
biarcs. The CAD kernel converts the file's unit to mm. It runs in a separate process, see
:mod:`chipload.geometry.isolated`: functions whose first parameter is a :class:`Part` are executed there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding, InputError
from chipload.files import is_file, open_regular
from chipload.geometry.contour import Contour, Floats
from chipload.geometry.isolated import Isolated

# biarc and chains are imported where they are used: importing their libraries takes as long as starting the CAD kernel,
# and the process of the kernel seldom needs them
if TYPE_CHECKING:
    from chipload.geometry.chains import Drawing

#: greatest angle of the normal of a horizontal plane from Z [rad]; also the distance of coincident ends [mm]
LEVEL = 1e-6
#: largest file that is read [bytes]
LARGEST_FILE = 200_000_000


def read_step_face(
    path: str | Path, *, z_mm: float | None = None, join_mm: float = 0.001, tolerance_mm: float = 0.001
) -> Drawing:
    """Contours of the horizontal planar faces at one height of a STEP part.

    Parameters
    ----------
    path : the STEP file
    z_mm : height [mm] of the face, to 0.001 mm; the topmost horizontal face by default
    join_mm : widest gap [mm] between edges that is closed
    tolerance_mm : greatest deviation [mm] of the arcs from an edge that is neither line nor circle

    Returns
    -------
    Drawing in mm; the layer of each contour is its height, such as ``z=12.5``.

    Raises
    ------
    InputError
        The file is missing or not a STEP file, or has no horizontal planar face (at ``z_mm``); the message lists the
        heights.
    """
    return read_step_level(path, z_mm=z_mm, join_mm=join_mm, tolerance_mm=tolerance_mm).drawing


@dataclass(frozen=True, eq=False)
class StepLevel:
    """The drawing of the horizontal faces at one height of a part, that height, and that of the top [mm]."""

    drawing: Drawing
    level: float
    top: float


def read_step_level(
    path: str | Path, *, z_mm: float | None = None, join_mm: float = 0.001, tolerance_mm: float = 0.001
) -> StepLevel:
    """As :func:`read_step_face`, with the heights of the face and of the top of the part."""
    file = Path(path)
    if z_mm is not None and not np.isfinite(z_mm):
        raise InputError(f"part.z_mm = {z_mm:g}: must be a finite number")
    with open_step(file, "part.file") as part:
        found: list[float] = part.call("step.levels")
        if not found:
            raise InputError(f"part.file = {file.name}: no horizontal planar face in the part: turn it, or state a DXF")
        heights = sorted({round(z, 3) + 0.0 for z in found})
        level = max(found) if z_mm is None else z_mm
        chosen: list[list[Floats]] = part.call("step.edges_at", level, tolerance_mm)
        top: float = part.call("step.highest")
    if not chosen:
        named = ", ".join(f"{z:g}" for z in heights)
        raise InputError(f"part.z_mm = {level:g}: no horizontal planar face at this height; faces are at {named} mm")
    from chipload.geometry.chains import Drawing, chain_parts

    findings: list[Finding] = []
    contours: list[Contour] = []
    for edges in chosen:
        made, seen = chain_parts(edges, join_mm, f"face at z = {level:g}: ")
        contours += made
        findings += seen
    if z_mm is None and len(heights) > 1:
        named = ", ".join(f"{z:g}" for z in heights)
        findings.append(Finding("step-topmost", 0, f"the topmost face, z = {level:g}, of those at {named} mm is read"))
    drawing = Drawing(tuple(contours), (f"z={level:g}",) * len(contours), "mm", tuple(findings))
    return StepLevel(drawing, level, top)


def step_triangles(
    path: str | Path, chord_mm: float, angle: float = 0.5, key: str = "part.file"
) -> tuple[Floats, NDArray[np.int64]]:
    """Triangles of a STEP part, face by face, seen counter-clockwise from outside.

    Parameters
    ----------
    chord_mm : greatest deviation [mm] of a triangle from its surface
    angle : greatest turn [rad] of the surface from one vertex to the next
    key : job key that names the file, for messages

    Returns
    -------
    (n, 3) vertices [mm] and (m, 3) vertex numbers of the triangles; a vertex on an edge of the part occurs once for
    each adjacent face.

    Raises
    ------
    InputError
        The file is missing or not a STEP file, or has no faces.
    """
    with open_step(Path(path), key) as part:
        points, corners = part.call("step.triangles", chord_mm, angle)
    if not len(corners):
        raise InputError(f"{key} = {Path(path).name}: no faces in this STEP file")
    return points, corners


def open_step(file: Path, key: str = "part.file") -> Isolated:
    """A STEP file in a separate process of the CAD kernel, which reads it at the first call.

    Raises
    ------
    InputError
        The file is missing, too large or not a STEP file.
    """
    if not is_file(file):
        raise InputError(f"{key} = {file}: no such file")
    with open_regular(file, f"{key} = {file.name}", LARGEST_FILE, "export the part alone") as stream:
        if b"ISO-10303-21" not in stream.read(4096):
            raise InputError(f"{key} = {file.name}: not a STEP file")
    return Isolated(file, key, "step.read_part")


# -- in the process of the CAD kernel ---------------------------------------------------------------------------
class Part:
    """A shape of the CAD kernel, in mm, and its faces in the order of the file."""

    def __init__(self, shape: Any) -> None:
        from OCP.TopAbs import TopAbs_FACE
        from OCP.TopExp import TopExp_Explorer
        from OCP.TopoDS import TopoDS

        self.shape, self.faces = shape, list[Any]()
        explorer = TopExp_Explorer(shape, TopAbs_FACE)
        while explorer.More():
            self.faces.append(TopoDS.Face(explorer.Current()))
            explorer.Next()


def read_part(path: str, key: str) -> Part:
    """The part of a file.

    Raises
    ------
    InputError
        The kernel cannot read it.
    """
    import OCP.IFSelect
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_Reader

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    reader = STEPControl_Reader()
    if reader.ReadFile(path) != OCP.IFSelect.IFSelect_RetDone or reader.TransferRoots() == 0:
        raise InputError(f"{key} = {Path(path).name}: the CAD kernel cannot read this STEP file")
    return Part(reader.OneShape())


def triangles(part: Part, chord_mm: float, angle: float) -> tuple[Floats, NDArray[np.int64]]:
    """As :func:`step_triangles`; empty arrays if no face has triangles."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_REVERSED
    from OCP.TopLoc import TopLoc_Location

    BRepMesh_IncrementalMesh(part.shape, chord_mm, False, angle, False)
    points: list[Floats] = []
    corners: list[NDArray[np.int64]] = []
    count = 0
    for face in part.faces:
        place = TopLoc_Location()
        made = BRep_Tool.Triangulation_s(face, place)
        if made is None:
            continue
        move = place.Transformation()
        nodes = [made.Node(i).Transformed(move) for i in range(1, made.NbNodes() + 1)]
        numbers = np.array([made.Triangle(i).Get() for i in range(1, made.NbTriangles() + 1)], dtype=np.int64)
        points.append(np.array([(p.X(), p.Y(), p.Z()) for p in nodes]))
        corners.append(count - 1 + (numbers[:, ::-1] if face.Orientation() == TopAbs_REVERSED else numbers))
        count += len(nodes)
    if not points:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    return np.vstack(points), np.vstack(corners)


def levels(part: Part) -> list[float]:
    """Height [mm] of every horizontal planar face."""
    return [z for z, _, _ in _level_faces(part)]


def highest(part: Part) -> float:
    """Greatest height [mm] of a part."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(part.shape, box, False, False)
    return float(box.CornerMax().Z())


def edges_at(part: Part, level: float, tolerance_mm: float) -> list[list[Floats]]:
    """(n, 7) segments [mm] of each edge of each horizontal face at a height that looks up.

    Where none looks up: of those that look down, such as the underside of a part.
    """
    faces = [(up, face) for z, up, face in _level_faces(part) if abs(z - level) <= 1e-3]
    any_up = any(up for up, _ in faces)
    return [list(_edges(face, tolerance_mm)) for up, face in faces if up == any_up]


def _level_faces(part: Part) -> Iterator[tuple[float, bool, Any]]:
    """Height [mm] of every horizontal plane, whether the material is below it, and its face."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_Plane
    from OCP.TopAbs import TopAbs_REVERSED

    for face in part.faces:
        surface = BRepAdaptor_Surface(face)
        if surface.GetType() == GeomAbs_Plane:
            plane = surface.Plane()
            axis = plane.Axis().Direction()
            if np.hypot(axis.X(), axis.Y()) < LEVEL:
                up = (axis.Z() > 0.0) == plane.Direct()
                yield float(plane.Location().Z()), up != (face.Orientation() == TopAbs_REVERSED), face


def _edges(face: Any, tolerance_mm: float) -> Iterator[Floats]:
    """(n, 7) segments [mm] of each edge of a face, in the sense of its wire."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    explorer = TopExp_Explorer(face, TopAbs_EDGE)
    while explorer.More():
        edge = TopoDS.Edge(explorer.Current())
        explorer.Next()
        if BRep_Tool.Degenerated_s(edge):
            continue
        curve = BRepAdaptor_Curve(edge)
        a, b = float(curve.FirstParameter()), float(curve.LastParameter())
        p, q = curve.Value(a), curve.Value(b)
        if curve.GetType() == GeomAbs_Line:
            rows = np.array([[p.X(), p.Y(), q.X(), q.Y(), 0.0, 0.0, 0.0]])
        elif curve.GetType() == GeomAbs_Circle:
            circle = curve.Circle()
            centre, side = circle.Location(), np.sign(circle.Axis().Direction().Z())
            rows = np.array([[p.X(), p.Y(), q.X(), q.Y(), centre.X(), centre.Y(), side * (b - a)]])
        else:
            from chipload.geometry.biarc import arcs_along

            def place_along(t: float, on: Any = curve) -> tuple[Floats, Floats]:
                point, slope = gp_Pnt(), gp_Vec()
                on.D1(t, point, slope)
                return np.array([point.X(), point.Y()]), np.array([slope.X(), slope.Y()])

            made = arcs_along(place_along, np.linspace(a, b, 5), tolerance_mm)
            if made is None:
                continue
            rows = np.array(made.segments)
            if np.hypot(p.X() - q.X(), p.Y() - q.Y()) < LEVEL:
                rows[-1, 2:4] = rows[0, 0:2]
        if edge.Orientation() == TopAbs_REVERSED:
            rows = rows[::-1]
            rows = np.column_stack([rows[:, 2:4], rows[:, 0:2], rows[:, 4:6], -rows[:, 6]])
        yield rows
