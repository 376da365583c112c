"""Impellers from STEP files: written from an impeller by formula, read back by the job, the same surfaces."""

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from chipload import examples
from chipload.geometry.bspline import patch_through
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade
from chipload.geometry.step_faces import read_faces
from chipload.geometry.step_roles import roles_of
from chipload.jobs import check_job, load_job
from chipload.jobs.impeller.flow import AGAINST_Z
from chipload.jobs.impeller.part import read_part
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from step_files import face, turned, written

EXAMPLES = Path(examples.__file__).parent
IMPELLER = impeller_of(ImpellerShape())
U, V = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 31), np.linspace(0, 1, 13), indexing="ij"))
STEP = """[impeller.step]
file = "impeller.step"
flow = "{flow}"
plus = {plus}
minus = {minus}
hub = {hub}
shroud = {shroud}
hub_ahead_mm = 0.0
"""


def job(folder: Path, flow="-z", plus="1", minus="2", hub="[3]", shroud="[4]", more="") -> Path:
    """The shipped example with its shape from faces."""
    path = Path(shutil.copytree(EXAMPLES / "impeller", folder / "job")) / "job.toml"
    text = path.read_text()
    first, last = text.index("[impeller.shape]"), text.index("[catalogue]")
    step = STEP.format(flow=flow, plus=plus, minus=minus, hub=hub, shroud=shroud)
    path.write_text(text[:first] + step + more + "\n" + text[last:])
    return path


def model(path: Path, impeller: Impeller = IMPELLER, rotation=None, unit="MM", **change) -> None:
    blade = impeller.blade
    shapes = {"plus": blade.plus, "minus": blade.minus} | change
    faces = [face(p) for p in shapes.values()]
    faces[2:2] = [turned(impeller.hub), turned(impeller.shroud)]
    written(path.parent / "impeller.step", *faces, rotation=rotation, unit=unit)


def apart(found: Blade, stated: Blade) -> float:
    """Greatest distance of points [mm], and of normals, on both sides."""
    sides = ((found.plus, stated.plus), (found.minus, stated.minus))
    return max(
        float(np.abs(x - y).max())
        for a, b in sides
        for x, y in ((a.at(U, V), b.at(U, V)), (a.normal(U, V), b.normal(U, V)))
    )


@pytest.mark.parametrize("flow", ["-z", "+z", "-x", "+x", "-y", "+y"])
def test_the_same_impeller_in_any_frame(tmp_path, flow):
    """The file is written in a frame of its own; the impeller is the one by formula, and what is made of it too."""
    path = job(tmp_path, flow)
    model(path, rotation=AGAINST_Z[flow].T)
    found = read_part(load_job(path).job).impeller
    assert apart(found.blade, IMPELLER.blade) < 1e-6
    s = np.linspace(0.0, 1.0, 9)
    assert found.hub.at(s, s) == pytest.approx(IMPELLER.hub.at(s, s), abs=2e-3)
    for a, b in ((found, IMPELLER), (IMPELLER, found)):
        assert a.across(0, s, s) == pytest.approx(b.across(0, s, s), abs=1e-4)


@pytest.mark.parametrize("flow", ["+z", "-x", "+y"])
def test_the_flow_is_found_by_the_faces_of_the_hub(tmp_path, flow):
    path = job(tmp_path)
    path.write_text(path.read_text().replace('flow = "-z"\n', ""))
    model(path, rotation=AGAINST_Z[flow].T)
    part = read_part(load_job(path).job)
    assert part.faces[0] == f"flow: {flow} of the file, by the hub, whose narrow end is up"
    assert apart(part.impeller.blade, IMPELLER.blade) < 1e-6


def test_frames_are_rotations():
    """The flow goes along -z after each; determinant 1."""
    for flow, R in AGAINST_Z.items():
        along = np.zeros(3)
        along["xyz".index(flow[1])] = 1.0 if flow[0] == "+" else -1.0
        assert (R @ along).tolist() == [0.0, 0.0, -1.0]
        assert np.linalg.det(R) == pytest.approx(1.0)
        assert np.abs(R @ R.T - np.eye(3)).max() == 0.0


