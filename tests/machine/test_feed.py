from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chipload.errors import InputError
from chipload.machine._acceleration import limit_change
from chipload.machine.feed import (
    _limit_change,
    corner_speed,
    curvature_speed,
    limited_speed,
    move_time,
    row_time_limited,
)
from chipload.machine.machine import machine_named


def brute(s, wanted, a, v0, v1):
    """v_i^2 = min over j of wanted_j^2 + the climb between i and j: the definition, O(n^2)."""
    w = np.asarray(wanted, dtype=float) ** 2
    w[0], w[-1] = min(w[0], v0**2), min(w[-1], v1**2)
    climb = np.concatenate([[0.0], np.cumsum(2.0 * np.broadcast_to(a, len(s) - 1) * np.diff(s))])
    return np.sqrt(np.min(w[None, :] + np.abs(climb[:, None] - climb[None, :]), axis=1))


def test_speeds_have_the_same_bits_with_and_without_compiled_loops():
    rng = np.random.default_rng(3)
    change, w = rng.uniform(0.0, 9.0, 5000), rng.uniform(0.0, 4000.0, 5001)
    interpreted = _limit_change(change, w)
    limit_change(change, w)
    assert interpreted.tobytes() == w.tobytes()


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.integers(2, 40), st.integers(0, 10**6), st.booleans())
def test_fastest_speed_against_its_definition(n, seed, piecewise):
    rng = np.random.default_rng(seed)
    s = np.cumsum(rng.uniform(0, 3, n) * rng.integers(0, 3, n))
    wanted = rng.choice([0.0, 5.0, np.inf, 40.0, 7.0], n)
    a = rng.uniform(10, 500, n - 1) if piecewise else float(rng.uniform(10, 500))
    v0, v1 = rng.choice([0.0, 3.0, 30.0], 2)
    v, t = limited_speed(s, wanted, a, v0, v1)
    np.testing.assert_allclose(v, brute(s, wanted, a, v0, v1), atol=1e-9, rtol=1e-12)
    assert (v <= wanted).all()
    assert (np.abs(np.diff(v**2)) <= 2.0 * a * np.diff(s) + 1e-9).all()
    moving = np.diff(s) > 0
    dt = np.diff(t[np.isfinite(t)])
    assert (dt >= 0).all()
    stuck = moving & (v[:-1] + v[1:] == 0)
    assert np.isfinite(t).all() == (not stuck.any())


@pytest.mark.parametrize(
    ("length", "speed", "a", "time"),
    [
        (10.0, 10.0, 100.0, 1.1),  # trapezoid: L/v + v/a
        (1.0, 100.0, 100.0, 0.2),  # triangle: 2 sqrt(L/a)
        (0.25, 5.0, 100.0, 0.1),  # just reached: v^2/a = L
    ],
)
def test_rest_to_rest(length, speed, a, time):
    assert move_time(length, speed, a, 0.0, 0.0) == pytest.approx(time, rel=1e-14)
    # exact with the samples where the acceleration changes
    ramp = min(speed**2 / (2 * a), length / 2)
    s = np.unique([0.0, ramp, length - ramp, length])
    v, t = limited_speed(s, np.full(len(s), speed), a)
    assert t[-1] == pytest.approx(time, rel=1e-14)
    assert v.max() == pytest.approx(min(speed, math.sqrt(a * length)), rel=1e-14)


def test_sampling_converges_in_second_order():
    """A triangle's peak between two samples is cut off: the error of the time falls with the step squared."""
    error = []
    for n in (10, 20, 40, 80):
        s = np.linspace(0.0, 1.0, n)  # the middle is no sample
        error.append(limited_speed(s, np.full(n, 1e3), 100.0)[1][-1] / 0.2 - 1.0)
    assert error[0] > 0.0
    assert np.polyfit(np.log([9, 19, 39, 79]), np.log(error), 1)[0] == pytest.approx(-2.0, abs=0.05)


def test_a_stop_inside_and_a_drop():
    v, t = limited_speed([0, 1, 2, 3], [9, 9, 0, 9], 8.0, 4.0, 4.0)
    np.testing.assert_allclose(v, [4, 4, 0, 4])  # sqrt(2 * 8 * 1) = 4
    np.testing.assert_allclose(t, [0, 0.25, 0.75, 1.25])


