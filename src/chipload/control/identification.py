"""Identification of a spindle from logs: torque constant, idle map, inertia, lag, noise, drift and valid range.

Notation as in :mod:`chipload.control.spindle`. Of power P the quotient P / w takes the place of the current, so that
K_T is the efficiency, and P_idle = i_0 w + i_1 w^2: friction and what grows with the speed. The lag of the sensor is
the one with the least residual; its interval holds the lags whose likelihood is not less by more than chi^2 of one
degree of freedom, and half a reading on both sides: when between two readings the torque changes is not known. The
noise is that of steady rows (1.48 times the median of the absolute residual). The torque behind lag tau and filter t
has half its power at the frequency f with

    (1 + (2 pi f tau)^2) (1 + (2 pi f t)^2) = 2,    and at most at half the rate of the readings.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.control.logs import SpindleLog
from chipload.control.spindle import Run, SpindleMap, estimate, first_order, identify_runs, known_rows
from chipload.errors import InputError
from chipload.lazy import scipy

Floats = NDArray[np.float64]

#: lags that are tried [s]
LAGS = (0.0, 0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.5)
#: the spindle counts as standing below this share of its greatest speed
STANDING = 0.02
#: the speed counts as one where it spreads by less than this share
ONE_SPEED = 0.005
#: blocks of a single log that are held out in turn
BLOCKS = 4


@dataclass(frozen=True)
class LogPrediction:
    """Prediction of a log from the others, and its error.

    Parameters
    ----------
    name : of the log
    rms, mean : error of the torque where the spindle cuts, behind the lag and the filter [N mm]
    greatest : torque of the log [N mm]
    covered : share of its rows in the cut whose interval, with two standard deviations of the noise, holds the torque
    apart : share of pairs of a row in the cut and one in the air of which the first is estimated greater; 0.5: they are
        not distinguished; not a number: there are not both
    """

    name: str
    rms: float
    mean: float
    greatest: float
    covered: float
    apart: float


@dataclass(frozen=True, eq=False)
class SensorReading:
    """Lag, noise and step of the sensor of a spindle.

    Parameters
    ----------
    lag, lag_interval : of the sensor [s]
    smoothing : a revolution, at least one reading [s]
    noise, step : of a reading [A], of power [N mm]
    period : between two readings [s]
    bandwidth : [Hz]
    """

    lag: float
    lag_interval: tuple[float, float]
    smoothing: float
    noise: float
    step: float
    period: float
    bandwidth: float


@dataclass(frozen=True, eq=False)
class IdleDrift:
    """Drift of the idle current over the logs.

    Parameters
    ----------
    rate, half_width : of its growth [A/s]
    error : share by which it may differ: interval and drift over the logs
    """

    rate: float
    half_width: float
    error: float


@dataclass(frozen=True, eq=False)
class IdentifiedSpindle:
    """A spindle as identified from logs.

    Parameters
    ----------
    source : ``current`` or ``power``
    found : the map; of power in the units of the head of this file
    constant_known : the torque constant was stated, not identified; None: it is not known, and `found` has 1
    inertia_found : the speed changes, so that the inertia and the slope of the idle map are known
    torque : (least, greatest) that the estimate holds for [N mm]; the greatest is inf where no cut limits it
    cut_speed : of the spindle in the cut, its median [rad/s]
    predictions : logs, each predicted from the others
    """

    source: str
    found: SpindleMap
    constant_known: bool | None
    inertia_found: bool
    sensor: SensorReading
    idle: IdleDrift
    torque: tuple[float, float]
    cut_speed: float
    predictions: tuple[LogPrediction, ...]

    @property
    def constant_error(self) -> float:
        """Half of the interval of the torque constant, as a share of it."""
        return float(self.found.half_width[0]) / self.found.torque_constant


def run_of(log: SpindleLog, label: str, source: str, air: bool = False) -> Run:
    """Return the rows of a log in which the spindle turns.

    Parameters
    ----------
    source : ``current`` or ``power``
    air : nothing is cut in the whole log

    Raises
    ------
    InputError
        It has no speed, or states neither the torque of the cut nor where it cuts.
    """
    values = log.current if source == "current" else log.power
    if values is None:
        raise InputError(f"{label}: no column of {source}, which the other logs have")
    if log.speed is None:
        raise InputError(f"{label}: no column of the spindle's speed")
    speed = np.abs(log.speed)
    turning = speed > STANDING * max(float(speed.max()), 1e-12)
    if source == "power":
        values = np.divide(values, speed, out=np.zeros(len(speed)), where=turning)
    if log.torque is not None and not air:
        torque = log.torque
    elif log.cutting is not None and not air:
        torque = np.where(log.cutting, np.nan, 0.0)
    elif air:
        torque = np.zeros(len(speed))
    else:
        raise InputError(
            f"{label}: no column of torque, and no label that states where it cuts: state one, or --air for a log in "
            "which nothing is cut"
        )
    return Run(log.time[turning], speed[turning], values[turning], torque[turning])


def identify_spindle(
    runs: Sequence[Run],
    names: Sequence[str],
    source: str = "current",
    torque_constant: float | None = None,
    sensor_lag: float | None = None,
    level: float = 0.95,
) -> IdentifiedSpindle:
    """Identify a spindle, and predict each log from the others.

    Parameters
    ----------
    runs, names : from :func:`run_of`, and their names
    source : ``current`` or ``power``
    torque_constant : that is known [N mm/A], of power the efficiency; None: it is identified from cuts of known torque
    sensor_lag : that is known [s]; None: it is identified where the speed or the torque changes
    level : of the intervals
    """
    changes = _speed_changes(runs)
    cuts_known = any((np.nan_to_num(run.torque) > 0.0).any() for run in runs)
    constant = torque_constant if torque_constant is not None else None if cuts_known else 1.0
    lag, interval = (sensor_lag, (sensor_lag, sensor_lag)) if sensor_lag is not None else _lag(runs, constant, changes)
    found = _identify_map(runs, lag, constant, changes, level)
    step = _step(np.concatenate([run.current for run in runs]))
    drift, drift_width = _drift(runs, found)
    cutting = [np.isnan(run.torque) | (np.nan_to_num(run.torque) > 0.0) for run in runs]
    speeds = np.concatenate([run.speed[c] for run, c in zip(runs, cutting, strict=True)])
    cut_speed = float(np.median(speeds if len(speeds) else np.concatenate([run.speed for run in runs])))
    period = float(np.median(np.concatenate([np.diff(run.time) for run in runs])))
    smoothing = max(math.tau / cut_speed, period)
    noise = math.sqrt(max(_spread(runs, found) ** 2 - step**2 / 12.0, 0.0))
    idle = abs(float(found.idle_current(cut_speed)))
    width = float(np.abs(cut_speed ** np.arange(len(found.idle))) @ found.half_width[2:])
    longest = max(float(run.time[-1] - run.time[0]) for run in runs)
    gain = min(period / smoothing, 1.0)
    idle_error = (width + abs(drift) * longest) / idle if idle > 0.0 else 0.0
    least = found.torque_constant * (2.0 * noise * math.sqrt(gain / (2.0 - gain)) + 0.5 * step + idle_error * idle)
    greatest = max(float(np.nan_to_num(run.torque).max()) for run in runs)
    return IdentifiedSpindle(
        source=source,
        found=found,
        constant_known=True if torque_constant is not None else False if cuts_known else None,
        inertia_found=changes,
        sensor=SensorReading(
            lag=lag,
            lag_interval=interval,
            smoothing=smoothing,
            noise=noise,
            step=step,
            period=period,
            bandwidth=min(bandwidth(lag, smoothing), 0.5 / period),
        ),
        idle=IdleDrift(drift, drift_width, idle_error),
        torque=(max(least, found.biased), greatest if cuts_known else math.inf),
        cut_speed=cut_speed,
        predictions=_predict_each(runs, names, lag, torque_constant, constant, level, smoothing),
    )


def bandwidth(lag: float, smoothing: float) -> float:
    """Return the frequency [Hz] at which lag and filter [s] leave half of the power; inf without both.

    One lag of 1 / (2 pi) s has half at 1 Hz:

    >>> round(bandwidth(0.0, 1.0 / math.tau), 9)
    1.0
    """
    a, b = lag * lag, smoothing * smoothing
    if a == 0.0 and b == 0.0:
        return math.inf
    square = 2.0 / (a + b + math.sqrt((a + b) ** 2 + 4.0 * a * b))
    return math.sqrt(square) / math.tau


def alias_frequency(frequency: float, rate: float) -> float:
    """Return the frequency [Hz] to which readings at a rate [Hz] fold another frequency.

    >>> alias_frequency(300.0, 100.0), alias_frequency(130.0, 100.0), alias_frequency(30.0, 100.0)
    (0.0, 30.0, 30.0)
    """
    return abs(frequency - rate * round(frequency / rate))


def _speed_changes(runs: Sequence[Run]) -> bool:
    speeds = np.concatenate([run.speed for run in runs])
    low, high = np.quantile(speeds, (0.01, 0.99))
    return bool(high - low > ONE_SPEED * high)


def _identify_map(
    runs: Sequence[Run], lag: float, constant: float | None, changes: bool, level: float, settled: float | None = None
) -> SpindleMap:
    terms = 2 if changes else 1
    return identify_runs(runs, lag, terms, level, torque_constant=constant, inertia=changes, settled=settled)


def _lag(runs: Sequence[Run], constant: float | None, changes: bool) -> tuple[float, tuple[float, float]]:
    """Return the lag with the least residual, and the interval of the lags that fit nearly as well."""
    longest = 0.05 * max(float(run.time[-1] - run.time[0]) for run in runs)
    period = min(float(np.median(np.diff(run.time))) for run in runs)
    tried = [lag for lag in LAGS if lag <= longest and (lag == 0.0 or lag >= 0.1 * period)]

    def misfit(lag: float) -> float:
        # all lags are judged by the rows that the longest leaves
        found = _identify_map(runs, lag, constant, changes, 0.95, tried[-1])
        return math.log(found.residual**2 + 1e-300)

    found = [misfit(lag) for lag in tried]
    k = int(np.argmin(found))
    best, least = tried[k], found[k]
    if len(tried) > 1:
        ends = tried[max(k - 1, 0)], tried[min(k + 1, len(tried) - 1)]
        finer = scipy.optimize.minimize_scalar(misfit, bounds=ends, method="bounded", options={"xatol": 1e-4})
        if finer.fun < least:
            best, least = float(finer.x), float(finer.fun)
    count = sum(int(known_rows(run, tried[-1]).sum()) for run in runs)
    # of chi^2 with one degree of freedom, 95 %
    allowed = least + 2.0 * float(scipy.special.gammaincinv(0.5, 0.95)) / count
    low = _edge(misfit, best, tried[0], allowed)
    return best, (max(low - 0.5 * period, 0.0), _edge(misfit, best, tried[-1], allowed) + 0.5 * period)


def _edge(misfit: Callable[[float], float], inside: float, outside: float, allowed: float) -> float:
    """Return the lag at which the misfit passes the allowed one, between a lag that fits and an end that may not."""
    if misfit(outside) <= allowed:
        return outside
    for _ in range(12):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if misfit(middle) <= allowed else (inside, middle)
    return inside


def _spread(runs: Sequence[Run], found: SpindleMap) -> float:
    """Standard deviation of a reading, without the few rows in which the torque changes."""
    left = []
    for run in runs:
        known = known_rows(run, found.sensor_lag)
        torque = first_order(np.nan_to_num(run.torque), run.time, found.sensor_lag)
        left.append((estimate(found, run.time, run.speed, run.current).torque - torque)[known] / found.torque_constant)
    return 1.4826 * float(np.median(np.abs(np.concatenate(left))))


def _step(values: Floats) -> float:
    """Return the step of the readings between their quartiles; 0 if there is none."""
    low, high = np.quantile(values, (0.25, 0.75))
    some, count = np.unique(values[(values >= low) & (values <= high)], return_counts=True)
    if len(some) < 3 or len(some) > 0.5 * count.sum():
        return 0.0
    gaps = np.diff(some)
    step = float(np.median(gaps[gaps <= 1.5 * gaps.min()]))
    whole = gaps / step
    return step if float(np.abs(whole - np.rint(whole)).max()) < 0.1 else 0.0


def _drift(runs: Sequence[Run], found: SpindleMap) -> tuple[float, float]:
    """Slope of the idle current over the time of each log, about its own mean [A/s], and half of its interval."""
    t, left = [], []
    for run in runs:
        air = known_rows(run, found.sensor_lag) & (np.nan_to_num(run.torque) == 0.0)
        if air.sum() > 2:
            rate = estimate(found, run.time, run.speed, run.current).torque[air] / found.torque_constant
            t.append(run.time[air] - run.time[air].mean())
            left.append(rate - rate.mean())
    if not t:
        return 0.0, 0.0
    x, y = np.concatenate(t), np.concatenate(left)
    total = float(x @ x)
    if total == 0.0:
        return 0.0, 0.0
    slope = float(x @ y) / total
    rest = y - slope * x
    power = float(rest @ rest)
    rho = min(max(float(rest[1:] @ rest[:-1]) / power, 0.0), 0.99) if power > 0.0 else 0.0
    spread = math.sqrt(power / max(len(x) - 2, 1) / total * (1.0 + rho) / (1.0 - rho))
    width = 1.96 * spread
    # a slope that may be 0 is 0: its interval states its range
    return (slope, width) if abs(slope) > width else (0.0, width)


def _predict_each(
    runs: Sequence[Run], names: Sequence[str], lag: float, stated: float | None, constant: float | None, level: float,
    smoothing: float,
) -> tuple[LogPrediction, ...]:  # fmt: skip
    """Predict each log from the others; a single log in blocks."""
    parts = list(zip(names, runs, strict=True)) if len(runs) > 1 else _blocks(names[0], runs[0])
    out = []
    for k, (name, run) in enumerate(parts):
        rest = [other for j, (_, other) in enumerate(parts) if j != k]
        try:
            own = stated if stated is not None else constant
            found = _identify_map(rest, lag, own, _speed_changes(rest), level)
        except InputError:
            continue
        predicted = _predict_log(name, run, found, smoothing)
        if predicted is not None:
            out.append(predicted)
    return tuple(out)


def _blocks(name: str, run: Run) -> list[tuple[str, Run]]:
    ends = np.linspace(0, len(run.time), BLOCKS + 1).astype(int)
    rows = [slice(a, b) for a, b in itertools.pairwise(ends)]
    return [
        (f"{name}, part {k + 1} of {BLOCKS}", Run(run.time[r], run.speed[r], run.current[r], run.torque[r]))
        for k, r in enumerate(rows)
    ]


def _predict_log(name: str, run: Run, found: SpindleMap, smoothing: float) -> LogPrediction | None:
    """Return the torque error of a log by a map that was identified without it."""
    if len(run.time) < 3:
        return None
    period = float(np.median(np.diff(run.time)))
    rows = max(round(smoothing / period), 1)
    average = rows if rows % 2 else rows + 1
    answer = estimate(found, run.time, run.speed, run.current, average=min(average, len(run.time) // 2 * 2 - 1))
    known = known_rows(run, found.sensor_lag)
    torque = first_order(np.nan_to_num(run.torque), run.time, found.sensor_lag)
    if average > 1:
        kernel = np.ones(average)
        torque = np.convolve(torque, kernel, "same") / np.convolve(np.ones(len(torque)), kernel, "same")
    cut, air = known & (torque > 0.0) & ~answer.off_speed, known & (torque <= 0.0) & ~answer.off_speed
    # what the sensor still shows of a cut is neither the one nor the other
    light = 0.05 * float(torque.max())
    free = known & (torque <= 0.01 * light) & ~answer.off_speed
    material = cut & (torque > light) if cut.any() else np.isnan(run.torque) & ~answer.off_speed
    apart = _separation(answer.torque[free], answer.torque[material]) if free.any() and material.any() else math.nan
    compared = cut if cut.any() else air
    if not compared.any():
        return None
    error = (answer.torque - torque)[compared]
    noise = 2.0 * found.torque_constant * found.residual / math.sqrt(average)
    covered = float((np.abs(error) <= answer.half_width[compared] + noise).mean())
    greatest = float(torque.max()) if cut.any() else 0.0
    return LogPrediction(name, float(np.sqrt(np.mean(error**2))), float(error.mean()), greatest, covered, apart)


def _separation(low: Floats, high: Floats) -> float:
    """Return the share of pairs in which the second is greater; ties count half."""
    order = np.sort(low)
    below = np.searchsorted(order, high, "left") + np.searchsorted(order, high, "right")
    return float(below.mean() / (2.0 * len(low)))
