"""Impellers from STEP files: written from an impeller by formula, read back by the job, the same surfaces."""

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from chipload import examples
from chipload.geometry.revolve import Revolved
from chipload.geometry.sections import Blade
from chipload.jobs import check_job, load_job
from chipload.jobs.impeller.part import AGAINST_Z, read_part
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


def same(found: Blade, given: Blade, within: float = 1e-6) -> None:
    for a, b in ((found.plus, given.plus), (found.minus, given.minus)):
        assert np.abs(a.at(U, V) - b.at(U, V)).max() < within
        assert np.abs(a.normal(U, V) - b.normal(U, V)).max() < 1e-6


@pytest.mark.parametrize("flow", ["-z", "+z", "-x", "+x", "-y", "+y"])
def test_the_same_impeller_in_any_frame(tmp_path, flow):
    """The file is written in a frame of its own; the impeller is the one by formula, and what is made of it too."""
    path = job(tmp_path, flow)
    model(path, rotation=AGAINST_Z[flow].T)
    found = read_part(load_job(path).job).impeller
    same(found.blade, IMPELLER.blade)
    s = np.linspace(0.0, 1.0, 9)
    assert found.hub.at(s, s) == pytest.approx(IMPELLER.hub.at(s, s), abs=2e-3)
    for a, b in ((found, IMPELLER), (IMPELLER, found)):
        assert a.across(0, s, s) == pytest.approx(b.across(0, s, s), abs=1e-4)


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
    same(read_part(load_job(path).job).impeller.blade, blade)


def test_inches_are_read_as_such(tmp_path):
    path = job(tmp_path)
    model(path, unit="INCH")
    same(read_part(load_job(path).job).impeller.blade, IMPELLER.blade)


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
    same(found.splitter, Blade(plus, minus))
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
    assert lines[6:] == formula[1:]


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


def test_fillets_are_said_and_what_is_not_milled(tmp_path):
    path = Path(shutil.copytree(EXAMPLES / "impeller", tmp_path / "job")) / "job.toml"
    text = path.read_text().replace("outer_diameter_mm = 223.0", "outer_diameter_mm = 223.0\nfillet_mm = 3.0")
    path.write_text(text.replace('side = "minus"', 'side = "minus fillet"'))
    lines, holds = check_job(load_job(path))
    assert holds
    assert lines[1].startswith("blade plus fillet: 3 mm, up to 3.634 mm of the side are under it, within ")
    assert lines[3] == "floor: at least 18.67 mm wide between two fillets, round the axis"
    assert lines[4] == "not milled, for no [[surface]] names it: blade plus fillet"
    assert lines[7].startswith("surface 1: blade minus fillet: 200 contact points, ")
    found = read_part(load_job(path).job).impeller
    # both ways: a side begins where its fillet ends
    for w, side in ((1, found.blade.plus), (-1, found.blade.minus)):
        assert np.abs(found.foot(0, w).at(U, 1.0) - side.at(U, 0.0)).max() < 1e-3
        assert np.abs(found.foot(0, w).normal(U, 1.0) - side.normal(U, 0.0)).max() < 2e-3
