"""The rules round the controller, each by itself, and all together against a flood of bad readings."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.control.fuzzy import standard
from chipload.control.override import KINDS, STATUS, STOPS, Override, Reading, begin, step, trim
from chipload.errors import InputError

TABLE = standard()
RULES = Override(
    kind="mamdani",
    torque_ref=1000.0,
    overload=2000.0,
    torque_most=10_000.0,
    light=50.0,
    floor=0.1,
    cap=1.0,
    start=0.4,
    air_override=0.5,
    lost_override=0.2,
    lost_s=1.0,
)
DT = 0.01


def follow(config, torques, state=None, **more):
    """Overrides, statuses and the last state for a series of readings (numbers, or functions of the override)."""
    state = begin(config) if state is None else state
    sent, statuses = [], []
    o = float(state[11])
    for torque in torques:
        value = torque(o) if callable(torque) else torque
        o, status, state = step(config, TABLE, state, Reading(value, DT, **{"actual": o, **more}))
        sent.append(o)
        statuses.append(status)
    return np.array(sent), statuses, state


def cut(k):
    """A cut whose torque is k times the override, with a ripple so that the sensor is seen to live."""
    ripple = np.random.default_rng(0)
    return lambda o: k * o + ripple.normal(0.0, 1e-3)


@pytest.mark.parametrize("kind", ["pi", "mamdani", "product-sum"])
@pytest.mark.parametrize("k", [1300.0, 2500.0, 4000.0])
def test_holds_the_torque(kind, k):
    sent, statuses, _ = follow(replace(RULES, kind=kind), [cut(k)] * 1500)
    assert sent[-1] == pytest.approx(1000.0 / k, abs=0.02)
    assert statuses[-1] == "run"


def test_fixed_does_not_move():
    sent, _, _ = follow(replace(RULES, kind="fixed"), [cut(3000.0)] * 100)
    assert set(sent) == {0.4}


def test_never_above_the_programmed_feed_unless_allowed():
    sent, _, _ = follow(RULES, [cut(300.0)] * 1000)
    assert sent.max() == sent[-1] == 1.0
    with pytest.raises(InputError) as err:
        replace(RULES, cap=1.2)
    assert (
        str(err.value) == "override.cap = 1.2: must be at least 0.1 and at most 1 (above_programmed = true allows more)"
    )
    sent, _, _ = follow(replace(RULES, cap=1.2, above_programmed=True), [cut(300.0)] * 1000)
    assert sent[-1] == pytest.approx(1.2, abs=1e-12)


def test_backs_off_several_times_faster_than_it_recovers():
    """The same relative error each way, from the middle: seconds for 0.1 of override."""
    _, _, state = follow(RULES, [cut(2000.0)] * 1000)
    down, _, _ = follow(replace(RULES, overload=9e3), [cut(4000.0)] * 600, state)
    up, _, _ = follow(RULES, [cut(1000.0)] * 600, state)
    first_down = int(np.flatnonzero(down < 0.4)[0])
    first_up = int(np.flatnonzero(up > 0.6)[0])
    assert first_up >= 3 * first_down
    with pytest.raises(InputError, match="it must fall faster than it rises"):
        replace(RULES, slew_down=2.0)
    with pytest.raises(InputError, match="it must fall faster than it rises"):
        replace(RULES, gain_down=2.0)


def test_slew():
    config = replace(RULES, quantum=0.0, gain_up=100.0, gain_down=300.0)
    up, _, state = follow(config, [cut(500.0)] * 300)
    assert np.diff(up).max() == pytest.approx(config.slew_up * DT, rel=1e-9)
    down, _, _ = follow(config, [cut(1900.0)] * 300, state)
    assert np.diff(down).min() == pytest.approx(-config.slew_down * DT, rel=1e-9)


def test_steps_of_the_override_are_whole_and_rounded_down():
    config = replace(RULES, quantum=0.05)
    sent, _, _ = follow(config, [cut(1700.0)] * 800)
    np.testing.assert_allclose(sent / 0.05, np.round(sent / 0.05), atol=1e-9)
    assert sent[-1] * 1700.0 <= 1000.0 + 1.0
    free, _, _ = follow(replace(config, quantum=0.0, kind="fixed", start=0.449), [cut(1700.0)])
    coarse, _, _ = follow(replace(config, kind="fixed", start=0.449), [cut(1700.0)])
    assert (free[0], coarse[0]) == (0.449, pytest.approx(0.40))


def test_floor():
    sent, statuses, _ = follow(RULES, [cut(15_000.0)] * 20 + [1500.0 + k / 1e3 for k in range(500)])
    assert statuses[2] == "overload"
    assert sent[-1] == 0.0
    sent, statuses, _ = follow(RULES, [1500.0 + k / 1e3 for k in range(500)])
    assert sent.min() == sent[-1] == pytest.approx(0.1)
    assert set(statuses[5:]) == {"run"}


def test_an_unknown_load_does_not_speed_up():
    """Light, or not trusted by the estimator: it may fall, it does not rise."""
    _, _, state = follow(RULES, [cut(1500.0)] * 800)
    untrusted, statuses, _ = follow(RULES, [cut(500.0)] * 300, state, trusted=False)
    assert untrusted.max() <= float(state[11])
    assert set(statuses) == {"unknown"}
    falling, _, _ = follow(RULES, [cut(2600.0)] * 300, state, trusted=False)
    assert falling[-1] < 0.5


def test_air_without_a_model():
    """In the air at most air_override; the time in the air does not wind anything up."""
    _, _, state = follow(RULES, [cut(1100.0)] * 1500)
    assert state[11] > 0.85
    peaks = []
    for steps in (100, 2000):
        air, statuses, after = follow(RULES, [float(k % 2) for k in range(steps)], state)
        assert statuses[-1] == "air"
        assert np.diff(air).max() <= 0.0
        assert air[-1] == pytest.approx(0.5, abs=0.011)
        again, _, _ = follow(RULES, [cut(3000.0)] * 300, after)
        peaks.append((again[0], again.max(), int(np.flatnonzero(again < 0.35)[0])))
    assert peaks[0] == peaks[1]


def test_anti_windup_at_the_cap():
    """Half a minute at the cap and half a second there: the same way down."""
    ways = []
    for steps in (600, 3600):
        sent, _, state = follow(RULES, [cut(400.0)] * steps)
        assert sent[-1] == 1.0
        way, _, _ = follow(RULES, [cut(1600.0)] * 200, state)
        ways.append(way)
    np.testing.assert_allclose(ways[0], ways[1], atol=0.011)


def test_anti_windup_while_the_axes_lag_behind():
    slow, _, state = follow(RULES, [300.0 + k / 1e3 for k in range(500)], actual=0.2)
    assert slow.max() <= 0.4
    assert trim(state) == pytest.approx(0.4)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, -200.0, 11_000.0])
def test_a_reading_that_is_none(bad):
    """Down to lost_override at the slew, never up, stopped after lost_s, and stopped for good."""
    _, _, state = follow(RULES, [cut(1100.0)] * 1500)
    sent, statuses, after = follow(RULES, [bad] * 99, state)
    assert set(statuses) == {"lost"}
    assert np.diff(sent).max() <= 0.0
    assert sent[-1] == pytest.approx(0.2)
    assert int(np.flatnonzero(sent < 0.201)[0]) <= math.ceil(0.75 / (RULES.slew_down * DT))
    sent, statuses, after = follow(RULES, [bad] * 10 + [cut(500.0)] * 50, after)
    assert statuses[-1] == "no-reading"
    assert sent[-1] == 0.0
    straight, statuses, _ = follow(replace(RULES, lost_override=0.0), [bad], state)
    assert (straight[0], statuses[0]) == (0.0, "no-reading")


def test_a_short_loss_is_recovered_from_slowly():
    _, _, state = follow(RULES, [cut(1100.0)] * 1500)
    _, _, lost = follow(RULES, [math.nan] * 50, state)
    back, statuses, _ = follow(RULES, [cut(1100.0)] * 300, lost)
    assert statuses[:4] == ["settling"] * 4
    assert back[3] <= 0.2 + 1e-12
    assert np.diff(back).max() <= RULES.slew_up * DT + RULES.quantum
    assert back[-1] > 0.7


def test_a_stuck_sensor():
    _, _, state = follow(RULES, [cut(1500.0)] * 1000)
    sent, statuses, _ = follow(RULES, [700.0] * 200, state)
    assert statuses[:10] == ["run"] * 10
    assert statuses[10] == "lost"
    assert statuses[-1] == "no-reading"
    assert sent[109] <= 0.2 + 1e-12


def test_a_dead_sensor_while_the_model_says_that_it_cuts():
    """0 N mm where 800 are expected: not air, nothing rises, then lost_override, then a stop."""
    state = begin(RULES, modelled=True)
    sent, statuses, _ = follow(RULES, [0.0] * 300, state, model=0.9, predicted=800.0)
    assert set(statuses[5:49]) == {"unknown"}
    assert set(statuses[49:]) == {"low-reading"}
    assert sent.max() <= 0.4
    assert sent[30] == pytest.approx(RULES.lost_override)
    assert sent[49:].max() == 0.0
    there, statuses, _ = follow(RULES, [0.0] * 300, state, model=0.9, predicted=0.0)
    assert statuses[-1] == "air"
    assert there[-1] == pytest.approx(0.9)


def test_material_where_the_model_says_air():
    """300 N mm where none are expected: a load that nobody knows; nothing rises, and too much of it lowers the trim."""
    state = begin(RULES, modelled=True)
    sent, statuses, _ = follow(RULES, [300.0 + k / 1e3 for k in range(200)], state, model=0.9, predicted=0.0)
    assert set(statuses[5:]) == {"unknown"}
    assert sent.max() <= 0.4
    _, _, after = follow(RULES, [1300.0 + k / 1e3 for k in range(50)], state, model=0.9, predicted=0.0)
    assert trim(after) < 0.95


def test_torque_above_the_one_that_is_held_counts_whatever_the_model_says():
    """1200 where 3000 were planned, but 1000 are allowed: the trim falls."""
    state = begin(RULES, modelled=True)
    state[1] = 0.5
    _, _, after = follow(RULES, [1200.0 + k / 1e3 for k in range(50)], state, model=0.4, predicted=3000.0)
    assert trim(after) < 0.45


def test_overload():
    _, _, state = follow(RULES, [cut(1500.0)] * 500)
    sent, statuses, state = follow(RULES, [2100.0, 2200.0, 500.0, 2100.0, 2200.0, 2300.0, 300.0, 300.0], state)
    assert statuses == ["run"] * 5 + ["overload"] * 3
    assert sent[5:].max() == 0.0
    fresh, statuses, _ = follow(RULES, [cut(1500.0)])
    assert (fresh[0], statuses[0]) == (0.4, "settling")


def test_a_gap_counts_as_a_start():
    _, _, state = follow(RULES, [cut(900.0)] * 1500)
    sent, status, state = step(RULES, TABLE, state, Reading(900.0, 2.0))
    assert status == "settling"
    assert sent <= RULES.start


def test_the_model_trim_finds_the_ratio():
    """True torque 1.3 times the planned one: q settles at 1 / 1.3, also far below the torque that is held."""
    state = begin(RULES, modelled=True)
    rng = np.random.default_rng(0)
    for _ in range(1500):
        _, _, state = step(
            RULES, TABLE, state, Reading(1.3 * 400.0 + rng.normal(0, 0.01), DT, model=0.6, predicted=400.0, actual=0.6)
        )
    assert trim(state) == pytest.approx(1.0 / 1.3, rel=0.01)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("modelled", [False, True])
def test_a_flood_of_bad_readings(kind, modelled):
    """Never above the cap, never faster up than the slew, never up on what is not known; stops hold."""
    rng = np.random.default_rng(7)
    config = replace(RULES, kind=kind, overload_steps=6)
    seen = set()
    for _ in range(30):
        state = begin(config, modelled)
        last, stopped = config.start, False
        for _ in range(200):
            torque = rng.choice(
                [rng.uniform(0, 1500), rng.uniform(0, 5000), 0.0, -500.0, math.nan, math.inf, 700.0],
                p=[0.6, 0.2, 0.06, 0.02, 0.06, 0.02, 0.04],
            )
            trusted, dt = bool(rng.random() < 0.9), float(rng.choice([0.001, 0.01, 0.1, 3.0], p=[0.3, 0.5, 0.19, 0.01]))
            model = float(rng.uniform(0, 3)) if modelled else None
            predicted = float(rng.choice([0.0, rng.uniform(50, 2000)]))
            o, status, state = step(config, TABLE, state, Reading(torque, dt, trusted, last, predicted, model))
            seen.add(status)
            assert 0.0 <= o <= config.cap
            assert o / 0.01 == pytest.approx(round(o / 0.01), abs=1e-9)
            if stopped:
                assert o == 0.0
            stopped = stopped or status in STOPS
            if not stopped:
                assert o >= min(config.floor, config.lost_override) - 1e-12
                assert o <= last + config.slew_up * dt + config.quantum + 1e-12
                unknown = not math.isfinite(torque) or torque < 0.0 or (not modelled and torque < config.light)
                if (unknown or not trusted or status in ("unknown", "lost", "settling")) and kind != "fixed":
                    assert o <= last + 1e-12
            last = o
    assert {"run", "lost", "settling"} <= seen <= set(STATUS)
