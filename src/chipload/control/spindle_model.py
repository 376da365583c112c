"""The model of a spindle, and the deviation of the real spindle from it.

The controller uses the model; the simulated machine has the real spindle. Both are equal if no deviation is stated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from chipload.errors import InputError

#: keys of a deviation and the least value that each may have
_LEAST = {
    "torque_constant_percent": -90.0, "idle_percent": -100.0, "idle_drift_percent_per_min": -1e3,
    "inertia_percent": -90.0, "sensor_lag_ms": -math.inf,
}  # fmt: skip


@dataclass(frozen=True)
class Spindle:
    """A spindle with its drive and current sensor, as its data state it.

    Parameters
    ----------
    speed : w_0 [rad/s]
    inertia : J [N mm s^2] (1 kg m^2 = 1000)
    torque_constant : K_T [N mm/A]
    idle : (i_0 [A], i_1 [A s])
    stiffness, reset : K_P [A s], K_I [A] of the speed controller
    most_current : of the drive [A]
    sensor_lag : time constant [s]
    smoothing : time constant of the filter behind it [s], about a revolution
    noise : standard deviation of a reading of the current [A]
    current_step : quantisation of a reading of the current [A]; 0: none
    idle_error : share by which the idle current may differ from ``idle`` (temperature, lubricant)
    torque_constant_error : share by which the torque constant may differ from ``torque_constant``
    """

    speed: float
    inertia: float
    torque_constant: float
    idle: tuple[float, float]
    stiffness: float
    reset: float
    most_current: float
    sensor_lag: float
    smoothing: float
    noise: float
    current_step: float = 0.0
    idle_error: float = 0.0
    torque_constant_error: float = 0.0

    def __post_init__(self) -> None:
        for name in ("speed", "inertia", "torque_constant", "stiffness", "most_current"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError(f"spindle.{name} = {getattr(self, name):g}: must be above 0")
        for name in (
            "reset",
            "sensor_lag",
            "smoothing",
            "noise",
            "current_step",
            "idle_error",
            "torque_constant_error",
        ):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise InputError(f"spindle.{name} = {getattr(self, name):g}: must be at least 0")


@dataclass(frozen=True)
class SpindleDeviation:
    """Deviation of the real spindle from its data.

    Parameters
    ----------
    torque_constant_percent : more torque for a current; above 0 the torque is greater than is estimated
    idle_percent : more current for the free spindle, all the time
    idle_drift_percent_per_min : the same, growing from the start
    inertia_percent : more inertia
    sensor_lag_ms : a longer lag of the current sensor

    Raises
    ------
    InputError
        A value is no number, or leaves nothing of what it changes.

    Examples
    --------
    >>> data = Spindle(600.0, 5.0, 300.0, (2.0, 0.004), 0.5, 5.0, 60.0, 0.01, 0.02, 0.05)
    >>> SpindleDeviation(torque_constant_percent=10.0).applied(data).torque_constant
    330.0
    """

    torque_constant_percent: float = 0.0
    idle_percent: float = 0.0
    idle_drift_percent_per_min: float = 0.0
    inertia_percent: float = 0.0
    sensor_lag_ms: float = 0.0

    def __post_init__(self) -> None:
        for name, least in _LEAST.items():
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= least and value <= 1e3):
                raise InputError(f"spindle.deviation.{name} = {value:g}: must be from {least:g} to 1000")

    def applied(self, data: Spindle) -> Spindle:
        """Return the real spindle at the start."""
        more = 1.0 + 1e-2 * self.idle_percent
        return replace(
            data,
            torque_constant=data.torque_constant * (1.0 + 1e-2 * self.torque_constant_percent),
            idle=(data.idle[0] * more, data.idle[1] * more),
            inertia=data.inertia * (1.0 + 1e-2 * self.inertia_percent),
            sensor_lag=max(data.sensor_lag + 1e-3 * self.sensor_lag_ms, 0.0),
        )

    def drift(self, data: Spindle) -> float:
        """Return the increase of the idle current per second [A/s] at the speed of ``data``."""
        return 1e-2 * self.idle_drift_percent_per_min / 60.0 * (data.idle[0] + data.idle[1] * data.speed)


#: none
AS_STATED = SpindleDeviation()
