"""Compiled loops of the chips between the true paths of the teeth; arrays and scalars only.

Notation as in :mod:`chipload.engagement.tooth_surfaces`: a line is a sinusoid along sin(phi) + offset + across cos(phi)
in the immersion phi counted from the feed, so that 0 and pi are the ends of the front; ``alike``: all teeth cut
equally, and tooth -1 stands for each.
Oracle: every slice against the paths of all earlier teeth by Newton's method, tests/engagement/tooth_paths.py.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

PI = math.pi
TAU = 2.0 * math.pi
#: share of the greatest chip below which a range ends where the feed is tangent to the cutter, not at a wall
CUSP = 1e-4
#: least cosine of the immersion at which a wall shortens the chip
STEEP = 1e-3
#: share of the chip's area below which what a wall takes away is left out
THIN = 1e-3
#: greatest offset of a range, as a share of its swing, at which its walls are those of a level cut
LEVEL = 1e-3
#: greatest feed over the distance from the axis for which the second order is taken: near a pointed tip less
LARGE = 0.25
#: piece of immersion that is left out, and half a piece below which a sinusoid through three values is a line [rad]
NONE, SMALL = 1e-9, 1e-4
#: rounding of angles [rad], of places as a share of the greatest radius, and of chips as a share of that of places
GRID, THICK = 1e-9, 1e-2


@njit(cache=True, nogil=True, inline="always")
def chip(si, co, f, c, R):
    """Chip [mm] against a tooth that passed f [mm] of feed before, of second order in f / R, at the immersion with the
    sine ``si`` and the cosine ``co``; c feed per radian.
    """
    return f * si * (1.0 - c * co / R) + f * f * co * co / (2.0 * R)


@njit(cache=True, nogil=True, inline="always")
def sinusoid_of_chip(sm, cm, sw, cw, f, c, R):
    """(along, offset, across) of the sinusoid through the chip at the middle m of a piece and at its ends m - w and
    m + w, from the sines and cosines of m and w.
    """
    hp = chip(sm * cw - cm * sw, cm * cw + sm * sw, f, c, R)
    hm = chip(sm, cm, f, c, R)
    hq = chip(sm * cw + cm * sw, cm * cw - sm * sw, f, c, R)
    A = (hm - 0.5 * (hp + hq)) / (1.0 - cw) if sw > SMALL else 0.0
    B = (hq - hp) / (2.0 * sw)
    return A * sm + B * cm, hm - A, A * cm - B * sm


@njit(cache=True, nogil=True)
def first_root(al, of, ac, x, y):
    """Least phi in (x, y) with al sin(phi) + of + ac cos(phi) = 0; y if none."""
    swing = math.hypot(al, ac)
    if swing <= abs(of):
        return y
    peak = math.atan2(al, ac)
    d = math.acos(-of / swing)
    best = y
    for t in (peak - d, peak + d):
        r = t - TAU * math.floor((t - x - 1e-12) / TAU)
        if r < best:
            best = r
    return best


@njit(cache=True, nogil=True)
def like(i, k, start, rows, tooth, piece, slices):
    """Whether step i has the same ranges as step k, as the steps along a straight row have."""
    count = start[i + 1] - start[i]
    if start[k + 1] - start[k] != count:
        return False
    for n in range(count):
        r = start[i] + n
        q = start[k] + n
        if tooth[r] != tooth[q]:
            return False
        for d in range(7):
            if rows[r, d] != rows[q, d] or slices[piece[r], d] != slices[piece[q], d]:
                return False
    return True


@njit(cache=True, nogil=True)
def round_ranges(rows, slices):
    """Ranges rounded to :data:`GRID`, so that those of steps along a straight row are equal to the last bit: chips do
    not depend on which steps are calculated together, nor on the unit of length.
    """
    size = 0.0
    for k in range(len(slices)):
        size = max(size, slices[k, 1])
    if size <= 0.0:
        return rows.copy()
    out = np.empty_like(rows)
    grid = np.array([GRID, GRID, GRID * size, GRID * size, *[GRID * THICK * size] * 3])
    over = 1.0 / grid
    for r in range(len(rows)):
        for d in range(7):
            out[r, d] = math.floor(rows[r, d] * over[d] + 0.5) * grid[d]
    return out


@njit(cache=True, nogil=True)
def adjoin(rows, piece, r, other):
    """Whether the range ``r`` ends where the range ``other`` of the same place of the edge begins."""
    if piece[r] != piece[other] or rows[r, 2] >= rows[other, 3] or rows[other, 2] >= rows[r, 3]:
        return False
    d = (rows[other, 0] - rows[r, 1]) % TAU
    return min(d, TAU - d) < 1e-6


@njit(cache=True, nogil=True)
def parts_of_lag(span, wide, thick, swing, e, share):
    """Number of parts of an edge that lags by ``span`` [rad] in which its radius is taken as that of the middle: what
    is missed at both ends of the engaged part, ``wide`` [rad], is about ``share`` of the mean chip ``thick`` [mm], and
    twice that of the thickest, ``swing``.
    """
    if e <= 0.0 or span <= 0.0:
        return 1
    x = share * thick / e
    most = max(min(math.sqrt(4.0 * x * min(wide, span)), wide, 2.0 * share * swing / e), x)
    return math.ceil(span / most)


@njit(cache=True, nogil=True)
def put(out, own, parent, before, at, p, q, s0, s1, al, of, ac, turned, si, co, tooth, row, m):
    """Write one range, its immersion counted from the feed less ``turned`` [rad], if there is room; next number.

    ``si``, ``co``: sine and cosine of ``turned``.
    """
    if at < len(out):
        low = p - turned
        low -= TAU * math.floor(low / TAU)
        out[at, 0] = low
        out[at, 1] = low + min(q - p, TAU)
        out[at, 2] = s0
        out[at, 3] = s1
        out[at, 4] = al * co - ac * si
        out[at, 5] = of
        out[at, 6] = al * si + ac * co
        own[at] = tooth
        parent[at] = row
        before[at] = m
    return at + 1


@njit(cache=True, nogil=True, inline="always")
def along_wall(line, lines, cosine, sine, rho, radius):
    """Add the line of the chip that runs out along the wall that a circle of radius ``rho`` meets where the immersion
    has that cosine.
    """
    line[lines, 0] = 0.0
    line[lines, 1] = sine * (radius - rho)
    line[lines, 2] = sine * rho / cosine
    line[lines, 3] = 0.0
    return lines + 1


@njit(cache=True, nogil=True)
def chips(
    start, given, tooth, piece, slices, runout, angles, turns, alike, share, widest, room, out, own, parent, before
):  # fmt: skip
    """Ranges of the chips that the true paths of the teeth leave; their number, which may be more than ``out`` holds.

    Parameters
    ----------
    start, given, tooth, piece, slices : of the front, as if each tooth were a circle that the feed moves on
    runout : (2,) [mm, rad]; angles (N,) lag of each tooth; turns (N, N) pitches before tooth j, over 2 pi / N
    share : see :func:`parts_of_lag`
    widest : widest piece of immersion in which a chip is a sinusoid through three of its values [rad]
    room : (n + 1,) filled: where the ranges of each step begin
    out, own, parent, before : filled: rows, tooth, row of ``given`` and number of teeth before the one that cuts whose
        path it meets; 0: a wall
    """
    N = len(angles)
    e = runout[0]
    rows = round_ranges(given, slices)
    line = np.empty((N + 2, 4))
    radii = np.zeros(N)
    cut = np.zeros((math.ceil(8.0 / widest), N, N, 3))
    ends = np.zeros((len(cut) + 1, 2))
    # typed: a literal would compile what it is passed to twice
    at: Any = np.int64(0)
    known: Any = np.int64(-1)
    for i in range(len(start) - 1):
        room[i] = at
        if known >= 0 and like(i, known, start, rows, tooth, piece, slices):
            for k in range(room[known], room[known + 1]):
                if at < len(out):
                    out[at] = out[k]
                    own[at] = own[k]
                    parent[at] = parent[k] - start[known] + start[i]
                    before[at] = before[k]
                at += 1
            room[i + 1] = at
            known = i
            continue
        known = i
        for r in range(start[i], start[i + 1]):
            k = piece[r]
            sine = slices[k, 3]
            offset = rows[r, 5]
            swing = math.hypot(rows[r, 4], rows[r, 6])
            if tooth[r] >= 0 or swing <= 0.0 or sine <= 0.0 or slices[k, 1] <= 0.0:
                # of one tooth, or not across the axis: every tooth as long as the one before
                one = alike or tooth[r] >= 0
                for j in range(1 if one else N):
                    fed = 1.0 if one else turns[j, 0]
                    at = put(
                        out, own, parent, before, at, rows[r, 0], rows[r, 1], rows[r, 2], rows[r, 3],
                        fed * rows[r, 4], fed * offset, fed * rows[r, 6], 0.0, 0.0, 1.0, tooth[r] if one else j, r,
                        np.int64(1),
                    )  # fmt: skip
                continue
            f = swing / sine
            rho = max(slices[k, 1], f / LARGE)
            c = N * f / TAU
            turned = math.atan2(rows[r, 6], rows[r, 4])
            st = rows[r, 6] / swing
            ct = rows[r, 4] / swing
            p = rows[r, 0] + turned
            p -= TAU * math.floor((p + 1e-6) / TAU)
            q = p + rows[r, 1] - rows[r, 0]
            sp = math.sin(p)
            cp = math.cos(p)
            sq = math.sin(q)
            cq = math.cos(q)
            whole = rows[r, 1] - rows[r, 0] > TAU - 1e-6
            least = CUSP * (swing + abs(offset))
            cusp_p = abs(swing * sp + offset) <= least
            cusp_q = abs(swing * sq + offset) <= least
            # a wall shortens the chip where the tooth before has cut along it already
            area = cp - cq
            level = abs(offset) <= LEVEL * swing and not whole
            wall_p = level and not cusp_p and p < PI and cp < -STEEP
            wall_q = level and not cusp_q and q < PI and cq > STEEP
            if wall_p and 0.5 * f / rho * abs(sp * cp) < THIN * area:
                wall_p = False
            if wall_q and 0.5 * f / rho * abs(sq * cq) < THIN * area:
                wall_q = False
            if r > start[i]:
                if wall_p and adjoin(rows, piece, r - 1, r):
                    wall_p = False
                if wall_q and adjoin(rows, piece, r, r - 1):
                    wall_q = False
            if r + 1 < start[i + 1]:
                if wall_p and adjoin(rows, piece, r + 1, r):
                    wall_p = False
                if wall_q and adjoin(rows, piece, r, r + 1):
                    wall_q = False
            most = 1 if alike else N
            reach = 0.5 * f / rho * (1.2 if alike else float(N))
            base = slices[k, 5] - slices[k, 6] * slices[k, 0]
            span = slices[k, 6] * (rows[r, 3] - rows[r, 2])
            thick = swing * area / (q - p) if level and q > p else swing + abs(offset)
            count = 1 if alike else parts_of_lag(span, q - p, max(thick, 1e-3 * swing), swing, e * sine, share)
            ds = (rows[r, 3] - rows[r, 2]) / count
            # the same lines for all parts of the edge; a wall may be met beyond an end by what a tooth stands out
            first = p - reach if cusp_p and not whole else p
            last = q + reach if cusp_q and not whole else q
            parts = max(1, math.ceil((last - first) / widest - 1e-9))
            for part in range(parts + 1):
                x = first + (last - first) * part / parts
                # the ends of the range are known
                if part == 0 and first == p:
                    ends[part, 0] = sp
                    ends[part, 1] = cp
                elif part == parts and last == q:
                    ends[part, 0] = sq
                    ends[part, 1] = cq
                else:
                    ends[part, 0] = math.sin(x)
                    ends[part, 1] = math.cos(x)
            width = (last - first) / parts
            for part in range(parts):
                if width > NONE:
                    # middle and half width of the piece from its ends, whose sum lies along the middle
                    sm = ends[part, 0] + ends[part + 1, 0]
                    cm = ends[part, 1] + ends[part + 1, 1]
                    both = math.sqrt(sm * sm + cm * cm)
                    sm /= both
                    cm /= both
                    cw = 0.5 * both
                    sw = sm * ends[part, 1] - cm * ends[part, 0]
                    for j in range(1 if alike else N):
                        for m in range(most):
                            past = f * turns[j, m]
                            al, of, ac = sinusoid_of_chip(sm, cm, sw, cw, past, c, rho)
                            cut[part, j, m, 0] = sine * al
                            cut[part, j, m, 1] = sine * of + offset * turns[j, m]
                            cut[part, j, m, 2] = sine * ac
            for b in range(count):
                s0 = rows[r, 2] + b * ds
                s1 = rows[r, 3] if b == count - 1 else s0 + ds
                psi = base + slices[k, 6] * 0.5 * (s0 + s1)
                if not alike:
                    for j in range(N):
                        radii[j] = e * math.cos(runout[1] - angles[j] - psi)
                for j in range(1 if alike else N):
                    lo = first
                    hi = last
                    if not alike and level and not cusp_p and p < PI:
                        lo = math.acos(min(max(rho * cp / (rho + radii[j]), -1.0), 1.0))
                    if not alike and level and not cusp_q and q < PI:
                        hi = math.acos(min(max(rho * cq / (rho + radii[j]), -1.0), 1.0))
                    for part in range(parts):
                        x = lo if part == 0 else first + (last - first) * part / parts
                        y = hi if part == parts - 1 else first + (last - first) * (part + 1) / parts
                        if y - x <= NONE:
                            continue
                        for m in range(most):
                            line[m, 0] = cut[part, j, m, 0]
                            line[m, 1] = cut[part, j, m, 1]
                            if not alike:
                                line[m, 1] += sine * (radii[j] - radii[(j - m - 1) % N])
                            line[m, 2] = cut[part, j, m, 2]
                            line[m, 3] = m + 1
                        lines = most
                        if wall_p and part == 0:
                            lines = along_wall(line, lines, cp, sine, rho, radii[j])
                        if wall_q and part == parts - 1:
                            lines = along_wall(line, lines, cq, sine, rho, radii[j])
                        sx = ends[part, 0]
                        cx = ends[part, 1]
                        if x == lo and lo != first:
                            sx = math.sin(x)
                            cx = math.cos(x)
                        sy = ends[part + 1, 0]
                        cy = ends[part + 1, 1]
                        if y == hi and hi != last:
                            sy = math.sin(y)
                            cy = math.cos(y)
                        at = lowest(
                            line, lines, x, y, sx, cx, sy, cy, s0, s1, turned, st, ct, -1 if alike else j, r, out, own,
                            parent, before, at,
                        )  # fmt: skip
        room[i + 1] = at
    return at


@njit(cache=True, nogil=True)
def lowest(
    line, lines, x, y, sx, cx, sy, cy, s0, s1, turned, st, ct, tooth, row, out, own, parent, before, at
):  # fmt: skip
    """Write the ranges in x .. y [rad] of the lower envelope of lines where it is positive; next number.

    ``sx``, ``cx``, ``sy``, ``cy``: sines and cosines of x and y.

    From each corner on the lowest line stays so until another crosses it downwards. A line is not looked at whose
    distance at both ends is more than it can bend between them.
    """
    best = 0
    low = math.inf
    for m in range(lines):
        v = line[m, 0] * sx + line[m, 1] + line[m, 2] * cx
        if v < low:
            low = v
            best = m
    g = x
    sg = sx
    cg = cx
    steps = 0
    while g < y - NONE and steps < 4 * lines + 4:
        steps += 1
        end = y
        after = best
        if lines > 1:
            bend = 0.125 * (y - g) * (y - g)
            for m in range(lines):
                if m == best:
                    continue
                A = line[m, 0] - line[best, 0]
                B = line[m, 1] - line[best, 1]
                C = line[m, 2] - line[best, 2]
                v = min(A * sg + B + C * cg, A * sy + B + C * cy)
                if v > (abs(A) + abs(C)) * bend:
                    continue
                t = first_root(A, B, C, g + 1e-10, end)
                if t < end and A * math.cos(t) - C * math.sin(t) < 0.0:
                    end = t
                    after = m
        al = line[best, 0]
        of = line[best, 1]
        ac = line[best, 2]
        se = sy if end == y else math.sin(end)
        ce = cy if end == y else math.cos(end)
        vg = al * sg + of + ac * cg
        ve = al * se + of + ac * ce
        m = int(line[best, 3])
        if vg >= 0.0 and ve >= 0.0 and (al * cg >= ac * sg or al * ce <= ac * se):
            # positive at both ends, with no trough between them
            at = put(out, own, parent, before, at, g, end, s0, s1, al, of, ac, turned, st, ct, tooth, row, m)
        elif vg >= 0.0 or ve >= 0.0 or (al * cg > ac * sg and al * ce < ac * se):
            u = g
            for _ in range(3):
                t = first_root(al, of, ac, u, end)
                if t > u + NONE:
                    mid = 0.5 * (u + t)
                    if al * math.sin(mid) + of + ac * math.cos(mid) > 0.0:
                        at = put(out, own, parent, before, at, u, t, s0, s1, al, of, ac, turned, st, ct, tooth, row, m)
                u = t
                if t >= end or (t > g and vg >= 0.0 and ve < 0.0):
                    break
        sg = se
        cg = ce
        g = end
        best = after
    return at
