"""A program held against the part, fixtures and its own stock, by the command line."""

import json
from importlib import resources
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

from chipload.web.result import open_result
from chipload.web.scene import bodies, page_scene
from cli.test_simulate import states, summary_of
from command import call
from mill import MILL, block_job, simulation

SLOT = "G21 G90 G17 G94\nT1 M6\nS3000 M3\nG0 X-10 Y0 Z5\nG0 Z-2.1\nG1 X25 F600\nG0 Z5\nM2\n"
JOB = block_job(
    "slot.ngc",
    "[0.0, -15.0, -5.0]",
    "[50.0, 15.0, 0.0]",
    """[part]
file = "part.stl"
units = "mm"
spacing_mm = 1.0
excess_range_mm = 0.5
[[fixture]]
file = "clamp.stl"
units = "mm"
spacing_mm = 1.0
[material]
name = "al7075-t6"
"""
    + MILL
    + """holder_mm = [[40.0, 40.0]]
[[operation]]
kind = "simulate"
step_mm = 2.0
stock_points_mm = 2.0
[limits]
force_n = 1000.0
gouge_mm = 0.02
excess_mm = 0.1
""",
)


def box(low, high):
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    mesh = trimesh.creation.box(extents=high - low)
    mesh.apply_translation(0.5 * (low + high))
    return mesh


@pytest.fixture
def job(tmp_path: Path) -> Path:
    """A slot 2 mm deep and 10.12 mm wide is wanted, one of 2.1 and 10 is milled beside a clamp 30 mm high."""
    (tmp_path / "slot.ngc").write_text(SLOT)
    (tmp_path / "job.toml").write_text(JOB)
    block, slot = box([0, -15, -5], [50, 15, 0]), box([-1, -5.06, -2], [25, 5.06, 1])
    end = trimesh.creation.cylinder(radius=5.06, height=3.0, sections=256)
    end.apply_translation([25.0, 0.0, -0.5])
    part = block.difference(slot.union(end, engine="manifold"), engine="manifold")
    part.export(tmp_path / "part.stl")
    box([40, -15, 0], [50, 15, 30]).export(tmp_path / "clamp.stl")
    return tmp_path / "job.toml"


def test_gouge_excess_and_collision(job: Path, tmp_path: Path) -> None:
    out = tmp_path / "r"
    code, said, _ = call("run", job, "--out", out)
    assert code == 3
    summary = summary_of(out)
    op = summary["operations"][0]
    assert op["gouge_mm"]["max"] == pytest.approx(0.1, abs=2e-3)
    assert op["gouge_mm"]["line"] == 6
    assert op["gouge_mm"]["place"][2] == -2.0
    assert op["excess_mm"]["max"] == pytest.approx(0.06, abs=2e-3)
    assert abs(op["excess_mm"]["place"][1]) <= 5.0601
    assert said.startswith("Exceeds: line 6: shank or holder goes 2.1 mm into fixture 0; and 2 more.")
    (gouge,) = (x for x in summary["limits"] if x["state"] == "exceeds")
    assert (gouge["limit"], gouge["line"], gouge["worst"]) == (0.02, 6, op["gouge_mm"]["max"])
    assert [x["code"] for x in summary["tracks"][0]["findings"]] == ["collision", "collision"]
    by_default = (
        "spindle_torque_nm", "spindle_power_w", "cutter_stress_mpa", "axial_overrun_mm", "deflection_share",
    )  # fmt: skip
    found = states(summary["limits"])
    assert found == {"force_n": "holds", "gouge_mm": "exceeds", "excess_mm": "holds"} | dict.fromkeys(
        by_default, "holds"
    )
    # the tip goes to x = 25 and to z = -2.1, the holder to x = 45 and down to z = 27.9
    # on the way in, and where the way out begins
    hit, again = op["collisions"]
    assert (again["line"], again["depth_mm"]) == (7, pytest.approx(2.1, abs=0.01))
    assert (hit["what"], hit["into"], hit["line"], hit["tool"]) == ("shank or holder", "fixture 0", 6, 1)
    assert hit["depth_mm"] == pytest.approx(2.1, abs=0.01)
    assert op["compared_with"] == ["fixture 0", "part", "stock"]
    missed = "fixtures: what is thinner than their spacing_mm, and a contact less deep, may be missed"
    assert missed in summary["unchecked"]
    assert op["no_holder"] == []
    history = pq.read_table(out / "history.parquet")
    assert max(history["gouge_mm"].to_pylist()) == pytest.approx(op["gouge_mm"]["max"])
    page = (out / "report.html").read_text()
    assert "Gouge and excess on the part" in page
    assert "shank or holder goes 2.1 mm into fixture 0" in page
    scene = trimesh.load(out / "scene.glb", process=False)
    assert "part" in scene.geometry
    assert len(np.unique(np.asarray(scene.geometry["part"].visual.vertex_colors), axis=0)) > 3


