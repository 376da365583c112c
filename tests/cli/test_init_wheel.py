"""`chipload init` of a model of a whole wheel: hub, shroud and sections are cut out of it, and the job passes check."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import trimesh
from typer.testing import CliRunner

from chipload.cli.app import app
from chipload.geometry.sections import AXES
from chipload.jobs import check_job, load_job
from chipload.jobs.impeller.part import read_part
from wheel_mesh import axial, radial, wheel_mesh, with_splitter


def init(folder: Path, mesh: trimesh.Trimesh, scale: float, axis: str) -> tuple[int, str]:
    """Write a wheel about an axis of the file in a unit, and draft its job."""
    p = np.asarray(mesh.vertices)[:, np.argsort(AXES[axis])] / scale
    trimesh.Trimesh(p, mesh.faces, process=False).export(folder / "wheel.stl")
    ran = CliRunner().invoke(app, ["init", str(folder / "wheel.stl"), str(folder / "job")])
    return ran.exit_code, " ".join(ran.output.split())


def test_a_wheel_becomes_an_impeller_job(tmp_path: Path) -> None:
    """Blades, unit and axis are found; the blade of the job is that of the formula that the mesh was made from."""
    wheel = radial(5)
    code, said = init(tmp_path, wheel_mesh((wheel,), along=49, up=9, round_axis=120), 25.4, "x")
    assert code == 0, said
    assert "a wheel about x, cut into 14 sections: the blade through them leaves the vertices of" in said
    tables = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert tables["impeller"]["blades"] == 5
    assert tables["impeller"]["sections"]["axis"] == "x"
    assert "its wheel was read in inch" in (tmp_path / "job" / "job.toml").read_text()
    loaded = load_job(tmp_path / "job" / "job.toml")
    part = read_part(loaded.job)
    assert part.faces[0] == "flow: against the axis of the files, by the hub, whose narrow end is up"
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.04, 0.96, 15), np.linspace(0.0, 1.0, 7), indexing="ij"))
    blade = part.impeller.blade
    for sign, side in ((1, blade.plus), (-1, blade.minus)):
        assert wheel.off(side.at(u, v), sign).max() < 0.04


def test_a_wheel_with_splitters_passes_check(tmp_path: Path) -> None:
    code, said = init(tmp_path, wheel_mesh(with_splitter(radial(4)), along=41, up=9, round_axis=90), 1.0, "z")
    assert code == 0, said
    loaded = load_job(tmp_path / "job" / "job.toml")
    lines, _ = check_job(loaded)
    assert "impeller: 4 blades and as many splitters" in lines
    assert any("no cutter is too short" in line for line in lines)


def test_a_rotor_for_axial_flow(tmp_path: Path) -> None:
    """Its hub widens a little along the flow: the narrow end is up."""
    code, said = init(tmp_path, wheel_mesh((axial(5),), along=41, up=9, round_axis=90), 1.0, "y")
    assert code == 0, said
    part = read_part(load_job(tmp_path / "job" / "job.toml").job)
    assert part.faces[0] == "flow: against the axis of the files, by the hub, whose narrow end is up"


def test_a_wheel_with_a_shroud_is_refused(tmp_path: Path) -> None:
    ring = trimesh.creation.annulus(58.0, 66.0, 30.0, sections=90)
    ring.apply_translation([0.0, 0.0, 15.0])
    whole = trimesh.util.concatenate([wheel_mesh((axial(5),), along=41, up=9, round_axis=90), ring])
    code, said = init(tmp_path, whole, 1.0, "z")
    assert code == 2
    assert "wheel.stl: a wheel about z: 5 blades stand between two surfaces of revolution" in said
    assert "leave the shroud out of the model" in said
