"""The estimator that reads one value after the other, against the one that has the whole log."""

from __future__ import annotations

import numpy as np
import pytest

from chipload.control import _estimator
from chipload.control.spindle import SpindleMap, estimate, first_order

KT, INERTIA, IDLE = 300.0, 50.0, (2.0, 0.004)


@pytest.mark.parametrize("lag", [0.0, 0.03])
@pytest.mark.parametrize("smoothing", [0.0, 0.05])
def test_as_on_a_log(lag, smoothing):
    """A run-up, a cut and noise; the filter is a sum of its own here."""
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 4.0, 0.01)
    speed = np.interp(t, [0.0, 1.0, 2.0, 4.0], [100.0, 500.0, 500.0, 620.0])
    current = rng.normal(6.0, 1.0, len(t))
    spindle = SpindleMap(KT, INERTIA, np.array(IDLE), np.zeros(4), 0.95, (100.0, 620.0), 0.0, 0.0, 1.0, lag)
    raw = estimate(spindle, t, speed, current).torque
    if lag == 0.0:
        # one reading after the other knows the difference to the last one only
        centred = np.gradient(speed, t)
        raw += INERTIA * (centred - np.diff(speed, prepend=speed[0]) / 0.01)
    wanted, torque = [], 0.0
    for value in raw:
        torque += (value - torque) * (min(0.01 / smoothing, 1.0) if smoothing else 1.0)
        wanted.append(torque)
    belief = _estimator.Belief(KT, *IDLE, INERTIA, lag, smoothing)
    state = np.empty(_estimator.STATE)
    _estimator.begin(state, speed[0])
    found = [_estimator.read(belief, state, i, w, 0.01) for i, w in zip(current, speed, strict=True)]
    np.testing.assert_allclose(found, wanted, atol=1e-6 * KT)


def test_a_run_up_is_no_torque():
    """200 rad/s^2 take 10,000 N mm of this inertia: what is left of it is the lag."""
    t = np.arange(0.0, 2.0, 0.01)
    speed = 100.0 + 200.0 * t
    current = first_order(IDLE[0] + IDLE[1] * speed + INERTIA * 200.0 / KT, t, 0.03)
    belief = _estimator.Belief(KT, *IDLE, INERTIA, 0.03, 0.0)
    state = np.empty(_estimator.STATE)
    _estimator.begin(state, speed[0])
    found = [_estimator.read(belief, state, i, w, 0.01) for i, w in zip(current, speed, strict=True)]
    assert np.abs(found[50:]).max() < 1e-3 * INERTIA * 200.0
