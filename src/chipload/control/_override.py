"""One step of the override and the override that a model allows, compiled.

The parameters are named tuples, the state is an array (STATE,) whose elements are named below.
:mod:`chipload.control.override` makes and defines them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipload.control._fuzzy import mamdani, product_sum

Floats = NDArray[np.float64]

# status of a step, in the order of chipload.control.override.Status; from OVERLOAD on the controller has stopped
RUN, SETTLING, AIR, UNKNOWN, LOST, OVERLOAD, NO_READING, LOW_READING, OFF_PATH, MACHINE_DATA = range(10)
# kind of controller that changes the trim
FIXED, PI, MAMDANI, PRODUCT_SUM = range(4)


class Rules(NamedTuple):
    """The numbers of a :class:`chipload.control.override.Override`, by the same names; ``kind`` as above."""

    kind: int
    torque_ref: float
    overload: float
    torque_most: float
    light: float
    floor: float
    cap: float
    start: float
    air_override: float
    lost_override: float
    lost_s: float
    slew_up: float
    slew_down: float
    gain_up: float
    gain_down: float
    error_span: float
    change_span: float
    pi_gain: float
    pi_rate: float
    overload_steps: float
    stuck_steps: float
    air_steps: float
    settle_steps: float
    low_share: float
    low_steps: float
    off_path_steps: float
    timeout_s: float
    quantum: float
    trim_least: float
    trim_most: float


class Sets(NamedTuple):
    """The arrays of a :class:`chipload.control.fuzzy.FuzzyTable`; ``strength`` (outputs,) is scratch."""

    error: Floats
    change: Floats
    output: Floats
    rules: NDArray[np.int64]
    whole_ends: bool
    strength: Floats


class Observation(NamedTuple):
    """The numbers of a :class:`chipload.control.override.Reading`; ``model`` below 0: there is none."""

    torque: float
    dt: float
    trusted: bool
    actual: float
    predicted: float
    model: float
    off_path: bool


# places of the state: override before rounding, trim q, last error e, last reading, how often it came again, light
# readings, readings above the overload, time without a reading [s], good readings since a start, status that is final,
# override that was wanted, override that was sent, readings in the cut that were too low, steps off the path under load
(
    OVERRIDE, TRIM, LAST_ERROR, LAST_READING, SAME_COUNT, LIGHT_COUNT, OVER_COUNT, LOST_TIME, GOOD_COUNT, FINAL, WANTED,
    SENT, LOW_COUNT, OFF_COUNT,
) = range(14)  # fmt: skip
STATE = 14


@njit(cache=True, nogil=True)
def allowed_override(s, at, feed, edge, cut, torque, latency, soon, slew, cap, first):
    """Override that a torque allows at ``s`` and that can still be left in time for what lies ahead.

    ``at, feed, edge, cut`` (n,): columns of the model; ``soon``: greatest override before this one acts, above 0;
    ``slew`` [1/s] how fast the override falls; ``first``: a row at or before s. Returns the override, not below 0, and
    the row.
    """
    n = len(at)
    while first + 1 < n and at[first + 1] <= s:
        first += 1
    best = cap
    i = first
    until = 0.0
    while i < n:
        if at[i] > s:
            until += (at[i] - max(s, at[i - 1])) / (soon * max(feed[i - 1], feed[i]))
        late = max(until - latency, 0.0) * slew
        if late >= best:
            break
        # the torque between two rows lies between theirs: both ends are used
        if cut[i] > 0.0:
            best = min(best, (torque - edge[i]) / cut[i] + late)
        elif edge[i] > torque:
            best = min(best, late)
        i += 1
    return max(best, 0.0), first


@njit(cache=True, nogil=True)
def step(rules, sets, state, seen):
    """One step of the override; see :func:`chipload.control.override.step`.

    Takes :class:`Rules`, :class:`Sets`, the state, which it changes, and an :class:`Observation`; returns the override
    and the status.
    """
    if state[FINAL] > 0.0:
        return 0.0, int(state[FINAL])
    dt = seen.dt
    if dt > rules.timeout_s:
        state[OVERRIDE] = min(state[OVERRIDE], rules.start)
        state[GOOD_COUNT] = 0.0
        dt = 0.0
    fresh = state[GOOD_COUNT] == 0.0
    final = _no_reading(rules, state, seen, dt)
    if final != RUN:
        if final == NO_READING:
            return _stop(state, NO_READING)
        falling = max(min(state[OVERRIDE], rules.lost_override), state[OVERRIDE] - rules.slew_down * dt)
        state[OVERRIDE] = falling
        return _put_out(state, falling, rules.quantum), LOST
    final = _implausible(rules, state, seen)
    if final != RUN:
        return _stop(state, final)
    e, known, status = _error(rules, state, seen)

    d = 0.0 if fresh else e - state[LAST_ERROR]
    state[LAST_ERROR] = e
    f = 0.0
    if rules.kind == MAMDANI:
        f = mamdani(
            sets.error, sets.change, sets.output, sets.rules, sets.whole_ends, e / rules.error_span,
            d / rules.change_span, sets.strength,
        )  # fmt: skip
    elif rules.kind == PRODUCT_SUM:
        f = product_sum(sets.error, sets.change, sets.output, sets.rules, e / rules.error_span, d / rules.change_span)
    f = min(max(f, -1.0), 1.0)
    may_rise = known and state[GOOD_COUNT] >= rules.settle_steps
    _move_trim(rules, state, seen, may_rise, f, d, e, dt)

    modelled = seen.model >= 0.0
    if rules.kind == FIXED:
        wanted = rules.start if not modelled else seen.model
    elif modelled:
        wanted = seen.model
    else:
        if status == AIR:
            state[TRIM] = min(state[TRIM], rules.air_override)
        wanted = state[TRIM]
    if seen.off_path:
        wanted = min(wanted, rules.start)
    if state[LOW_COUNT] > rules.stuck_steps:
        wanted = min(wanted, rules.lost_override)
    wanted = min(max(wanted, rules.floor), rules.cap)
    state[WANTED] = wanted
    if fresh:
        state[OVERRIDE] = min(state[OVERRIDE], wanted)
    rise = rules.slew_up * dt if may_rise or (rules.kind == FIXED and not seen.off_path) else 0.0
    state[OVERRIDE] = min(max(wanted, state[OVERRIDE] - rules.slew_down * dt), state[OVERRIDE] + rise)
    return _put_out(state, max(state[OVERRIDE], rules.floor), rules.quantum), status


@njit(cache=True, nogil=True)
def _no_reading(rules, state, seen, dt):
    """RUN where the reading is one, else LOST, or NO_READING where that lasts too long."""
    torque = seen.torque
    lost = not (-rules.light <= torque <= rules.torque_most)
    if not lost:
        # a pin that nothing is connected to reads 0; with a prediction that is held against it instead
        may_repeat = torque == 0.0 and not (np.isnan(seen.predicted) and seen.actual > 0.0)
        state[SAME_COUNT] = state[SAME_COUNT] + 1.0 if torque == state[LAST_READING] and not may_repeat else 0.0
        state[LAST_READING] = torque
        lost = state[SAME_COUNT] >= rules.stuck_steps
    if not lost:
        state[LOST_TIME] = 0.0
        state[GOOD_COUNT] += 1.0
        return RUN
    state[GOOD_COUNT] = 0.0
    state[OVER_COUNT] = 0.0
    state[LOST_TIME] += dt
    if state[LOST_TIME] >= rules.lost_s or rules.lost_override == 0.0:
        return NO_READING
    return LOST


@njit(cache=True, nogil=True)
def _implausible(rules, state, seen):
    """RUN, or the status of a stop: overload, load off the path, readings below what the cut must give."""
    torque, light = seen.torque, rules.light
    state[OVER_COUNT] = state[OVER_COUNT] + 1.0 if torque > rules.overload else 0.0
    if state[OVER_COUNT] >= rules.overload_steps:
        return OVERLOAD
    # behind a cut the reading and the prediction die away together
    residue = seen.predicted if seen.predicted > 0.0 else 0.0
    loaded = seen.off_path and seen.actual > 0.0 and torque > light + residue
    state[OFF_COUNT] = state[OFF_COUNT] + 1.0 if loaded else 0.0
    if state[OFF_COUNT] >= rules.off_path_steps:
        return OFF_PATH
    if seen.predicted >= light and not seen.off_path:
        low = torque < rules.low_share * seen.predicted and seen.predicted - torque > light
        state[LOW_COUNT] = state[LOW_COUNT] + 1.0 if low else 0.0
        if state[LOW_COUNT] >= rules.low_steps:
            return LOW_READING
    elif state[LOW_COUNT] <= rules.stuck_steps:
        # a cut that ends a little before its prediction; a greater count stays, for a dead sensor reads the air rightly
        state[LOW_COUNT] = 0.0
    return RUN


@njit(cache=True, nogil=True)
def _error(rules, state, seen):
    """Error e, whether a rise rests on a load that is known, and the status."""
    torque, light, predicted = seen.torque, rules.light, seen.predicted
    state[LIGHT_COUNT] = state[LIGHT_COUNT] + 1.0 if torque < light else 0.0
    e = (rules.torque_ref - torque) / rules.torque_ref
    status = RUN
    known = seen.trusted and torque >= light
    if seen.model >= 0.0:
        if predicted >= light and torque >= light:
            own = 1.0 - state[TRIM] * torque / predicted
            e = min(own, e) if e < 0.0 else own
        elif predicted < light and torque < light:
            e = 0.0
            known = seen.trusted
            status = AIR
        else:
            e = min(e, 0.0)
            known = False
    elif state[LIGHT_COUNT] >= rules.air_steps:
        status = AIR
    if state[LOW_COUNT] > rules.air_steps or seen.off_path:
        e = min(e, 0.0)
        known = False
    if status == RUN and not known:
        status = UNKNOWN
    if state[GOOD_COUNT] < rules.settle_steps:
        status = SETTLING
    return e, known, status


@njit(cache=True, nogil=True)
def _move_trim(rules, state, seen, may_rise, f, d, e, dt):
    """Move the trim by the answer f; anti-windup: not against a stop, the slew or axes that lag behind."""
    held = state[WANTED] > state[OVERRIDE] + 1e-12 or seen.actual < 0.9 * state[SENT]
    move = state[TRIM] * f * (rules.gain_up if f > 0.0 else rules.gain_down) * dt
    if rules.kind == PI:
        move = rules.pi_gain * d + rules.pi_rate * e * dt
    if (move < 0.0 or (may_rise and not held)) and not (move < 0.0 and state[OVERRIDE] <= rules.floor):
        state[TRIM] += move
    if seen.model >= 0.0:
        state[TRIM] = min(max(state[TRIM], rules.trim_least), rules.trim_most)
    else:
        state[TRIM] = min(max(state[TRIM], rules.floor), rules.cap)


@njit(cache=True, nogil=True)
def _stop(state, status):
    """Stop for good."""
    state[FINAL] = status
    state[OVERRIDE] = state[SENT] = 0.0
    return 0.0, status


@njit(cache=True, nogil=True)
def _put_out(state, value, quantum):
    """Round down to whole steps of the override and keep what was sent."""
    if quantum > 0.0:
        value = int(value / quantum + 1e-9) * quantum
    state[SENT] = value
    return value
