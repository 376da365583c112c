"""Compiled: times of rows whose motion keeps a jerk.

Notation: v [mm/s] speed, a [mm/s^2] and j [mm/s^3] greatest acceleration and jerk along the path, L [mm] length. A
change of speed dv from and to zero acceleration takes T = dv / a + a / j, or 2 sqrt(dv / j) where dv < a^2 / j, and the
way (v0 + v1) T / 2. A stretch is a change v0 -> top, an even part, and a change top -> v1: seven phases.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: relative difference of speeds that are the same
_SAME = 1e-9


@njit(cache=True, error_model="numpy")
def _change_time(dv: float, a: float, j: float) -> float:
    """Time [s] of a change of speed."""
    return dv / a + a / j if dv >= a * a / j else 2.0 * math.sqrt(dv / j)


@njit(cache=True, error_model="numpy")
def _change_length(v0: float, v1: float, a: float, j: float) -> float:
    """Way [mm] of a change of speed."""
    return float(0.5 * (v0 + v1) * _change_time(abs(v1 - v0), a, j))


@njit(cache=True, error_model="numpy")
def _free_time(length: float, v0: float, v1: float, high: float, a: float) -> float:
    """Time [s] of a stretch without a limit of the jerk that reaches ``high``."""
    level = length - (2.0 * high * high - v0 * v0 - v1 * v1) / (2.0 * a)
    return (2.0 * high - v0 - v1) / a + max(level, 0.0) / high if high > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _reached_speed(v0: float, length: float, a: float, j: float) -> float:
    """Greatest speed [mm/s] at the end of a way that begins with v0."""
    if length >= _change_length(v0, v0 + a * a / j, a, j):
        p = 0.5 * (a * a / j + 2.0 * v0)
        return v0 - p + math.sqrt(p * p + 2.0 * a * length - 2.0 * v0 * a * a / j)
    # u^3 + 2 v0 u = L sqrt(j), u = sqrt(dv): Newton falls to the root from above
    goal = length * math.sqrt(j)
    u = goal ** (1.0 / 3.0)
    for _ in range(60):
        step = (u * (u * u + 2.0 * v0) - goal) / (3.0 * u * u + 2.0 * v0) if u > 0.0 else 0.0
        u -= step
        if abs(step) <= 1e-15 * u:
            break
    return float(v0 + u * u)


@njit(cache=True, error_model="numpy")
def _top(length: float, v0: float, v1: float, most: float, a: float, j: float) -> float:
    """Greatest speed [mm/s] of a stretch."""
    if _change_length(v0, most, a, j) + _change_length(most, v1, a, j) <= length:
        return most
    low, high = max(v0, v1), most
    for _ in range(64):
        middle = 0.5 * (low + high)
        if _change_length(v0, middle, a, j) + _change_length(middle, v1, a, j) < length:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, error_model="numpy")
def _distance_and_speed(t: float, v0: float, v1: float, a: float, j: float) -> tuple[float, float]:
    """Way [mm] and speed [mm/s] at a time [s] of a change of speed."""
    dv = abs(v1 - v0)
    sense = 1.0 if v1 > v0 else -1.0
    whole = _change_time(dv, a, j)
    most = a if dv >= a * a / j else math.sqrt(dv * j)
    rise = most / j
    if t <= rise:
        return v0 * t + sense * j * t**3 / 6.0, v0 + sense * 0.5 * j * t * t
    if t >= whole - rise:
        left = whole - t
        return (
            0.5 * (v0 + v1) * whole - v1 * left + sense * j * left**3 / 6.0,
            v1 - sense * 0.5 * j * left * left,
        )
    even = t - rise
    v = v0 + sense * 0.5 * most * rise
    return v0 * rise + sense * j * rise**3 / 6.0 + v * even + sense * 0.5 * most * even * even, v + sense * most * even


@njit(cache=True, error_model="numpy")
def jerk_limited(
    length: Floats, most: Floats, acceleration: Floats, limit: Floats, v: Floats, jerk: float
) -> tuple[Floats, Floats]:
    """(n,) time [s] and (n,) greatest speed [mm/s] of each row.

    Parameters
    ----------
    length, most, acceleration : (n,) of each row
    limit, v : (n + 1,) greatest speed at the ends of rows, and that which the acceleration allows there

    Rows whose joint does not limit their speed are one stretch, with the least of their accelerations; at the ends of a
    stretch the acceleration is zero. Where a joint limits the speed while it goes on rising or falling, and a row
    beside it takes less time than the jerk needs for its change of speed, the stretch goes on too (feeds in small
    steps): it takes what its rows take without a limit of the jerk, and what the jerk adds to its greatest change.
    """
    n = len(length)
    time, peak = np.zeros(n), np.zeros(n)
    free_time, own = np.zeros(n), np.zeros(n)
    for k in range(n):
        a = acceleration[k]
        own[k] = max(min(most[k], math.sqrt(a * length[k] + 0.5 * (v[k] ** 2 + v[k + 1] ** 2))), v[k], v[k + 1])
        free_time[k] = _free_time(length[k], v[k], v[k + 1], own[k], a)
    # stretches: first row, greatest speed, acceleration, whether a joint inside limits the speed
    first = np.zeros(n + 1, dtype=np.int64)
    top, least, stepped = np.zeros(n), np.zeros(n), np.zeros(n, dtype=np.bool_)
    count, cap, highest, a = 0, 0.0, 0.0, np.inf
    for k in range(n):
        bound = most[k] if own[k] >= most[k] * (1.0 - _SAME) else 0.0
        if k > 0:
            free = v[k] < limit[k] * (1.0 - _SAME)
            even = abs(most[k] - most[k - 1]) <= _SAME * most[k] and v[k] >= most[k] * (1.0 - _SAME)
            fits = cap == 0.0 or bound == 0.0 or abs(cap - bound) <= _SAME * cap
            if not ((free or even) and fits):
                before, after = v[k] - v[k - 1], v[k + 1] - v[k]
                least_a = min(acceleration[k - 1], acceleration[k])
                hurried = free_time[k - 1] < _change_time(abs(before), least_a, jerk) or free_time[k] < _change_time(
                    abs(after), least_a, jerk
                )
                if v[k] > 0.0 and before * after >= 0.0 and before + after != 0.0 and hurried:
                    stepped[count] = True
                else:
                    top[count], least[count] = cap if cap > 0.0 else highest, a
                    count += 1
                    first[count] = k
                    cap, highest, a = 0.0, 0.0, np.inf
        cap, highest, a = max(cap, bound), max(highest, most[k]), min(a, acceleration[k])
    top[count], least[count] = cap if cap > 0.0 else highest, a
    count += 1
    first[count] = n
    s = np.zeros(n + 1)
    for k in range(n):
        s[k + 1] = s[k] + length[k]
    w = np.zeros(count + 1)
    for g in range(count + 1):
        w[g] = v[first[g]]
    for g in range(count):
        if w[g + 1] > w[g]:
            w[g + 1] = min(w[g + 1], _reached_speed(w[g], s[first[g + 1]] - s[first[g]], least[g], jerk))
    for g in range(count - 1, -1, -1):
        if w[g] > w[g + 1]:
            w[g] = min(w[g], _reached_speed(w[g + 1], s[first[g + 1]] - s[first[g]], least[g], jerk))
    for g in range(count):
        begin, end = first[g], first[g + 1]
        v0, v1, a = w[g], w[g + 1], least[g]
        whole = s[end] - s[begin]
        if stepped[g]:
            top[g] = own[begin:end].max()
        high = _top(whole, v0, v1, max(top[g], max(v0, v1)), a, jerk)
        up, down = _change_time(high - v0, a, jerk), _change_time(high - v1, a, jerk)
        rising, falling = _change_length(v0, high, a, jerk), _change_length(high, v1, a, jerk)
        level = max(whole - rising - falling, 0.0) / high if high > 0.0 else 0.0
        if stepped[g]:
            total = free_time[begin:end].sum()
            free = _free_time(whole, v0, v1, max(min(top[g], math.sqrt(a * whole + 0.5 * (v0**2 + v1**2))), v0, v1), a)
            share = 1.0 + max(up + level + down - free, 0.0) / total
            for k in range(begin, end):
                time[k], peak[k] = share * free_time[k], own[k]
            continue
        t, now = 0.0, v0
        for k in range(begin, end):
            at, t1, v_end = s[k + 1] - s[begin], up + level + down, v1
            if k + 1 < end:
                t1, v_end = _time_at_distance(at, v0, high, v1, up, level, down, rising, whole - falling, a, jerk)
            time[k] = max(t1 - t, 0.0)
            peak[k] = high if t <= up + level and t1 >= up else (v_end if t1 < up else now)
            t, now = t1, v_end
    return time, peak


@njit(cache=True, error_model="numpy")
def _time_at_distance(
    at: float, v0: float, high: float, v1: float, up: float, level: float, down: float, rising: float, even: float,
    a: float, j: float,
) -> tuple[float, float]:  # fmt: skip
    """Time [s] and speed [mm/s] at which a stretch passes the way ``at``; its parts end at ``rising`` and ``even``."""
    if rising <= at <= even:
        return up + (at - rising) / high, high
    before = at < rising
    start, end, length = (v0, high, at) if before else (high, v1, at - even)
    low, late = 0.0, up if before else down
    for _ in range(64):
        middle = 0.5 * (low + late)
        if _distance_and_speed(middle, start, end, a, j)[0] < length:
            low = middle
        else:
            late = middle
    return low if before else up + level + low, _distance_and_speed(low, start, end, a, j)[1]
