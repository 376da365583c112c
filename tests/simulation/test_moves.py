"""Programs simulated by moves: loads in closed form, streaming, resume, the shank, the stock that is left."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_along
from chipload.cutting.material import Material, material_named
from chipload.errors import Cancelled
from chipload.program.build import rapid, rows
from chipload.program.program import LINE, Program
from chipload.simulation.accuracy import COMPARED, MOVES_FLOOR, WITH_FORCE
from chipload.simulation.checkpoint import Checkpoint
from chipload.simulation.chips import remove
from chipload.simulation.chunks import remove_in_chunks
from chipload.simulation.loads import (
    BANDS,
    LOADS,
    Cuts,
    greatest_loads,
    over_turn,
)
from chipload.simulation.removal import Removal, Resolution
from chipload.stock.layers import LayeredStock
from layer_oracle.loads import StepEngagement, loads_of_steps
from layer_oracle.removal import remove_by_layers

Floats = NDArray[np.float64]
MILL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
BALL = Cutter(8.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=4.0, runout=(0.01, 0.3))
FINE = Resolution(step_mm=1.0, tolerance=0.001, corner_slices=24, flank_mm=2.5)
ALLOY = replace(material_named("al7075-t6"), spread=0.05)
LOW, HIGH = (0.0, 0.0, -8.0), (40.0, 30.0, 0.0)


def block(layer: float = 0.5) -> LayeredStock:
    return LayeredStock.block(LOW, HIGH, layer, 20.0)


def path(points: Any, tool: int = 1, speed: float = 300.0, feed: float = 20.0) -> Program:
    """Lines from point to point, a rapid to the first."""
    p = np.asarray(points, dtype=float).tolist()
    cut = rows([LINE] * (len(p) - 1), p[1:], (0.0, 0.0), feed, speed, tool, "cut")
    return Program.join([rapid(p[0], speed, tool, "link"), cut])


def zigzag() -> Program:
    """A face by the mill, a plunge and a slot, then rows of the ball over a wave."""
    x = np.linspace(-6.0, 46.0, 40)
    face = [[float(a), float(y), -1.0] for k, y in enumerate((2.0, 8.0, 14.0)) for a in (x if k % 2 == 0 else x[::-1])]
    one = path([*face, [20.0, 20.0, 1.0], [20.0, 20.0, -3.0], [30.0, 24.0, -3.5]])
    wave = [
        [float(a), 16.0 + 0.5 * k, -2.0 + 0.5 * math.sin(a / 5.0)]
        for k in range(6)
        for a in (x if k % 2 == 0 else x[::-1])
    ]
    return Program.join([one, rapid([20.0, 20.0, 9.0], 300.0, 1, "link"), path(wave, 2)])


def run(program: Program, stock: LayeredStock | None = None, **more: Any) -> Removal:
    return remove(program, stock or block(), {1: MILL, 2: BALL}, ALLOY, FINE, **more)


def run_by_layers(program: Program, stock: LayeredStock | None = None, **more: Any) -> Removal:
    return remove_by_layers(program, stock or block(), {1: MILL, 2: BALL}, ALLOY, FINE, **more)


def test_a_slot_costs_what_the_straight_flank_costs() -> None:
    columns = run(path([[-8.0, 15.0, -3.0], [30.0, 15.0, -3.0]])).columns
    known = forces_along(
        [0.0], [math.pi], 20.0 * math.tau / 4 / 300.0, [[1.0, 0.0]], MILL, ALLOY, 3.0, spindle_speed=300.0
    )
    k = 30
    for name in ("torque_mean_nm", "power_w", "chip_max_mm"):
        assert columns[name][k] == pytest.approx(float(known[name][0]), rel=1e-9)
    assert columns["torque_nm"][k] == pytest.approx(float(known["torque_nm"][0]), rel=1e-3)
    for axis in "xyz":
        assert columns[f"force_{axis}_mean_n"][k] == pytest.approx(float(known[f"force_{axis}_mean_n"][0]), rel=1e-9)
    assert columns["chip_volume_mm3"][k] == pytest.approx(10.0 * 3.0 * 1.0, rel=1e-9)
    assert columns["force_normal_n"][k] == 0.0


@pytest.mark.parametrize("speed", [300.0, -300.0])
def test_both_engines_agree_on_a_straight_flank(speed: float) -> None:
    """A side cut of 2 mm by a flat mill, on which the layers are exact."""
    program = path([[-8.0, -3.0, -4.0], [30.0, -3.0, -4.0]], speed=speed)
    one, two = run(program).columns, run_by_layers(program).columns
    k = slice(20, 36)
    for name in two:
        scale = np.abs(two[name][k]).max() if two[name].dtype.kind == "f" else 1.0
        np.testing.assert_allclose(one[name][k], two[name][k], rtol=1e-3, atol=2e-3 * scale, err_msg=name)


def test_work_of_the_torque_is_ktc_times_the_volume_that_the_stock_lost() -> None:
    plain = Material("plain", 900.0, 300.0, 100.0, 0.0, 0.0, 0.0, source="made up")
    stock = block(0.02)
    removal = remove(zigzag(), stock, {1: MILL, 2: BALL}, plain, FINE)
    work = 1e3 * removal.columns["cutting_work_j"].sum()
    lost = removal.volume_before - removal.volume_after
    assert removal.volume_before == pytest.approx(40.0 * 30.0 * 8.0)
    assert work == pytest.approx(900.0 * lost, rel=5e-3)
    assert removal.columns["chip_volume_mm3"].sum() == pytest.approx(lost, rel=5e-3)


def test_a_program_again_cuts_nothing() -> None:
    program = path([[-8.0, 15.0, -3.0], [30.0, 15.0, -3.0], [30.0, 20.0, -3.0]])
    back = [rapid(p, 300.0, 1, "link") for p in ([30.0, 20.0, 9.0], [-8.0, 15.0, 9.0])]
    twice = Program.join([program, *back, program])
    columns = run(twice).columns
    n = len(columns["line"]) // 2
    assert columns["chip_volume_mm3"][:n].sum() > 100.0
    assert columns["chip_volume_mm3"][n:].sum() == 0.0
    assert columns["force_n"][n:].max() == 0.0


def test_a_rapid_through_material_is_found() -> None:
    program = Program.join([path([[-8.0, 5.0, -1.0], [20.0, 5.0, -1.0]]), rapid([20.0, 20.0, -1.0], 300.0, 1, "link")])
    assert [f.code for f in run(program).findings] == ["rapid-cuts"]


def test_a_spindle_at_rest_is_found() -> None:
    found = run(path([[-8.0, 5.0, -1.0], [20.0, 5.0, -1.0]], speed=0.0)).findings
    assert [f.code for f in found] == ["machine-spindle-off"]


def leaning() -> Program:
    program = path([[-8.0, 5.0, -1.0], [20.0, 5.0, -1.0]])
    axis = np.array(program.axis)
    axis[1] = (0.1, 0.0, math.sqrt(0.99))
    return replace(program, axis=axis)


def test_a_shank_stands_in_what_is_above_the_flutes() -> None:
    """Flutes of 2 mm, 3 mm deep: they cut 2 mm of the height as if the stock began there, and the shank 1 mm rubs."""
    short = replace(MILL, flute_length=2.0)
    program = path([[-8.0, 15.0, -3.0], [30.0, 15.0, -3.0]])
    stock = block()
    found = remove(program, stock, {1: short}, ALLOY, FINE).columns
    low = LayeredStock.block(LOW, (*HIGH[:2], -1.0), 0.5, 20.0)
    known = remove(program, low, {1: short}, ALLOY, FINE).columns
    cutting, whole = known["chip_volume_mm3"] > 0.0, known["x_mm"] > 6.0
    np.testing.assert_allclose(found["chip_volume_mm3"][whole], 2.0 * 10.0 * 1.0, rtol=1e-6)
    for name in ("force_n", "torque_nm"):
        np.testing.assert_allclose(found[name][whole], known[name][whole], rtol=2e-3, err_msg=name)
    assert (known["axial_overrun_mm"] == 0.0).all()
    # a step that ends with its front in the block has its shank there
    np.testing.assert_allclose(found["axial_overrun_mm"][cutting], 1.0, atol=1e-6)
    assert stock.volume() == pytest.approx(stock.volumes().sum(), rel=1e-12)
    # what stands above the flutes stays
    assert stock.volumes()[-2:] == pytest.approx([40.0 * 30.0 * 0.5] * 2)


def test_a_neck_has_room_where_material_stands_above_the_flutes() -> None:
    """A neck that is narrower by more than the cut is wide does not rub; one that is not stands in the wall by 1 mm."""
    side = path([[-8.0, HIGH[1] + 4.0, -3.0], [45.0, HIGH[1] + 4.0, -3.0]])  # 1 mm wide
    for neck, overrun in ((7.0, 0.0), (9.0, 1.0)):
        short = replace(MILL, flute_length=2.0, shank_diameter=neck)
        found = remove(side, block(), {1: short}, ALLOY, FINE).columns
        assert found["axial_overrun_mm"].max() == pytest.approx(overrun, abs=1e-6)
        whole = (found["x_mm"] > 1.0) & (found["x_mm"] < 36.0)
        np.testing.assert_allclose(found["chip_volume_mm3"][whole], 2.0 * 1.0 * 1.0, rtol=1e-3)


def test_a_mesh_is_cut_as_its_box() -> None:
    mesh = trimesh.creation.box(bounds=[LOW, HIGH])
    one = run(zigzag()).columns
    two = run(zigzag(), stock=LayeredStock.of_mesh(mesh, 0.5, 20.0)).columns
    np.testing.assert_allclose(two["force_n"], one["force_n"], atol=1e-5 * one["force_n"].max())


def test_the_layers_that_are_left_are_those_of_the_layered_engine() -> None:
    one, two = block(), block()
    run(zigzag(), stock=one)
    run_by_layers(zigzag(), two)
    for a, b in zip(one.volumes(), two.volumes(), strict=True):
        assert a == pytest.approx(b, abs=2e-3 * 40.0 * 30.0 * 0.5)
    for i in range(0, one.layers, 3):
        assert one.section(i).symmetric_difference(two.section(i)).area < 2.0


def all_bytes(removal: Removal, stock: LayeredStock) -> list[bytes]:
    c = removal.columns
    whole = [removal.volume_before, removal.volume_after, removal.mean_band, removal.findings]
    return [repr(whole).encode(), stock.to_bytes(), *(np.ascontiguousarray(c[k]).tobytes() for k in c)]


def test_workers_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chipload.simulation.chips.BLOCK", 3)
    # blocks of 24 steps, which 4 threads share
    monkeypatch.setattr("chipload.simulation.strips.FEWEST", 1)
    every = []
    for workers in (1, 2, 4):
        stock = block()
        removal = run(zigzag(), stock=stock, keep=True, watch=watch, workers=workers)
        every.append(all_bytes(removal, stock))
        assert removal.columns["chip_volume_mm3"].any()
    assert every[0] == every[1] == every[2]


def watch(cuts: Cuts) -> dict[str, Floats]:
    return {"own": cuts.plain.chip_max() + cuts.ends[:, 0]}


@pytest.mark.parametrize("flutes", [20.0, 2.9])
def test_a_run_that_was_stopped_goes_on_with_the_same_bytes(
    tmp_path: Path, flutes: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chipload.simulation.chips.BLOCK", 8 if flutes > 3.0 else 64)
    monkeypatch.setattr("chipload.simulation.strips.FEWEST", 1)
    cutters = {1: replace(MILL, flute_length=flutes), 2: BALL}
    stock = block()
    whole = remove(zigzag(), stock, cutters, ALLOY, FINE, watch=watch)
    known = all_bytes(whole, stock)
    assert (whole.columns["axial_overrun_mm"].max() > 0.0) == (flutes < 3.0)
    for _ in range(40):
        calls = 0

        def stop(done: float, what: str) -> None:
            nonlocal calls
            calls += 1
            if calls == 4:
                raise Cancelled("stopped")

        again = block()
        try:
            with Checkpoint(tmp_path / "run", 0.0) as kept:
                found = remove_in_chunks(zigzag(), again, cutters, ALLOY, FINE, kept, watch=watch, progress=stop)
                assert all_bytes(found, again) == known
                return
        except Cancelled:
            continue
    raise AssertionError("never done")


@pytest.fixture
def one_instant(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every short step is looked at in its middle alone."""
    monkeypatch.setattr("chipload.engagement.moves.stock.MORE", (1, 1))


