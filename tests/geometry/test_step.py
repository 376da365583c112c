"""Faces of STEP parts as contours."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from chipload.errors import InputError
from chipload.geometry.contour import Region
from chipload.geometry.step import read_step_face
from step_files import written

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))


@pytest.fixture(scope="module")
def part(tmp_path_factory):
    """A box 40 x 30 x 10 with a through hole of radius 5 at (15, 10) and an elliptic boss 12 x 6 on top, 4 high."""
    import OCP.IFSelect
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
    from OCP.gp import gp_Ax2, gp_Dir, gp_Elips, gp_Pnt, gp_Vec
    from OCP.Message import Message, Message_Fail
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Fail)
    box = BRepPrimAPI_MakeBox(40.0, 30.0, 10.0).Shape()
    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(15, 10, -1), gp_Dir(0, 0, 1)), 5.0, 20.0).Shape()
    ellipse = gp_Elips(gp_Ax2(gp_Pnt(20, 22, 10), gp_Dir(0, 0, 1)), 6.0, 3.0)
    wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(ellipse).Edge()).Wire()
    boss = BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire).Face(), gp_Vec(0, 0, 4)).Shape()
    whole = BRepAlgoAPI_Fuse(BRepAlgoAPI_Cut(box, hole).Shape(), boss).Shape()
    writer = STEPControl_Writer()
    writer.Transfer(whole, STEPControl_AsIs)
    path = tmp_path_factory.mktemp("step") / "part.step"
    assert writer.Write(str(path)) == OCP.IFSelect.IFSelect_RetDone
    return path


def test_the_process_of_the_kernel_imports_little():
    """Each file that is read starts one: the libraries of chains and biarcs would double what that takes."""
    code = "import sys, chipload.geometry.step_roles; print(*{'numba', 'scipy', 'shapely'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n"


def test_the_face_at_a_height_has_its_holes(part):
    drawing = read_step_face(part, z_mm=10.0)
    assert drawing.units == "mm"
    assert set(drawing.layers) == {"z=10"}
    region = Region.of(drawing.contours)
    assert region.area == pytest.approx(1200.0 - 25.0 * np.pi - 18.0 * np.pi, abs=0.03)
    assert sorted(len(c.segments) for c in drawing.contours)[:2] == [1, 4]
    assert region.contains([[15, 10], [20, 22], [2, 2]]).tolist() == [False, False, True]


def test_the_topmost_face_is_taken_and_said(part):
    drawing = read_step_face(part)
    assert drawing.layers == ("z=14",)
    assert abs(drawing.contours[0].area) == pytest.approx(18.0 * np.pi, abs=0.02)
    assert drawing.findings[-1].text == "the topmost face, z = 14, of those at 0, 10, 14 mm is read"


def test_refusals(part, tmp_path):
    with pytest.raises(
        InputError, match=r"^part\.z_mm = 7: no horizontal planar face at this height; faces are at 0, 10, 14 mm$"
    ):
        read_step_face(part, z_mm=7.0)
    rubbish = tmp_path / "rubbish.step"
    rubbish.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match=r"^part\.file = rubbish\.step: not a STEP file$"):
        read_step_face(rubbish)
    rubbish.write_text("ISO-10303-21;\nHEADER;\nrubbish\n")
    with pytest.raises(InputError, match=r"^part\.file = rubbish\.step: the CAD kernel cannot read this STEP file$"):
        read_step_face(rubbish)
    with pytest.raises(InputError, match=r"nothing\.step: no such file$"):
        read_step_face(tmp_path / "nothing.step")


@pytest.mark.skipif(
    not (DATA / "cad/nist_step").is_dir(), reason="no STEP files of NIST in CHIPLOAD_DATA or ../shared/data"
)
def test_nist_part_by_two_protocols():
    old, new = (read_step_face(DATA / f"cad/nist_step/nist_ctc_01_asme1_ap{n}.stp") for n in (203, 242))
    assert [c.area for c in old.contours] == pytest.approx([c.area for c in new.contours], rel=1e-6)
    assert all(c.closed for c in old.contours)


def test_what_looks_down_is_no_floor(tmp_path: Path) -> None:
    """A rib over a plate of 40 x 16 mm, 5 mm longer on both sides: its undersides lie at the height of the face."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    plate = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(40, 16, 8)).Shape()
    rib = BRepPrimAPI_MakeBox(gp_Pnt(19, -5, 8), gp_Pnt(21, 21, 20)).Shape()
    written(tmp_path / "rib.step", BRepAlgoAPI_Fuse(plate, rib).Shape())
    lengths = {z: [c.length for c in read_step_face(tmp_path / "rib.step", z_mm=z).contours] for z in (0.0, 8.0, 20.0)}
    # each side of the face is 19 x 16 mm; the bottom looks down, and is read as nothing else is at its height
    assert lengths[8.0] == pytest.approx([70.0, 70.0])
    assert lengths[0.0] == pytest.approx([112.0])
    assert lengths[20.0] == pytest.approx([56.0])
