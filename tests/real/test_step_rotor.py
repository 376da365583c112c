"""A transonic rotor's blade from its STEP file (T-Blade3): against the points of the sections it was lofted through."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from chipload.errors import InputError
from chipload.examples import copy_example
from chipload.geometry.sections import check_sections, loft, read_sections
from chipload.geometry.step_faces import read_faces
from chipload.geometry.thin_wall import through_sections
from chipload.jobs import check_job, load_job, run_job
from chipload.jobs.impeller.flow import AGAINST_Z
from chipload.jobs.impeller.part import read_part
from chipload.jobs.thinwall.faces import wall_of_faces

DATA = Path(os.environ.get("CHIPLOAD_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
ROTOR = DATA / "cad" / "tblade3_rotor"

pytestmark = pytest.mark.skipif(not ROTOR.is_dir(), reason=f"{ROTOR} is missing")

PART = """[impeller]
blades = 16
outer_diameter_mm = 302.4

[impeller.step]
file = "rotor.step"
flow = "+x"
plus = 1
minus = 2
hub = [3]
shroud = [4]
hub_ahead_mm = 0.0

"""
SURFACE = """[[surface]]
body = "blade"
side = "plus"
along = [0.1, 0.9]
up = [0.4, 0.95]
points = [2, 2]

[[operation]]
kind = "impeller"
table_deg = [60.0]
check_mm = 5.0
near_mm = 2.0
clearance_mm = 0.5
scallop_mm = 0.1
feed_mm_min = 600.0
speed_rpm = 3000.0
most_cutters = 1
cutter_change_s = 60.0
table_change_s = 300.0
"""


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    path = copy_example("impeller", tmp_path_factory.mktemp("rotor") / "job") / "job.toml"
    shutil.copy(ROTOR / "Case_7-28-8_Rotor.step", path.parent / "rotor.step")
    text = path.read_text()
    text = text[text.index("[catalogue]") : text.index("[[surface]]")]
    path.write_text(PART + text + SURFACE)
    return path


def nearest(patches, points):
    """Distances (n,) of points to the nearest of some patches: from a grid by Gauss and Newton."""
    u, v = np.linspace(0.0, 1.0, 241), np.linspace(0.0, 1.0, 61)
    U, V = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    out = np.full(len(points), np.inf)
    for patch in patches:
        grid = patch.at(U, V)
        k = np.array([((grid - p) ** 2).sum(axis=1).argmin() for p in points])
        a, b = U[k], V[k]
        for _ in range(8):
            d = points - patch.at(a, b)
            J = np.stack([patch.at(a, b, 1, 0), patch.at(a, b, 0, 1)], axis=-1)
            step = np.linalg.solve(np.swapaxes(J, 1, 2) @ J, np.swapaxes(J, 1, 2) @ d[..., None])[..., 0]
            a, b = np.clip(a + step[:, 0], 0.0, 1.0), np.clip(b + step[:, 1], 0.0, 1.0)
        out = np.minimum(out, np.linalg.norm(points - patch.at(a, b), axis=1))
    return out


def test_the_blade_is_that_of_its_sections(job):
    """21 sections of 241 points, from T-Blade3's own output: the CAD lofted them through fewer poles, and says so."""
    part = read_part(load_job(job).job)
    rows = np.loadtxt(ROTOR / "blade3d.Case7-28-8.dat", skiprows=1).reshape(21, 241, 3)
    points = (rows[::4, ::5].reshape(-1, 3)) @ AGAINST_Z["+x"].T
    away = nearest((part.impeller.blade.plus, part.impeller.blade.minus), points)
    assert np.median(away) < 0.003
    assert away.max() < 0.03


def test_what_check_says(job):
    lines, holds = check_job(load_job(job))
    assert holds
    assert lines[3].startswith("plus: face 1: b-spline, 4876.5 mm2, 4 edges")
    assert lines[3].endswith("fitted by 241 x 21 poles, within 4.5e-05 mm of the face")


def test_its_side_is_searched(job):
    found = run_job(load_job(job)).outcome
    assert (found.surfaces[0].answer.cutter >= 0).all()
    assert found.one is not None
    faces = [text[:5] for key, text in found.provenance.inputs.items() if key.startswith("face ")]
    assert faces == ["hub: ", "shrou", "plus:", "minus", "blade"]


def test_programs_for_so_thin_an_edge_are_refused(job, tmp_path):
    """Next to its leading edge the blade is 0.06 mm thick: from there the check would see the cutter behind it."""
    path = shutil.copytree(job.parent, tmp_path / "job") / "job.toml"
    paths = (Path(__file__).parents[2] / "examples/impeller/job.toml").read_text()
    path.write_text(path.read_text() + paths[paths.index("[operation.paths]") :])
    with pytest.raises(InputError, match=r"gouge_mm = 0.05: the metal is 0.0\d+ mm thick next to an edge of a blade: "):
        check_job(load_job(path))


WALL = """# a blade as a wall
[wall]
shape = "step"
file = "rotor.step"
front = 1
back = 2
clamp = 3
edge_share = 0.15
foot_mm = 8.0
allowance_mm = [0.3, 0.3]
elements = [8, 8]

"""


def test_the_blade_as_a_wall(tmp_path):
    """As thick as the wall through the 21 sections of the other file."""
    path = copy_example("plate", tmp_path / "job") / "job.toml"
    shutil.copy(ROTOR / "Case_7-28-8_Rotor.step", path.parent / "rotor.step")
    text = path.read_text()
    path.write_text(WALL + text[text.index("[workpiece]") :])
    found = wall_of_faces(load_job(path).job)
    rows = np.loadtxt(ROTOR / "blade3d.Case7-28-8.dat", skiprows=1).reshape(21, 241, 3)
    given = through_sections(loft(check_sections(tuple(rows @ AGAINST_Z["+x"].T))), 0.15)
    # the two have other parameters along the blade: what they share is the distance from one side to the other
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 401), np.linspace(0.0, 1.0, 401), indexing="ij")
    greatest = []
    for wall in (found, given):
        other = cKDTree(wall.sides(u, v)[1].reshape(-1, 3))
        rows = [wall.sides(u[:, 0], np.full(401, height))[0] for height in (0.2, 0.4, 0.6, 0.8)]
        greatest.append([float(other.query(p)[0].max()) for p in rows])
    assert greatest[0] == pytest.approx(greatest[1], rel=0.01)


def test_the_points_of_the_rotor_are_its_faces():
    """The blade through the points that T-Blade3 wrote, against the faces by the CAD kernel's distance."""
    blade = loft(check_sections(read_sections([ROTOR / "blade3d.Case7-28-8.dat"], "mm")))
    model = read_faces(ROTOR / "Case_7-28-8_Rotor.step")
    rng = np.random.default_rng(1)
    u, v = rng.uniform(0.03, 0.97, 25), rng.uniform(0.02, 0.98, 25)
    for side in (blade.plus, blade.minus):
        points = side.at(u, v)[:, [2, 0, 1]].tolist()
        assert max(min(face.distance(p) for face in model.faces[:2]) for p in points) < 0.03
