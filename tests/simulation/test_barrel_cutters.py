"""Barrel cutters by moves and layers: volumes against profile and dexels, forces against a fine stack of discs."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.program.build import plunge, rapid
from chipload.program.program import Program
from chipload.simulation import _form_error
from chipload.simulation.chips import remove
from chipload.simulation.clearance.body import cutting_part
from chipload.simulation.deflection import _shape
from chipload.simulation.removal import Removal, Resolution
from chipload.stock.dexel import TriDexel
from chipload.stock.layers import LayeredStock
from layer_oracle.removal import remove_by_layers
from simulation.discs import mean_loads_of_discs
from simulation.test_steps import five_axis

OVAL = Cutter(12.0, 3, 0.5, 28.0, 50.0, 6e5, corner_radius=2.0, barrel_radius=85.0)
CONE = Cutter(8.0, 4, 0.4, 20.0, 50.0, 6e5, corner_radius=1.5, barrel_radius=250.0, taper=math.radians(12.0))
LENS = Cutter(10.0, 2, 0.3, 16.0, 50.0, 6e5, corner_e=2.0, barrel_radius=25.0)
BARRELS = {"tangential": OVAL, "conical": CONE, "sharp": LENS}
#: every form by moves, one by layers too
RUNS = [*((name, remove) for name in BARRELS), ("tangential", remove_by_layers)]
PLAIN = Material("plain", 800.0, 250.0, 150.0, 12.0, 9.0, 4.0, source="made up")
ENERGY = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this test")
FINE = Resolution(step_mm=2.0, tolerance=1e-4, corner_slices=40, flank_mm=0.25)
DEEP, REST = 14.0, 4.6  # axial depth, distance of the stock's edge from the cutter's axis [mm]


def wall(layer_mm: float = 0.1) -> LayeredStock:
    return LayeredStock.block((0.0, -20.0, -DEEP), (30.0, 0.0, 0.0), layer_mm, 30.0)


def along(cutter: Cutter, rest: float = REST, feed: float = 20.0) -> Program:
    points = [-10.0, rest, -DEEP], [40.0, rest, -DEEP]
    return Program.join([rapid(points[0], 300.0, 1, "link"), plunge(points[1], feed, 300.0, 1, "cut")])


@pytest.mark.parametrize("name", BARRELS)
def test_the_profile_is_tangent_and_its_arc_has_the_radius(name: str) -> None:
    cutter = BARRELS[name]
    arc = cutter.flank_arc
    assert arc is not None
    z = np.linspace(arc.z_from + 1e-4, min(arc.z_to, 30.0) - 1e-4, 50)
    assert np.hypot(cutter.radius_at(z) - arc.e, z - arc.f) == pytest.approx(cutter.barrel_radius, rel=1e-12)
    for place in ([arc.z_from] if cutter.corner_radius else []) + [arc.z_to]:
        low, here, high = cutter.radius_at([place - 1e-5, place, place + 1e-5])
        assert here - low == pytest.approx(high - here, abs=2e-10 / min(cutter.corner_radius or 9.0, 1.0))
    above = cutter.radius_at([arc.z_to, arc.z_to + 1.0])
    assert above[1] - above[0] == pytest.approx(math.tan(cutter.taper), abs=1e-9)
    assert above[0] == pytest.approx(cutter.radius + arc.z_to * math.tan(cutter.taper), rel=1e-12)


@pytest.mark.parametrize(("name", "by"), RUNS)
def test_a_wall_takes_the_volume_under_the_profile(name: str, by: Callable[..., Removal]) -> None:
    cutter, stock = BARRELS[name], wall()
    removal = by(along(cutter), stock, {1: cutter}, PLAIN, FINE)
    z = (np.arange(40_000) + 0.5) * (DEEP / 40_000)
    area = np.maximum(cutter.radius_at(z) - REST, 0.0).mean() * DEEP
    assert area > 0.2
    assert removal.columns["chip_volume_mm3"].sum() == pytest.approx(30.0 * area, rel=2e-3)
    lost = removal.volume_before - removal.volume_after
    assert lost == pytest.approx(removal.columns["chip_volume_mm3"].sum(), rel=1e-9 if by is remove_by_layers else 2e-3)


@pytest.mark.parametrize(("name", "by"), RUNS)
def test_forces_are_those_of_a_fine_stack_of_discs(name: str, by: Callable[..., Removal]) -> None:
    """The feed is so small that the teeth run on circles: chips between their true paths begin f / (2 rho) later."""
    cutter, feed = BARRELS[name], 1.0
    found = by(along(cutter, feed=feed), wall(), {1: cutter}, PLAIN, FINE).columns
    k = int(np.flatnonzero(np.abs(found["x_mm"] - 15.0) < 1.1)[0])
    expected = mean_loads_of_discs(cutter.radius_at(np.linspace(0.0, DEEP, 4001)), DEEP, REST, cutter, feed, PLAIN)
    for key, value in expected.items():
        assert abs(value) > 0.01
        assert found[key][k] == pytest.approx(value, rel=5e-3), key


def test_the_torque_does_the_work_that_the_volume_asks_for() -> None:
    found = remove(along(OVAL), wall(), {1: OVAL}, ENERGY, FINE)
    work = found.columns["cutting_work_j"].sum()
    assert work == pytest.approx(ENERGY.Ktc * found.columns["chip_volume_mm3"].sum() / 1000.0, rel=0.02)


@pytest.mark.parametrize(("name", "by"), RUNS)
def test_a_leaning_barrel_takes_what_dexels_lose(name: str, by: Callable[..., Removal]) -> None:
    cutter = BARRELS[name]
    tips, axes = [[-6.0, 2.0, -4.0], [36.0, 1.0, -5.0]], [[0.1, 0.45, 1.0], [-0.2, 0.3, 1.0]]
    stock = LayeredStock.block((0.0, -20.0, -12.0), (30.0, 10.0, 0.0), 0.15, 30.0)
    found = by(five_axis(tips, axes), stock, {1: cutter}, PLAIN, FINE)
    dexels = TriDexel.block((0.0, -20.0, -12.0), (30.0, 10.0, 0.0), 0.2)
    a0, a1 = (np.array(a) / np.linalg.norm(a) for a in axes)
    dexels.remove_move(tips[0], a0, tips[1], a1, cutter.outline, error_mm=2e-3)
    lost = [12.0 * 900.0 - v for v in dexels.volume_by_direction().values()]
    assert np.mean(lost) > 500.0
    assert found.columns["chip_volume_mm3"].sum() == pytest.approx(np.mean(lost), rel=3e-3)


def test_a_barrel_is_not_handed_over() -> None:
    found = remove(along(OVAL), wall(0.5), {1: OVAL}, PLAIN, FINE, accuracy=False)
    assert found.findings == ()


@pytest.mark.parametrize("name", BARRELS)
def test_distances_from_the_body_and_its_foot_are_those_of_dense_points(name: str) -> None:
    cutter, rng = BARRELS[name], np.random.default_rng(9)
    z = np.linspace(0.0, cutter.flute_length, 200_001)
    line = np.column_stack([cutter.radius_at(z), z])
    end = cutter.apt[2] if cutter.corner_radius == 0.0 else 0.0
    line = np.vstack([np.column_stack([np.linspace(0.0, end, 2000), np.zeros(2000)]), line])
    body, shape, out = cutting_part(cutter), _shape(cutter), np.empty(5)
    for _ in range(200):
        rho, up = rng.uniform(0.0, 9.0), rng.uniform(0.0, cutter.flute_length - 3.0)
        far = np.hypot(*(line - [rho, up]).T).min() * (-1.0 if rho < cutter.radius_at([up])[0] else 1.0)
        assert body.distance(rho, up) == pytest.approx(far, abs=2e-4)
        _form_error.foot(rho, up, shape, out)
        assert out[0] == pytest.approx(far, abs=2e-4)
        assert (
            abs(cutter.radius_at([out[2]])[0] - (rho - out[0] * out[3])) < 1e-6
            or out[3] == out[4] == 0.0
            or (out[2] < 1e-9)
        )
