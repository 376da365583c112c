"""Force against slices, vectors and hand formulas; phi, h, theta as in chipload.cutting.force."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.force import forces_along, forces_over_turn, greatest_forces, mean_forces
from chipload.cutting.material import Material, material_named
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.errors import InputError

AL = material_named("al7075-t6")
MILL = Cutter(10.0, 4, math.radians(30.0), 25.0, 35.0, 6e5)
NO_EDGE = Material("no edge", 800.0, 250.0, 150.0, 0.0, 0.0, 0.0, source="made up")


def sliced(theta, arcs, feed, cutter, material, depth, slices):
    """Force (T, n, axis) and torque of the front by summing slices; a slice counts for the part that is engaged."""
    z = np.linspace(0.0, depth, slices + 1)
    total = np.zeros(4)
    lag = math.tan(cutter.helix) / cutter.radius
    n = cutter.flutes
    for j in range(n):
        tip = theta - math.tau * j / n
        for low, high in arcs:
            for turn in range(-1, 4):
                bottom = tip + math.tau * turn - lag * z[:-1]
                top = tip + math.tau * turn - lag * z[1:]
                a = np.clip(top, low, high)
                b = np.clip(bottom, low, high)
                share = (b - a) / (bottom - top)
                phi = 0.5 * (a + b)
                h = feed * np.sin(phi)
                dz = np.where(h > 0.0, share * np.diff(z), 0.0)
                f_t = (material.Ktc * h + material.Kte) * dz
                f_r = (material.Krc * h + material.Kre) * dz
                f_a = (material.Kac * h + material.Kae) * dz
                total += [
                    np.sum(-f_t * np.cos(phi) - f_r * np.sin(phi)),
                    np.sum(f_t * np.sin(phi) - f_r * np.cos(phi)),
                    -f_a.sum(),
                    cutter.radius * f_t.sum(),
                ]
    return total


@pytest.mark.parametrize(
    ("arcs", "helix", "flutes", "depth"),
    [
        ([(2.8, math.pi)], 30.0, 4, 5.0),
        ([(0.0, 0.4)], 45.0, 3, 25.0),
        ([(0.0, math.pi)], 12.0, 2, 8.0),
        ([(0.1, 0.5), (2.0, 2.9)], 60.0, 5, 25.0),
        ([(1.0, 1.2)], 0.5, 1, 10.0),
    ],
)
def test_closed_form_equals_two_thousand_slices(arcs, helix, flutes, depth):
    mill = replace(MILL, helix=math.radians(helix), flutes=flutes)
    ends = np.array([arcs])
    engagement = engagement_of_arcs(ends[..., 0], ends[..., 1], 0.06, mill, depth)
    theta = np.append(np.random.default_rng(1).uniform(0.0, math.tau, 8), arcs[0][0] + np.array([0.01, 0.1]))
    force, torque = forces_over_turn(engagement, mill, AL, theta)
    ours = np.column_stack([force[0], torque[0]])
    brute = np.array([sliced(t, arcs, 0.06, mill, AL, depth, 2000) for t in theta])
    assert np.abs(brute).max() > 1.0
    np.testing.assert_allclose(ours, brute, rtol=0.0, atol=1e-6 * np.abs(brute).max(axis=0).max())


@pytest.mark.parametrize("spindle", ["cw", "ccw"])
def test_direction_by_vectors_of_the_moving_tooth(spindle):
    """One straight tooth in a slot: where its chip is thickest, a little off straight ahead, the force opposes omega x
    p, and points at the axis.
    """
    mill = replace(MILL, helix=0.0, flutes=1)
    p = np.array([math.cos(0.7), math.sin(0.7)])
    omega = np.array([0.0, 0.0, -1.0 if spindle == "cw" else 1.0])
    depth, h = 3.0, 0.05
    motion = np.cross(omega, [*p, 0.0])[:2]
    expected = -depth * ((AL.Ktc * h + AL.Kte) * motion + (AL.Krc * h + AL.Kre) * p)
    out = forces_along([0.0], [math.pi], h, p[None], mill, AL, depth, spindle_speed=0.0, spindle=spindle)
    off = 6e-3 * np.linalg.norm(expected)
    np.testing.assert_allclose([out["force_x_n"][0], out["force_y_n"][0]], expected, rtol=0.0, atol=off)
    assert out["force_xy_n"][0] == pytest.approx(np.linalg.norm(expected), rel=1e-5)
    assert out["force_z_n"][0] == pytest.approx(-depth * (AL.Kac * h + AL.Kae), rel=1e-5)
    assert out["chip_max_mm"][0] == pytest.approx(h, rel=1e-5)


def test_down_milling_drives_the_cutter_forward_and_off_the_wall_up_milling_holds_it_back():
    """Climb milling at a small depth, wall on the right (-y): the work pushes the cutter along +x and +y."""
    a = 0.3
    heading = [[1.0, 0.0]] * 2
    out = forces_along([math.pi - a, 0.0], [math.pi, a], 0.05, heading, MILL, AL, 5.0, spindle_speed=0.0)
    assert out["force_x_mean_n"][0] > 0.0
    assert out["force_y_mean_n"][0] > 0.0
    assert out["force_x_mean_n"][1] < 0.0


@pytest.mark.parametrize("arc", [(2.9, math.pi), (0.0, 0.35), (0.0, math.pi), (0.3, 1.1)])
def test_means_equal_the_textbook_closed_form(arc):
    """[Altintas2012] ch. 2, average milling forces; x along T, y along n."""
    s, e = arc
    feed, depth, n = 0.07, 4.0, MILL.flutes

    def bound(f):
        return f(e) - f(s)

    k, c = AL, n * depth * feed / (8.0 * math.pi)
    d = n * depth / (2.0 * math.pi)
    fx = bound(
        lambda p: (
            c * (k.Ktc * math.cos(2 * p) - k.Krc * (2 * p - math.sin(2 * p)))
            + d * (-k.Kte * math.sin(p) + k.Kre * math.cos(p))
        )
    )
    fy = bound(
        lambda p: (
            c * (k.Ktc * (2 * p - math.sin(2 * p)) + k.Krc * math.cos(2 * p))
            - d * (k.Kte * math.cos(p) + k.Kre * math.sin(p))
        )
    )
    fz = -bound(lambda p: d * (-k.Kac * feed * math.cos(p) + k.Kae * p))
    engagement = engagement_of_arcs([s], [e], feed, MILL, depth)
    force, _ = mean_forces(engagement, MILL, AL)
    np.testing.assert_allclose(force[0], [fx, fy, fz], rtol=1e-12)
    theta = (np.arange(4000) + 0.5) * math.tau / 4000
    turn, torque = forces_over_turn(engagement, MILL, AL, theta)
    np.testing.assert_allclose(turn[0].mean(axis=0), force[0], rtol=1e-5)
    assert torque[0].mean() == pytest.approx(mean_forces(engagement, MILL, AL)[1][0], rel=1e-5)


def test_straight_teeth_are_at_their_worst_where_they_enter():
    """Helix 0, down milling: F = depth hypot(Ktc f sin a + Kte, Krc f sin a + Kre) at phi = pi - a."""
    mill = replace(MILL, helix=0.0)
    a, feed, depth = 0.33, 0.05, 5.0
    engagement = engagement_of_arcs([math.pi - a], [math.pi], feed, mill, depth)
    peak = greatest_forces(engagement, mill, AL)
    h = feed * math.sin(a)
    tangential = AL.Ktc * h + AL.Kte
    resultant = depth * math.hypot(tangential, AL.Krc * h + AL.Kre)
    assert math.hypot(peak["force_t"][0], peak["force_n"][0]) == pytest.approx(resultant, rel=1e-7)
    assert peak["torque"][0] == pytest.approx(depth * tangential * mill.radius, rel=1e-7)
    assert peak["theta"][0] % (math.tau / 4) == pytest.approx((math.pi - a) % (math.tau / 4), abs=1e-8)


@pytest.mark.parametrize("helix", [0.0, 25.0])
def test_four_teeth_in_a_full_slot_are_steady(helix):
    """Sum of sin^2 over two teeth a quarter turn apart is 1, of sin cos is 0: F = depth f (-Krc, Ktc), never else."""
    mill = replace(MILL, helix=math.radians(helix))
    engagement = engagement_of_arcs([0.0], [math.pi], 0.05, mill, 5.0)
    force, _ = forces_over_turn(engagement, mill, NO_EDGE, np.linspace(0.01, 6.0, 50))
    np.testing.assert_allclose(force[0, :, 0], -5.0 * 0.05 * NO_EDGE.Krc, rtol=1e-12)
    np.testing.assert_allclose(force[0, :, 1], 5.0 * 0.05 * NO_EDGE.Ktc, rtol=1e-12)
    peak = greatest_forces(engagement, mill, NO_EDGE)
    resultant = 0.25 * math.hypot(NO_EDGE.Ktc, NO_EDGE.Krc)
    assert math.hypot(peak["force_t"][0], peak["force_n"][0]) == pytest.approx(resultant)


@pytest.mark.parametrize("runout", [(0.0, 0.0), (0.006, 1.1)])
def test_greatest_is_no_accident_of_sampling(runout):
    """Against samples a hundred times finer: never below them, and never more than 0.1 % above."""
    rng = np.random.default_rng(5)
    for _ in range(6):
        mill = replace(
            MILL, flutes=int(rng.integers(1, 6)), helix=math.radians(float(rng.uniform(0.0, 55.0))), runout=runout
        )
        low = float(rng.uniform(0.0, 2.5))
        high = float(rng.uniform(low + 0.02, math.pi))
        depth = float(rng.uniform(0.3, 25.0))
        engagement = chips_of_teeth(engagement_of_arcs([low], [high], 0.04, mill, depth), mill)
        peak = greatest_forces(engagement, mill, AL)
        theta = np.arange(36000) * math.tau / 36000
        force, torque = forces_over_turn(engagement, mill, AL, theta)
        for ours, fine in (
            (math.hypot(peak["force_t"][0], peak["force_n"][0]), np.hypot(force[0, :, 0], force[0, :, 1]).max()),
            (peak["torque"][0], torque[0].max()),
            (abs(peak["force_axis"][0]), np.abs(force[0, :, 2]).max()),
        ):
            assert fine * (1.0 - 1e-7) <= ours <= fine * 1.001


def test_two_arcs_add_up_where_the_teeth_are_far_apart():
    mill = replace(MILL, helix=0.2)
    both = engagement_of_arcs([[0.0, 2.6]], [[0.4, math.pi]], 0.05, mill, 4.0)
    apart = engagement_of_arcs([0.0, 2.6], [0.4, math.pi], 0.05, mill, 4.0)
    theta = np.linspace(0.0, 6.0, 40)
    together, _ = forces_over_turn(both, mill, AL, theta)
    each, _ = forces_over_turn(apart, mill, AL, theta)
    np.testing.assert_allclose(together[0], each[0] + each[1], atol=1e-10)
    assert np.abs(each).max() > 10.0


def test_padding_is_not_cut():
    arcs = np.array([[[2.8, math.pi], [9.0, 7.0]], [[0.0, 0.0], [0.0, 0.0]]])
    args = ([[1.0, 0.0]] * 2, MILL, AL, 5.0)
    out = forces_along(arcs[..., 0], arcs[..., 1], 0.05, *args, spindle_speed=400.0, count=[1, 0])
    alone = forces_along([2.8], [math.pi], 0.05, [[1.0, 0.0]], *args[1:], spindle_speed=400.0)
    for name, column in out.items():
        assert column.shape == (2,)
        assert column[0] == alone[name][0]
        assert column[1] == 0.0
    assert out["power_w"][0] == pytest.approx(out["torque_mean_nm"][0] * 400.0)


def test_slices_of_a_cut_add_up_to_the_cut():
    """The interface of engagement ranges: a depth cut into slices is the same cut."""
    whole = engagement_of_arcs([2.7], [math.pi], 0.05, MILL, 6.0)
    heights = np.linspace(0.0, 6.0, 8)
    rows = [[2.7, math.pi, a, b, 0.05, 0.0, 0.0] for a, b in pairwise(heights)]
    parts = ToothEngagement(np.array([0, 7]), np.array(rows), np.full(7, -1), np.zeros(7, dtype=int), whole.slices)
    theta = np.linspace(0.0, 6.0, 30)
    np.testing.assert_allclose(
        forces_over_turn(parts, MILL, AL, theta)[0], forces_over_turn(whole, MILL, AL, theta)[0], atol=1e-10
    )
    np.testing.assert_allclose(mean_forces(parts, MILL, AL)[0], mean_forces(whole, MILL, AL)[0], rtol=1e-12)
    ours, theirs = greatest_forces(parts, MILL, AL), greatest_forces(whole, MILL, AL)
    for name in ("force_t", "force_n", "torque", "force_axis"):
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"phi_out": [3.5]}, "arc 0 of step 0: 2.8 to 3.5 rad: must rise within 0 to pi"),
        ({"phi_in": [float("nan")]}, "arc 0 of step 0: nan to 3.14159 rad: must rise within 0 to pi"),
        ({"feed_per_tooth": -0.05}, "feed_per_tooth[0] = -0.05 mm: must be at least 0"),
        ({"T": [[2.0, 0.0]]}, "T of shape (1, 2): need (1, 2) unit vectors, one a step"),
        ({"axial_depth": 26.0}, "axial_depth_mm = 26: must be above 0 and at most cutter.flute_length_mm = 25"),
        ({"count": [-1]}, "count: must be (1,) integers from 0 to 1, the number of arcs kept a step"),
        ({"spindle": "left"}, "spindle = 'left': must be cw or ccw"),
        ({"spindle_speed": -1.0}, "spindle_speed: must be finite and at least 0 rad/s"),
        ({"sample_step": 1.0}, "sample_step = 57.2958 deg: must be above 0 and at most 15"),
        (
            {"cutter": replace(MILL, corner_radius=1.0)},
            "cutter.corner_radius_mm = 1: forces are known for a straight flank only; choose a flat end mill",
        ),
    ],
)
def test_refused(change, message):
    args = {
        "phi_in": [2.8],
        "phi_out": [math.pi],
        "feed_per_tooth": 0.05,
        "T": [[1.0, 0.0]],
        "cutter": MILL,
        "material": AL,
        "axial_depth": 5.0,
        "spindle_speed": 400.0,
    }
    with pytest.raises(InputError) as err:
        forces_along(**{**args, **change})
    assert str(err.value) == message


def test_the_greatest_torque_of_a_straight_tooth_by_hand():
    """Ktc a h R = 1000 x 2 x 0.1 x 5 N mm, where the chip of a slot is thickest."""
    plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this test")
    mill = Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5)
    found = forces_along([0.0], [math.pi], 0.1, [[1.0, 0.0]], mill, plain, 2.0, spindle_speed=100.0)
    assert found["torque_nm"] == pytest.approx([1.0], rel=1e-3)
