"""A simulated cut and spindle for a machine that really moves: what its spindle would measure.

Notation as in :mod:`chipload.control.plant`, whose spindle this is, and the same order of sums; there the axes are
simulated too, here place and feed are the machine's own. Between two readings of the machine the two parts of the
torque go straight from one to the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from chipload.control.plant import Spindle
from chipload.errors import InputError


@dataclass(frozen=True)
class SpindleState:
    """State of a spindle.

    Parameters
    ----------
    speed : w [rad/s]
    reset : what the integral of the speed controller adds [A]
    sensed : current behind the lag of its sensor [A]
    rate : J dw/dt behind the same lag [N mm]
    filtered : measured torque [N mm]
    expected_sensed : torque of the model behind the lag of the sensor [N mm]
    expected : the same behind the filter too, as it would be measured [N mm]
    """

    speed: float
    reset: float
    sensed: float
    rate: float = 0.0
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
    return SpindleState(speed=spindle.speed, reset=idle, sensed=idle)


def advance(
    spindle: Spindle,
    state: SpindleState,
    true: tuple[Load, Load],
    model: tuple[Load, Load],
    seconds: float,
    substep: float,
) -> tuple[SpindleState, float]:
    """The spindle after some time.

    Parameters
    ----------
    spindle, state : as they are
    true, model : load at the beginning and at the end; what the cutter meets, what is expected
    seconds : between them, above 0
    substep : longest step of the sum [s]

    Returns
    -------
    The state and the greatest torque on the way [N mm].
    """
    if not (0.0 < seconds < math.inf and substep > 0.0):
        raise InputError(f"spindle.advance: seconds = {seconds:g}, substep = {substep:g}: must be above 0")
    n = max(math.ceil(seconds / substep - 1e-9), 1)
    dt = seconds / n
    w, reset, sensed, rate, expected = state.speed, state.reset, state.sensed, state.rate, state.expected_sensed
    lag = spindle.sensor_lag
    x = min(dt / lag, 1.0) if lag > 0.0 else 1.0
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
        rate += (accelerating - rate) * x
        expected += (believed - expected) * x
        greatest = max(greatest, torque)
    new = replace(state, speed=w, reset=reset, sensed=sensed, rate=rate, expected_sensed=expected)
    return new, greatest


def measure(spindle: Spindle, state: SpindleState, noise: float, seconds: float) -> SpindleState:
    """The state after a reading with ``noise`` [A], ``seconds`` after the last: ``filtered``, and ``expected``."""
    idle = spindle.idle[0] + spindle.idle[1] * state.speed
    current = state.sensed + noise
    if spindle.current_step > 0.0:
        current = round(current / spindle.current_step) * spindle.current_step
    raw = spindle.torque_constant * (current - idle) - state.rate
    share = min(seconds / spindle.smoothing, 1.0) if spindle.smoothing > 0.0 else 1.0
    return replace(
        state,
        filtered=state.filtered + (raw - state.filtered) * share,
        expected=state.expected + (state.expected_sensed - state.expected) * share,
    )
