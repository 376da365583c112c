"""Faces of STEP files: named, taken as patches, taken as meridians; the oracles are the surfaces that were written."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from chipload.geometry.bspline import BSplinePatch, patch_through
from chipload.geometry.revolve import Revolved
from chipload.geometry.step_faces import read_faces
from chipload.geometry.step_meridian import meridian_of
from chipload.geometry.step_patch import patch_of
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from step_files import face, surface, turned, written

IMPELLER = impeller_of(ImpellerShape())
U, V = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 21), indexing="ij"))


@pytest.fixture(scope="module", params=["MM", "INCH", "M"])
def model(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("step") / "impeller.step"
    blade = IMPELLER.blade
    written(
        path, face(blade.plus), face(blade.minus), turned(IMPELLER.hub), turned(IMPELLER.shroud), unit=request.param
    )
    return read_faces(path)


def test_faces_are_listed(model):
    assert [f.number for f in model.faces] == [1, 2, 3, 4]
    assert str(model.faces[2]) == (
        "face 3: of revolution, 13060 mm2, 4 edges; x -46.4004 to 111.5, y 0 to 111.5, z 0 to 50 mm"
    )
    # Pappus: length of the meridian times the way of its middle through 2 rad
    m = IMPELLER.hub.curve(np.linspace(0.0, 1.0, 20001))
    way = np.linalg.norm(np.diff(m, axis=0), axis=1)
    assert model.faces[2].area == pytest.approx(2.0 * (way * 0.5 * (m[1:, 0] + m[:-1, 0])).sum(), rel=1e-6)


def test_a_face_by_a_point_on_it(model):
    blade = IMPELLER.blade
    assert model.face(tuple(blade.plus.at(0.3, 0.4)[0]), "plus").number == 1
    assert model.face(tuple(blade.minus.at(0.3, 0.4)[0]), "minus").number == 2
    x, y, z = blade.minus.at(0.3, 0.4)[0] + 0.009 * blade.minus.normal(0.3, 0.4)[0]
    assert model.face((x, y, z), "minus").number == 2


def test_surfaces_come_back(model):
    for number, side in enumerate((IMPELLER.blade.plus, IMPELLER.blade.minus)):
        taken = patch_of(model.faces[number], "side", 1e-3)
        assert taken.kept
        assert taken.off < 1e-9
        assert np.abs(taken.patch.at(U, V) - side.at(U, V)).max() < 1e-9
        for order in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2)):
            assert np.abs(taken.patch.at(U, V, *order) - side.at(U, V, *order)).max() < 1e-5


def test_meridians_come_back(model):
    for number, given in ((2, IMPELLER.hub), (3, IMPELLER.shroud)):
        m = meridian_of([model.faces[number]], np.eye(3), "hub")
        assert np.linalg.norm(m[0] - given.curve([0.0])[0]) < 1e-9
        assert np.linalg.norm(m[-1] - given.curve([1.0])[0]) < 1e-9
        p = Revolved(m, 1).curve(np.linspace(0.0, 1.0, 1001))
        s = np.linspace(0.0, 1.0, 100001)
        at, along = given.curve(s), given.curve(s, 1)
        _, k = cKDTree(at).query(p)
        d = p - at[k]
        across = (d[:, 0] * along[k, 1] - d[:, 1] * along[k, 0]) / np.linalg.norm(along[k], axis=1)
        assert np.abs(across).max() < 1e-6


def cut(shape, low, high):
    """The faces of a shape within a box."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    return BRepAlgoAPI_Common(shape, BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()).Shape()


def test_a_trim_across_parameter_lines_is_fitted(tmp_path):
    """A blade side cut by four planes: every point lies on the surface that was cut (as the kernel projects), corners
    are those of the box."""
    from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
    from OCP.gp import gp_Pnt

    side = IMPELLER.blade.plus
    low, high = (72.0, -60.0, 14.0), (84.0, 60.0, 28.0)
    model = read_faces(written(tmp_path / "cut.step", cut(face(side), low, high)))
    assert len(model.faces) == 1
    taken = patch_of(model.faces[0], "side", 1e-3)
    assert not taken.kept
    whole = surface(side)
    p = taken.patch.at(U, V)
    away = [GeomAPI_ProjectPointOnSurf(gp_Pnt(*q), whole).LowerDistance() for q in p.tolist()]
    assert max(away) <= taken.off <= 1e-3
    assert np.abs(p[:, [0, 2]].min(axis=0) - [72.0, 14.0]).max() < 1e-3
    assert np.abs(p[:, [0, 2]].max(axis=0) - [84.0, 28.0]).max() < 1e-3
    corners = {(round(x, 3), round(z, 3)) for x, _, z in taken.patch.at([0, 0, 1, 1], [0, 1, 0, 1])}
    assert corners == {(72.0, 14.0), (72.0, 28.0), (84.0, 14.0), (84.0, 28.0)}
    fine = patch_of(model.faces[0], "side", 1e-6)
    assert fine.off <= 1e-6
    assert fine.patch.control.shape[0] > taken.patch.control.shape[0]