def test_what_is_not_stated_is_said_to_be_unchecked(job: Path, tmp_path: Path) -> None:
    text = job.read_text().replace("stock_points_mm = 2.0\n", "").replace("holder_mm = [[40.0, 40.0]]\n", "")
    job.write_text(text.replace(text[text.index("[[fixture]]") : text.index("[material]")], ""))
    assert call("run", job, "--out", tmp_path / "r")[0] == 3
    page = (tmp_path / "r" / "report.html").read_text()
    assert "shank and holder in the stock: a contact less than" in page
    assert "fixtures: none is stated" in page
    assert "holders of tools 1: not stated" in page


def test_a_limit_of_a_part_that_is_not_stated(job: Path, tmp_path: Path) -> None:
    text = job.read_text()
    job.write_text(text.replace(text[text.index("[part]") : text.index("[[fixture]]")], ""))
    code, _, err = call("run", job, "--out", tmp_path / "r")
    assert code == 2
    assert "job.toml: limits.gouge_mm: needs the finished part: state [part] or leave it out" in err


TABLE = """[machine_table]
low_mm = [-40.0, -60.0, -35.0]
high_mm = [90.0, 60.0, -5.0]
spacing_mm = 2.0
"""


def test_the_table_of_the_machine_is_held_against_the_tool_and_shown(tmp_path: Path) -> None:
    # a slot through a block of 5 mm that goes on 0.8 mm into the table under it
    (tmp_path / "slot.ngc").write_text(SLOT.replace("Z-2.1", "Z-5.8"))
    rest = TABLE + simulation("force_n = 3000.0\n")
    job, out = tmp_path / "job.toml", tmp_path / "r"
    job.write_text(block_job("slot.ngc", "[0.0, -15.0, -5.0]", "[50.0, 15.0, 0.0]", rest))
    code, said, _ = call("run", job, "--out", out)
    assert code == 3
    assert "cutting part goes 0.8 mm into machine table" in said
    op = summary_of(out)["operations"][0]
    assert op["compared_with"] == ["machine table", "stock"]
    assert max(one["depth_mm"] for one in op["collisions"]) == pytest.approx(0.8, abs=1e-3)
    assert {(one["what"], one["into"]) for one in op["collisions"]} == {("cutting part", "machine table")}
    shown = open_result(tmp_path, "r")
    solids, _ = bodies(shown)
    plate = next(b for b in solids if b.name == "machine table")
    assert plate.kind == "fixture"
    assert (plate.low.tolist(), plate.high.tolist()) == ([-40.0, -60.0, -35.0], [90.0, 60.0, -5.0])
    # a click on the finding turns these red
    marks = page_scene(shown, shown.tracks[0], (solids, ""), "force_n").marks
    assert marks[0].bodies == ("cutting part", "machine table")
    assert marks[0].depth_mm == pytest.approx(0.8, abs=1e-3)


@pytest.mark.parametrize(("own", "low"), [("", [-300.0, -200.0, -90.0]), (TABLE, [-40.0, -60.0, -35.0])])
def test_the_machine_file_states_the_table_unless_the_job_does(tmp_path: Path, own: str, low: list[float]) -> None:
    (tmp_path / "slot.ngc").write_text(SLOT.replace("Z-2.1", "Z-5.8"))
    machine = resources.files("chipload").joinpath("data", "machines", "vmc.toml").read_text()
    (tmp_path / "mine.toml").write_text(f"{machine}[table]\nlow_mm = [-300, -200, -90]\nhigh_mm = [300, 200, -5.2]\n")
    text = block_job("slot.ngc", "[0.0, -15.0, -5.0]", "[50.0, 15.0, 0.0]", own + simulation("force_n = 3000.0\n"))
    (tmp_path / "job.toml").write_text(text.replace('name = "vmc"', 'file = "mine.toml"'))
    assert call("run", tmp_path / "job.toml", "--out", tmp_path / "r")[0] == 3
    op = summary_of(tmp_path / "r")["operations"][0]
    assert op["compared_with"] == ["machine table", "stock"]
    # the face lies on Z = -5.2 by the machine, on -5 by the job
    assert max(one["depth_mm"] for one in op["collisions"]) == pytest.approx(0.8 if own else 0.6, abs=1e-3)
    shown = open_result(tmp_path, "r")
    solids, _ = bodies(shown)
    plate = next(b for b in solids if b.name == "machine table")
    assert plate.low.tolist() == low
    # a wide table does not move the first view away from the work: 50 x 30 x 5 mm and its path
    document = page_scene(shown, shown.tracks[0], (solids, ""), "force_n").document
    box = json.loads(document[8 : 8 + int.from_bytes(document[4:8], "little")])
    assert np.ptp([box["low"][:2], box["high"][:2]], axis=0).max() < 100.0


def test_a_table_that_is_upside_down_is_refused(tmp_path: Path) -> None:
    (tmp_path / "slot.ngc").write_text(SLOT)
    rest = TABLE.replace("-35.0]", "-5.0]") + simulation("force_n = 3000.0\n")
    (tmp_path / "job.toml").write_text(block_job("slot.ngc", "[0.0, -15.0, -5.0]", "[50.0, 15.0, 0.0]", rest))
    code, _, wrong = call("check", tmp_path / "job.toml")
    assert code == 2
    assert "machine_table.low_mm: Z = -5: must be below high_mm, Z = -5" in wrong
