"""A stock that an earlier program cut is the initial stock of the next: a program in two parts cuts as the whole."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_along
from chipload.cutting.material import Material, material_named
from chipload.errors import InputError
from chipload.program.build import rapid, rows
from chipload.program.program import LINE, RAPID, Program
from chipload.simulation.chips import remove
from chipload.simulation.initial_stock import initial_stock
from chipload.simulation.moves import stock_before
from chipload.simulation.removal import Removal, Resolution
from chipload.stock.earlier_moves import EarlierMoves, no_moves
from chipload.stock.layers import LayeredStock
from chipload.stock.solid import stepped_body
from chipload.stock.turned import turn_matrix, turned_stock

Floats = NDArray[np.float64]
MILL = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
BALL = Cutter(8.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=4.0, runout=(0.01, 0.3))
CUTTERS = {1: MILL, 2: BALL}
FINE = Resolution(step_mm=1.0, tolerance=0.001, corner_slices=24, flank_mm=2.5)
ALLOY = material_named("al7075-t6")
LOW, HIGH = (0.0, 0.0, -8.0), (40.0, 30.0, 0.0)
COLUMNS = ("force_n", "torque_nm", "chip_volume_mm3", "chip_areas")


def block(layer: float = 0.5) -> LayeredStock:
    return LayeredStock.block(LOW, HIGH, layer, 20.0)


def path(points: Any, tool: int = 1) -> Program:
    p = np.asarray(points, dtype=float).tolist()
    cut = rows([LINE] * (len(p) - 1), p[1:], (0.0, 0.0), 20.0, 300.0, tool, "cut")
    return Program.join([rapid(p[0], 300.0, tool, "link"), cut])


def two_tools(lean: float = 0.0) -> Program:
    """Rows of the mill, then rows of the ball over a wave, its axis leaning by ``lean`` [rad]."""
    x = np.linspace(-6.0, 46.0, 14)
    face = [[float(a), y, -1.0] for k, y in enumerate((2.0, 8.0)) for a in (x if k % 2 == 0 else x[::-1])]
    wave = [
        [float(a), 3.0 + 1.5 * k, -2.0 + 0.5 * math.sin(a / 5.0)] for k in range(2) for a in (x if k == 0 else x[::-1])
    ]
    program = Program.join([path(face), rapid([-6.0, 3.0, 9.0], 300.0, 1, "link"), path(wave, 2)])
    axis = np.tile([math.sin(lean), 0.0, math.cos(lean)], (len(program), 1))
    axis[program.tool == 1] = (0.0, 0.0, 1.0)
    return replace(program, axis=axis)


def parts_of(program: Program, row: int) -> tuple[Program, Program]:
    """The rows before ``row``, and the others, which begin where the first end."""
    columns = {f.name: getattr(program, f.name) for f in fields(program) if f.name != "labels"}
    first = Program(**{name: x[:row] for name, x in columns.items()}, labels=program.labels)
    rest = {name: x[row - 1 :] for name, x in columns.items()}
    rest["motion"] = np.append(RAPID, rest["motion"][1:])
    return first, Program(**rest, labels=program.labels)


def run(program: Program, stock: LayeredStock, **more: Any) -> Removal:
    return remove(program, stock, CUTTERS, ALLOY, FINE, **{"accuracy": False} | more)


@pytest.fixture(scope="module", params=[0.0, 0.2], ids=["upright", "leaning"])
def whole(request: pytest.FixtureRequest) -> tuple[Program, Removal, LayeredStock]:
    program, stock = two_tools(request.param), block()
    return program, run(program, stock), stock


def test_a_program_in_two_parts_cuts_as_the_whole(whole: tuple[Program, Removal, LayeredStock], tmp_path: Path) -> None:
    program, known, left = whole
    # from the middle of the first row of the ball on, so that its second half cuts what both tools left
    first, rest = parts_of(program, 36)
    stock = block()
    one = run(first, stock)
    stock.save(tmp_path / "stock.npz")
    stock = LayeredStock.load(tmp_path / "stock.npz")
    two = run(rest, stock, accuracy=True)
    assert two.findings == ()
    for name in COLUMNS:
        both = np.concatenate([one.columns[name], two.columns[name]])
        off = np.abs(both - known.columns[name])
        # a step is looked at in as many instants as it differs from the one before it: the first has none
        off[len(one.columns[name])] = 0.0
        # of a leaning axis borders are searched first where they were before
        near = 2e-4 if program.axis[:, 2].min() == 1.0 else 0.03
        assert off.max() <= near * np.abs(known.columns[name]).max(), name
    assert two.volume_after == pytest.approx(known.volume_after, rel=1e-5)
    assert one.volume_before - two.volume_after == pytest.approx(known.volume_before - known.volume_after, rel=1e-4)
    for i in range(0, left.layers, 4):
        assert left.section(i).symmetric_difference(stock.section(i)).area < 0.05
    assert 0.0 < two.resolution_error["force_n"] < math.inf


def test_a_slot_beside_a_slot_costs_what_its_engagement_costs() -> None:
    """The second program widens the slot of the first by 4 mm on its right: up to pi/2 + asin(1/5)."""
    stock = block()
    run(path([[-8.0, 18.0, -3.0], [48.0, 18.0, -3.0]]), stock)
    columns = run(path([[-8.0, 14.0, -3.0], [48.0, 14.0, -3.0]]), stock).columns
    # material from the right side on up to the old wall, 1 mm to the right of the axis
    known = forces_along(
        [math.pi - math.acos(1.0 - 4.0 / 5.0)], [math.pi], 20.0 * math.tau / 4 / 300.0, [[1.0, 0.0]], MILL, ALLOY, 3.0,
        spindle_speed=300.0,
    )  # fmt: skip
    assert columns["torque_mean_nm"][30] == pytest.approx(float(known["torque_mean_nm"][0]), rel=1e-6)
    assert columns["chip_volume_mm3"][30] == pytest.approx(4.0 * 3.0 * 1.0, rel=1e-6)


def test_work_is_ktc_times_the_volume_that_a_turned_stock_lost() -> None:
    """A stock that is turned over keeps its layers only: they are the body of the second program."""
    plain = Material("plain", 900.0, 300.0, 100.0, 0.0, 0.0, 0.0, source="made up")
    stock = block()
    run(path([[-8.0, 10.0, -3.0], [48.0, 12.0, -5.0]]), stock)
    over = turned_stock(stock, turn_matrix("x", 180.0), np.zeros(3), 0.5)
    assert over.earlier is None
    program = path([[-8.0, -10.0, 2.0], [48.0, -16.0, 3.0], [48.0, -20.0, 3.0], [-8.0, -12.0, 5.0]])
    found = remove(program, over, CUTTERS, plain, FINE, accuracy=False)
    assert found.findings == ()
    lost = found.volume_before - found.volume_after
    assert 1e3 * found.columns["cutting_work_j"].sum() == pytest.approx(900.0 * lost, rel=0.02)
    assert found.columns["chip_volume_mm3"].sum() == pytest.approx(lost, rel=0.01)


def test_layers_as_the_body_cut_as_the_moves_that_made_them() -> None:
    """Of level cuts the layers are exact."""
    one = block()
    run(path([[-8.0, 10.0, -3.0], [48.0, 10.0, -3.0]]), one)
    other = one.copied()
    other.earlier = None
    program = path([[-8.0, 14.0, -4.0], [20.0, 12.0, -4.0], [48.0, 6.0, -2.0]])
    known, found = run(program, one).columns, run(program, other).columns
    for name in COLUMNS[:3]:
        np.testing.assert_allclose(found[name], known[name], atol=2e-3 * known[name].max(), err_msg=name)


def test_a_stock_whose_layers_were_cut_otherwise_forgets_its_moves() -> None:
    stock = block()
    run(path([[-8.0, 10.0, -3.0], [48.0, 10.0, -3.0]]), stock)
    assert stock.earlier is not None
    state = stock.state()
    stock.remove(15, stock.section(15))
    assert stock.earlier is None
    stock.restore(state)
    assert stock.earlier is not None


def test_the_exposed_faces_hold_what_the_layers_hold() -> None:
    stock = block()
    run(two_tools(), stock)
    body = stock.exposed_body()
    assert body.volume == pytest.approx(stock.volume(), rel=1e-9)
    # no level face lies within the stock
    level = np.abs(body.face_normals[:, 2]) > 0.5
    centre = body.triangles_center[level]
    for z in np.unique(centre[:, 2])[1:-1]:
        k = int(np.argmin(np.abs(stock.bounds - z)))
        away = stock.section(k - 1).symmetric_difference(stock.section(k)).area
        assert body.area_faces[level][centre[:, 2] == z].sum() == pytest.approx(away, rel=1e-6, abs=1e-6)
    box = trimesh.creation.box(bounds=[LOW, HIGH])
    assert stepped_body([block().section(0)] * 2, np.array([-8.0, -4.0, 0.0])).volume == pytest.approx(box.volume)


def test_moves_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    stock = block()
    run(path([[-8.0, 10.0, -3.0], [48.0, 10.0, -3.0]]), stock)
    assert stock.earlier is not None
    stock.earlier = replace(stock.earlier, cutter=stock.earlier.cutter + 1)
    stock.save(tmp_path / "stock.npz")
    with pytest.raises(InputError, match=r"stock.npz: damaged: its moves do not fit each other"):
        LayeredStock.load(tmp_path / "stock.npz")


DAMAGES = {
    "a field that no cutter has": lambda c: {**c, "teeth": 3},
    "a text for a number": lambda c: {**c, "diameter": "wide"},
    "not finite": lambda c: {**c, "diameter": math.nan},
    "nothing": lambda _: {},
    "a shape without numbers": lambda c: {**c, "shape": [[1], [2]]},
    "no table": lambda _: 3,
    "nested": lambda c: {**c, "pitch": [[[[0.0]]]]},
}


@pytest.mark.parametrize("change", DAMAGES)
def test_a_saved_stock_with_a_damaged_cutter_is_refused(tmp_path: Path, change: str) -> None:
    """When it is read, or when a program begins in it; nothing but a clear error."""
    cut = block()
    remove(path([[-6.0, 5.0, -1.0], [46.0, 5.0, -1.0]]), cut, CUTTERS, ALLOY, FINE)
    assert cut.earlier is not None
    good = cut.earlier
    cut.earlier = replace(good, cutters=(DAMAGES[change](dict(good.cutters[0])),))  # type: ignore[arg-type]
    cut.save(tmp_path / "stock.npz")
    with pytest.raises(InputError, match=r"stock|cutter"):
        initial_stock(LayeredStock.load(tmp_path / "stock.npz"), CUTTERS, upright=True)


def test_a_saved_stock_whose_cutters_are_nested_without_end_is_refused(tmp_path: Path) -> None:
    cut = block()
    arrays = no_moves() | {
        "moves": np.zeros((1, 6)), "move_cutter": np.zeros(1, np.int64),
        "cutters": np.frombuffer(b"[" * 100_000, dtype=np.uint8),
    }  # fmt: skip
    with pytest.raises(ValueError, match="cutters"):
        EarlierMoves.from_arrays(arrays)
    cut.save(tmp_path / "stock.npz")
    assert LayeredStock.load(tmp_path / "stock.npz").earlier is None


@pytest.mark.parametrize("lean", [0.0, 0.1])
def test_the_stock_before_a_step_is_that_of_the_program_up_to_it(lean: float) -> None:
    """A slot from x = 0 on: its length by the steps before; the stock before the program is as it was."""
    program = path([[-8.0, 10.0, -2.0], [20.0, 10.0, -2.0]])
    axis = np.tile([math.sin(lean), 0.0, math.cos(lean)], (len(program), 1))
    program, first = replace(program, axis=axis), block()
    after = first.copied()
    known = remove(program, after, CUTTERS, ALLOY, FINE, accuracy=False)
    for step in (0, 14, 20, len(known.columns["x_mm"])):
        left = stock_before(step, program, first, CUTTERS, FINE, after)
        removed = first.volume() - left.volume()
        # the layers of 0.5 mm cut a bottom that leans into steps
        off = 5e-3 if lean == 0.0 else 0.02
        assert removed == pytest.approx(known.columns["chip_volume_mm3"][:step].sum(), rel=off, abs=0.3)
        if step == 20 and lean == 0.0:  # the tip is at x = 12
            assert removed == pytest.approx(2.0 * (10.0 * 12.0 + 0.5 * math.pi * 25.0), rel=1e-4)
    assert not first.cut.any()
