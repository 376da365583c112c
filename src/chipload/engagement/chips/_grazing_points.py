"""Compiled loops that find the grazing points of a section: where V changes sign around it.

Notation: arrays ``S``, ``C``, ``K`` and rows as in :mod:`chipload.engagement.chips._section`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.engagement.chips._section import TAU, on_circle, point, point_at, speed

CORNER = 5  # a root at a corner of the section
NODES = 32
MAX_ROOTS = 16
_COS = np.cos(np.arange(NODES) * (TAU / NODES))
_SIN = np.sin(np.arange(NODES) * (TAU / NODES))


#: types are stated: a constant among the arguments would else be compiled as a type of its own
_R1 = types.Array(types.float64, 1, "C", readonly=True)
_F1, _F2 = types.float64[::1], types.float64[:, ::1]


@njit(types.boolean(_F1, types.float64, types.int64, _F1), cache=True, nogil=True)
def _newton(S, guess, sign, row):
    """The grazing point of an ellipse near ``guess`` by Newton's method, theta into ``row[2]``; False if it fails."""
    theta = guess
    bx, by = S[22] * S[3] / S[5], S[22] * S[4] / S[5]
    for _ in range(8):
        ct, st = math.cos(theta), math.sin(theta)
        b, m = bx * ct + by * st, S[25] * ct + S[26] * st
        v = S[23] * ct + S[24] * st + b * m
        dv = S[24] * ct - S[23] * st + (by * ct - bx * st) * m + b * (S[26] * ct - S[25] * st)
        if dv * sign <= 0.0:
            return False
        step = v / dv
        theta -= step
        if abs(theta - guess) > 0.5:
            return False
        if abs(step) < 1e-9:
            row[2] = theta
            return True
    return False


@njit(types.boolean(_F1, types.int64, _F1), cache=True, nogil=True)
def _graze(S, sign, row):
    """The grazing point of this sign of a ball's circle into ``row``, V = 0 in closed form; False if there is none."""
    size2 = S[23] * S[23] + S[24] * S[24]
    rest = size2 - S[25] * S[25]
    if not rest > 0.0:
        return False
    along, across = -S[25] / size2, sign * math.sqrt(rest) / size2
    ux = along * S[23] + across * S[24]
    uy = along * S[24] - across * S[23]
    k = (S[3] * ux + S[4] * uy) / (1.0 + S[5])
    on_circle(S, ux, uy, math.atan2(uy - k * S[4], ux - k * S[3]) % TAU, row)
    return True


@njit(cache=True, nogil=True)
def _circle_roots(S, vmin, R, sign):
    """``roots`` of a ball's circle."""
    fastest = math.hypot(S[23], S[24])
    outward, inward = S[25] + fastest >= vmin, S[25] - fastest <= -vmin
    if not outward or not inward:
        return 0, (1 if outward else (-1 if inward else 0))
    if not _graze(S, -1, R[0]) or not _graze(S, 1, R[1]):
        return -1, 0
    sign[0], sign[1] = -1, 1
    if R[1, 2] < R[0, 2]:
        for i in range(7):
            R[0, i], R[1, i] = R[1, i], R[0, i]
        sign[0], sign[1] = 1, -1
    return 2, -sign[0]


@njit(cache=True, nogil=True)
def _zero(S, K, lo, vlo, hi, vhi, row):
    """A zero of V between two angles of one smooth stretch where its signs differ, into ``row``."""
    side = 0
    for _ in range(80):
        x = (lo * vhi - hi * vlo) / (vhi - vlo)
        if not lo < x < hi:
            x = 0.5 * (lo + hi)
        v = point(S, K, x, row)
        if v == 0.0 or hi - lo < 1e-14:
            break
        if (v > 0.0) == (vhi > 0.0):
            near = hi - x
            hi, vhi = x, v
            if side == 1:
                vlo *= 0.5
            side = 1
        else:
            near = x - lo
            lo, vlo = x, v
            if side == -1:
                vhi *= 0.5
            side = -1
        if near < 1e-14:
            break