def test_faces_in_any_sense(tmp_path):
    """U and v changed, counted from their other ends; the minus side of another blade of the channel."""
    blade = IMPELLER.blade
    path = job(tmp_path)
    model(
        path,
        plus=blade.plus.swapped().reversed(True, False),
        minus=blade.minus.reversed(False, True).turned(2.0 * math.pi / 11.0),
    )
    assert apart(read_part(load_job(path).job).impeller.blade, blade) < 1e-6


def test_inches_are_read_as_such(tmp_path):
    path = job(tmp_path)
    model(path, unit="INCH")
    assert apart(read_part(load_job(path).job).impeller.blade, IMPELLER.blade) < 1e-6


def test_splitters_by_points(tmp_path):
    """A splitter is the blade half a pitch on; its faces are named by points on them, hub and shroud by files."""
    half = math.pi / 11.0
    plus, minus = IMPELLER.blade.plus.turned(half), IMPELLER.blade.minus.turned(half)
    named = [", ".join(f"{x:.6f}" for x in p.at(0.4, 0.6)[0]) for p in (plus, minus)]
    path = job(
        tmp_path, hub='"hub.txt"', shroud='"shroud.txt"',
        more=f'splitter_plus = [{named[0]}]\nsplitter_minus = [{named[1]}]\nunit = "mm"\n',
    )  # fmt: skip
    for name, curve in (("hub", IMPELLER.hub), ("shroud", IMPELLER.shroud)):
        np.savetxt(path.parent / f"{name}.txt", curve.meridian[:, ::-1])
    model(path, splitter_plus=plus, splitter_minus=minus)
    found = read_part(load_job(path).job).impeller
    assert found.splitter is not None
    assert apart(found.splitter, Blade(plus, minus)) < 1e-6
    assert np.abs(found.hub.curve(U) - IMPELLER.hub.curve(U)).max() < 1e-9


def test_check_says_what_the_faces_became(tmp_path):
    path = job(tmp_path)
    model(path)
    lines, holds = check_job(load_job(path))
    assert holds
    assert lines[3].startswith("plus: face 1: b-spline, 2314.5 mm2, 4 edges; x 45.8689 to 105.117, ")
    assert "poles and knots of the file, within " in lines[3]
    assert float(lines[5].removeprefix("blade: its foot leaves the hub by at most ").removesuffix(" mm")) < 1e-4
    formula, _ = check_job(load_job(EXAMPLES / "impeller" / "job.toml"))
    # the curve of the hub has other knots, and so other points between the check points
    same_lines = [[x for x in of if not x.startswith("between check points: ")] for of in (lines[6:], formula[1:])]
    assert same_lines[0] == same_lines[1]
    assert len(lines[6:]) == len(formula[1:])


def test_a_shroud_from_the_tip_of_a_blade(tmp_path):
    """The tip is a strip of the shroud, 3 deg wide; the meridian is the same."""
    path = job(tmp_path)
    blade = IMPELLER.blade
    shapes = [face(blade.plus), face(blade.minus), turned(IMPELLER.hub), turned(IMPELLER.shroud, math.radians(3.0))]
    written(path.parent / "impeller.step", *shapes)
    found = read_part(load_job(path).job).impeller.shroud
    assert isinstance(found, Revolved)
    given = IMPELLER.shroud.curve(np.linspace(0.0, 1.0, 20001))
    p = found.curve(np.linspace(0.0, 1.0, 31))
    assert np.sqrt(((p[:, None] - given[None]) ** 2).sum(axis=2)).min(axis=1).max() < 5e-3


def test_sides_and_hub_are_named(tmp_path):
    """Three blades and the hub, in any order; of a lone blade nothing is said."""
    sides = [p.turned(k * IMPELLER.pitch) for k in range(3) for p in (IMPELLER.blade.plus, IMPELLER.blade.minus)]
    path = written(tmp_path / "three.step", *map(face, sides[:2]), turned(IMPELLER.hub), *map(face, sides[2:]))
    lines = roles_of(read_faces(path))
    assert lines[0].startswith("6 similar faces of 23")
    assert lines[0].endswith(" mm2: sides of blades?: 1, 2, 4, 5, 6, 7")
    assert lines[1] == "face 3: of revolution about z, r 45.88 to 111.5 mm: the hub?"
    path = written(tmp_path / "one.step", *map(face, sides[:2]), turned(IMPELLER.hub))
    assert roles_of(read_faces(path)) == []