def test_no_way_out_is_said():
    v, t = limited_speed([0, 1, 2], [0, 0, 5], 10.0)
    assert v.tolist() == [0, 0, 0]
    assert np.isinf(t[1:]).all()


def test_between_samples_the_machine_speeds_up_and_slows_down():
    """From rest to rest over 1 mm at 10 mm/s^2: 2 sqrt(L / a); at most 2 mm/s: L / v + v / a; from 1 to 1 mm/s over
    1 mm: the peak is sqrt(a L + 1); a piece that speeds up all along: as without."""
    _, t = limited_speed([0, 1, 2, 4], [0, 0, 0, 5], 10.0, end_speed=9.0, between=[100.0, 2.0, 7.0])
    np.testing.assert_allclose(np.diff(t)[:2], [2.0 * math.sqrt(0.1), 0.5 + 0.2])
    peak = math.sqrt(10.0 * 2.0 + 12.5)
    assert np.diff(t)[2] == pytest.approx((2.0 * peak - 5.0) / 10.0)
    _, t = limited_speed([0, 1], [1, 1], 10.0, 1.0, 1.0, between=9.0)
    assert t[1] == pytest.approx(2.0 * (math.sqrt(11.0) - 1.0) / 10.0)
    same = limited_speed([0, 1, 2], [0, 9, 9], 10.0, end_speed=9.0)[1]
    np.testing.assert_allclose(limited_speed([0, 1, 2], [0, 9, 9], 10.0, end_speed=9.0, between=9.0)[1], same)


def test_trapezoid_between_two_speeds():
    """From 2 to 1 over 10 mm at 1 mm/s^2, at most 3 mm/s: 1 s up over 2.5 mm, 2 s down over 4 mm, 3.5 mm at 3 mm/s."""
    assert move_time(10.0, 3.0, 1.0, 2.0, 1.0) == pytest.approx(1.0 + 2.0 + 3.5 / 3.0)


def test_curve_and_corner():
    np.testing.assert_allclose(curvature_speed([0.1, -0.4, 0.0], 1000.0), [100.0, 50.0, np.inf])
    theta = np.array([0.0, 1e-4, 0.1, math.pi / 2, 3.0, math.pi])
    v = corner_speed(theta, 3000.0, 0.01)
    assert np.isinf(v[:2]).all()
    half = theta[2:5] / 2
    np.testing.assert_allclose(v[2:5] ** 2, 3000.0 * 0.01 * np.cos(half) / (1 - np.cos(half)), rtol=1e-12)
    assert v[5] == 0.0
    assert corner_speed(1.0, 3000.0, 0.0) == 0.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (([0, 1], [1], 1.0), "limited_speed: s (2,) and wanted (1,): must be (n,) and (n,), n >= 1"),
        (([0, -1], [1, 1], 1.0), "limited_speed: s must be finite and never fall"),
        (([0, 1], [1, np.nan], 1.0), "limited_speed: a speed is negative or not a number"),
        (([0, 1], [1, 1], 1.0, 0, 0, 0.0), "limited_speed: between must be above 0 mm/s"),
        (([0, 1], [1, 1], 0.0), "limited_speed: acceleration must be finite and above 0 mm/s^2"),
    ],
)
def test_refused(call, message):
    with pytest.raises(InputError) as err:
        limited_speed(*call)
    assert str(err.value) == message


def test_the_slowest_axis_or_the_time_that_is_asked():
    """A at 30 deg/s: 45, 15 and 0 degrees in 1.5, 0.5 and 0 s; asked for are 1, 2 and 3 s."""
    axes = np.zeros((4, 9))
    axes[1:, 3] = np.radians([45.0, 60.0, 60.0])
    machine = machine_named("xyzac-trunnion")
    assert row_time_limited(machine, axes, [1.0, 2.0, 3.0]) == pytest.approx([1.5, 2.0, 3.0])
    for wrong in ([1.0] * 5, [1.0, -1.0, 1.0], [1.0, math.nan, 1.0]):
        with pytest.raises(InputError, match=r"row_time_limited: time \(\d,\): must be one number or \(n - 1,\), >= 0"):
            row_time_limited(machine, axes, wrong)
