"""Compiled loops of the map of one tooth period and its multipliers; arrays and scalars only.

Notation: M modes, w [rad/s], z damping ratio, U (2, M) [1/sqrt(t)] rows T, n; r = U q the displacement of the cutter
from the work [mm], q'' + 2 z w q' + w^2 q = U^T F. A tooth period tau has m equal cells of length h. The state is
(r, h r') at the m nodes of the last period, then q, then q': 4 m + 2 M numbers. In a cell the difference
D(t) = r(t) - r(t - tau) is the cubic Hermite of its ends, the force A D is taken at three Gauss points, the modes
answer exactly: order 4 in h. What D is at the end follows from a 4 x 4 system for each cell, solved once for all
applications of the map. Process damping adds the force C r', r' the slope of the cubic Hermite of r; r is D and what
was there a period before, so that with it a cell also needs its delayed start and end.

Oracles: Chebyshev collocation, semi-discretisation, many frequencies and a simulation in time, in tests/stability.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.stability._directional import G3, W3, matrices
from chipload.stability._spectrum import first_vector, is_settled, next_vector

TAU = 2.0 * math.pi
#: the Hermite polynomials of value and slope at the start, value and slope at the end, at the Gauss points
HERMITE = np.array([[2 * t**3 - 3 * t**2 + 1, t**3 - 2 * t**2 + t, -2 * t**3 + 3 * t**2, t**3 - t**2] for t in G3])
#: and their slopes, over the length of the cell
SLOPES = np.array([[6 * t**2 - 6 * t, 3 * t**2 - 4 * t + 1, 6 * t - 6 * t**2, 3 * t**2 - 2 * t] for t in G3])
#: least number of cells of a period
FEWEST = 12
#: multiplier below which its logarithm does not matter
TINY = 1e-9
#: factors on the force at which a stable and an unstable step are tested first
ABOVE = np.array([1.25, 1.5, 2.0, 3.0])
BELOW = 0.7
DOWN = 16
#: greatest number of evaluations near the limit, and tolerance of log|mu| there
CLOSING = 14
CLOSE = 3e-4


@njit(cache=True, nogil=True)
def cells_of(tau, w, per_wave):
    """Cells of a period, ``per_wave`` of a wave of the fastest mode, :data:`FEWEST` at least."""
    fastest = 0.0
    for k in range(len(w)):
        fastest = max(fastest, w[k])
    return max(FEWEST, math.ceil(per_wave * fastest * tau / TAU))


@njit(cache=True, nogil=True)
def free_motion(w, z, U, h, free, push, end):
    """What the modes do in a cell: ``free`` (4, M) from q, q' to q, q'; ``push`` (3, 2, M) q and q' at the end by a
    unit of force at a Gauss point times its share of h; ``end`` (3, 4, 2) (r, h r') by a force there.
    """
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
    for g in range(3):
        for a in range(2):
            for b in range(2):
                x = 0.0
                y = 0.0
                for k in range(len(w)):
                    x += U[a, k] * push[g, 0, k] * U[b, k]
                    y += U[a, k] * push[g, 1, k] * U[b, k]
                end[g, a, b] = x
                end[g, 2 + a, b] = h * y


@njit(cache=True, nogil=True)
def solve4(B, X, n):
    """In place: X (4, n) becomes B^-1 X, with partial pivoting."""
    for c in range(4):
        p = c
        for r in range(c + 1, 4):
            if abs(B[r, c]) > abs(B[p, c]):
                p = r
        if p != c:
            for k in range(4):
                B[c, k], B[p, k] = B[p, k], B[c, k]
            for k in range(n):
                X[c, k], X[p, k] = X[p, k], X[c, k]
        for r in range(c + 1, 4):
            f = B[r, c] / B[c, c]
            if f != 0.0:
                for k in range(c, 4):
                    B[r, k] -= f * B[c, k]
                for k in range(n):
                    X[r, k] -= f * X[c, k]
    for c in range(3, -1, -1):
        for k in range(n):
            t = X[c, k]
            for r in range(c + 1, 4):
                t -= B[c, r] * X[r, k]
            X[c, k] = t / B[c, c]


@njit(cache=True, nogil=True)
def cell_systems(A, C, gain, h, end, ends, forces, cuts):
    """For each cell: ``ends`` (m, 4, 8) the difference at its end from that at its start and from free less delayed
    end; ``forces`` (m, 6, 8) at the Gauss points from the differences at both ends; ``cuts`` (m,) whether A is not 0.

    With process damping C (m, 3, 4), which ``gain`` does not count for, both have 8 columns more: from the delayed
    start and end. Without it C has no cells.
    """
    damped = len(C) > 0
    columns = ends.shape[2]
    B = np.empty((4, 4))
    X = np.empty((4, columns))
    for i in range(len(A)):
        cuts[i] = False
        for g in range(3):
            for c in range(4):
                if A[i, g, c] != 0.0 or (damped and C[i, g, c] != 0.0):
                    cuts[i] = True
        if not cuts[i]:
            continue
        B[:] = 0.0
        X[:] = 0.0
        for r in range(4):
            B[r, r] = 1.0
            X[r, 4 + r] = 1.0
        for g in range(3):
            for a in range(2):
                for c in range(4):
                    forces[i, 2 * g + a, 2 * c] = HERMITE[g, c] * gain * A[i, g, 2 * a]
                    forces[i, 2 * g + a, 2 * c + 1] = HERMITE[g, c] * gain * A[i, g, 2 * a + 1]
                    if damped:
                        for b in range(2):
                            x = SLOPES[g, c] / h * C[i, g, 2 * a + b]
                            forces[i, 2 * g + a, 2 * c + b] += x
                            forces[i, 2 * g + a, 8 + 2 * c + b] = x
            for r in range(4):
                x = forces[i, 2 * g]
                y = forces[i, 2 * g + 1]
                for c in range(4):
                    X[r, c] += end[g, r, 0] * x[c] + end[g, r, 1] * y[c]
                    B[r, c] -= end[g, r, 0] * x[4 + c] + end[g, r, 1] * y[4 + c]
                for c in range(8, columns):
                    X[r, c] += end[g, r, 0] * x[c] + end[g, r, 1] * y[c]
        solve4(B, X, columns)
        ends[i] = X


@njit(cache=True, nogil=True, fastmath=True)
def of_delayed(row, x, at, p0, p1, p2, p3):
    """What process damping adds to a row of ``ends`` or ``forces``: by the delayed start, in x, and end of a cell."""
    return (
        row[8] * x[at] + row[9] * x[at + 1] + row[10] * x[at + 2] + row[11] * x[at + 3]
        + row[12] * p0 + row[13] * p1 + row[14] * p2 + row[15] * p3
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True)
def apply_map(x, y, ends, forces, cuts, free, push, U, h, m, q, v):
    """The state y one tooth period after the state x; q, v (M,) are room to work in."""
    modes = len(q)
    damped = ends.shape[2] > 8
    r0 = 0.0
    r1 = 0.0
    r2 = 0.0
    r3 = 0.0
    for k in range(modes):
        q[k] = x[4 * m + k]
        v[k] = x[4 * m + modes + k]
        r0 += U[0, k] * q[k]
        r1 += U[1, k] * q[k]
        r2 += h * U[0, k] * v[k]
        r3 += h * U[1, k] * v[k]
    n0 = r0
    n1 = r1
    n2 = r2
    n3 = r3
    for i in range(m):
        y[4 * i] = r0
        y[4 * i + 1] = r1
        y[4 * i + 2] = r2
        y[4 * i + 3] = r3
        f0 = 0.0
        f1 = 0.0
        f2 = 0.0
        f3 = 0.0
        for k in range(modes):
            a = free[0, k] * q[k] + free[1, k] * v[k]
            b = free[2, k] * q[k] + free[3, k] * v[k]
            q[k] = a
            v[k] = b
            f0 += U[0, k] * a
            f1 += U[1, k] * a
            f2 += h * U[0, k] * b
            f3 += h * U[1, k] * b
        if not cuts[i]:
            r0 = f0
            r1 = f1
            r2 = f2
            r3 = f3
            continue
        d0, d1, d2, d3 = r0 - x[4 * i], r1 - x[4 * i + 1], r2 - x[4 * i + 2], r3 - x[4 * i + 3]
        p0, p1, p2, p3 = n0, n1, n2, n3
        if i < m - 1:
            p0, p1, p2, p3 = x[4 * i + 4], x[4 * i + 5], x[4 * i + 6], x[4 * i + 7]
        e0, e1, e2, e3 = f0 - p0, f1 - p1, f2 - p2, f3 - p3
        s = ends[i]
        c0 = s[0, 0] * d0 + s[0, 1] * d1 + s[0, 2] * d2 + s[0, 3] * d3
        c0 += s[0, 4] * e0 + s[0, 5] * e1 + s[0, 6] * e2 + s[0, 7] * e3
        c1 = s[1, 0] * d0 + s[1, 1] * d1 + s[1, 2] * d2 + s[1, 3] * d3
        c1 += s[1, 4] * e0 + s[1, 5] * e1 + s[1, 6] * e2 + s[1, 7] * e3
        c2 = s[2, 0] * d0 + s[2, 1] * d1 + s[2, 2] * d2 + s[2, 3] * d3
        c2 += s[2, 4] * e0 + s[2, 5] * e1 + s[2, 6] * e2 + s[2, 7] * e3
        c3 = s[3, 0] * d0 + s[3, 1] * d1 + s[3, 2] * d2 + s[3, 3] * d3
        c3 += s[3, 4] * e0 + s[3, 5] * e1 + s[3, 6] * e2 + s[3, 7] * e3
        t = forces[i]
        if damped:
            c0 += of_delayed(s[0], x, 4 * i, p0, p1, p2, p3)
            c1 += of_delayed(s[1], x, 4 * i, p0, p1, p2, p3)
            c2 += of_delayed(s[2], x, 4 * i, p0, p1, p2, p3)
            c3 += of_delayed(s[3], x, 4 * i, p0, p1, p2, p3)
        for g in range(3):
            a = t[2 * g, 0] * d0 + t[2 * g, 1] * d1 + t[2 * g, 2] * d2 + t[2 * g, 3] * d3
            a += t[2 * g, 4] * c0 + t[2 * g, 5] * c1 + t[2 * g, 6] * c2 + t[2 * g, 7] * c3
            b = t[2 * g + 1, 0] * d0 + t[2 * g + 1, 1] * d1 + t[2 * g + 1, 2] * d2 + t[2 * g + 1, 3] * d3
            b += t[2 * g + 1, 4] * c0 + t[2 * g + 1, 5] * c1 + t[2 * g + 1, 6] * c2 + t[2 * g + 1, 7] * c3
            if damped:
                a += of_delayed(t[2 * g], x, 4 * i, p0, p1, p2, p3)
                b += of_delayed(t[2 * g + 1], x, 4 * i, p0, p1, p2, p3)
            for k in range(modes):
                f = U[0, k] * a + U[1, k] * b
                q[k] += push[g, 0, k] * f
                v[k] += push[g, 1, k] * f
        r0 = c0 + p0
        r1 = c1 + p1
        r2 = c2 + p2
        r3 = c3 + p3
    for k in range(modes):
        y[4 * m + k] = q[k]
        y[4 * m + modes + k] = v[k]


@njit(cache=True, nogil=True, fastmath=True)
def scale_state(U, w, h, m, scale):
    """Factors (4 m + 2 M,) that make the parts of a state of like size: history, slopes, q, q'."""
    modes = len(w)
    fastest = w.max()
    for i in range(m):
        scale[4 * i] = 1.0 / math.sqrt(m)
        scale[4 * i + 1] = scale[4 * i]
        scale[4 * i + 2] = scale[4 * i] / (fastest * h)
        scale[4 * i + 3] = scale[4 * i + 2]
    for k in range(modes):
        size = math.hypot(U[0, k], U[1, k]) + 1e-12 * np.abs(U).max()
        scale[4 * m + k] = size
        scale[4 * m + modes + k] = size / w[k]


@njit(cache=True, nogil=True, fastmath=True)
def arnoldi(ends, forces, cuts, free, push, U, w, h, m, most, tol, V, H, room, x, y, q, v, scale):
    """Modulus and angle of the greatest multiplier, and the dimension of the Krylov space, kept in ``V`` (rows) and
    ``H``. It ends when the modulus changes by less than ``tol`` over two dimensions, with 6 to ``most`` dimensions.
    """
    n = 4 * m + 2 * len(w)
    most = min(most, n - 1)
    scale_state(U, w, h, m, scale)
    first_vector(V[0])
    H[:] = 0.0
    state = np.array([0.0, 0.0, -1.0, -2.0])
    used = 0
    for j in range(most):
        for i in range(n):
            x[i] = V[j, i] / scale[i]
        apply_map(x, y, ends, forces, cuts, free, push, U, h, m, q, v)
        for i in range(n):
            y[i] *= scale[i]
        norm = next_vector(V, H, j, y)
        used = j + 1
        if is_settled(H, j, norm, most, tol, room, state):
            break
        for i in range(n):
            V[j + 1, i] = y[i] / norm
    return state[0], state[1], used


@njit(cache=True, nogil=True)
def strongest_mode(H, V, used, best, angle, scale, m, modes):
    """The mode of greatest share in the vector of the greatest multiplier."""
    values, vectors = np.linalg.eig(H[:used, :used].astype(np.complex128))
    wanted = best * (math.cos(angle) + 1j * math.sin(angle))
    at = np.argmin(np.abs(values - wanted))
    share = np.zeros(modes)
    for k in range(modes):
        a = 0.0 + 0.0j
        b = 0.0 + 0.0j
        for j in range(used):
            a += V[j, 4 * m + k] * vectors[j, at]
            b += V[j, 4 * m + modes + k] * vectors[j, at]
        share[k] = abs(a) ** 2 + abs(b) ** 2
    return np.argmax(share)


@njit(cache=True, nogil=True)
def chatter_hz(angle, tau, w):
    """Frequency [Hz] (angle / 2 pi + j) / tau, either sign of the angle, nearest to a natural frequency [rad/s]."""
    best = 0.0
    off = 1e300
    f = w / TAU
    for sign in (-1.0, 1.0):
        share = sign * angle / TAU
        j = max(math.floor(f * tau - share + 0.5), 0.0)
        x = abs((share + j) / tau)
        if abs(x - f) < off:
            off = abs(x - f)
            best = x
    return best


@njit(cache=True, nogil=True)
def cut_motion(k, start, rows, damped, exponents, tau, pitch, w, z, U, per_wave):
    """Of cut k: cells m of a tooth period, their time h [s], ``matrices`` A (m, 3, 4) and of process damping C [N s/mm]
    (m, 3, 4), without cells where there is none; ``free_motion`` in a cell.
    """
    m = cells_of(tau[k], w, per_wave)
    h = tau[k] / m
    A = np.zeros((m, 3, 4))
    matrices(rows, start[k], start[k + 1], pitch[k], m, exponents, A)
    C = np.zeros((m if len(damped) else 0, 3, 4))
    if len(damped):
        matrices(damped, start[k], start[k + 1], pitch[k], m, np.zeros(3), C)
        C *= tau[k] / pitch[k]
    free = np.empty((4, len(w)))
    push = np.empty((3, 2, len(w)))
    end = np.empty((3, 4, 2))
    free_motion(w, z, U[k], h, free, push, end)
    return m, h, A, C, free, push, end


@njit(cache=True, nogil=True)
def workspace(m, modes, most, columns):
    """Arrays that ``cell_systems`` (3) and ``arnoldi`` (8) write; ``columns`` 8, or 16 with process damping."""
    n = 4 * m + 2 * modes
    room = min(most, n - 1) + 1
    return (
        np.empty((m, 4, columns)), np.empty((m, 6, columns)), np.empty(m, np.bool_), np.empty((room, n)),
        np.empty((room, room)), np.empty((room, room)), np.empty(n), np.empty(n), np.empty(modes), np.empty(modes),
        np.empty(n),
    )  # fmt: skip


@njit(
    "void(int64, int64, int64[::1], float64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1],"
    " float64[:,::1], float64[::1], float64[:,:,::1], float64[::1], float64, int64, float64, float64[:,::1])",
    cache=True, nogil=True,
)  # fmt: skip
def multipliers(first, last, start, rows, damped, exponents, tau, pitch, w, z, U, gain, per_wave, most, tol, out):
    """Of the cuts first .. last - 1: modulus and angle of the greatest multiplier, and its dimension: out (n, 3).

    ``start`` (n + 1,) of rows; ``damped`` (b, 11) rows of process damping at 1 rad/s, or none; ``tau`` [s], ``pitch``
    [rad], ``w`` (n, M), ``U`` (n, 2, M), ``gain`` on the force (n,).
    """
    modes = len(z)
    for k in range(first, last):
        m, h, A, C, free, push, end = cut_motion(k, start, rows, damped, exponents, tau, pitch, w[k], z, U, per_wave)
        ends, forces, cuts, V, H, work, x, y, q, v, scale = workspace(m, modes, most, 16 if len(C) else 8)
        cell_systems(A, C, gain[k], h, end, ends, forces, cuts)
        best, angle, used = arnoldi(
            ends, forces, cuts, free, push, U[k], w[k], h, m, most, tol, V, H, work, x, y, q, v, scale
        )
        out[k, 0] = best
        out[k, 1] = angle
        out[k, 2] = used


@njit(
    "void(int64, int64, int64[::1], float64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1],"
    " float64[:,::1], float64[::1], float64[:,:,::1], float64, int64, float64, float64[:,::1])",
    cache=True, nogil=True,
)  # fmt: skip
def margins(first, last, start, rows, damped, exponents, tau, pitch, w, z, U, per_wave, most, tol, out):
    """Of the cuts first .. last - 1: the factor on the force at which the greatest multiplier has the modulus 1, the
    frequency there [Hz], the mode from 0, log|mu| at the factor 1, and evaluations: out (n, 5).

    A stable cut is tested at the factors ``ABOVE``; if it is stable at all of them, the factor is the last one, the
    frequency 0 and the mode -1. The factor is -1 if the eigenvalues were not found.
    """
    modes = len(z)
    for k in range(first, last):
        m, h, A, C, free, push, end = cut_motion(k, start, rows, damped, exponents, tau, pitch, w[k], z, U, per_wave)
        ends, forces, cuts, V, H, work, x, y, q, v, scale = workspace(m, modes, most, 16 if len(C) else 8)
        count = 0
        lo, l_lo, hi, l_hi = 0.0, -1.0, 0.0, 0.0
        at_one = 0.0
        gain = 1.0
        look = 0
        found = False
        failed = False
        side = 0
        used = 0
        best = 0.0
        angle = 0.0
        while True:
            cell_systems(A, C, gain, h, end, ends, forces, cuts)
            best, angle, used = arnoldi(
                ends, forces, cuts, free, push, U[k], w[k], h, m, most, tol, V, H, work, x, y, q, v, scale
            )
            count += 1
            if not best >= 0.0:
                failed = True
                break
            value = math.log(max(best, TINY))
            if count == 1:
                at_one = value
            if not found:
                if value >= 0.0:
                    hi = gain
                    l_hi = value
                    if count > 1 and at_one < 0.0:
                        found = True
                    elif look == DOWN:
                        break
                    else:
                        gain *= BELOW
                        look += 1
                        continue
                else:
                    lo = gain
                    l_lo = value
                    if at_one >= 0.0:
                        found = True
                    elif look == len(ABOVE):
                        break
                    else:
                        gain = ABOVE[look]
                        look += 1
                        continue
                count_found = count
            else:
                if value >= 0.0:
                    hi = gain
                    l_hi = value
                    if side > 0:
                        l_lo *= 0.5
                    side = 1
                else:
                    lo = gain
                    l_lo = value
                    if side < 0:
                        l_hi *= 0.5
                    side = -1
                if abs(value) < CLOSE or hi - lo < 1e-6 * hi or count - count_found > CLOSING:
                    break
            gain = (lo * l_hi - hi * l_lo) / (l_hi - l_lo)
            if not lo < gain < hi:
                gain = 0.5 * (lo + hi)
        out[k, 3] = at_one
        out[k, 4] = count
        if failed:
            out[k, 0] = -1.0
            continue
        out[k, 0] = gain
        out[k, 1] = 0.0
        out[k, 2] = -1.0
        if found or at_one >= 0.0:
            mode = strongest_mode(H, V, used, best, angle, scale, m, modes)
            out[k, 2] = mode
            out[k, 1] = chatter_hz(angle, tau[k], w[k, mode])