def test_a_side_of_several_faces(tmp_path):
    """Each side in two faces, one beyond the other along the flow: the same blade, within what is said."""
    path = job(tmp_path, plus="[1, 2]", minus="[3, 4]", hub="[5]", shroud="[6]", more="fit_mm = 0.01\n")
    blade, halves = IMPELLER.blade, []
    u, v = np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 13)
    a, b = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    for side in (blade.plus, blade.minus):
        for first, last in ((0.0, 0.45), (0.45, 1.0)):
            grid = side.at(first + a * (last - first), b).reshape(41, 13, 3)
            halves.append(face(patch_through(grid, u, v, side=side.side)))
    written(path.parent / "impeller.step", *halves, turned(IMPELLER.hub), turned(IMPELLER.shroud))
    lines, holds = check_job(load_job(path))
    assert holds
    assert "faces 1, 2: sampled along rulings from hub to shroud by " in lines[3]
    found = read_part(load_job(path).job).impeller.blade
    for mine, given in ((found.plus, blade.plus), (found.minus, blade.minus)):
        p = mine.at(U, V)
        r, theta = np.hypot(p[:, 0], p[:, 1]), np.arctan2(p[:, 1], p[:, 0])
        assert np.abs(round_the_axis(r, p[:, 2], theta, given)).max() < 0.012


def round_the_axis(r, z, theta, given):
    """Distance [mm] round the axis of points from a side, met at the same r and z by Newton's method."""
    grid = given.at(*(x.ravel() for x in np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 61))))
    uv = np.stack([x.ravel() for x in np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 61))], axis=-1)
    uv = uv[cKDTree(np.stack([np.hypot(grid[:, 0], grid[:, 1]), grid[:, 2]], axis=-1)).query(np.stack([r, z], -1))[1]]
    for _ in range(20):
        p = given.at(uv[:, 0], uv[:, 1])
        q = np.hypot(p[:, 0], p[:, 1])
        d = [given.at(uv[:, 0], uv[:, 1], *x) for x in ((1, 0), (0, 1))]
        J = np.stack([np.stack([(x[:, :2] * p[:, :2]).sum(axis=1) / q, x[:, 2]], axis=-1) for x in d], axis=-1)
        uv = np.clip(uv + np.linalg.solve(J, np.stack([r - q, z - p[:, 2]], -1)[..., None])[..., 0], 0.0, 1.0)
    p = given.at(uv[:, 0], uv[:, 1])
    return r * np.angle(np.exp(1j * (np.arctan2(p[:, 1], p[:, 0]) - theta)))


def test_fillets_are_said_and_what_is_not_milled(tmp_path):
    path = Path(shutil.copytree(EXAMPLES / "impeller", tmp_path / "job")) / "job.toml"
    text = path.read_text().replace("outer_diameter_mm = 223.0", "outer_diameter_mm = 223.0\nfillet_mm = 3.0")
    path.write_text(text.replace('side = "minus"', 'side = "minus fillet"'))
    lines, holds = check_job(load_job(path))
    assert holds
    assert lines[1].startswith("blade plus fillet: 3 mm, up to 3.634 mm of the side are under it, within ")
    assert lines[3] == "floor: at least 18.67 mm wide between two fillets, round the axis"
    assert lines[4] == "not milled: no [[surface]] names it: blade plus fillet"
    assert lines[7].startswith("surface 1: blade minus fillet: 200 contact points, ")
    found = read_part(load_job(path).job).impeller
    # both ways: a side begins where its fillet ends
    for w, side in ((1, found.blade.plus), (-1, found.blade.minus)):
        assert np.abs(found.foot(0, w).at(U, 1.0) - side.at(U, 0.0)).max() < 1e-3
        assert np.abs(found.foot(0, w).normal(U, 1.0) - side.normal(U, 0.0)).max() < 2e-3