def test_a_side_of_several_edges(tmp_path):
    """A plate whose lower edge is in two pieces, next to a smaller box that shares it."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.gp import gp_Pnt

    polygon = BRepBuilderAPI_MakePolygon()
    for x, z in ((0, 0), (7, 0), (20, 0), (22, 10), (1, 12)):
        polygon.Add(gp_Pnt(x, 3, z))
    polygon.Close()
    model = read_faces(written(tmp_path / "plate.step", BRepBuilderAPI_MakeFace(polygon.Wire()).Face()))
    taken = patch_of(model.faces[0], "pocket", 1e-6)
    p = taken.patch.at([0, 0, 1, 1, 0.5], [0, 1, 0, 1, 0.5])
    assert {(round(x, 9), round(y, 9), round(z, 9)) for x, y, z in p[:4]} == {
        (0, 3, 0),
        (20, 3, 0),
        (22, 3, 10),
        (1, 3, 12),
    }
    assert p[4] == pytest.approx(np.mean([(0, 3, 0), (20, 3, 0), (22, 3, 10), (1, 3, 12)], axis=0))


def test_uneven_parameters_are_put_over_lengths(tmp_path):
    """A cylinder of radius 20 whose lines crowd as u^3: after that its points are even and still on the cylinder."""
    u = np.linspace(0.0, 1.0, 33)
    angle = 0.1 * u + 1.3 * u**3
    grid = np.stack([20.0 * np.cos(angle), 20.0 * np.sin(angle), 0.0 * u], axis=-1)[:, None] + np.array(
        [[0.0, 0.0, 0.0], [0.0, 0.0, 8.0]]
    )
    uneven = patch_through(grid, u, [0.0, 1.0])
    gap = np.linalg.norm(np.diff(uneven.at(np.linspace(0, 1, 41), 0.5), axis=0), axis=1)
    assert gap.max() > 10.0 * gap.min()
    model = read_faces(written(tmp_path / "uneven.step", face(uneven), face(BSplinePatch(uneven.knots_v, uneven.knots_u,
                       np.swapaxes(uneven.control, 0, 1)))))  # fmt: skip
    for k, (a, b) in enumerate(((np.linspace(0, 1, 41), np.full(41, 0.5)), (np.full(41, 0.5), np.linspace(0, 1, 41)))):
        taken = patch_of(model.faces[k], "side", 1e-4)
        assert not taken.kept
        p = taken.patch.at(a, b)
        gap = np.linalg.norm(np.diff(p, axis=0), axis=1)
        assert gap.max() < 1.01 * gap.min()
        assert np.abs(np.hypot(p[:, 0], p[:, 1]) - 20.0).max() < 1e-4
        assert p[[0, -1]] == pytest.approx(uneven.at([0.0, 1.0], 0.5), abs=1e-9)


@pytest.fixture(scope="module", params=[1, -1])
def shaft(request, tmp_path_factory):
    """A cylinder of radius 10, a round of radius 10 and a flat disc: faces in the order disc, cylinder, round."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    a = np.linspace(0.0, 0.5 * math.pi, 201)
    quarter = Revolved(np.stack([20.0 - 10.0 * np.cos(a), 15.0 - 10.0 * np.sin(a)], axis=-1)[:: request.param], 1)
    outer, inner = (
        BRepBuilderAPI_MakeWire(
            BRepBuilderAPI_MakeEdge(gp_Circ(gp_Ax2(gp_Pnt(0, 0, 5), gp_Dir(0, 0, 1)), r)).Edge()
        ).Wire()
        for r in (40.0, 20.0)
    )
    disc = BRepBuilderAPI_MakeFace(outer)
    disc.Add(TopoDS.Wire(inner.Reversed()))
    cylinder = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 15), gp_Dir(0, 0, 1)), 10.0, 15.0).Shape()
    side = TopExp_Explorer(cylinder, TopAbs_FACE).Current()
    path = tmp_path_factory.mktemp("shaft") / "shaft.step"
    return read_faces(written(path, disc.Face(), side, turned(quarter, 2.0 * math.pi)))


def test_faces_of_a_hub_are_joined(shaft):
    assert [f.kind for f in shaft.faces] == ["plane", "cylinder", "of revolution"]
    m = meridian_of(shaft.faces, np.eye(3), "hub")
    assert m[0] == pytest.approx([10.0, 30.0])
    assert m[-1] == pytest.approx([40.0, 5.0])
    assert (np.diff(m[:, 0]) >= -1e-9).all()
    assert (np.diff(m[:, 1]) <= 1e-9).all()
    high, flat = m[:, 1] >= 15.0, m[:, 0] >= 20.0
    assert np.abs(m[high, 0] - 10.0).max() < 1e-9
    assert np.abs(m[flat, 1] - 5.0).max() < 1e-9
    rest = m[~high & ~flat]
    assert np.abs(np.hypot(rest[:, 0] - 20.0, rest[:, 1] - 15.0) - 10.0).max() < 1e-6