@pytest.mark.usefixtures("one_instant")
def test_what_a_watch_gets_gives_the_same_loads() -> None:
    """The kept engagement of a step at one instant gives the loads of the step and their bands."""
    removal = run(zigzag(), keep=True)
    for cuts in removal.cuts:
        loads = greatest_loads(cuts, ALLOY, FINE.rotation, bands=True)
        assert set(BANDS) < set(loads)
        columns = dict(removal.columns)
        columns["force_axial_n"] = np.maximum(columns["force_z_max_n"], -columns["force_z_min_n"])
        for name, values in loads.items():
            np.testing.assert_allclose(values, columns[name][cuts.step], rtol=1e-6, atol=1e-9, err_msg=name)


@pytest.mark.usefixtures("one_instant")
@pytest.mark.parametrize("tool", [0, 1])
def test_every_load_is_that_of_the_layered_engine_for_the_same_engagement(tool: int) -> None:
    """All columns of loads, work and engaged volume from the rows of one engine by the code of the other; tool 1 has
    runout. The surface that is left is known to each in its own way and is tested elsewhere.
    """
    removal = run(zigzag(), keep=True)
    cuts = removal.cuts[tool]
    engagement, seconds = cuts.engagement, removal.columns["seconds"][cuts.step]
    parts = [
        StepEngagement(k, engagement.frame[k], engagement.rows[a:b], engagement.slice[a:b])  # type: ignore[index]
        for k, (a, b) in enumerate(itertools.pairwise(engagement.start.tolist()))
    ]
    turn = over_turn(engagement, cuts.cutter, ALLOY, FINE.rotation)
    known = loads_of_steps(cuts.plain, engagement, parts, cuts.cutter, ALLOY, turn, cuts.spindle, seconds)
    for i, name in enumerate(LOADS):
        if name != "force_normal_n":
            some = removal.columns[name][cuts.step]
            np.testing.assert_allclose(
                some, known[:, i], rtol=1e-6, atol=1e-8 * np.abs(known[:, i]).max(), err_msg=name
            )


