"""Compiled loops of what a cutter sweeps whose axis leans or turns; arrays and scalars only.

Notation: a move is a row: tip p0 at the start, what it goes u [mm], axis a0 at the start, direction b across it to
which the axis turns, by which angle theta [rad], the length of u, n = a0 x b, and a and b at the end; at the time t in
0..1 the tip is p0 + t u and the axis A = a0 cos(t theta) + b sin(t theta). A cutter is a row of
:func:`chipload.engagement.bricks.stock.cutter_row`; rho, w [mm] are the distance of a point from the axis and its
height above the tip. The cutter is convex and closed at the end of its flutes; f(t) is the distance of a point out of
it, negative within.

In the frame of the cutter the point goes along a path whose second derivative is at most
M = theta^2 |x - p| + 2 theta |u|, and the distance from a convex body is convex and changes no faster than the point
moves. So f + M t^2 / 2 is convex, and f is bounded from below by a parabola through each of its values and rates; with
a fixed axis M = 0. The least f is found by intervals whose two parabolas cross below what is asked.
Oracle: least f over many times, in tests/engagement/bricks.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.engagement.moves._kernels import CORNER, EPS, FLAT, FLUTE, KIND, WIDE, E, F

#: columns of a move: u from, a0 from, b from, theta, length of u
U, A0, B, THETA, LENGTH = 3, 6, 9, 12, 13
#: further columns of a cutter: sine and cosine of the angles of bottom and flank
SIN_A, COS_A, SIN_B, COS_B = range(12, 16)
#: a least distance that lies between bounds this near to each other is known [mm]
KNOWN = 1e-11
#: most intervals that wait
WAIT = 64


@njit(cache=True, nogil=True)
def from_profile(c, rho, w):
    """Distance of a point out of the cutter, negative within, and the normal there: across and along the axis."""
    vr = rho - c[E]
    vw = w - c[F]
    r = c[CORNER]
    if vr * c[COS_A] + vw * c[SIN_A] >= 0.0 and vr * c[SIN_B] + vw * c[COS_B] <= 0.0:
        size = math.sqrt(vr * vr + vw * vw)
        f = size - r
        if size > 0.0:
            nr = vr / size
            nw = vw / size
        else:
            nr = c[SIN_A]
            nw = -c[COS_A]
    else:
        bottom = vr * c[SIN_A] - vw * c[COS_A]
        flank = vr * c[COS_B] - vw * c[SIN_B]
        if bottom > flank:
            f = bottom - r
            nr = c[SIN_A]
            nw = -c[COS_A]
        else:
            f = flank - r
            nr = c[COS_B]
            nw = -c[SIN_B]
    if w - c[FLUTE] > f:
        return w - c[FLUTE], 0.0, 1.0
    return f, nr, nw


@njit(cache=True, nogil=True)
def turn(m, t):
    """Cosine and sine of the angle by which the axis has turned, at most 0.1 rad."""
    a = m[THETA] * t
    q = a * a
    return 1.0 - q * (0.5 - q * (1.0 / 24.0 - q / 720.0)), a * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0 - q / 5040.0)))


@njit(cache=True, nogil=True)
def outside(m, c, t, x, y, z):
    """F at a time, and its rate."""
    cosine, sine = turn(m, t)
    ax = m[6] * cosine + m[9] * sine
    ay = m[7] * cosine + m[10] * sine
    az = m[8] * cosine + m[11] * sine
    qx = x - m[0] - t * m[3]
    qy = y - m[1] - t * m[4]
    qz = z - m[2] - t * m[5]
    w = qx * ax + qy * ay + qz * az
    qx -= w * ax
    qy -= w * ay
    qz -= w * az
    rho = math.sqrt(qx * qx + qy * qy + qz * qz)
    f, nr, nw = from_profile(c, rho, w)
    # of the axis' motion the part towards the point
    g = m[THETA] * (
        qx * (m[9] * cosine - m[6] * sine) + qy * (m[10] * cosine - m[7] * sine) + qz * (m[11] * cosine - m[8] * sine)
    )
    rate = nw * (g - m[3] * ax - m[4] * ay - m[5] * az)
    if rho > 1e-12:
        rate -= nr * (qx * m[3] + qy * m[4] + qz * m[5] + w * g) / rho
    return f, rate


@njit(cache=True, nogil=True)
def least(m, c, x, y, z, above, below, near, wait):
    """Bounds (low, high) of the least f over the move. They end where low >= above, where high < below, or where they
    are ``near`` to each other; ``wait`` (WAIT, 6) is room.
    """
    f1, s1 = outside(m, c, 1.0, x, y, z)
    if f1 < below:
        return -math.inf, f1
    theta = m[THETA]
    bend = 0.0
    if theta > 0.0:
        away = math.sqrt((x - m[0]) ** 2 + (y - m[1]) ** 2 + (z - m[2]) ** 2) + m[LENGTH]
        bend = theta * (theta * away + 2.0 * m[LENGTH])
    if s1 <= 0.0 and f1 - 0.5 * bend >= above:
        return f1 - 0.5 * bend, f1
    f0, s0 = outside(m, c, 0.0, x, y, z)
    if f0 < below:
        return -math.inf, f0
    if s0 >= 0.0 and f0 - 0.5 * bend >= above:
        return f0 - 0.5 * bend, f0
    high = min(f0, f1)
    low = high
    wait[0, 0] = 0.0
    wait[0, 1] = f0
    wait[0, 2] = s0
    wait[0, 3] = 1.0
    wait[0, 4] = f1
    wait[0, 5] = s1
    count = 1
    turns = 0
    while count > 0:
        count -= 1
        a = wait[count, 0]
        fa = wait[count, 1]
        sa = wait[count, 2]
        b = wait[count, 3]
        fb = wait[count, 4]
        sb = wait[count, 5]
        size = b - a
        fall = sb - sa + bend * size
        # where the two parabolas cross, counted from a
        d = 0.5 * size
        if fall > 0.0:
            d = min(max((fa - fb + sb * size + 0.5 * bend * size * size) / fall, 0.0), size)
        floor = min(fa + sa * d - 0.5 * bend * d * d, min(fa, fb))
        if floor >= min(above, high - near):
            low = min(low, floor)
            continue
        turns += 1
        if turns % 3 == 0 or not 0.0 < d < size:
            d = 0.5 * size
        t = a + d
        if not a < t < b or count + 2 > WAIT:
            low = min(low, floor)
            continue
        f, s = outside(m, c, t, x, y, z)
        if f < below:
            return -math.inf, f
        high = min(high, f)
        wait[count, 0] = a
        wait[count, 1] = fa
        wait[count, 2] = sa
        wait[count, 3] = t
        wait[count, 4] = f
        wait[count, 5] = s
        wait[count + 1, 0] = t
        wait[count + 1, 1] = f
        wait[count + 1, 2] = s
        wait[count + 1, 3] = b
        wait[count + 1, 4] = fb
        wait[count + 1, 5] = sb
        count += 2
    return low, high


@njit(cache=True, nogil=True)
def nearest(x, y, dx, dy, first, last):
    """Square of the least distance from the axis of a point that goes from (x, y) by (dx, dy) at times first..last."""
    size = dx * dx + dy * dy
    t = -(x * dx + y * dy) / size if size > 0.0 else 0.0
    t = min(max(t, first), last)
    return (x + t * dx) ** 2 + (y + t * dy) ** 2


@njit(cache=True, nogil=True)
def in_cylinder(x, y, w, dx, dy, dw, wide, low, high):
    """Whether a point on its way is somewhere within a cylinder: nearer to the axis than ``wide``, low < w < high."""
    first = 0.0
    last = 1.0
    if dw == 0.0:
        if not low < w < high:
            return False
    else:
        a = (low - w) / dw
        b = (high - w) / dw
        if a > b:
            a, b = b, a
        first = max(a, 0.0)
        last = min(b, 1.0)
        if first > last:
            return False
    return nearest(x, y, dx, dy, first, last) < wide * wide


@njit(cache=True, nogil=True)
def swept(m, c, x, y, z, wait):
    """Whether a point is in the volume that a move sweeps.

    Where the axis is fixed the point goes along a line in the frame of the cutter; where it turns it is never farther
    than M / 8 from the line between its first and its last place there. What a cylinder as much wider or narrower says
    settles most points; for a flat mill with a fixed axis that is all.
    """
    qx = x - m[0]
    qy = y - m[1]
    qz = z - m[2]
    x0 = qx * m[14] + qy * m[15] + qz * m[16]
    y0 = qx * m[9] + qy * m[10] + qz * m[11]
    w0 = qx * m[6] + qy * m[7] + qz * m[8]
    theta = m[THETA]
    off = EPS
    if theta > 0.0:
        away = math.sqrt(qx * qx + qy * qy + qz * qz) + m[LENGTH]
        off += 0.125 * theta * (theta * away + 2.0 * m[LENGTH])
    qx -= m[3]
    qy -= m[4]
    qz -= m[5]
    dx = qx * m[14] + qy * m[15] + qz * m[16] - x0
    dy = qx * m[20] + qy * m[21] + qz * m[22] - y0
    dw = qx * m[17] + qy * m[18] + qz * m[19] - w0
    if not in_cylinder(x0, y0, w0, dx, dy, dw, c[WIDE] + off, -off, c[FLUTE] + off):
        return False
    if c[KIND] == FLAT:
        if theta == 0.0:
            return True
        if in_cylinder(x0, y0, w0, dx, dy, dw, c[WIDE] - off, off, c[FLUTE] - off):
            return True
    return least(m, c, x, y, z, EPS, EPS, KNOWN, wait)[1] < EPS
