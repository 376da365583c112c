"""The value of a load at a confidence: closed forms, a sum over teeth and heights, random coefficients and runouts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.checking.load_budget import bounded_factors, budget_parts, factors_of_steps
from chipload.cutter.cutter import Cutter
from chipload.cutting.load_parts import LoadParts, bounded_parts, load_parts
from chipload.cutting.material import Material
from chipload.cutting.revolution import loads_over_turn
from chipload.engagement.tooth_engagement import ToothEngagement, engagement_of_arcs
from chipload.engagement.tooth_surfaces import chips_of_teeth
from chipload.result.budget import ErrorBudget, ErrorPart

K = (800.0, 300.0, 150.0, 20.0, 15.0, 5.0)
Z95 = 1.6448536


def metal(spread: float | None = 0.25, coefficients: tuple[float, ...] = K, **more: object) -> Material:
    return Material("metal", *coefficients, source="made up for tests", spread=spread, **more)


def up(cutter: Cutter, ae: float, fz: float, ap: float) -> ToothEngagement:
    """A steady cut in up milling, its arc from 0 to the wall."""
    end = math.acos(1.0 - 2.0 * min(ae, 0.9999 * cutter.diameter) / cutter.diameter)
    return replace(engagement_of_arcs([0.0], [end], fz, cutter, ap), frame=np.eye(3)[None])


def at_95(own: LoadParts, load: str, cutter: Cutter, material: Material, nominal: float) -> float:
    return ErrorBudget(0.95, budget_parts(own, load, cutter, material, 0.0, 0.0, 0.0)).value(nominal)


def test_a_load_that_is_one_coefficient_times_the_chip_has_the_quantile_of_that_coefficient() -> None:
    """Mean torque Ktc f depth ae / (2 pi) N: with a spread of 10 % its value at 95 % is that of a lognormal Ktc."""
    mill = Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5, runout_size=0.0)
    alone = metal(0.1, (1000.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    own = load_parts(up(mill, 10.0, 0.01, 2.0), mill, alone)["torque_mean_nm"][0]
    assert own.load == pytest.approx(1000.0 * 0.01 * 2.0 * 10.0 * 2 / math.tau / 1000.0, rel=1e-3)
    assert at_95(own, "torque_mean_nm", mill, alone, own.load) == pytest.approx(
        own.load * math.exp(Z95 * 0.1), rel=1e-6
    )
    # a peak scatters from turn to turn besides, by 1.5 %
    own = load_parts(up(mill, 10.0, 0.1, 2.0), mill, alone)["force_n"][0]
    expected = own.load * math.exp(Z95 * math.hypot(0.1, 0.015))
    assert at_95(own, "force_n", mill, alone, own.load) == pytest.approx(expected, rel=1e-6)


def test_elasticities_are_the_changes_by_each_coefficient() -> None:
    """Loads are linear in the coefficients, so that the elasticities add up to 1; each against a load with 0.1 % more
    of its coefficient, at the rotation of its own peak.
    """
    mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5, runout_size=0.0)
    cut = up(mill, 4.0, 0.08, 3.0)
    base = load_parts(cut, mill, metal())
    for name in ("force_n", "torque_nm", "torque_mean_nm"):
        own = base[name][0]
        assert sum(own.elasticity) == pytest.approx(1.0, abs=1e-12)
        for k in range(6):
            more = tuple(v * (1.001 if i == k else 1.0) for i, v in enumerate(K))
            raised = load_parts(cut, mill, metal(coefficients=more))[name][0]
            assert (raised.load / own.load - 1.0) / 1e-3 == pytest.approx(own.elasticity[k], abs=1e-3)


def test_parts_of_a_budget_by_hand() -> None:
    """100 N, bounds 1 and 4 %, rise 20 % with its scatter, deviations 3 and 4 %: the root of the squares is 0.0764."""
    parts = (
        ErrorPart("resolution", bound=0.01), ErrorPart("bending", bound=0.04),
        ErrorPart("runout", rise=0.2, deviation=0.2 * 0.29), ErrorPart("coefficients", deviation=0.03),
        ErrorPart("thin chips", deviation=0.04),
    )  # fmt: skip
    deviation = math.sqrt(0.058**2 + 0.03**2 + 0.04**2)
    assert ErrorBudget(0.95, parts).value(100.0) == pytest.approx(100.0 * 1.05 * 1.2 * math.exp(Z95 * deviation))
    assert ErrorBudget(0.5, parts).value(100.0) == pytest.approx(105.0)
    assert [p.name for p, _ in ErrorBudget(0.95, parts).in_order()] == [
        "runout", "thin chips", "coefficients", "bending", "resolution"
    ]  # fmt: skip


def tooth_by_tooth(cutter: Cutter, ae: float, fz: float, ap: float, e: float, direction: float) -> float:
    """Greatest force in up milling by a sum over teeth and heights; each tooth meets the deepest of N paths before."""
    R, N = cutter.diameter / 2.0, cutter.flutes
    rate = math.tan(cutter.helix) / R
    z = (np.arange(160) + 0.5) * ap / 160
    theta = np.arange(0.0, math.tau, math.radians(1.0))[:, None]
    end, force = math.acos(1.0 - 2.0 * ae / cutter.diameter), np.zeros((len(theta), 3))
    for j in range(N):
        phi = (theta - j * math.tau / N - z * rate) % math.tau
        excess = [e * np.cos(direction - (j - m) * math.tau / N - z * rate) for m in range(N + 1)]
        h = np.min([m * fz * np.sin(phi) + excess[0] - excess[m] for m in range(1, N + 1)], axis=0)
        cuts = (phi < np.arccos(R * math.cos(end) / (R + excess[0]))) & (h > 0.0)
        t, r, a = (np.where(cuts, K[k] * h + K[k + 3], 0.0) * ap / 160 for k in range(3))
        force += np.stack(
            [(t * np.cos(phi) + r * np.sin(phi)).sum(1), (t * np.sin(phi) - r * np.cos(phi)).sum(1), a.sum(1)], axis=1
        )
    return float(np.linalg.norm(force, axis=1).max())


@pytest.mark.parametrize(
    ("diameter", "teeth", "ap", "ae", "fz"),
    [(10.0, 4, 8.0, 1.0, 0.05), (10.0, 4, 5.0, 5.0, 0.1), (16.0, 2, 3.0, 15.9, 0.1), (6.0, 3, 12.0, 0.3, 0.03)],
)
def test_the_rise_by_an_unknown_runout_is_that_of_a_sum_over_teeth(
    diameter: float, teeth: int, ap: float, ae: float, fz: float
) -> None:
    mill = Cutter(diameter, teeth, math.radians(35.0), 25.0, 40.0, 6e5)
    own = load_parts(up(mill, ae, fz, ap), mill, metal())["force_n"][0]
    e = 0.010 if diameter <= 10.0 else 0.0125
    base = tooth_by_tooth(mill, ae, fz, ap, 0.0, 0.0)
    assert own.load == pytest.approx(base, rel=0.02)
    raised = [tooth_by_tooth(mill, ae, fz, ap, e, k * math.tau / 8 / teeth) for k in range(8)]
    assert own.rise == pytest.approx(np.mean(raised) / base - 1.0, rel=0.08)
    assert own.assumed_runout
    # what is used where a step is not computed again is not less
    assert bounded_parts(mill, metal(), own_chip(mill, ae, fz, ap)).rise > 0.95 * own.rise
    # a stated runout of unknown direction: the worst of its directions; none at all: no rise
    stated = load_parts(up(mill, ae, fz, ap), replace(mill, runout_size=e), metal())["force_n"][0]
    assert stated.rise == pytest.approx(max(raised) / base - 1.0, rel=0.1)
    assert stated.rise_deviation == 0.0
    assert load_parts(up(mill, ae, fz, ap), replace(mill, runout_size=0.0), metal())["force_n"][0].rise == 0.0


def own_chip(mill: Cutter, ae: float, fz: float, ap: float) -> float:
    return float(chips_of_teeth(up(mill, ae, fz, ap), mill).chip_max()[0])


@pytest.mark.parametrize(("spread", "low", "high"), [(0.25, 0.93, 0.985), (0.03, 0.93, 0.995)])
def test_random_coefficients_and_runouts_stay_below_the_value_at_95_percent(
    spread: float, low: float, high: float
) -> None:
    """40 cuts, 10 draws each: lognormal coefficients of correlation 0.5, runout even in 5 to 15 um, turns by 1.5 %."""
    g, kept, known = np.random.default_rng(7), [], metal(spread)
    for _ in range(40):
        D, N = float(g.choice([4.0, 6.0, 8.0, 10.0])), int(g.integers(2, 6))
        mill = Cutter(D, N, math.radians(g.uniform(25.0, 45.0)), 2.0 * D, 3.0 * D, 6e5)
        ap, ae = D * math.exp(g.uniform(math.log(0.1), 0.4)), D * min(math.exp(g.uniform(math.log(0.02), 0.0)), 0.98)
        front = up(mill, ae, D * math.exp(g.uniform(math.log(0.003), math.log(0.012))), ap)
        own = load_parts(front, mill, known)["force_n"][0]
        most = at_95(own, "force_n", mill, known, own.load)
        for _ in range(10):
            z = g.normal(size=8)
            factors = np.exp(spread * math.sqrt(0.5) * (z[0] + z[1:7]))
            true = metal(None, tuple(np.array(K) * factors))
            off = replace(mill, runout=(g.uniform(0.005, 0.015), g.uniform(0.0, math.tau)))
            cut = chips_of_teeth(front, off)
            peak = loads_over_turn(cut, off, true, math.radians(3.0), np.zeros((1, 3)))[0][0, 9]
            kept.append(peak * (1.0 + 0.015 * z[7]) <= most)
    assert low <= np.mean(kept) <= high


def test_edge_forces_of_chips_below_the_measured_range_are_a_part() -> None:
    """Ktc h + Kte with h from 0 to 0.05 mm and a range from 0.1 mm on: all of the edge is below it."""
    mill = Cutter(10.0, 2, 0.0, 20.0, 30.0, 6e5)
    thin = metal(0.0, chip=(0.1, 0.3))
    front = up(mill, 10.0, 0.05, 2.0)
    own = load_parts(front, mill, thin)["torque_mean_nm"][0]
    edge = 20.0 * 2.0 * 0.5 * 5.0 * 2 / 1000.0  # Kte depth, half of the turn, radius, teeth [N m]
    assert own.thin_chips == pytest.approx(0.5 * edge / own.load, rel=5e-3)
    assert load_parts(front, mill, metal(0.0, chip=(0.0, 0.3)))["torque_mean_nm"][0].thin_chips == 0.0


def test_bending_is_a_share_of_the_radial_depth_and_none_in_a_slot() -> None:
    mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    shallow, slot = (load_parts(up(mill, ae, 0.05, 2.0), mill, metal())["force_n"][0] for ae in (0.5, 10.0))
    assert shallow.bending(0.02) == pytest.approx(0.04, rel=1e-3)
    assert slot.bending(0.02) == 0.0


@pytest.mark.parametrize("load", ["force_n", "deflection_um", "torque_nm", "torque_mean_nm", "power_w", "chip_max_mm"])
def test_factors_of_many_steps_are_those_of_one_budget_each(load: str) -> None:
    mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    parts = [LoadParts(100.0, 0.3, 0.1, 0.02, True, False, 2.0), LoadParts(50.0, 0.0, 0.2, 0.0, False)]
    found = factors_of_steps(parts, load, np.array([100.0, 50.0]), 0.9, 0.02, 0.4, np.array([0.01, 0.0]))
    expected = [
        ErrorBudget(0.9, budget_parts(own, load, mill, metal(), 0.02, 0.4, bent)).value(1.0)
        for own, bent in zip(parts, (0.01, 0.0), strict=True)
    ]
    np.testing.assert_allclose(found, expected)


def test_bounds_of_many_steps_are_those_of_one_each() -> None:
    """What thin walls plan with is what their check holds a force at."""
    mills = {1: Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5), 2: Cutter(16.0, 3, 0.5, 20.0, 30.0, 6e5, runout_size=0.002)}
    columns = {"tool": np.array([1, 2, 1]), "chip_max_mm": np.array([0.05, 0.1, 0.0])}
    expected = []
    for tool, chip in zip(columns["tool"].tolist(), columns["chip_max_mm"].tolist(), strict=True):
        own = bounded_parts(mills[tool], metal(), chip)
        expected.append(at_95(own, "force_over_allowable", mills[tool], metal(), 1.0))
    np.testing.assert_allclose(bounded_factors(columns, mills, metal(), 0.95), expected)
    assert bounded_factors(columns, mills, metal(), 0.5).tolist() == [1.0, 1.0, 1.0]
