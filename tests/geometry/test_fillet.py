"""Fillets between side and hub: closed forms of planes and cylinders, a CAD kernel's fillet, and the ball itself."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch, patch_through
from chipload.geometry.fillet import FIT, add_fillet, from_hub
from chipload.geometry.revolve import Revolved
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of

PLANE = Revolved(np.array([[10.0, 0.0], [100.0, 0.0]]), 1)
SHAFT = Revolved(np.array([[30.0, 80.0], [30.0, -10.0]]), 1)
U, V = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 31), np.linspace(0, 1, 17), indexing="ij"))


def wall(lean: float) -> BSplinePatch:
    """A plane through the line y = 0 on the plane hub, its normal towards -y, leaning by an angle over it."""
    top = 30.0 * np.array([0.0, -math.sin(lean), math.cos(lean)])
    low = np.array([[20.0, 0.0, 0.0], [80.0, 0.0, 0.0]])
    grid = np.stack([low, low + top], axis=1)
    return patch_through(grid, [0.0, 1.0], [0.0, 1.0])


@pytest.mark.parametrize("lean", [-0.5, 0.0, 0.4])
@pytest.mark.parametrize("radius", [1.0, 3.0, 8.0])
def test_planes(lean, radius):
    """A part of a cylinder: its axis a from both; the ball touches a / tan(half the corner) above the corner."""
    corner = 0.5 * math.pi - lean
    height = radius / math.tan(0.5 * corner)
    found = add_fillet(wall(lean), PLANE, radius)
    assert found.height == pytest.approx(height, rel=1e-9)
    p = found.fillet.at(U, V)
    middle = np.array([-height, radius])
    assert np.abs(np.linalg.norm(p[:, 1:] - middle, axis=1) - radius).max() < 2e-7 * radius
    assert np.abs(found.fillet.at(U, 0.0)[:, 1:] - [-height, 0.0]).max() < 1e-9
    top = height * np.array([-math.sin(lean), math.cos(lean)])
    assert np.abs(found.fillet.at(U, 1.0)[:, 1:] - top).max() < 1e-9
    assert np.abs(found.side.at(U, 0.0)[:, 1:] - top).max() < 1e-9
    towards = middle - p[:, 1:]
    n = found.fillet.normal(U, V)
    assert ((n[:, 1:] * towards).sum(axis=1) / radius).min() > 0.999
    # tangent to both
    assert found.fillet.normal(U, 0.0) == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(U), 1)), abs=5e-5)
    assert found.fillet.normal(U, 1.0) == pytest.approx(wall(lean).normal(U, 1.0), abs=5e-5)
    assert found.fillet.principal(U, V)[:, 1] == pytest.approx(1.0 / radius, rel=5e-4)


def fin() -> BSplinePatch:
    """The side y = 1 of a fin that stands on a shaft of radius 30, up to radius 50."""
    z, r = np.linspace(0.0, 60.0, 5), np.linspace(30.0, 50.0, 9)
    x = np.sqrt(r**2 - 1.0)
    grid = np.stack(np.broadcast_arrays(x[None, :], 1.0, z[:, None]), axis=-1)
    patch = patch_through(grid, z / 60.0, (r - 30.0) / 20.0)
    return patch if patch.normal(0.5, 0.5)[0][1] > 0.0 else patch.reversed(True, False)


def test_a_fin_on_a_shaft():
    """Centre at y = 1 + a, 30 + a from the axis: a line; the ball touches the shaft under it."""
    a = 4.0
    found = add_fillet(fin(), SHAFT, a)
    x = math.sqrt((30.0 + a) ** 2 - (1.0 + a) ** 2)
    p = found.fillet.at(U, V)
    assert np.abs(np.hypot(p[:, 0] - x, p[:, 1] - 1.0 - a) - a).max() < FIT
    low, high = found.fillet.at(U, 0.0), found.fillet.at(U, 1.0)
    assert np.abs(low[:, :2] - 30.0 / (30.0 + a) * np.array([x, 1.0 + a])).max() < 1e-6
    assert np.abs(high[:, :2] - [x, 1.0]).max() < 1e-6


def test_the_fillet_of_another_program():
    """The CAD kernel's own fillet of the fin fused with the shaft."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    shaft = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 30.0, 60.0).Shape()
    box = BRepPrimAPI_MakeBox(gp_Pnt(20, -1, 0), gp_Pnt(50, 1, 60)).Shape()
    whole = BRepAlgoAPI_Fuse(shaft, box).Shape()
    maker = BRepFilletAPI_MakeFillet(whole)
    explorer, count = TopExp_Explorer(whole, TopAbs_EDGE), 0
    while explorer.More():
        edge = TopoDS.Edge(explorer.Current())
        explorer.Next()
        if BRep_Tool.Degenerated_s(edge):
            continue
        curve = BRepAdaptor_Curve(edge)
        ends = [curve.Value(t) for t in (curve.FirstParameter(), curve.LastParameter())]
        along = all(abs(p.Y() - 1.0) < 1e-6 and abs(math.hypot(p.X(), p.Y()) - 30.0) < 1e-6 for p in ends)
        if along and abs(ends[0].Z() - ends[1].Z()) > 50.0 and count == 0:
            maker.Add(4.0, edge)
            count += 1
    assert count == 1
    solid = maker.Shape()
    found = add_fillet(fin(), SHAFT, 4.0)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.1, 0.9, 4), np.linspace(0.05, 0.95, 7), indexing="ij"))
    shell = TopExp_Explorer(solid, TopExp_kind()).Current()
    for p in found.fillet.at(u, v).tolist():
        vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*p)).Vertex()
        assert BRepExtrema_DistShapeShape(vertex, shell).Value() < FIT