@njit(types.UniTuple(types.float64, 2)(_F1, _R1, _F2, types.int64, _F1), cache=True, nogil=True)
def _corner(S, K, C, i, row):
    """The corner i into ``row``, across its own velocity; returns V of the pieces before and after it."""
    x, y = C[i, 1], C[i, 2]
    vl, lx, ly = speed(S, K, x, y, int(C[i, 3]))
    vr, rx, ry = speed(S, K, x, y, int(C[i, 4]))
    nx = lx * abs(vr) + rx * abs(vl)
    ny = ly * abs(vr) + ry * abs(vl)
    n = math.hypot(nx, ny)
    row[0], row[1], row[2], row[3] = x, y, C[i, 0], S[21]
    row[4], row[5] = (nx / n, ny / n) if n > 0.0 else (lx, ly)
    row[6] = CORNER
    return vl, vr


@njit(cache=True, nogil=True)
def _sample_angles(S, K, C, th, vv, at, row, grid):
    """Angles ``th`` with V ``vv`` at even nodes and, before and after, at corners ``at`` (-1: a node); how many."""
    n = 0
    nc = int(S[20])
    k = 0
    for i in range(NODES):
        angle = i * (TAU / NODES)
        while k < nc and C[k, 0] <= angle:
            vl, vr = _corner(S, K, C, k, row)
            th[n], vv[n], at[n] = C[k, 0], vl, k
            th[n + 1], vv[n + 1], at[n + 1] = C[k, 0], vr, k
            n += 2
            k += 1
        grid[i] = point_at(S, K, angle, _COS[i], _SIN[i], row)
        if k > 0 and C[k - 1, 0] == angle:
            continue
        th[n], vv[n], at[n] = angle, grid[i], -1
        n += 1
    while k < nc:
        vl, vr = _corner(S, K, C, k, row)
        th[n], vv[n], at[n] = C[k, 0], vl, k
        th[n + 1], vv[n + 1], at[n + 1] = C[k, 0], vr, k
        n += 2
        k += 1
    return n


@njit(cache=True, nogil=True)
def _one_zero(S, K, C, th, vv, at, last, i, n, here, now, out):
    """The one sign change from ``here`` to ``now`` among samples ``last`` .. i that may be near zero, into ``out``;
    false: there is none.
    """
    j = last
    while j != i:
        m = (j + 1) % n
        if (vv[j] > 0.0) == (here > 0) and (vv[m] > 0.0) == (now > 0):
            if at[j] >= 0 and at[j] == at[m]:
                _corner(S, K, C, at[j], out)
            else:
                hi = th[m] if th[m] > th[j] else th[m] + TAU
                _zero(S, K, th[j], vv[j], hi, vv[m], out)
                out[2] %= TAU
            return True
        j = m
    return False


