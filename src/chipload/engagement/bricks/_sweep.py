"""Compiled loops of the volume that a cutter with a leaning or turning axis sweeps; arrays and scalars only.

Notation: a move is a row: tip p0 at the start [mm], its motion u [mm], axis a0 at the start, direction b across it to
which the axis turns, the angle theta of the turn [rad], the length of u, n = a0 x b, and the motion of the first tip in
the cutter's frame; at the time t in 0..1 the tip is p0 + t u and the axis A = a0 cos(t theta) + b sin(t theta). A
cutter is a record of :mod:`chipload.cutter.record`; rho, w [mm] are the distance of a point from
the axis and its height above the tip. The cutter is convex and closed at the end of its flutes; f(t) [mm] is the
distance of a point from its surface, negative within.

In the frame of the cutter the point moves on a path whose second derivative is at most
M = theta^2 |x - p| + 2 theta |u|, and the distance from a convex body is convex and changes no faster than the point
moves. So f + M t^2 / 2 is convex, and f is bounded from below by a parabola through each of its values and rates; with
a fixed axis M = 0. The search for the least f divides the intervals whose two parabolas cross below the wanted bound.
Oracle: least f over many times, in tests/engagement/bricks.
"""

from __future__ import annotations

import math

from numba import njit

from chipload.cutter.record import FLAT
from chipload.engagement.moves._sweep import EPS

#: columns of a move: u from, a0 from, b from, theta, length of u, n from
U, A0, B, THETA, LENGTH, N = 3, 6, 9, 12, 13, 14
#: motion of a point at the first tip in the frame of the cutter along n, b and a, cosine of theta less 1, its sine, and
#: the part of M that does not depend on the point, over theta
ALONG_X, ALONG_Y, ALONG_W, TURNED, SINE, BEND = range(17, 23)
#: difference of the bounds of a least distance at which the search ends [mm]
KNOWN = 1e-11
#: greatest number of intervals that are still to be divided
WAIT = 64
#: tolerance of the distance of a ball, as a share of its radius
NEAR = 0.1


@njit(cache=True, nogil=True)
def from_profile(c, rho, w):
    """Distance [mm] of a point (rho, w) from the cutter, negative within, and the normal: across, along the axis."""
    f = -math.inf
    nr = 0.0
    nw = 1.0
    # the greatest distance from a tangent: of an arc or sharp corner from the one whose normal goes through the point
    for i in range(c.count):
        if c.line[i] > 0:
            continue
        vr = rho - c.e[i]
        vw = w - c.f[i]
        if vr * c.cos[i] + vw * c.sin[i] >= 0.0 and vr * c.cos_to[i] + vw * c.sin_to[i] <= 0.0:
            size = math.sqrt(vr * vr + vw * vw)
            if size - c.radius[i] > f:
                f = size - c.radius[i]
                nr = vr / size if size > 0.0 else c.sin[i]
                nw = vw / size if size > 0.0 else -c.cos[i]
    if f == -math.inf or c.arcs > 1:
        for i in range(c.count):
            if c.line[i] > 0:
                g = (rho - c.rho_to[i]) * c.sin[i] - (w - c.z_to[i]) * c.cos[i]
                if g >= f:
                    f = g
                    nr = c.sin[i]
                    nw = -c.cos[i]
    if w - c.height > f:
        return w - c.height, 0.0, 1.0
    return f, nr, nw


@njit(cache=True, nogil=True)
def turn(m, t):
    """Cosine and sine of the angle by which the axis has turned, at most 0.1 rad."""
    a = m[THETA] * t
    q = a * a
    return 1.0 - q * (0.5 - q * (1.0 / 24.0 - q / 720.0)), a * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0 - q / 5040.0)))


@njit(cache=True, nogil=True)
def outside_distance(m, c, t, x, y, z):
    """Distance f [mm] of the point (x, y, z) at the time t, and its rate."""
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
    """:func:`least_from` with the time at which the point on its chord is nearest to the axis as the start."""
    x0, y0, _, dx, dy, _, _ = chord(m, x, y, z)
    return least_from(m, c, x, y, z, nearest_time(x0, y0, dx, dy), above, below, near, wait)