def test_a_watch_gets_the_instant_of_the_greatest_force() -> None:
    """Steps of 4 mm of a cutter of 8 mm, looked at five times, into a wall whose depth rises."""
    program = path([[-4.0, 15.0, -0.5], [44.0, 15.0, -4.0]], tool=2)
    fine = replace(FINE, step_mm=4.0)
    removal = remove(program, block(), {2: BALL}, ALLOY, fine, keep=True)
    cuts = removal.cuts[0]
    loads = greatest_loads(cuts, ALLOY, FINE.rotation)
    for name in ("force_n", "torque_nm"):
        np.testing.assert_allclose(loads[name], removal.columns[name][cuts.step], rtol=2e-3, err_msg=name)
    assert (loads["torque_mean_nm"] > 1.05 * removal.columns["torque_mean_nm"][cuts.step]).any()


def test_a_step_that_cuts_unlike_the_one_before_it_is_looked_at_three_times(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mill of 10 mm enters a block at right angles in steps of 1 mm: against steps of 0.02 mm."""
    program = path([[-6.0, 15.0, -3.0], [9.0, 15.0, -3.0]])
    fine = remove(program, block(), {1: MILL}, ALLOY, replace(FINE, step_mm=0.02), accuracy=False)
    known = fine.columns["chip_volume_mm3"].reshape(15, 50).sum(axis=1)
    some = run(program, accuracy=False).columns["chip_volume_mm3"]
    monkeypatch.setattr("chipload.engagement.moves.stock.MORE", (1, 1))
    once = run(program, accuracy=False).columns["chip_volume_mm3"]
    assert np.abs(some - known).max() < 0.5 * np.abs(once - known).max()
    np.testing.assert_allclose(some[6:], known[6:], rtol=1e-3)


def test_a_wall_that_a_step_meets_at_its_very_end_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Square into a wall that stands 0.3 mm before the corner of the path: against steps of 0.02 mm."""
    program = path([[-8.0, -2.0, -3.0], [-4.7, -2.0, -3.0], [-4.7, 9.0, -3.0]])
    fine = replace(FINE, step_mm=0.02)
    known = remove(program, block(), {1: MILL}, ALLOY, fine, accuracy=False).columns
    first = known["y_mm"] <= -2.0

    def peak() -> float:
        columns = run(program, accuracy=False).columns
        return float(columns["force_n"][columns["y_mm"] <= -2.0].max())

    assert peak() == pytest.approx(float(known["force_n"][first].max()), rel=0.03)
    monkeypatch.setattr("chipload.engagement.moves.stock.MORE", (1, 1))
    assert peak() == 0.0


def test_what_is_engaged_is_what_is_removed() -> None:
    """The volume under the chip thickness of the force model against that of the contact."""
    columns = run(zigzag()).columns
    volume, engaged = columns["chip_volume_mm3"], columns["engaged_volume_mm3"]
    feeding = ~columns["rapid"]
    np.testing.assert_allclose(engaged[feeding], volume[feeding], rtol=0.02, atol=1e-3 * volume.max())
    np.testing.assert_allclose(columns["cutting_work_j"], 1e-3 * ALLOY.Ktc * engaged, rtol=1e-9)


def test_accuracy_of_a_run() -> None:
    removal = run(zigzag())
    assert set(removal.energy_balance) == {1, 2}
    assert max(abs(v) for v in removal.energy_balance.values()) < 0.01
    assert set(removal.resolution_error) == {*COMPARED, *WITH_FORCE}
    for name in COMPARED:
        assert MOVES_FLOOR[name] <= removal.resolution_error[name] < 0.15
    assert (removal.columns["axial_overrun_mm"] == 0.0).all()


def test_times_on_the_machine_count() -> None:
    program = zigzag()
    times = np.linspace(0.1, 0.5, len(program))
    found, known = run(program, times=times).columns, run_by_layers(program, times=times).columns
    for name in ("t_s", "duration_s", "seconds"):
        np.testing.assert_array_equal(found[name], known[name])
    assert found["t_s"][-1] == pytest.approx(times.sum())


@pytest.mark.parametrize("pattern", ["*.parquet", "sums-*.npz"])
def test_a_damaged_checkpoint_is_set_aside(tmp_path: Path, pattern: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chipload.simulation.chips.BLOCK", 8)
    cutters, stock = {1: MILL, 2: BALL}, block()
    known = all_bytes(remove(zigzag(), stock, cutters, ALLOY, FINE), stock)

    def stop(done: float, what: str) -> None:
        if done > 0.5:
            raise Cancelled("stopped")

    with pytest.raises(Cancelled), Checkpoint(tmp_path / "run", 0.0) as kept:
        remove_in_chunks(zigzag(), block(), cutters, ALLOY, FINE, kept, progress=stop)
    file = sorted((tmp_path / "run").glob(pattern))[0]
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(bytes(data))
    said, again = list[str](), block()
    with Checkpoint(tmp_path / "run", 0.0, notice=said.append) as kept:
        found = remove_in_chunks(zigzag(), again, cutters, ALLOY, FINE, kept)
        assert all_bytes(found, again) == known
    assert len(said) == 1
    assert "is moved to" in said[0]
    assert (tmp_path / "run.damaged-1" / file.name).read_bytes() == bytes(data)
