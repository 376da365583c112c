"""Alignment of a log of the spindle with the simulated history of the program that ran.

A log has its own clock: it starts before the program, and the machine needs longer or less than was calculated. A time
t of the log is the time (t - lag) / rate of the history. Where the log has the line of the program, the first samples
of the lines are matched instead, and between them time runs evenly; where it has the feed override, a sample of the
log advances the program by its override. The signal follows the load late, as a first-order sensor does, and the lines
may be logged early or late: the time constant and the shift with which prediction and signal correlate best are taken.

Notation: t time [s], w spindle speed [rad/s].
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.control.logs import SpindleLog
from chipload.control.spindle import first_order
from chipload.errors import Finding, InputError, Severity
from chipload.lazy import scipy
from chipload.number_text import number_text

Floats = NDArray[np.float64]

#: least correlation of signal and prediction of a log that is taken to be one of the program
LEAST_CORRELATION = 0.8
#: how much longer than calculated a program may take on the machine, and how much shorter
RATES = (0.8, 1.5)
#: how much longer or shorter than calculated half of the lines of a log may last: a tenth of the feed, or its unit
MOST_LONGER = 8.0
#: greatest feed override of a control
MOST_OVERRIDE = 3.0
#: samples of the search for lag and rate, and rates that are tried
SAMPLES, TRIED = 4096, 71
#: time constants of a sensor that are tried [s], then refined, and the greatest shift that is believed [s], in samples:
#: drives filter their power and current by 0.02 to 0.1 s, and a log on its own clock has its lag found before
SENSOR_LAGS, MOST_SHIFT_S, MOST_SHIFT_SAMPLES = (0.0, 0.03, 0.1, 0.3), 0.3, 2.0
#: greatest time constant of a sensor that is found [s]
MOST_LAG_S = 1.0
#: samples of a log at least
LEAST_SAMPLES = 10
#: share of the samples at each end whose range is the usual one, and how often that a sample may be outside of it
SPIKE_SHARE, SPIKE_RANGES = 0.005, 10.0
#: a step of time over the usual one, and in seconds, that is a gap
GAP_STEPS, GAP_S = 10.0, 1.0


@dataclass(frozen=True, eq=False)
class PredictedTorque:
    """Mean torque of a simulated program, by the parts that the coefficients are proportional to.

    Parameters
    ----------
    time : (n,) float [s], rising, at the end of each step
    speed : (n,) float [rad/s], of the spindle
    cutting, edge : (n,) float [N mm], with the cutting and the edge coefficients of the prior material
    line : (n,) int, of the program
    tool : (n,) int
    """

    time: Floats
    speed: Floats
    cutting: Floats
    edge: Floats
    line: NDArray[np.int64]
    tool: NDArray[np.int64]

    def __post_init__(self) -> None:
        n = len(self.time)
        if n < 2:
            raise InputError("the history has less than two steps: simulate the program that ran")
        for name in ("speed", "cutting", "edge", "line", "tool"):
            column = getattr(self, name)
            if column.shape != (n,) or not np.isfinite(column).all():
                raise InputError(f"history.{name}: must be a column of {n} finite numbers like time")
        if not (np.diff(self.time) >= 0.0).all():
            raise InputError("history.time: must rise")

    @property
    def cut_seconds(self) -> dict[int, float]:
        """Time in the cut of each tool [s]."""
        seconds = np.where(self.cutting + self.edge > 0.0, np.diff(self.time, prepend=0.0), 0.0)
        return {int(tool): float(seconds[self.tool == tool].sum()) for tool in np.unique(self.tool)}


@dataclass(frozen=True, eq=False)
class AlignedLog:
    """The place in the program of each sample of a log.

    Parameters
    ----------
    name : of the log
    time : (m,) float [s], of the log
    signal : (m,) float, what the log measures of the spindle
    row : (m,) int, of the history; -1: the program does not run
    lag, rate : the time of the history is (t - lag) / rate
    correlation : of signal and prediction
    sensor_lag : time constant of the sensor [s], stated or found
    findings : gaps of the clock
    """

    name: str
    time: Floats
    signal: Floats
    row: NDArray[np.int64]
    lag: float
    rate: float
    correlation: float
    sensor_lag: float = 0.0
    findings: tuple[Finding, ...] = ()


def predicted_torque(columns: Mapping[str, NDArray[Any]], name: str) -> PredictedTorque:
    """Return the torque of a simulated program of the columns of its history.

    The cutting work of a step over the angle by which the spindle turns is the torque with the cutting coefficients;
    the rest of the mean torque is that with the edge coefficients. In the air the spindle turns as in the cut before.

    Parameters
    ----------
    columns : of :attr:`chipload.result.track.Track.columns`
    name : of the job or result, for messages

    Raises
    ------
    InputError
        The history has no loads.
    """
    missing = [key for key in ("t_s", "torque_mean_nm", "cutting_work_j", "power_w", "cutting_s") if key not in columns]
    if missing:
        raise InputError(f"{name}: its history has no {', '.join(missing)}: state stock, material and cutters")
    torque, tool = 1e3 * columns["torque_mean_nm"], np.asarray(columns["tool"], dtype=np.int64)
    speed = np.divide(1e3 * columns["power_w"], torque, out=np.full(len(torque), np.nan), where=torque > 0.0)
    for number in np.unique(tool):
        own = tool == number
        cut = np.flatnonzero(own & np.isfinite(speed))
        if len(cut):
            at = np.clip(np.searchsorted(cut, np.flatnonzero(own), side="right") - 1, 0, None)
            speed[own] = speed[cut[at]]
    swept = speed * columns["cutting_s"]
    cutting = np.divide(1e3 * columns["cutting_work_j"], swept, out=np.zeros(len(swept)), where=swept > 0.0)
    return PredictedTorque(
        np.asarray(columns["t_s"]), np.nan_to_num(speed), cutting, np.maximum(torque - cutting, 0.0),
        np.asarray(columns["line"], dtype=np.int64), tool,
    )  # fmt: skip


def align_log(
    name: str, log: SpindleLog, signal: Floats, predicted: PredictedTorque, sensor_lag: float = 0.0
) -> AlignedLog:
    """Return the row of the history at which each sample of a log was taken.

    Parameters
    ----------
    name : of the log, for messages
    log : with ``line`` or ``override`` if it has them
    signal : (m,) float, current, power or torque of its samples
    predicted : of the program
    sensor_lag : time constant of the sensor [s]; 0: it is found

    Raises
    ------
    InputError
        The signal does not follow the program: another program, or no cut; the log has too few samples.
    """
    if len(log.time) < LEAST_SAMPLES:
        raise InputError(f"{name}: {len(log.time)} samples: at least {LEAST_SAMPLES} are needed: log the whole program")
    log, signal, notes = _without_spikes(name, log, signal)
    notes += _gaps(name, log.time)
    log = replace(log, time=_without_jumps(log.time, float(predicted.time[-1])))
    start = np.concatenate([[0.0], predicted.time[:-1]])
    load = predicted.cutting + predicted.edge
    if not (load > 0.0).any():
        raise InputError(f"{name}: the program cuts nothing, so that its log tells nothing of the material")
    clock = log.time - log.time[0]
    if log.override is not None:
        worst = log.override[np.argmax(np.abs(log.override))]
        if not (log.override >= 0.0).all() or worst > MOST_OVERRIDE:
            raise InputError(
                f"{name}: override = {worst:g}: must be from 0 to {MOST_OVERRIDE:g}, a share of the programmed feed; "
                "in percent, name the column override_percent"
            )
        clock = np.concatenate([[0.0], np.cumsum(np.diff(log.time) * log.override[1:])])
    lag, rate = 0.0, 1.0
    place = None if log.line is None else _time_by_line(name, log.line, clock, predicted, start)
    if place is None and log.line is not None:
        text = f"{name}: its lines are not those of the program: it is aligned by its load"
        notes.append(Finding("log-line", 0, text, Severity.NOTE))
    if place is None:
        lag, rate = _lag_and_rate(clock, signal, predicted.time, start, load, sensor_lag)
        place = (clock - lag) / rate
    place, shift, sensor_lag = _shift_and_sensor_lag(place, log.time, signal, predicted.time, load, sensor_lag)
    lag = lag + shift if log.line is None else lag
    row = np.searchsorted(predicted.time, place, side="left")
    running = (place >= 0.0) & (row < len(predicted.time))
    row = np.where(running, row, -1)
    expected = first_order(np.where(running, load[row], 0.0), log.time, sensor_lag)
    correlation = _correlation(signal, expected)
    if not correlation >= LEAST_CORRELATION:
        raise InputError(
            f"{name}: its signal follows the program with a correlation of {correlation:.2f}, at least "
            f"{LEAST_CORRELATION:g} is needed: it is the log of another program, or the spindle does not feel the cut"
            f"{_what_is_odd(log, clock, signal, float(predicted.time[-1]))}"
        )
    return AlignedLog(name, log.time, signal, row, lag, rate, correlation, sensor_lag, tuple(notes))


def _what_is_odd(log: SpindleLog, clock: Floats, signal: Floats, seconds: float) -> str:
    """Return what else a log that does not follow the program of so many seconds has: its clock, its sign."""
    out = "".join(f"; {f.text}" for f in _gaps("its clock", log.time))
    if out:
        return f"{out}{': log the line of the program, or cut the log there' if log.line is None else ''}"
    longer = float(clock[-1]) / seconds
    if not RATES[0] <= longer <= MOST_LONGER:
        unit = f", or the unit of its time (a factor of {1.0 / longer:.2g})" if abs(math.log10(longer)) > 0.9 else ""
        own, whole = number_text(clock[-1]), number_text(seconds)
        part = "a part of the program" if longer < 1.0 else "more than the program"
        out += f"; it lasts {own} s, the program is calculated to last {whole} s: {part}{unit}"
    if float(np.median(signal)) < 0.0:
        out += "; most of its values are negative: check their sign"
    return out


def _without_jumps(time: Floats, seconds: float) -> Floats:
    """Return a clock without steps that are longer than the program of so many seconds: each lasts a usual step."""
    step = np.diff(time)
    usual = np.where(step > seconds, np.median(step), step)
    return np.asarray(time[0] + np.concatenate([[0.0], np.cumsum(usual)]))


def _without_spikes(name: str, log: SpindleLog, signal: Floats) -> tuple[SpindleLog, Floats, list[Finding]]:
    """Return a log without the few samples that are far outside of the range of all others, and a finding of them."""
    low, high = np.quantile(signal, (SPIKE_SHARE, 1.0 - SPIKE_SHARE), method="nearest")
    far = SPIKE_RANGES * (high - low)
    kept = (signal >= low - far) & (signal <= high + far)
    if far <= 0.0 or kept.all():
        return log, signal, []
    worst = int(np.argmax(np.abs(signal - 0.5 * (low + high))))
    text = (
        f"{name}: {int((~kept).sum())} of its samples are left out: the one at {number_text(log.time[worst])} s is "
        f"{number_text((signal[worst] - low) / (high - low), 2)} times the range of all others away"
    )
    columns = {key: value[kept] for key, value in vars(log).items() if value is not None}
    return SpindleLog(**columns), signal[kept], [Finding("log-spike", 0, text, Severity.NOTE)]


def _correlation(a: Floats, b: Floats) -> float:
    """Return the correlation of two series; 0 where one does not vary."""
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def _gaps(name: str, time: Floats) -> list[Finding]:
    step = np.diff(time)
    far = np.flatnonzero(step > max(GAP_STEPS * float(np.median(step)), GAP_S)) if len(step) else np.empty(0, np.int64)
    if not len(far):
        return []
    text = f"{name}: {len(far)} gap{'s' if len(far) > 1 else ''} in time, the first of {number_text(step[far[0]], 3)} s"
    text += f" at {number_text(time[far[0]])} s"
    return [Finding("log-gap", 0, text, Severity.NOTE)]


def _time_by_line(name: str, line: Floats, clock: Floats, predicted: PredictedTorque, start: Floats) -> Floats | None:
    """Return the time of the history of each sample, by the first sample of each line; None: no two lines are shared.

    Lines that run again, as in a loop, count where they run first.

    Raises
    ------
    InputError
        Half of the lines last much longer or shorter than calculated, as if the clock had another unit.
    """
    logged, first = np.unique(np.asarray(line, dtype=np.int64), return_index=True)
    lines, row = np.unique(predicted.line, return_index=True)
    _, a, b = np.intersect1d(logged, lines, assume_unique=True, return_indices=True)
    if len(a) < 2:
        return None
    at, then = clock[first[a]], start[row[b]]
    order = np.argsort(then, kind="stable")
    at, then = at[order], then[order]
    rises = np.concatenate([[True], np.diff(np.maximum.accumulate(at)) > 0.0])
    at, then = at[rises], then[rises]
    if len(at) < 2:
        return None
    lasts = np.diff(then) > 0.0
    longer = float(np.median(np.diff(at)[lasts] / np.diff(then)[lasts])) if lasts.any() else 1.0
    if not 1.0 / MOST_LONGER < longer < MOST_LONGER:
        unit = 10.0 ** round(math.log10(longer))
        raise InputError(
            f"{name}: half of its lines last {number_text(longer)} times as long as calculated, at most "
            f"{MOST_LONGER:g} times are believed: check the unit of its time (a factor of {unit:g})"
        )
    out = np.interp(clock, at, then, left=-1.0)
    # the last line ends when the history does, at the pace of the lines before it
    pace = (then[-1] - then[0]) / max(at[-1] - at[0], np.finfo(np.float64).tiny)
    after = clock > at[-1]
    out[after] = then[-1] + (clock[after] - at[-1]) * pace
    return np.asarray(out)


def _lag_and_rate(
    clock: Floats, signal: Floats, end: Floats, start: Floats, load: Floats, sensor_lag: float
) -> tuple[float, float]:
    """Return the lag [s] and the rate at which prediction and signal correlate best.

    Every rate: all lags at once, by a correlation of the series at SAMPLES equal steps, O(S log S); then both together.
    """
    step = max(float(clock[-1]), float(end[-1]) * RATES[1]) / SAMPLES
    grid = np.arange(0.0, float(clock[-1]) + step, step)
    seen = _means_on_grid(grid, step, clock, signal)
    seen = seen - seen.mean()
    size = float(np.sqrt(seen @ seen))
    if size == 0.0:
        return 0.0, 1.0
    work = np.concatenate([[0.0], np.cumsum(load * (end - start))])
    times = np.concatenate([[0.0], end])
    best = (-np.inf, 0.0, 1.0)
    ones = np.ones(len(seen))
    for rate in np.linspace(*RATES, TRIED):
        own = np.arange(0.0, rate * float(end[-1]) + step, step)
        wanted = np.diff(np.interp(own / rate, times, work)) / step * rate
        if sensor_lag > 0.0:
            wanted = first_order(wanted, own[1:], sensor_lag)
        product = scipy.signal.correlate(seen, wanted, "full", "fft")
        # the prediction is 0 outside of the program, so that its mean over the log is that of what lies within
        total = scipy.signal.correlate(ones, wanted, "full", "fft")
        square = scipy.signal.correlate(ones, wanted * wanted, "full", "fft")
        variance = square - total * total / len(seen)
        enough = square > 0.5 * float(wanted @ wanted)
        value = np.where(enough & (variance > 0.0), product / np.sqrt(np.maximum(variance, 1e-300)), -np.inf) / size
        k = int(np.argmax(value))
        if value[k] > best[0]:
            best = (float(value[k]), (k - (len(wanted) - 1)) * step, float(rate))

    def misfit(x: Floats) -> float:
        place = (clock - x[0]) / x[1]
        row = np.searchsorted(end, place, side="left")
        inside = (place >= 0.0) & (row < len(end))
        expected = np.where(inside, load[np.minimum(row, len(end) - 1)], 0.0)
        return -_correlation(signal, first_order(expected, clock, sensor_lag))

    _, lag, rate = best
    simplex = np.array([[lag, rate], [lag + 3.0 * step, rate], [lag, rate * 1.01]])
    found = scipy.optimize.minimize(
        misfit, simplex[0], method="Nelder-Mead", options={"initial_simplex": simplex, "xatol": 1e-4}
    )
    return float(found.x[0]), float(found.x[1])


def _shift_and_sensor_lag(
    place: Floats, time: Floats, signal: Floats, end: Floats, load: Floats, stated: float
) -> tuple[Floats, float, float]:
    """Return the time of the history of each sample, how much later it is taken [s], and the lag of the sensor [s].

    On equal steps, at which the sensor is a recursive filter: O(m) for each of 100 trials. A gap lasts a few steps.
    """
    step = float(np.median(np.diff(time)))
    clock = np.concatenate([[0.0], np.cumsum(np.minimum(np.diff(time), GAP_STEPS * step))])
    grid = np.arange(0.0, clock[-1] + step, step)
    seen = np.interp(grid, clock, signal)
    most = max(MOST_SHIFT_S, MOST_SHIFT_SAMPLES * step)

    def misfit(x: Floats) -> float:
        lag = stated if stated > 0.0 else abs(float(x[1]))
        at = np.interp(grid - x[0], clock, place)
        row = np.searchsorted(end, at, side="left")
        inside = (at >= 0.0) & (row < len(end))
        expected = np.where(inside, load[np.minimum(row, len(end) - 1)], 0.0)
        believed = abs(x[0]) <= most and lag <= max(MOST_LAG_S, stated)
        return -_correlation(seen, first_order(expected, grid, lag)) if believed else 1.0

    tried = [(shift, lag) for lag in SENSOR_LAGS for shift in np.linspace(-most, most, 13)]
    best = min(tried, key=lambda x: misfit(np.array(x)))
    simplex = np.array(best) + np.array([[0.0, 0.0], [0.5 * most / 13.0, 0.0], [0.0, 0.02]])
    found = scipy.optimize.minimize(
        misfit, simplex[0], method="Nelder-Mead", options={"initial_simplex": simplex, "xatol": 1e-3, "maxfev": 80}
    ).x
    return np.interp(clock - found[0], clock, place), float(found[0]), stated if stated > 0.0 else abs(float(found[1]))


def _means_on_grid(grid: Floats, step: float, clock: Floats, signal: Floats) -> Floats:
    """Return the signal at equal steps: means of the samples of a step, or between samples that are further apart."""
    place = np.clip(np.rint(clock / step).astype(np.int64), 0, len(grid) - 1)
    count = np.bincount(place, minlength=len(grid))
    total = np.bincount(place, signal, minlength=len(grid))
    between = np.interp(grid, clock, signal)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), between))
