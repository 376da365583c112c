"""The shortest possible time against closed forms and the controllers; the tuning rule of the PI controller."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chipload.control.fuzzy import standard
from chipload.control.ideal import ideal_time, pi_tuning
from chipload.control.plant import Loop, TorqueProfile, comparison, run
from chipload.errors import InputError
from simulated_machine import ACCELERATION, PATH, RULES, SPINDLE


def path(length=100.0, n=20001, feed=20.0, edge=0.0, cut=1000.0):
    s = np.linspace(0.0, length, n)
    return TorqueProfile(s, np.full(n, feed), np.full(n, edge), np.full(n, cut))


def test_one_depth():
    """Half of the limit is the edge: o = (1000 - 500) / 1000; from rest v / 2a longer than length / v."""
    v = 0.5 * 20.0
    assert ideal_time(path(edge=500.0), 1000.0, 1.0, 1.0, 100.0) == pytest.approx(100.0 / v + v / 200.0, rel=1e-4)


def test_a_step_of_depth():
    """20 and 10 mm/s, 50 mm each: the axes begin to brake (v1^2 - v2^2) / 2a before the step."""
    s = np.linspace(0.0, 100.0, 20001)
    two = TorqueProfile(s, np.full(20001, 20.0), np.zeros(20001), np.where(s < 50.0, 1000.0, 2000.0))
    brake = (20.0**2 - 10.0**2) / 200.0
    wanted = (50.0 - brake) / 20.0 + 20.0 / 200.0 + (20.0 - 10.0) / 100.0 + 50.0 / 10.0
    assert ideal_time(two, 1000.0, 1.0, 1.0, 100.0) == pytest.approx(wanted, rel=1e-3)


def test_relief_and_cap():
    """Twice the relief is twice the feed, up to the cap; an edge above the limit cannot be cut at all."""
    once, twice = (ideal_time(path(cut=4000.0), 1000.0, r, 1.0, 1e9) for r in (1.0, 2.0))
    assert once == pytest.approx(2.0 * twice, rel=1e-3)
    assert ideal_time(path(cut=10.0), 1000.0, 1.0, 0.5, 1e9) == pytest.approx(10.0, rel=1e-3)
    assert ideal_time(path(edge=1001.0), 1000.0, 1.0, 1.0, 1e9) == math.inf
    with pytest.raises(InputError, match="acceleration = 0"):
        ideal_time(path(), 1000.0, 1.0, 1.0, 0.0)


def test_nobody_is_faster():
    """Of the controllers that keep the limit none is; the fuzzy one with the model comes near."""
    limit = 2000.0
    shortest = ideal_time(PATH.truth, limit, 1.0, 1.0, ACCELERATION)
    constant = 0.99 * PATH.truth.constant_override(limit)  # the spindle droops
    loop, times = Loop(ACCELERATION), {}
    for name, (rules, modelled) in comparison(constant, replace(RULES, torque_ref=0.93 * limit)).items():
        model = PATH.model if modelled else None
        found = run(PATH.truth, model, rules, standard(), SPINDLE, loop, limit, monitor=PATH.model)
        if found.torque_max <= limit:
            times[name] = found.time
    assert {"constant", "fuzzy_feedforward"} <= set(times)
    assert min(times.values()) > shortest
    assert times["fuzzy_feedforward"] < 1.35 * shortest < times["constant"]


def test_the_rule_of_the_pi_controller():
    """The loop of a plant k / (t s + 1) with a delay d: gain margin and phase margin that the rule is known for."""
    k, t, d = 2.0, 0.03, 0.11
    gain, rate = pi_tuning(k, t, d)
    w = np.geomspace(0.1, 1e3, 200_000)
    open_loop = (gain + rate / (1j * w)) * k / (1.0 + 1j * w * t) * np.exp(-1j * w * d)
    phase = np.unwrap(np.angle(open_loop))
    at_180 = np.interp(math.pi, -phase, np.abs(open_loop))
    assert 1.0 / at_180 == pytest.approx(math.pi, rel=0.02)
    crossing = np.flatnonzero(np.abs(open_loop) < 1.0)[0]
    assert math.degrees(math.pi + phase[crossing]) == pytest.approx(61.4, abs=1.0)
    with pytest.raises(InputError, match="delay = 0: must be above 0"):
        pi_tuning(1.0, 1.0, 0.0)
