"""Estimate of the cutting torque from successive readings of current and speed, compiled.

Notation: I current; w speed of this and the previous reading; tau time constant of the current sensor; w' the speed
with the same lag, linear between two readings; T the estimate, filtered with the time constant t:

    raw = K_T (I - i_0 - i_1 w') - J (w - w') / tau,    T += min(dt / t, 1) (raw - T).

If tau = 0, dw/dt is the difference of two readings over dt. Oracle: :func:`chipload.control.spindle.estimate` on a log.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# places of the state: speed that was read last, the same behind the lag of the sensor, torque
LAST_SPEED, LAGGED_SPEED, TORQUE = range(3)
STATE = 3


class Belief(NamedTuple):
    """What the estimator takes the spindle for: K_T [N mm/A], i_0 [A], i_1 [A s], J [N mm s^2], tau and t [s]."""

    torque_constant: float
    idle_constant: float
    idle_slope: float
    inertia: float
    sensor_lag: float
    smoothing: float


@njit(cache=True, nogil=True)
def begin(state, speed):
    """The state in the air at a speed [rad/s]."""
    state[LAST_SPEED] = state[LAGGED_SPEED] = speed
    state[TORQUE] = 0.0


@njit(cache=True, nogil=True)
def read(belief, state, current, speed, seconds):
    """The torque [N mm] after a reading, ``seconds`` after the last, above 0; changes the state."""
    lag = belief.sensor_lag
    if lag > 0.0:
        a = seconds / lag
        decay = math.exp(-a)
        ramp = (1.0 - decay) / a
        lagged = decay * state[LAGGED_SPEED] + (ramp - decay) * state[LAST_SPEED] + (1.0 - ramp) * speed
        rate = (speed - lagged) / lag
    else:
        lagged = speed
        rate = (speed - state[LAST_SPEED]) / seconds
    state[LAST_SPEED], state[LAGGED_SPEED] = speed, lagged
    idle = belief.idle_constant + belief.idle_slope * lagged
    raw = belief.torque_constant * (current - idle) - belief.inertia * rate
    share = min(seconds / belief.smoothing, 1.0) if belief.smoothing > 0.0 else 1.0
    state[TORQUE] += (raw - state[TORQUE]) * share
    return state[TORQUE]
