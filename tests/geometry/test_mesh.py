"""Meshes from files and their sections, against solids of known size."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
import shapely
import trimesh

from chipload.errors import InputError
from chipload.geometry.mesh import open_edges, read_mesh, sections


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    """A rod of radius 20 and height 10 about (3, 4) as a STEP part."""
    import OCP.IFSelect
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    writer = STEPControl_Writer()
    shape = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(3, 4, 0), gp_Dir(0, 0, 1)), 20.0, 10.0).Shape()
    writer.Transfer(shape, STEPControl_AsIs)
    path = tmp_path_factory.mktemp("step") / "rod.step"
    assert writer.Write(str(path)) == OCP.IFSelect.IFSelect_RetDone
    return path


@pytest.mark.parametrize("chord", [0.5, 0.05, 0.005])
def test_a_rod_of_step_is_within_its_chord(rod, chord):
    mesh = read_mesh(rod, chord_mm=chord)
    assert open_edges(mesh) == 0
    ring = np.asarray(sections(mesh, [5.0])[0].geoms[0].exterior.coords) - (3.0, 4.0)
    middles = np.hypot(*(0.5 * (ring[1:] + ring[:-1])).T)
    assert np.hypot(*ring.T) == pytest.approx(20.0, abs=1e-6 + chord)
    assert middles.min() >= 20.0 - chord
    assert math.pi * (20.0 - chord) ** 2 * 10.0 <= mesh.volume <= math.pi * 4000.0


def ball(radius: float, rings: int) -> trimesh.Trimesh:
    return trimesh.creation.uv_sphere(radius, (rings, 2 * rings))


def test_stl_in_inches_is_in_mm(tmp_path):
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "box.stl")
    mesh = read_mesh(tmp_path / "box.stl", unit="inch")
    assert mesh.extents.tolist() == pytest.approx([25.4, 50.8, 76.2], rel=1e-7)
    assert mesh.volume == pytest.approx(6.0 * 25.4**3, rel=1e-6)
    (tmp_path / "text.STL").write_bytes(trimesh.creation.box((1.0, 2.0, 3.0)).export(file_type="stl_ascii").encode())
    assert read_mesh(tmp_path / "text.STL", unit="mm").volume == pytest.approx(6.0, rel=1e-6)


def test_a_mesh_inside_out_is_turned(tmp_path):
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    box.invert()
    box.export(tmp_path / "box.stl")
    assert read_mesh(tmp_path / "box.stl", unit="mm").volume == pytest.approx(6.0, rel=1e-6)


def test_sections_of_a_torus_are_rings():
    major, minor, n = 10.0, 3.0, 400
    torus = trimesh.creation.torus(major, minor, n, n)
    for h, section in zip((-2.0, 0.3, 1.5), sections(torus, (-2.0, 0.3, 1.5)), strict=True):
        w = math.sqrt(minor**2 - h**2)
        assert section.area == pytest.approx(4.0 * math.pi * major * w, rel=3e-4)
        assert [len(p.interiors) for p in section.geoms] == [1]
    assert sections(torus, [3.1])[0].is_empty


def test_planes_through_vertices_and_faces():
    box = trimesh.creation.box((2.0, 2.0, 2.0)).subdivide().subdivide()
    low, at, mid, top, over = sections(box, [-1.0, -0.5, 0.0, 1.0, 1.0 + 1e-12])
    assert [s.area for s in (at, mid, top)] == pytest.approx([4.0] * 3, rel=1e-14)
    assert low.is_empty
    assert over.is_empty


@pytest.mark.parametrize("turn", np.linspace(0.0, 6.0, 7))
def test_a_ring_that_crosses_itself_keeps_its_solid(turn):
    """The tail of a fish is inside out, and is where a ring is told by its outermost corner."""
    fish = np.array([(0.0, 0.0), (5.0, -3.0), (9.0, 0.0), (5.0, 3.0), (0.0, 0.0), (-2.0, -1.0), (-2.0, 1.0)])
    fish[4] += 0.1
    c, s = math.cos(turn), math.sin(turn)
    p = fish @ np.array([[c, s], [-s, c]])
    n = len(p)
    vertices = np.vstack([np.column_stack([p, np.full(n, z)]) for z in (0.0, 1.0)])
    walls = [f for i in range(n) for j in [(i + 1) % n] for f in ((i, j, j + n), (i, j + n, i + n))]
    (section,) = sections(trimesh.Trimesh(vertices, walls, process=False), [0.5])
    assert 24.0 < section.area < 33.0


def test_bodies_that_share_an_edge_are_closed():
    one, two = trimesh.creation.box((2.0, 2.0, 2.0)), trimesh.creation.box((2.0, 2.0, 2.0))
    two.apply_translation((2.0, 2.0, 0.0))
    whole = trimesh.util.concatenate([one, two])
    whole.merge_vertices()
    assert len(whole.vertices) == 14
    assert open_edges(whole) == 0
    (section,) = sections(whole, [0.25])
    assert section.area == pytest.approx(8.0, rel=1e-14)


def test_bodies_in_bodies():
    """A shell with a core in its hollow, and a body that overlaps the shell from the side."""
    hollow = trimesh.creation.box((6.0, 6.0, 6.0))
    hollow.invert()
    core, side = trimesh.creation.box((2.0, 2.0, 2.0)), trimesh.creation.box((4.0, 1.0, 9.0))
    side.apply_translation((6.0, 0.0, 0.0))
    whole = trimesh.util.concatenate([side, core, hollow, trimesh.creation.box((10.0, 10.0, 10.0))])
    (section,) = sections(whole, [0.2])
    assert section.area == pytest.approx(100.0 - 36.0 + 4.0 + 3.0, rel=1e-14)
    assert len(section.geoms) == 2


def test_a_random_body_is_cut_as_brute_force_says():
    rng = np.random.default_rng(3)
    body = ball(5.0, 12)
    body.vertices = np.round(body.vertices + rng.normal(0.0, 0.15, body.vertices.shape), 1)
    for h in (-3.0, -0.5, 0.0, 0.7, 2.2):
        (section,) = sections(body, [h])
        xy = rng.uniform(-6.0, 6.0, (300, 2))
        p = np.column_stack([xy, np.full(300, h - 1e-9)])
        a, b, c = (body.triangles[:, i][None] - p[:, None] for i in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
        det = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
        dots = [np.einsum("ijk,ijk->ij", u, v) for u, v in ((a, b), (b, c), (c, a))]
        solid = 2.0 * np.arctan2(det, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
        inside = np.round(solid.sum(axis=1) / (4.0 * math.pi)) > 0.5
        near = shapely.distance(section.boundary, shapely.points(xy)) < 1e-6
        assert (shapely.contains_xy(section, *xy.T) == inside)[~near].all()


@pytest.mark.parametrize(
    ("name", "data", "options", "message"),
    [
        ("none.stl", None, {"unit": "mm"}, "no such file"),
        ("a.stl", b"solid", {}, "STL has no unit: state unit as one of um, mm, cm, m, inch, foot"),
        ("a.stl", b"solid", {"unit": "furlong"}, "STL has no unit"),
        ("a.stl", b"solid\nfacet", {"unit": "mm"}, "a.stl: "),
        (
            "a.stl",
            bytes(80) + struct.pack("<I", 9) + bytes(60),
            {"unit": "mm"},
            "its header states 9 triangles, which are 534 bytes, but the file has 144",
        ),
        ("a.step", b"hello", {"chord_mm": 0.1}, "a.step: not a STEP file"),
        ("a.step", b"hello", {}, "state chord_mm above 0, the greatest deviation of a triangle from a surface"),
        ("a.obj", b"", {}, "must be .stl, .stp or .step"),
    ],
)
def test_refused(tmp_path, name, data, options, message):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=message):
        read_mesh(tmp_path / name, **options)


def test_an_open_mesh_is_refused_with_its_edges(tmp_path):
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    trimesh.Trimesh(box.vertices, box.faces[1:]).export(tmp_path / "open.stl")
    with pytest.raises(InputError, match=r"stock.file = open.stl: the mesh is not closed: 3 open edges"):
        read_mesh(tmp_path / "open.stl", unit="mm")
