"""Compiled loops of the area of a layer that a cutter with a fixed axis covers on a straight move.

Notation: arrays ``K`` and profile (rho, w) as in :mod:`chipload.engagement.chips._section`; A the axis, a its part in
the layer, v the motion. The cutter is convex, hence what it sweeps, and hence the section of that with a layer. So the
boundary is known by its point in each direction u of the layer. It has a normal N = (u, n_z) in space. The **support**
of the cutter in the direction N is the point of its profile with the normal g, where N = sin(g) e_r - cos(g) A.

Where N . v = 0 the support moves along the boundary of the swept volume, and passes the layer at the time t. If t is in
0 .. 1 this is the point in the direction u. Before, the point is that of the section at the start, and later, of that
at the end. In a section the support rises with n_z; n_z is such that it is in the layer. On the flank, where N is
across a line of the surface, it is the point of this line.

Directions are halved until no part of the boundary is more than the tolerance beyond a chord: it lies within the
tangents at both ends of the chord and in the direction between.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.engagement.chips._section import extent

NOTHING, FULL = -1, -3
#: initial number of directions
FIRST = 8
#: angle below which two directions are one [rad]
LEAST = 1e-6
#: distance below which two points are one, as a share of the tolerance
SAME = 1e-3
#: height of a chord's triangle of tangents, in tolerances, above which the chord is divided without a test
HIGH = 2.5


@njit("void(float64[::1], float64[::1], float64, float64, float64, float64[::1])", cache=True, nogil=True)
def support(K, A, nx, ny, nz, out):
    """The point of the cutter farthest in a direction, from its tip, into ``out``."""
    na = nx * A[0] + ny * A[1] + nz * A[2]
    rx, ry, rz = nx - na * A[0], ny - na * A[1], nz - na * A[2]
    # once more: where N is almost along the axis all that is left of it is rounding, which need not be across the axis
    over = rx * A[0] + ry * A[1] + rz * A[2]
    rx, ry, rz = rx - over * A[0], ry - over * A[1], rz - over * A[2]
    nr = math.sqrt(rx * rx + ry * ry + rz * rz)
    n = math.sqrt(nr * nr + na * na)
    sg, cg = nr / n, -na / n
    if cg > 0.0 and sg * K[4] < cg * K[3]:
        rho, w = 0.0, 0.0
    elif cg < K[6] or K[2] - K[1] * cg > K[10]:
        rho, w = K[11], K[10]
    else:
        rho, w = K[0] + K[1] * sg, K[2] - K[1] * cg
    rho = rho / nr if nr > 0.0 else 0.0
    out[0], out[1], out[2] = w * A[0] + rho * rx, w * A[1] + rho * ry, w * A[2] + rho * rz


@njit("boolean(float64, float64, float64[::1], float64, float64, float64, float64[::1])", cache=True, nogil=True)
def on_rim(rho, w, A, z, ux, uy, out):
    """Point of a rim at the height z that is farther in the direction u, into ``out``; False: there is none."""
    s = math.sqrt(A[0] * A[0] + A[1] * A[1])
    if rho <= 0.0 or s <= 0.0:
        return False
    c = (z - w * A[2]) / (rho * s)
    if not -1.0 <= c <= 1.0:
        return False
    ex, ey = A[0] / s, A[1] / s
    along, across = w * s - rho * c * A[2], rho * math.sqrt((1.0 - c) * (1.0 + c))
    if uy * ex - ux * ey < 0.0:
        across = -across
    out[0], out[1], out[2] = along * ex - across * ey, along * ey + across * ex, z
    return True


@njit("void(float64[::1], float64[::1], float64, float64, float64, float64[:,::1])", cache=True, nogil=True)
def of_section(K, A, z, ux, uy, work):
    """The point in the direction u of the section at the height z over the tip, into ``work[0]``."""
    m = ux * A[0] + uy * A[1]
    q = math.sqrt(m * m + A[2] * A[2])
    turn = -math.asin(min(K[6] / q, 1.0)) - math.atan2(m, A[2])
    # the line of the flank across this direction, from its lower to its upper end
    nx, ny, nz = math.cos(turn) * ux, math.cos(turn) * uy, math.sin(turn)
    na = nx * A[0] + ny * A[1] + nz * A[2]
    rx, ry, rz = nx - na * A[0], ny - na * A[1], nz - na * A[2]
    nr = math.sqrt(rx * rx + ry * ry + rz * rz)
    low, rho = min(K[2] - K[1] * K[6], K[10]), K[0] + K[1] * K[7]
    if low == K[10]:
        rho = K[11]
    z0, z1 = low * A[2] + rho * rz / nr, K[10] * A[2] + K[11] * rz / nr
    if z0 <= z <= z1:
        f = (z - z0) / (z1 - z0) if z1 > z0 else 0.0
        w, rho = low + f * (K[10] - low), (rho + f * (K[11] - rho)) / nr
        work[0, 0], work[0, 1], work[0, 2] = w * A[0] + rho * rx, w * A[1] + rho * ry, z
        return
    if z > z1 and on_rim(K[11], K[10], A, z, ux, uy, work[0]):
        return
    if z < z0 and K[1] == 0.0 and K[5] == 0.0 and on_rim(K[0], K[2], A, z, ux, uy, work[0]):
        return
    a, b = (-0.5 * math.pi, turn) if z < z0 else (turn, 0.5 * math.pi)
    support(K, A, math.cos(a) * ux, math.cos(a) * uy, math.sin(a), work[1])
    support(K, A, math.cos(b) * ux, math.cos(b) * uy, math.sin(b), work[2])
    if z < z0:
        work[2, 0], work[2, 1], work[2, 2] = low * A[0] + rho / nr * rx, low * A[1] + rho / nr * ry, z0
    side, fa, fb = 0, work[1, 2] - z, work[2, 2] - z
    for k in range(80):
        x = (a * fb - b * fa) / (fb - fa) if fb > fa else 0.5 * (a + b)
        if k > 12 or not a < x < b:
            x = 0.5 * (a + b)
        support(K, A, math.cos(x) * ux, math.cos(x) * uy, math.sin(x), work[0])
        f = work[0, 2] - z
        if abs(f) < 1e-12 or b - a < 1e-14:
            break
        if f > 0.0:
            b, fb = x, f
            work[2] = work[0]
            fa = 0.5 * fa if side == 1 else fa
            side = 1
        else:
            a, fa = x, f
            work[1] = work[0]
            fb = 0.5 * fb if side == -1 else fb
            side = -1
    # across a line of the surface the support jumps from one end of it to the other
    if abs(work[0, 2] - z) > 1e-12 and work[2, 2] > work[1, 2]:
        f = min(max((z - work[1, 2]) / (work[2, 2] - work[1, 2]), 0.0), 1.0)
        for i in range(2):
            work[0, i] = work[1, i] + f * (work[2, i] - work[1, i])


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[::1], float64, boolean, boolean, float64, float64[:,::1],"
    " float64[::1])",
    cache=True,
    nogil=True,
)
def boundary(K, A, p, v, h, starts, ends, angle, work, row):
    """The point of the boundary in a direction into ``row``: x, y, the angle.

    ``starts``, ``ends``: whether the cutter is in the layer at the start and at the end.
    """
    ux, uy = math.cos(angle), math.sin(angle)
    ahead = ux * v[0] + uy * v[1]
    if v[2] == 0.0:
        t = 2.0 if ahead > 0.0 else -1.0
    else:
        n = math.sqrt(ahead * ahead + v[2] * v[2])
        s = abs(v[2]) / n
        support(K, A, s * ux, s * uy, -ahead / n if v[2] > 0.0 else ahead / n, work[0])
        t = (h - p[2] - work[0, 2]) / v[2]
    if (t < 0.0 and starts) or (t > 1.0 and ends):
        t = 0.0 if t < 0.0 else 1.0
        of_section(K, A, h - p[2] - t * v[2], ux, uy, work)
    t = min(max(t, 0.0), 1.0)
    row[0], row[1], row[2] = p[0] + work[0, 0] + t * v[0], p[1] + work[0, 1] + t * v[1], angle


@njit("boolean(float64[::1], float64[::1], float64[::1], float64)", cache=True, nogil=True)
def flat_enough(a, m, b, tol):
    """Whether the tangents in a, m and b leave no place that is more than ``tol`` beyond the chord from a to b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = math.sqrt(dx * dx + dy * dy)
    half = math.sin(0.5 * (b[2] - a[2]))
    mx, my = math.cos(m[2]), math.sin(m[2])
    first = ((m[0] - a[0]) * mx + (m[1] - a[1]) * my) / half
    last = ((m[0] - b[0]) * mx + (m[1] - b[1]) * my) / half
    # beyond the chord: to the right of it
    rise = first * (dx * math.cos(a[2]) + dy * math.sin(a[2])) / length
    fall = last * (dx * math.cos(b[2]) + dy * math.sin(b[2])) / length
    return abs(rise) <= tol and abs(fall) <= tol


