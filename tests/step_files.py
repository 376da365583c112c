"""STEP files for the tests, written by the CAD kernel from our own surfaces."""

from pathlib import Path

import numpy as np

from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.revolve import Revolved


def surface(patch: BSplinePatch):
    """The kernel's surface with the poles and knots of a patch."""
    from OCP.collections import Array1_double, Array1_int, Array2_gp_Pnt
    from OCP.Geom import Geom_BSplineSurface
    from OCP.gp import gp_Pnt

    n, m = patch.control.shape[:2]
    poles = Array2_gp_Pnt(1, n, 1, m)
    for i in range(n):
        for j in range(m):
            poles.SetValue(i + 1, j + 1, gp_Pnt(*patch.control[i, j].tolist()))
    arrays = []
    for knots in (patch.knots_u, patch.knots_v):
        x, count = np.unique(knots, return_counts=True)
        values, mults = Array1_double(1, len(x)), Array1_int(1, len(x))
        for k in range(len(x)):
            values.SetValue(k + 1, float(x[k]))
            mults.SetValue(k + 1, int(count[k]))
        arrays.append((values, mults))
    (ku, mu), (kv, mv) = arrays
    return Geom_BSplineSurface(poles, ku, kv, mu, mv, *patch.degrees)


def face(patch: BSplinePatch):
    """The whole patch as a face."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

    return BRepBuilderAPI_MakeFace(surface(patch), 1e-7).Face()


def turned(revolved: Revolved, angle: float = 2.0, first: float = 0.0, last: float = 1.0):
    """A surface of revolution as a face, from ``first`` to ``last`` along its meridian."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_int
    from OCP.Geom import Geom_BSplineCurve
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer

    b = revolved._curve
    poles = Array1_gp_Pnt(1, len(b.c))
    for k, (r, z) in enumerate(b.c.tolist(), 1):
        poles.SetValue(k, gp_Pnt(r, 0.0, z))
    x, count = np.unique(b.t, return_counts=True)
    values, mults = Array1_double(1, len(x)), Array1_int(1, len(x))
    for k in range(len(x)):
        values.SetValue(k + 1, float(x[k]))
        mults.SetValue(k + 1, int(count[k]))
    edge = BRepBuilderAPI_MakeEdge(Geom_BSplineCurve(poles, values, mults, b.k), first, last).Edge()
    axis = gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))
    return TopExp_Explorer(BRepPrimAPI_MakeRevol(edge, axis, angle).Shape(), TopAbs_FACE).Current()


def written(path: Path, *shapes, unit: str = "MM", rotation=None) -> Path:
    """A STEP file of shapes in their order."""
    import OCP.IFSelect
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Trsf
    from OCP.Interface import Interface_Static
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TopoDS import TopoDS_Compound

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    whole, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    if rotation is not None:
        move = gp_Trsf()
        R = np.asarray(rotation, dtype=float)
        move.SetValues(*[x for row in R.tolist() for x in (*row, 0.0)])
        whole = BRepBuilderAPI_Transform(whole, move, True).Shape()
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(whole, STEPControl_AsIs)
    assert writer.Write(str(path)) == OCP.IFSelect.IFSelect_RetDone
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    return path


def moved(file: Path, degrees: float, away: tuple[float, float]) -> None:
    """Turn the part of a STEP file about z and move it in x and y [mm]; the file is written again."""
    import math

    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(file))
    reader.TransferRoots()
    turn, shift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), math.radians(degrees))
    shift.SetTranslation(gp_Vec(*away, 0.0))
    written(file, BRepBuilderAPI_Transform(reader.OneShape(), shift.Multiplied(turn), True).Shape())
