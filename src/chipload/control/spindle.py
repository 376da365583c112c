"""Estimate of the cutting torque from the spindle's current, with its interval and valid range.

Notation: w spindle speed [rad/s], I current [A], T torque of cutting [N mm], J inertia [N mm s^2], K_T [N mm/A],
I_idle(w) = i_0 + i_1 w + ... [A] the current of the free spindle:

    J dw/dt = K_T (I - I_idle(w)) - T,   so   I = I_idle(w) + T / K_T + (J / K_T) dw/dt,

which is linear in i_k, 1 / K_T and J / K_T: they come from cuts of known torque by least squares. A current sensor of
first order lags by tau [s]; speed and torque pass the same lag before they are compared with it. Residuals of a log
follow each other; their first autocorrelation rho widens the intervals by sqrt((1 + rho) / (1 - rho)).

Not valid: torques below ``light`` (by friction, slip and noise the relative error is above the required one), and
speeds outside the identified range. Bandwidth: revolutions, not teeth.

Reference: [Altintas1992] (cutting force from the current of drives).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SpindleMap:
    """An identified spindle.

    Parameters
    ----------
    torque_constant, inertia : K_T [N mm/A], J [N mm s^2]
    idle : (p,) float, coefficients of I_idle in powers of w [A, A s, ...]
    half_width : (p + 2,) float, half of the interval of K_T, J and the coefficients, at ``level``
    level : of confidence, 0 .. 1
    speeds : (least, greatest) w that it was identified at [rad/s]
    light : torque below which a single estimate is not to be trusted [N mm]
    biased : the same after any averaging: below it the mean itself is wrong [N mm]
    residual : standard deviation of a current around the map [A]
    sensor_lag : tau [s]
    """

    torque_constant: float
    inertia: float
    idle: Floats
    half_width: Floats
    level: float
    speeds: tuple[float, float]
    light: float
    biased: float
    residual: float
    sensor_lag: float

    def idle_current(self, speed: ArrayLike) -> Floats:
        """Return I_idle(w) [A] in the shape of ``speed`` [rad/s]."""
        return np.asarray(np.polynomial.polynomial.polyval(np.asarray(speed, dtype=np.float64), self.idle))


def first_order(values: ArrayLike, time: Floats, lag: float) -> Floats:
    """Return the response of a first-order sensor to a series, from rest at its first value.

    Parameters
    ----------
    values : (n,) float, taken to be straight between two times
    time : (n,) float [s], rising
    lag : tau [s]; 0: nothing is done
    """
    x = np.asarray(values, dtype=np.float64)
    if lag == 0.0:
        return x.copy()
    step = np.diff(time)
    if len(x) > 2 and np.ptp(step) <= 1e-9 * step[0]:
        a = float(step[0]) / lag
        decay = math.exp(-a)
        ramp = (1.0 - decay) / a
        after, _ = scipy.signal.lfilter([1.0 - ramp, ramp - decay], [1.0, -decay], x, zi=[x[0] * ramp])
        return np.asarray(after)
    out = np.empty_like(x)
    out[0] = y = x[0]
    for k in range(1, len(x)):
        a = (time[k] - time[k - 1]) / lag
        decay = math.exp(-a)
        ramp = (1.0 - decay) / a
        y = decay * y + (ramp - decay) * x[k - 1] + (1.0 - ramp) * x[k]
        out[k] = y
    return out


def lagged_rate(speed: Floats, time: Floats, lag: float) -> Floats:
    """Return dw/dt behind a first-order sensor, (w - lagged w) / tau; without a lag by central differences."""
    if lag == 0.0:
        return np.asarray(np.gradient(speed, time))
    return (speed - first_order(speed, time, lag)) / lag


@dataclass(frozen=True, eq=False)
class Run:
    """One log of a spindle.

    Parameters
    ----------
    time, speed, current : (n,) float [s], [rad/s], [A]
    torque : (n,) float [N mm], 0 in the air; not a number where it is not known
    """

    time: Floats
    speed: Floats
    current: Floats
    torque: Floats

    def __post_init__(self) -> None:
        n = len(self.time)
        for name in ("speed", "current", "torque"):
            column = getattr(self, name)
            if column.shape != (n,) or not (np.isfinite(column) | (name == "torque")).all():
                raise InputError(f"spindle.{name}: must be a column of {n} numbers like time")


def identify(
    time: Floats,
    speed: Floats,
    current: Floats,
    torque: Floats,
    sensor_lag: float,
    idle_terms: int = 2,
    level: float = 0.95,
    share: float = 0.2,
) -> SpindleMap:
    """Identify a spindle from one log of cuts of known torque (0 in the air); as :func:`identify_runs`."""
    if not np.isfinite(torque).all():
        raise InputError(f"spindle.torque: must be a column of {len(time)} numbers like time")
    run = Run(time, speed, current, torque)
    if float(np.ptp(speed)) == 0.0 and float(np.abs(speed).max()) > 0.0:
        raise InputError("spindle.speed: the speed must change somewhere (a run-up), or J cannot be found")
    return identify_runs((run,), sensor_lag, idle_terms, level, share)


def identify_runs(
    runs: Sequence[Run],
    sensor_lag: float,
    idle_terms: int = 2,
    level: float = 0.95,
    share: float = 0.2,
    torque_constant: float | None = None,
    inertia: bool = True,
    settled: float | None = None,
) -> SpindleMap:
    """Identify a spindle from logs of cuts of known torque, air runs (torque 0), or both.

    Parameters
    ----------
    runs : the logs; rows of unknown torque are left out
    sensor_lag : tau [s]
    idle_terms : coefficients of I_idle, 1 .. 4
    level : of the intervals
    share : an estimate counts as trusted where its error is below this share of the torque
    torque_constant : K_T [N mm/A] that is known, and not identified
    inertia : J is identified; False: it is 0, for logs of one speed
    settled : rows are left out while a lag of so long still shows what is not known [s]; None: ``sensor_lag``

    Raises
    ------
    InputError
        The rows are too few, or do not distinguish the parameters (one speed, one torque, no ramp).
    """
    scale_w, scale_t = _scales(runs, idle_terms, torque_constant)
    settled = sensor_lag if settled is None else settled
    parts = [_rows(run, sensor_lag, settled, idle_terms, scale_w, scale_t or 1.0) for run in runs]
    design, current = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    if not len(current):
        raise InputError("spindle: no row is valid: the logs are shorter than the lag of the sensor: log longer")
    scale_r = float(np.abs(design[:, 1]).max()) or 1.0
    design[:, 1] /= scale_r
    known = np.zeros(len(current))
    if torque_constant is not None:
        known = design[:, 0] * (scale_t or 1.0) / torque_constant
    free = [k for k in range(idle_terms + 2) if not (k == 0 and torque_constant is not None) and (k != 1 or inertia)]
    found = _regression(design, current - known, free)
    per_rate = found.values[1] / scale_r
    if torque_constant is None:
        if found.values[0] <= 0.0:
            raise InputError("spindle.torque: a greater torque takes less current: the columns do not belong together")
        constant = float(scale_t / found.values[0])
    else:
        constant = torque_constant
    # delta method: K_T = 1/a, J = b/a
    jacobian = np.zeros_like(found.covariance)
    if torque_constant is None:
        jacobian[0, 0] = -(constant**2) / scale_t
        jacobian[1, 0] = -per_rate * constant**2 / scale_t
    jacobian[1, 1] = constant / scale_r
    jacobian[2:, 2:] = np.diag(scale_w ** -np.arange(idle_terms, dtype=np.float64))
    spread = np.sqrt(np.diag(jacobian @ found.covariance @ jacobian.T))
    light, biased = _light(design[:, 0] * scale_t, constant * found.left, share) if scale_t > 0.0 else (0.0, 0.0)
    return SpindleMap(
        torque_constant=constant,
        inertia=per_rate * constant,
        idle=found.values[2:] / scale_w ** np.arange(idle_terms),
        half_width=float(scipy.special.stdtrit(found.freedom, 0.5 + 0.5 * level)) * spread,
        level=level,
        speeds=(min(float(run.speed.min()) for run in runs), max(float(run.speed.max()) for run in runs)),
        light=light,
        biased=biased,
        residual=math.sqrt(found.variance),
        sensor_lag=sensor_lag,
    )


def _scales(runs: Sequence[Run], idle_terms: int, torque_constant: float | None) -> tuple[float, float]:
    """Return the greatest speed [rad/s] and torque [N mm] of logs; refuse logs that do not identify a spindle."""
    if not 1 <= idle_terms <= 4:
        raise InputError(f"spindle.idle_terms = {idle_terms}: must be from 1 to 4")
    count = sum(len(run.time) for run in runs)
    if count < 10 * (idle_terms + 2):
        raise InputError(f"spindle.time: {count} rows: must be at least {10 * (idle_terms + 2)} to identify")
    speed = max(float(np.abs(run.speed).max()) for run in runs)
    torque = max(float(np.abs(np.nan_to_num(run.torque)).max()) for run in runs)
    if speed == 0.0:
        raise InputError("spindle.speed: the spindle must turn")
    if torque == 0.0 and torque_constant is None:
        raise InputError("spindle.torque: at least one cut of known torque is needed")
    return speed, torque


class _Regression(NamedTuple):
    """Least squares: values (k,), 0 where not free, their covariance (k, k), what is left (n,), its variance."""

    values: Floats
    covariance: Floats
    left: Floats
    freedom: int
    variance: float


def _regression(design: Floats, target: Floats, free: list[int]) -> _Regression:
    """``target`` (n,) by the ``free`` columns of ``design`` (n, k); what is left is correlated from row to row."""
    count = design.shape[1]
    found, _, rank, _ = np.linalg.lstsq(design[:, free], target, rcond=1e-10)
    if rank < len(free):
        raise InputError(
            "spindle: torque, acceleration and idle current cannot be distinguished: cuts at two speeds and two "
            "torques are needed, or fewer idle_terms"
        )
    left = target - design[:, free] @ found
    freedom = len(left) - len(free)
    if freedom < 1:
        raise InputError(f"spindle: {len(left)} rows are valid: must be more than the {len(free)} unknowns: log longer")
    power = float(left @ left)
    variance = power / freedom
    rho = min(max(float(left[1:] @ left[:-1]) / power, 0.0), 0.99) if power > 0.0 else 0.0
    covariance = np.zeros((count, count))
    inner = np.linalg.inv(design[:, free].T @ design[:, free])
    covariance[np.ix_(free, free)] = variance * (1.0 + rho) / (1.0 - rho) * inner
    values = np.zeros(count)
    values[free] = found
    return _Regression(values, covariance, left, freedom, variance)


def _rows(
    run: Run, lag: float, settled: float, idle_terms: int, scale_w: float, scale_t: float
) -> tuple[Floats, Floats]:
    """Return torque, acceleration and powers of the speed behind the lag, and the current, for the valid rows."""
    usable = known_rows(run, settled)
    columns = [first_order(np.nan_to_num(run.torque) / scale_t, run.time, lag), lagged_rate(run.speed, run.time, lag)]
    columns += [first_order((run.speed / scale_w) ** k, run.time, lag) for k in range(idle_terms)]
    return np.stack(columns, axis=1)[usable], run.current[usable]


def known_rows(run: Run, lag: float) -> NDArray[np.bool_]:
    """(n,) bool: the torque is known, and what the sensor still shows of rows before it is too."""
    unknown = np.isnan(run.torque)
    # the state of the sensor before the first row is not known
    last = np.where(unknown, run.time, -np.inf)
    last[0] = max(last[0], run.time[0] if lag > 0.0 else -np.inf)
    since = run.time - np.maximum.accumulate(last)
    return np.asarray(~unknown & (since >= 5.0 * lag))


def idle_map(
    speed: Floats, current: Floats, torque_constant: float, sensor_lag: float, idle_terms: int = 1, light: float = 0.0
) -> SpindleMap:
    """A map from a spindle that runs free: idle current only; K_T is taken as given (1: the torque is in amperes).

    ``light`` is raised to twice the spread of a reading, below which nothing can be distinguished from the air.
    """
    if len(speed) < 10 * idle_terms or len(speed) != len(current):
        raise InputError(f"spindle.speed: {len(speed)} rows in the air: must be at least {10 * idle_terms}")
    scale = float(np.abs(speed).max()) or 1.0
    design = (speed[:, None] / scale) ** np.arange(idle_terms)
    found, _, rank, _ = np.linalg.lstsq(design, current, rcond=1e-10)
    if rank < idle_terms:
        raise InputError("spindle.speed: one speed only: must be idle_terms = 1")
    left = current - design @ found
    freedom = len(speed) - idle_terms
    variance = float(left @ left) / freedom
    spread = np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design))) / scale ** np.arange(idle_terms)
    return SpindleMap(
        torque_constant=torque_constant,
        inertia=0.0,
        idle=found / scale ** np.arange(idle_terms),
        half_width=np.concatenate([np.zeros(2), float(scipy.special.stdtrit(freedom, 0.975)) * spread]),
        level=0.95,
        speeds=(float(speed.min()), float(speed.max())),
        light=max(light, 2.0 * torque_constant * math.sqrt(variance)),
        biased=light,
        residual=math.sqrt(variance),
        sensor_lag=sensor_lag,
    )


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimate of the torque from a log.

    Parameters
    ----------
    torque : (n,) float [N mm], lagging by the sensor's lag
    half_width : (n,) float [N mm], half of the interval of K_T and of the idle map, at the level of the map
    light, off_speed : (n,) bool, why a row is not to be trusted: too little torque, a speed that was not identified
    """

    torque: Floats
    half_width: Floats
    light: NDArray[np.bool_]
    off_speed: NDArray[np.bool_]

    @property
    def trusted(self) -> NDArray[np.bool_]:
        """Mask (n,) of valid rows: neither light nor outside the speed range."""
        return ~(self.light | self.off_speed)


