"""Compiled loops of the immersion; arrays and scalars only.

Notation as in :mod:`layer_oracle.immersion`: phi immersion, u = cos(phi) n + sin(phi) T, a sinusoid
a cos(phi) + b sin(phi) + c is written (a, b, c); p a point of the edge, q the point of the cutter's surface uphill or
downhill of it at the height of a section. ``slices`` (k, 9): s from, s to, rho, z at the middle, sin kappa, cos kappa,
z at s from and to, radius of the arc (0: straight).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

TAU = 2.0 * math.pi
#: shortest interval of immersion that is kept [rad]
SHORT = 1e-9
#: share of its motion across its own face below which an edge does not cut
ALONG = 1e-9
#: difference of its heights below which a slice is level [mm]
LEVEL = 1e-9
#: part of the axis in the plane below which it is upright
UPRIGHT = 1e-12
#: samples of immersion in a revolution, and halvings between two of them, where the axis leans
SAMPLES = 96
HALVINGS = 20


@njit(cache=True, nogil=True)
def roots(a, b, c, out, count):
    """Add the zeros of a cos(phi) + b sin(phi) + c in [0, 2 pi) to ``out`` from ``count`` on; the new count."""
    size = math.hypot(a, b)
    if size <= abs(c):
        return count
    middle = math.atan2(b, a)
    half = math.acos(-c / size)
    out[count] = (middle + half) % TAU
    out[count + 1] = (middle - half) % TAU
    return count + 2


@njit(cache=True, nogil=True)
def crossings(mid, flat, radius, edges, first, last, out, count):
    """Add where the projected circle ``mid`` + radius (cos(phi) flat[0] + sin(phi) flat[1]) crosses edges."""
    for e in range(first, last):
        x0 = edges[e, 0]
        y0 = edges[e, 1]
        dx = edges[e, 2] - x0
        dy = edges[e, 3] - y0
        c = dx * (mid[1] - y0) - dy * (mid[0] - x0)
        a = radius * (dx * flat[0, 1] - dy * flat[0, 0])
        b = radius * (dx * flat[1, 1] - dy * flat[1, 0])
        size2 = a * a + b * b
        if size2 <= c * c:
            continue
        middle = math.atan2(b, a)
        half = math.acos(-c / math.sqrt(size2))
        long2 = dx * dx + dy * dy
        for side in range(2):
            phi = middle + half if side == 0 else middle - half
            co = radius * math.cos(phi)
            si = radius * math.sin(phi)
            px = mid[0] + co * flat[0, 0] + si * flat[1, 0] - x0
            py = mid[1] + co * flat[0, 1] + si * flat[1, 1] - y0
            along = px * dx + py * dy
            if -SHORT * long2 <= along <= (1.0 + SHORT) * long2:
                if count >= len(out):
                    return count
                out[count] = phi % TAU
                count += 1
    return count


@njit(cache=True, nogil=True)
def covers(x, y, edges, first, last):
    """Whether (x, y) is in the polygons whose edges are given: a ray along +x."""
    odd = False
    for e in range(first, last):
        y0 = edges[e, 1]
        y1 = edges[e, 3]
        if (y0 > y) != (y1 > y):
            x0 = edges[e, 0]
            if x0 + (y - y0) / (y1 - y0) * (edges[e, 2] - x0) > x:
                odd = not odd
    return odd


@njit(cache=True, nogil=True)
def layer_of(z, bounds):
    """The layer that holds z, -1 where none does."""
    if z < bounds[0] or z >= bounds[-1]:
        return -1
    return int(np.searchsorted(bounds, z, side="right")) - 1


@njit(cache=True, nogil=True)
def layer_below(z, bounds):
    """The layer whose section lies next below z, the lowest one where there is none; -1 outside the layers."""
    row = layer_of(z, bounds)
    if row > 0 and z < 0.5 * (bounds[row] + bounds[row + 1]):
        row -= 1
    return row


@njit(cache=True, nogil=True)
def thickness(rho, z, sk, ck, frame, speed, turn, out):
    """The sinusoid of the chip thickness at a point of the profile: cosine, sine, constant into ``out``; the way."""
    T, n, A = frame[0], frame[1], frame[2]
    swing = np.cross(A, turn)
    lever = np.cross(turn, A)
    out[:] = 0.0
    for i in range(3):
        w = sk * (speed[i] + z * lever[i]) - rho * ck * swing[i]
        out[0] += w * n[i]
        out[1] += w * T[i]
        out[2] -= ck * speed[i] * A[i]
    return math.sqrt(speed @ speed) + math.sqrt(turn @ turn) * (abs(z) + rho)


@njit(cache=True, nogil=True)
def add_row(rows, owner, total, p, q, s_from, s_to, h, k):
    """Write an engagement range; the number of engagement ranges after it, -1 where there is no room."""
    if total == len(rows):
        return -1
    first = p % TAU
    rows[total, 0] = first
    rows[total, 1] = first + (q - p)
    rows[total, 2] = s_from
    rows[total, 3] = s_to
    rows[total, 4] = h[1]
    rows[total, 5] = h[2]
    rows[total, 6] = h[0]
    owner[total] = k
    return total + 1


@njit(cache=True, nogil=True)
def at_height(slice_, z, out):
    """The place of a rising slice at the height z on the tip: s, rho, sin kappa, cos kappa into ``out``."""
    r = slice_[8]
    middle = 0.5 * (slice_[0] + slice_[1])
    if r > 0.0:
        ck = min(max(slice_[5] - (z - slice_[3]) / r, -1.0), 1.0)
        kappa = math.acos(ck)
        out[0] = middle + r * (kappa - math.atan2(slice_[4], slice_[5]))
        out[2] = math.sin(kappa)
        out[3] = ck
        out[1] = slice_[2] + r * (out[2] - slice_[4])
    else:
        out[0] = middle + (z - slice_[3]) / slice_[4]
        out[1] = slice_[2] + (out[0] - middle) * slice_[5]
        out[2] = slice_[4]
        out[3] = slice_[5]


@njit(cache=True, nogil=True)
def on_surface(dz, rho, sk, ck, r, widest, out):
    """The circle of an upright cutter dz [mm] above one of its circles: rho, sin and cos kappa; False: it has none."""
    if r > 0.0:
        cosine = ck - dz / r
        if cosine >= 1.0:
            return False
        out[2] = max(cosine, 0.0)
        out[1] = math.sqrt(1.0 - out[2] * out[2])
        out[0] = rho + r * (out[1] - sk)
    else:
        out[1] = sk
        out[2] = ck
        out[0] = min(rho + dz * ck / sk, widest)
    return out[0] > 0.0


@njit(cache=True, nogil=True)
def band(
    tip,
    frame,
    speed,
    turn,
    slice_,
    k,
    layer,
    place,
    s_from,
    s_to,
    widest,
    bounds,
    start,
    edges,
    breaks,
    rows,
    owner,
    total,
):
    """Tooth engagement of one slice of an upright cutter between two bounds of layers, ``place``: s, rho, sine,
    cosine there.
    """
    h = np.empty(3)
    hq = np.empty(3)
    q = np.empty(3)
    mid = tip[:2]
    flat = np.empty((2, 2))
    flat[0, 0], flat[0, 1] = frame[1, 0], frame[1, 1]
    flat[1, 0], flat[1, 1] = frame[0, 0], frame[0, 1]
    rho, sk, ck = place[1], place[2], place[3]
    r = slice_[8]
    z = slice_[3] + (r * (slice_[5] - ck) if r > 0.0 else (place[0] - 0.5 * (slice_[0] + slice_[1])) * slice_[4])
    least = ALONG * thickness(rho, z, sk, ck, frame, speed, turn, h)
    if math.hypot(h[0], h[1]) + h[2] <= least:
        return total
    height = tip[2] + z
    middle = 0.5 * (bounds[layer] + bounds[layer + 1])
    under = layer_below(height, bounds)
    steep = slice_[7] - slice_[6] > LEVEL
    has = steep and on_surface(middle - height, rho, sk, ck, r, widest, q)
    always = False
    count = roots(h[0], h[1], h[2] - least, breaks, 0)
    if has:
        thickness(q[0], z + middle - height, q[1], q[2], frame, speed, turn, hq)
        always = hq[2] == 0.0 and h[2] == 0.0 and turn[0] == 0.0 and turn[1] == 0.0 and turn[2] == 0.0
        count = crossings(mid, flat, q[0], edges, start[layer], start[layer + 1], breaks, count)
        if not always:
            count = roots(hq[0], hq[1], hq[2], breaks, count)
    if not always:
        count = crossings(mid, flat, rho, edges, start[under], start[under + 1], breaks, count)
    if count == 0:
        breaks[0] = 0.0
        count = 1
    breaks[:count].sort()
    opened = -1
    for b in range(count):
        p = breaks[b]
        to = breaks[b + 1] if b + 1 < count else breaks[0] + TAU
        if to - p < SHORT:
            continue
        phi = 0.5 * (p + to)
        co, si = math.cos(phi), math.sin(phi)
        kept = h[1] * si + h[0] * co + h[2] > least
        if kept:
            onto = has and (always or hq[1] * si + hq[0] * co + hq[2] > 0.0)
            wide = q[0] if onto else rho
            row = layer if onto else under
            x = mid[0] + wide * (co * flat[0, 0] + si * flat[1, 0])
            y = mid[1] + wide * (co * flat[0, 1] + si * flat[1, 1])
            kept = covers(x, y, edges, start[row], start[row + 1])
        if not kept:
            opened = -1
            continue
        if opened >= 0 and p - rows[opened, 1] < SHORT:
            rows[opened, 1] = to
            continue
        total = add_row(rows, owner, total, p, to, s_from, s_to, h, k)
        if total < 0:
            return -1
        opened = total - 1
    return total


@njit(cache=True, nogil=True)
def upright(tip, frame, speed, turn, slices, bounds, start, edges, rows, owner):
    """Tooth engagement of a step of an upright cutter, see :func:`step_engagement`."""
    breaks = np.empty(4 * len(edges) + 16)
    place = np.empty(4)
    low, high = np.empty(4), np.empty(4)
    widest = slices[:, 2].max()
    total = 0
    for k in range(len(slices)):
        bottom = tip[2] + slices[k, 6]
        top = tip[2] + slices[k, 7]
        level = slices[k, 7] - slices[k, 6] <= LEVEL
        if level:
            # in one layer, or in none
            first = layer_of(bottom, bounds)
            last = first + 1 if first >= 0 else first
        else:
            first = max(int(np.searchsorted(bounds, bottom, side="right")) - 1, 0)
            last = min(int(np.searchsorted(bounds, top, side="left")), len(bounds) - 1)
        for row in range(first, last):
            s_from, s_to = slices[k, 0], slices[k, 1]
            if not level:
                at_height(slices[k], max(bounds[row], bottom) - tip[2], low)
                at_height(slices[k], min(bounds[row + 1], top) - tip[2], high)
                s_from = s_from if bottom >= bounds[row] else low[0]
                s_to = s_to if top <= bounds[row + 1] else high[0]
                if s_to - s_from <= 0.0:
                    continue
            r = slices[k, 8]
            place[0] = 0.5 * (s_from + s_to)
            place[1], place[2], place[3] = slices[k, 2], slices[k, 4], slices[k, 5]
            off = place[0] - 0.5 * (slices[k, 0] + slices[k, 1])
            if not level and r > 0.0:
                kappa = math.atan2(slices[k, 4], slices[k, 5]) + off / r
                place[2], place[3] = math.sin(kappa), math.cos(kappa)
                place[1] = slices[k, 2] + r * (place[2] - slices[k, 4])
            elif not level:
                place[1] = slices[k, 2] + off * place[3]
            total = band(
                tip, frame, speed, turn, slices[k], k, row, place, s_from, s_to, widest, bounds, start, edges, breaks,
                rows, owner, total,
            )  # fmt: skip
            if total < 0:
                return -1
    return total


@njit(cache=True, nogil=True)
def meets(phi, tip, frame, speed, turn, slice_, bounds, start, edges):
    """Whether the point of a slice of a leaning cutter at phi is in material."""
    rho, z, sk, ck, r = slice_[2], slice_[3], slice_[4], slice_[5], slice_[8]
    co, si = math.cos(phi), math.sin(phi)
    p = np.empty(3)
    nu = np.empty(3)
    for i in range(3):
        u = co * frame[1, i] + si * frame[0, i]
        p[i] = z * frame[2, i] + rho * u
        nu[i] = sk * u - ck * frame[2, i]
    v = speed + np.cross(turn, p)
    height = tip[2] + p[2]
    row = layer_of(height, bounds)
    if row < 0:
        return False
    dz = 0.5 * (bounds[row] + bounds[row + 1]) - height
    x, y = tip[0] + p[0], tip[1] + p[1]
    flat = math.hypot(nu[0], nu[1])
    found = False
    if flat > 0.0:
        if r > 0.0:
            cosine = -nu[2] - dz / r
            if abs(cosine) < 1.0:
                sine = math.sqrt(1.0 - cosine * cosine)
                found = (sine * (v[0] * nu[0] + v[1] * nu[1]) / flat - cosine * v[2]) > 0.0
                shift = r * (sine - flat)
        else:
            shift = -dz * nu[2] / flat
            found = abs(shift) < 0.5 * rho
        if found:
            x += shift * nu[0] / flat
            y += shift * nu[1] / flat
            return covers(x, y, edges, start[row], start[row + 1])
    row = layer_below(height, bounds)
    return covers(x, y, edges, start[row], start[row + 1])


@njit(cache=True, nogil=True)
def find_change(a, b, state, tip, frame, speed, turn, slice_, bounds, start, edges):
    """Where between a and b the state changes that is ``state`` at a."""
    for _ in range(HALVINGS):
        middle = 0.5 * (a + b)
        if meets(middle, tip, frame, speed, turn, slice_, bounds, start, edges) == state:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)


@njit(cache=True, nogil=True)
def leaning_engagement(tip, frame, speed, turn, slices, bounds, start, edges, rows, owner):
    """Tooth engagement of a step of a leaning cutter, see :func:`step_engagement`: sampled over phi, each change
    bisected.
    """
    h = np.empty(3)
    total = 0
    for k in range(len(slices)):
        one = slices[k]
        least = ALONG * thickness(one[2], one[3], one[4], one[5], frame, speed, turn, h)
        size, c = math.hypot(h[0], h[1]), h[2] - least
        if size + c <= 0.0:
            continue
        reach = one[2] * math.hypot(frame[0, 2], frame[1, 2])
        height = tip[2] + one[3] * frame[2, 2]
        if height - reach >= bounds[-1] or height + reach < bounds[0]:
            continue
        middle = math.atan2(h[1], h[0])
        half = math.pi if c >= size else math.acos(-c / size)
        number = max(8, math.ceil(half / math.pi * SAMPLES))
        pitch = 2.0 * half / number
        begin = middle - half
        before = meets(begin + 0.5 * pitch, tip, frame, speed, turn, one, bounds, start, edges)
        opened = begin
        for i in range(1, number + 1):
            a = begin + (i - 0.5) * pitch
            now = before
            if i < number:
                now = meets(a + pitch, tip, frame, speed, turn, one, bounds, start, edges)
            if i < number and now == before:
                continue
            end = begin + 2.0 * half
            if i < number:
                end = find_change(a, a + pitch, before, tip, frame, speed, turn, one, bounds, start, edges)
            if before and end - opened > SHORT:
                total = add_row(rows, owner, total, opened, end, one[0], one[1], h, k)
                if total < 0:
                    return -1
            opened = end
            before = now
    return total


@njit(cache=True, nogil=True)
def step_engagement(tip, frame, speed, turn, slices, bounds, start, edges, rows, owner):
    """Tooth engagement of one step: fills ``rows`` (m, 7) and ``owner`` (m,), returns their number, -1 where they are
    too few.

    ``frame`` rows T, n, A; ``speed`` (3,) of the tip and ``turn`` (3,) of the axis over one tooth period; the layers
    between ``bounds`` have the edges start[row] .. start[row + 1] - 1.
    """
    if math.hypot(frame[2, 0], frame[2, 1]) < UPRIGHT:
        return upright(tip, frame, speed, turn, slices, bounds, start, edges, rows, owner)
    return leaning_engagement(tip, frame, speed, turn, slices, bounds, start, edges, rows, owner)
