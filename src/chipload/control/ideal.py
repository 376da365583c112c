"""References for the comparison of controllers: the shortest possible time, and a PI controller with tuned gains.

Notation: F programmed feed, o(s) = min(cap, (T r - edge) / cut) the override at which the true torque is the limit T
times the relief r; v <= o F, and the axes accelerate by a at most: v_i+1^2 <= v_i^2 + 2 a ds, both ways. No controller
can be faster, because this reference knows the true torque before the cut.

PI: of a plant with gain k (torque over T_ref for an override), lag t and delay d the rule SIMC with a closed loop as
slow as the delay takes K = t / (2 k d) and T_I = min(t, 8 d). Reference: [Skogestad2003].
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.control.plant import TorqueProfile
from chipload.errors import InputError

Floats = NDArray[np.float64]


def ideal_time(truth: TorqueProfile, limit: float, relief: ArrayLike, cap: float, acceleration: float) -> float:
    """Return the shortest time [s] of a path with the torque within its limit; inf if no feed is slow enough.

    Parameters
    ----------
    truth : what the cutter meets
    limit : T [N mm]
    relief : (n,) float, or 1
    cap : greatest override
    acceleration : of the axes along the path [mm/s^2]

    Examples
    --------
    90 mm at 10 mm/s, of which the limit allows half: 18 s, and 0.05 s to speed up at 50 mm/s^2.

    >>> n = 9001
    >>> path = TorqueProfile(np.linspace(0.0, 90.0, n), np.full(n, 10.0), np.zeros(n), np.full(n, 4.0))
    >>> round(ideal_time(path, 2.0, 1.0, 1.0, 50.0), 3)
    18.05
    """
    if not (acceleration > 0.0 and cap > 0.0):
        raise InputError(f"ideal_time: acceleration = {acceleration:g}, cap = {cap:g}: must be above 0")
    share = np.broadcast_to(np.asarray(relief, dtype=np.float64), truth.s.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        override = np.where(truth.cut > 0.0, (limit * share - truth.edge) / truth.cut, np.inf)
    override = np.where((truth.cut == 0.0) & (truth.edge > limit * share), 0.0, override)
    speed = np.clip(override, 0.0, cap) * truth.feed
    step = np.diff(truth.s)
    speed[0] = 0.0
    for k in range(1, len(speed)):
        speed[k] = min(speed[k], math.sqrt(speed[k - 1] ** 2 + 2.0 * acceleration * step[k - 1]))
    for k in range(len(speed) - 2, -1, -1):
        speed[k] = min(speed[k], math.sqrt(speed[k + 1] ** 2 + 2.0 * acceleration * step[k]))
    mean = 0.5 * (speed[1:] + speed[:-1])
    return float((step / mean).sum()) if (mean > 0.0).all() else math.inf


def pi_tuning(gain: float, lag: float, delay: float) -> tuple[float, float]:
    """Return K and K / T_I [1/s] of a PI controller by the rule SIMC, see the module.

    Parameters
    ----------
    gain : k, torque over T_ref for an override of 1
    lag, delay : [s], the delay above 0

    Examples
    --------
    >>> pi_tuning(2.0, 0.04, 0.01)
    (1.0, 25.0)
    """
    for name, value in (("gain", gain), ("lag", lag), ("delay", delay)):
        if not 0.0 < value < math.inf:
            raise InputError(f"pi_tuning: {name} = {value:g}: must be above 0")
    proportional = lag / (2.0 * gain * delay)
    return proportional, proportional / min(lag, 8.0 * delay)
