"""Simulations at default settings against double sums over the edge, and their stated error against the true one.

Bounds: 2 % of the mean torque, 3 % of the peaks; where the settings are stated coarser, ``resolution_error`` covers it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import astuple, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chipload.api.simulation import simulate
from chipload.checking.history import History
from chipload.checking.settings import Limits, SimulationSettings
from chipload.checking.workpiece import Stock
from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material, material_named
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from engagement.tooth_paths import Cut, true_loads
from laws.edge_sum import Sum, edge_sum
from simulation.test_steps import five_axis

Floats = NDArray[np.float64]
BALL = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=5.0)
BULL = Cutter(12.0, 3, 0.4, 20.0, 30.0, 6e5, corner_radius=3.0)
TAPER = Cutter(6.0, 2, 0.5, 20.0, 30.0, 6e5, corner_radius=1.0, taper=0.1)
FLAT = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
NO_EDGE = Material("no edge", 1000.0, 300.0, 100.0, 0.0, 0.0, 0.0, source="made up for this test")
#: the sums take h = f sin(phi): at 0.01 mm a tooth the true paths of the teeth are near enough to circles, also at the
#: tip of a ball nose 0.02 mm deep. Edge coefficients are in proportion, so that they have their share of the force.
FAST, FEED, SPINDLE = 20.0, 1.0, 300.0
REAL = material_named("al7075-t6")
AL = replace(REAL, **{name: getattr(REAL, name) * FEED / FAST for name in ("Kte", "Kre", "Kae")})
#: for ball noses so shallow that the edge has most of the force: where one tooth leaves a slot the next has entered,
#: at any feed, and both edges together are the peak, which a sum over circles does not have
BARE = replace(REAL, Kte=0.0, Kre=0.0, Kae=0.0)
SHALLOW = 0.1
COLUMNS = ("torque_mean_nm", "torque_nm", "force_n", "chip_max_mm")


def path(points: Any, feed: float = FEED) -> Program:
    return Program.join(
        [rapid(points[0], SPINDLE, 1, "link"), *(plunge(p, feed, SPINDLE, 1, "cut") for p in points[1:])]
    )


def run(
    program: Program, cutter: Cutter, high: float = 0.0, material: Material = AL, on: str = "vmc", **keys: Any
) -> History:
    block = Stock.block((0.0, -16.0, -12.0), (30.0, 16.0, high), keys.pop("layer_mm", None))
    settings = SimulationSettings(**({"step_mm": 0.25 * cutter.diameter} | keys))
    return simulate(program, block, cutter, material, on, Limits(force_n=1e6), settings=settings)


def per_tooth(cutter: Cutter, direction: Any) -> Floats:
    d = np.asarray(direction, dtype=np.float64)
    return d / np.linalg.norm(d) * FEED * math.tau / (cutter.flutes * SPINDLE)


def at(history: History, x: float) -> dict[str, float]:
    """Loads of the step whose end is nearest to x."""
    c = history.columns
    cut = np.flatnonzero(~np.asarray(c["rapid"]))
    k = int(cut[np.argmin(np.abs(c["x_mm"][cut] - x))])
    return {name: float(c[name][k]) for name in (*COLUMNS, "x_mm", "z_mm")}


def off(found: dict[str, float], exact: Sum, stated: Mapping[str, float]) -> dict[str, float]:
    """Relative errors above 2 % of the mean torque, 3 % of the peaks; of the chip, taken at the middle of slices, above
    what is stated.
    """
    most = {"torque_mean_nm": 0.02, "torque_nm": 0.03, "force_n": 0.03, "chip_max_mm": 0.03 + stated["chip_max_mm"]}
    errors = {name: abs(found[name] / getattr(exact, name) - 1.0) for name in most}
    return {name: error for name, error in errors.items() if not error <= most[name]}


def uncovered(history: History, exact: Sum, k: int) -> dict[str, float]:
    """True loads that do not lie within the stated error of those of step k."""
    stated, values = history.resolution_error, {name: float(history.columns[name][k]) for name in COLUMNS}
    return {
        name: getattr(exact, name)
        for name, value in values.items()
        if not abs(getattr(exact, name) - value) <= stated[name] * value + 2e-3 * value
    }


@pytest.mark.parametrize(
    ("cutter", "depth", "step"),
    [
        (BALL, 0.02, 0.5),
        (BALL, 0.02, 0.02),
        (BALL, 0.3, 3.0),
        (BALL, 1.0, 0.1),
        (BALL, 1.874, 0.5),
        (BALL, 5.0, 3.0),
        (BULL, 0.02, 3.0),
        (BULL, 0.3, 0.5),
        (BULL, 5.0, 0.5),
        (TAPER, 0.3, 0.5),
        (TAPER, 3.0, 3.0),
        (FLAT, 0.02, 0.1),
        (FLAT, 5.0, 3.0),
    ],
)
def test_a_straight_slot(cutter: Cutter, depth: float, step: float) -> None:
    length = 2.0 if step < 0.1 else 20.0
    begin = -cutter.diameter
    points = [[begin, 0, -depth], [10.0, 0, -depth], [10.0 + length, 0, -depth]]
    metal = BARE if depth < SHALLOW else AL
    program = path([points[0], points[1]]) if step >= 0.1 else path(points)
    history = run(program, cutter, material=metal, step_mm=step)
    exact = edge_sum(cutter, (0, 0, -depth), (0, 0, 1), per_tooth(cutter, (1, 0, 0)), lambda p: p[..., 2] < 0.0, metal)
    assert off(at(history, 9.0 if step < 3.0 else 7.0), exact, history.resolution_error) == {}


@pytest.mark.parametrize(
    ("cutter", "depth", "feed"),
    [
        (BALL, 0.02, FEED),
        (BALL, 0.05, FEED),
        (BALL, 0.3, FAST),
        (BALL, 1.0, FAST),
        (BALL, 1.874, FAST),
        (BALL, 5.0, FAST),
        (FLAT, 0.02, FAST),
        (FLAT, 5.0, FAST),
    ],
)
def test_a_straight_slot_against_the_true_paths(cutter: Cutter, depth: float, feed: float) -> None:
    """0.01, 0.1 and 0.2 mm a tooth, against the trochoids of all earlier teeth, with all of the edge force."""
    history = run(path([[-10.0, 0.0, -depth], [10.0, 0.0, -depth]], feed), cutter, material=REAL, step_mm=0.5)
    f = feed * math.tau / (cutter.flutes * SPINDLE)
    cut = Cut(10.0, cutter.flutes, math.degrees(cutter.helix), depth, 10.0, f, ball=cutter is BALL)
    force, torque, mean, chip = true_loads(cut, astuple(REAL)[1:7], rotations=360, slices=1000)
    assert off(at(history, 7.0), Sum(mean / 1e3, torque / 1e3, force, chip), history.resolution_error) == {}


def test_points_of_a_program_however_near_cost_the_same() -> None:
    """D 10 ball, 1 mm deep, program points 0.2, 0.1 and 0.02 mm apart."""
    exact = edge_sum(BALL, (0, 0, -1), (0, 0, 1), per_tooth(BALL, (1, 0, 0)), lambda p: p[..., 2] < 0.0, AL)
    for apart in (0.2, 0.1, 0.02):
        x = np.concatenate([[-10.0, 5.0], np.arange(5.0, 7.0, apart)[1:]])
        history = run(path([[v, 0.0, -1.0] for v in x]), BALL)
        assert off(at(history, 6.5), exact, history.resolution_error) == {}


@pytest.mark.parametrize("cutter", [BALL, BULL, TAPER], ids=["ball", "bull", "taper"])
@pytest.mark.parametrize("slope", [-0.02, -0.15, 0.1])
def test_a_ramp(cutter: Cutter, slope: float) -> None:
    """Down and up, in material that nothing has cut: what lies below the top and goes outward cuts."""
    begin, end = (-0.2, -0.2 + 12.0 * slope) if slope < 0.0 else (-3.0, -3.0 + 12.0 * slope)
    history = run(path([[2.0, 0.0, begin], [14.0, 0.0, end]]), cutter, step_mm=0.5)
    found = at(history, 13.0)
    tip = (found["x_mm"] - 0.25, 0.0, begin + slope * (found["x_mm"] - 0.25 - 2.0))
    exact = edge_sum(cutter, tip, (0, 0, 1), per_tooth(cutter, (1, 0, slope)), lambda p: p[..., 2] < 0.0, AL)
    assert off(found, exact, history.resolution_error) == {}


@pytest.mark.parametrize("cutter", [BALL, BULL, FLAT], ids=["ball", "bull", "flat"])
def test_a_plunge(cutter: Cutter) -> None:
    history = run(path([[15.0, 0.0, 1.0], [15.0, 0.0, -3.0]]), cutter, step_mm=0.02)
    c = history.columns
    k = int(np.argmax(c["z_mm"] <= -2.0))
    tip = (15.0, 0.0, float(c["z_mm"][k]) + 0.01)
    exact = edge_sum(cutter, tip, (0, 0, 1), per_tooth(cutter, (0, 0, -1)), lambda p: p[..., 2] < 0.0, AL)
    assert off({name: float(c[name][k]) for name in COLUMNS}, exact, history.resolution_error) == {}


@pytest.mark.parametrize("lean", [(0.3, 0.0), (0.0, 0.3), (-0.2, 0.2)])
@pytest.mark.parametrize("cutter", [BALL, BULL, FLAT], ids=["ball", "bull", "flat"])
def test_a_slot_with_a_leaning_axis(cutter: Cutter, lean: tuple[float, float]) -> None:
    """Within the law, or within the error that the run states."""
    axis = np.array([*lean, 1.0]) / math.hypot(*lean, 1.0)
    tips = [[x, 0.0, -1.5] for x in (-14.0, 16.0)]
    program = replace(five_axis(tips, [axis.tolist()] * 2, feed=FEED), spindle=np.full(2, SPINDLE))
    history = run(program, cutter, on="cradle-ac", step_mm=1.0)
    c = history.columns
    k = int(np.flatnonzero(c["x_mm"] >= 14.0)[0])
    exact = edge_sum(cutter, (0, 0, -1.5), axis, per_tooth(cutter, (1, 0, 0)), lambda p: p[..., 2] < 0.0, AL)
    assert uncovered(history, exact, k) == {}
    found = {name: float(c[name][k]) for name in COLUMNS}
    if cutter is BALL:
        assert off(found, exact, history.resolution_error) == {}


def test_an_arc_removes_what_pappus_says() -> None:
    """Work of a slot along an arc: Ktc times the area of the section times the way of its middle."""
    angle = np.linspace(0.0, 0.5 * math.pi, 121)
    points = np.column_stack([4.0 + 12.0 * np.sin(angle), -12.0 + 12.0 * np.cos(angle), np.full(121, -1.0)])
    history = run(path([[-8.0, 0.0, -1.0], *points.tolist()]), BALL, material=NO_EDGE)
    c = history.columns
    own = (c["x_mm"] > 11.0) & (c["y_mm"] > -9.0)
    way = float((c["cutting_s"][own] * FEED).sum())
    area = 25.0 * math.acos(0.8) - 4.0 * 3.0
    assert float(c["cutting_work_j"][own].sum()) == pytest.approx(area * way, rel=0.01)


def raster(p: Floats, row: int, over: float, depth: float) -> NDArray[np.bool_]:
    """Below the top and in none of the troughs of the rows before."""
    solid = p[..., 2] < 0.0
    for j in range(row):
        y, z = p[..., 1] - (j - row) * over, p[..., 2] - (5.0 - depth)
        solid &= ~((np.hypot(y, z) < 5.0) | ((z > 0.0) & (np.abs(y) < 5.0)))
    return solid


@pytest.mark.parametrize(
    ("depth", "over", "layer"), [(0.3, 0.5, None), (0.3, 0.5, 0.5), (0.05, 0.3, None), (1.0, 2.0, None)]
)
def test_a_finishing_raster(depth: float, over: float, layer: float | None) -> None:
    """0.3 mm of stock by a ball nose, also with the layers that were the default before."""
    points: list[list[float]] = []
    for k in range(3):
        ends = [[-7.0, (k - 2) * over, -depth], [20.0, (k - 2) * over, -depth]]
        points += [[ends[0][0], ends[0][1], 2.0], *ends, [ends[1][0], ends[1][1], 2.0]]
    metal = BARE if depth < SHALLOW else AL
    history = run(path(points), BALL, material=metal, layer_mm=layer)
    c = history.columns
    k = int(np.flatnonzero((c["x_mm"] > 9.0) & (c["z_mm"] == -depth) & (np.abs(c["y_mm"]) < 1e-9))[0])
    tip, way = (0.0, 0.0, -depth), per_tooth(BALL, (1, 0, 0))
    exact = edge_sum(BALL, tip, (0, 0, 1), way, lambda p: raster(p, 2, over, depth), metal)
    if layer is None:
        assert off({name: float(c[name][k]) for name in COLUMNS}, exact, history.resolution_error) == {}
    # the worst step is one of the first row, a slot
    slot = edge_sum(BALL, tip, (0, 0, 1), way, lambda p: p[..., 2] < 0.0, metal)
    assert uncovered(history, slot, int(np.flatnonzero((c["x_mm"] > 9.0) & (c["z_mm"] == -depth))[0])) == {}


@pytest.mark.parametrize(
    ("cutter", "depth", "keys"),
    [
        (BALL, 0.3, {"layer_mm": 0.5}),
        (BALL, 1.0, {"layer_mm": 0.5, "corner_slices": 4}),
        (BALL, 1.874, {"layer_mm": 0.6, "corner_slices": 12}),
        (BALL, 0.3, {"corner_slices": 6}),
        (BULL, 1.0, {"layer_mm": 1.0, "corner_slices": 2}),
        (TAPER, 2.0, {"flank_mm": 4.0, "corner_slices": 2}),
    ],
)
def test_coarse_settings_state_the_error_that_they_make(cutter: Cutter, depth: float, keys: dict[str, Any]) -> None:
    history = run(path([[-12.0, 0.0, -depth], [20.0, 0.0, -depth]]), cutter, step_mm=0.5, **keys)
    exact = edge_sum(cutter, (0, 0, -depth), (0, 0, 1), per_tooth(cutter, (1, 0, 0)), lambda p: p[..., 2] < 0.0, AL)
    assert uncovered(history, exact, int(np.flatnonzero(history.columns["x_mm"] > 15.0)[0])) == {}


def test_a_shallow_ramp_removes_what_it_sweeps() -> None:
    """0.1 mm deep at its end; the layers of what is shown, 0.5 mm thick, do not matter."""
    program = path([[2.0, 0.0, 0.0], [27.0, 0.0, -0.1]])
    x = (np.arange(20_000) + 0.5) / 20_000 * 25.0
    depth = 0.1 * x / 25.0
    volume = float(
        (25.0 * np.arccos(1.0 - depth / 5.0) - (5.0 - depth) * np.sqrt(depth * (10.0 - depth))).mean() * 25.0
    )
    # and the front half of the cap at its end, before the tip
    volume += math.pi * 0.1**2 * (15.0 - 0.1) / 6.0
    for layer in (None, 0.5):
        columns = run(program, BALL, step_mm=0.5, layer_mm=layer).columns
        assert float(columns["engaged_volume_mm3"].sum()) == pytest.approx(volume, rel=0.02)
        assert float(columns["chip_volume_mm3"].sum()) == pytest.approx(volume, rel=0.02)


@pytest.mark.parametrize("m", [0.0, 0.25])
def test_the_energy_balance_of_a_slot_closes(m: float) -> None:
    """Also with a size effect, where K is the mean of Ktc h^(-m) with the thickness used."""
    metal = Material("m", 1000.0, 0.0, 0.0, 30.0, 0.0, 0.0, source="made up for this test", exponents=(m, 0.0, 0.0))
    history = run(path([[-6.0, 0.0, -2.0], [40.0, 0.0, -2.0]]), BALL, step_mm=0.5, material=metal)
    assert list(history.energy_balance) == [1]
    assert history.energy_balance[1] == pytest.approx(0.0, abs=0.02)


def test_a_wall_that_a_line_meets_at_its_end_has_its_force() -> None:
    """A cleared field, then a line that runs square into its wall in the last 0.45 mm of a step of 1 mm or so."""
    words = []
    for y in (-8.0, 0.0, 8.0):
        words += [rapid((-8.0, y, 5.0), SPINDLE, 1, "link"), rapid((-8.0, y, -2.0), SPINDLE, 1, "link")]
        words += [plunge((15.0, y, -2.0), 2.0, SPINDLE, 1, "clear"), rapid((15.0, y, 5.0), SPINDLE, 1, "link")]
    words += [rapid((6.0, 0.0, 5.0), SPINDLE, 1, "link"), rapid((6.0, 0.0, -2.0), SPINDLE, 1, "link")]
    program = Program.join([*words, plunge((15.45, 0.0, -2.0), FAST, SPINDLE, 1, "cut")])
    coarse, fine = (run(program, FLAT, step_mm=step) for step in (1.0, 0.05))
    truth = float(fine["force_n"].max())
    assert float(coarse["force_n"][-1]) == pytest.approx(truth, rel=0.03)
