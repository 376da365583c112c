"""Pockets of a model whose ribs rise above the face: rapids clear them, and no pocket ends below the face."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from chipload.machine.machine import machine_named
from chipload.program.read import read_program
from command import call
from step_files import written

#: two levels instead of the five of the draft, and half of its passes
FEWER = ("axial_depth_mm=6.0", "radial_depth_mm=1.5", "step_mm=0.4")
#: plate 28 x 14 mm with its face at 8 mm, and a rib across it that rises to 20 mm
FACE, RIB = 8.0, 20.0


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    folder = tmp_path_factory.mktemp("ribs")
    plate = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(28, 14, FACE)).Shape()
    rib = BRepPrimAPI_MakeBox(gp_Pnt(13, -5, FACE), gp_Pnt(15, 19, RIB)).Shape()
    written(folder / "ribs.step", BRepAlgoAPI_Fuse(plate, rib).Shape())
    assert call("init", folder / "ribs.step", folder / "job")[0] == 0
    return folder / "job" / "job.toml"


def test_the_draft_takes_the_top_of_the_model(job: Path) -> None:
    drafted = tomllib.loads(job.read_text())
    assert (drafted["part"]["face_z_mm"], drafted["stock"]["top_mm"]) == (FACE, RIB)
    assert drafted["operation"][0]["depth_mm"] == RIB - FACE
    assert drafted["cutter"][0]["flute_length_mm"] >= RIB - FACE


def test_no_rapid_of_the_program_crosses_the_rib_below_its_top(job: Path, tmp_path: Path) -> None:
    changes = [word for change in FEWER for word in ("--set", f"operation.0.{change}")]
    code, _, said = call("run", job, "--out", tmp_path / "result", "--accept", *changes)
    assert code == 3, said
    (program,) = (tmp_path / "result").glob("0-*.ngc")
    read = read_program(program, machine_named("vmc")).program
    # before the first motion in Z the height is not stated
    path = read.p_work[int((read.p_work[:, 2] > RIB).argmax()) :]
    crossing = (path[:-1, 0] - 14.0) * (path[1:, 0] - 14.0) < 0.0
    assert crossing.any()
    assert min(path[:-1][crossing][:, 2].min(), path[1:][crossing][:, 2].min()) > RIB
    assert path[:, 2].min() == pytest.approx(FACE)


def test_heights_that_contradict_the_model_are_refused(job: Path) -> None:
    depth = "operation.0.depth_mm"
    code, _, said = call("check", job, "--set", "stock.top_mm=13", "--set", f"{depth}=5")
    assert code == 2
    assert "rapids go at z = 18 mm" in said
    assert "must be at least 7" in said
    code, _, said = call("check", job, "--set", f"{depth}=12.5")
    assert code == 2
    assert "ends at z = 7.5 mm, below the face at z = 8 mm" in said
    assert "must be at most 12," in said
