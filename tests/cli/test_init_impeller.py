"""Drafts of impellers: a known wheel written as others write it, drafted, and read back by the job."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from typer.testing import CliRunner

from chipload.cli.app import app
from chipload.geometry.bspline import BSplinePatch
from chipload.geometry.sections import Blade
from chipload.jobs import check_job, load_job
from chipload.jobs.drafts.make import draft_of
from chipload.jobs.impeller.part import read_part
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of

WHEEL = impeller_of(ImpellerShape())
#: order of x y z in a file whose axis of rotation is another one
ORDER = {"X": (2, 0, 1), "Z": (0, 1, 2)}


def profile(blade: Blade, v: float) -> np.ndarray:
    """A closed section with pointed edges: both sides meet at their mean."""
    u = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, 121))
    plus, minus = blade.plus.at(u, v), blade.minus.at(u, v)
    ends = 0.5 * (plus[[0, -1]] + minus[[0, -1]])
    return np.concatenate([ends[:1], plus[1:-1], ends[1:], minus[-2:0:-1]])


def write_row(folder: Path, axis: str, over: bool, splitter: bool = False) -> Path:
    """The wheel in centimetres about an axis, the flow along it where it is turned over."""
    side = np.array([1.0, -1.0, -1.0]) if over else np.ones(3)
    bodies = [WHEEL.blade, *([WHEEL.blade.turned(0.5 * WHEEL.pitch)] if splitter else [])]
    lines = []
    for name, blade in zip(("Main Blade", "Splitter Blade 1"), bodies, strict=False):
        lines += [f"## {name}"] * splitter
        for k, v in enumerate(np.linspace(0.0, 1.0, 7)):
            rows = 0.1 * (profile(blade, v) * side)[:, ORDER[axis]]
            lines += [f"# Profile {k}", *(" ".join(f"{x:.8f}" for x in p) for p in rows)]
    (folder / "profile.curve").write_text("\n".join(lines) + "\n")
    for name, curve in (("hub", WHEEL.hub), ("shroud", WHEEL.shroud)):
        p = curve.at(np.linspace(0.0, 1.0, 61), np.zeros(61)) * side
        np.savetxt(folder / f"{name}.curve", 0.1 * p[:, ORDER[axis]], fmt="%.8f")
    keys = {
        "Axis of Rotation": axis, "Number of Blade Sets": 11, "Number of Blades Per Set": 1 + splitter,
        "Geometry Units": "CM", "Hub Data File": "hub.curve", "Shroud Data File": "shroud.curve",
        "Profile Data File": "profile.curve",
    }  # fmt: skip
    (folder / "BladeGen.inf").write_text("! export\n" + "".join(f"{k}: {v}\n" for k, v in keys.items()))
    return folder / "BladeGen.inf"


def farthest(found: BSplinePatch, stated: BSplinePatch) -> float:
    """Greatest distance [mm] of the middle of a side from the other one's points."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 1201), np.linspace(0.0, 1.0, 61), indexing="ij"))
    a, b = (x.ravel() for x in np.meshgrid(np.linspace(0.1, 0.9, 31), np.linspace(0.0, 1.0, 61)[::5], indexing="ij"))
    return float(cKDTree(stated.at(u, v)).query(found.at(a, b))[0].max())


@pytest.mark.parametrize(("axis", "over"), [("Z", False), ("Z", True), ("X", True)])
def test_a_row_of_bladegen_becomes_an_impeller_job(tmp_path: Path, axis: str, over: bool) -> None:
    """Number of blades, unit, axis and flow as the files have them: the blade is where it was."""
    file = write_row(tmp_path, axis, over)
    ran = CliRunner().invoke(app, ["init", str(file), str(tmp_path / "job")])
    assert ran.exit_code == 0, ran.output
    tables = tomllib.loads((tmp_path / "job" / "job.toml").read_text())
    assert tables["impeller"]["blades"] == 11
    assert tables["impeller"]["sections"].get("axis", "z") == axis.lower()
    assert "flow_along_x" not in tables["impeller"]["sections"]
    part = read_part(load_job(tmp_path / "job" / "job.toml").job)
    assert part.faces[0].startswith(f"flow: {'along' if over else 'against'} the axis of the files")
    for found, stated in ((part.impeller.blade.plus, WHEEL.blade.plus), (part.impeller.blade.minus, WHEEL.blade.minus)):
        assert farthest(found, stated) < 0.1


def test_main_blade_and_splitter_of_one_file(tmp_path: Path) -> None:
    file = write_row(tmp_path, "Z", False, splitter=True)
    ran = CliRunner().invoke(app, ["init", str(file), str(tmp_path / "job")])
    assert ran.exit_code == 0, ran.output
    loaded = load_job(tmp_path / "job" / "job.toml")
    bodies = read_part(loaded.job).impeller.bodies
    assert len(bodies) == 2
    assert len(loaded.job.table.surface) == 6
    assert farthest(bodies[1].plus, WHEEL.blade.plus.turned(0.5 * WHEEL.pitch)) < 0.1


def test_the_draft_passes_check(tmp_path: Path) -> None:
    """Its cutters fit, its gouge is what the thin edges allow, and each guess is named."""
    file = write_row(tmp_path, "Z", True)
    assert CliRunner().invoke(app, ["init", str(file), str(tmp_path / "job")]).exit_code == 0
    loaded = load_job(tmp_path / "job" / "job.toml")
    assert any("catalogue.file" in guess for guess in loaded.guesses)
    lines, _ = check_job(loaded)
    assert any(line.startswith("catalogue draft: ") for line in lines)
    assert any("no cutter is too short" in line for line in lines)


def test_the_blades_of_a_blade3d_file_are_those_of_its_input(tmp_path: Path) -> None:
    """The input of the same case beside it states how many there are; that of another case is not read."""
    v = np.linspace(0.0, 1.0, 5)
    rows = np.array([profile(WHEEL.blade, x) for x in v])[..., [2, 0, 1]]
    lines = [f"{rows.shape[1]} {len(v)}", *(" ".join(f"{x:.8f}" for x in p) for p in rows.reshape(-1, 3))]
    (tmp_path / "blade3d.mine.dat").write_text("\n".join(lines) + "\n")
    for name, case, count in (("3dbgbinput.1.dat", "other", 7), ("3dbgbinput.2.dat", "Mine", 11)):
        (tmp_path / name).write_text(f" Input parameters\n {case}\n Number of blades in this row:\n   {count}\n")
    draft = draft_of(tmp_path / "blade3d.mine.dat", tmp_path / "job")
    part, sections = draft.tables[:2]
    assert (part.entries[0].value, part.entries[0].note, part.entries[0].guess) == (11, "of 3dbgbinput.2.dat", False)
    assert {e.key: e.value for e in sections.entries}["unit"] == "mm"