@njit(cache=True, nogil=True)
def roots(S, K, C, vmin, R, sign, grid):
    """Where V changes sign around the section, in order of theta: rows into ``R``, +1 from inward to outward.

    Speeds under ``vmin`` take the sign before them. Returns (count, sign of V where count is 0; 0: |V| < vmin all
    round). ``grid`` (NODES,) takes V at even angles.
    """
    if S[22] < 0.0:
        around = R[0]
        for i in range(NODES):
            grid[i] = point_at(S, K, i * (TAU / NODES), _COS[i], _SIN[i], around)
        return _circle_roots(S, vmin, R, sign)
    th = np.empty(NODES + 16)
    vv = np.empty(NODES + 16)
    at = np.empty(NODES + 16, np.int64)
    row = np.empty(7)
    n = _sample_angles(S, K, C, th, vv, at, row, grid)
    start = -1
    for i in range(n):
        if abs(vv[i]) >= vmin:
            start = i
            break
    if start < 0:
        return 0, 0
    count = 0
    last = start
    first_sign = 1 if vv[start] > 0.0 else -1
    here = first_sign
    for step in range(1, n + 1):
        i = (start + step) % n
        if abs(vv[i]) < vmin:
            continue
        now = 1 if vv[i] > 0.0 else -1
        if now != here:
            if count + 2 > MAX_ROOTS:
                return -1, 0
            if not _one_zero(S, K, C, th, vv, at, last, i, n, here, now, R[count]):
                return -1, 0
            sign[count] = now
            count += 1
        else:
            j = (last + 1) % n
            if j == i and at[i] < 0 and at[last] < 0:  # a pair of roots between even nodes: the least |V| by a parabola
                before = (last - 1 + n) % n
                after = (i + 1) % n
                if at[before] < 0 and at[after] < 0:
                    a0, a1, a2, a3 = abs(vv[before]), abs(vv[last]), abs(vv[i]), abs(vv[after])
                    if a1 <= a0 and a2 <= a3 and min(a1, a2) < 0.25 * max(a0, a3):
                        hi = th[i] if th[i] > th[last] else th[i] + TAU
                        lo = th[last]
                        a, b = lo, hi
                        for _ in range(40):
                            x1 = b - 0.6180339887498949 * (b - a)
                            x2 = a + 0.6180339887498949 * (b - a)
                            v1 = point(S, K, x1, row) * here
                            v2 = point(S, K, x2, row) * here
                            if min(v1, v2) < -vmin:
                                x, v = (x1, v1) if v1 < v2 else (x2, v2)
                                if count + 3 > MAX_ROOTS:
                                    return -1, 0
                                _zero(S, K, lo, vv[last], x, v * here, R[count])
                                R[count, 2] %= TAU
                                sign[count] = -here
                                _zero(S, K, x, v * here, hi, vv[i], R[count + 1])
                                R[count + 1, 2] %= TAU
                                sign[count + 1] = here
                                count += 2
                                break
                            if v1 < v2:
                                b = x2
                            else:
                                a = x1
                            if b - a < 1e-8:
                                break
        here = now
        last = i
    return count, first_sign


@njit(cache=True, nogil=True)
def wrap_angle(angle):
    """The angle in -pi .. pi."""
    return angle - TAU * math.floor(angle / TAU + 0.5)


@njit(cache=True, nogil=True)
def deviation(a, b):
    """How far a smooth curve can be from its chord, from its tangents at both ends [mm]."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    return 0.25 * max(abs(dx * a[4] + dy * a[5]), abs(dx * b[4] + dy * b[5]))


@njit(types.boolean(_F1, _R1, _F2, types.float64, types.float64, types.int64, _F1), cache=True, nogil=True)
def root_near(S, K, C, guess, width, sign, row):
    """The change of V of this sign near ``guess``, into ``row``; False if there is none within a quarter turn."""
    if S[22] < 0.0:
        return _graze(S, sign, row)
    if S[22] > 0.0 and _newton(S, guess, sign, row):
        point(S, K, row[2], row)
        return True
    lo = guess - width
    hi = guess + width
    vlo = point(S, K, lo, row)
    vhi = point(S, K, hi, row)
    while sign * vlo >= 0.0:
        hi, vhi = lo, vlo
        width *= 2.0
        lo -= width
        if lo < guess - 1.6:
            return False
        vlo = point(S, K, lo, row)
    while sign * vhi <= 0.0:
        lo, vlo = hi, vhi
        width *= 2.0
        hi += width
        if hi > guess + 1.6:
            return False
        vhi = point(S, K, hi, row)
    for i in range(int(S[20])):
        theta = C[i, 0] + TAU * math.floor((lo - C[i, 0]) / TAU + 1.0)
        if not lo < theta < hi:
            continue
        vl, vr = _corner(S, K, C, i, row)
        if sign * vl > 0.0:
            hi, vhi = theta, vl
        elif sign * vr < 0.0:
            lo, vlo = theta, vr
        else:
            return True
    _zero(S, K, lo, vlo, hi, vhi, row)
    return True