@njit(cache=True, nogil=True)
def least_from(m, c, x, y, z, start, above, below, near, wait):
    """Bounds (low, high) [mm] of the least f over the move.

    The search ends where low >= above, where high < below, or where both differ by at most ``near`` [mm]. ``start`` is
    the first time that is evaluated, ``wait`` (WAIT, 6) a working array.
    """
    f, s = outside_distance(m, c, start, x, y, z)
    if f < below:
        return -math.inf, f
    bend = m[THETA] * (m[THETA] * math.sqrt((x - m[0]) ** 2 + (y - m[1]) ** 2 + (z - m[2]) ** 2) + m[BEND])
    rest = 1.0 - start
    low = min(f, f - (s + 0.5 * bend * start) * start, f + (s - 0.5 * bend * rest) * rest)
    if low >= above:
        return low, f
    f0, s0, f1, s1 = f, s, f, s
    if start > 0.0:
        f0, s0 = outside_distance(m, c, 0.0, x, y, z)
        if f0 < below:
            return -math.inf, f0
    if start < 1.0:
        f1, s1 = outside_distance(m, c, 1.0, x, y, z)
        if f1 < below:
            return -math.inf, f1
    high = min(f, min(f0, f1))
    low = high
    wait[0, 0] = 0.0
    wait[0, 1] = f0
    wait[0, 2] = s0
    wait[0, 3] = 1.0
    wait[0, 4] = f1
    wait[0, 5] = s1
    count = 1
    if 0.0 < start < 1.0:
        wait[0, 3] = wait[1, 0] = start
        wait[0, 4] = wait[1, 1] = f
        wait[0, 5] = wait[1, 2] = s
        wait[1, 3] = 1.0
        wait[1, 4] = f1
        wait[1, 5] = s1
        count = 2
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
        f, s = outside_distance(m, c, t, x, y, z)
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
def chord(m, x, y, z):
    """Chord of the path of a point in the frame of the cutter: its beginning along n, b and the axis, its motion along
    each until the end, and the greatest deviation of the path from the chord, all in mm.
    """
    qx = x - m[0]
    qy = y - m[1]
    qz = z - m[2]
    x0 = qx * m[14] + qy * m[15] + qz * m[16]
    y0 = qx * m[9] + qy * m[10] + qz * m[11]
    w0 = qx * m[6] + qy * m[7] + qz * m[8]
    theta = m[THETA]
    if theta == 0.0:
        return x0, y0, w0, m[ALONG_X], m[ALONG_Y], m[ALONG_W], 0.0
    dy = m[ALONG_Y] + y0 * m[TURNED] - w0 * m[SINE]
    dw = m[ALONG_W] + w0 * m[TURNED] + y0 * m[SINE]
    return x0, y0, w0, m[ALONG_X], dy, dw, 0.125 * theta * (theta * math.sqrt(y0 * y0 + w0 * w0) + m[BEND])


@njit(cache=True, nogil=True)
def nearest_time(x, y, dx, dy):
    """Time in 0..1 at which a point that moves from (x, y) by (dx, dy) is nearest to the axis."""
    along = -(x * dx + y * dy)
    if along <= 0.0:
        return 0.0
    size = dx * dx + dy * dy
    return along / size if along < size else 1.0


@njit(cache=True, nogil=True)
def nearest(x, y, dx, dy, first, last):
    """Square of the least distance [mm^2] from the axis of a point that moves from (x, y) by (dx, dy)."""
    size = dx * dx + dy * dy
    t = -(x * dx + y * dy) / size if size > 0.0 else 0.0
    t = min(max(t, first), last)
    return (x + t * dx) ** 2 + (y + t * dy) ** 2


@njit(cache=True, nogil=True)
def in_cylinder(x, y, w, dx, dy, dw, wide, low, high):
    """Whether a moving point enters a cylinder: nearer to the axis than ``wide`` [mm], low < w < high."""
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
def from_axis(m, t, x0, y0, w0):
    """Square of the distance of a point from the axis at the time t [mm^2], its rate, and its height over the tip [mm];
    (x0, y0, w0) as of :func:`chord`.
    """
    cosine, sine = turn(m, t)
    c1 = 1.0 + m[TURNED]
    # what the tip goes along b and a at the start
    ub = -(c1 * m[ALONG_Y] + m[SINE] * m[ALONG_W])
    ua = -(c1 * m[ALONG_W] - m[SINE] * m[ALONG_Y])
    yt = y0 - t * ub
    wt = w0 - t * ua
    x = x0 + t * m[ALONG_X]
    y = yt * cosine - wt * sine
    w = wt * cosine + yt * sine
    rate = ua * sine - ub * cosine - m[THETA] * w
    return x * x + y * y, 2.0 * (x * m[ALONG_X] + y * rate), w


@njit(cache=True, nogil=True)
def swept_by_flank(m, c, t, x0, y0, w0, dx, dy, off):
    """1: a point was swept by a cutter's cylinder, 0: it was not, -1: not known.

    Newton's step from the time t to the least distance from the axis; its square h has a second derivative of at least
    2 (x'^2 + y'^2 - |y| M), so that h there is above the least one by no more than h'^2 over twice that.
    """
    bend = 8.0 * off
    t = min(max(t - 0.5 * from_axis(m, t, x0, y0, w0)[1] / (dx * dx + dy * dy + 1e-300), 0.0), 1.0)
    h, rate, w = from_axis(m, t, x0, y0, w0)
    far = (c.wide + EPS) ** 2
    if h < far:
        return 1 if -EPS < w < c.height + EPS else -1
    slope = max(abs(dy) - 0.5 * bend, 0.0)
    curve = 2.0 * (dx * dx + slope * slope - (max(abs(y0), abs(y0 + dy)) + off) * bend)
    if curve > 0.0:
        if (t > 0.0 or rate < 0.0) and (t < 1.0 or rate > 0.0):
            h -= 0.5 * rate * rate / curve
        if h >= far:
            return 0
    return -1


