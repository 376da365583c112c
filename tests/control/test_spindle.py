"""The estimator on currents made from known parameters: recovery, coverage of the intervals, lag, light loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter, lsim
from scipy.stats import sem, t

from chipload.control.spindle import Run, _light, estimate, first_order, identify, identify_runs, idle_map
from chipload.errors import InputError

KT, INERTIA, IDLE, LAG = 300.0, 50.0, (2.0, 0.004), 0.05
TIME = np.arange(0.0, 20.0, 0.02)


def cuts():
    """Speed with two run-ups and torque with passes of several depths [rad/s], [N mm]."""
    speed = np.interp(TIME, [0.0, 1.5, 9.0, 10.0, 20.0], [100.0, 500.0, 500.0, 700.0, 700.0])
    torque = np.select(
        [(a < TIME) & (b > TIME) for a, b, _ in PASSES], [level + 0.0 * TIME for _, _, level in PASSES], 0.0
    )
    return speed, torque


PASSES = ((2.0, 3.0, 300.0), (4.0, 5.5, 2500.0), (6.5, 8.0, 5000.0), (11.0, 13.0, 1200.0), (14.0, 17.0, 3600.0))


def currents(rng, spread=0.3, rho=0.0, lag=LAG, dead=0.0):
    """The current by finite differences in fine steps; ``dead``: torque that friction swallows."""
    speed, torque = cuts()
    fine = np.arange(0.0, TIME[-1] + 1e-9, 0.002)
    w, load = np.interp(fine, TIME, speed), np.interp(fine, TIME, torque)
    load = np.where(load > 0.0, np.maximum(load - dead, 0.0), 0.0)
    true = IDLE[0] + IDLE[1] * w + (load + INERTIA * np.gradient(w, fine)) / KT
    if lag:
        true = lsim(([1.0], [lag, 1.0]), true - true[0], fine)[1] + true[0]
    noise = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], rng.normal(0.0, spread, len(TIME) + 100))[100:]
    return speed, torque, true[:: round(0.02 / 0.002)][: len(TIME)] + noise


def test_recovery_without_noise():
    speed, torque, current = currents(np.random.default_rng(0), spread=0.0)
    found = identify(TIME, speed, current, torque, LAG)
    assert found.torque_constant == pytest.approx(KT, rel=2e-3)
    assert found.inertia == pytest.approx(INERTIA, rel=2e-3)
    np.testing.assert_allclose(found.idle, IDLE, rtol=0.011)
    assert found.speeds == (100.0, 700.0)


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_the_intervals_cover(rho):
    """60 logs, intervals of 90 %: the truth lies in 80 to 100 % of them, with noise that follows itself too."""
    inside = np.zeros(4)
    for seed in range(60):
        speed, torque, current = currents(np.random.default_rng(seed), rho=rho)
        found = identify(TIME, speed, current, torque, LAG, level=0.9)
        values = np.array([found.torque_constant, found.inertia, *found.idle])
        inside += np.abs(values - [KT, INERTIA, *IDLE]) <= found.half_width
    assert np.all(inside / 60 >= 0.8), inside


def test_without_its_lag_the_inertia_is_wrong():
    speed, torque, current = currents(np.random.default_rng(1), spread=0.05)
    right, wrong = (identify(TIME, speed, current, torque, lag) for lag in (LAG, 0.0))
    assert wrong.residual > 2.0 * right.residual


def test_first_order_is_that_of_the_differential_equation():
    rng = np.random.default_rng(5)
    t = np.linspace(0.0, 3.0, 301)
    x = np.cumsum(rng.normal(size=301))
    other = lsim(([1.0], [0.2, 1.0]), x - x[0], t)[1] + x[0]
    np.testing.assert_allclose(first_order(x, t, 0.2), other, atol=1e-10)
    np.testing.assert_array_equal(first_order(x, t, 0.0), x)


def test_estimate():
    """Another log of the same spindle: the torque within the noise, the lag and the interval."""
    speed, torque, current = currents(np.random.default_rng(2))
    spindle = identify(TIME, speed, current, torque, LAG)
    speed, torque, current = currents(np.random.default_rng(3))
    found = estimate(spindle, TIME, speed, current, average=11)
    steady = np.zeros(len(TIME), dtype=bool)
    for a, b, level in PASSES:
        rows = (a + 0.5 < TIME) & (b - 0.2 > TIME)
        assert found.torque[rows].mean() == pytest.approx(level, abs=25.0)
        assert found.trusted[rows].all()
        assert estimate(spindle, TIME, speed, current).trusted[rows].all() == (level > 1000.0)
        steady |= rows
    assert np.abs(found.torque - torque)[steady].std() < 3.0 * KT * 0.3 / np.sqrt(11)
    ramp = (TIME > 0.3) & (TIME < 1.2)
    assert np.abs(found.torque[ramp].mean()) < 60.0
    assert not found.trusted[ramp].any()


def test_light_loads_are_not_trusted():
    """Friction that swallows 400 N mm: the pass of 300 is not to be trusted, however long it is averaged."""
    speed, torque, current = currents(np.random.default_rng(4), dead=400.0)
    dead = identify(TIME, speed, current, torque, LAG, share=0.25)
    clean = identify(TIME, *(currents(np.random.default_rng(4))[k] for k in (0, 2, 1)), LAG, share=0.25)
    assert clean.biased == 0.0
    assert dead.biased > 300.0
    weak = (TIME > 2.5) & (TIME < 2.8)
    assert not estimate(dead, TIME, speed, current, average=51).trusted[weak].any()


def test_a_speed_that_was_not_identified():
    speed, torque, current = currents(np.random.default_rng(2))
    spindle = identify(TIME, speed, current, torque, LAG)
    found = estimate(spindle, TIME, np.full_like(speed, 900.0), current)
    assert found.off_speed.all()
    assert not found.trusted.any()


def test_air_alone():
    rng = np.random.default_rng(0)
    speed = rng.uniform(100.0, 600.0, 500)
    spindle = idle_map(speed, 2.0 + 0.004 * speed + rng.normal(0, 0.5, 500), 1.0, 0.0, idle_terms=2)
    np.testing.assert_allclose(spindle.idle, IDLE, atol=3.0 * 0.5 / np.sqrt(500))
    assert spindle.light == pytest.approx(1.0, rel=0.1)
    assert spindle.speeds == (speed.min(), speed.max())


def test_the_interval_of_an_idle_current_is_that_of_a_mean():
    """One speed: the current is a mean, its interval that of Student's t."""
    current = np.random.default_rng(3).normal(2.0, 0.5, 40)
    found = idle_map(np.full(40, 300.0), current, 1.0, 0.0)
    low, high = t.interval(0.95, 39, loc=current.mean(), scale=sem(current))
    assert found.idle[0] == pytest.approx(current.mean())
    assert found.half_width[2] == pytest.approx(0.5 * (high - low))
    assert found.level == 0.95


