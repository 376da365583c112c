"""The loop of controller, axes and spindle, compiled; see :mod:`chipload.control.plant`.

Oracles: closed forms of its parts in the tests.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipload.control._override import OVERLOAD, OVERRIDE, RUN, TRIM, Observation, allowed, step

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
    """The numbers of a :class:`chipload.control.plant.Spindle`."""

    speed: float
    inertia: float
    torque_constant: float
    idle_constant: float
    idle_slope: float
    stiffness: float
    reset: float
    most_current: float
    current_step: float
    sensor_lag: float
    smoothing: float


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


@njit(cache=True, nogil=True)
def run(columns, feed_forward, predicting, rules, sets, state, axes, spindle, fault, noise, limit, quick, out):
    """Controller, axes and spindle along a path; see :func:`chipload.control.plant.run`.

    ``feed_forward``: the override follows the model; ``predicting``: readings are held against it; ``noise`` (m,) [A],
    used in turn; ``quick``: a row of ``out`` every so many steps of control. ``out`` (rows, 8): t, s, feed, torque,
    measured, override, status, speed. Returns rows filled, how it ended, time, greatest torque, the same over its
    relief, time in which that is over the limit.
    """
    at, feed, edge, cut, relief = columns.at, columns.feed, columns.edge, columns.cut, columns.relief
    model_edge, model_cut = columns.model_edge, columns.model_cut
    dt, acc, every = axes.dt, axes.acceleration, axes.every
    kt, idle0, idle1, most = spindle.torque_constant, spindle.idle_constant, spindle.idle_slope, spindle.most_current
    inertia, lag, smooth = spindle.inertia, spindle.sensor_lag, spindle.smoothing
    # until the first override acts the axes stand
    queue = np.zeros(axes.delay + 1)
    t, s, v, w = 0.0, at[0], 0.0, spindle.speed
    i, first = 0, 0
    summed = idle0 + idle1 * w
    sensed, rate, filtered = summed, 0.0, 0.0
    expected_sensed, expected = 0.0, 0.0
    rows, k, status, head = 0, 0, RUN, 0
    sent, command = 0.0, 0.0
    greatest, most_load, over = 0.0, 0.0, 0.0
    end = at[len(at) - 1]
    ended = TIMED_OUT
    reading, held, torque, relief_here = 0.0, 0.0, 0.0, 1.0
    while t < axes.longest:
        while i + 2 < len(at) and at[i + 1] <= s:
            i += 1
        programmed = between_rows(at, feed, i, s)
        if k % every == 0:
            number = k // every
            current = sensed + noise[number % len(noise)]
            if spindle.current_step > 0.0:
                current = np.rint(current / spindle.current_step) * spindle.current_step
            raw = kt * (current - idle0 - idle1 * w) - rate
            y = min(every * dt / smooth, 1.0) if smooth > 0.0 else 1.0
            filtered += (raw - filtered) * y
            expected += (expected_sensed - expected) * y
            relief_here = between_rows(at, relief, i, s)
            reading = filtered / relief_here
            if fault.begin <= t < fault.end:
                if fault.kind == NOT_A_NUMBER:
                    reading = np.nan
                elif fault.kind == STUCK:
                    reading = held
                elif fault.kind == VALUE:
                    reading = fault.value
                elif fault.kind == SCALED:
                    reading *= fault.value
            else:
                held = reading
            model = -1.0
            if feed_forward:
                known = axes.latency + every * dt
                soon = max(v / programmed, min(rules.cap, state[OVERRIDE] + rules.slew_up * known))
                model, first = allowed(
                    s, at, feed, model_edge, model_cut, rules.torque_ref * state[TRIM], known, soon,
                    min(rules.slew_down, acc / programmed), rules.cap, first,
                )  # fmt: skip
            predicted = expected if predicting else np.nan
            seen = Observation(reading, every * dt, True, v / programmed, predicted, model, False)
            sent, status = step(rules, sets, state, seen)
            queue[head] = sent
            head = (head + 1) % len(queue)
            command = queue[head] if len(queue) > 1 else sent
        goal = command * programmed
        v = min(goal, v + acc * dt) if goal > v else max(goal, v - acc * dt)
        ratio = v / programmed * (spindle.speed / w)
        torque = between_rows(at, edge, i, s) + between_rows(at, cut, i, s) * ratio if v > 0.0 else 0.0
        believed = 0.0
        if v > 0.0:
            believed = between_rows(at, model_edge, i, s) + between_rows(at, model_cut, i, s) * ratio
        # spindle: speed loop with a limited current
        wrong = spindle.speed - w
        drawn = spindle.stiffness * wrong + summed
        if abs(drawn) <= most:
            summed += spindle.reset * wrong * dt
        drawn = min(max(drawn, -most), most)
        turning = (kt * (drawn - idle0 - idle1 * w) - torque) / inertia
        w += turning * dt
        x = min(dt / lag, 1.0) if lag > 0.0 else 1.0
        sensed += (drawn - sensed) * x
        rate += (inertia * turning - rate) * x
        expected_sensed += (believed - expected_sensed) * x
        greatest = max(greatest, torque)
        load = torque / between_rows(at, relief, i, s)
        most_load = max(most_load, load)
        if load > limit:
            over += dt
        if k % (every * quick) == 0 and rows < len(out):
            out[rows, 0], out[rows, 1], out[rows, 2], out[rows, 3] = t, s, v, torque
            out[rows, 4], out[rows, 5], out[rows, 6], out[rows, 7] = reading * relief_here, sent, status, w
            rows += 1
        s += v * dt
        t += dt
        k += 1
        if s >= end:
            ended = FINISHED
            break
        if v == 0.0 and command == 0.0 and status >= OVERLOAD:
            ended = STOPPED
            break
        if w <= axes.stall * spindle.speed:
            ended = STALLED
            break
    if rows < len(out):
        out[rows, 0], out[rows, 1], out[rows, 2], out[rows, 3] = t, s, v, torque
        out[rows, 4], out[rows, 5], out[rows, 6], out[rows, 7] = reading * relief_here, sent, status, w
        rows += 1
    return rows, ended, t, greatest, most_load, over
