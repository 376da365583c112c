"""The resolution of a torque from a spindle's current: its parts against simulated readings, and the refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chipload.control.linuxcnc.simulated_spindle import Load, advance, at_speed, measure
from chipload.control.resolution import check_light, check_limit, torque_resolution
from chipload.control.spindle_model import Spindle
from chipload.errors import InputError

SPINDLE = Spindle(628.0, 5.0, 300.0, (2.0, 0.004), 0.5, 5.0, 60.0, 0.01, 0.02, 0.05, 0.02, 0.03)
PERIOD = 0.01


def readings(spindle, load, count=4000, assumed=None):
    """Estimates while the spindle turns under a load; ``assumed``: what the estimator takes the spindle for."""
    noise = np.random.default_rng(1).normal(0.0, spindle.noise, count)
    state, found, loads = at_speed(spindle), [], (Load(load, 0.0), Load(load, 0.0))
    for k in range(count):
        state, _ = advance(spindle, state, loads, loads, PERIOD, PERIOD)
        state = measure(assumed or spindle, state, float(noise[k]), PERIOD)
        found.append(state.filtered)
    return np.array(found[200:])


@pytest.mark.parametrize("smoothing", [0.0, 0.02, 0.1])
def test_noise(smoothing):
    """Two standard deviations of simulated estimates."""
    spindle = replace(SPINDLE, smoothing=smoothing, current_step=0.0)
    assert torque_resolution(spindle, PERIOD).noise == pytest.approx(2.0 * readings(spindle, 500.0).std(), rel=0.06)


def test_quantisation():
    """The greatest error of an estimate without noise, over many loads: half a step."""
    spindle = replace(SPINDLE, noise=0.0, smoothing=0.0, current_step=0.4)
    wrong = [readings(spindle, load, 260)[-1] - load for load in np.linspace(100.0, 340.0, 41)]
    assert 57.0 < np.abs(wrong).max() <= 60.0 == pytest.approx(torque_resolution(spindle, PERIOD).quantisation)


def test_idle_map():
    """The estimate of a spindle whose idle current is 3 % above its map is wrong by that torque."""
    quiet = replace(SPINDLE, noise=0.0, current_step=0.0)
    drifted = replace(quiet, idle=(1.03 * 2.0, 1.03 * 0.004))
    wrong = readings(drifted, 500.0, 600, assumed=quiet)[-1] - 500.0
    assert torque_resolution(SPINDLE, PERIOD).idle == pytest.approx(wrong, rel=1e-3)


def test_a_spindle_that_cannot_tell_a_cut_from_air():
    """1.5 N m/A, 0.2 A of noise, 14.28 A to run free, 5 % of which are not known."""
    large = replace(SPINDLE, torque_constant=1500.0, noise=0.2, idle=(8.0, 0.01), current_step=0.005, idle_error=0.05)
    with pytest.raises(InputError) as refused:
        check_light(large, PERIOD, 50.0)
    assert str(refused.value) == (
        "override.light = 0.05 N m: below the resolution of the spindle, 1.42 N m (noise 0.35, quantisation 0.0037, "
        "idle map 1.1): air cannot be distinguished from a cut: state a spindle with a smaller idle_error_share (an "
        "air run before each job) or a smaller spindle, or light at least 1.42 N m"
    )
    check_light(SPINDLE, PERIOD, 61.2)


def test_a_limit_that_cannot_be_held():
    """R = 60.9 N mm; with 93 % held and 5 % granted it is 12 % of 508 N mm."""
    assert torque_resolution(SPINDLE, PERIOD).total == pytest.approx(
        2.0 * 300.0 * 0.05 / 3.0**0.5 + 3.0 + 300.0 * 0.03 * 4.512, rel=1e-12
    )
    check_limit(SPINDLE, PERIOD, 520.0, 0.93, 0.05)
    with pytest.raises(InputError) as refused:
        check_limit(SPINDLE, PERIOD, 400.0, 0.93, 0.05)
    assert str(refused.value) == (
        "spindle: it resolves 0.0609 N m (noise 0.017, quantisation 0.003, idle map 0.041), the limit is 0.4 N m: must "
        "be at most 0.048 N m, the share of the limit that is neither held nor allowed in excess: state a spindle with "
        "a smaller idle_error_share (an air run before each job) or a smaller spindle, or hold at most 0.9; this "
        "spindle holds limits from 0.508 N m"
    )
    check_limit(SPINDLE, PERIOD, 400.0, 0.89, 0.05)


def test_a_period_that_is_none():
    with pytest.raises(InputError, match="period = 0 s: must be above 0"):
        torque_resolution(SPINDLE, 0.0)
