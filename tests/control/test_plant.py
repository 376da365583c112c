"""The loop with its plant: closed forms of its parts, the toy path, surprises, faults, restarts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.control.fuzzy import standard
from chipload.control.override import Override
from chipload.control.plant import (
    Fault,
    Loop,
    Surprise,
    TorqueProfile,
    comparison,
    run,
    with_surprises,
)
from chipload.control.spindle_model import Spindle
from chipload.errors import InputError

TABLE = standard()
LIMIT = 2000.0
#: a spindle with 20 A s of stiffness, idle 2 to 4.5 A, its current sensor slower than its speed loop
SPINDLE = Spindle(
    speed=628.0,
    inertia=5.0,
    torque_constant=300.0,
    idle=(2.0, 0.004),
    stiffness=0.5,
    reset=5.0,
    most_current=60.0,
    sensor_lag=0.01,
    smoothing=0.02,
    noise=0.05,
)
LOOP = Loop(acceleration=500.0)
RULES = Override(
    kind="mamdani",
    torque_ref=0.93 * LIMIT,
    overload=2.0 * LIMIT,
    torque_most=18e3,
    light=80.0,
    floor=0.05,
    cap=1.0,
    start=0.3,
    air_override=0.4,
    lost_override=0.2,
    lost_s=1.0,
)


def profile(levels, feed=20.0, spacing=0.25, edge=0.15):
    """Steps of depth: (length, torque at the programmed feed)."""
    ends = np.cumsum([length for length, _ in levels])
    s = np.arange(0.0, ends[-1] + 0.5 * spacing, spacing)
    depth = np.array([levels[min(int(np.searchsorted(ends, x, "right")), len(levels) - 1)][1] for x in s])
    return TorqueProfile(s, np.full(len(s), feed), edge * depth, (1.0 - edge) * depth)


#: light and heavy steps, air at both ends: 33 s at the constant feed that respects the limit
TOY = profile([(5.0, 0.0), (80.0, 1900.0), (30.0, 3900.0), (60.0, 1400.0), (60.0, 3000.0), (40.0, 2100.0), (5.0, 0.0)])


def fixed(o):
    return replace(RULES, kind="fixed", start=o, floor=min(o, 0.05), quantum=0.0)


def go(controller, truth=TOY, model=None, **more):
    loop = replace(LOOP, **{k: v for k, v in more.items() if k in ("latency", "period", "acceleration", "seed")})
    return run(truth, model, controller, TABLE, SPINDLE, loop, LIMIT, more.get("fault"))


def test_time_and_torque_at_a_constant_override():
    """Time (length - v^2 / 2a) / v + v / a; torque edge + cut o, less what the spindle slows down by."""
    found = go(fixed(0.4))
    v = 0.4 * 20.0
    assert found.finished
    assert found.time == pytest.approx(280.0 / v + 0.5 * v / 500.0, abs=0.004)
    assert found.torque_max == pytest.approx(3900.0 * (0.15 + 0.85 * 0.4), rel=0.01)
    assert found.time_over == 0.0
    flat = profile([(200.0, 1500.0)])
    steady = go(fixed(0.5), flat)
    assert steady.torque[-1] == pytest.approx(1500.0 * 0.575, rel=1e-3)


def test_the_spindle_balances():
    """Held speed: K_T (I - I_idle) = T; what is measured is the torque, within the noise of its filter."""
    found = go(fixed(0.5), profile([(200.0, 1500.0)]))
    late = found.t > 5.0
    assert found.speed[-1] == pytest.approx(SPINDLE.speed, rel=1e-4)
    assert found.measured[late].mean() == pytest.approx(found.torque[late].mean(), rel=2e-3)
    # a first order filter of gain g lets through sqrt(g / (2 - g)) of white noise
    g = LOOP.period / SPINDLE.smoothing
    spread = SPINDLE.torque_constant * SPINDLE.noise * math.sqrt(g / (2.0 - g))
    assert found.measured[late].std() == pytest.approx(spread, rel=0.1)


def test_the_estimate_follows_through_lag_and_filter():
    """A step of torque is seen as a step through two first order lags, whatever the spindle does meanwhile."""
    quiet = replace(SPINDLE, noise=0.0)
    step = profile([(50.0, 500.0), (100.0, 1500.0)])
    fine = replace(LOOP, period=0.001)
    found = run(step, None, fixed(0.5), TABLE, quiet, fine, LIMIT)
    begun = found.t[np.flatnonzero(found.s >= 49.875)[0]]
    low, high = 500.0 * 0.575, 1500.0 * 0.575
    t = found.t - begun
    a, b = quiet.sensor_lag, quiet.smoothing
    wanted = low + (high - low) * np.where(t < 0, 0.0, 1.0 - (a * np.exp(-t / a) - b * np.exp(-t / b)) / (a - b))
    after = (t > -0.5) & (t < 0.2)
    assert np.abs(found.measured - wanted)[after].max() < 0.08 * (high - low)


def test_a_finer_step_gives_the_same():
    coarse = go(replace(RULES, quantum=0.0), model=TOY)
    fine = run(TOY, TOY, replace(RULES, quantum=0.0), TABLE, SPINDLE, replace(LOOP, substep=0.00025), LIMIT)
    assert fine.time == pytest.approx(coarse.time, rel=0.005)
    assert fine.torque_max == pytest.approx(coarse.torque_max, rel=0.02)


def test_the_toy_path():
    """Feedback alone is much faster and overshoots a step of depth by half; what the model says ahead removes that."""
    constant = TOY.constant_override(LIMIT)
    found = {name: go(c, model=TOY if ff else None) for name, (c, ff) in comparison(constant, RULES).items()}
    assert all(x.finished for x in found.values())
    slow = found["constant"]
    assert slow.torque_max == pytest.approx(LIMIT, rel=0.01)
    for name in ("pi", "fuzzy"):
        assert found[name].time < 0.75 * slow.time
        assert found[name].torque_max > 1.3 * LIMIT
    ahead = found["fuzzy_feedforward"]
    assert ahead.time < 0.75 * slow.time
    assert ahead.torque_max < LIMIT
    assert ahead.time_over == 0.0


@pytest.mark.parametrize("latency", [0.0, 0.1])
def test_surprises(latency):
    """Stock 30 % thicker on one side, a hard spot, a worn cutter, a thinner wall: 20 % faster, at most 5 % over."""
    truth = with_surprises(
        TOY,
        (
            Surprise(100.0, 140.0, 1.3, 1.3, ramp=15.0),
            Surprise(180.0, 190.0, 1.2, ramp=5.0),
            Surprise(200.0, 280.0, 1.1, 1.5, ramp=40.0),
            Surprise(20.0, 60.0, 0.8, 0.8, ramp=10.0),
        ),
    )
    constant = go(fixed(truth.constant_override(LIMIT)), truth)
    ahead = go(RULES, truth, TOY, latency=latency)
    assert ahead.finished
    assert ahead.time < 0.8 * constant.time
    assert ahead.torque_max < 1.05 * LIMIT
    blind = go(RULES, truth, None, latency=latency)
    assert blind.torque_max > 1.5 * LIMIT
    alone = go(replace(RULES, kind="fixed"), truth, TOY, latency=latency)
    assert alone.torque_max > 1.15 * LIMIT


def test_latency_costs():
    """Stock that grows by half over 8 mm, without a model: the peak is the higher, the later the override acts."""
    truth = with_surprises(profile([(150.0, 2600.0)]), (Surprise(90.0, 140.0, 1.5, 1.5, ramp=8.0),))
    peaks = np.array([go(RULES, truth, latency=x).torque_max for x in (0.0, 0.1, 0.3)])
    assert np.diff(peaks).min() > 0.02 * LIMIT


def test_the_model_looks_ahead_as_far_as_it_must():
    """Before a step from T = 0 to 4000 at o = 1 the axes are slow enough when they get there, and no earlier."""
    wall = profile([(100.0, 400.0), (50.0, 4000.0)])
    found = go(replace(RULES, quantum=0.0), wall, wall, latency=0.1)
    there = np.flatnonzero(found.s >= 99.75)[0]
    wanted = (0.93 * 2000.0 / 4000.0 - 0.15) / 0.85
    assert found.feed[there] / 20.0 <= 1.02 * wanted
    begun = found.s[np.flatnonzero((found.s > 60.0) & (found.feed < 19.9))[0]]
    # latency at full feed, then a fall at the slew at an average of the two feeds, with half a second to spare
    longest = 20.0 * (0.1 + (1.0 - wanted) / RULES.slew_down)
    assert 100.0 - begun < longest + 0.5 * 20.0 * 0.2


@pytest.mark.parametrize("kind", ["nan", "stuck", "value"])
def test_sensor_faults_in_the_loop(kind):
    """Lost, stuck, negative for good: the feed falls, the run stops, and the torque never exceeds what it was."""
    fault = Fault(kind, 4.0, 1e9, -500.0)
    found = go(RULES, model=TOY, fault=fault)
    assert not found.finished
    assert found.ended == "no-reading"
    after = found.t > 4.2
    assert np.diff(found.override[after]).max() <= 0.0
    assert found.feed[-1] == 0.0
    assert found.torque_max < LIMIT


def test_a_short_loss_goes_on():
    found = go(RULES, model=TOY, fault=Fault("nan", 4.0, 4.4))
    assert found.finished
    assert found.torque_max < LIMIT
    assert found.time > go(RULES, model=TOY).time


def test_overload_stops():
    truth = with_surprises(TOY, (Surprise(120.0, 125.0, 8.0, 8.0),))
    found = go(RULES, truth, TOY)
    assert (found.finished, found.ended) == (False, "overload")
    assert found.feed[-1] == 0.0
    assert found.s[-1] < 125.0


@pytest.mark.parametrize("modelled", [False, True])
@pytest.mark.parametrize("begin", [86.0, 176.0, 236.0])
def test_restart_in_the_middle(begin, modelled):
    """In the deepest cut too: it starts at the start override and does not exceed the limit that this gives."""
    rest = TOY.s >= begin
    part = TorqueProfile(TOY.s[rest], TOY.feed[rest], TOY.edge[rest], TOY.cut[rest])
    found = go(RULES, part, part if modelled else None)
    assert found.finished
    early = found.t < 1.0
    assert found.torque[early].max() < LIMIT
    assert found.override[0] <= RULES.start


@pytest.mark.parametrize("before", [0.5, 1.5, 3.0, 5.0])
@pytest.mark.parametrize("start", [0.35, 0.9])
def test_restart_just_before_a_step(before, start):
    """From standing still, through 100 ms of latency: the axes must not run into the step that the model knows."""
    wall = profile([(before, 400.0), (50.0, 4000.0)])
    found = go(replace(RULES, start=start), wall, wall, latency=0.1)
    assert found.finished
    assert found.torque_max < LIMIT


def test_slow_axes_before_a_step():
    """While they still speed up, the look-ahead reckons with the override that was sent, not with the feed that is."""
    wall = profile([(2.0, 400.0), (50.0, 4000.0)])
    found = go(replace(RULES, start=0.9), wall, wall, latency=0.1, acceleration=40.0)
    assert found.finished
    assert found.torque_max < LIMIT


def test_the_current_of_the_drive_is_limited():
    """12 A give (12 - idle) K_T = 2246 N mm at speed: a cut of 2600 stalls the spindle, unless the controller stops."""
    weak = replace(SPINDLE, most_current=12.0)
    cut = profile([(40.0, 400.0), (80.0, 2600.0)])
    heedless = replace(fixed(1.0), overload=17e3)
    assert run(cut, None, heedless, TABLE, SPINDLE, LOOP, LIMIT).finished
    assert run(cut, None, heedless, TABLE, weak, LOOP, LIMIT).ended == "stalled"
    careful = run(cut, None, replace(fixed(1.0), overload=2500.0), TABLE, weak, LOOP, LIMIT)
    assert careful.ended == "overload"
    assert careful.speed[-1] > 0.5 * SPINDLE.speed
    assert go(fixed(0.05), cut).finished
    assert run(cut, None, fixed(0.05), TABLE, SPINDLE, replace(LOOP, longest_s=1.0), LIMIT).ended == "time"


def test_a_step_of_the_programmed_feed():
    """The programmed feed doubles where the depth does: the look-ahead reckons with the faster feed."""
    s = np.arange(0.0, 120.01, 0.25)
    deep = s >= 60.0
    path = TorqueProfile(s, np.where(s > 56.0, 40.0, 20.0), np.where(deep, 500.0, 50.0), np.where(deep, 3000.0, 600.0))
    found = go(replace(RULES, kind="product-sum"), path, path, latency=0.1)
    assert found.finished
    assert found.torque_max < LIMIT


def test_worn_cutter_is_an_edge():
    truth = with_surprises(TOY, (Surprise(0.0, 280.0, 1.0, 3.0),))
    np.testing.assert_allclose(truth.torque(0.0), 3.0 * TOY.torque(0.0), rtol=1e-12)
    np.testing.assert_allclose(truth.torque(1.0) - truth.torque(0.0), TOY.cut, rtol=1e-12, atol=1e-9)


def test_same_seed_same_bytes():
    a, b = go(RULES, model=TOY, seed=3), go(RULES, model=TOY, seed=3)
    assert a.torque.tobytes() == b.torque.tobytes()
    assert go(RULES, model=TOY, seed=4).measured.tobytes() != a.measured.tobytes()


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: TorqueProfile([0, 1], [1, 0], [0, 0], [0, 0]), "profile.feed[1] = 0: must be a number, above 0"),
        (lambda: TorqueProfile([0, 0], [1, 1], [0, 0], [0, 0]), "profile.s[1] = 0: must be above 0 before it"),
        (lambda: TorqueProfile([0, 1], [1, 1], [0, -1], [0, 0]), "profile.edge[1] = -1: must be a number, at least 0"),
        (lambda: Surprise(2.0, 1.0, 1.3), "surprise.end = 1 mm: must be above begin = 2"),
        (lambda: replace(LOOP, substep=0.1), "loop.substep = 0.1 s: must be at most the period 0.01"),
        (lambda: replace(SPINDLE, inertia=0.0), "spindle.inertia = 0: must be above 0"),
        (
            lambda: go(RULES, model=profile([(10.0, 1.0)])),
            "plant.model: from s = 0 to 10 mm: must cover the path, 0 to 280",
        ),
    ],
)
def test_refused(make, text):
    with pytest.raises(InputError) as err:
        make()
    assert str(err.value) == text


def test_relief_is_held_as_a_share():
    """What is borne grows from once to twice: the torque follows it, and the same share of it is kept everywhere."""
    path = profile([(60.0, 4000.0)])
    relief = np.interp(path.s, [0.0, 20.0, 40.0, 60.0], [1.0, 1.0, 2.0, 2.0])
    found = run(path, path, RULES, TABLE, SPINDLE, LOOP, LIMIT, relief=relief)
    share = found.torque / np.interp(found.s, path.s, relief)
    settled = (found.s > 10.0) & (found.s < 58.0)
    assert share[settled] == pytest.approx(RULES.torque_ref, rel=0.08)
    assert found.torque[found.s > 50.0].max() > 1.8 * found.torque[found.s < 20.0].max()
    assert found.load_max == pytest.approx(share.max(), rel=0.01)
    assert found.torque_max == pytest.approx(found.torque.max(), rel=0.01)


@pytest.mark.parametrize("relief", [np.zeros(3), np.ones(2), np.array([1.0, np.nan, 1.0])])
def test_a_relief_that_is_none(relief):
    path = TorqueProfile(np.arange(3.0), np.ones(3), np.ones(3), np.ones(3))
    with pytest.raises(InputError, match="relief: must be 3 numbers above 0"):
        run(path, None, RULES, TABLE, SPINDLE, LOOP, LIMIT, relief=relief)
