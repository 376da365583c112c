"""Force of every cutter form and engagement against a plain double sum and closed forms; notation as in the force."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.cutter.cutter import Cutter
from chipload.cutter.slices import slices
from chipload.cutting.force import forces_over_turn, greatest_forces, in_work, mean_forces
from chipload.cutting.material import Material, material_named
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError

AL = material_named("al7075-t6")
PLAIN = Material("plain", 800.0, 250.0, 150.0, 12.0, 9.0, 4.0, source="made up")
NO_EDGE = Material("no edge", 800.0, 250.0, 150.0, 0.0, 0.0, 0.0, source="made up")
BALL = Cutter(10.0, 2, math.radians(30.0), 20.0, 30.0, 6e5, corner_radius=5.0)
FORMS = {
    "ball": BALL,
    "bull": Cutter(10.0, 3, math.radians(40.0), 20.0, 30.0, 6e5, corner_radius=2.0),
    "cone": Cutter(8.0, 4, math.radians(20.0), 20.0, 30.0, 6e5, taper=math.radians(10.0)),
    "point": Cutter(8.0, 2, math.radians(25.0), 20.0, 30.0, 6e5, corner_radius=0.5, bottom=0.3, taper=0.1),
}


def feed_bites(cutter, feed, low, high, top, corner_slices=16, flank_mm=None):
    """Every slice up to s = top moves by ``feed`` (T, n, A) a tooth and is engaged from low to high, where h > 0."""
    edge = slices(cutter, corner_slices=corner_slices, flank_mm=flank_mm)
    rows, own = [], []
    for k in range(len(edge)):
        ends = edge.s_from[k], min(edge.s_to[k], top)
        if ends[0] >= ends[1]:
            continue
        along, across = edge.sin_kappa[k] * feed[0], edge.sin_kappa[k] * feed[1]
        offset = -edge.cos_kappa[k] * feed[2]
        swing, crest = math.hypot(along, across), math.atan2(along, across)
        if offset <= -swing:
            continue
        reach = math.acos(-offset / swing) if swing > abs(offset) else math.pi
        for turn in (-1, 0, 1, 2):
            a, b = max(low, crest - reach + math.tau * turn), min(high, crest + reach + math.tau * turn)
            if b > a:
                back = math.tau if a > math.tau else 0.0
                rows.append([a - back, b - back, *ends, along, offset, across])
                own.append(k)
    table = np.reshape(rows, (-1, 7))
    return ToothEngagement([0, len(rows)], table, np.full(len(rows), -1), np.array(own, dtype=int), edge.columns)


def point_of(cutter, s):
    """rho, z, kappa of the profile at s, from its definition: bottom line, corner circle, flank."""
    _, r, e, f, alpha, beta, _ = cutter.apt
    flank = math.pi / 2 - beta
    kappa = np.clip(alpha + s / r, alpha, flank) if r > 0.0 else np.where(s < 0.0, alpha, flank)
    up, back = np.maximum(s - r * (flank - alpha), 0.0), np.minimum(s, 0.0)
    rho = e + r * np.sin(kappa) + up * math.sin(beta) + back * math.cos(alpha)
    return rho, f - r * np.cos(kappa) + up * math.cos(beta) + back * math.sin(alpha), kappa


def brute(cutter, material, feed, low, high, top, theta, elements):
    """Force along T, n, A and torque: vectors of elements of edge, one by one, no sinusoid and no closed form."""
    _, r, e, _, alpha, _, _ = cutter.apt
    bottom = (e + r * math.sin(alpha)) / math.cos(alpha)
    ds = (top + bottom) / elements
    s = (np.arange(elements) + 0.5) * ds - bottom
    rho, z, kappa = point_of(cutter, s)
    total = np.zeros(4)
    axis = np.array([0.0, 0.0, 1.0])
    for j in range(cutter.flutes):
        phi = (theta - math.tau * j / cutter.flutes - z * math.tan(cutter.helix) / cutter.radius) % math.tau
        for turn in (0.0, math.tau):
            here = (phi + turn >= low) & (phi + turn < high)
            for x, r, k in zip(phi[here], rho[here], kappa[here], strict=True):
                u = np.array([math.sin(x), math.cos(x), 0.0])
                t = np.array([math.cos(x), -math.sin(x), 0.0])
                nu = math.sin(k) * u - math.cos(k) * axis
                e = math.cos(k) * u + math.sin(k) * axis
                h = nu @ feed
                if h <= 0.0:
                    continue
                f = ds * (np.array(material.coefficients[:3]) * h + material.coefficients[3:])
                total[:3] -= f[0] * t + f[1] * nu + f[2] * e
                total[3] += r * f[0]
    return total


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("feed", "low", "high"),
    [((0.08, 0.0, 0.0), 0.0, math.pi), ((0.06, -0.03, -0.04), 0.0, math.tau), ((0.05, 0.04, 0.01), 5.0, 8.5)],
)
def test_every_form_against_vectors_of_elements(form, feed, low, high):
    cutter = FORMS[form]
    top = 7.0
    theta = np.random.default_rng(3).uniform(0.0, math.tau, 4)
    expected = np.array([brute(cutter, PLAIN, feed, low, high, top, t, 4000) for t in theta])
    engagement = feed_bites(cutter, feed, low, high, top, corner_slices=400, flank_mm=0.5)
    force, torque = forces_over_turn(engagement, cutter, PLAIN, theta)
    assert np.abs(expected).max() > 50.0
    ours = np.column_stack([force[0], torque[0]])
    np.testing.assert_allclose(ours, expected, rtol=0.0, atol=2e-3 * np.abs(expected).max(axis=0).max())


def test_slices_of_the_corner_converge_with_their_square():
    """Mean torque x 2 pi / (N f) = Ktc x the section 2 r (e + r pi / 4) of the corner of a bull nose in a slot."""
    bull, feed = FORMS["bull"], 0.05
    expected = NO_EDGE.Ktc * 2 * 2.0 * (3.0 + 2.0 * math.pi / 4.0)
    error = []
    for pieces in (10, 20, 40):
        engagement = feed_bites(bull, (feed, 0.0, 0.0), 0.0, math.pi, math.pi, pieces)
        torque = mean_forces(engagement, bull, NO_EDGE)[1][0] * math.tau / (3 * feed)
        error.append(abs(torque / expected - 1.0))
    assert error[0] < 1e-3
    assert all(3.9 < a / b < 4.1 for a, b in pairwise(error))


def test_plunge_with_a_full_bottom():
    """h = f everywhere: the thrust is N R (Krc f + Kre) along the axis, the torque N (Ktc f + Kte) R^2 / 2; steady."""
    mill = Cutter(10.0, 4, 0.6, 20.0, 30.0, 6e5)
    f = 0.03
    engagement = feed_bites(mill, (0.0, 0.0, -f), 0.0, math.tau, 0.0)
    thrust = 4 * 5.0 * (PLAIN.Krc * f + PLAIN.Kre)
    twist = 4 * (PLAIN.Ktc * f + PLAIN.Kte) * 12.5
    force, torque = mean_forces(engagement, mill, PLAIN)
    np.testing.assert_allclose(force[0], [0.0, 0.0, thrust], rtol=1e-12, atol=1e-9)
    assert torque[0] == pytest.approx(twist, rel=1e-12)
    force, torque = forces_over_turn(engagement, mill, PLAIN, np.linspace(0.0, 7.0, 40))
    np.testing.assert_allclose(force[0], np.broadcast_to([0.0, 0.0, thrust], (40, 3)), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(torque[0], twist, rtol=1e-12)
    assert engagement.chip_max()[0] == pytest.approx(f, rel=1e-15)


def test_a_drill_with_a_point_angle_plunges():
    """Bottom line at alpha, h = f cos(alpha), edge R / cos(alpha): thrust R [(Krc h + Kre) - tan(alpha) (Kac h + Kae)]
    a tooth.
    """
    drill = Cutter(6.0, 2, 0.5, 20.0, 30.0, 6e5, bottom=math.radians(30.0))
    f = 0.05
    h = f * math.cos(math.radians(30.0))
    engagement = feed_bites(drill, (0.0, 0.0, -f), 0.0, math.tau, 0.0)
    force, torque = mean_forces(engagement, drill, PLAIN)
    one = (PLAIN.Krc * h + PLAIN.Kre) - math.tan(math.radians(30.0)) * (PLAIN.Kac * h + PLAIN.Kae)
    assert force[0, 2] == pytest.approx(2 * 3.0 * one, rel=1e-12)
    assert torque[0] == pytest.approx(2 * (PLAIN.Ktc * h + PLAIN.Kte) * 4.5 / math.cos(math.radians(30.0)), rel=1e-12)


def test_a_ramp_is_a_slot_and_a_plunge():
    """Flat mill, feed forward and down: the flank's h is that of the slot, the bottom's that of the plunge."""
    mill = Cutter(10.0, 3, 0.5, 20.0, 30.0, 6e5)
    args = (0.0, math.tau, 4.0)
    ramp, torque = mean_forces(feed_bites(mill, (0.06, 0.0, -0.01), *args), mill, PLAIN)
    slot, slot_torque = mean_forces(feed_bites(mill, (0.06, 0.0, 0.0), *args), mill, PLAIN)
    plunge, plunge_torque = mean_forces(feed_bites(mill, (0.0, 0.0, -0.01), *args), mill, PLAIN)
    np.testing.assert_allclose(ramp, slot + plunge, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(torque, slot_torque + plunge_torque, rtol=1e-12)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(sorted(FORMS)),
    st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.05, 0.05)).filter(
        lambda f: math.hypot(f[0], f[1]) > 1e-3
    ),
    st.floats(0.0, 6.28),
    st.floats(0.01, 6.28),
)
def test_energy_of_any_engagement(form, feed, low, width):
    """Mean torque x 2 pi / N = integral of rho (Ktc h + Kte) dphi ds, here by 4,000 midpoints of phi; where h begins
    the edge force jumps, so that each of its ends is right to half a step of phi.
    """
    cutter = FORMS[form]
    engagement = feed_bites(cutter, feed, low, low + width, 6.0)
    _, torque = mean_forces(engagement, cutter, PLAIN)
    edge = slices(cutter)
    phi = low + (np.arange(4000) + 0.5) * width / 4000
    total = jump = 0.0
    for k in range(len(edge)):
        ds = min(edge.s_to[k], 6.0) - edge.s_from[k]
        h = edge.sin_kappa[k] * (feed[0] * np.sin(phi) + feed[1] * np.cos(phi)) - edge.cos_kappa[k] * feed[2]
        if ds > 0.0:
            total += ds * edge.rho[k] * np.where(h > 0.0, PLAIN.Ktc * h + PLAIN.Kte, 0.0).sum() * width / 4000
            jump += ds * edge.rho[k] * PLAIN.Kte * width / 4000
    assert torque[0] * math.tau / cutter.flutes == pytest.approx(total, rel=1e-5, abs=1.01 * jump)


@pytest.mark.parametrize("form", FORMS)
def test_the_mean_is_the_mean_over_the_turn(form):
    cutter = FORMS[form]
    engagement = feed_bites(cutter, (0.05, 0.02, -0.02), 0.3, 4.0, 7.0)
    turn, torque = forces_over_turn(engagement, cutter, AL, (np.arange(3000) + 0.5) * math.tau / 3000)
    mean, torque_mean = mean_forces(engagement, cutter, AL)
    np.testing.assert_allclose(turn[0].mean(axis=0), mean[0], rtol=0.0, atol=1e-4 * np.abs(turn).max())
    assert torque[0].mean() == pytest.approx(torque_mean[0], rel=1e-4)


def test_where_immersion_is_counted_from_does_not_matter():
    """The same cut with phi counted from another direction: the force turns with it."""
    shift = 1.3
    one = feed_bites(BALL, (0.05, 0.0, -0.02), 0.4, 3.0, 7.0)
    rows = np.array(one.rows)
    rows[:, :2] += shift
    rows[:, 4] = one.rows[:, 4] * math.cos(shift) + one.rows[:, 6] * math.sin(shift)
    rows[:, 6] = one.rows[:, 6] * math.cos(shift) - one.rows[:, 4] * math.sin(shift)
    other = ToothEngagement(one.start, rows, one.tooth, one.slice, one.slices)
    np.testing.assert_allclose(other.chip_max(), one.chip_max(), rtol=1e-12)
    theta = np.linspace(0.1, 6.0, 30)
    first, torque = forces_over_turn(one, BALL, AL, theta)
    second, other_torque = forces_over_turn(other, BALL, AL, theta + shift)
    c, s = math.cos(shift), math.sin(shift)
    turned = np.stack([c * first[..., 0] + s * first[..., 1], c * first[..., 1] - s * first[..., 0], first[..., 2]], -1)
    np.testing.assert_allclose(second, turned, atol=1e-9)
    np.testing.assert_allclose(other_torque, torque, rtol=1e-9, atol=1e-9)


def test_greatest_of_many_rows_by_samples_is_that_by_breaks():
    engagement = feed_bites(BALL, (0.05, 0.01, -0.02), 0.2, 2.4, 8.0, corner_slices=40, flank_mm=1.0)
    assert len(engagement.rows) > 40
    by_breaks = greatest_forces(engagement, BALL, AL, exact_rows=None)
    by_samples = greatest_forces(engagement, BALL, AL)
    theta = np.arange(20000) * math.tau / 20000
    force, torque = forces_over_turn(engagement, BALL, AL, theta)
    for peak in (by_breaks, by_samples):
        plane = np.hypot(peak["force_t"], peak["force_n"])[0]
        assert plane == pytest.approx(np.hypot(force[0, :, 0], force[0, :, 1]).max(), rel=1e-5)
        assert peak["torque"][0] == pytest.approx(torque[0].max(), rel=1e-5)
        assert abs(peak["force_axis"][0]) == pytest.approx(np.abs(force[0, :, 2]).max(), rel=1e-5)


def test_in_the_frame_of_the_work():
    """A frame turned about its three axes: lengths stay, and its own rows come out for unit forces."""
    rng = np.random.default_rng(4)
    frame = np.linalg.qr(rng.normal(size=(5, 3, 3)))[0]
    force = rng.normal(size=(5, 7, 3))
    out = in_work(force, frame)
    np.testing.assert_allclose(np.linalg.norm(out, axis=2), np.linalg.norm(force, axis=2))
    for k in range(3):
        unit = np.zeros((5, 3))
        unit[:, k] = 1.0
        np.testing.assert_array_equal(in_work(unit, frame), frame[:, k])
    with pytest.raises(InputError, match=r"in_work: force \(5, 7, 3\), frame \(4, 3, 3\): need"):
        in_work(force, frame[:4])