@njit("float64(float64[::1], float64[::1])", cache=True, nogil=True)
def height(a, b):
    """Height of the triangle of the chord from a to b and the tangents there."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = math.sqrt(dx * dx + dy * dy)
    if length == 0.0:
        return 0.0
    sa = (dx * math.cos(a[2]) + dy * math.sin(a[2])) / length
    sb = (dx * math.cos(b[2]) + dy * math.sin(b[2])) / length
    return length * abs(sa * sb) / math.sin(b[2] - a[2])


@njit(
    "int64(float64[::1], float64[::1], float64[::1], float64[::1], float64, boolean, boolean, float64, float64[:,::1],"
    " float64[:,::1], int64)",
    cache=True,
    nogil=True,
)
def outline(K, A, p, v, h, starts, ends, tol, work, out, n):
    """Enter the outline of one layer into ``out`` from ``n`` on; the place after its last point, or FULL."""
    cur, zero = np.empty(3), np.empty(3)
    goals = np.empty((64, 3))
    boundary(K, A, p, v, h, starts, ends, 0.0, work, zero)
    cur[:] = zero
    begin = n
    for k in range(1, FIRST + 1):
        if k < FIRST:
            boundary(K, A, p, v, h, starts, ends, k * (2.0 * math.pi / FIRST), work, goals[0])
        else:
            goals[0, 0], goals[0, 1], goals[0, 2] = zero[0], zero[1], 2.0 * math.pi
        waiting = 1
        while waiting > 0:
            goal = goals[waiting - 1]
            high = height(cur, goal)
            if high > tol and goal[2] - cur[2] > LEAST and waiting < len(goals):
                boundary(K, A, p, v, h, starts, ends, 0.5 * (cur[2] + goal[2]), work, goals[waiting])
                if high > HIGH * tol or not flat_enough(cur, goals[waiting], goal, tol):
                    waiting += 1
                    continue
            if n == len(out):
                return FULL
            if n == begin or math.hypot(cur[0] - out[n - 1, 0], cur[1] - out[n - 1, 1]) > SAME * tol:
                out[n, 0], out[n, 1] = cur[0], cur[1]
                n += 1
            cur[:] = goal
            waiting -= 1
    while n > begin and math.hypot(out[n - 1, 0] - out[begin, 0], out[n - 1, 1] - out[begin, 1]) <= SAME * tol:
        n -= 1
    return n


@njit(
    "int64(float64[:,::1], float64[:,::1], float64[:,::1], float64[::1], float64[::1], int64[::1], float64,"
    " float64[:,::1], int64[::1])",
    cache=True,
    nogil=True,
)
def outlines(starts, ways, axes, K, heights, first, tol, out, count):
    """Outlines of the layers ``heights[first[m] : first[m + 1]]`` of moves m, counter-clockwise, one after the other.

    ``starts``, ``ways`` and ``axes`` (m, 3) are p, v and A. ``out`` takes points, ``count`` how many of each layer, or
    NOTHING. Returns how many layers are done: all, or ``out`` is full.
    """
    work, S = np.empty((3, 3)), np.empty(27)
    used = 0
    for m in range(len(first) - 1):
        p, v, A = starts[m], ways[m], axes[m]
        S[3], S[4], S[5] = A[0], A[1], A[2]
        low, _, high, _ = extent(S, K)
        for i in range(first[m], first[m + 1]):
            z = heights[i] - p[2]
            if not min(v[2], 0.0) + low < z < max(v[2], 0.0) + high:
                count[i] = NOTHING
                continue
            here, there = low < z < high, low < z - v[2] < high
            n = outline(K, A, p, v, heights[i], here, there, tol, work, out, used)
            if n < 0:
                return i
            count[i] = n - used
            if n - used < 3:
                count[i] = NOTHING
                n = used
            used = n
    return len(heights)
