"""Compiled loops over the path of the cutter's centre; arrays and scalars only.

Notation: a **motion** is a row ``[x0, y0, x1, y1, xc, yc, sweep, rho, a0]`` of ``mot``: a segment as in
:mod:`chipload.geometry.contour`, its radius and start angle; of zero length it is a point. A **moment** is a motion k
and the share w in 0..1 of it that has been travelled. ``grid`` is ``(gx, gy, h, nx, ny, start, items, cover)``: cell
c = j nx + i holds the motions ``items[start[c]:start[c + 1]]`` that can reach it, in order, none after ``cover[c]``,
the first that cuts all of it. ``rows`` is ``(y0, dy, n, start, items, piece)``: pieces of the stock's boundary
``[ylo, yhi, up, arc, xa, ya, xb, yb]``, monotone in y, by strips of y; n == 0 is solid everywhere.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

TAU = 2.0 * math.pi


@njit(cache=True, nogil=True)
def place(mot, k, w):
    """Centre and unit heading at the moment (k, w); heading 0, 0 where the motion has no length."""
    sweep = mot[k, 6]
    if sweep == 0.0:
        dx = mot[k, 2] - mot[k, 0]
        dy = mot[k, 3] - mot[k, 1]
        length = math.hypot(dx, dy)
        x = mot[k, 0] + w * dx
        y = mot[k, 1] + w * dy
        if w == 1.0:
            x = mot[k, 2]
            y = mot[k, 3]
        if length == 0.0:
            return x, y, 0.0, 0.0
        return x, y, dx / length, dy / length
    turn = 1.0 if sweep > 0.0 else -1.0
    a = mot[k, 8] + w * sweep
    cos = math.cos(a)
    sin = math.sin(a)
    return mot[k, 4] + mot[k, 7] * cos, mot[k, 5] + mot[k, 7] * sin, -turn * sin, turn * cos


@njit(cache=True, nogil=True)
def places(mot, k, w, centre, heading):
    """Fill ``centre`` (m, 2) and ``heading`` (m, 2) at the moments (k, w)."""
    for q in range(len(k)):
        x, y, tx, ty = place(mot, k[q], w[q])
        centre[q, 0] = x
        centre[q, 1] = y
        heading[q, 0] = tx
        heading[q, 1] = ty


@njit(cache=True, nogil=True)
def nearest(mot, i, first, last, px, py):
    """Distance from (px, py) to the shares first..last of motion i, and the share of the nearest point."""
    sweep = mot[i, 6]
    if sweep == 0.0:
        dx = mot[i, 2] - mot[i, 0]
        dy = mot[i, 3] - mot[i, 1]
        wx = px - mot[i, 0]
        wy = py - mot[i, 1]
        square = dx * dx + dy * dy
        w = (wx * dx + wy * dy) / square if square > 0.0 else last
        w = min(max(w, first), last)
        return math.hypot(wx - w * dx, wy - w * dy), w
    vx = px - mot[i, 4]
    vy = py - mot[i, 5]
    rho = mot[i, 7]
    size = abs(sweep)
    turn = 1.0 if sweep > 0.0 else -1.0
    along = (turn * (math.atan2(vy, vx) - mot[i, 8])) % TAU
    w = along / size
    if first <= w <= last:
        return abs(math.hypot(vx, vy) - rho), w
    a = mot[i, 8] + first * sweep
    b = mot[i, 8] + last * sweep
    da = math.hypot(vx - rho * math.cos(a), vy - rho * math.sin(a))
    db = math.hypot(vx - rho * math.cos(b), vy - rho * math.sin(b))
    if da < db:
        return da, first
    return db, last


@njit(cache=True, nogil=True)
def is_within(mot, i, last, px, py, reach):
    """Whether (px, py) is nearer than ``reach`` to the first share ``last`` of motion i."""
    if mot[i, 6] == 0.0:
        dx = mot[i, 2] - mot[i, 0]
        dy = mot[i, 3] - mot[i, 1]
        wx = px - mot[i, 0]
        wy = py - mot[i, 1]
        square = dx * dx + dy * dy
        w = wx * dx + wy * dy
        if w <= 0.0 or square == 0.0:
            return wx * wx + wy * wy < reach * reach
        w = min(w / square, last)
        ex = wx - w * dx
        ey = wy - w * dy
        return ex * ex + ey * ey < reach * reach
    vx = px - mot[i, 4]
    vy = py - mot[i, 5]
    d = math.sqrt(vx * vx + vy * vy)
    if abs(d - mot[i, 7]) >= reach:
        return False
    ex = px - mot[i, 0]
    ey = py - mot[i, 1]
    if ex * ex + ey * ey < reach * reach:
        return True
    sweep = mot[i, 6]
    if last == 1.0 and abs(sweep) < 3.0:  # the wedge by cross products, without an angle
        ex = px - mot[i, 2]
        ey = py - mot[i, 3]
        if ex * ex + ey * ey < reach * reach:
            return True
        turn = 1.0 if sweep > 0.0 else -1.0
        past = (mot[i, 0] - mot[i, 4]) * vy - (mot[i, 1] - mot[i, 5]) * vx
        left = vx * (mot[i, 3] - mot[i, 5]) - vy * (mot[i, 2] - mot[i, 4])
        return turn * past >= 0.0 and turn * left >= 0.0
    return nearest(mot, i, 0.0, last, px, py)[0] < reach


@njit(cache=True, nogil=True)
def fill_grid(mot, active, radius, slack, gx, gy, h, nx, ny, cover, count, start, items, fill):
    """Two passes. First (``fill`` False): ``cover`` (initially n) and the ``count`` of motions a cell. Then, with
    ``start`` their running sum and ``count`` zeroed: the lists.
    """
    half = h * math.sqrt(0.5)
    far = radius + half + slack
    near = radius - half - slack
    for i in range(len(mot)):
        if not active[i]:
            continue
        line = mot[i, 6] == 0.0
        x0 = min(mot[i, 0], mot[i, 2])
        x1 = max(mot[i, 0], mot[i, 2])
        y0 = min(mot[i, 1], mot[i, 3])
        y1 = max(mot[i, 1], mot[i, 3])
        if not line:
            size = abs(mot[i, 6])
            grow = mot[i, 7] * (1.0 - math.cos(size / 2.0)) if size < math.pi else 2.0 * mot[i, 7]
            x0 -= grow
            y0 -= grow
            x1 += grow
            y1 += grow
        dx = mot[i, 2] - mot[i, 0]
        dy = mot[i, 3] - mot[i, 1]
        length = math.hypot(dx, dy)
        j0 = max(int((y0 - far - gy) / h) - 1, 0)
        j1 = min(int((y1 + far - gy) / h) + 1, ny - 1)
        for j in range(j0, j1 + 1):
            cy = gy + (j + 0.5) * h
            xlo = x0 - far
            xhi = x1 + far
            if line and abs(dy) > 1e-9 * length:  # the strip about the line, in this row of cells
                a = mot[i, 0] + (dx * (cy - mot[i, 1]) - far * length) / dy
                b = mot[i, 0] + (dx * (cy - mot[i, 1]) + far * length) / dy
                xlo = max(xlo, min(a, b))
                xhi = min(xhi, max(a, b))
                if xlo > xhi:
                    continue
            i0 = max(int((xlo - gx) / h) - 1, 0)
            i1 = min(int((xhi - gx) / h) + 1, nx - 1)
            for q in range(i0, i1 + 1):
                c = j * nx + q
                if cover[c] < i:
                    continue
                d = nearest(mot, i, 0.0, 1.0, gx + (q + 0.5) * h, cy)[0]
                if d < far:
                    if fill:
                        items[start[c] + count[c]] = i
                    count[c] += 1
                    if d < near and not fill:
                        cover[c] = i


@njit(cache=True, nogil=True)
def in_stock(px, py, rows):
    """Whether (px, py) lies in the initial stock: winding number > 0 by the crossings of the ray to +x."""
    y0, dy, n, start, items, piece = rows
    if n == 0:
        return True
    j = min(max(int((py - y0) / dy), 0), n - 1)
    total = 0
    for m in range(start[j], start[j + 1]):
        i = items[m]
        if piece[i, 0] <= py < piece[i, 1]:
            if piece[i, 3] == 0.0:
                t = (py - piece[i, 5]) / (piece[i, 7] - piece[i, 5])
                x = piece[i, 4] + t * (piece[i, 6] - piece[i, 4])
            else:
                rho = piece[i, 6]
                e = py - piece[i, 5]
                square = (rho - e) * (rho + e)
                x = piece[i, 4] + piece[i, 7] * (math.sqrt(square) if square > 0.0 else 0.0)
            if x > px:
                total += 1 if piece[i, 2] > 0.0 else -1
    return total > 0


@njit(cache=True, nogil=True)
def uncut(px, py, k, w, reach, own, apart, mot, grid, rows, hint):
    """Whether (px, py) is stock that no centre before the moment (k, w) has come within ``reach`` of, nor one of a
    motion before ``own`` within ``reach + apart``. The stock's own boundary is displaced by ``apart`` as well: above 0
    inwards, below 0 outwards.

    ``hint[0]`` is the motion that cut the last tested point; it is tested first.
    """
    gx, gy, h, nx, ny, start, items, cover = grid
    i = math.floor((px - gx) / h)
    j = math.floor((py - gy) / h)
    if 0 <= i < nx and 0 <= j < ny:
        c = j * nx + i
        if cover[c] < k:
            return False
        last = hint[0]
        if 0 <= last < k and is_within(mot, last, 1.0, px, py, reach + apart if last < own else reach):
            return False
        for m in range(start[c], start[c + 1]):
            q = items[m]
            if q > k:
                break
            if is_within(mot, q, 1.0 if q < k else w, px, py, reach + apart if q < own else reach):
                hint[0] = q
                return False
    if apart == 0.0 or rows[2] == 0:
        return in_stock(px, py, rows)
    # four points, one of which at least is displaced by |apart| across any boundary
    d = abs(apart) * math.sqrt(2.0)
    held = 0
    for dx, dy in ((d, 0.0), (-d, 0.0), (0.0, d), (0.0, -d)):
        if in_stock(px + dx, py + dy, rows):
            held += 1
    return held == 4 if apart > 0.0 else held > 0


@njit(cache=True, nogil=True)
def uncut_many(points, k, w, reach, mot, grid, rows, out):
    """:func:`uncut` for every point (m, 2) at its moment."""
    hint = np.full(1, -1, dtype=np.int64)
    for q in range(len(points)):
        out[q] = uncut(points[q, 0], points[q, 1], k[q], w[q], reach, np.int64(0), 0.0, mot, grid, rows, hint)


@njit(cache=True, nogil=True)
def rim(k, w, centre, heading, radius, reach, own, apart, sample, precision, mot, grid, rows, first, last, angle, count,
        phi):  # fmt: skip
    """Fill ``angle``, ``count`` and ``phi`` of the queries first..last.

    The rim at ``radius`` about ``centre`` is tested at the immersions ``sample`` (rising from 0 to pi); each change is
    halved down to ``precision`` [rad]. ``own`` and ``apart`` as of :func:`uncut`.
    """
    hint = np.full(1, -1, dtype=np.int64)
    sines = np.sin(sample)
    cosines = np.cos(sample)
    for q in range(first, last):
        ox = centre[q, 0]
        oy = centre[q, 1]
        tx = radius * heading[q, 0]
        ty = radius * heading[q, 1]
        pieces = 0
        total = 0.0
        begin = 0.0
        was = False
        for j in range(len(sample)):
            s = sines[j]
            c = cosines[j]
            x, y = ox + s * tx - c * ty, oy + s * ty + c * tx
            now = uncut(x, y, k[q], w[q], reach, own[q], apart, mot, grid, rows, hint)
            if j > 0 and now != was:
                lo = sample[j - 1]
                hi = sample[j]
                while hi - lo > precision:
                    mid = 0.5 * (lo + hi)
                    s = math.sin(mid)
                    c = math.cos(mid)
                    x = ox + s * tx - c * ty
                    y = oy + s * ty + c * tx
                    if uncut(x, y, k[q], w[q], reach, own[q], apart, mot, grid, rows, hint) == was:
                        lo = mid
                    else:
                        hi = mid
                if now:
                    begin = 0.5 * (lo + hi)
            ends = was and not now
            if now and j == len(sample) - 1:
                ends = True
                lo = hi = sample[j]
            if ends:
                end = 0.5 * (lo + hi)
                if pieces < phi.shape[1]:
                    phi[q, pieces, 0] = begin
                    phi[q, pieces, 1] = end
                pieces += 1
                total += end - begin
            if now and j == 0:
                begin = sample[0]
            was = now
        angle[q] = total
        count[q] = pieces


@njit(cache=True, nogil=True)
def centre_path_distance(points, radius, slack, mot, active, grid, out):
    """Distance from each point (m, 2) to the whole path: exact where it is above ``radius + slack``, else at most
    ``slack`` above the least.
    """
    gx, gy, h, nx, ny, start, items, _ = grid
    n = len(mot)
    for p in range(len(points)):
        px = points[p, 0]
        py = points[p, 1]
        i = math.floor((px - gx) / h)
        j = math.floor((py - gy) / h)
        best = math.inf
        if 0 <= i < nx and 0 <= j < ny:
            c = j * nx + i
            for m in range(start[c], start[c + 1]):
                best = min(best, nearest(mot, items[m], 0.0, 1.0, px, py)[0])
        if best > radius + slack:
            for q in range(n):
                if not active[q]:
                    continue
                reach = mot[q, 7] * 2.0 if mot[q, 6] != 0.0 else 0.0
                ex = max(min(mot[q, 0], mot[q, 2]) - px, px - max(mot[q, 0], mot[q, 2])) - reach
                ey = max(min(mot[q, 1], mot[q, 3]) - py, py - max(mot[q, 1], mot[q, 3])) - reach
                if ex >= best or ey >= best:
                    continue
                best = min(best, nearest(mot, q, 0.0, 1.0, px, py)[0])
        out[p] = best


@njit(cache=True, nogil=True)
def signed_distance(points, wall, loose, side, out):
    """Distance from each point (m, 2) to the wall's motions (n, 9), negative on the side of its material.

    ``side`` +1 where the material lies on the left of travel, -1 on the right; ``loose[i]`` has bit 1 where the start
    of segment i is a loose end, bit 2 where its end is: nearest to a loose end no side is told, the distance is
    positive.
    """
    n = len(wall)
    hint = 0
    for p in range(len(points)):
        px = points[p, 0]
        py = points[p, 1]
        best = nearest(wall, hint, 0.0, 1.0, px, py)[0] * (1.0 + 1e-12) + 1e-15
        value = best
        lean = -1.0
        winner = hint
        for i in range(n):
            reach = 2.0 * wall[i, 7] if wall[i, 6] != 0.0 else 0.0
            ex = max(min(wall[i, 0], wall[i, 2]) - px, px - max(wall[i, 0], wall[i, 2])) - reach
            ey = max(min(wall[i, 1], wall[i, 3]) - py, py - max(wall[i, 1], wall[i, 3])) - reach
            if ex > best or ey > best:
                continue
            d, w = nearest(wall, i, 0.0, 1.0, px, py)
            if d > best * (1.0 + 1e-12) + 1e-15:
                continue
            qx, qy, tx, ty = place(wall, i, w)
            cross = tx * (py - qy) - ty * (px - qx)
            if d < best * (1.0 - 1e-12) - 1e-15 or abs(cross) > lean:
                winner = i
                lean = abs(cross)
                value = d
                free = cross * side <= 0.0
                if (w == 0.0 and loose[i] & 1) or (w == 1.0 and loose[i] & 2):
                    free = True
                if not free:
                    value = -d
            best = min(best, d)
        hint = winner
        out[p] = value


@njit(cache=True, nogil=True)
def locate(points, z, mot, z0, z1, tolerance, z_tolerance, k, w):
    """Moments of the points (m, 2) at the heights z, each sought forward from the one before it.

    Returns the number found: m, or the index of the first point that does not lie on the rest of the path.
    """
    motion = 0
    share = 0.0
    for p in range(len(points)):
        found = False
        for i in range(motion, len(mot)):
            low = share if i == motion else 0.0
            x, y, _, _ = place(mot, i, low)
            if math.hypot(points[p, 0] - x, points[p, 1] - y) <= tolerance:  # the start of a full turn is not its end
                at = low
            flat = mot[i, 6] == 0.0 and mot[i, 0] == mot[i, 2] and mot[i, 1] == mot[i, 3]
            d, at = nearest(mot, i, low, 1.0, points[p, 0], points[p, 1])
            if flat:
                rise = z1[i] - z0[i]
                at = 1.0 if rise == 0.0 else min(max((z[p] - z0[i]) / rise, low), 1.0)
            if d <= tolerance and abs(z0[i] + at * (z1[i] - z0[i]) - z[p]) <= z_tolerance:
                found = True
                motion = i
                share = at
                k[p] = i
                w[p] = at
                break
        if not found:
            return p
    return len(points)
