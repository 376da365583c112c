"""Multipliers and margins against closed forms, collocation, semi-discretisation, many frequencies and time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.errors import InputError
from chipload.stability import _tooth_period
from chipload.stability._directional import G3, W3, matrices
from chipload.stability._spectrum import greatest
from chipload.stability.chart import critical_depth, stability_chart
from chipload.stability.cuts import dynamic_cuts
from chipload.stability.margin import MOST_MARGIN, largest_multipliers, stability_margins
from chipload.stability.modes import Modes
from stability.stability_oracles import (
    KR,
    KT,
    METAL,
    ONE,
    TAU,
    TWO,
    collocation,
    cut_of,
    down,
    in_time,
    many_frequencies,
    mill,
    semi_discretisation,
    shapes,
    with_loss_of_contact,
    with_pitches,
)  # fmt: skip
from stability.zero_order import zero_order_margin

SLOT, HALF, THIN = down(1.0), down(0.5), down(0.05)
#: |mu| by collocation, to 1e-8
KNOWN = [
    (ONE, 4000, 0.8, SLOT, 0.0, 0.41497698), (ONE, 9000, 1.5, SLOT, 0.0, 0.84603298),
    (ONE, 6000, 2.0, HALF, 0.0, 0.51201098), (ONE, 11000, 1.2, HALF, 0.0, 0.62156467),
    (ONE, 9300, 6.0, THIN, 0.0, 1.02250195), (TWO, 4000, 0.8, SLOT, 0.0, 1.33673105),
    (TWO, 9000, 1.5, SLOT, 0.0, 1.86913676), (TWO, 6000, 2.0, HALF, 0.0, 0.81884769),
    (TWO, 11000, 1.2, HALF, 0.0, 0.88696125), (TWO, 9300, 6.0, THIN, 0.0, 0.96659523),
    (TWO, 6000, 2.0, HALF, 30.0, 0.81818135), (TWO, 9000, 4.0, HALF, 30.0, 1.27863473),
]  # fmt: skip


@pytest.mark.parametrize(("modes", "rpm", "depth", "arc", "helix", "size"), KNOWN)
def test_multipliers_are_those_of_collocation(modes, rpm, depth, arc, helix, size):
    cut = cut_of(modes, rpm, depth, arc, helix=helix)
    assert abs(largest_multipliers(cut)[0]) == pytest.approx(size, abs=3e-6)
    if not helix:
        assert collocation(modes, rpm, depth, arc) == pytest.approx(size, abs=2e-6)


def test_semi_discretisation_comes_to_the_same():
    size = abs(largest_multipliers(cut_of(TWO, 9000, 1.0, HALF))[0])
    coarse, fine = (semi_discretisation(TWO, 9000, 1.0, HALF, m=m) for m in (60, 120))
    assert fine == pytest.approx(size, rel=5e-3)
    assert abs(fine - size) < 0.5 * abs(coarse - size)


def test_the_map_is_of_order_four_across_breaks():
    cut, waves = cut_of(ONE, 3000, 1.0, HALF), 650.0 / 150.0
    error = [abs(abs(largest_multipliers(cut, per_wave=(m - 0.5) / waves)[0]) - 0.7740567440) for m in (20, 40, 80)]
    assert error == pytest.approx([2.9e-3, 1.9e-4, 1.2e-5], rel=0.1)
    assert error[0] / error[1] > 12.0
    assert error[1] / error[2] > 12.0


@pytest.mark.parametrize(
    ("rpm", "depth"), [(2000, 1.70587), (4000, 1.77036), (8000, 6.85682), (9500, 14.10215), (12000, 1.07443)]
)
def test_four_teeth_in_a_slot_have_the_depth_of_the_closed_form(rpm, depth):
    cut = cut_of(ONE, rpm, 1.0, SLOT, teeth=4)
    assert critical_depth(cut, 20.0) == pytest.approx(depth, rel=2e-5)
    assert zero_order_margin(cut)[0][0] == pytest.approx(depth, rel=5e-3)  # A is constant: zero order is exact


def test_the_least_depth_of_a_slot_over_all_speeds():
    """2 k z (1 + z) / Krc at w_c = w sqrt(1 + 2 z), with a delay at which the phase fits."""
    least = 2.0 * 5000.0 * 0.02 * 1.02 / KR
    assert least == pytest.approx(0.9714286)
    hz = 650.0 * math.sqrt(1.04)
    phase = math.pi + 2.0 * math.atan2(-2.0 * 0.02 * math.sqrt(1.04), -0.04)
    found = []
    for turns in (2, 3, 4):
        period = (turns + phase % TAU / TAU) / hz
        found.append(critical_depth(cut_of(ONE, 15.0 / period, 1.0, SLOT, teeth=4), 4.0))
    assert found == pytest.approx([least] * 3, rel=1e-3)


@pytest.mark.parametrize(("rpm", "gain"), [(6000, 0.187196), (9000, 0.162677)])
def test_the_depth_of_an_axial_pitch_has_no_harmonics(rpm, gain):
    cut = cut_of(TWO, rpm, TAU / (3 * math.tan(math.radians(30.0)) / 5.0), HALF, helix=30.0)
    assert stability_margins(cut).margin[0] == pytest.approx(gain, rel=1e-3)
    assert zero_order_margin(cut)[0][0] == pytest.approx(gain, rel=1e-3)


@pytest.mark.parametrize(
    ("rpm", "arc", "depth", "zero_order"),
    [
        (6000, HALF, 4.0458, 3.8625),
        (8000, HALF, 0.9505, 0.9344),
        (9300, HALF, 2.6513, 2.5460),
        (8000, THIN, 3.5966, 3.1031),
        (9300, THIN, 5.1934, 8.4555),
    ],
)
def test_critical_depths_and_what_zero_order_makes_of_them(rpm, arc, depth, zero_order):
    assert critical_depth(cut_of(ONE, rpm, 1.0, arc), 10.0) == pytest.approx(depth, abs=6e-5)
    margin = stability_margins(cut_of(ONE, rpm, 0.7 * depth, arc))
    assert margin.margin[0] == pytest.approx(1.0 / 0.7, rel=5e-3)
    assert zero_order_margin(cut_of(ONE, rpm, 1.0, arc))[0][0] == pytest.approx(zero_order, rel=1e-3)


def test_a_flip_that_zero_order_misses_by_63_percent_is_told_by_its_frequency():
    depth = critical_depth(cut_of(ONE, 9300, 1.0, THIN), 10.0)
    assert zero_order_margin(cut_of(ONE, 9300, depth, THIN))[0][0] > 1.6
    found = stability_margins(cut_of(ONE, 9300, 1.1 * depth, THIN))
    assert found.margin[0] < 1.0 < math.exp(found.growth[0])
    assert found.frequency[0] == pytest.approx(1.5 * 9300 * 3 / 60)  # an odd multiple of half the tooth frequency
    at = many_frequencies(ONE, 9300, 1.0, THIN, depth)
    beside = many_frequencies(ONE, 9300, 1.0, THIN, 0.98 * depth)
    assert abs(at) < 0.02 * abs(beside)


def test_more_teeth_periods_are_powers_and_coefficients_scale():
    a = abs(largest_multipliers(cut_of(TWO, 6000, 2.0, HALF))[0])
    even = largest_multipliers(with_pitches(cut_of(TWO, 6000, 2.0, HALF), [TAU / 3] * 3))[0]
    assert abs(even) == pytest.approx(a**3, rel=1e-5)
    twice = Material("twice", 2 * KT, 2 * KR, 0.0, 0.0, 0.0, 0.0, source="made up for tests")
    one, two = (stability_margins(cut_of(ONE, 8000, 0.5, HALF, metal=m)).margin[0] for m in (METAL, twice))
    assert one == pytest.approx(2.0 * two, rel=4e-3)


def test_idle_teeth_leave_the_free_modes():
    cut = cut_of(TWO, 6000, 2.0, HALF)
    decay = max(math.exp(-z * TAU * f / 300.0) for f, z in zip(TWO.frequency, TWO.damping, strict=True))
    assert abs(largest_multipliers(cut, 1e-12)[0]) == pytest.approx(decay, rel=1e-6)


def test_a_mirrored_cut_has_the_same_multiplier():
    """Spindle and n mirrored: the same cutter in a mirror."""
    skew = Modes([650.0, 720.0], [0.02, 0.025], [5000.0, 7000.0], [[1.0, 0.4], [-0.3, 1.0]])
    mirrored = Modes([650.0, 720.0], [0.02, 0.025], [5000.0, 7000.0], [[1.0, -0.4], [-0.3, -1.0]])
    a = largest_multipliers(cut_of(skew, 7000, 1.5, HALF))[0]
    b = largest_multipliers(cut_of(mirrored, 7000, 1.5, HALF, n=(0.0, -1.0)))[0]
    other = largest_multipliers(cut_of(mirrored, 7000, 1.5, HALF))[0]
    assert a == pytest.approx(b, rel=1e-9)
    assert abs(abs(other) - abs(a)) > 1e-3


def test_feed_directions_turn_with_the_modes():
    angle = 0.7
    turned = Modes(
        [650.0, 720.0], [0.02, 0.025], [5000.0, 7000.0],
        [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]],
    )  # fmt: skip
    T, n = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
    a = largest_multipliers(cut_of(TWO, 7000, 1.5, HALF))[0]
    assert largest_multipliers(cut_of(turned, 7000, 1.5, HALF, T=T, n=n))[0] == pytest.approx(a, rel=1e-9)


@pytest.mark.parametrize(
    ("pitches", "depth", "size"),
    [
        ((120, 120, 120), 1.0, 0.540874),
        ((120, 120, 120), 2.0, 0.549047),
        ((110, 120, 130), 1.0, 0.52109),
        ((110, 120, 130), 2.0, 0.6413),
        ((104, 120, 136), 1.0, 0.44983),
        ((104, 120, 136), 2.0, 0.50926),
    ],
)
def test_teeth_that_are_not_evenly_spaced(pitches, depth, size):
    assert abs(
        largest_multipliers(with_pitches(cut_of(TWO, 6000, depth, HALF), np.radians(pitches)))[0]
    ) == pytest.approx(size, abs=2e-4)


@pytest.mark.parametrize(("rpm", "depth"), [(6000, 2.0), (8000, 1.5), (9000, 4.0), (4000, 12.0)])
def test_margins_of_teeth_that_are_not_evenly_spaced(rpm, depth):
    """Even pitches have the margin of even teeth; at the margin of others |mu| is 1, and the mode is one of both."""
    cut = cut_of(TWO, rpm, depth, HALF)
    even, usual = stability_margins(with_pitches(cut, [TAU / 3] * 3)), stability_margins(cut)
    assert even.margin[0] == pytest.approx(usual.margin[0], rel=4e-3)
    assert even.growth[0] == pytest.approx(usual.growth[0], abs=1e-3)
    assert even.mode[0] == usual.mode[0]
    assert even.frequency[0] == pytest.approx(usual.frequency[0], abs=60.0 / TAU)
    uneven = with_pitches(cut, np.radians([104.0, 120.0, 136.0]))
    found = stability_margins(uneven)
    if found.margin[0] < 3.0:
        assert abs(largest_multipliers(uneven, found.margin)[0]) == pytest.approx(1.0, abs=0.02)
        assert abs(found.frequency[0] - TWO.frequency[found.mode[0]]) < 0.2 * TWO.frequency[0]
    else:
        assert abs(largest_multipliers(uneven, 3.0)[0]) < 1.0


def test_a_simulation_in_time_agrees_on_40_random_cuts():
    """The sign of log |mu|, and where it is not near 0 its value."""
    rng = np.random.default_rng(7)
    near, unstable, errors = 0, 0, []
    for _ in range(40):
        count = int(rng.integers(1, 4))
        modes = Modes(
            rng.uniform(400.0, 1200.0, count), rng.uniform(0.01, 0.05, count), rng.uniform(3000.0, 20000.0, count),
            rng.standard_normal((count, 2)),
        )  # fmt: skip
        teeth, rpm = int(rng.integers(2, 5)), float(rng.uniform(4000.0, 16000.0))
        share, depth = float(rng.uniform(0.05, 1.0)), float(rng.uniform(0.5, 12.0))
        arc = down(share) if rng.random() < 0.5 else tuple(math.pi - x for x in reversed(down(share)))
        found = stability_margins(cut_of(modes, rpm, depth, arc, teeth=teeth))
        exact = math.log(abs(largest_multipliers(cut_of(modes, rpm, depth, arc, teeth=teeth))[0]))
        w, z, U = shapes(modes)
        steps = max(120, math.ceil(120 * w.max() / TAU * 60.0 / (rpm * teeth)))
        told = in_time(240, steps, teeth, *arc, depth, KT, KR, w, z, np.ascontiguousarray(U), rpm)
        assert abs(found.growth[0] - exact) < 0.02
        assert (found.margin[0] < 1.0) == (found.growth[0] >= 0.0)
        if abs(exact) < 0.02:
            near += 1
            continue
        assert np.sign(told) == np.sign(exact), (exact, told)
        unstable += exact > 0.0
        errors.append(abs(told - exact))
    assert near < 6
    assert 8 < unstable < 32
    assert np.quantile(errors, 0.9) < 0.04


@pytest.mark.parametrize(("rpm", "depth", "grows"), [(6000, 2.0, False), (9000, 2.0, False), (9000, 3.0, True)])
def test_where_teeth_lose_contact_chatter_stays_bounded(rpm, depth, grows):
    """A disturbance of an unstable cut would grow without bound; with loss of contact its motion grows with the feed
    alone. A stable cut settles to the forced motion, which repeats itself in each tooth period.
    """
    exact = math.log(abs(largest_multipliers(cut_of(TWO, rpm, depth, HALF))[0]))
    assert (exact > 0.0) == grows
    w, z, U = shapes(TWO)

    def motion(feed):
        return with_loss_of_contact(400, 240, 3, *HALF, depth, feed, KT, KR, w, z, np.ascontiguousarray(U), rpm)

    size, off = motion(0.05)
    twice, _ = motion(0.1)
    np.testing.assert_allclose(twice[-50:], 2.0 * size[-50:], rtol=0.02 if not grows else 0.4)
    late, before = size[-100:].max(), size[-200:-100].max()
    assert late == pytest.approx(before, rel=0.2 if grows else 1e-6)
    if grows:
        assert off > 0.02
    else:
        # the motion of a tooth period repeats itself
        assert np.ptp(size[-50:]) < 1e-6 * late


def test_the_margin_is_the_factor_at_which_the_multiplier_is_one():
    rng = np.random.default_rng(3)
    for _ in range(20):
        cut = cut_of(
            TWO, float(rng.uniform(4000, 15000)), float(rng.uniform(0.2, 2.0)), down(rng.uniform(0.1, 1.0)), helix=30.0
        )
        found = stability_margins(cut)
        if found.margin[0] < 3.0:
            assert abs(largest_multipliers(cut, found.margin[0])[0]) == pytest.approx(1.0, abs=3e-3)
            assert found.mode[0] in (0, 1)
            below = found.frequency[0] / TWO.frequency[found.mode[0]]
            assert 0.7 < below < 1.4
        else:
            assert (np.abs([largest_multipliers(cut, g)[0] for g in (1.0, 1.25, 1.5, 2.0, 3.0)]) < 1.0).all()
            assert found.frequency[0] == 0.0


def test_a_chart_has_the_signs_of_all_its_points():
    cut = cut_of(TWO, 6000, 1.0, HALF)
    speed, depth = np.linspace(3000, 15000, 60) * TAU / 60.0, np.linspace(0.1, 4.0, 40)
    chart = stability_chart(cut, speed, depth)
    assert chart.evaluated.mean() < 0.7
    wrong = 0
    for i in range(0, 60, 7):
        for j in range(0, 40, 5):
            exact = math.log(abs(largest_multipliers(cut_of(TWO, speed[i] * 60.0 / TAU, depth[j], HALF))[0]))
            wrong += np.sign(exact) != np.sign(chart.growth[i, j]) and abs(exact) > 1e-3
    assert wrong == 0
    k = 30
    assert chart.limit[k] == pytest.approx(critical_depth(cut_of(TWO, speed[k] * 60.0 / TAU, 1.0, HALF), 4.0), abs=0.05)


def test_the_directional_matrix_is_that_of_quadrature_in_numpy():
    """Helix, two slices, exponents: moments of each cell against a sum over the edge."""
    arc, helix = (1.0, 2.6), 30.0
    for exponents in ((0.0, 0.0, 0.0), (0.25, 0.3, 0.2)):
        metal = Material("m", 900.0, 300.0, 200.0, 0.0, 0.0, 0.0, source="made up for tests", exponents=exponents)
        cut = cut_of(TWO, 6000, 3.0, arc, helix=helix, metal=metal, feed=0.08)
        m, pitch = 15, TAU / 3
        A = np.zeros((m, 3, 4))
        matrices(cut.rows, 0, 1, pitch, m, cut.exponents, A)
        theta = (np.arange(m * 400) + 0.5) * pitch / (m * 400)
        s = (np.arange(300) + 0.5) * 3.0 / 300
        phi = theta[:, None] + np.arange(-1, 4)[None, :] * pitch
        phi = phi[:, :, None] - math.tan(math.radians(helix)) / 5.0 * s
        on = (phi > arc[0]) & (phi < arc[1])
        h = np.where(on, 0.08 * np.sin(phi), 1.0)
        kt, kr = (1 - exponents[0]) * 900.0 * h ** -exponents[0], (1 - exponents[1]) * 300.0 * h ** -exponents[1]
        sin, cos = np.sin(phi), np.cos(phi)
        rows = [
            (kt * cos + kr * sin) * sin,
            (kt * cos + kr * sin) * cos,
            (kr * cos - kt * sin) * sin,
            (kr * cos - kt * sin) * cos,
        ]
        exact = -np.stack([(np.where(on, x, 0.0)).sum(axis=(1, 2)) * 3.0 / 300 for x in rows], axis=1)
        mean = exact.reshape(m, 400, 4).mean(axis=1)
        assert np.allclose((A * W3[None, :, None]).sum(axis=1), mean, atol=2e-3 * np.abs(mean).max())
        t = np.tile((np.arange(400) + 0.5) / 400, m).reshape(m, 400)
        first = (exact.reshape(m, 400, 4) * t[:, :, None]).mean(axis=1)
        assert np.allclose((A * (W3 * G3)[None, :, None]).sum(axis=1), first, atol=2e-3 * np.abs(mean).max())


def test_a_bull_nose_counts_its_slope():
    """On a slice with kappa the force across the axis is sin(kappa) (Ktc, sin(kappa) Krc + cos(kappa) Kac)."""
    metal = Material("m", 900.0, 300.0, 200.0, 0.0, 0.0, 0.0, source="made up for tests")
    flat = cut_of(TWO, 6000, 1.0, HALF, metal=metal)
    own = np.array([[0.0, 5.0, 0.0, 0.6, 0.8, 0.0, 0.0]])
    met = ToothEngagement([0, 1], [[HALF[0], HALF[1], 0.0, 1.0, 0.05, 0.0, 0.0]], [-1], [0], own)
    cut = dynamic_cuts(met, mill(), metal, TWO, 6000 * TAU / 60, [[1.0, 0.0]], [[0.0, 1.0]])
    assert cut.rows[0, 5:8].tolist() == pytest.approx([0.6 * 900.0, 0.36 * 300.0, 0.48 * 200.0])
    assert flat.rows[0, 5:8].tolist() == [900.0, 300.0, 0.0]


def test_eigenvalues_of_hessenberg_matrices_are_those_of_lapack():
    rng = np.random.default_rng(0)
    for n in (1, 2, 3, 5, 9, 20):
        H = np.triu(rng.standard_normal((n, n)), -1)
        values = np.linalg.eigvals(H)
        size, angle = greatest(np.ascontiguousarray(H), n, np.empty((n, n)))
        k = np.argmax(np.abs(values))
        assert size == pytest.approx(abs(values[k]), rel=1e-10)
        assert angle == pytest.approx(abs(np.angle(values[k])), abs=1e-7)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        (([650.0], [-0.02], [5000.0], [[0, 1]]), "modes.damping = -0.02"),
        (([0.0], [0.02], [5000.0], [[0, 1]]), "modes.frequency = 0 Hz"),
        (([650.0], [0.02], [5e-3], [[0, 1]]), "modes.stiffness = 0.005 N/mm"),
        (([650.0], [0.02], [5000.0], [[0, 0]]), "modes.direction"),
        (([650.0], [math.nan], [5000.0], [[0, 1]]), "modes.damping = nan"),
        (([], [], [], []), "one or more modes"),
    ],
)
def test_modes_that_cannot_be_are_refused(values, text):
    with pytest.raises(InputError, match=text.replace(".", r"\.")):
        Modes(*values)


def test_what_the_functions_cannot_use_is_refused():
    cut = cut_of(ONE, 6000, 1.0, HALF)
    met = engagement_of_arcs([1.0], [2.0], 0.05, mill(), 1.0)
    for call, text in (
        (lambda: critical_depth(cut, 0.0), "deepest_mm = 0"),
        (lambda: stability_chart(cut.chosen([0, 0]), [1.0, 2.0], [1.0, 2.0]), "2 cuts: must be one"),
        (lambda: stability_chart(cut, [2.0, 1.0], [1.0, 2.0]), "speeds: must be"),
        (lambda: largest_multipliers(with_pitches(cut, [1.0, 2.0, 3.0])), "add up to 360 deg"),
        (lambda: cut.at_speeds(0.0), "above 0 s"),
        (lambda: dynamic_cuts(met, mill(), METAL, ONE, 0.0, [[1, 0]], [[0, 1]]), "spindle speed of 0"),
        (lambda: dynamic_cuts(met, mill(), METAL, ONE, 9.0), "has no frames"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=text):
            call()


def test_a_cut_whose_map_has_no_solution_is_looked_at_in_finer_cells(monkeypatch):
    from chipload.stability import margin

    cut = cut_of(TWO, 8000, 2.0, HALF)
    exact, asked, own = stability_margins(cut).margin[0], [], margin._margins

    def lost(cuts, per_wave):
        asked.append(per_wave)
        out = own(cuts, per_wave)
        if per_wave < 20.0:
            out[:, 0] = -1.0 if per_wave < 12.0 else np.nan
        return out

    monkeypatch.setattr(margin, "_margins", lost)
    assert stability_margins(cut.chosen([0, 0])).margin == pytest.approx([exact] * 2, rel=5e-3)
    assert asked == [9.0, 15.0, 25.0]
    monkeypatch.setattr(margin, "_margins", lambda cuts, per_wave: np.full((len(cuts), 5), -1.0))
    with pytest.raises(InputError, match="a multiplier was not found"):
        stability_margins(cut)


def test_quiet_speeds_have_the_least_margin_of_all_cuts():
    from chipload.stability.speeds import quiet_speeds

    cuts = [cut_of(TWO, 6000, depth, HALF) for depth in (1.0, 2.0)]
    speed = np.linspace(5000, 14000, 40) * TAU / 60.0
    found = quiet_speeds(cuts, speed, 1.2)
    for k in (3, 20, 33):
        each = [stability_margins(cut_of(TWO, speed[k] * 60 / TAU, d, HALF)).margin[0] for d in (1.0, 2.0)]
        assert found.margin[k] == pytest.approx(min(each))
    for window in found.windows:
        inside = (speed >= window.low) & (speed <= window.high)
        assert (found.margin[inside] >= 1.2).all()
        assert window.margin == found.margin[inside].max()
    assert sum(((speed >= w.low) & (speed <= w.high)).sum() for w in found.windows) == (found.margin >= 1.2).sum()
    margin = found.advised(900.0)[1]
    assert margin >= 0.98 * found.margin.max()
    for bad in ([], [-1.0, 2.0], [2.0, 1.0]):
        with pytest.raises(InputError, match="speeds must rise"):
            quiet_speeds(cuts, bad, 1.0)
    with pytest.raises(InputError, match="no cut"):
        quiet_speeds([], [1.0, 2.0], 1.0)


def test_the_greatest_margin_is_the_last_factor_that_is_looked_at():
    assert _tooth_period.ABOVE[-1] == MOST_MARGIN
