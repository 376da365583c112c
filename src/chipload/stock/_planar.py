"""Compiled loops of the planar stock: the uncut arcs of a rim, and the removal of capsules.

Notation: R [mm] cutter radius; a **capsule** is the disc of radius R swept along an axis from A to B, a line or an
arc. A row of ``axis`` is ``ax, ay, bx, by, xc, yc, rho, t0, sweep``: the ends, and for an arc its centre, radius, the
angle [rad] of A about the centre and the sweep [rad], 0 < sweep <= pi / 2; sweep = 0 is a line. The plane is
cut into square cells; ``head[cell]`` is FULL (no capsule reaches it), EMPTY (it is wholly cleared) or the first entry
of a chain ``link[:, 0]`` (next entry or -1), ``link[:, 1]`` (capsule). ``grid`` is
``[x0, y0, h, nx, ny, reach, piece, room]``: origin, cell side, cells along x and y, the radius of the disc about a
cell's centre for which its status holds, the angle [rad] of the pieces in which a rim is examined, and the greatest
number of entries of one capsule. Entries never change, so that the heads alone define the stock.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

FULL, EMPTY = -1, -2
#: greatest number of separate arcs of a rim
ARCS = 24
#: number of capsules whose arcs of a rim are stored while it is examined
KNOWN = 64
#: rows of the array of the arcs of a rim, and of the workspace after them: the uncut parts of a piece and those after
#: the next capsule, the stored capsules with their number of arcs, and the ends of these
LEFT, NEXT, SEEN, ENDS = ARCS, ARCS + 16, ARCS + 50, ARCS + 50 + KNOWN
RIM = ENDS + 2 * KNOWN
#: least number of capsules that enter a cell before it is pruned for the first time
MORE = 12
#: number of parts of a cell along x and y in pruning, and of a part that no single capsule covers
PARTS, FINER = 8, 4
#: capsules of a cell above which its parts are cut more finely
LONG = 40


@njit(cache=True, nogil=True, inline="always")
def axis_distance(px, py, axis, q):
    """Distance of P from the axis in row q."""
    ax, ay = axis[q, 0], axis[q, 1]
    wx, wy = px - ax, py - ay
    if axis[q, 8] > 0.0:
        xc, yc = axis[q, 4], axis[q, 5]
        ux, uy = px - xc, py - yc
        vx, vy = axis[q, 2] - xc, axis[q, 3] - yc
        if (ax - xc) * uy - (ay - yc) * ux >= 0.0 and ux * vy - uy * vx >= 0.0:
            return abs(math.sqrt(ux * ux + uy * uy) - axis[q, 6])
        vx, vy = px - axis[q, 2], py - axis[q, 3]
        return math.sqrt(min(wx * wx + wy * wy, vx * vx + vy * vy))
    ex, ey = axis[q, 2] - ax, axis[q, 3] - ay
    ll = ex * ex + ey * ey
    t = min(1.0, max(0.0, (wx * ex + wy * ey) / ll)) if ll > 0.0 else 0.0
    dx, dy = wx - t * ex, wy - t * ey
    return math.sqrt(dx * dx + dy * dy)


@njit(cache=True, nogil=True)
def axis_row(ax, ay, bx, by, xc, yc, sweep, row):
    """Fill a row of ``axis``; an arc that turns to the right is stored from its other end."""
    if sweep < 0.0:
        ax, ay, bx, by = bx, by, ax, ay
    row[0], row[1], row[2], row[3], row[4], row[5] = ax, ay, bx, by, xc, yc
    row[6] = math.sqrt((ax - xc) ** 2 + (ay - yc) ** 2)
    row[7], row[8] = math.atan2(ay - yc, ax - xc), abs(sweep)


@njit(cache=True, nogil=True, inline="always")
def half_width(d, r, R):
    """Half the angle of the circle of radius r that lies in a disc of radius R, d away; at d = 0 all or nothing."""
    if d <= 0.0:
        return 0.0 if r > R else math.pi
    return math.acos(min(1.0, max(-1.0, (d * d + r * r - R * R) / (2.0 * d * r))))


@njit(cache=True, nogil=True)
def covered_arc(ax, ay, bx, by, r, R):
    """Arc (lo, hi) of the circle of radius r about the origin that lies in the capsule of radius R about AB.

    One arc always: every disc of the capsule that meets the circle covers an arc about its own direction. Its ends are
    those of the end discs, or where the circle crosses a side of the capsule. lo > hi where there is none.
    """
    ex, ey = bx - ax, by - ay
    length = math.sqrt(ex * ex + ey * ey)
    reach = r + R
    if length < 1e-12:
        d = math.sqrt(ax * ax + ay * ay)
        if d >= reach:
            return 1.0, 0.0
        if d <= R - r:
            return -math.pi, math.pi
        th = math.atan2(ay, ax)
        half = half_width(d, r, R)
        return th - half, th + half
    ex, ey = ex / length, ey / length
    p = ex * -ay - ey * -ax
    if p < 0.0:
        ax, ay, bx, by = bx, by, ax, ay
        ex, ey, p = -ex, -ey, -p
    if p >= reach:
        return 1.0, 0.0
    xo = -(ax * ex + ay * ey)
    w = math.sqrt(reach * reach - p * p)
    xa, xb = max(-xo, -w), min(length - xo, w)
    if xa >= xb:
        return 1.0, 0.0
    turn = math.atan2(ey, ex)
    da, db = math.sqrt(xa * xa + p * p), math.sqrt(xb * xb + p * p)
    if da <= R - r or db <= R - r:
        return -math.pi, math.pi
    s1 = (R - p) / r
    if s1 >= 1.0:
        s1, c1, al = 1.0, 0.0, 0.5 * math.pi
    else:
        s1 = max(-1.0, s1)
        al = math.asin(s1)
        c1 = r * math.sqrt(max(0.0, 1.0 - s1 * s1))
    ta = math.atan2(-p, xa) if p > 0.0 else (0.0 if xa > 0.0 else -math.pi)
    tb = math.atan2(-p, xb) if p > 0.0 else (0.0 if xb > 0.0 else -math.pi)
    ha = half_width(da, r, R)
    hb = half_width(db, r, R)
    if c1 > xb:
        hi = tb + hb
    elif c1 < xa:
        hi = ta + ha
    else:
        hi = al
    if -c1 < xa:
        lo = ta - ha
    elif -c1 > xb:
        lo = tb - hb
    else:
        lo = -math.pi - al
    return lo + turn, hi + turn


@njit(cache=True, nogil=True)
def covered_by_arc(cx, cy, rho, t0, sweep, r, R, out, row):
    """Arcs of the circle of radius r about the origin that lie in the capsule of radius R about an arc: their number
    (0 to 2), and their ends in ``out`` from ``row`` on.

    Notation: C the centre of the axis, L its distance; c(t) = C + rho e(t); alpha(t) the direction and d(t) the
    distance of c(t), h(d) half the angle that its disc covers. The discs that meet the circle are a window of t about
    the place nearest to the origin. In each of its parts alpha - h to alpha + h is covered; its ends are at an end of
    the part, or where an envelope of the capsule (C + (rho +- R) e(t)) crosses the circle.
    """
    L = math.sqrt(cx * cx + cy * cy)
    reach = r + R
    near = math.atan2(-cy, -cx)  # t of the axis' circle nearest to the origin
    if L < 1e-12:
        if rho >= reach:
            return 0
        if rho <= R - r:
            out[row, 0], out[row, 1] = -math.pi, math.pi
            return 1
        h = half_width(rho, r, R)
        out[row, 0], out[row, 1] = t0 - h, t0 + sweep + h
        return 1
    bound = (L * L + rho * rho - reach * reach) / (2.0 * L * rho)
    if bound >= 1.0:
        return 0
    window = math.pi if bound <= -1.0 else math.acos(bound)
    # the middle of the window as a turn at or after t0 - pi
    middle = near + 2.0 * math.pi * math.ceil((t0 - math.pi - near) / (2.0 * math.pi))
    count = 0
    for turn in range(2):
        m = middle + 2.0 * math.pi * turn
        ta, tb = max(t0, m - window), min(t0 + sweep, m + window)
        if ta >= tb:
            continue
        # direction of c(ta), from which all others are counted on
        xa, ya = cx + rho * math.cos(ta), cy + rho * math.sin(ta)
        first = math.atan2(ya, xa)
        lo, hi = 1e9, -1e9
        for k in range(6):
            if k < 2:
                x, y = xa, ya
                if k == 1:
                    x, y = cx + rho * math.cos(tb), cy + rho * math.sin(tb)
                d = math.sqrt(x * x + y * y)
                if d <= R - r:
                    out[row, 0], out[row, 1] = -math.pi, math.pi
                    return 1
                ahead = half_width(d, r, R)
                behind = -ahead
            else:
                e = rho + R if k < 4 else rho - R
                c = (r * r - L * L - e * e) / (2.0 * L * e) if e != 0.0 else 2.0
                if not -1.0 <= c <= 1.0:
                    continue
                # about the direction away from the origin
                t = near + math.pi + (math.acos(c) if k % 2 == 0 else -math.acos(c))
                t += 2.0 * math.pi * math.ceil((ta - t) / (2.0 * math.pi))
                if t > tb:
                    continue
                ux, uy = math.cos(t), math.sin(t)
                x, y = cx + rho * ux, cy + rho * uy
                px, py = cx + e * ux, cy + e * uy
                ahead = math.atan2(x * py - y * px, x * px + y * py)
                behind = ahead
            step = 0.0 if k == 0 else math.atan2(y, x) - first
            if rho > L:  # the origin is inside: the direction only grows
                step -= 2.0 * math.pi * math.floor((step + 1e-9) / (2.0 * math.pi))
            else:
                step -= 2.0 * math.pi * round(step / (2.0 * math.pi))
            hi = max(hi, first + step + ahead)
            lo = min(lo, first + step + behind)
        # the nearest disc of all may hold the whole circle
        if ta <= m <= tb and abs(L - rho) <= R - r:
            out[row, 0], out[row, 1] = -math.pi, math.pi
            return 1
        out[row + count, 0], out[row + count, 1] = lo, hi
        count += 1
    return count


@njit(cache=True, nogil=True)
def covered_by_capsule(q, ox, oy, tx, ty, heading, r, R, axis, out, row):
    """Arcs of the circle of radius r about O, from T, in capsule q: their number and, in ``out`` from ``row`` on, their
    ends.
    """
    if axis[q, 8] > 0.0:
        cx, cy = axis[q, 4] - ox, axis[q, 5] - oy
        return covered_by_arc(
            cx * tx + cy * ty, cy * tx - cx * ty, axis[q, 6], axis[q, 7] - heading, axis[q, 8], r, R, out, row
        )
    ax, ay = axis[q, 0] - ox, axis[q, 1] - oy
    bx, by = axis[q, 2] - ox, axis[q, 3] - oy
    lo, hi = covered_arc(ax * tx + ay * ty, ay * tx - ax * ty, bx * tx + by * ty, by * tx - bx * ty, r, R)
    out[row, 0], out[row, 1] = lo, hi
    return 1 if lo <= hi else 0


@njit(cache=True, nogil=True)
def uncut(ox, oy, tx, ty, r, R, whole, grid, head, link, axis, out):
    """Uncut arcs of the circle of radius r about O; ``out[k] = lo, hi`` from T, counter-clockwise; returns the count.

    The front half ``[-pi/2, pi/2]``, or the ``whole`` circle ``[-pi/2, 3 pi/2]``; ``out`` as of :func:`uncut_between`.
    """
    m = round(math.pi / grid[6])
    return uncut_between(ox, oy, tx, ty, r, R, 0, 2 * m if whole else m, grid, head, link, axis, out)


@njit(cache=True, nogil=True)
def uncut_between(ox, oy, tx, ty, r, R, begin, end, grid, head, link, axis, out):
    """Uncut arcs of some pieces of the circle of radius r about O, as of :func:`uncut`; piece k begins at
    ``-pi/2 + k grid[6]``.

    ``out`` (RIM, 2) is also the workspace of the loop: its allocation took longer than the calculation.
    """
    x0, y0, h, piece = grid[0], grid[1], grid[2], grid[6]
    nx, ny = int(grid[3]), int(grid[4])
    half, cells = 0.5 * r * piece, 1.0 / h
    # what each capsule covers of the circle is found once: the last one of each place, its number of arcs, their ends
    for k in range(SEEN, ENDS):
        out[k, 0] = -1.0
    count = 0
    held = -1  # the capsule that held the last piece whole: often it holds the next one too
    heading = math.atan2(ty, tx)
    ca, sa = math.cos(piece), math.sin(piece)
    c = math.cos(-0.5 * math.pi + (begin + 0.5) * piece)
    s = math.sin(-0.5 * math.pi + (begin + 0.5) * piece)
    for k in range(begin, end):
        mx, my = ox + r * (c * tx - s * ty), oy + r * (c * ty + s * tx)
        a0 = -0.5 * math.pi + k * piece
        a1 = a0 + piece
        c, s = c * ca - s * sa, s * ca + c * sa
        i, j = int((mx - x0) * cells), int((my - y0) * cells)
        at = FULL
        if 0 <= i < nx and 0 <= j < ny:
            at = head[j * nx + i]
        if at == EMPTY or (at >= 0 and held >= 0 and axis_distance(mx, my, axis, held) <= R - half):
            continue
        n = 1
        out[LEFT, 0], out[LEFT, 1] = a0, a1
        while at >= 0:
            q = link[at, 1]
            at = link[at, 0]
            d = axis_distance(mx, my, axis, q)
            if d >= R + half:
                continue
            if d <= R - half:
                n, held = 0, q
                break
            seen, ends = SEEN + q % KNOWN, ENDS + 2 * (q % KNOWN)
            if out[seen, 0] != q:
                out[seen, 0] = q
                out[seen, 1] = covered_by_capsule(q, ox, oy, tx, ty, heading, r, R, axis, out, ends)
            for side in range(int(out[seen, 1])):
                lo, hi = out[ends + side, 0], out[ends + side, 1]
                # of the turns of the covered arc those that can reach into [a0, a1]
                turns = math.ceil((a0 - hi) / (2.0 * math.pi)) * 2.0 * math.pi
                lo += turns
                hi += turns
                while lo < a1 and n > 0:
                    kept = 0
                    for v in range(LEFT, LEFT + n):
                        if lo > out[v, 0]:
                            out[NEXT + kept, 0], out[NEXT + kept, 1] = out[v, 0], min(lo, out[v, 1])
                            kept += 1
                        if hi < out[v, 1]:
                            out[NEXT + kept, 0], out[NEXT + kept, 1] = max(hi, out[v, 0]), out[v, 1]
                            kept += 1
                    n = min(kept, 16)
                    for v in range(n):
                        out[LEFT + v, 0], out[LEFT + v, 1] = out[NEXT + v, 0], out[NEXT + v, 1]
                    lo += 2.0 * math.pi
                    hi += 2.0 * math.pi
            if n == 0:
                break
        for v in range(LEFT, LEFT + n):
            if count and out[v, 0] - out[count - 1, 1] <= 1e-12:
                out[count - 1, 1] = out[v, 1]
            elif count < ARCS:
                out[count, 0], out[count, 1] = out[v, 0], out[v, 1]
                count += 1
    return count


@njit(cache=True, nogil=True)
def keep_one(px, py, hd, near, m, axis, R, keep):
    """Mark, of the m chain entries in ``near``, one whose capsule holds the whole square part (centre P, half diagonal
    hd); whether one does.
    """
    found = -1
    for v in range(m):
        if axis_distance(px, py, axis, near[0, v]) <= R - hd:
            found = near[1, v]
            if keep[found]:
                break
    if found >= 0:
        keep[found] = True
    return found >= 0


@njit(cache=True, nogil=True)
def keep_all(px, py, hd, near, m, axis, R, keep):
    """Mark every capsule of ``near`` that reaches the square part."""
    for v in range(m):
        k = near[1, v]
        if not keep[k] and axis_distance(px, py, axis, near[0, v]) < R + hd:
            keep[k] = True


@njit(cache=True, nogil=True)
def keep_fine(px, py, hd, near, m, axis, R, keep):
    """Mark what the square part needs, cut into FINER x FINER; whether it is cleared.

    Of a chain of over LONG capsules, as left by repeated passes of very small depth, each of these that no one
    capsule holds is cut once more: fewer capsules reach a smaller part.
    """
    whole = True
    side = 2.0 * hd * math.sqrt(0.5) / FINER
    for a in range(FINER):
        for b in range(FINER):
            x, y = px + (a - 0.5 * (FINER - 1)) * side, py + (b - 0.5 * (FINER - 1)) * side
            if keep_one(x, y, hd / FINER, near, m, axis, R, keep):
                continue
            if len(keep) <= LONG:
                keep_all(x, y, hd / FINER, near, m, axis, R, keep)
                whole = False
                continue
            for c in range(FINER):
                for d in range(FINER):
                    u, v = x + ((c + 0.5) / FINER - 0.5) * side, y + ((d + 0.5) / FINER - 0.5) * side
                    if not keep_one(u, v, hd / FINER / FINER, near, m, axis, R, keep):
                        keep_all(u, v, hd / FINER / FINER, near, m, axis, R, keep)
                        whole = False
    return whole


@njit(cache=True, nogil=True)
def prune(cell, grid, head, link, used, axis, R):
    """A new chain of a cell with what its cleared part needs; returns the number of chain entries used.

    The square about the disc of the cell is cut into parts. A part inside one capsule needs that one only; in any
    other part every capsule that reaches it stays. The union does not change. O(capsules x parts).
    """
    x0, y0, h, reach = grid[0], grid[1], grid[2], grid[5]
    nx = int(grid[3])
    cx, cy = x0 + (cell % nx + 0.5) * h, y0 + (cell // nx + 0.5) * h
    first = head[cell]
    n = 0
    at = first
    while at >= 0:
        n += 1
        at = link[at, 0]
    if used + n + int(grid[7]) > len(link):
        return used
    keep = np.zeros(n, dtype=np.bool_)
    near = np.empty((2, n), dtype=np.int64)  # capsules that reach a part, and their places in the chain
    side = 2.0 * reach / PARTS
    hd = side * math.sqrt(0.5)
    whole = True
    for a in range(PARTS):
        for b in range(PARTS):
            px, py = cx - reach + (a + 0.5) * side, cy - reach + (b + 0.5) * side
            if (px - cx) ** 2 + (py - cy) ** 2 >= (reach + hd) ** 2:
                continue
            found = -1
            m = 0
            k = 0
            at = first
            while at >= 0:
                q = link[at, 1]
                d = axis_distance(px, py, axis, q)
                if d <= R - hd:
                    found = k
                    if keep[k]:
                        break
                elif d < R + hd:
                    near[0, m], near[1, m] = q, k
                    m += 1
                at = link[at, 0]
                k += 1
            if found >= 0:
                keep[found] = True
            else:
                whole = keep_fine(px, py, hd, near, m, axis, R, keep) and whole
    if whole:
        head[cell] = EMPTY
        return used
    at = first
    head[cell] = used
    k = 0
    while at >= 0:
        if keep[k]:
            link[used, 0] = used + 1
            link[used, 1] = link[at, 1]
            used += 1
        at = link[at, 0]
        k += 1
    link[used - 1, 0] = -1
    return used


@njit(cache=True, nogil=True)
def remove(q, R, grid, head, count, link, used, axis):
    """Enter capsule q in the cells that it reaches; ``count`` is how many more a cell takes before it is pruned.

    Returns the number of chain entries used.
    """
    x0, y0, h, reach = grid[0], grid[1], grid[2], grid[5]
    nx, ny = int(grid[3]), int(grid[4])
    ax, ay, bx, by = axis[q, 0], axis[q, 1], axis[q, 2], axis[q, 3]
    out = R + reach
    if axis[q, 8] > 0.0:
        out += axis[q, 6] * (1.0 - math.cos(0.5 * axis[q, 8]))
    i0 = max(0, math.floor((min(ax, bx) - out - x0) / h))
    i1 = min(nx - 1, math.floor((max(ax, bx) + out - x0) / h))
    j0 = max(0, math.floor((min(ay, by) - out - y0) / h))
    j1 = min(ny - 1, math.floor((max(ay, by) + out - y0) / h))
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            cell = j * nx + i
            if head[cell] == EMPTY:
                continue
            d = axis_distance(x0 + (i + 0.5) * h, y0 + (j + 0.5) * h, axis, q)
            if d <= R - reach:
                head[cell] = EMPTY
            elif d < R + reach:
                link[used, 0] = head[cell]
                link[used, 1] = q
                head[cell] = used
                used += 1
                count[cell] -= 1
                if count[cell] <= 0:
                    before = used
                    used = prune(cell, grid, head, link, used, axis, R)
                    count[cell] = max(MORE, used - before)
    return used


@njit(cache=True, nogil=True)
def remove_segment(ax, ay, bx, by, xc, yc, sweep, q, R, grid, head, count, link, used, axis):
    """Enter a line or an arc, cut into capsules of at most R / 2 and an eighth of a turn, from row q on.

    Returns the rows and the chain entries used.
    """
    if sweep == 0.0:
        length = math.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
        rho, t0 = 0.0, 0.0
        parts = max(1, math.ceil(2.0 * length / R))
    else:
        rho = math.sqrt((ax - xc) ** 2 + (ay - yc) ** 2)
        t0 = math.atan2(ay - yc, ax - xc)
        parts = max(1, math.ceil(max(2.0 * rho * abs(sweep) / R, 4.0 * abs(sweep) / math.pi)))
    x0, y0 = ax, ay
    for k in range(parts):
        w = (k + 1) / parts
        if k + 1 == parts:
            x1, y1 = bx, by
        elif sweep == 0.0:
            x1, y1 = ax + w * (bx - ax), ay + w * (by - ay)
        else:
            x1, y1 = xc + rho * math.cos(t0 + w * sweep), yc + rho * math.sin(t0 + w * sweep)
        axis_row(x0, y0, x1, y1, xc, yc, sweep / parts, axis[q])
        used = remove(q, R, grid, head, count, link, used, axis)
        q += 1
        x0, y0 = x1, y1
    return q, used
