"""The map of a revolution with one delay a tooth; arrays and scalars only. Notation as in
:mod:`chipload.stability._kernels`. Oracle: even pitches, where it is a power of the map of one tooth.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.stability._kernels import (
    HERMITE,
    first_vector,
    free_motion,
    next_vector,
    scaled,
    settled,
    solve4,
    strongest_mode,
)
from chipload.stability.directional._kernels import matrices

TAU = 2.0 * math.pi


@njit(cache=True, nogil=True)
def between(a, b, t, out):
    """(r, h r') at the share t of a cell from its two ends."""
    for k in range(2):
        out[k] = (2 * t**3 - 3 * t**2 + 1) * a[k] + (t**3 - 2 * t**2 + t) * a[k + 2]
        out[k] += (3 * t**2 - 2 * t**3) * b[k] + (t**3 - t**2) * b[k + 2]
        out[k + 2] = 6 * (t**2 - t) * a[k] + (3 * t**2 - 4 * t + 1) * a[k + 2]
        out[k + 2] += 6 * (t - t**2) * b[k] + (3 * t**2 - 2 * t) * b[k + 2]


@njit(cache=True, nogil=True)
def forces_of_waves(A, delay, i, nodes, history, first, last, known, slope):
    """Force in cell i at the three points of integration: what is ``known`` (3, 2), and its ``slope`` (3, 2, 4) over
    the state at the end of the cell. ``first``, ``last`` (4,) are room to work.
    """
    now = history[nodes + i]
    known[:] = 0.0
    slope[:] = 0.0
    for j in range(len(A)):
        cuts = False
        for g in range(3):
            for c in range(4):
                cuts = cuts or A[j, i, g, c] != 0.0
        if not cuts:
            continue
        for which in range(2):
            at = nodes + i + which - delay[j]
            k = math.floor(at + 1e-9)
            share = at - k
            to = first if which == 0 else last
            if share < 1e-9:
                to[:] = history[k]
            else:
                between(history[k], history[k + 1], share, to)
        for g in range(3):
            for a in range(2):
                for b in range(2):
                    x = A[j, i, g, 2 * a + b]
                    known[g, a] += x * (
                        HERMITE[g, 0] * (now[b] - first[b])
                        + HERMITE[g, 1] * (now[2 + b] - first[2 + b])
                        - HERMITE[g, 2] * last[b]
                        - HERMITE[g, 3] * last[2 + b]
                    )
                    slope[g, a, b] += HERMITE[g, 2] * x
                    slope[g, a, 2 + b] += HERMITE[g, 3] * x


@njit(cache=True, nogil=True)
def turned(x, A, delay, nodes, U, free, push, end, h, history, y):
    """The state y a revolution after the state x: (r, h r') at the nodes of the longest delay, q, q'.

    ``A`` (teeth, cells, 3, 4), ``delay`` (teeth,) in cells, ``history`` (nodes + cells + 1, 4) is room to work in.
    """
    cells = A.shape[1]
    modes = U.shape[1]
    first = np.empty(4)
    last = np.empty(4)
    B = np.empty((4, 4))
    new = np.empty((4, 1))
    known = np.empty((3, 2))
    slope = np.empty((3, 2, 4))
    q = x[4 * nodes : 4 * nodes + modes].copy()
    v = x[4 * nodes + modes :].copy()
    for i in range(nodes):
        for c in range(4):
            history[i, c] = x[4 * i + c]
    history[nodes] = 0.0
    for a in range(2):
        for k in range(modes):
            history[nodes, a] += U[a, k] * q[k]
            history[nodes, 2 + a] += h * U[a, k] * v[k]
    for i in range(cells):
        new[:] = 0.0
        for k in range(modes):
            a = free[0, k] * q[k] + free[1, k] * v[k]
            b = free[2, k] * q[k] + free[3, k] * v[k]
            q[k] = a
            v[k] = b
            for c in range(2):
                new[c, 0] += U[c, k] * a
                new[2 + c, 0] += h * U[c, k] * b
        B[:] = 0.0
        for r in range(4):
            B[r, r] = 1.0
        forces_of_waves(A, delay, i, nodes, history, first, last, known, slope)
        for g in range(3):
            for r in range(4):
                for a in range(2):
                    new[r, 0] += end[g, r, a] * known[g, a]
                    for c in range(4):
                        B[r, c] -= end[g, r, a] * slope[g, a, c]
        solve4(B, new, 1)
        for g in range(3):
            fx = known[g, 0]
            fy = known[g, 1]
            for c in range(4):
                fx += slope[g, 0, c] * new[c, 0]
                fy += slope[g, 1, c] * new[c, 0]
            for k in range(modes):
                f = U[0, k] * fx + U[1, k] * fy
                q[k] += push[g, 0, k] * f
                v[k] += push[g, 1, k] * f
        history[nodes + i + 1] = new[:, 0]
    for i in range(nodes):
        for c in range(4):
            y[4 * i + c] = history[cells + i, c]
    for k in range(modes):
        y[4 * nodes + k] = q[k]
        y[4 * nodes + modes + k] = v[k]


@njit(
    "void(int64, int64, int64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[:,::1],"
    " float64[::1], float64[:,:,::1], float64[::1], float64, int64, float64, float64[:,::1])",
    cache=True, nogil=True,
)  # fmt: skip
def multipliers(first, last, start, rows, exponents, turn, pitch, w, z, U, gain, per_wave, most, tol, out):
    """Of the cuts first .. last - 1: modulus and angle of the greatest multiplier of a revolution, its dimension, and
    the mode of greatest share in its vector: out (n, 4).

    ``turn`` (n,) [s] of a revolution, ``pitch`` (teeth,) [rad] of each tooth to the one before it; the others as of
    :func:`chipload.stability._kernels.multipliers`.
    """
    modes = len(z)
    teeth = len(pitch)
    even = TAU / teeth
    for k in range(first, last):
        cells = max(12 * teeth, math.ceil(per_wave * w[k].max() * turn[k] / TAU))
        h = turn[k] / cells
        A = np.zeros((teeth, cells, 3, 4))
        behind = 0.0
        for j in range(teeth):
            behind += pitch[j] if j > 0 else 0.0
            own = rows[start[k] : start[k + 1]].copy()
            own[:, 2:4] += behind
            own[:, 8:11] *= pitch[j] / even
            matrices(own, 0, len(own), TAU, cells, exponents, A[j])
        A *= gain[k]
        free, push, end = np.empty((4, modes)), np.empty((3, 2, modes)), np.empty((3, 4, 2))
        free_motion(w[k], z, U[k], h, free, push, end)
        delay = pitch / TAU * cells
        nodes = math.ceil(delay.max() - 1e-9)
        n = 4 * nodes + 2 * modes
        dimension = min(most, n - 1)
        V, H = np.empty((dimension + 1, n)), np.zeros((dimension + 1, dimension + 1))
        room = np.empty((dimension + 1, dimension + 1))
        history, scale, y = np.empty((nodes + cells + 1, 4)), np.empty(n), np.empty(n)
        scaled(U[k], w[k], h, nodes, scale)
        first_vector(V[0])
        state = np.array([0.0, 0.0, -1.0, -2.0])
        used = 0
        for j in range(dimension):
            turned(V[j] / scale, A, delay, nodes, U[k], free, push, end, h, history, y)
            y *= scale
            norm = next_vector(V, H, j, y)
            used = j + 1
            if settled(H, j, norm, dimension, tol, room, state):
                break
            V[j + 1] = y / norm
        out[k, 0] = state[0]
        out[k, 1] = state[1]
        out[k, 2] = used
        out[k, 3] = strongest_mode(H, V, used, state[0], state[1], scale, nodes, modes)
