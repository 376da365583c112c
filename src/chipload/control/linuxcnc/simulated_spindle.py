"""A simulated cut and spindle for a running LinuxCNC: the values that its spindle would measure.

Notation as in :mod:`chipload.control.plant`, whose spindle this is, and the same order of sums; there the axes are
simulated too, here place and feed are the machine's own. Between two readings of the machine the two parts of the
torque go straight from one to the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from chipload.control.plant import belief_of
from chipload.control.spindle_model import Spindle
from chipload.errors import InputError
from chipload.lazy import LateModule

_estimator = LateModule("chipload.control._estimator")


@dataclass(frozen=True)
class SpindleState:
    """State of a spindle.

    Parameters
    ----------
    speed : w [rad/s]
    reset : what the integral of the speed controller adds [A]
    sensed : current behind the lag of its sensor [A]
    last_speed, lagged_speed : that the estimator read last, and behind the lag of the sensor [rad/s]
    filtered : measured torque [N mm]
    expected_sensed : torque of the model behind the lag of the sensor [N mm]
    expected : the same behind the filter too, as it would be measured [N mm]
    """

    speed: float
    reset: float
    sensed: float
    last_speed: float
    lagged_speed: float
    filtered: float = 0.0
    expected_sensed: float = 0.0
    expected: float = 0.0


@dataclass(frozen=True)
class Load:
    """Torque at the programmed spindle speed: its edge part and what goes with the feed per tooth [N mm]."""

    edge: float
    cut: float


def at_speed(spindle: Spindle) -> SpindleState:
    """The spindle in the air at its speed."""
    idle = spindle.idle[0] + spindle.idle[1] * spindle.speed
    return SpindleState(spindle.speed, idle, idle, spindle.speed, spindle.speed)


def advance(
    spindle: Spindle,
    state: SpindleState,
    true: tuple[Load, Load],
    model: tuple[Load, Load],
    seconds: float,
    substep: float,
    believed_lag: float | None = None,
) -> tuple[SpindleState, float]:
    """The spindle after some time.

    Parameters
    ----------
    spindle, state : as they really are
    true, model : load at the beginning and at the end; what the cutter meets, what is expected
    seconds : between them, above 0
    substep : longest step of the sum [s]
    believed_lag : lag of the sensor that the expectation is made with [s]; None: that of the spindle

    Returns
    -------
    The state and the greatest torque on the way [N mm].
    """
    if not (0.0 < seconds < math.inf and substep > 0.0):
        raise InputError(f"spindle.advance: seconds = {seconds:g}, substep = {substep:g}: must be above 0")
    n = max(math.ceil(seconds / substep - 1e-9), 1)
    dt = seconds / n
    w, reset, sensed, expected = state.speed, state.reset, state.sensed, state.expected_sensed
    lags = spindle.sensor_lag, spindle.sensor_lag if believed_lag is None else believed_lag
    x, y = (min(dt / lag, 1.0) if lag > 0.0 else 1.0 for lag in lags)
    greatest = 0.0
    for k in range(n):
        b = (k + 0.5) / n
        slower = spindle.speed / w
        torque, believed = (
            (1.0 - b) * p.edge + b * q.edge + ((1.0 - b) * p.cut + b * q.cut) * slower for p, q in (true, model)
        )
        wrong = spindle.speed - w
        drawn = spindle.stiffness * wrong + reset
        if abs(drawn) <= spindle.most_current:
            reset += spindle.reset * wrong * dt
        drawn = min(max(drawn, -spindle.most_current), spindle.most_current)
        idle = spindle.idle[0] + spindle.idle[1] * w
        accelerating = spindle.torque_constant * (drawn - idle) - torque
        w += accelerating / spindle.inertia * dt
        sensed += (drawn - sensed) * x
        expected += (believed - expected) * y
        greatest = max(greatest, torque)
    new = replace(state, speed=w, reset=reset, sensed=sensed, expected_sensed=expected)
    return new, greatest


def read_current(spindle: Spindle, state: SpindleState, noise: float) -> float:
    """The current as the real spindle's sensor gives it, with ``noise`` [A]."""
    current = state.sensed + noise
    return round(current / spindle.current_step) * spindle.current_step if spindle.current_step > 0.0 else current


def estimate_state(believed: Spindle, state: SpindleState, current: float, seconds: float) -> SpindleState:
    """The state after the estimator read ``current`` [A], ``seconds`` after the last reading."""
    values = np.array([state.last_speed, state.lagged_speed, state.filtered])
    _estimator.read(belief_of(believed), values, current, state.speed, seconds)
    share = min(seconds / believed.smoothing, 1.0) if believed.smoothing > 0.0 else 1.0
    expected = state.expected + (state.expected_sensed - state.expected) * share
    last, lagged, filtered = map(float, values)
    return replace(state, last_speed=last, lagged_speed=lagged, filtered=filtered, expected=expected)


def measure(spindle: Spindle, state: SpindleState, noise: float, seconds: float) -> SpindleState:
    """The state after a reading with ``noise`` [A] of a spindle that is what the estimator takes it for."""
    return estimate_state(spindle, state, read_current(spindle, state, noise), seconds)
