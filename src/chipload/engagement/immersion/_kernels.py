"""Compiled loops of the immersion; arrays and scalars only.

Notation as in :mod:`chipload.engagement.immersion.immersion`: phi immersion, u = cos(phi) n + sin(phi) T, a sinusoid
a cos(phi) + b sin(phi) + c is written (a, b, c).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

TAU = 2.0 * math.pi
#: shortest interval of immersion that is kept [rad]
SHORT = 1e-9
#: an edge that moves along its own face but for this share of its way does not cut
ALONG = 1e-9
#: a slice is level where its heights differ by less than this [mm]
LEVEL = 1e-9


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
def inside(x, y, edges, first, last):
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
def immersed(tip, frame, speed, turn, slices, bounds, start, edges, rows, owner):
    """Bites of one step: fills ``rows`` (m, 7) and ``owner`` (m,), returns their number, -1 where they are too few.

    ``frame`` rows T, n, A; ``speed`` (3,) of the tip and ``turn`` (3,) of the axis over one tooth period; ``slices``
    (k, 8) s from, s to, rho, z at mid, sin kappa, cos kappa, z at s from and to; the layers between ``bounds`` have the
    edges start[l] .. start[l + 1] - 1.
    """
    T = frame[0]
    n = frame[1]
    A = frame[2]
    swing = np.cross(A, turn)
    lever = np.cross(turn, A)
    flat = np.empty((2, 2))
    flat[0, 0] = n[0]
    flat[0, 1] = n[1]
    flat[1, 0] = T[0]
    flat[1, 1] = T[1]
    mid = np.empty(2)
    breaks = np.empty(2 * len(edges) + 2 * len(bounds) + 8)
    total = 0
    for k in range(len(slices)):
        rho = slices[k, 2]
        z = slices[k, 3]
        sk = slices[k, 4]
        ck = slices[k, 5]
        along = 0.0
        across = 0.0
        offset = 0.0
        for i in range(3):
            w = speed[i] + z * lever[i]
            along += (sk * w - rho * ck * swing[i]) * T[i]
            across += (sk * w - rho * ck * swing[i]) * n[i]
            offset -= ck * speed[i] * A[i]
        way = math.sqrt(speed @ speed) + math.sqrt(turn @ turn) * (abs(z) + rho)
        least = ALONG * way
        if math.hypot(along, across) + offset <= least:
            continue
        mid[0] = tip[0] + z * A[0]
        mid[1] = tip[1] + z * A[1]
        height = tip[2] + z * A[2]
        at = layer_of(height, bounds)
        if at < 0:
            at = 0 if height < bounds[0] else len(bounds) - 2
        # a face that looks down cuts the layer whose middle is next below it
        half = 0.5 * (bounds[at + 1] - bounds[at])
        look = height - ck * A[2] * half
        rise = rho + sk * half
        low = look - rise * math.hypot(n[2], T[2])
        high = look + rise * math.hypot(n[2], T[2])
        level = high - low < LEVEL
        # the circles of a level slice lie in layers of their own
        upright = level and (slices[k, 7] - slices[k, 6]) * A[2] > LEVEL
        if upright:
            low = tip[2] + (slices[k, 6] - ck * half) * A[2]
            high = tip[2] + (slices[k, 7] - ck * half) * A[2]
        bottom = max(int(np.searchsorted(bounds, low, side="right")) - 1, 0)
        top = min(int(np.searchsorted(bounds, high, side="left")), len(bounds) - 1)
        if level and not upright:
            bottom = layer_of(look, bounds)
            top = bottom + 1 if bottom >= 0 else -1
        parts = top - bottom if upright else 1
        for part in range(parts):
            first = bottom + part if upright else bottom
            last = first + 1 if upright else top
            if last <= first or start[first] == start[last]:
                continue
            s_from = slices[k, 0]
            s_to = slices[k, 1]
            if upright:
                s_from = max(s_from, s_from + (bounds[first] - low) / (sk * A[2]))
                s_to = min(s_to, s_to - (high - bounds[first + 1]) / (sk * A[2]))
                if s_to <= s_from:
                    continue
            count = roots(across, along, offset - least, breaks, 0)
            if not level:
                for l in range(first, last + 1):
                    count = roots(rise * n[2], rise * T[2], look - bounds[l], breaks, count)
            count = crossings(mid, flat, rho, edges, start[first], start[last], breaks, count)
            if count == 0:
                breaks[0] = 0.0
                count = 1
            breaks[:count].sort()
            open_row = -1
            for b in range(count):
                p = breaks[b]
                q = breaks[b + 1] if b + 1 < count else breaks[0] + TAU
                if q - p < SHORT:
                    continue
                phi = 0.5 * (p + q)
                co = math.cos(phi)
                si = math.sin(phi)
                kept = along * si + across * co + offset > least
                if kept:
                    l = first
                    if not level:
                        l = layer_of(look + rise * (n[2] * co + T[2] * si), bounds)
                    x = mid[0] + rho * (co * n[0] + si * T[0])
                    y = mid[1] + rho * (co * n[1] + si * T[1])
                    kept = l >= 0 and inside(x, y, edges, start[l], start[l + 1])
                if not kept:
                    open_row = -1
                    continue
                if open_row >= 0 and p - rows[open_row, 1] < SHORT:
                    rows[open_row, 1] = q
                    continue
                if total == len(rows):
                    return -1
                rows[total, 0] = p
                rows[total, 1] = q
                rows[total, 2] = s_from
                rows[total, 3] = s_to
                rows[total, 4] = along
                rows[total, 5] = offset
                rows[total, 6] = across
                owner[total] = k
                open_row = total
                total += 1
    return total
