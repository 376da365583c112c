"""Chips between the true paths of the teeth against those paths, found by Newton's method slice by slice."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_over_turn, mean_forces
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import chip_error, chips_and_paths, chips_of_teeth, tooth_radii
from engagement.tooth_paths import Cut, path_on_ray, true_loads

K = (800.0, 300.0, 150.0, 20.0, 15.0, 5.0)
METAL = Material("m", *K, source="made up for tests")
#: radial depth, feed per tooth of a mill of 10 mm with 4 teeth and 35 deg, 8 mm deep; greatest error [%] of force and
#: torque, up and down, as stated in the specification of the chip of second order
LAYERS = [
    (0.02, 0.02, 0.1), (0.02, 0.1, 0.5), (0.02, 0.2, 1.4), (0.05, 0.05, 0.3), (0.05, 0.1, 0.35), (0.1, 0.1, 0.4),
    (0.1, 0.2, 0.75), (0.3, 0.1, 0.2), (0.3, 0.2, 0.5), (1.0, 0.1, 0.2), (5.0, 0.1, 0.45), (7.0, 0.1, 0.45),
]  # fmt: skip


def mill_of(cut: Cut) -> Cutter:
    return Cutter(
        cut.D, cut.N, math.radians(cut.helix), 3.0 * cut.D, 4.0 * cut.D, 6e5, runout=(cut.e, cut.lam),
        pitch=tuple(cut.pitches) if cut.pitch else (),
    )  # fmt: skip


def loads_of(cut: Cut, rotations: int = 360, material: Material = METAL) -> tuple[np.ndarray, float]:
    """Force, torque, mean torque and chip of a cut as the package has them, and the error that it states."""
    mill = mill_of(cut)
    front = engagement_of_arcs([cut.arc[0]], [cut.arc[1]], cut.fz, mill, cut.ap)
    chips = chips_of_teeth(front, mill)
    force, torque = forces_over_turn(chips, mill, material, math.tau * np.arange(rotations) / rotations)
    # the mean of the same samples as the oracle's; that of the revolution is test_force's
    loads = [np.linalg.norm(force[0], axis=1).max(), torque[0].max(), torque[0].mean(), chips.chip_max()[0]]
    return np.array(loads), float(chip_error(front, mill)[0])


def test_the_path_of_the_oracle_by_hand():
    """Straight ahead the tooth before was c back less what its cutter came nearer: a circle without feed, and a feed
    that lets the ray pass the place where both stand at the same immersion.
    """
    assert path_on_ray(1.0, math.pi, 5.0, 0.0) == pytest.approx(5.0, abs=1e-12)
    assert path_on_ray(math.pi / 2, math.pi, 5.0, 0.02) == pytest.approx(5.0 - 0.02 * math.pi, abs=1e-12)


@pytest.mark.parametrize("up", [True, False])
@pytest.mark.parametrize(("ae", "fz", "most"), LAYERS)
def test_layers_are_right_to_second_order(ae: float, fz: float, most: float, up: bool):
    cut = Cut(10.0, 4, 35.0, 8.0, ae, fz, up)
    found, stated = loads_of(cut)
    off = np.abs(found / true_loads(cut, K) - 1.0)
    assert off[:3].max() < 0.01 * most
    assert off.max() < stated


def test_a_thin_layer_is_nine_percent_wrong_with_circles():
    """The front alone, h = f sin(phi): what :func:`chips_of_teeth` mends."""
    cut = Cut(10.0, 4, 35.0, 8.0, 0.02, 0.1, False)
    front = engagement_of_arcs([cut.arc[0]], [cut.arc[1]], cut.fz, mill_of(cut), cut.ap)
    torque = forces_over_turn(front, mill_of(cut), METAL, math.tau * np.arange(360) / 360)[1].max()
    assert torque / true_loads(cut, K)[1] - 1.0 == pytest.approx(-0.090, abs=0.003)


@pytest.mark.parametrize(
    ("D", "N", "helix", "ap", "ae", "fz", "e"),
    [
        (10.0, 4, 38.0, 10.0, 1.0, 0.05, 0.01),
        (12.0, 4, 45.0, 18.0, 1.0, 0.05, 0.015),
        (10.0, 2, 30.0, 10.0, 3.0, 0.05, 0.01),
    ],
)
def test_runout_turns_with_the_helix(D: float, N: int, helix: float, ap: float, ae: float, fz: float, e: float):
    """With one radius over the depth of a tooth peaks were up to 31 % low here."""
    for lam in np.radians([20.0, 160.0, 280.0]):
        cut = Cut(D, N, helix, ap, ae, fz, True, e, lam)
        found, stated = loads_of(cut, 120)
        off = np.abs(found / true_loads(cut, K, 120, 1000) - 1.0)
        assert off[:3].max() < max(0.005, stated)
        assert off[3] < 0.02


def test_runout_in_a_layer_as_thin_as_itself():
    cut = Cut(10.0, 4, 35.0, 8.0, 0.05, 0.1, False, 0.005, 1.0)
    found, stated = loads_of(cut, 120)
    assert np.abs(found / true_loads(cut, K, 120, 2500) - 1.0)[:3].max() < min(stated, 0.01)


def test_uneven_pitch_with_runout():
    cut = Cut(10.0, 4, 38.0, 10.0, 1.0, 0.05, True, 0.01, 2.0, (84.0, 96.0, 84.0, 96.0))
    found, _ = loads_of(cut, 360)
    assert np.abs(found / true_loads(cut, K, 360, 1000) - 1.0)[:3].max() < 0.004


def test_without_edge_forces_a_cut_costs_what_it_weighs():
    """Power of torque and force is Ktc times the area that the chip sweeps: on its outside, where the arm of the torque
    ends, an area of h^2 / 2 a radian more than its volume.
    """
    plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for tests")
    for p, q in ((0.0, 0.14), (3.0, math.pi), (0.0, math.pi), (0.0, 1.5)):
        mill = Cutter(10.0, 4, 0.6, 20.0, 30.0, 6e5)
        front = engagement_of_arcs([p], [q], 0.1, mill, 5.0)
        force, torque = mean_forces(chips_of_teeth(front, mill), mill, plain)
        ae = 5.0 * (math.cos(p) - math.cos(q))
        outside = 0.1**2 / 4.0 * (q - p - math.sin(q) * math.cos(q) + math.sin(p) * math.cos(p))
        work = math.tau * torque[0] - 4 * 0.1 * force[0, 0]
        assert work == pytest.approx(1000.0 * 4 * 5.0 * (0.1 * ae + outside), rel=1e-3 if q - p > 1.0 else 6e-3)


@pytest.mark.parametrize("tilt", [0.0, 0.7, 4.0])
def test_the_chip_does_not_depend_on_where_immersion_is_counted_from(tilt: float):
    """A motion at an angle to T is the same cut turned by it."""
    mill = Cutter(10.0, 4, 0.6, 20.0, 30.0, 6e5, runout=(0.006, 0.4))
    edge = [[0.0, 5.0, 0.0, 1.0, 0.0, 0.0, math.tan(0.6) / 5.0]]
    low, high, f = 0.0, 0.6, 0.08

    def chips(turned):
        row = [(low + turned) % math.tau, 0.0, 0.0, 6.0, f * math.cos(turned), 0.0, -f * math.sin(turned)]
        row[1] = row[0] + high - low
        return chips_of_teeth(ToothEngagement([0, 1], [row], [-1], [0], edge), mill)

    one, other = chips(0.0), chips(tilt)
    assert len(one.rows) == len(other.rows)
    assert other.chip_max() == pytest.approx(one.chip_max(), rel=1e-9)
    theta = np.linspace(0.0, 6.0, 25)
    torque = forces_over_turn(one, mill, METAL, theta)[1]
    # the teeth of the turned cut stand the same way to the feed when all has turned, their runout too
    lag = chips_of_teeth(
        ToothEngagement(
            [0, 1],
            other.rows[:1] * 0.0 + [[tilt, tilt + 0.6, 0.0, 6.0, f * math.cos(tilt), 0.0, -f * math.sin(tilt)]],
            [-1],
            [0],
            edge,
        ),
        mill,
    )
    turned = forces_over_turn(lag, mill, METAL, theta + tilt)[1]
    np.testing.assert_allclose(turned, torque, rtol=1e-6, atol=1e-6 * torque.max())


def test_each_height_of_a_tooth_has_its_own_radius():
    mill = Cutter(10.0, 4, 0.6, 20.0, 30.0, 6e5, runout=(0.01, 0.4))
    r = tooth_radii(mill, [0.0, math.pi / 2])
    np.testing.assert_allclose(r[0, 1], 0.01 * math.cos(0.4 - math.pi / 2), atol=1e-15)
    np.testing.assert_allclose(r[1, 0], r[0, 1], atol=1e-15)


def test_a_flat_bottom_does_not_feel_runout():
    mill = Cutter(10.0, 4, 0.5, 25.0, 35.0, 6e5, runout=(0.01, 0.3))
    bottom = ToothEngagement([0, 1], [[0.0, math.tau, 0.0, 2.0, 0.0, 0.03, 0.0]], [-1], [0], [[0, 2, 0, 0, 1, 0, 0]])
    chips = chips_of_teeth(bottom, mill)
    assert chips.tooth.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(chips.rows, np.tile(bottom.rows, (4, 1)), atol=1e-9)


def test_ranges_of_one_tooth_stay():
    mill = Cutter(10.0, 4, 0.5, 25.0, 35.0, 6e5, runout=(0.01, 0.0))
    mine = ToothEngagement([0, 1], [[0.0, 1.0, 0.0, 2.0, 0.05, 0.0, 0.0]], [2], [0], [[0, 5, 0, 1, 0, 0, 0.1]])
    kept = chips_of_teeth(mine, mill)
    np.testing.assert_allclose(kept.rows, mine.rows, atol=1e-9)
    assert kept.tooth.tolist() == [2]


def test_equal_steps_have_equal_chips():
    """Chips of a step like the one before are taken over: the same as of a step by itself."""
    mill = Cutter(10.0, 3, 0.6, 20.0, 30.0, 6e5, runout=(0.008, 1.0))
    some = engagement_of_arcs([0.0, 0.0, 0.1, 0.1], [0.7, 0.7, 0.9, 0.9], 0.06, mill, 5.0)
    each, parent, before = chips_and_paths(some, mill)
    for k in range(4):
        alone = chips_of_teeth(some.part(np.array([k])), mill)
        rows = slice(each.start[k], each.start[k + 1])
        np.testing.assert_allclose(each.rows[rows], alone.rows, rtol=1e-12, atol=1e-12)
        assert (parent[rows] == k).all()
        assert ((before[rows] >= 0) & (before[rows] <= 3)).all()


def test_the_stated_error_holds_for_random_cuts():
    """A small sample of benchmarks/truth.py."""
    off, stated = [], []
    for seed in range(40):
        g = np.random.default_rng(70_000 + seed)
        D, N = float(g.choice([4.0, 6.0, 10.0, 16.0])), int(g.integers(2, 6))
        ap, ae = D * math.exp(g.uniform(math.log(0.1), 0.0)), D * math.exp(g.uniform(math.log(0.004), -0.05))
        fz, e = D * math.exp(g.uniform(math.log(0.002), math.log(0.015))), float(g.choice([0.0, 0.005, 0.01]))
        cut = Cut(D, N, float(g.uniform(20.0, 50.0)), ap, ae, fz, bool(g.integers(2)), e, float(g.uniform(0.0, 6.28)))
        found, own = loads_of(cut, 48)
        off.append(np.abs(found / true_loads(cut, K, 48) - 1.0)[:3].max())
        stated.append(own)
    assert (np.array(off) <= np.array(stated)).mean() >= 0.97
    assert (np.array(off) <= 2.0 * np.array(stated)).all()
