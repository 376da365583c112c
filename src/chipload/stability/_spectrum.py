"""Greatest eigenvalue of a real upper Hessenberg matrix, and the steps of Arnoldi that make it; arrays only.

Reference: [Martin1970], shifted QR of a real Hessenberg matrix (EISPACK hqr); LAPACK's call with vectors takes longer
than the map itself. Oracle: numpy.linalg.eigvals.
"""

from __future__ import annotations

import math

from numba import njit

#: iterations for one eigenvalue at most
MOST = 60
SMALL = 1e-15


@njit(cache=True, nogil=True)
def _sweep(a, low, last, x, y, w):
    """One double step of QR on rows low .. last."""
    m = last - 2
    p = 0.0
    q = 0.0
    r = 0.0
    while m >= low:
        z = a[m, m]
        r = x - z
        s = y - z
        p = (r * s - w) / a[m + 1, m] + a[m, m + 1]
        q = a[m + 1, m + 1] - z - r - s
        r = a[m + 2, m + 1]
        s = abs(p) + abs(q) + abs(r)
        p /= s
        q /= s
        r /= s
        if m == low:
            break
        u = abs(a[m, m - 1]) * (abs(q) + abs(r))
        v = abs(p) * (abs(a[m - 1, m - 1]) + abs(z) + abs(a[m + 1, m + 1]))
        if u <= SMALL * v:
            break
        m -= 1
    for i in range(m + 2, last + 1):
        a[i, i - 2] = 0.0
        if i != m + 2:
            a[i, i - 3] = 0.0
    for k in range(m, last):
        third = k != last - 1
        if k != m:
            p = a[k, k - 1]
            q = a[k + 1, k - 1]
            r = a[k + 2, k - 1] if third else 0.0
            x = abs(p) + abs(q) + abs(r)
            if x != 0.0:
                p /= x
                q /= x
                r /= x
        s = math.sqrt(p * p + q * q + r * r)
        if p < 0.0:
            s = -s
        if s == 0.0:
            continue
        if k != m:
            a[k, k - 1] = -s * x
        elif low != m:
            a[k, k - 1] = -a[k, k - 1]
        p += s
        x = p / s
        y = q / s
        z = r / s
        q /= p
        r /= p
        for j in range(k, last + 1):
            p = a[k, j] + q * a[k + 1, j]
            if third:
                p += r * a[k + 2, j]
                a[k + 2, j] -= p * z
            a[k + 1, j] -= p * y
            a[k, j] -= p * x
        for i in range(low, min(last, k + 3) + 1):
            p = x * a[i, k] + y * a[i, k + 1]
            if third:
                p += z * a[i, k + 2]
                a[i, k + 2] -= p * r
            a[i, k + 1] -= p * q
            a[i, k] -= p


@njit("UniTuple(float64, 2)(float64[:,::1], int64, float64[:,::1])", cache=True, nogil=True)
def greatest(matrix, n, a):
    """Modulus and angle (0 .. pi) of the eigenvalue of greatest modulus of ``matrix[:n, :n]``; modulus -1 where it was
    not found. ``a`` (n, n) or larger is room to work in.
    """
    norm = 0.0
    for i in range(n):
        for j in range(n):
            a[i, j] = matrix[i, j]
            norm += abs(matrix[i, j]) if j >= i - 1 else 0.0
    if norm == 0.0:
        return 0.0, 0.0
    best = 0.0
    angle = 0.0
    last = n - 1
    shift = 0.0
    while last >= 0:
        tries = 0
        while True:
            low = last
            while low >= 1:
                s = abs(a[low - 1, low - 1]) + abs(a[low, low])
                if abs(a[low, low - 1]) <= SMALL * (s if s != 0.0 else norm):
                    a[low, low - 1] = 0.0
                    break
                low -= 1
            x = a[last, last]
            if low == last:
                root = x + shift
                if abs(root) > best:
                    best = abs(root)
                    angle = 0.0 if root > 0.0 else math.pi
                last -= 1
                break
            y = a[last - 1, last - 1]
            w = a[last, last - 1] * a[last - 1, last]
            if low == last - 1:
                p = 0.5 * (y - x)
                q = p * p + w
                z = math.sqrt(abs(q))
                x += shift
                if q >= 0.0:
                    z = p + (z if p >= 0.0 else -z)
                    for root in (x + z, x + z if z == 0.0 else x - w / z):
                        if abs(root) > best:
                            best = abs(root)
                            angle = 0.0 if root > 0.0 else math.pi
                elif math.hypot(x + p, z) > best:
                    best = math.hypot(x + p, z)
                    angle = abs(math.atan2(z, x + p))
                last -= 2
                break
            if tries == MOST:
                return -1.0, 0.0
            if tries > 0 and tries % 10 == 0:
                shift += x
                for i in range(last + 1):
                    a[i, i] -= x
                s = abs(a[last, last - 1]) + abs(a[last - 1, last - 2])
                x = 0.75 * s
                y = x
                w = -0.4375 * s * s
            tries += 1
            _sweep(a, low, last, x, y, w)
    return best, angle


@njit(cache=True, nogil=True, fastmath=True)
def first_vector(v):
    """A unit vector that is always the same."""
    seed = 12345.0
    norm = 0.0
    for i in range(len(v)):
        seed = (seed * 16807.0) % 2147483647.0
        v[i] = seed / 2147483647.0 - 0.5
        norm += v[i] ** 2
    norm = math.sqrt(norm)
    for i in range(len(v)):
        v[i] /= norm


@njit(cache=True, nogil=True, fastmath=True)
def next_vector(V, H, j, y):
    """Make y orthogonal to the rows 0 .. j of V, twice; what is taken goes into H, the norm of the rest is returned."""
    n = V.shape[1]
    for _ in range(2):
        for row in range(j + 1):
            dot = 0.0
            for i in range(n):
                dot += V[row, i] * y[i]
            H[row, j] += dot
            for i in range(n):
                y[i] -= dot * V[row, i]
    norm = 0.0
    for i in range(n):
        norm += y[i] * y[i]
    norm = math.sqrt(norm)
    H[j + 1, j] = norm
    return norm


@njit(cache=True, nogil=True)
def is_settled(H, j, norm, most, tol, room, state):
    """Whether the greatest multiplier after j + 1 dimensions is the one that is kept. ``state``: modulus and angle, and
    the modulus one and two dimensions before.
    """
    last = j == most - 1 or norm < 1e-12
    if last or j >= 3:
        state[0], state[1] = greatest(H, j + 1, room)
        moved = abs(state[0] - state[2]) + abs(state[2] - state[3])
        if last or (j >= 5 and moved < tol * max(state[0], 0.1)):
            return True
        state[3] = state[2]
        state[2] = state[0]
    return False