@njit(cache=True, nogil=True)
def swept(m, c, x, y, z, wait):
    """Whether a point is in the volume that a move sweeps.

    With a fixed axis the point moves along a line in the frame of the cutter; with a turning axis it is never farther
    than M / 8 from its chord. A test with a cylinder that is wider or narrower by this decides most points; for a flat
    mill with a fixed axis it decides all. For a flank alone a Newton step decides most others, see
    :func:`swept_by_flank`.
    """
    x0, y0, w0, dx, dy, dw, bow = chord(m, x, y, z)
    t = nearest_time(x0, y0, dx, dy)
    x1 = x0 + t * dx
    y1 = y0 + t * dy
    far = x1 * x1 + y1 * y1
    off = bow + EPS
    wide = c.wide
    tall = c.height
    if far >= (wide + off) ** 2:
        return False
    least_w = min(w0, w0 + dw)
    most_w = max(w0, w0 + dw)
    if most_w <= -off or least_w >= tall + off:
        return False
    whole = least_w > -off and most_w < tall + off
    if not whole and not in_cylinder(x0, y0, w0, dx, dy, dw, wide + off, -off, tall + off):
        return False
    w = w0 + t * dw
    if c.kind == FLAT:
        if m[THETA] == 0.0:
            return True
        if far < (wide - off) ** 2 and off < w < tall - off:
            return True
        if not whole and in_cylinder(x0, y0, w0, dx, dy, dw, wide - off, off, tall - off):
            return True
    elif from_profile(c, math.sqrt(far), w)[0] < (-off if m[THETA] > 0.0 else EPS):
        return True
    if least_w > c.cylinder + off:
        known = swept_by_flank(m, c, t, x0, y0, w0, dx, dy, bow)
        if known >= 0:
            return known == 1
    elif c.kind == FLAT:
        h, _, w = from_axis(m, t, x0, y0, w0)
        if h < (wide + EPS) ** 2 and -EPS < w < tall + EPS:
            return True
    return least_from(m, c, x, y, z, t, EPS, EPS, KNOWN, wait)[1] < EPS


@njit(cache=True, nogil=True)
def estimated_least(m, c, x, y, z):
    """Estimate of the least f [mm] of a point over a move, for the search of its zero: f near the time at which the
    point is nearest to the axis; near the corner or the bottom after two further steps along its rate.
    """
    x0, y0, w0, dx, dy, dw, _ = chord(m, x, y, z)
    t = nearest_time(x0, y0, dx, dy)
    if m[THETA] > 0.0:
        size = dx * dx + dy * dy + 1e-300
        for _ in range(2):
            t = min(max(t - 0.5 * from_axis(m, t, x0, y0, w0)[1] / size, 0.0), 1.0)
        h, _, w = from_axis(m, t, x0, y0, w0)
    else:
        w = w0 + t * dw
        h = (x0 + t * dx) ** 2 + (y0 + t * dy) ** 2
    rho = math.sqrt(h)
    f, _, nw = from_profile(c, rho, w)
    if nw == 0.0:
        return f
    f, s = outside_distance(m, c, t, x, y, z)
    size = dx * dx + dy * dy + dw * dw
    if size == 0.0:
        return f
    to = min(max(t - s * c.wide / size, 0.0), 1.0)
    f1, s1 = outside_distance(m, c, to, x, y, z)
    if s1 != s:
        f2, _ = outside_distance(m, c, min(max(to - s1 * (to - t) / (s1 - s), 0.0), 1.0), x, y, z)
        f1 = min(f1, f2)
    return min(f, f1)


@njit(cache=True, nogil=True)
def swept_share_of_ball(m, c, x, y, z, r, wait):
    """Part of a ball of radius r [mm] about a point that the move sweeps: 1 all, 0 none, -1 a part, or unknown."""
    x0, y0, w0, dx, dy, dw, off = chord(m, x, y, z)
    t = nearest_time(x0, y0, dx, dy)
    far = (x0 + t * dx) ** 2 + (y0 + t * dy) ** 2
    out = r + off
    if far >= (c.wide + out) ** 2:
        return 0
    least_w = min(w0, w0 + dw)
    if max(w0, w0 + dw) <= -out or least_w >= c.height + out:
        return 0
    if from_profile(c, math.sqrt(far), w0 + t * dw)[0] < -out:
        return 1
    if least_w > c.cylinder + out:
        return -1
    low, high = least_from(m, c, x, y, z, t, r, -r, NEAR * r, wait)
    if low >= r:
        return 0
    return 1 if high < -r else -1
