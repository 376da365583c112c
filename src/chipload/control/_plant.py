"""The loop of controller, axes and spindle, compiled; see :mod:`chipload.control.plant`.

Oracles: closed forms of its parts in the tests.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipload.control import _estimator
from chipload.control._override import OVERLOAD, OVERRIDE, RUN, TRIM, Observation, allowed_override, step

Floats = NDArray[np.float64]

# how a run ends; the names are in chipload.control.plant
FINISHED, STOPPED, TIMED_OUT, STALLED = range(4)
# what happens to the sensor; the names are in chipload.control.plant
NONE, NOT_A_NUMBER, STUCK, VALUE, SCALED = range(5)


class Columns(NamedTuple):
    """Rows of a path: place s [mm], programmed feed [mm/s], both parts of the true torque [N mm], those of the model
    over the relief [N mm], and the relief.
    """

    at: Floats
    feed: Floats
    edge: Floats
    cut: Floats
    model_edge: Floats
    model_cut: Floats
    relief: Floats


class Axes(NamedTuple):
    """Substep [s], substeps a step of control, delay of an override in steps of control, the latency that the
    controller knows [s], acceleration [mm/s^2], longest time [s], share of its speed at which the spindle stalls.
    """

    dt: float
    every: int
    delay: int
    latency: float
    acceleration: float
    longest: float
    stall: float


class SpindleDrive(NamedTuple):
    """The numbers of the real spindle, as :class:`chipload.control.spindle_model.Spindle` has them; ``idle_drift``
    [A/s] is what its idle current gains.
    """

    speed: float
    inertia: float
    torque_constant: float
    idle_constant: float
    idle_slope: float
    idle_drift: float
    stiffness: float
    reset: float
    most_current: float
    current_step: float
    sensor_lag: float


class SensorFault(NamedTuple):
    """Kind as above, from, to [s], value [N mm] or factor."""

    kind: int
    begin: float
    end: float
    value: float


@njit(cache=True, nogil=True)
def between_rows(at, values, i, s):
    """Value of a column at s, between row i and the next."""
    if i + 1 >= len(at) or s <= at[i]:
        return values[i]
    x = (s - at[i]) / (at[i + 1] - at[i])
    return (1.0 - x) * values[i] + x * values[i + 1]


# places of the state of the spindle: speed, what the integral of its controller adds, current behind the sensor
SPEED, SUMMED, SENSED = range(3)


@njit(cache=True, nogil=True)
def turn(drive, wheel, torque, t, dt):
    """The spindle under a torque [N mm] for ``dt`` [s]: speed loop with a limited current; changes its state."""
    w = wheel[SPEED]
    wrong = drive.speed - w
    drawn = drive.stiffness * wrong + wheel[SUMMED]
    if abs(drawn) <= drive.most_current:
        wheel[SUMMED] += drive.reset * wrong * dt
    drawn = min(max(drawn, -drive.most_current), drive.most_current)
    idle = drive.idle_constant + drive.idle_drift * t + drive.idle_slope * w
    wheel[SPEED] = w + (drive.torque_constant * (drawn - idle) - torque) / drive.inertia * dt
    wheel[SENSED] += (drawn - wheel[SENSED]) * (min(dt / drive.sensor_lag, 1.0) if drive.sensor_lag > 0.0 else 1.0)


@njit(cache=True, nogil=True)
def read_current(drive, wheel, noise):
    """The current as it is read [A]."""
    current = wheel[SENSED] + noise
    return np.rint(current / drive.current_step) * drive.current_step if drive.current_step > 0.0 else current


@njit(cache=True, nogil=True)
def faulty(fault, t, reading, held):
    """A reading as the fault of the sensor leaves it, and the last one without it."""
    if not fault.begin <= t < fault.end:
        return reading, reading
    if fault.kind == NOT_A_NUMBER:
        reading = np.nan
    elif fault.kind == STUCK:
        reading = held
    elif fault.kind == VALUE:
        reading = fault.value
    elif fault.kind == SCALED:
        reading *= fault.value
    return reading, held


@njit(cache=True, nogil=True)
def model_override(columns, rules, state, axes, s, actual, programmed, first):
    """The override that the model allows at s, with the trim of the controller, and the row at or before s."""
    known = axes.latency + axes.every * axes.dt
    soon = max(actual, min(rules.cap, state[OVERRIDE] + rules.slew_up * known))
    return allowed_override(
        s, columns.at, columns.feed, columns.model_edge, columns.model_cut, rules.torque_ref * state[TRIM], known, soon,
        min(rules.slew_down, axes.acceleration / programmed), rules.cap, first,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def put_row(row, t, s, feed, torque, measured, sent, status, speed):
    """One row of the outcome."""
    row[0], row[1], row[2], row[3] = t, s, feed, torque
    row[4], row[5], row[6], row[7] = measured, sent, status, speed


@njit(cache=True, nogil=True)
def run(columns, feed_forward, predicting, rules, sets, state, axes, drive, belief, fault, noise, limit, quick, out):
    """Controller, axes and spindle along a path; see :func:`chipload.control.plant.run`.

    ``feed_forward``: the override follows the model; ``predicting``: readings are held against it; ``noise`` (m,) [A],
    used in turn; ``quick``: a row of ``out`` every so many steps of control. ``out`` (rows, 8): t, s, feed, torque,
    measured, override, status, speed. Returns rows filled, how it ended, time, greatest torque, the same over its
    relief, time in which that is over the limit.
    """
    at, dt, every = columns.at, axes.dt, axes.every
    period, change = every * dt, axes.acceleration * dt
    # until the first override acts the axes stand
    queue = np.zeros(axes.delay + 1)
    idle = drive.idle_constant + drive.idle_slope * drive.speed
    wheel, estimator = np.array([drive.speed, idle, idle]), np.empty(_estimator.STATE)
    _estimator.begin(estimator, drive.speed)
    smooth = min(period / belief.smoothing, 1.0) if belief.smoothing > 0.0 else 1.0
    lag = min(dt / belief.sensor_lag, 1.0) if belief.sensor_lag > 0.0 else 1.0
    t, s, v, i, first, rows, k, status, head = 0.0, at[0], 0.0, 0, 0, 0, 0, RUN, 0
    expected_sensed, expected, sent, command, reading, held, torque, relief = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
    greatest, most_load, over, ended = 0.0, 0.0, 0.0, TIMED_OUT
    while t < axes.longest:
        while i + 2 < len(at) and at[i + 1] <= s:
            i += 1
        programmed = between_rows(at, columns.feed, i, s)
        if k % every == 0:
            number = k // every
            current = read_current(drive, wheel, noise[number % len(noise)])
            estimated = _estimator.read(belief, estimator, current, wheel[SPEED], period)
            expected += (expected_sensed - expected) * smooth
            relief = between_rows(at, columns.relief, i, s)
            reading, held = faulty(fault, t, estimated / relief, held)
            model = -1.0
            if feed_forward:
                model, first = model_override(columns, rules, state, axes, s, v / programmed, programmed, first)
            predicted = expected if predicting else np.nan
            seen = Observation(reading, period, True, v / programmed, predicted, model, False)
            sent, status = step(rules, sets, state, seen)
            queue[head] = sent
            head = (head + 1) % len(queue)
            command = queue[head] if len(queue) > 1 else sent
        goal = command * programmed
        v = min(goal, v + change) if goal > v else max(goal, v - change)
        believed = torque = 0.0
        if v > 0.0:
            ratio = v / programmed * (drive.speed / wheel[SPEED])
            torque = between_rows(at, columns.edge, i, s) + between_rows(at, columns.cut, i, s) * ratio
            believed = between_rows(at, columns.model_edge, i, s) + between_rows(at, columns.model_cut, i, s) * ratio
        turn(drive, wheel, torque, t, dt)
        expected_sensed += (believed - expected_sensed) * lag
        load = torque / between_rows(at, columns.relief, i, s)
        greatest, most_load = max(greatest, torque), max(most_load, load)
        if load > limit:
            over += dt
        if k % (every * quick) == 0 and rows < len(out):
            put_row(out[rows], t, s, v, torque, reading * relief, sent, status, wheel[SPEED])
            rows += 1
        s += v * dt
        t += dt
        k += 1
        if s >= at[len(at) - 1]:
            ended = FINISHED
        elif v == 0.0 and command == 0.0 and status >= OVERLOAD:
            ended = STOPPED
        elif wheel[SPEED] <= axes.stall * drive.speed:
            ended = STALLED
        if ended != TIMED_OUT:
            break
    if rows < len(out):
        put_row(out[rows], t, s, v, torque, reading * relief, sent, status, wheel[SPEED])
        rows += 1
    return rows, ended, t, greatest, most_load, over