def TopExp_kind():
    from OCP.TopAbs import TopAbs_SHELL

    return TopAbs_SHELL


@pytest.mark.parametrize("key", ["plus", "minus"])
def test_a_ball_on_a_twisted_blade(key):
    """Dense points of side and hub: the ball comes to both within a hair and goes into neither."""
    impeller, a = impeller_of(ImpellerShape(lean=0.15)), 3.0
    side = getattr(impeller.blade, key)
    found = add_fillet(side, impeller.hub, a)
    u = np.linspace(0.02, 0.98, 25)
    high, low = found.fillet.at(u, 1.0), found.fillet.at(u, 0.0)
    C = high + a * found.fillet.normal(u, 1.0)
    assert np.abs(np.linalg.norm(C - low, axis=1) - a).max() < FIT
    w = np.linspace(0.1, 0.9, 9)
    p = found.fillet.at(np.repeat(u, 9), np.tile(w, 25)).reshape(25, 9, 3)
    assert np.abs(np.linalg.norm(p - C[:, None], axis=2) - a).max() < FIT
    x, y = np.linspace(0, 1, 1201), np.linspace(0, 0.4, 301)
    blade = side.at(np.repeat(x, 301), np.tile(y, 1201))
    at = np.arctan2(C[:, 1], C[:, 0])
    s, theta = np.linspace(0, 1, 1201), np.linspace(at.min() - 0.1, at.max() + 0.1, 1201)
    hub = impeller.hub.at(np.repeat(s, 1201), np.tile(theta, 1201))
    for points in (blade, hub):
        d = cKDTree(points).query(C)[0]
        assert d.min() > a - 2e-3
        assert d.max() < a + 2e-2


def test_above_its_fillet_the_side_is_the_same():
    side = impeller_of(ImpellerShape()).blade.plus
    found = add_fillet(side, impeller_of(ImpellerShape()).hub, 3.0)
    p, n = found.side.at(U, V), found.side.normal(U, V)
    x, y = np.linspace(0, 1, 801), np.linspace(0, 1, 401)
    grid = side.at(np.repeat(x, 401), np.tile(y, 801))
    k = cKDTree(grid).query(p)[1]
    assert np.abs(((p - grid[k]) * n).sum(axis=1)).max() < FIT
    assert found.side.at(U, 1.0) == pytest.approx(side.at(U, 1.0), abs=FIT)


def test_distance_from_a_hub():
    p = np.array([[20.0, 5.0, 3.0], [0.0, 60.0, -2.0], [31.0, 0.0, 40.0]])
    d, n = from_hub(PLANE, p)
    assert d == pytest.approx(p[:, 2])
    assert n == pytest.approx(np.tile([0.0, 0.0, 1.0], (3, 1)))
    d, n = from_hub(SHAFT, p)
    assert d == pytest.approx(np.hypot(p[:, 0], p[:, 1]) - 30.0)


def test_refused():
    with pytest.raises(InputError, match=r"^a fillet of 40 mm reaches above the side at u = 0$"):
        add_fillet(wall(0.0), PLANE, 40.0)
    with pytest.raises(InputError, match=r"^no fillet of 1 mm fits between side and hub at u = 0: "):
        add_fillet(patch_through([[[20, 0, 1], [20, 0, 9]], [[80, 0, 1], [80, 0, 9]]], [0, 1], [0, 1]), PLANE, 1.0)
