"""Programs of a leaning and turning axis by moves: against the upright engine turned in space, layers, volume lost."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material, material_named
from chipload.engagement.tooth_surfaces import BEYOND, TIP, UNLIKE
from chipload.errors import Cancelled
from chipload.program.build import rapid, rows
from chipload.program.program import LINE, Program
from chipload.simulation.accuracy import LEANING_MOVES_FLOOR
from chipload.simulation.checkpoint import Checkpoint
from chipload.simulation.chips import remove
from chipload.simulation.chunks import remove_in_chunks
from chipload.simulation.removal import Removal, Resolution
from chipload.stock.layers import LayeredStock
from layer_oracle.removal import remove_by_layers

Floats = NDArray[np.float64]
MILL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
BALL = Cutter(8.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=4.0, runout=(0.01, 0.3))
FINE = Resolution(step_mm=1.0, tolerance=0.001, corner_slices=24, flank_mm=2.5)
ALLOY = replace(material_named("al7075-t6"), spread=0.05)
LOW, HIGH = np.array([0.0, 0.0, -8.0]), np.array([30.0, 24.0, 0.0])


def path(points: Any, axes: Any, tool: int = 1, speed: float = 300.0) -> Program:
    """Lines from point to point at 20 mm/s, a rapid to the first; one axis for all or one a point."""
    p = np.asarray(points, dtype=float)
    a = np.broadcast_to(np.asarray(axes, dtype=float), p.shape)
    a = a / np.linalg.norm(a, axis=1)[:, None]
    cut = rows([LINE] * (len(p) - 1), p[1:].tolist(), (0.0, 0.0), 20.0, speed, tool, "cut")
    program = Program.join([rapid(p[0].tolist(), speed, tool, "link"), cut])
    return replace(program, axis=a)


def block(layer: float = 0.5) -> LayeredStock:
    return LayeredStock.block(LOW, HIGH, layer, 20.0)


def run(program: Program, stock: LayeredStock | None = None, **more: Any) -> Removal:
    return remove(program, stock or block(), {1: MILL, 2: BALL}, ALLOY, FINE, **more)


def waving(tool: int = 1) -> Program:
    """Rows whose axis leans by up to 17 degrees and turns by up to 2 degrees a mm."""
    x = np.linspace(-6.0, 36.0, 22)
    points = [[a, y, -2.0 + 0.3 * math.sin(0.3 * a)] for k, y in enumerate((6.0, 9.0)) for a in (x, x[::-1])[k % 2]]
    axes = [[0.2 * math.sin(0.1 * p[0]), 0.2 * math.cos(0.13 * p[0]), 1.0] for p in points]
    return path(points, axes, tool)


@pytest.mark.parametrize(
    ("tool", "speed", "degrees"),
    [(1, 300.0, 35.0), (1, -300.0, 35.0), (2, 300.0, 35.0), (2, -300.0, 35.0), (1, 300.0, 90.0), (2, 300.0, 90.0),
     (1, 300.0, 125.0), (2, 300.0, 180.0)],
)  # fmt: skip
def test_loads_of_a_turned_program_are_those_of_the_upright_one(tool: int, speed: float, degrees: float) -> None:
    """Body, points and axis turned, until the tool lies or comes from below: sizes stay, directions turn."""
    points = [[-8.0, 8.0, -1.5], [12.0, 8.0, -1.5], [20.0, 13.0, -1.5], [20.0, 20.0, -2.5], [2.0, 15.0, -2.5]]
    upright = run(path(points, [0.0, 0.0, 1.0], tool, speed), accuracy=False).columns
    a = math.radians(degrees)
    R = np.array([[math.cos(a), 0.0, math.sin(a)], [0.0, 1.0, 0.0], [-math.sin(a), 0.0, math.cos(a)]])
    box = trimesh.creation.box(bounds=[LOW, HIGH])
    body = trimesh.Trimesh(np.asarray(box.vertices) @ R.T, box.faces)
    stock = LayeredStock.of_mesh(body, 1.0, 40.0)
    turned = run(path(np.array(points) @ R.T, R[:, 2], tool, speed), stock=stock, accuracy=False)
    assert turned.findings == ()
    # steps in full contact: of those that enter each engine looks at other instants
    k = np.r_[14:19, 30:34, 45:55]
    for name in ("force_n", "torque_nm", "torque_mean_nm", "power_w", "chip_volume_mm3", "chip_max_mm", "torque_sd_nm"):
        np.testing.assert_allclose(turned.columns[name][k], upright[name][k], rtol=0.02, err_msg=name)
        assert np.median(np.abs(turned.columns[name][k] / upright[name][k] - 1.0)) < 3e-3
    mean = np.column_stack([upright[f"force_{x}_mean_n"][k] for x in "xyz"]) @ R.T
    found = np.column_stack([turned.columns[f"force_{x}_mean_n"][k] for x in "xyz"])
    np.testing.assert_allclose(found, mean, atol=0.01 * np.abs(mean).max())


@pytest.mark.parametrize("tool", [1, 2])
def test_work_of_the_torque_is_ktc_times_the_volume_that_the_stock_lost(tool: int) -> None:
    """At 1 mm/s, where teeth run on circles: with chips between trochoids feed over radius, 0.3 % of the ball, is
    missing, as the feed drive does some of the work and the motion along the axis counts in first order. The work of
    the front has no such share at any feed.
    """
    plain = Material("plain", 900.0, 300.0, 100.0, 0.0, 0.0, 0.0, source="made up")
    quick = waving(tool)
    slow = replace(quick, feed=np.where(np.isfinite(quick.feed), quick.feed / 20.0, quick.feed))
    for program, name, factor in ((slow, "torque_mean_nm", 300.0), (quick, "cutting_work_j", 1.0)):
        removal = remove(program, block(0.05), {1: MILL, 2: BALL}, plain, FINE, accuracy=False)
        columns, lost = removal.columns, removal.volume_before - removal.volume_after
        seconds = columns["seconds"] if name == "torque_mean_nm" else 1.0
        work = (1e3 * columns[name] * factor * seconds).sum()
        assert columns["chip_volume_mm3"].sum() == pytest.approx(lost, rel=5e-3)
        assert work == pytest.approx(900.0 * lost, rel=5e-3)
        np.testing.assert_allclose(columns["engaged_volume_mm3"], columns["chip_volume_mm3"], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("tool", [1, 2])
def test_work_of_the_torque_at_a_large_feed_is_within_the_stated_error(tool: int) -> None:
    """0.1 and 0.2 mm a tooth: Ktc times the volume, up to the error of the mean torque."""
    plain = Material("plain", 900.0, 300.0, 100.0, 0.0, 0.0, 0.0, source="made up")
    removal = remove(waving(tool), block(0.05), {1: MILL, 2: BALL}, plain, FINE)
    columns, lost = removal.columns, removal.volume_before - removal.volume_after
    work = (1e3 * columns["torque_mean_nm"] * 300.0 * columns["seconds"]).sum()
    assert abs(work / (900.0 * lost) - 1.0) < min(removal.resolution_error["torque_mean_nm"], 0.05)


def test_layers_find_the_same_loads() -> None:
    """Thin layers and many slices, in the steps of the first row, which are deep: in shallow ones layers are coarse."""
    fine = replace(FINE, corner_slices=48, bottom_slices=12, flank_mm=0.5)
    one = run(waving(), accuracy=False).columns
    two = remove_by_layers(waving(), block(0.1), {1: MILL}, ALLOY, fine).columns
    k = np.arange(18, 40)
    for name, most in (("chip_volume_mm3", 0.005), ("force_n", 0.05), ("torque_nm", 0.05), ("torque_mean_nm", 0.04)):
        error = np.abs(one[name][k] / two[name][k] - 1.0)
        assert np.median(error) < 0.5 * most, name
        assert error.max() < most, name


def test_accuracy_of_a_run_with_a_turning_axis() -> None:
    """Runout adds what the chips of a ball leave out: 0.002 + 0.07 x + 4 x^2, x = e / ae, at most 1."""
    removal, plain = (run_of_ball(replace(BALL, runout=runout)) for runout in (BALL.runout, (0.0, 0.0)))
    for one in (removal, plain):
        assert abs(one.energy_balance[2]) < 1e-6
    error = plain.resolution_error["force_n"]
    assert LEANING_MOVES_FLOOR["force_n"] <= error < 0.3
    more = removal.resolution_error["force_n"] - error
    x = 0.01 / BALL.diameter
    assert more == pytest.approx(UNLIKE + TIP * x + BEYOND * x * x, abs=0.01)


def run_of_ball(ball: Cutter) -> Removal:
    return remove(waving(2), block(), {2: ball}, ALLOY, FINE)


def test_a_program_again_cuts_nothing() -> None:
    program = waving()
    back = replace(program, axis=program.axis[::-1].copy(), p_work=program.p_work[::-1].copy())
    twice = Program.join([program, back])
    columns = run(twice, accuracy=False).columns
    n = len(columns["line"]) // 2
    assert columns["chip_volume_mm3"][:n].sum() > 100.0
    assert columns["chip_volume_mm3"][n + 2 :].sum() == 0.0


def test_a_run_that_was_stopped_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chipload.simulation.chips.BLOCK", 2)
    stock = block()
    known = remove(waving(), stock, {1: MILL}, ALLOY, FINE)

    def stop(done: float, what: str) -> None:
        if done > 0.5:
            raise Cancelled("stopped")

    with pytest.raises(Cancelled), Checkpoint(tmp_path / "run", 0.0) as kept:
        remove_in_chunks(waving(), block(), {1: MILL}, ALLOY, FINE, kept, progress=stop)
    again = block()
    with Checkpoint(tmp_path / "run", 0.0) as kept:
        found = remove_in_chunks(waving(), again, {1: MILL}, ALLOY, FINE, kept)
        for name, values in known.columns.items():
            np.testing.assert_array_equal(np.asarray(found.columns[name]), values, err_msg=name)
    assert again.to_bytes() == stock.to_bytes()


def test_the_shank_of_a_leaning_cutter_stands_in_what_is_above_its_flutes() -> None:
    """The lowest point of a circle of the shank leaves the block at (3 + r sin) / cos along the axis."""
    short = replace(MILL, flute_length=2.0)
    program = path([[-8.0, 12.0, -3.0], [20.0, 12.0, -3.0]], [0.1, 0.0, 1.0])
    found = remove(program, block(), {1: short}, ALLOY, FINE, accuracy=False).columns
    lean, r = math.atan(0.1), 5.0 - 4.0 * FINE.tolerance
    known = (3.0 + r * math.sin(lean)) / math.cos(lean) - 2.0
    assert found["axial_overrun_mm"].max() == pytest.approx(known, abs=1e-6)
