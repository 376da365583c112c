"""The map of a period with several delays, in two or three directions; arrays and scalars only.

Notation as in ``_tooth_period.py``, with d = 2 directions (T, n) or 3 (T, n, A), U (d, M). A delay is a
number of cells, whole or not: where a delayed time lies between nodes, r is the cubic Hermite there. What the state at
the end of a cell is follows from a 2 d x 2 d system that is inverted once for all applications.

In three directions a row of ``rows`` has 13 numbers: the first five and the last three of the eleven are those of
:mod:`chipload.stability._directional`; 5 to 7 are the bare slopes Kt, Kr, Ka [MPa], 11 and 12 sin(kappa) and
cos(kappa). A displacement makes the chip thicker by nu . r, nu = sin(kappa) u - cos(kappa) A; the force on the cutter
is -(Kt e + Kr nu + Ka (cos(kappa) u + sin(kappa) A)) of it.

Oracle: even teeth, where it is a power of the map of one tooth; a simulation in time in three directions.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.stability._directional import (
    AT_END,
    FROM_MOMENTS,
    G3,
    G5,
    G12,
    UPRIGHT,
    W3,
    W5,
    W12,
    matrices,
)
from chipload.stability._spectrum import first_vector, is_settled, next_vector
from chipload.stability._tooth_period import HERMITE

TAU = 2.0 * math.pi
#: least number of cells between two teeth
FEWEST = 12
#: tolerance in cells within which a delayed time is that of a node
NODE = 1e-9


@njit(cache=True, nogil=True)
def density(phi, row, exponents, out):
    """The nine values of A at the immersion phi for each mm of edge; with exponents 0 where no chip is cut."""
    s = math.sin(phi)
    c = math.cos(phi)
    kt = row[5]
    kr = row[6]
    ka = row[7]
    if exponents[0] != 0.0 or exponents[1] != 0.0 or exponents[2] != 0.0:
        h = row[8] * s + row[9] * c + row[10]
        if h <= 0.0:
            out[:] = 0.0
            return
        kt *= h ** (-exponents[0])
        kr *= h ** (-exponents[1])
        ka *= h ** (-exponents[2])
    across = kr * row[11] + ka * row[12]
    along = kr * row[12] - ka * row[11]
    force_t = -(kt * c + across * s)
    force_n = kt * s - across * c
    thick_t = row[11] * s
    thick_n = row[11] * c
    thick_a = -row[12]
    out[0] = force_t * thick_t
    out[1] = force_t * thick_n
    out[2] = force_t * thick_a
    out[3] = force_n * thick_t
    out[4] = force_n * thick_n
    out[5] = force_n * thick_a
    out[6] = along * thick_t
    out[7] = along * thick_n
    out[8] = along * thick_a


@njit(cache=True, nogil=True)
def primitive(phi, row, factor, out):
    """Adds ``factor`` times the integral of the nine values of A over the immersion from 0, without exponents."""
    s = math.sin(phi)
    c = math.cos(phi)
    sc = 0.5 * s * s
    ss = 0.5 * (phi - s * c)
    cc = 0.5 * (phi + s * c)
    kt = row[5] * factor
    across = (row[6] * row[11] + row[7] * row[12]) * factor
    along = (row[6] * row[12] - row[7] * row[11]) * factor
    out[0] -= row[11] * (kt * sc + across * ss)
    out[1] -= row[11] * (kt * cc + across * sc)
    out[2] += row[12] * (kt * s + across * (1.0 - c))
    out[3] += row[11] * (kt * ss - across * sc)
    out[4] += row[11] * (kt * sc - across * cc)
    out[5] -= row[12] * (kt * (1.0 - c) - across * s)
    out[6] += row[11] * along * (1.0 - c)
    out[7] += row[11] * along * s
    out[8] -= row[12] * along * phi


@njit(cache=True, nogil=True)
def integrate_with_exponents(low, high, row, exponents, factor, out, one):
    """Adds the integral of :func:`density` with exponents, times ``factor``: between peak and trough of h the variable
    is w, phi = zero +- w^3, so that a power of h at its zero is smooth enough for twelve points.
    """
    swing = math.hypot(row[8], row[9])
    peak = math.atan2(row[8], row[9])
    reach = math.acos(-row[10] / swing) if swing > abs(row[10]) else math.pi
    k = math.floor((low - peak) / math.pi)
    begin = low
    while begin < high:
        end = min(high, peak + (k + 1) * math.pi)
        if end > begin:
            falling = k % 2 == 0
            zero = peak + k * math.pi + reach if falling else peak + (k + 1) * math.pi - reach
            u = np.cbrt(max(zero - end, 0.0) if falling else max(begin - zero, 0.0))
            v = np.cbrt(max(zero - begin, 0.0) if falling else max(end - zero, 0.0))
            for g in range(12):
                w = 0.5 * (u + v) + 0.5 * (v - u) * G12[g]
                density(zero - w**3 if falling else zero + w**3, row, exponents, one)
                for c in range(9):
                    out[c] += 1.5 * (v - u) * w * w * W12[g] * factor * one[c]
        begin = end
        k += 1


@njit(cache=True, nogil=True)
def value(theta, row, exponents, out, one):
    """The nine values of A of one row at a rotation, of the tooth whose immersion there is not wrapped."""
    out[:] = 0.0
    span = row[3] - row[2]
    if span < UPRIGHT:
        phi = theta - row[2]
        if row[0] < phi < row[1]:
            density(phi, row, exponents, out)
            for c in range(9):
                out[c] *= row[4]
        return
    low = max(row[0], theta - row[3])
    high = min(row[1], theta - row[2])
    if high <= low:
        return
    if exponents[0] == 0.0 and exponents[1] == 0.0 and exponents[2] == 0.0:
        primitive(high, row, row[4] / span, out)
        primitive(low, row, -row[4] / span, out)
    else:
        integrate_with_exponents(low, high, row, exponents, row[4] / span, out, one)


@njit("void(float64[:,::1], int64, int64, float64, int64, float64[::1], float64[:,:,::1])", cache=True, nogil=True)
def matrices3(rows, lo, hi, period, m, exponents, out):
    """As :func:`chipload.stability._directional.matrices`, in three directions: out (m, 3, 9) [N/mm]."""
    d = period / m
    a = np.empty(9)
    one = np.empty(9)
    moments = np.empty((3, 9))
    breaks = np.empty(4)
    ends = np.empty(6)
    for r in range(lo, hi):
        row = rows[r]
        if row[1] <= row[0] or row[4] <= 0.0:
            continue
        breaks[0] = row[0] + row[2]
        breaks[1] = min(row[0] + row[3], row[1] + row[2])
        breaks[2] = max(row[0] + row[3], row[1] + row[2])
        breaks[3] = row[1] + row[3]
        for i in range(math.floor(breaks[0] / d), math.ceil(breaks[3] / d)):
            begin = i * d
            count = 1
            ends[0] = begin
            for k in range(4):
                if ends[count - 1] + AT_END * d < breaks[k] < begin + d - AT_END * d:
                    ends[count] = breaks[k]
                    count += 1
            ends[count] = begin + d
            at = i % m
            if count == 1:
                for g in range(3):
                    value(begin + d * G3[g], row, exponents, a, one)
                    for c in range(9):
                        out[at, g, c] += a[c]
                continue
            moments[:] = 0.0
            for k in range(count):
                width = ends[k + 1] - ends[k]
                for g in range(5):
                    theta = ends[k] + width * G5[g]
                    t = (theta - begin) / d
                    value(theta, row, exponents, a, one)
                    for c in range(9):
                        x = a[c] * W5[g] * width / d
                        moments[0, c] += x
                        moments[1, c] += x * t
                        moments[2, c] += x * t * t
            for g in range(3):
                for c in range(9):
                    for k in range(3):
                        out[at, g, c] += FROM_MOMENTS[g, k] * moments[k, c]


@njit(cache=True, nogil=True)
def motion(w, z, U, h, free, push, end):
    """As :func:`chipload.stability._tooth_period.free_motion`, in d directions: ``free`` (4, M), ``push`` (3, 2, M),
    ``end`` (2 d, 3 d), which has the columns of the first Gauss point first.
    """
    d = U.shape[0]
    end[:] = 0.0
    for k in range(len(w)):
        wd = w[k] * math.sqrt(1.0 - z[k] ** 2)
        decay = math.exp(-z[k] * w[k] * h)
        c = math.cos(wd * h)
        s = math.sin(wd * h)
        free[0, k] = decay * (c + z[k] * w[k] / wd * s)
        free[1, k] = decay * s / wd
        free[2, k] = -(w[k] ** 2) * free[1, k]
        free[3, k] = decay * (c - z[k] * w[k] / wd * s)
        for g in range(3):
            t = h * (1.0 - G3[g])
            decay_g = math.exp(-z[k] * w[k] * t)
            cg = math.cos(wd * t)
            sg = math.sin(wd * t)
            push[g, 0, k] = h * W3[g] * decay_g * sg / wd
            push[g, 1, k] = h * W3[g] * decay_g * (cg - z[k] * w[k] / wd * sg)
            for a in range(d):
                for b in range(d):
                    end[a, d * g + b] += U[a, k] * push[g, 0, k] * U[b, k]
                    end[d + a, d * g + b] += h * U[a, k] * push[g, 1, k] * U[b, k]


@njit(cache=True, nogil=True)
def systems(A, end, inverse, slopes, cuts):
    """For each cell: ``inverse`` (m, 2 d, 2 d) by which the state at its end follows from free motion and known forces,
    ``slopes`` (m, 3 d, 2 d) of the forces over that state, ``cuts`` (D, m) whether a delay counts there.
    """
    delays, m = A.shape[0], A.shape[1]
    n, columns = end.shape
    d = n // 2
    for i in range(m):
        any_cuts = False
        slopes[i] = 0.0
        for j in range(delays):
            cuts[j, i] = False
            for g in range(3):
                for a in range(d):
                    for b in range(d):
                        x = A[j, i, g, d * a + b]
                        if x != 0.0:
                            cuts[j, i] = True
                            any_cuts = True
                            slopes[i, d * g + a, b] += HERMITE[g, 2] * x
                            slopes[i, d * g + a, d + b] += HERMITE[g, 3] * x
        inverse[i] = np.eye(n)
        if any_cuts:
            B = np.eye(n)
            for r in range(n):
                for c in range(n):
                    for k in range(columns):
                        B[r, c] -= end[r, k] * slopes[i, k, c]
            inverse[i] = np.linalg.inv(B)


@njit(cache=True, nogil=True, fastmath=True)
def delayed_coordinate(history, k, t, b, d):
    """Coordinate b of the state a share t of a cell after node k, and one cell later: first, h first', last, h last'.

    ``history`` (nodes, 2 d) holds r and h r' at the nodes; between nodes the state is the cubic Hermite.
    """
    p0 = history[k, b]
    s0 = history[k, d + b]
    p1 = history[k + 1, b]
    s1 = history[k + 1, d + b]
    if t < NODE:
        return p0, s0, p1, s1
    t2 = t * t
    t3 = t2 * t
    p2 = history[k + 2, b]
    s2 = history[k + 2, d + b]
    h0 = 2 * t3 - 3 * t2 + 1
    h1 = t3 - 2 * t2 + t
    h2 = 3 * t2 - 2 * t3
    h3 = t3 - t2
    g0 = 6 * (t2 - t)
    g1 = 3 * t2 - 4 * t + 1
    g3 = 3 * t2 - 2 * t
    return (
        h0 * p0 + h1 * s0 + h2 * p1 + h3 * s1,
        g0 * (p0 - p1) + g1 * s0 + g3 * s1,
        h0 * p1 + h1 * s1 + h2 * p2 + h3 * s2,
        g0 * (p1 - p2) + g1 * s1 + g3 * s2,
    )


@njit(cache=True, nogil=True, fastmath=True)
def advance_period(x, A, delay, nodes, U, free, push, end, inverse, slopes, cuts, h, history, q, v, known, new, y):
    """The state y a period after the state x: (r, h r') at the nodes of the longest delay, q, q'.

    Parameters
    ----------
    x, y : (2 d nodes + 2 M,) state at the beginning, and at the end, which is written
    A, delay : (D, m, 3, d d) force over displacement [N/mm] at the Gauss points of the m cells; (D,) delays in cells
    U : (d, M) of the modes; free, push, end : of :func:`motion`; inverse, slopes, cuts : of :func:`systems`
    h : length of a cell [s]
    history, q, v, known, new : (nodes + m + 1, 2 d), (M,), (M,), (3 d,), (2 d,) working arrays
    """
    delays, cells = cuts.shape
    d, modes = U.shape
    n = 2 * d
    for k in range(modes):
        q[k] = x[n * nodes + k]
        v[k] = x[n * nodes + modes + k]
    for i in range(nodes):
        for c in range(n):
            history[i, c] = x[n * i + c]
    for a in range(d):
        history[nodes, a] = 0.0
        history[nodes, d + a] = 0.0
        for k in range(modes):
            history[nodes, a] += U[a, k] * q[k]
            history[nodes, d + a] += h * U[a, k] * v[k]
    for i in range(cells):
        for k in range(modes):
            a = free[0, k] * q[k] + free[1, k] * v[k]
            v[k] = free[2, k] * q[k] + free[3, k] * v[k]
            q[k] = a
        for a in range(d):
            p = 0.0
            s = 0.0
            for k in range(modes):
                p += U[a, k] * q[k]
                s += U[a, k] * v[k]
            new[a] = p
            new[d + a] = h * s
        cutting = False
        for j in range(delays):
            if not cuts[j, i]:
                continue
            if not cutting:
                known[:] = 0.0
                cutting = True
            at = nodes + i - delay[j]
            k = math.floor(at + NODE)
            for b in range(d):
                first, first_slope, last, last_slope = delayed_coordinate(history, k, at - k, b, d)
                now = history[nodes + i, b] - first
                now_slope = history[nodes + i, d + b] - first_slope
                for g in range(3):
                    gap = (
                        HERMITE[g, 0] * now
                        + HERMITE[g, 1] * now_slope
                        - HERMITE[g, 2] * last
                        - HERMITE[g, 3] * last_slope
                    )
                    for a in range(d):
                        known[d * g + a] += A[j, i, g, d * a + b] * gap
        to = history[nodes + i + 1]
        if not cutting:
            for c in range(n):
                to[c] = new[c]
            continue
        for r in range(n):
            for k in range(3 * d):
                new[r] += end[r, k] * known[k]
        for r in range(n):
            p = 0.0
            for c in range(n):
                p += inverse[i, r, c] * new[c]
            to[r] = p
        for r in range(3 * d):
            for c in range(n):
                known[r] += slopes[i, r, c] * to[c]
        for k in range(modes):
            for g in range(3):
                f = 0.0
                for a in range(d):
                    f += U[a, k] * known[d * g + a]
                q[k] += push[g, 0, k] * f
                v[k] += push[g, 1, k] * f
    for i in range(nodes):
        for c in range(n):
            y[n * i + c] = history[cells + i, c]
    for k in range(modes):
        y[n * nodes + k] = q[k]
        y[n * nodes + modes + k] = v[k]


@njit(cache=True, nogil=True)
def sizes(U, w, h, nodes, scale):
    """As :func:`chipload.stability._tooth_period.scale_state`, in d directions."""
    d, modes = U.shape
    n = 2 * d
    for i in range(nodes):
        for a in range(d):
            scale[n * i + a] = 1.0 / math.sqrt(nodes)
            scale[n * i + d + a] = scale[n * i + a] / (w.max() * h)
    for k in range(modes):
        size = math.sqrt((U[:, k] ** 2).sum()) + 1e-12 * np.abs(U).max()
        scale[n * nodes + k] = size
        scale[n * nodes + modes + k] = size / w[k]


@njit(cache=True, nogil=True)
def mode_of(H, V, used, best, angle, first, modes):
    """The mode of greatest share in the vector of the greatest multiplier; those of the state begin at ``first``."""
    values, vectors = np.linalg.eig(H[:used, :used].astype(np.complex128))
    at = np.argmin(np.abs(values - best * (math.cos(angle) + 1j * math.sin(angle))))
    share = np.zeros(modes)
    for k in range(modes):
        for part in (first + k, first + modes + k):
            x = 0.0 + 0.0j
            for j in range(used):
                x += V[j, part] * vectors[j, at]
            share[k] += abs(x) ** 2
    return np.argmax(share)


@njit(
    "void(int64, int64, int64[::1], float64[:,::1], int64[::1], float64[::1], float64[::1], float64[::1], float64,"
    " float64[:,::1], float64[::1], float64[:,:,::1], float64[::1], float64, int64, float64, float64[:,::1])",
    cache=True, nogil=True,
)  # fmt: skip
def multipliers(first, last, start, rows, which, delays, exponents, time, angle, w, z, U, gain, per_wave, most, tol,
                out):  # fmt: skip
    """Of the cuts first .. last - 1: modulus and angle of the greatest multiplier of a period, its dimension, and
    the mode of greatest share in its vector: out (n, 4).

    ``which`` (b,) number of the delay of each row, its lag that of its own tooth; ``delays`` (D,) [rad]; ``time`` (n,)
    [s] and ``angle`` [rad] of a period; the others as of :func:`chipload.stability._tooth_period.multipliers`.
    """
    modes = len(z)
    d = U.shape[1]
    for k in range(first, last):
        fewest = FEWEST * max(1, round(angle / delays.min()))
        cells = max(fewest, math.ceil(per_wave * w[k].max() * time[k] / TAU))
        h = time[k] / cells
        used_delay = np.zeros(len(delays), np.bool_)
        for r in range(start[k], start[k + 1]):
            used_delay[which[r]] = True
        own = np.flatnonzero(used_delay)
        A = np.zeros((len(own), cells, 3, d * d))
        for j in range(len(own)):
            some = rows[start[k] : start[k + 1]][which[start[k] : start[k + 1]] == own[j]]
            if d == 2:
                matrices(some, 0, len(some), angle, cells, exponents, A[j])
            else:
                matrices3(some, 0, len(some), angle, cells, exponents, A[j])
        A *= gain[k]
        free, push, end = np.empty((4, modes)), np.empty((3, 2, modes)), np.empty((2 * d, 3 * d))
        motion(w[k], z, U[k], h, free, push, end)
        inverse, slopes = np.empty((cells, 2 * d, 2 * d)), np.empty((cells, 3 * d, 2 * d))
        cuts = np.empty((len(own), cells), np.bool_)
        systems(A, end, inverse, slopes, cuts)
        delay = delays[own] / angle * cells
        nodes = 1 if len(own) == 0 else math.ceil(delay.max() - NODE)
        n = 2 * d * nodes + 2 * modes
        dimension = min(most, n - 1)
        V, H = np.empty((dimension + 1, n)), np.zeros((dimension + 1, dimension + 1))
        room = np.empty((dimension + 1, dimension + 1))
        history, scale, x, y = np.empty((nodes + cells + 1, 2 * d)), np.empty(n), np.empty(n), np.empty(n)
        q, v, known, new = np.empty(modes), np.empty(modes), np.empty(3 * d), np.empty(2 * d)
        sizes(U[k], w[k], h, nodes, scale)
        first_vector(V[0])
        state = np.array([0.0, 0.0, -1.0, -2.0])
        used = 0
        for j in range(dimension):
            for i in range(n):
                x[i] = V[j, i] / scale[i]
            advance_period(
                x, A, delay, nodes, U[k], free, push, end, inverse, slopes, cuts, h, history, q, v, known, new, y
            )
            for i in range(n):
                y[i] *= scale[i]
            norm = next_vector(V, H, j, y)
            used = j + 1
            if is_settled(H, j, norm, dimension, tol, room, state):
                break
            for i in range(n):
                V[j + 1, i] = y[i] / norm
        out[k, 0] = state[0]
        out[k, 1] = state[1]
        out[k, 2] = used
        out[k, 3] = mode_of(H, V, used, state[0], state[1], 2 * d * nodes, modes)