def estimate(spindle: SpindleMap, time: Floats, speed: Floats, current: Floats, average: int = 1) -> Estimate:
    """Estimate the cutting torque from speed and current.

    Parameters
    ----------
    spindle : from :func:`identify` or :func:`idle_map`
    time, speed, current : (n,) float [s], [rad/s], [A]
    average : rows that are averaged (centred), odd; ``light`` falls with its root, down to ``biased``

    Returns
    -------
    See :class:`Estimate`.
    """
    if average < 1 or average % 2 == 0:
        raise InputError(f"spindle.average = {average}: must be odd and at least 1")
    seen = first_order(speed, time, spindle.sensor_lag)
    torque = spindle.torque_constant * (current - spindle.idle_current(seen))
    if spindle.inertia:
        torque -= spindle.inertia * lagged_rate(speed, time, spindle.sensor_lag)
    idle_width = np.abs(seen[:, None] ** np.arange(len(spindle.idle))) @ spindle.half_width[2:]
    width = np.hypot(spindle.half_width[0] / spindle.torque_constant * torque, spindle.torque_constant * idle_width)
    if average > 1:
        kernel = np.ones(average)
        weight = np.convolve(np.ones_like(torque), kernel, "same")
        torque = np.convolve(torque, kernel, "same") / weight
        width = np.convolve(width, kernel, "same") / weight
    slack = 0.02 * max(abs(spindle.speeds[0]), abs(spindle.speeds[1]))
    off = (seen < spindle.speeds[0] - slack) | (seen > spindle.speeds[1] + slack)
    return Estimate(torque, width, torque < max(spindle.light / math.sqrt(average), spindle.biased), off)


def _light(torque: Floats, error: Floats, share: float, bins: int = 12) -> tuple[float, float]:
    """Torques above which the root mean square of the error, and its mean, stay below ``share`` of a band of torque."""
    cutting = torque > 0.0
    edges = np.linspace(0.0, float(torque.max()), bins + 1)
    light, biased = 0.0, 0.0
    for low, high in itertools.pairwise(edges):
        band = cutting & (torque > low) & (torque <= high)
        if band.sum() < 5:
            continue
        believed = share * float(torque[band].mean())
        if math.sqrt(float(np.mean(error[band] ** 2))) > believed:
            light = float(high)
        if abs(float(error[band].mean())) > believed:
            biased = float(high)
    return light, biased
