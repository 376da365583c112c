"""Compiled loops of the engagement of a cutter circle with line-and-arc stock; arrays and scalars only.

Notation: segments as in :mod:`chipload.geometry.contour`, with the MATERIAL ON THE LEFT of every segment. The rim is
the circle about (ox, oy) of radius r; rim angles are counter-clockwise from +x [rad].
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

PI = math.pi
TAU = 2.0 * math.pi
MAX_CROSSINGS = 256


@njit(cache=True, nogil=True)
def rim_crossings(ox, oy, r, seg, candidates, n, angle, sign):
    """Where the rim crosses the segments ``seg[candidates[:n]]``: fills ``angle`` in [0, 2 pi) and ``sign`` (+1 the
    rim, run counter-clockwise, enters material there, -1 it leaves), unsorted. Returns the count, -1 if too many.
    """
    count = 0
    for j in range(n):
        i = candidates[j]
        x0 = seg[i, 0]
        y0 = seg[i, 1]
        sweep = seg[i, 6]
        if sweep == 0.0:
            dx = seg[i, 2] - x0
            dy = seg[i, 3] - y0
            length = math.hypot(dx, dy)
            dx /= length
            dy /= length
            wx = x0 - ox
            wy = y0 - oy
            b = wx * dx + wy * dy
            h = wx * dy - wy * dx
            disc = (r - h) * (r + h)
            if disc <= 0.0:
                continue
            root = math.sqrt(disc)
            for k in range(2):
                s = -b + root if k == 0 else -b - root
                if 0.0 <= s < length:
                    if count >= MAX_CROSSINGS:
                        return -1
                    angle[count] = math.atan2(wy + s * dy, wx + s * dx) % TAU
                    sign[count] = 1 if k == 0 else -1
                    count += 1
        else:
            cx = seg[i, 4]
            cy = seg[i, 5]
            wx = cx - ox
            wy = cy - oy
            dist = math.hypot(wx, wy)
            rho = math.hypot(x0 - cx, y0 - cy)
            near = (rho - dist + r) * (rho + dist - r)
            far = (dist + r - rho) * (dist + r + rho)
            if near <= 0.0 or far <= 0.0:
                continue
            beta = 2.0 * math.atan2(math.sqrt(near), math.sqrt(far))
            towards = math.atan2(wy, wx)
            a0 = math.atan2(y0 - cy, x0 - cx)
            turn = 1.0 if sweep > 0.0 else -1.0
            for k in range(2):
                a = towards + beta if k == 0 else towards - beta
                ux = math.cos(a)
                uy = math.sin(a)
                px = r * ux - wx
                py = r * uy - wy
                along = (turn * (math.atan2(py, px) - a0)) % TAU
                if along < abs(sweep):
                    if count >= MAX_CROSSINGS:
                        return -1
                    angle[count] = a % TAU
                    sign[count] = 1 if turn * (px * uy - py * ux) > 0.0 else -1
                    count += 1
    return count


@njit(cache=True, nogil=True)
def rim_arcs(ox, oy, r, seg, candidates, n, enter, leave):
    """The arcs of the whole rim that lie in material: from ``enter[k]`` counter-clockwise to ``leave[k] > enter[k]``.

    Returns their number; -1 where nothing is crossed (the rim is wholly in or wholly out), -2 where the crossings do
    not alternate (a broken boundary). A crossing that falls on a joint can be seen twice or not at all: then the rim
    is tried again with a radius changed by a few parts in 1e12.
    """
    angle = np.empty(MAX_CROSSINGS)
    sign = np.empty(MAX_CROSSINGS, dtype=np.int64)
    for attempt in range(6):
        nudge = 0.0
        if attempt > 0:
            nudge = (1.0 if attempt % 2 == 1 else -1.0) * 10.0 ** (attempt - 13)
        count = rim_crossings(ox, oy, r * (1.0 + nudge), seg, candidates, n, angle, sign)
        if count == 0:
            return -1
        if count < 0 or count % 2 == 1:
            continue
        for i in range(1, count):  # few crossings: insertion sort
            a = angle[i]
            s = sign[i]
            k = i - 1
            while k >= 0 and angle[k] > a:
                angle[k + 1] = angle[k]
                sign[k + 1] = sign[k]
                k -= 1
            angle[k + 1] = a
            sign[k + 1] = s
        ok = True
        for i in range(count):
            if sign[i] == sign[(i + 1) % count]:
                ok = False
                break
        if not ok:
            continue
        first = 0 if sign[0] > 0 else 1
        arcs = count // 2
        for k in range(arcs):
            i = first + 2 * k
            enter[k] = angle[i]
            leave[k] = angle[(i + 1) % count] if i + 1 < count else angle[0] + TAU
        return arcs
    return -2


@njit(cache=True, nogil=True)
def leading_arcs(tx, ty, enter, leave, n, phi_in, phi_out):
    """The rim arcs in material, cut to the front half, as immersion angles.

    Immersion phi is counted from the left normal n = Rot(+90 deg) T clockwise (the sense of a spindle that turns
    clockwise seen from above): phi = pi/2 is straight ahead, the front half is 0..pi. Returns the number of pieces.
    """
    normal = math.atan2(tx, -ty)
    count = 0
    for k in range(n):
        lo = normal - leave[k]
        hi = normal - enter[k]
        turns = math.floor(hi / TAU)
        lo -= turns * TAU
        hi -= turns * TAU
        for shift in range(2):  # hi is in [0, 2 pi): this turn, and the part that began in the turn before
            a = max(lo + shift * TAU, 0.0)
            b = min(hi + shift * TAU, math.pi)
            if b > a:
                phi_in[count] = a
                phi_out[count] = b
                count += 1
    return count


@njit(cache=True, nogil=True)
def side_of(px, py, seg, candidates, n):
    """+1 where (px, py) is in material (left of the nearest segment), -1 where it is not.

    Where the nearest point is a joint the two sides are added: the sign of the bisector is the true one.
    """
    best = math.inf
    lean = 0.0
    for j in range(n):
        i = candidates[j]
        sweep = seg[i, 6]
        if sweep == 0.0:
            dx = seg[i, 2] - seg[i, 0]
            dy = seg[i, 3] - seg[i, 1]
            u = ((px - seg[i, 0]) * dx + (py - seg[i, 1]) * dy) / (dx * dx + dy * dy)
            u = min(max(u, 0.0), 1.0)
            wx = px - seg[i, 0] - u * dx
            wy = py - seg[i, 1] - u * dy
        else:
            cx = seg[i, 4]
            cy = seg[i, 5]
            turn = 1.0 if sweep > 0.0 else -1.0
            a0 = math.atan2(seg[i, 1] - cy, seg[i, 0] - cx)
            rho = math.hypot(seg[i, 0] - cx, seg[i, 1] - cy)
            vx = px - cx
            vy = py - cy
            dist = math.hypot(vx, vy)
            along = (turn * (math.atan2(vy, vx) - a0)) % TAU
            if dist > 0.0 and along <= abs(sweep):
                qx = vx / dist * rho
                qy = vy / dist * rho
            else:
                k = 0 if math.hypot(px - seg[i, 0], py - seg[i, 1]) < math.hypot(px - seg[i, 2], py - seg[i, 3]) else 2
                qx = seg[i, k] - cx
                qy = seg[i, k + 1] - cy
            wx = vx - qx
            wy = vy - qy
            dx = -turn * qy
            dy = turn * qx
        d = math.hypot(wx, wy)
        cross = (dx * wy - dy * wx) / math.hypot(dx, dy)
        if d < best * (1.0 - 1e-12) - 1e-15:
            best = d
            lean = cross
        elif d <= best * (1.0 + 1e-12) + 1e-15:
            lean += cross
    return 1 if lean > 0.0 else -1


@njit(cache=True, nogil=True)
def boxes(seg, out):
    """Bounding boxes (xmin, ymin, xmax, ymax) of the segments; an arc's is that of its chord grown by its bulge."""
    for i in range(len(seg)):
        x0 = seg[i, 0]
        y0 = seg[i, 1]
        x1 = seg[i, 2]
        y1 = seg[i, 3]
        grow = 0.0
        if seg[i, 6] != 0.0:
            rho = math.hypot(x0 - seg[i, 4], y0 - seg[i, 5])
            half = abs(seg[i, 6]) / 2.0
            grow = rho * (1.0 - math.cos(half)) if half < math.pi / 2.0 else 2.0 * rho
        out[i, 0] = min(x0, x1) - grow
        out[i, 1] = min(y0, y1) - grow
        out[i, 2] = max(x0, x1) + grow
        out[i, 3] = max(y0, y1) + grow


