"""Thrust and torque of drills against handbooks' formulas, worked examples, and a sum over the lips."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.cutter.cutter import Cutter
from chipload.cutting.drilling import chisel_factors, drill_loads, force_per_radius, is_pointed
from chipload.cutting.material import Material, material_named
from chipload.errors import InputError

STEEL = material_named("group-2-steel")


def drill(diameter: float, point_deg: float = 118.0, **more: float) -> Cutter:
    bottom = math.radians(90.0 - 0.5 * point_deg)
    return Cutter(diameter, 2, math.radians(30.0), 6.0 * diameter, 8.0 * diameter, 5.8e5, bottom=bottom, **more)


def constant(kc: float) -> Material:
    return Material("constant", kc, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up")


def full(cutter: Cutter, material: Material, feed: float) -> tuple[float, float]:
    """Torque [N m] and thrust [N] of a drill in full material."""
    lips = force_per_radius(cutter, material, [feed]) * cutter.diameter**2 / 8.0
    own = drill_loads(cutter, material, [feed], lips, [True])
    return float((lips + own.chisel_torque)[0]) / 1e3, float(own.thrust[0])


@pytest.mark.parametrize(
    ("diameter", "torque_factor", "thrust_factor"), [(4.8, 16.84, 3.51), (11.0, 74.90, 6.81), (25.5, 340.2, 13.34)]
)
@pytest.mark.parametrize(("feed", "feed_factor"), [(0.1, 0.158), (0.2, 0.276), (0.4, 0.480)])
@pytest.mark.parametrize(
    ("web", "a", "b", "j"), [(0.155, 1.085, 1.355, 0.030), (0.025, 1.0, 1.1, 0.001), (0.30, 1.31, 1.575, 0.12)]
)
def test_the_tables_of_a_handbook(diameter, torque_factor, thrust_factor, feed, feed_factor, web, a, b, j):
    """[Machinery2020] p. 1152, 1153: M and T by the printed factors, whose material has Kd = 5 kc (f D)^0.2."""
    kd = 16000.0
    by_hand = (
        0.000025 * kd * feed_factor * torque_factor * a,
        0.05 * kd * feed_factor * thrust_factor * b + 0.007 * kd * diameter**2 * j,
    )
    kc = 0.2 * kd / (feed * diameter) ** 0.2
    assert full(drill(diameter, web=web * diameter), constant(kc), feed) == pytest.approx(by_hand, rel=6e-3)


def test_a_worked_example_of_a_drill_without_a_chisel_edge():
    """[Iscar2017] p. 601: 22 mm, 0.15 mm, kc 2200, 2894 1/min: 20 N m, 8.06 kW at 75 %, about 2286 N."""
    torque, thrust = full(drill(22.0, web=0.01), constant(2200.0), 0.15)
    assert torque == pytest.approx(20.0, abs=0.05)
    assert torque * 2894.0 * math.tau / 60.0 / 0.75 / 1e3 == pytest.approx(8.06, abs=0.02)
    # their factor 0.63 is approximate and between the 0.5 of lips and that of a chisel edge
    assert math.exp(-1.96 * 0.2) < thrust / 2286.0 < math.exp(1.96 * 0.2)


def test_published_values_are_inside_the_spread():
    """Steel: [Tungaloy2020] L068 with K of 1.42 to 2.41, [MmcDrilling]: 15 N m and 2500 N at 10 mm, 0.3 mm.

    Model 0.2 and coefficients 0.3 in squares, two-sided 95 %.
    """
    room = 1.96 * math.hypot(0.2, 0.3)
    torque, thrust = full(drill(10.0), STEEL, 0.3)
    assert abs(math.log(15.0 / torque)) < room
    assert abs(math.log(2500.0 / thrust)) < room
    for k in (1.42, 1.62, 2.22, 2.41):
        for diameter, feed in ((6.0, 0.12), (10.0, 0.2), (16.0, 0.3)):
            torque, thrust = full(drill(diameter), STEEL, feed)
            assert abs(math.log(k * diameter**2 * (0.630 + 16.84 * feed) / 100.0 / torque)) < room
            assert abs(math.log(570.0 * k * diameter * feed**0.85 / thrust)) < room


@pytest.mark.parametrize("name", ["group-2-steel", "al7075-t6"])
@pytest.mark.parametrize("reach", [0.3, 1.0])
def test_a_sum_over_the_lips(name, reach):
    """Both lips in pieces of 1 um along their edge, from the axis to a share of the radius; 140 deg, no web."""
    own, cutter, feed = material_named(name), drill(10.0, 140.0, web=0.01), 0.18
    kappa, edge = math.radians(70.0), 5.0 * reach / math.sin(math.radians(70.0))
    s = (np.arange(round(edge / 1e-3)) + 0.5) * (edge / round(edge / 1e-3))
    h, ds = 0.5 * feed * math.sin(kappa), edge / len(s)
    tangential = (own.Ktc * h ** (1.0 - own.exponents[0]) + own.Kte) * ds
    torque, force = 2.0 * (tangential * s * math.sin(kappa)).sum(), 2.0 * tangential * len(s)
    found = drill_loads(cutter, own, [feed], [torque], [True])
    whole = 2.0 * (own.Ktc * h ** (1.0 - own.exponents[0]) + own.Kte) * 5.0 / math.sin(kappa)
    kc = whole / (5.0 * feed)
    chisel = 0.1 * 0.5 * whole + 0.007 * 5.0 * kc * (feed * 10.0) ** 0.2 * 100.0 * 0.001
    assert found.chisel_torque[0] == 0.0
    assert found.thrust[0] == pytest.approx(0.5 * force + chisel, rel=1e-6)


def test_work_of_a_turn_is_the_specific_energy_of_its_chips():
    """Without edge force and chisel edge: 2 pi M = Ktc pi D^2 f / 4."""
    torque, _ = full(drill(8.0, web=0.01), constant(900.0), 0.25)
    assert math.tau * torque * 1e3 == pytest.approx(900.0 * math.pi / 4.0 * 64.0 * 0.25, rel=1e-12)


def test_a_hole_that_was_drilled_before_leaves_the_rim_of_the_lips():
    """From 3 to 5 mm radius: k (25 - 9) / 2 of torque, k (5 - 3) / 2 of thrust, no chisel edge."""
    cutter, k = drill(10.0), float(force_per_radius(drill(10.0), STEEL, [0.2])[0])
    own = drill_loads(cutter, STEEL, [0.2], [8.0 * k], [False])
    assert own.chisel_torque[0] == 0.0
    assert own.thrust[0] == pytest.approx(k)


def test_what_has_the_point_of_a_drill():
    assert is_pointed(drill(10.0))
    for mill in (
        Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5), replace(drill(10.0), corner_radius=0.2),
        Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, taper=0.3),
    ):  # fmt: skip
        assert not is_pointed(mill)


def test_a_thicker_web_costs_thrust():
    thrusts = [full(drill(10.0, web=w), STEEL, 0.2)[1] for w in (0.25, 1.0, 1.55, 2.5)]
    assert np.all(np.diff(thrusts) > 0.0)
    assert chisel_factors(drill(10.0)) == chisel_factors(drill(10.0, web=1.55)) == (1.085, 1.355, 0.03)
    with pytest.raises(InputError, match=r"cutter.web_mm = 4: must be above 0 and at most 0.35 diameter_mm = 3.5"):
        drill(10.0, web=4.0)
