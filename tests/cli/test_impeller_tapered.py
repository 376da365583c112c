"""An impeller job whose catalogue states a tapered or a barrel cutter: from its file to programs on five axes."""

import json
import math
import re

import numpy as np
import pytest
from tests.cli.test_impeller_programs import job
from tests.planning.impeller.test_profile_cutters import away
from typer.testing import CliRunner

from chipload.cli import app
from chipload.cutter.catalogue import CatalogueCutter, read_catalogue
from chipload.machine.kinematics import forward
from chipload.machine.machine import machine_named
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of

POINTS = """[operation.point_milling]
machine = { name = "cradle-ac" }
feed_mm_min = 300.0
speed_rpm = 3000.0

[operation.paths]"""
#: a straight ball for the index table where it needs one, and what mills by points
ROWS = {
    "tapered": "{ corner_radius_mm = 2.0, taper_deg = 4.0, cutting_length_mm = 40.0, shank_diameter_mm = 10.0 }",
    "barrel": "{ diameter_mm = 12.0, corner_radius_mm = 2.0, barrel_radius_mm = 85.0, cutting_length_mm = 25.0, "
    "neck_diameter_mm = 10.0, neck_length_mm = 60.0 }",
}
BETA = math.radians(4.0)
CUTTERS = {
    "tapered": CatalogueCutter(
        4.0 * (1.0 - math.sin(BETA)) / math.cos(BETA), 2.0, 40.0, shank_diameter=10.0, taper=BETA
    ),
    "barrel": CatalogueCutter(12.0, 2.0, 25.0, neck_diameter=10.0, neck_length=60.0, barrel_radius=85.0),
}
NAMES = {"tapered": "points-1-blade-plus-taper4D3.73r2", "barrel": "points-1-blade-plus-barrel85D12r2"}


@pytest.fixture(scope="module", params=["tapered", "barrel"])
def milled(request, tmp_path_factory):
    root = tmp_path_factory.mktemp(request.param)
    path = job(root / "one")
    straight = "" if request.param == "tapered" else "{ diameter_mm = 3.0, corner_radius_mm = 1.5 }, "
    rows = f'name = "own"\ncutter = [{straight}{ROWS[request.param]}]\n'
    (root / "one" / "cutters.toml").write_text(rows)
    text = path.read_text().replace('name = "wu2019"', 'file = "cutters.toml"')
    text = re.sub(r"^hand_picked.*\n", "", text, flags=re.MULTILINE)
    path.write_text(text.replace("[operation.paths]", POINTS))
    done = CliRunner().invoke(app, ["run", str(path), "--out", str(root / "out")])
    assert done.exit_code == 0, done.output
    return request.param, root, json.loads((root / "out" / "summary.json").read_bytes())


def test_the_catalogue_is_read(milled):
    kind, root, _ = milled
    assert read_catalogue(root / "one" / "cutters.toml").cutters[-1] == CUTTERS[kind]


def test_the_surface_is_milled_by_points_and_verified(milled):
    kind, root, summary = milled
    (points,) = summary["operations"][0]["point_milling"]
    assert (points["program"], points["verdict"]) == (NAMES[kind], "holds")
    (track,) = (t for t in summary["tracks"] if t["name"] == points["program"])
    states = {x["name"]: x["state"] for x in track["limits"]}
    assert states == dict.fromkeys(("gouge_mm", "scallop_mm", "axial_overrun_mm"), "holds")
    assert points["removal"]["removed_mm3"] > 100.0
    text = (root / "out" / f"{points['program']}.ngc").read_text()
    said = {"tapered": "T1: taper 4 deg D 3.73 r 2 mm, tool", "barrel": "T1: barrel 85 D 12 r 2 mm, tool"}[kind]
    assert said in text


def poses_of(text, machine):
    """Tips and axes of a text, read by a few regular expressions and brought back by the machine's chain."""
    letters = "XYZ" + "".join(axis.letter for axis in machine.chain.rotary)
    position, rows = dict.fromkeys(letters, 0.0), []
    for line in text.splitlines():
        if not line.startswith(("(", "M", "T", "G43")) and re.search(rf"[{letters}]-?\d", line):
            position |= {letter: float(x) for letter, x in re.findall(rf"([{letters}])(-?[\d.]+)", line)}
            rows.append(list(position.values()))
    q = np.zeros((len(rows), 9))
    q[:, [0, 1, 2]] = np.array(rows)[:, :3] + machine.chain.work_zero
    for k, axis in enumerate(machine.chain.rotary):
        q[:, axis.column] = np.radians(np.array(rows)[:, 3 + k])
    return q


def check_dense(tip, axis, cutter, scallop):
    """Dense points of the side and of its neighbours against all poses."""
    impeller = impeller_of(ImpellerShape())
    wall = impeller.body(0).plus
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.3, 0.45, 41), np.linspace(0.5, 0.7, 61), indexing="ij"))
    own = away(wall.at(u, v), tip, axis, cutter, 8)
    assert own.min() > -0.05
    assert own.max() <= 0.1
    assert own.max() == pytest.approx(scallop, abs=0.015)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.02, 0.98, 61), np.linspace(0.05, 0.98, 41), indexing="ij"))
    for other in (impeller.body(0).plus, impeller.body(1).minus, impeller.body(-1).plus):
        assert away(other.at(u, v), tip, axis, cutter, 2).min() > -0.05


def test_dense_points_against_the_poses_of_the_text(milled):
    kind, root, summary = milled
    machine = machine_named("cradle-ac")
    q = poses_of((root / "out" / f"{NAMES[kind]}.ngc").read_text(), machine)
    # the first row, before which Z is nowhere
    tip, axis = (x[1:] for x in forward(machine, q))
    (points,) = summary["operations"][0]["point_milling"]
    check_dense(tip, axis, CUTTERS[kind], points["scallop_greatest_mm"])


def test_the_index_table_is_planned_with_a_tapered_cutter_too(milled):
    kind, _, summary = milled
    (op,) = summary["operations"]
    assert {p["corner_radius_mm"] for p in op["programs"]} == ({2.0} if kind == "tapered" else {1.5})
    tracks = {t["name"]: t for t in summary["tracks"]}
    (program,) = op["programs"]
    assert tracks[program["program"]]["verdict"] == "holds"
    assert ("taper4D3.73r2" in program["program"]) == (kind == "tapered")
