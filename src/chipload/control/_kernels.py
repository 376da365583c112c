"""The fuzzy answer, a step of the override and the loop with its plant, compiled; arrays and scalars only.

Oracles: the sampled form in :mod:`chipload.control.fuzzy`; closed forms of the plant in the tests.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def place(centres, x):
    """Index of the set to the left of x, at most the last but one, and the memberships of that set and of the next."""
    last = len(centres) - 1
    if x <= centres[0]:
        return 0, 1.0, 0.0
    if x >= centres[last]:
        return last - 1, 0.0, 1.0
    i = 0
    while x >= centres[i + 1]:
        i += 1
    width = centres[i + 1] - centres[i]
    # both from their own side: the answer stays odd to the last bits
    return i, (centres[i + 1] - x) / width, (x - centres[i]) / width


@njit(cache=True, nogil=True)
def _falling(a, x):
    """Area and moment about 1/2 of min(a, 1 - y) over y from 0 to x."""
    p = min(x, 1.0 - a)
    area = a * p
    moment = 0.5 * a * p * (p - 1.0)
    if x > p:
        # primitives of 1 - y and of (1 - y)(y - 1/2)
        area += (x - p) * (1.0 - 0.5 * (x + p))
        moment += (x - p) * (-0.5 + 0.75 * (x + p) - (x * x + x * p + p * p) / 3.0)
    return area, moment


@njit(cache=True, nogil=True)
def between(a, b):
    """Area and moment about the middle of max(min(a, 1 - y), min(b, y)) over y from 0 to 1."""
    if b <= a and b <= 0.5:
        left, right = 1.0 - b, b
    elif a <= 0.5:
        left, right = a, 1.0 - a
    else:
        left, right = 0.5, 0.5
    a0, m0 = _falling(a, left)
    a1, m1 = _falling(b, right)
    return a0 + a1, m0 - m1


@njit(cache=True, nogil=True)
def mamdani(error, change, output, rules, whole_ends, e, d, strength):
    """Centroid of the cut sets; ``strength`` (outputs,) is scratch. See :func:`chipload.control.fuzzy.mamdani`."""
    i, x0, x1 = place(error, e)
    j, y0, y1 = place(change, d)
    strength[:] = 0.0
    for p in range(2):
        a = x1 if p else x0
        for q in range(2):
            w = min(a, y1 if q else y0)
            k = rules[i + p, j + q]
            strength[k] = max(strength[k], w)
    area, moment = 0.0, 0.0
    last = len(output) - 1
    for k in range(last):
        if strength[k] > 0.0 or strength[k + 1] > 0.0:
            width = output[k + 1] - output[k]
            a, m = between(strength[k], strength[k + 1])
            area += width * a
            moment += width * (0.5 * (output[k] + output[k + 1]) * a + width * m)
    if whole_ends:
        width = output[1] - output[0]
        a, m = between(0.0, strength[0])
        area += width * a
        moment += width * ((output[0] - 0.5 * width) * a + width * m)
        width = output[last] - output[last - 1]
        a, m = between(strength[last], 0.0)
        area += width * a
        moment += width * ((output[last] + 0.5 * width) * a + width * m)
    return moment / area


@njit(cache=True, nogil=True)
def product_sum(error, change, output, rules, e, d):
    """Output centres interpolated over the rules; see :func:`chipload.control.fuzzy.product_sum`."""
    i, x0, x1 = place(error, e)
    j, y0, y1 = place(change, d)
    low = y0 * output[rules[i, j]] + y1 * output[rules[i, j + 1]]
    high = y0 * output[rules[i + 1, j]] + y1 * output[rules[i + 1, j + 1]]
    return x0 * low + x1 * high


# status of a step; the names are in chipload.control.override
RUN, SETTLING, AIR, UNKNOWN, LOST, OVERLOAD, GIVEN_UP = range(7)
# which answer moves the trim
FIXED, PI, MAMDANI, PRODUCT_SUM = range(4)
# how a run ends; the names are in chipload.control.plant
FINISHED, STOPPED, TIMED_OUT, STALLED = range(4)
# places of the state
_O, _Q, _E, _READ, _SAME, _LIGHT, _OVER, _LOST_S, _GOOD, _LATCH, _WANTED, _OUT = range(12)
STATE = 12


@njit(cache=True, nogil=True)
def allowed(s, at, feed, edge, cut, torque, latency, soon, slew, cap, first):
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
        # the torque between two rows lies between theirs: both ends are asked
        if cut[i] > 0.0:
            best = min(best, (torque - edge[i]) / cut[i] + late)
        elif edge[i] > torque:
            best = min(best, late)
        i += 1
    return max(best, 0.0), first


@njit(cache=True, nogil=True)
def step(p, error, change, output, rules, whole_ends, strength, state, torque, trusted, predicted, model, actual, dt):
    """One step of the override; see :func:`chipload.control.override.step`.

    ``p`` (27,) the numbers of the configuration in their order; ``model``: override that the model allows with the trim
    of the state, below 0: there is no model; ``predicted`` [N mm] what the model expects to be measured now;
    ``actual``: override at which the axes move. Fills ``state`` and returns (override, status).
    """
    kind, aim, cap, floor, start, air_most, lost_most = int(p[0]), p[1], p[2], p[3], p[4], p[5], p[6]
    up, down, gain_up, gain_down, span_e, span_d = p[7], p[8], p[9], p[10], p[11], p[12]
    light, overload, overload_n, most = p[13], p[14], p[15], p[16]
    stuck_n, air_n, settle_n, lost_s, gap_s, quantum = p[17], p[18], p[19], p[20], p[21], p[22]
    kp, ki, trim_least, trim_most = p[23], p[24], p[25], p[26]
    if state[_LATCH] > 0.0:
        return 0.0, int(state[_LATCH])
    if dt > gap_s:
        state[_O] = min(state[_O], start)
        state[_GOOD] = 0.0
        dt = 0.0
    fresh = state[_GOOD] == 0.0

    # is the reading one?
    lost = not (-light <= torque <= most)
    if not lost:
        state[_SAME] = state[_SAME] + 1.0 if torque == state[_READ] and torque != 0.0 else 0.0
        state[_READ] = torque
        lost = state[_SAME] >= stuck_n
    if lost:
        state[_GOOD] = 0.0
        state[_OVER] = 0.0
        state[_LOST_S] += dt
        if state[_LOST_S] >= lost_s or lost_most == 0.0:
            state[_LATCH] = GIVEN_UP
            state[_O] = state[_OUT] = 0.0
            return 0.0, GIVEN_UP
        state[_O] = max(min(state[_O], lost_most), state[_O] - down * dt)
        return _put_out(state, state[_O], quantum), LOST
    state[_LOST_S] = 0.0
    state[_GOOD] += 1.0
    state[_OVER] = state[_OVER] + 1.0 if torque > overload else 0.0
    if state[_OVER] >= overload_n:
        state[_LATCH] = OVERLOAD
        state[_O] = state[_OUT] = 0.0
        return 0.0, OVERLOAD
    state[_LIGHT] = state[_LIGHT] + 1.0 if torque < light else 0.0
    in_air = state[_LIGHT] >= air_n

    # the error, and whether a rise rests on a load that is known
    modelled = model >= 0.0
    e = (aim - torque) / aim
    status = RUN
    known = trusted and torque >= light
    if modelled:
        both_light = predicted < light and torque < light
        if predicted >= light and torque >= light:
            own = 1.0 - state[_Q] * torque / predicted
            e = min(own, e) if e < 0.0 else own
        elif both_light:
            e = 0.0
            known = trusted
            status = AIR
        else:
            e = min(e, 0.0)
            known = False
    elif in_air:
        status = AIR
    if status == RUN and not known:
        status = UNKNOWN
    if state[_GOOD] < settle_n:
        status = SETTLING
    may_rise = known and state[_GOOD] >= settle_n

    d = 0.0 if fresh else e - state[_E]
    state[_E] = e
    f = 0.0
    if kind == MAMDANI:
        f = mamdani(error, change, output, rules, whole_ends, e / span_e, d / span_d, strength)
    elif kind == PRODUCT_SUM:
        f = product_sum(error, change, output, rules, e / span_e, d / span_d)
    f = min(max(f, -1.0), 1.0)
    # anti-windup: no further against a stop, against the slew or while the axes lag behind
    held = state[_WANTED] > state[_O] + 1e-12 or actual < 0.9 * state[_OUT]
    move = state[_Q] * f * (gain_up if f > 0.0 else gain_down) * dt
    if kind == PI:
        move = kp * d + ki * e * dt
    if (move < 0.0 or (may_rise and not held)) and not (move < 0.0 and state[_O] <= floor):
        state[_Q] += move
    if modelled:
        state[_Q] = min(max(state[_Q], trim_least), trim_most)
    else:
        state[_Q] = min(max(state[_Q], floor), cap)

    if kind == FIXED:
        wanted = start if not modelled else model
    elif modelled:
        wanted = model
    else:
        if status == AIR:
            state[_Q] = min(state[_Q], air_most)
        wanted = state[_Q]
    wanted = min(max(wanted, floor), cap)
    state[_WANTED] = wanted
    if fresh:
        state[_O] = min(state[_O], wanted)
    rise = up * dt if may_rise or kind == FIXED else 0.0
    state[_O] = min(max(wanted, state[_O] - down * dt), state[_O] + rise)
    return _put_out(state, max(state[_O], floor), quantum), status


@njit(cache=True, nogil=True)
def _put_out(state, value, quantum):
    """Round down to whole steps of the override and keep what was sent."""
    if quantum > 0.0:
        value = int(value / quantum + 1e-9) * quantum
    state[_OUT] = value
    return value


@njit(cache=True, nogil=True)
def between_rows(at, values, i, s):
    """Value of a column at s, between row i and the next."""
    if i + 1 >= len(at) or s <= at[i]:
        return values[i]
    x = (s - at[i]) / (at[i + 1] - at[i])
    return (1.0 - x) * values[i] + x * values[i + 1]


@njit(cache=True, nogil=True)
def run(
    at, feed, edge, cut, model_edge, model_cut, relief, modelled,
    p, error, change, output, rules, whole_ends, strength, state, latency_known,
    drive, spindle, fault, noise, every, delay, limit, quick, out,
):  # fmt: skip
    """Controller, axes and spindle along a path; see :func:`chipload.control.plant.run`.

    ``model_edge, model_cut`` are over ``relief``, as is what the controller is told.
    ``drive`` (dt, acceleration, longest time, share of the speed at which the spindle stalls); ``spindle`` (J, K_T,
    idle 0, idle 1, K_P, K_I, most current, speed, lags of sensor and filter); ``fault`` (kind, from, to, value);
    ``noise`` (m,) [A], used in turn; ``delay`` in steps of control. ``out`` (rows, 8): t, s, feed, torque, measured,
    override, status, speed. Returns rows filled, how it ended, time, greatest torque, the same over its relief, time in
    which that is over the limit.
    """
    dt, acc, longest, stall = drive[0], drive[1], drive[2], drive[3]
    inertia, kt, idle0, idle1 = spindle[0], spindle[1], spindle[2], spindle[3]
    prop, integ, most, aim_speed, lag, smooth = spindle[4], spindle[5], spindle[6], spindle[7], spindle[8], spindle[9]
    # until the first override acts the axes stand
    queue = np.zeros(int(delay) + 1)
    t, s, v, w = 0.0, at[0], 0.0, aim_speed
    i, first = 0, 0
    summed = idle0 + idle1 * w
    sensed, rate, expected, filtered = summed, 0.0, 0.0, 0.0
    rows, k, status, head = 0, 0, RUN, 0
    sent, command = 0.0, 0.0
    greatest, most_load, over = 0.0, 0.0, 0.0
    end = at[len(at) - 1]
    ended = TIMED_OUT
    reading, held, torque, borne = 0.0, 0.0, 0.0, 1.0
    while t < longest:
        while i + 2 < len(at) and at[i + 1] <= s:
            i += 1
        programmed = between_rows(at, feed, i, s)
        if k % every == 0:
            number = k // every
            current = sensed + noise[number % len(noise)]
            raw = kt * (current - idle0 - idle1 * w) - rate
            filtered += (raw - filtered) * min(every * dt / smooth, 1.0) if smooth > 0.0 else raw - filtered
            borne = between_rows(at, relief, i, s)
            reading = filtered / borne
            if fault[1] <= t < fault[2]:
                if fault[0] == 1.0:
                    reading = np.nan
                elif fault[0] == 2.0:
                    reading = held
                elif fault[0] == 3.0:
                    reading = fault[3]
            else:
                held = reading
            model = -1.0
            if modelled:
                known = latency_known + every * dt
                soon = max(v / programmed, min(p[2], state[_O] + p[7] * known))
                model, first = allowed(
                    s, at, feed, model_edge, model_cut, p[1] * state[_Q], known, soon,
                    min(p[8], acc / programmed), p[2], first,
                )  # fmt: skip
            sent, status = step(
                p, error, change, output, rules, whole_ends, strength, state, reading, True, expected, model,
                v / programmed, every * dt,
            )  # fmt: skip
            queue[head] = sent
            head = (head + 1) % len(queue)
            command = queue[head] if len(queue) > 1 else sent
        goal = command * programmed
        v = min(goal, v + acc * dt) if goal > v else max(goal, v - acc * dt)
        ratio = v / programmed * (aim_speed / w)
        torque = between_rows(at, edge, i, s) + between_rows(at, cut, i, s) * ratio if v > 0.0 else 0.0
        believed = 0.0
        if v > 0.0:
            believed = between_rows(at, model_edge, i, s) + between_rows(at, model_cut, i, s) * ratio
        # spindle: speed loop with a limited current
        wrong = aim_speed - w
        drawn = prop * wrong + summed
        if abs(drawn) <= most:
            summed += integ * wrong * dt
        drawn = min(max(drawn, -most), most)
        turning = (kt * (drawn - idle0 - idle1 * w) - torque) / inertia
        w += turning * dt
        x = min(dt / lag, 1.0) if lag > 0.0 else 1.0
        sensed += (drawn - sensed) * x
        rate += (inertia * turning - rate) * x
        y = min(dt / (lag + smooth), 1.0) if lag + smooth > 0.0 else 1.0
        expected += (believed - expected) * y
        greatest = max(greatest, torque)
        load = torque / between_rows(at, relief, i, s)
        most_load = max(most_load, load)
        if load > limit:
            over += dt
        if k % (every * quick) == 0 and rows < len(out):
            out[rows, 0], out[rows, 1], out[rows, 2], out[rows, 3] = t, s, v, torque
            out[rows, 4], out[rows, 5], out[rows, 6], out[rows, 7] = reading * borne, sent, status, w
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
        if w <= stall * aim_speed:
            ended = STALLED
            break
    if rows < len(out):
        out[rows, 0], out[rows, 1], out[rows, 2], out[rows, 3] = t, s, v, torque
        out[rows, 4], out[rows, 5], out[rows, 6], out[rows, 7] = reading * borne, sent, status, w
        rows += 1
    return rows, ended, t, greatest, most_load, over
