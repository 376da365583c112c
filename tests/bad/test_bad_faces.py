"""Faces of STEP files that must be refused, each with its exact message."""

from __future__ import annotations

import math
import shutil
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from chipload import examples
from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.geometry.bspline import BSplinePatch, patch_through
from chipload.geometry.revolve import Revolved
from chipload.jobs import check_job, load_job
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from step_files import face, turned, written

EXAMPLES = Path(examples.__file__).parent
U, V = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 15), np.linspace(0.0, 1.0, 9), indexing="ij"))
IMPELLER = impeller_of(ImpellerShape())
STEP = """[impeller.step]
file = "impeller.step"
flow = "-z"
plus = 1
minus = 2
hub = [3]
shroud = [4]
hub_ahead_mm = 0.0

"""


def scaled(patch: BSplinePatch, by: float) -> BSplinePatch:
    return BSplinePatch(patch.knots_u, patch.knots_v, by * patch.control, patch.side)


def holed(patch: BSplinePatch):
    """A face with a bored hole of radius 2 across its middle."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    p = patch.at(0.5, 0.5)[0]
    axis = gp_Ax2(gp_Pnt(*(p - [0, 20, 0]).tolist()), gp_Dir(0, 1, 0))
    return BRepAlgoAPI_Cut(face(patch), BRepPrimAPI_MakeCylinder(axis, 2.0, 40.0).Shape()).Shape()


def three_sided():
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.gp import gp_Pnt

    polygon = BRepBuilderAPI_MakePolygon(gp_Pnt(60, 0, 0), gp_Pnt(90, 0, 0), gp_Pnt(60, 0, 30), True)
    return BRepBuilderAPI_MakeFace(polygon.Wire()).Face()


def corner():
    """A flat ring that meets a cylinder at right angles, as hub."""
    return [
        turned(Revolved(np.array([[40.0, 50.0], [40.0, 0.0]]), 1)),
        turned(Revolved(np.array([[40.0, 0.0], [111.5, 0.0]]), 1)),
    ]


FACES = [face(IMPELLER.blade.plus), face(IMPELLER.blade.minus), turned(IMPELLER.hub), turned(IMPELLER.shroud)]


@cache
def step() -> bytes:
    """The file of all faces, written once."""
    with TemporaryDirectory() as folder:
        written(Path(folder) / "impeller.step", *FACES)
        return (Path(folder) / "impeller.step").read_bytes()


@pytest.fixture
def job(tmp_path):
    path = Path(shutil.copytree(EXAMPLES / "impeller", tmp_path / "job")) / "job.toml"
    text = path.read_text()
    first, last = text.index("[impeller.shape]"), text.index("[catalogue]")
    path.write_text(text[:first] + STEP + text[last:])
    (path.parent / "impeller.step").write_bytes(step())
    return path


def refused(path, old="", new=""):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        check_job(load_job(path))
    return str(caught.value).replace(str(path.parent) + "/", "")


ON_PLUS = ", ".join(f"{x:.9f}" for x in IMPELLER.blade.plus.at(0.05, 0.0)[0])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("plus = 1", "plus = 9",
         "impeller.step.plus = 9: no such face: must be from 1 to 4: chipload check impeller.step lists the faces"),
        ("plus = 1", "plus = 0", "job.toml: impeller.step.plus = 0: must be from 1 (side of a blade that faces a "
         "growing angle about the axis, seen against the flow)"),
        ("plus = 1", "plus = [1.0, 2.0]",
         "job.toml: impeller.step.plus = [1.0, 2.0]: must be the number of a face or a point [x, y, z] on it, in mm "
         "(side of a blade that faces a growing angle about the axis, seen against the flow)"),
        ("plus = 1", "plus = [0.0, 0.0, 25.0]",
         "impeller.step.plus = [0, 0, 25]: lies 49.51 mm from the nearest face, 2: must be within 0.01 mm of a face "
         "(mm, in the frame of the file)"),
        ("plus = 1\nminus = 2", "plus = 2\nminus = 1",
         "impeller.step.plus and minus: metal fills 31.26 deg of the pitch of 32.73 deg from minus to plus: must be "
         "less than half: exchange the sides: plus faces a growing angle about the axis"),
        ("hub = [3]", "hub = [1]",
         "impeller.step.hub: face 1 is not of revolution about the axis: radius and height round it change by "
         "39.35 mm: check flow, and that the axis goes through the origin"),
        ("hub = [3]", "hub = [3, 3]", "impeller.step.hub: face 3 appears twice: name each face once"),
        ("hub = [3]", "hub = [3, 4]",
         "impeller.step.hub: face 4 begins 24 mm from the end of face 3: state the faces between them"),
        ("hub = [3]", "hub = []",
         "job.toml: impeller.step.hub = []: must name at least one face, or a file of points"),
        ('flow = "-z"', 'flow = "-y"',
         "impeller.step.hub: face 3 is not of revolution about the axis: radius and height round it change by "
         "65.59 mm: check flow, and that the axis goes through the origin"),
        ("outer_diameter_mm = 223.0", "outer_diameter_mm = 5664.2",
         "impeller.step.plus and minus: faces: outer diameter 223 mm: must be 5664.2 as stated: smaller by 25.4, as "
         "inch read as mm"),
        ('file = "impeller.step"', 'file = "nothing.step"', "impeller.step.file = nothing.step: no such file"),
        ("minus = 2\n", "minus = 2\nsplitter_plus = 1\n",
         "job.toml: impeller.step.splitter_minus: missing: state both sides of the splitter or neither"),
        ("hub = [3]", 'hub = "hub.txt"',
         "job.toml: impeller.step.unit: missing: state it for the points of hub"),
        ("hub = [3]", 'hub = [3]\nunit = "mm"', "job.toml: impeller.step.unit: of no file: leave it out"),
        ("[catalogue]", "[impeller.sections]\nblade = ['a']\nhub = 'h'\nshroud = 's'\nunit = 'mm'\n"
         "flow_along_x = true\nhub_ahead_mm = 0.0\n\n[catalogue]",
         "job.toml: impeller: sections and step are stated: state one of [impeller.shape], "
         "[impeller.sections], [impeller.step]"),
    ],
)  # fmt: skip
def test_names(job, old, new, message):
    assert refused(job, old, new) == message


def test_a_point_on_an_edge(job):
    text = refused(job, "plus = 1", f"plus = [{ON_PLUS}]")
    assert text.endswith(": lies on faces 1 and 3: state a point inside one of them")


def test_inches_taken_for_millimetres(job):
    """A model drawn in inches but written as mm."""
    blade = IMPELLER.blade
    small = [Revolved(c.meridian / 25.4, c.side) for c in (IMPELLER.hub, IMPELLER.shroud)]
    sides = [face(scaled(p, 1.0 / 25.4)) for p in (blade.plus, blade.minus)]
    written(job.parent / "impeller.step", *sides, turned(small[0]), turned(small[1]))
    assert refused(job) == (
        "impeller.step.plus and minus: faces: outer diameter 8.77953 mm: must be 223 as stated: smaller by 25.4, as "
        "inch read as mm"
    )


def test_a_file_without_a_unit(job):
    path = job.parent / "impeller.step"
    path.write_text(path.read_text().replace("LENGTH_UNIT", "LENGTH_UNIX"))
    assert refused(job) == "impeller.step.file = impeller.step: states no unit of length: export it again with its unit"


def test_a_face_with_a_hole(job):
    written(job.parent / "impeller.step", holed(IMPELLER.blade.plus), *FACES[1:])
    assert refused(job) == "impeller.step.plus: face 1 has a hole: must have none"


def test_a_face_with_three_sides(job):
    written(job.parent / "impeller.step", three_sided(), *FACES[1:])
    assert refused(job) == (
        "impeller.step.plus: face 1: no edge lies along the shroud, the nearest is 24.4 mm away: "
        "state all faces of the side, or check shroud"
    )


def test_a_part_of_a_side(job):
    """Half of a side does not reach from hub to shroud."""
    blade = IMPELLER.blade
    lower = patch_through(blade.plus.at(U, 0.5 * V).reshape(15, 9, 3), U[::9], V[:9])
    written(job.parent / "impeller.step", face(lower), face(lower), *FACES[1:])
    text = refused(
        job, "plus = 1\nminus = 2\nhub = [3]\nshroud = [4]", "plus = [1, 2]\nminus = 3\nhub = [4]\nshroud = [5]"
    )
    assert text.startswith("impeller.step.plus: faces 1, 2: no edge lies along the shroud, the nearest is ")
    assert text.endswith(" mm away: state all faces of the side, or check shroud")


def test_a_face_of_a_side_twice(job):
    assert refused(job, "plus = 1", "plus = [1, 1]") == (
        "impeller.step.plus: face 1 appears twice: name each face once"
    )


def test_a_hub_with_a_corner(job):
    written(job.parent / "impeller.step", *FACES[:2], *corner(), FACES[3])
    assert refused(job, "hub = [3]\nshroud = [4]", "hub = [3, 4]\nshroud = [5]") == (
        "impeller.step.hub: faces 3 and 4 meet at 90 deg: must join smoothly: state only the faces along the channel"
    )


def test_a_fit_that_is_not_kept(job):
    """A cylinder is no polynomial: 129 x 129 poles of a half one of radius 80 keep 1e-9 mm, not 1e-12."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer

    solid = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 80.0, 30.0, math.pi).Shape()
    written(job.parent / "impeller.step", TopExp_Explorer(solid, TopAbs_FACE).Current(), *FACES[1:])
    text = refused(job, "plus = 1", "plus = 1\nfit_mm = 1e-12")
    assert text.startswith("impeller.step.plus: the fit of face 1 deviates by ")
    assert text.endswith(" mm: must be at most fit_mm = 1e-12: raise it, or export the face in smooth parts")


