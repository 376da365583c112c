"""Compiled loops of the dexels: where a ray is in a cutter, and which parts a moving cutter removes from it.

Notation: a ray runs along the axis k of the grid, s [mm] is its coordinate k; its others are at u = (k + 1) % 3 and
v = (k + 2) % 3. The cutter stands with its tip at T and its unit axis A; z [mm] is the height above the tip, rho [mm]
the distance from the axis. ``shape`` is ``[r, e, f, m, z1, z2, c, tb, h, big]``: APT corner radius r and its centre
(e, f), the bottom rho = m z up to z1 (m = 0: none), the corner up to z2, the flank rho = c + tb z up to the height h;
``big`` is the largest rho; then ``[R, E, F, z3]`` of the flank arc of a barrel, between z2 and z3 (R = 0: none). Such a
body is convex, so that a ray is in it over one interval; an empty one has lo > hi.

In a move lo(t) and hi(t) are continuous while the ray is in the body, so that one passage takes the interval from min
lo to max hi. A straight move makes lo convex and hi concave: chords bound what lies between two moments; a turn bends
that by the square of its angle.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: most steps along a corner that is a torus; the error there is below 1e-10 mm save where a ray touches it
NEWTON = 60
#: halvings of the moment at which a ray is met, and most steps to the deepest moment
HALVINGS, GOLDEN = 14, 40
STEP = 1e-4
#: greatest distance of a pose from the middle of its neighbours on an even path, as a share of their distance
EVEN = 1e-3
RATIO = 0.6180339887498949


@njit(cache=True, nogil=True)
def band(z0, slope, low, high):
    """Interval of s in which low <= z0 + slope s <= high."""
    if abs(slope) < 1e-15:
        if low <= z0 <= high:
            return -1e300, 1e300
        return 1.0, 0.0
    a, b = (low - z0) / slope, (high - z0) / slope
    if a > b:
        a, b = b, a
    return a, b


@njit(cache=True, nogil=True)
def times_below(a, b, c, low, high):
    """Where a s^2 + 2 b s + c <= 0 in low .. high; the longer part where there are two (at the tip of a cone)."""
    if abs(a) < 1e-14:
        if abs(b) < 1e-14:
            if c <= 0.0:
                return low, high
            return 1.0, 0.0
        if b > 0.0:
            return low, min(high, -0.5 * c / b)
        return max(low, -0.5 * c / b), high
    disc = b * b - a * c
    if disc < 0.0:
        if a > 0.0:
            return 1.0, 0.0
        return low, high
    q = -(b + math.copysign(math.sqrt(disc), b))
    s1 = q / a
    s2 = c / q if q != 0.0 else 0.0
    if s1 > s2:
        s1, s2 = s2, s1
    if a > 0.0:
        return max(low, s1), min(high, s2)
    left, right = min(high, s1) - low, high - max(low, s2)
    if left >= right:
        return low, min(high, s1)
    return max(low, s2), high


@njit(cache=True, nogil=True)
def corner_end(s, sign, far, u2, u1, u0, z0, slope, r, e, f):
    """From s onward (``sign`` 1) or back (-1) to ``far`` the first point within r of the disc of radius e at z = f.

    The distance is convex along the ray, so that Newton's steps come from one side. Returns (found, s).
    """
    for _ in range(NEWTON):
        rho = math.sqrt(max(0.0, (u2 * s + 2.0 * u1) * s + u0))
        z = z0 + slope * s
        out = max(0.0, rho - e)
        d = math.sqrt(out * out + (f - z) ** 2)
        g = d - r
        if g <= 0.0:
            return True, s
        turn = -(f - z) * slope
        if out > 0.0:
            turn += out * (u2 * s + u1) / rho
        turn = sign * turn / d
        if turn >= 0.0:
            return False, s
        step = -g / turn
        s += sign * step
        if sign * (s - far) > 0.0:
            return False, s
        if step < 1e-11:
            return True, s
    return True, s


@njit(cache=True, nogil=True)
def pierce(k, u, v, tip, axis, shape):
    """Interval (lo, hi) of the ray (u, v) along axis k in the cutter; lo > hi: none."""
    r, e, f, m, z1, z2 = shape[0], shape[1], shape[2], shape[3], shape[4], shape[5]
    c, tb, h = shape[6], shape[7], shape[8]
    R, z3 = shape[10], shape[13]
    ku, kv = (k + 1) % 3, (k + 2) % 3
    wu, wv = u - tip[ku], v - tip[kv]
    au, av, slope = axis[ku], axis[kv], axis[k]
    z0 = wu * au + wv * av
    # rho^2 = u2 s^2 + 2 u1 s + u0, with s from the tip
    u2 = au * au + av * av
    u1 = -z0 * slope
    cross = wu * av - wv * au
    u0 = cross * cross + slope * slope * (wu * wu + wv * wv)
    lo, hi = 1e300, -1e300
    if m > 0.0 and z1 > 0.0:
        a, b = band(z0, slope, 0.0, min(z1, h))
        if a <= b:
            ms = m * slope
            a, b = times_below(u2 - ms * ms, u1 - m * z0 * ms, u0 - (m * z0) ** 2, a, b)
            if a <= b:
                lo, hi = min(lo, a), max(hi, b)
    if r > 0.0 and z1 < h:
        a, b = band(z0, slope, z1, min(z2, h))
        if a <= b:
            if e <= 0.0:
                a, b = times_below(1.0, u1 + (z0 - f) * slope, u0 + (z0 - f) ** 2 - r * r, a, b)
            else:
                # the part within e + r of the axis is finite for every ray that is not along it
                a, b = times_below(u2, u1, u0 - (e + r) ** 2, a, b)
                if a <= b:
                    there, a = corner_end(a, 1.0, b, u2, u1, u0, z0, slope, r, e, f)
                    if there:
                        there, b = corner_end(b, -1.0, a, u2, u1, u0, z0, slope, r, e, f)
                    if not there:
                        a, b = 1.0, 0.0
            if a <= b:
                lo, hi = min(lo, a), max(hi, b)
    if R > 0.0 and z2 < h:
        a, b = band(z0, slope, z2, min(z3, h))
        if a <= b:
            E, F = shape[11], shape[12]
            # the cylinder around the arc is finite for every ray that is not along it
            a, b = times_below(u2, u1, u0 - (E + R) ** 2, a, b)
            if a <= b:
                there, a = corner_end(a, 1.0, b, u2, u1, u0, z0, slope, R, E, F)
                if there:
                    there, b = corner_end(b, -1.0, a, u2, u1, u0, z0, slope, R, E, F)
                if not there:
                    a, b = 1.0, 0.0
            if a <= b:
                lo, hi = min(lo, a), max(hi, b)
    if z3 < h:
        a, b = band(z0, slope, z3, h)
        if a <= b:
            ms, at = tb * slope, c + tb * z0
            a, b = times_below(u2 - ms * ms, u1 - at * ms, u0 - at * at, a, b)
            if a <= b:
                lo, hi = min(lo, a), max(hi, b)
    return lo + tip[k], hi + tip[k]


@njit(cache=True, nogil=True)
def pierce_at(k, u, v, t, tips, axes, shape, tip, axis):
    """:func:`pierce` between the poses: t = 1.5 is half-way from pose 1 to pose 2; axes by normalised lerp."""
    i = min(int(t), len(tips) - 2)
    w = t - i
    norm = 0.0
    for j in range(3):
        tip[j] = tips[i, j] * (1.0 - w) + tips[i + 1, j] * w
        axis[j] = axes[i, j] * (1.0 - w) + axes[i + 1, j] * w
        norm += axis[j] * axis[j]
    norm = math.sqrt(norm)
    for j in range(3):
        axis[j] /= norm
    return pierce(k, u, v, tip, axis, shape)


@njit(cache=True, nogil=True)
def signed_end(k, u, v, t, sign, tips, axes, shape, tip, axis):
    """The lower end (``sign`` 1) or less the upper end (-1) of the ray in the cutter at the moment t."""
    lo, hi = pierce_at(k, u, v, t, tips, axes, shape, tip, axis)
    if lo > hi:
        return 1e300
    return lo if sign > 0 else -hi


@njit(cache=True, nogil=True)
def deepest(k, u, v, ta, tb, sign, tol, tips, axes, shape, tip, axis):
    """Least :func:`signed_end` between two moments, by golden section until chords prove that it is within ``tol``."""
    fa = signed_end(k, u, v, ta, sign, tips, axes, shape, tip, axis)
    fb = signed_end(k, u, v, tb, sign, tips, axes, shape, tip, axis)
    # at an end from which it rises it is least, but for what a short first step may hide
    # (by the chord over the rest of the way, less than tol)
    step = min(STEP, 0.5 * tol / abs(fb - fa)) * (tb - ta) if fa != fb else 0.0
    if fa < fb:
        if signed_end(k, u, v, ta + step, sign, tips, axes, shape, tip, axis) >= fa:
            return fa
    elif fb < fa and signed_end(k, u, v, tb - step, sign, tips, axes, shape, tip, axis) >= fb:
        return fb
    t1, t2 = tb - RATIO * (tb - ta), ta + RATIO * (tb - ta)
    f1 = signed_end(k, u, v, t1, sign, tips, axes, shape, tip, axis)
    f2 = signed_end(k, u, v, t2, sign, tips, axes, shape, tip, axis)
    best = min(fa, fb, f1, f2)
    for _ in range(GOLDEN):
        if f1 <= f2:
            # the least is left of t2; the golden steps make t1 - ta and t2 - t1 alike
            if max(fa - f1, 2.0 * (f2 - f1)) < tol:
                break
            tb, fb, t2, f2 = t2, f2, t1, f1
            t1 = tb - RATIO * (tb - ta)
            f1 = signed_end(k, u, v, t1, sign, tips, axes, shape, tip, axis)
            best = min(best, f1)
        else:
            if max(fb - f2, 2.0 * (f1 - f2)) < tol:
                break
            ta, fa, t1, f1 = t1, f1, t2, f2
            t2 = ta + RATIO * (tb - ta)
            f2 = signed_end(k, u, v, t2, sign, tips, axes, shape, tip, axis)
            best = min(best, f2)
    return best


@njit(cache=True, nogil=True)
def edge(k, u, v, inside, outside, tips, axes, shape, tip, axis):
    """Moment between one at which the ray is met and one at which it is not, as late as it is met."""
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        lo, hi = pierce_at(k, u, v, middle, tips, axes, shape, tip, axis)
        if lo <= hi:
            inside = middle
        else:
            outside = middle
    return inside


@njit(cache=True, nogil=True)
def subtract(ray, lo, hi, ends, count):
    """Take lo .. hi from the intervals of a ray; False (and nothing done) where there is no room."""
    n = count[ray]
    first = 0
    while first < n and ends[ray, first, 1] <= lo:
        first += 1
    if first == n or ends[ray, first, 0] >= hi:
        return True
    if ends[ray, first, 0] < lo and ends[ray, first, 1] > hi:
        if n == ends.shape[1]:
            return False
        for i in range(n, first, -1):
            ends[ray, i, 0], ends[ray, i, 1] = ends[ray, i - 1, 0], ends[ray, i - 1, 1]
        ends[ray, first, 1] = lo
        ends[ray, first + 1, 0] = hi
        count[ray] = n + 1
        return True
    if ends[ray, first, 0] < lo:
        ends[ray, first, 1] = lo
        first += 1
    last = first
    while last < n and ends[ray, last, 1] <= hi:
        last += 1
    if last < n and ends[ray, last, 0] < hi:
        ends[ray, last, 0] = hi
    if last > first:
        for i in range(last, n):
            ends[ray, i - last + first, 0], ends[ray, i - last + first, 1] = ends[ray, i, 0], ends[ray, i, 1]
        count[ray] = n - (last - first)
    return True


@njit(cache=True, nogil=True)
def boxes(k, tips, axes, shape, out):
    """Rectangle (u0, u1, v0, v1) about the cutter at each pose, seen along axis k."""
    h, big = shape[8], shape[9]
    for i in range(len(tips)):
        for n in range(2):
            j = (k + 1 + n) % 3
            a = axes[i, j]
            wide = big * math.sqrt(max(0.0, 1.0 - a * a))
            top = tips[i, j] + h * a
            out[i, 2 * n] = min(tips[i, j], top) - wide
            out[i, 2 * n + 1] = max(tips[i, j], top) + wide


@njit(cache=True, nogil=True)
def turns(tips, axes, h):
    """Number of poses before each (m + 1,) at which the tip or the top does not go on evenly and straight: where it
    does at all poses of a passage, the ends of a ray in the cutter are convex over its time.
    """
    m = len(tips)
    out = np.zeros(m + 1, dtype=np.int64)
    for i in range(m):
        even = True
        if 0 < i < m - 1:
            bend, way = np.zeros(2), np.zeros(2)
            for j in range(3):
                for n in range(2):
                    a = tips[i - 1, j] + n * h * axes[i - 1, j]
                    b = tips[i, j] + n * h * axes[i, j]
                    c = tips[i + 1, j] + n * h * axes[i + 1, j]
                    bend[n] += (a - 2.0 * b + c) ** 2
                    way[n] += (c - a) ** 2
            even = bend[0] <= EVEN**2 * way[0] and bend[1] <= EVEN**2 * way[1]
        out[i + 1] = out[i] + (not even)
    return out


@njit(cache=True, nogil=True)
def solid_length(ray, ends, count):
    """Length of the solid intervals of a ray [mm]."""
    length = 0.0
    for i in range(count[ray]):
        length += ends[ray, i, 1] - ends[ray, i, 0]
    return length


@njit(cache=True, nogil=True)
def cut(k, grid, tol, tips, axes, shape, ends, count, lost):
    """Remove what the cutter covers on its path through the poses from the rays along axis k.

    ``grid`` is ``[u0, v0, du, dv, nu, nv]``: the first ray, the distances, the numbers; ray (i, j) is i * nv + j.
    ``tol`` [mm] is the greatest error of the extremes. The length that the rays lose [mm] is added to ``lost`` (1,).
    Returns False where a ray had no room for its intervals: call it again with more room; intervals already removed
    stay removed.
    """
    u0, v0, du, dv = grid[0], grid[1], grid[2], grid[3]
    nu, nv = int(grid[4]), int(grid[5])
    m = len(tips)
    box = np.empty((m, 4))
    boxes(k, tips, axes, shape, box)
    i0 = max(0, math.ceil((box[:, 0].min() - u0) / du))
    i1 = min(nu - 1, math.floor((box[:, 1].max() - u0) / du))
    j0 = max(0, math.ceil((box[:, 2].min() - v0) / dv))
    j1 = min(nv - 1, math.floor((box[:, 3].max() - v0) / dv))
    tip, axis = np.empty(3), np.empty(3)
    los, his = np.empty(m), np.empty(m)
    bends = turns(tips, axes, shape[8])
    room = True
    for i in range(i0, i1 + 1):
        u = u0 + i * du
        for j in range(j0, j1 + 1):
            ray = i * nv + j
            if count[ray] == 0:
                continue
            v = v0 + j * dv
            for move in range(m):
                if box[move, 0] <= u <= box[move, 1] and box[move, 2] <= v <= box[move, 3]:
                    los[move], his[move] = pierce(k, u, v, tips[move], axes[move], shape)
                else:
                    los[move], his[move] = 1.0, 0.0
            n = np.int64(0)
            before = -1.0
            while n < m:
                if los[n] > his[n]:
                    n += 1
                    continue
                if before < 0.0:
                    before = solid_length(ray, ends, count)
                start = n
                while n < m and los[n] <= his[n]:
                    n += 1
                done = passage(k, u, v, ray, start, n, los, his, tol, bends, tips, axes, shape, tip, axis, ends, count)
                room = done and room
            if before > 0.0:
                lost[0] += before - solid_length(ray, ends, count)
    return room


@njit(cache=True, nogil=True)
def solid_between(ray, lo, hi, ends, count):
    """Whether the ray has solid in lo .. hi."""
    for i in range(count[ray]):
        if ends[ray, i, 1] > lo:
            return ends[ray, i, 0] < hi
    return False


@njit(cache=True, nogil=True)
def spare(values, a, start, stop, sign):
    """How far below its least pose a convex function (sign times ``values``) may be between poses, by chords."""
    most = 0.0
    for way in (-1, 1):
        if not start <= a + way < stop:
            continue
        if start <= a - way < stop:
            most = max(most, sign * (values[a - way] - values[a]))
        elif start <= a + 2 * way < stop:
            most = max(most, sign * (values[a] - 2.0 * values[a + way] + values[a + 2 * way]))
        else:
            return 1e300
    return most


@njit(cache=True, nogil=True)
def passage(k, u, v, ray, start, stop, los, his, tol, bends, tips, axes, shape, tip, axis, ends, count):
    """Take what the poses start .. stop - 1, at all of which the ray is met, and the moments about them cover."""
    n = count[ray]
    if n == 0:
        return True
    a, b = start, start
    for i in range(start + 1, stop):
        if los[i] < los[a]:
            a = i
        if his[i] > his[b]:
            b = i
    lo, hi = los[a], his[b]
    if lo <= ends[ray, 0, 0] and hi >= ends[ray, n - 1, 1]:
        count[ray] = 0
        return True
    ta, tb = float(start), float(stop - 1)
    within = start == 0 and stop == len(tips)
    if within or (stop - start > 1 and bends[stop] == bends[start]):
        # twice what the chords allow, also beyond the first and the last pose
        p, q = lo - 2.0 * spare(los, a, start, stop, 1.0), hi + 2.0 * spare(his, b, start, stop, -1.0)
        if start > 0:
            p = min(p, los[start] - 2.0 * max(0.0, los[start + 1] - los[start]))
            q = max(q, his[start] + 2.0 * max(0.0, his[start] - his[start + 1]))
        if stop < len(tips):
            p = min(p, los[stop - 1] - 2.0 * max(0.0, los[stop - 2] - los[stop - 1]))
            q = max(q, his[stop - 1] + 2.0 * max(0.0, his[stop - 1] - his[stop - 2]))
        if not solid_between(ray, p, q, ends, count):
            return True
    if start > 0:
        ta = edge(k, u, v, ta, ta - 1.0, tips, axes, shape, tip, axis)
    if stop < len(tips):
        tb = edge(k, u, v, tb, tb + 1.0, tips, axes, shape, tip, axis)
    if tb > ta:
        if lo > ends[ray, 0, 0]:
            t0, t1 = max(ta, a - 1.0), min(tb, a + 1.0)
            lo = min(lo, deepest(k, u, v, t0, t1, np.int64(1), tol, tips, axes, shape, tip, axis))
        if hi < ends[ray, n - 1, 1]:
            t0, t1 = max(ta, b - 1.0), min(tb, b + 1.0)
            hi = max(hi, -deepest(k, u, v, t0, t1, np.int64(-1), tol, tips, axes, shape, tip, axis))
    return subtract(ray, lo, hi, ends, count)
