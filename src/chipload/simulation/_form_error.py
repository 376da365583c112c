"""Compiled loops of the form error; arrays and scalars only.

Notation as in :mod:`chipload.simulation.deflection`: q point of the surface, n its normal, p tip, A axis, d distance
from q to the cutter, (rho, z) its foot on the profile, s the length along it; theta rotation of tooth 0 at the tip. A
``shape`` is (r, e, f, alpha, beta, h, rho where the bottom line ends, E, F, R of the flank arc of a barrel (0: none),
kappa where the corner ends, and where that arc ends below h), a bar (length, 1 / (E I), c_ff, c_mm, c_fm), a
row of ``steps`` (p0, p1, a0, a1), 12 numbers; engagement ranges and slices as in :mod:`chipload.cutting._tooth_force`.
Oracles: closed forms, the wall of :mod:`chipload.cutting.wall_error` and sums over slices in tests/simulation.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.cutting._strength import NODES, PIECE, WEIGHTS, edge_at, points_of
from chipload.cutting._tooth_force import BESIDE, TAU, engaged_part, first_turn

GOLDEN = 0.6180339887498949
#: steps of the golden-section search: the bracket shrinks to 1e-6 of the step, the error of the distance to 1e-12
STEPS = 29


@njit(cache=True, nogil=True)
def foot(rho, z, shape, out):
    """Distance d [mm] of a point at (rho, z) from the profile, negative inside: ``out`` (5,) = d, s, z of the foot, sin
    and cos of kappa.

    On a sharp corner kappa is that of the direction to the point. Sine and cosine are 0 if the foot is the upper end of
    the flutes.
    """
    r, e, f, alpha, beta, h, end, E, F, R, first, last = shape
    sa, ca = math.sin(alpha), math.cos(alpha)
    sb, cb = math.sin(beta), math.cos(beta)
    low = f - r * ca
    turn = f - r * math.cos(first)
    high, wide = f - r * sb, e + r * cb
    if R > 0.0:
        high, wide = F - R * sb, E + R * cb
    inside = z >= 0.0 and z <= h
    if inside:
        if z < low:
            inside = sa > 0.0 and rho * sa <= z * ca
        elif z < turn:
            inside = rho <= e + math.sqrt(max(r * r - (f - z) ** 2, 0.0))
        elif z < high:
            inside = rho <= E + math.sqrt(max(R * R - (F - z) ** 2, 0.0))
        else:
            inside = rho <= wide + (z - high) * sb / cb
    best = math.inf
    if end > 0.0:  # bottom line
        t = min(max(rho * ca + z * sa, 0.0), end / ca)
        best = math.hypot(rho - t * ca, z - t * sa)
        out[1] = t - end / ca
        out[2] = t * sa
        out[3], out[4] = sa, ca
        if t == end / ca and r == 0.0 and best > 0.0:
            out[3], out[4] = (rho - end) / best, -(z - low) / best
    if r > 0.0:
        kappa = math.atan2(rho - e, f - z)
        if alpha <= kappa <= first:
            d = abs(math.hypot(rho - e, f - z) - r)
            if d < best:
                best = d
                out[1] = r * (kappa - alpha)
                out[2] = f - r * math.cos(kappa)
                out[3], out[4] = math.sin(kappa), math.cos(kappa)
    reach = r * (first - alpha)
    if R > 0.0:
        kappa = min(max(math.atan2(rho - E, F - z), first), last)
        d = math.hypot(rho - E - R * math.sin(kappa), z - F + R * math.cos(kappa))
        if d < best:
            best = d
            out[1] = reach + R * (kappa - first)
            out[2] = F - R * math.cos(kappa)
            out[3], out[4] = math.sin(kappa), math.cos(kappa)
            if kappa == last and out[2] >= h and d > 0.0:
                out[3], out[4] = 0.0, 0.0
        reach += R * (last - first)
    top = (h - high) / cb
    if top > 0.0:
        t = min(max((rho - wide) * sb + (z - high) * cb, 0.0), top)
        d = math.hypot(rho - wide - t * sb, z - high - t * cb)
        if d < best:
            best = d
            out[1] = reach + t
            out[2] = high + t * cb
            out[3], out[4] = cb, sb
            if t == top and d > 0.0:
                out[3], out[4] = 0.0, 0.0
    out[0] = -best if inside else best


@njit(cache=True, nogil=True)
def foot_at(q, row, t, shape, frame, out):
    """:func:`foot` of q with the cutter at the share t of the step.

    ``frame`` (9,) receives the tip, the axis and the unit vector from the axis to q.
    """
    size = 0.0
    for c in range(3):
        frame[c] = row[c] + t * (row[3 + c] - row[c])
        frame[3 + c] = row[6 + c] + t * (row[9 + c] - row[6 + c])
        size += frame[3 + c] ** 2
    size = math.sqrt(size)
    z = 0.0
    for c in range(3):
        frame[3 + c] /= size
        z += (q[c] - frame[c]) * frame[3 + c]
    rho = 0.0
    for c in range(3):
        frame[6 + c] = q[c] - frame[c] - z * frame[3 + c]
        rho += frame[6 + c] ** 2
    rho = math.sqrt(rho)
    for c in range(3):
        frame[6 + c] = frame[6 + c] / rho if rho > 0.0 else 0.0
    foot(rho, z, shape, out)


@njit(cache=True, nogil=True)
def nearest(q, n, row, shape, most, facing, frame, out):
    """Share of the step at which the cutter is nearest to q; -1 if it stays farther than ``most`` [mm] or does not face
    the surface there.

    The cutter faces the surface if the cosine of the angle between its normal and -n is at least ``facing``. Fills
    ``frame`` and ``out``, as :func:`foot_at`, for that moment.
    """
    foot_at(q, row, 0.5, shape, frame, out)
    travel = 0.0
    turn = 0.0
    for c in range(3):
        travel += (row[3 + c] - row[c]) ** 2
        turn += (row[9 + c] - row[6 + c]) ** 2
    travel = math.sqrt(travel)
    if out[0] - 0.5 * (travel + math.sqrt(turn) * (shape[5] + most)) > most:
        return -1.0
    a, b = 0.0, 1.0
    x, y = b - GOLDEN, a + GOLDEN
    foot_at(q, row, x, shape, frame, out)
    dx = out[0]
    foot_at(q, row, y, shape, frame, out)
    dy = out[0]
    for _ in range(STEPS):
        if dx <= dy:
            b, y, dy = y, x, dx
            x = b - GOLDEN * (b - a)
            foot_at(q, row, x, shape, frame, out)
            dx = out[0]
        else:
            a, x, dx = x, y, dy
            y = a + GOLDEN * (b - a)
            foot_at(q, row, y, shape, frame, out)
            dy = out[0]
    t = 0.5 * (a + b)
    foot_at(q, row, t, shape, frame, out)
    if out[0] > most:
        return -1.0
    towards = 0.0
    for c in range(3):
        towards -= (out[3] * frame[6 + c] - out[4] * frame[3 + c]) * n[c]
    return t if towards >= facing else -1.0


@njit(cache=True, nogil=True)
def least_distances(points, normals, steps, shape, most, facing, out):
    """Lower ``out`` (p,) [mm] to the least distance of each point from the cutter over all steps, if below ``most``."""
    frame, foot_values = np.empty(9), np.empty(5)
    for p in range(len(points)):
        best = out[p]
        for k in range(len(steps)):
            if nearest(points[p], normals[p], steps[k], shape, min(best, most), facing, frame, foot_values) >= 0.0:
                best = min(best, foot_values[0])
        out[p] = best


@njit(cache=True, nogil=True)
def contacts(points, normals, steps, shape, most, facing, owner, moment):
    """Pairs of point and step no farther apart than ``most`` (p,) [mm]; their number.

    ``owner`` (m, 2) point and step, ``moment`` (m, 14) = d, s, z, sin and cos of kappa, tip, axis, direction to q. If
    there are more than m pairs, only the first m are written.
    """
    frame, foot_values = np.empty(9), np.empty(5)
    m = 0
    for p in range(len(points)):
        for k in range(len(steps)):
            if nearest(points[p], normals[p], steps[k], shape, most[p], facing, frame, foot_values) < 0.0:
                continue
            if m < len(owner):
                owner[m, 0], owner[m, 1] = p, k
                moment[m, :5] = foot_values
                moment[m, 5:] = frame
            m += 1
    return m


@njit(cache=True, nogil=True)
def nearest_engaged(s, phi, rows, tooth, piece, slices, lo, hi, j, reach):
    """Immersion phi [rad] moved just inside the nearest engagement range of tooth j at s, and whether an end of a range
    is within ``reach`` [mm] along the circle of its slice.
    """
    best = reach
    out = phi
    reached = False
    for r in range(lo, hi):
        if not rows[r, 2] - 1e-9 <= s <= rows[r, 3] + 1e-9 or (tooth[r] >= 0 and tooth[r] != j):
            continue
        p, q = rows[r, 0], rows[r, 1]
        x = p + (phi - p) % TAU
        if x <= q:
            inner = min(x - p, q - x)
            off = 0.0
        elif x - q <= p + TAU - x:
            off = inner = x - q
            x = q
        else:
            off = inner = p + TAU - x
            x = p
        rho = slices[piece[r], 1]
        reached = reached or inner * rho <= reach
        if off * rho <= best:
            best = off * rho
            margin = min(BESIDE, 0.5 * (q - p))
            out = min(max(x, p + margin), q - margin)
    return out, reached


@njit(cache=True, nogil=True)
def chain_compliance(za, zb, bars):
    """Deflection [mm/N] at height zb under a unit force at za, as of ``chipload.structure.spindle``."""
    top = max(za, zb)
    c = top - min(za, zb)
    end = 0.0
    total = 0.0
    for i in range(len(bars)):
        low = max(end - top, 0.0)
        end += bars[i, 0]
        high = max(end - top, 0.0)
        total += bars[i, 1] * ((high**3 - low**3) / 3.0 + c * (high**2 - low**2) / 2.0)
        if end >= top:
            total += bars[i, 2] + bars[i, 4] * (2.0 * end - za - zb) + bars[i, 3] * (end - za) * (end - zb)
    return total


@njit(cache=True, nogil=True)
def load_of_teeth(theta, z, rows, tooth, piece, slices, lo, hi, teeth, c, bars, out):
    """Load of all teeth at the rotation theta: ``out`` (5,) = force on the cutter along T, n, A [N], displacement of
    the cutter at height z along T, n [mm].

    Gauss quadrature over pieces of at most ``PIECE`` of immersion, divided at z; the number of points depends on their
    immersion.
    """
    out[:] = 0.0
    linear = c[6] == 0.0 and c[7] == 0.0 and c[8] == 0.0
    for r in range(lo, hi):
        p = rows[r, 0]
        q = rows[r, 1]
        k = piece[r]
        rate = slices[k, 6]
        base = slices[k, 5] - rate * slices[k, 0]
        first = base + rate * rows[r, 2]
        last = base + rate * rows[r, 3]
        single = tooth[r] >= 0
        for i in range(1 if single else teeth):
            j = tooth[r] if single else i
            turn = first_turn(theta, j, teeth, p, first)
            while turn - last <= q:
                s1, s2 = engaged_part(turn, base, rate, p, q, rows[r, 2], rows[r, 3])
                sine = slices[k, 3]
                split = slices[k, 0] + (z - slices[k, 2]) / sine if sine > 0.0 else s1
                for side in range(2):
                    b1 = s1 if side == 0 else max(s1, split)
                    b2 = min(s2, split) if side == 0 else s2
                    if b2 <= b1:
                        continue
                    parts = max(math.ceil(rate * (b2 - b1) / PIECE), 1)
                    h = (b2 - b1) / parts
                    points = points_of(rate * h)
                    for part in range(parts):
                        for g in range(points):
                            s = b1 + h * (part + 0.5 + 0.5 * NODES[points, g])
                            phi = turn - base - rate * s
                            t, n, a, _ = edge_at(phi, linear, rows[r, 4], rows[r, 5], rows[r, 6], sine, slices[k, 4], c)
                            w = 0.5 * h * WEIGHTS[points, g]
                            out[0] += w * t
                            out[1] += w * n
                            out[2] += w * a
                            if len(bars):
                                flex = w * chain_compliance(slices[k, 2] + sine * (s - slices[k, 0]), z, bars)
                                out[3] += flex * t
                                out[4] += flex * n
                turn += TAU


@njit(cache=True, nogil=True)
def loads_of_teeth(step, theta, z, start, rows, tooth, piece, slices, teeth, c, bars, out):
    """:func:`load_of_teeth` of many moments (m,): ``out`` (m, 5)."""
    for m in range(len(step)):
        i = step[m]
        load_of_teeth(theta[m], z[m], rows, tooth, piece, slices, start[i], start[i + 1], teeth, c, bars, out[m])


@njit(cache=True, nogil=True)
def nearest_engaged_many(step, s, phi, start, rows, tooth, piece, slices, j, reach, out, made):
    """:func:`nearest_engaged` of many moments (m,), for tooth j."""
    for m in range(len(step)):
        i = step[m]
        out[m], made[m] = nearest_engaged(s[m], phi[m], rows, tooth, piece, slices, start[i], start[i + 1], j, reach)