def test_with_a_torque_constant_that_is_known_the_rest_is_found():
    """Of a current without noise and lag: idle current and inertia as they were made."""
    speed, torque, current = currents(np.random.default_rng(0), spread=0.0, lag=0.0)
    found = identify_runs([Run(TIME, speed, current, torque)], 0.0, torque_constant=KT)
    assert found.torque_constant == KT
    np.testing.assert_allclose(found.idle, IDLE, rtol=0.02)
    assert found.inertia == pytest.approx(INERTIA, rel=0.05)


def test_refused():
    speed, torque, current = currents(np.random.default_rng(0))
    for change, text in (
        ({"torque": 0.0 * torque}, "spindle.torque: at least one cut of known torque is needed"),
        (
            {"speed": 0.0 * speed + 3.0},
            "spindle.speed: the speed must change somewhere (a run-up), or J cannot be found",
        ),
        ({"torque": torque[1:]}, "spindle.torque: must be a column of 1000 numbers like time"),
        (
            {"current": 10.0 - current},
            "spindle.torque: a greater torque takes less current: the columns do not belong together",
        ),
    ):
        given = {"time": TIME, "speed": speed, "current": current, "torque": torque, "sensor_lag": LAG, **change}
        with pytest.raises(InputError) as err:
            identify(**given)
        assert str(err.value) == text
    spindle = identify(TIME, speed, current, torque, LAG)
    with pytest.raises(InputError, match="must be odd"):
        estimate(replace(spindle), TIME, speed, current, average=4)


def test_below_which_torque_the_error_is_too_great_by_hand():
    """Twelve bands of 1 N mm; errors of 1 up to 3 N mm exceed a fifth of the torque; at 3 they are of either sign."""
    torque = np.repeat(np.arange(1.0, 13.0), 6)
    error = np.where(torque <= 3.0, 1.0, 0.0)
    error[torque == 3.0] *= [1.0, -1.0] * 3
    assert _light(torque, error, 0.2) == (3.0, 2.0)
    assert _light(torque, error, 0.6) == (1.0, 1.0)


@pytest.mark.parametrize("terms", [1, 2, 4])
def test_ten_rows_for_each_parameter_are_needed(terms):
    speed, torque = cuts()
    few = slice(0, 10 * (terms + 2) - 1)
    with pytest.raises(InputError, match=rf"{few.stop} rows: must be at least {few.stop + 1} to identify"):
        identify(TIME[few], speed[few], speed[few], torque[few], sensor_lag=LAG, idle_terms=terms)


def test_a_lag_of_a_ramp_at_uneven_times():
    """x = c t through a lag tau, from rest: y = c (t - tau (1 - exp(-t / tau))), exact at every time."""
    time = np.array([0.0, 0.01, 0.03, 0.035, 0.1, 0.11, 0.3, 0.9])
    exact = 7.0 * (time - LAG * (1.0 - np.exp(-time / LAG)))
    np.testing.assert_allclose(first_order(7.0 * time, time, LAG), exact, rtol=1e-12)
