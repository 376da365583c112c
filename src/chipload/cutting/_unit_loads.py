"""Compiled loops of loads for 1 of each coefficient where the law of the material is linear; arrays and scalars only.

Notation as in ``_tooth_force.py``; the columns of a basis (4, 6) are those of (Ktc, Krc, Kac, Kte, Kre,
Kae), its rows the force along T, n and the axis and the torque. All six come from the same integrals of 1, sin, cos and
their products over the immersion.
Oracle: :func:`chipload.cutting._tooth_force.load` with one coefficient at a time, in tests/cutting.
"""

from __future__ import annotations

import math

from numba import njit, types

TAU = 2.0 * math.pi
#: lag over an engagement range below which an edge counts as straight [rad]
STRAIGHT = 1e-5

_RI = types.Array(types.int64, 1, "C", readonly=True)
_R1 = types.Array(types.float64, 1, "C", readonly=True)
_R2 = types.Array(types.float64, 2, "C", readonly=True)
_F3 = types.float64[:, :, ::1]


@njit(cache=True, nogil=True)
def add(out, i, d, s, c, ss, sc, cc, along, offset, across, sine, cosine, arm):
    """Add an engagement range to ``out[i]`` (4, 6), from its integrals of 1, sin, cos, sin^2, sin cos, cos^2."""
    h = along * s + across * c + offset * d
    hs = along * ss + across * sc + offset * s
    hc = along * sc + across * cc + offset * c
    out[i, 0, 0] -= hc
    out[i, 1, 0] += hs
    out[i, 3, 0] += arm * h
    out[i, 0, 1] -= sine * hs
    out[i, 1, 1] -= sine * hc
    out[i, 2, 1] += cosine * h
    out[i, 0, 2] -= cosine * hs
    out[i, 1, 2] -= cosine * hc
    out[i, 2, 2] -= sine * h
    out[i, 0, 3] -= c
    out[i, 1, 3] += s
    out[i, 3, 3] += arm * d
    out[i, 0, 4] -= sine * s
    out[i, 1, 4] -= sine * c
    out[i, 2, 4] += cosine * d
    out[i, 0, 5] -= cosine * s
    out[i, 1, 5] -= cosine * c
    out[i, 2, 5] -= sine * d


@njit(cache=True, nogil=True)
def add_range(out, i, low, high, weight, along, offset, across, sine, cosine, arm):
    """:func:`add` of the immersion low .. high, times ``weight``."""
    s0 = math.sin(low)
    c0 = math.cos(low)
    s1 = math.sin(high)
    c1 = math.cos(high)
    d = high - low
    product = 0.5 * (s1 * c1 - s0 * c0)
    add(
        out, i, weight * d, weight * (c0 - c1), weight * (s1 - s0), weight * (0.5 * d - product),
        0.5 * weight * (s1 * s1 - s0 * s0), weight * (0.5 * d + product), along, offset, across, sine, cosine, arm,
    )  # fmt: skip


@njit(types.void(_RI, _R2, _RI, _RI, _R2, types.int64, _F3), cache=True, nogil=True)
def mean_bases(start, rows, tooth, piece, slices, teeth, out):
    """Means over a revolution: out (n, 4, 6), which is 0 before."""
    for i in range(len(start) - 1):
        for r in range(start[i], start[i + 1]):
            k = piece[r]
            weight = (rows[r, 3] - rows[r, 2]) * (1.0 if tooth[r] >= 0 else teeth) / TAU
            add_range(
                out, i, rows[r, 0], rows[r, 1], weight, rows[r, 4], rows[r, 5], rows[r, 6], slices[k, 3],
                slices[k, 4], slices[k, 1],
            )  # fmt: skip


@njit(types.void(_RI, _R2, _RI, _RI, _R2, _R1, types.int64, _F3), cache=True, nogil=True)
def bases_at(start, rows, tooth, piece, slices, theta, teeth, out):
    """At a rotation of its own of each step: out (n, 4, 6), which is 0 before."""
    for i in range(len(start) - 1):
        for r in range(start[i], start[i + 1]):
            k = piece[r]
            p = rows[r, 0]
            q = rows[r, 1]
            rate = slices[k, 6]
            size = rows[r, 3] - rows[r, 2]
            lag = slices[k, 5] + rate * (rows[r, 2] - slices[k, 0])
            one = tooth[r] >= 0
            for j in range(1 if one else teeth):
                turn = theta[i] - lag - TAU * (tooth[r] if one else j) / teeth
                turn += TAU * math.ceil((p - turn) / TAU)
                while turn - rate * size <= q:
                    if rate * size < STRAIGHT:
                        phi = turn - 0.5 * rate * size
                        s = math.sin(phi)
                        c = math.cos(phi)
                        add(
                            out, i, size, size * s, size * c, size * s * s, size * s * c, size * c * c, rows[r, 4],
                            rows[r, 5], rows[r, 6], slices[k, 3], slices[k, 4], slices[k, 1],
                        )  # fmt: skip
                    else:
                        add_range(
                            out, i, max(turn - rate * size, p), min(turn, q), 1.0 / rate, rows[r, 4], rows[r, 5],
                            rows[r, 6], slices[k, 3], slices[k, 4], slices[k, 1],
                        )  # fmt: skip
                    turn += TAU