@njit(cache=True, nogil=True)
def engage(centres, headings, r, seg, box, first, last, angle, count, phi):
    """Fill ``angle``, ``count``, ``phi`` of queries first..last; candidates are kept while the centre stays near."""
    n = len(seg)
    candidates = np.empty(n, dtype=np.int64)
    everything = np.arange(n)
    kept = np.int64(0)
    anchor_x = math.inf
    anchor_y = math.inf
    reach = r * 0.25
    enter = np.empty(MAX_CROSSINGS)
    leave = np.empty(MAX_CROSSINGS)
    phi_in = np.empty(2 * MAX_CROSSINGS)
    phi_out = np.empty(2 * MAX_CROSSINGS)
    for q in range(first, last):
        ox = centres[q, 0]
        oy = centres[q, 1]
        if not (abs(ox - anchor_x) < reach and abs(oy - anchor_y) < reach):
            anchor_x = ox
            anchor_y = oy
            kept = np.int64(0)
            far = r * 1.001 + reach
            for i in range(n):
                if box[i, 0] <= ox + far and box[i, 2] >= ox - far and box[i, 1] <= oy + far and box[i, 3] >= oy - far:
                    candidates[kept] = i
                    kept += 1
        arcs = rim_arcs(ox, oy, r, seg, candidates, kept, enter, leave)
        if arcs == -1:
            arcs = 0
            if side_of(ox + r * headings[q, 0], oy + r * headings[q, 1], seg, everything, n) > 0:
                arcs = 1
                enter[0] = 0.0
                leave[0] = TAU
        if arcs < 0:
            count[q] = -1
            angle[q] = 0.0
            continue
        m = leading_arcs(headings[q, 0], headings[q, 1], enter, leave, arcs, phi_in, phi_out)
        count[q] = m
        total = 0.0
        for k in range(m):
            total += phi_out[k] - phi_in[k]
            if k < phi.shape[1]:
                phi[q, k, 0] = phi_in[k]
                phi[q, k, 1] = phi_out[k]
        angle[q] = total
