"""The flank pass of an impeller's blade with five axes: its chip at the slider's step, as GLB and as VTK."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import chipload
import chipload.examples
from chipload.cli import app
from chipload.planning.impeller.parametric import ImpellerShape, impeller_of
from report.test_export import read_vtk
from web_lists import VIEW
from web_served import Served

SHORTER = ("operation.0.step_mm=3", "stock.layer_mm=1")
PANEL = "chiploadViewer.cut(document.querySelector('.cl-cut').id, document.querySelector('.cl-stage').id)"


@pytest.fixture(scope="module")
def blade(tmp_path_factory) -> Path:
    """A folder that holds the result and its export."""
    folder = tmp_path_factory.mktemp("blade")
    shutil.copytree(Path(chipload.examples.__file__).parent / "chips", folder / "chips")
    words = [word for key in SHORTER for word in ("--set", key)]
    job, out = folder / "chips" / "blade.toml", folder / "result"
    done = CliRunner().invoke(app, ["run", str(job), "--out", str(out), *words])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(app, ["export", str(out), "--out", str(folder / "export"), "--vtk", "--glb"])
    assert done.exit_code == 0, done.output
    return folder


def allowance() -> float:
    """The volume [mm3] of 0.5 mm off the side above where the flank ends, and of what the corner takes below.

    A corner of 1 mm draws back by 1 - sqrt(1 - h^2) at h below its flank: it cuts down to h = sin 60 deg.
    """
    side = impeller_of(ImpellerShape()).bodies[0].plus
    u, v = np.linspace(0.6, 0.92, 121), np.linspace(0.35, 1.0, 121)
    p = side.at(*(c.ravel() for c in np.meshgrid(u, v, indexing="ij"))).reshape(121, 121, 3)
    across = np.cross(p[1:, :-1] - p[:-1, :-1], p[:-1, 1:] - p[:-1, :-1])
    corner = 0.5 * (np.pi / 3.0 + np.sin(np.pi / 3.0) * 0.5) - 0.5 * np.sin(np.pi / 3.0)
    end = float(np.linalg.norm(np.diff(p[:, 0], axis=0), axis=1).sum())
    return 0.5 * float(np.linalg.norm(across, axis=2).sum()) + corner * end


def test_the_chips_are_the_allowance_of_the_side(blade) -> None:
    result = chipload.load_result(blade / "result")
    columns = result.tracks[0].columns
    assert columns["chip_volume_mm3"].sum() == pytest.approx(allowance(), rel=0.01)
    # the axis turns by some 50 degrees while it cuts
    cuts = columns["chip_volume_mm3"] > 0.0
    axis = np.column_stack([columns[f"axis_{x}"] for x in "xyz"])[cuts]
    assert np.degrees(np.arccos((axis[0] * axis[-1]).sum())) > 30.0


def test_its_chips_are_closed_bodies_in_both_formats(blade) -> None:
    whole = chipload.load_result(blade / "result").tracks[0].columns["chip_volume_mm3"].sum()
    table = read_vtk(blade / "export" / "chips-program.vtu")
    scene = trimesh.load(blade / "export" / "chips-program.glb")
    assert set(scene.geometry) == {f"chip-{n}" for n in np.unique(table["chip"])}
    assert len(scene.geometry) > 5
    # rays against polygons on layers
    assert sum(body.volume for body in scene.geometry.values()) == pytest.approx(whole, rel=0.04)


def test_the_page_shows_the_chip_of_a_tooth_at_the_step(blade, browser) -> None:
    columns = chipload.load_result(blade / "result").tracks[0].columns
    row = int(np.argmax(columns["chip_volume_mm3"]))
    served = Served(blade)
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    try:
        page.set_default_timeout(120_000)
        page.goto(served.address("?show=result"))
        page.wait_for_selector(".cv-ramp")
        page.wait_for_selector(".cl-now")
        page.locator(".cl-tabs").get_by_text("cut", exact=True).click()
        page.wait_for_selector(".cv-cut-said")
        page.evaluate(f"{VIEW}.go({row})")
        page.wait_for_function(f"r => {PANEL}.state()?.row == r", arg=row)
        state = page.evaluate(f"{PANEL}.state()")
        # three teeth cut alike; in the step the spindle turns by duration x 4000 / 60
        assert state["teeth"] == [-1]
        chips = 3.0 * 4000.0 / 60.0 * columns["duration_s"][row]
        assert state["volume"][0] * chips == pytest.approx(columns["chip_volume_mm3"][row], rel=0.05)
        assert state["thickest"][0] == pytest.approx(columns["chip_max_mm"][row], rel=1e-3)
        # the work turns about Z, then about Y, so that the tool stands upright
        page.locator(".cl-layers").get_by_text("tool upright").click()
        page.wait_for_function(f"{VIEW}.upright")
        turned = np.array(page.evaluate(f"{VIEW}.work.matrixWorld.elements")).reshape(4, 4).T[:3, :3]
        axis = np.array([columns[f"axis_{x}"][row] for x in "xyz"])
        assert turned @ axis == pytest.approx([0.0, 0.0, 1.0], abs=1e-5)
        assert turned @ np.cross([0.0, 0.0, 1.0], axis) == pytest.approx([0.0, np.hypot(*axis[:2]), 0.0], abs=1e-5)
    finally:
        page.close()
        served.end()