def test_sections_that_are_a_model(tmp_path):
    path = Path(shutil.copytree(EXAMPLES / "hecc", tmp_path / "hecc")) / "job.toml"
    assert refused(path, '"main_01.txt"', '"blade.stp"') == (
        "job.toml: impeller.sections: blade.stp: is a STEP file: name its faces in [impeller.step]"
    )


WALL = """# a wall
[wall]
shape = "step"
file = "wall.step"
front = {front}
back = {back}
clamp = {clamp}
{more}foot_mm = 6.0
allowance_mm = [0.3, 0.2]
elements = [4, 4]

"""
FRONT, BACK, BELOW = [7.0, 3.0, 9.0], [11.0, 0.0, 4.0], [20.0, 1.5, 0.0]


def block(cut=None):
    """A plate of 40 x 3 x 30 mm, less a box or a bore."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    plate = BRepPrimAPI_MakeBox(40.0, 3.0, 30.0).Shape()
    return plate if cut is None else BRepAlgoAPI_Cut(plate, cut).Shape()


def bore():
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(30, -1, 20), gp_Dir(0, 1, 0)), 2.0, 6.0).Shape()


def slot():
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    return BRepPrimAPI_MakeBox(gp_Pnt(-1, 1, 10), gp_Pnt(41, 2, 31)).Shape()


@pytest.mark.parametrize(
    ("cut", "front", "back", "clamp", "more", "message"),
    [
        (None, 1, 9, 5, "",
         "wall.back = 9: no such face: must be from 1 to 6: chipload check wall.step lists the faces"),
        (None, 1, 1, 5, "", "wall.back: face 1 is wall.front too: state the opposite face"),
        (None, FRONT, [20.0, 1.0, 30.0], [20.0, 3.0, 0.0], "",
         "wall between faces 4 and 6 of wall.step: not opposite each other: lines across lean by 84.3 deg from the "
         "normals: must be at most 45 deg, and apart: state the two sides of one wall, or a greater edge_share"),
        (None, FRONT, BACK, [20.0, 1.5, 30.0], "",
         "wall.clamp = [20, 1.5, 30]: lies 1.5 mm off the nearest edge of face 4: must be within 0.01 mm (mm, in the "
         "frame of the file)"),
        (None, FRONT, BACK, BACK, "",
         "wall.clamp = [11, 0, 4]: lies 5 mm off the nearest edge of face 4: must be within 0.01 mm (mm, in the "
         "frame of the file)"),
        (None, FRONT, BACK, 3, "",
         "wall.clamp: face 3 lies 3 mm off the nearest side of face 4: must touch it along a side, or state a point of "
         "the edge that is clamped"),
        (None, FRONT, BACK, [0.0, 3.0, 0.0], "",
         "wall.clamp = [0, 3, 0]: lies at a corner of face 4: take a point within the edge"),
        (bore, FRONT, BACK, 5, "", "wall.front: face 4 has a hole: must have none"),
        (slot, [7.0, 1.0, 20.0], [7.0, 2.0, 20.0], [20.0, 1.0, 10.0], "",
         "wall between faces 3 and 5 of wall.step: no material between them: state the two sides of a wall, not of a "
         "slot"),
        (None, FRONT, BACK, [20.0, 3.0, 0.0], "length_mm = 5.0\n",
         "job.toml: wall.length_mm: not used by shape = step: leave it out"),
        (None, FRONT, BACK, [20.0, 3.0, 0.0], "edge_share = 0.6\n",
         "wall.edge_share = 0.6: must be from 0 to below 0.5"),
    ],
)  # fmt: skip
def test_walls(tmp_path, cut, front, back, clamp, more, message):
    path = copy_example("plate", tmp_path / "job") / "job.toml"
    written(path.parent / "wall.step", block(None if cut is None else cut()))
    text = path.read_text()
    path.write_text(WALL.format(front=front, back=back, clamp=clamp, more=more) + text[text.index("[workpiece]") :])
    assert refused(path) == message


def test_a_wall_in_inches_taken_for_millimetres(tmp_path):
    """Its foot would be higher than the wall."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    path = copy_example("plate", tmp_path / "job") / "job.toml"
    written(path.parent / "wall.step", BRepPrimAPI_MakeBox(40.0 / 25.4, 3.0 / 25.4, 30.0 / 25.4).Shape())
    text = path.read_text()
    names = {k: [round(x / 25.4, 9) for x in p] for k, p in (("front", FRONT), ("back", BACK), ("clamp", [20, 3, 0]))}
    path.write_text(WALL.format(more="", **names) + text[text.index("[workpiece]") :])
    assert refused(path) == ("wall.foot_mm = 6: must be below 0.8 of the wall's height of 1.181 mm: the rest is cut")
