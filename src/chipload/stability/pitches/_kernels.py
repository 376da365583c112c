"""The map of a revolution with one delay a tooth; arrays and scalars only. Notation as in
:mod:`chipload.stability._kernels`. Oracle: even pitches, where it is a power of the map of one tooth.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.stability._kernels import HERMITE


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
def begin(column, nodes, U, h, history, q, v):
    """The unit state of a column: history, modal displacement q and velocity v."""
    modes = U.shape[1]
    history[:] = 0.0
    q[:] = 0.0
    v[:] = 0.0
    if column < 4 * nodes:
        history[column // 4, column % 4] = 1.0
    elif column < 4 * nodes + modes:
        q[column - 4 * nodes] = 1.0
    else:
        v[column - 4 * nodes - modes] = 1.0
    for a in range(2):
        for k in range(modes):
            history[nodes, a] += U[a, k] * q[k]
            history[nodes, 2 + a] += h * U[a, k] * v[k]


@njit(
    "void(float64[:,:,:,::1], float64[::1], int64, float64[:,::1], float64[:,::1], float64[:,:,::1], float64[:,:,::1],"
    " float64, float64[:,::1])",
    cache=True, nogil=True,
)  # fmt: skip
def revolution(A, delay, nodes, U, free, push, end, h, out):
    """The map of a revolution, column by column: out (4 nodes + 2 M, 4 nodes + 2 M).

    ``A`` (teeth, cells, 3, 4), ``delay`` (teeth,) in cells, ``nodes`` of the history.
    """
    cells = A.shape[1]
    modes = U.shape[1]
    n = len(out)
    history = np.empty((nodes + cells + 1, 4))
    first = np.empty(4)
    last = np.empty(4)
    B = np.empty((4, 4))
    right = np.empty(4)
    known = np.empty((3, 2))
    slope = np.empty((3, 2, 4))
    q = np.empty(modes)
    v = np.empty(modes)
    for column in range(n):
        begin(column, nodes, U, h, history, q, v)
        for i in range(cells):
            right[:] = 0.0
            for k in range(modes):
                a = free[0, k] * q[k] + free[1, k] * v[k]
                b = free[2, k] * q[k] + free[3, k] * v[k]
                q[k] = a
                v[k] = b
                for c in range(2):
                    right[c] += U[c, k] * a
                    right[2 + c] += h * U[c, k] * b
            B[:] = 0.0
            for r in range(4):
                B[r, r] = 1.0
            forces_of_waves(A, delay, i, nodes, history, first, last, known, slope)
            for g in range(3):
                for r in range(4):
                    for a in range(2):
                        right[r] += end[g, r, a] * known[g, a]
                        for c in range(4):
                            B[r, c] -= end[g, r, a] * slope[g, a, c]
            new = np.linalg.solve(B, right)
            for g in range(3):
                x = known[g, 0]
                y = known[g, 1]
                for c in range(4):
                    x += slope[g, 0, c] * new[c]
                    y += slope[g, 1, c] * new[c]
                for k in range(modes):
                    f = U[0, k] * x + U[1, k] * y
                    q[k] += push[g, 0, k] * f
                    v[k] += push[g, 1, k] * f
            history[nodes + i + 1] = new
        for i in range(nodes):
            for c in range(4):
                out[4 * i + c, column] = history[cells + i, c]
        for k in range(modes):
            out[4 * nodes + k, column] = q[k]
            out[4 * nodes + modes + k, column] = v[k]
