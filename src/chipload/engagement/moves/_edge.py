"""Compiled loops that cut the part of the edge that may be in material into slices; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.moves._contact`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.cutter.record import FLANK_LINE, FLAT
from chipload.engagement.moves._sweep import profile
from chipload.engagement.moves._uncounted_arrays import borrow_arrays

PI = math.pi
#: heights closer than this count as one [mm], and ends of slices
SAME, PLACE = 1e-6, 1e-9
#: column of a slice: 0 for one of the flank, 1 for one of the flank that begins at a height of the stock, else below 0
FLANK = 11
#: number of slices of the part of a corner whose circles cut all round in a downward motion, where there is material
ROUND = 4
#: by how many more slices a flank has than a corner where it is a cone, or goes down beside a floor that does: on a
#: helix of flat mills the greatest torque was 2 to 4.5 % too high, that of cones in thin layers up to 30 %
DOWN = 4


@njit(cache=True, nogil=True)
def candidates(p, T, narrow, c, grid, shape, level, near):
    """Cells in which the surface of the cutter at p may be in material: rows of ``near``; their number."""
    half = 0.5 * math.hypot(grid[2], grid[3])
    wide = c.wide
    i0 = max(0, math.floor((p[0] - wide - grid[0]) / grid[2]))
    i1 = min(shape[0] - 1, math.floor((p[0] + wide - grid[0]) / grid[2]))
    j0 = max(0, math.floor((p[1] - wide - grid[1]) / grid[3]))
    j1 = min(shape[1] - 1, math.floor((p[1] + wide - grid[1]) / grid[3]))
    count = 0
    for i in range(i0, i1 + 1):
        dx = grid[0] + (i + 0.5) * grid[2] - p[0]
        rest = (wide + half) ** 2 - dx * dx
        if rest <= 0.0:
            continue
        rest = math.sqrt(rest)
        first = max(j0, math.floor((p[1] - rest - grid[1]) / grid[3]))
        last = min(j1, math.floor((p[1] + rest - grid[1]) / grid[3]))
        for j in range(first, last + 1):
            ceil = level[i * shape[1] + j, 1] - p[2]
            if ceil <= 0.0:
                continue
            dy = grid[1] + (j + 0.5) * grid[3] - p[1]
            ahead = dx * T[0] + dy * T[1]
            if narrow and ahead < -half:
                continue
            d2 = dx * dx + dy * dy
            if d2 > (wide + half) ** 2:
                continue
            d = math.sqrt(d2)
            if profile(c, max(d - half, 0.0)) >= ceil:
                continue
            near[count, 0] = max(d - half, 0.0)
            near[count, 1] = d + half
            near[count, 2] = ahead
            near[count, 3] = dy * T[0] - dx * T[1]
            near[count, 4] = ceil
            near[count, 5] = level[i * shape[1] + j, 0] - p[2]
            near[count, 6] = i * shape[1] + j
            count += 1
    return count


@njit(cache=True, nogil=True)
def direction(x, y):
    """Angle of a vector within 2e-5 rad, in -pi .. pi.

    Reference: [Abramowitz1964] 4.4.47.
    """
    ax = abs(x)
    ay = abs(y)
    q = min(ax, ay) / max(ax, ay)
    s = q * q
    a = q * (0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351))))
    if ay > ax:
        a = 0.5 * PI - a
    if x < 0.0:
        a = PI - a
    return a if y >= 0.0 else -a


@njit(cache=True, nogil=True)
def windows(near, count, half, out, slices):
    """Range of psi [rad] in which candidates touch each slice, into columns 9 and 10 of ``out``: the first is above the
    second if none does; both are infinite if candidates lie all round.
    """
    for k in range(slices):
        out[k, 9] = math.inf
        out[k, 10] = -math.inf
    for i in range(count):
        d0 = near[i, 0]
        d1 = near[i, 1]
        # slices rise and widen: the first that reaches as far as the cell does
        a = 0
        b = slices
        while a < b:
            k = (a + b) // 2
            if out[k, 8] < d0:
                a = k + 1
            else:
                b = k
        if a == slices or out[a, 7] > d1 or out[a, 3] >= near[i, 4]:
            continue
        low = -math.inf
        high = math.inf
        if d0 > 0.0:
            # no less than asin(q), exact at 0 and 1
            q = half / (d0 + half)
            wide = q * (1.0 + 0.5708 * q * q) + 2e-4
            at = direction(near[i, 2], near[i, 3])
            if at - wide >= -PI and at + wide <= PI:
                low = at - wide
                high = at + wide
        for k in range(a, slices):
            if out[k, 7] > d1 or out[k, 3] >= near[i, 4]:
                break
            if low < out[k, 9]:
                out[k, 9] = low
            if high > out[k, 10]:
                out[k, 10] = high


@njit(cache=True, nogil=True)
def add_slice(out, k, s0, s1, rho, z0, sk, ck, z, rho0, rho1):
    """Row k of the slices: s from, s to, rho, z from, sin, cos kappa, z of the circle, least and greatest rho; not of
    the flank.
    """
    out[k, 0] = s0
    out[k, 1] = s1
    out[k, 2] = rho
    out[k, 3] = z0
    out[k, 4] = sk
    out[k, 5] = ck
    out[k, 6] = z
    out[k, 7] = rho0
    out[k, 8] = rho1
    out[k, FLANK] = -1.0
    return k + 1


@njit(cache=True, nogil=True)
def add_arc(out, k, c, i, k0, k1, mid):
    """:func:`add_slice` of the arc i from the angle k0 of its normal to k1 [rad], with the circle at ``mid``."""
    r = c.radius[i]
    e = c.e[i]
    f = c.f[i]
    return add_slice(
        out, k, c.s[i] + r * (k0 - c.kappa[i]), c.s[i] + r * (k1 - c.kappa[i]), e + r * math.sin(mid),
        f - r * math.cos(k0), math.sin(mid), math.cos(mid), f - r * math.cos(mid), e + r * math.sin(k0),
        e + r * math.sin(k1),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def arc_of(c, s0, s1):
    """The arc of a cutter on which a part of the profile from s0 to s1 lies; -1: none."""
    for i in range(c.count):
        end = c.s[i] + c.radius[i] * (c.kappa_to[i] - c.kappa[i])
        if c.radius[i] > 0.0 and s0 > c.s[i] - PLACE and s1 < end + PLACE:
            return i
    return -1


@njit(cache=True, nogil=True)
def slice_arc_again(c, i, low, high, parts, out):
    """Place the slices of the arc i, which ``out`` begins with, between the circles of two of them; ``low`` below 0,
    ``high`` beyond the last: to where they begin and end now.
    """
    many = len(parts)
    a = c.kappa[i] + (out[0, 0] - c.s[i]) / c.radius[i]
    b = c.kappa[i] + (out[many - 1, 1] - c.s[i]) / c.radius[i]
    if low >= 0:
        a = math.atan2(out[low, 4], out[low, 5])
    if high < many:
        b = math.atan2(out[high, 4], out[high, 5])
    for j in range(many):
        add_arc(out, j, c, i, a + (b - a) * parts[j, 0], a + (b - a) * parts[j, 1], a + (b - a) * parts[j, 2])


@njit(cache=True, nogil=True)
def slice_profile(p, c, near, count, u, parts, flank, levels, index, out):
    """Cut the part of the profile that the candidates touch into slices: their number, and whether the contact of the
    flank may change between its slices and its ends.
    """
    # what a call passes counts again
    index = borrow_arrays(index)
    inner = math.inf
    outer = 0.0
    top = 0.0
    for i in range(count):
        inner = min(inner, near[i, 0])
        outer = max(outer, near[i, 1])
        top = max(top, near[i, 4])
    outer = min(outer, c.wide)
    top = min(top, c.height)
    # typed: a literal would compile what it is passed to twice
    k = np.int64(0)
    for i in range(c.count):
        if c.line[i] == FLANK_LINE:
            if outer >= c.rho[i] and top > c.z[i]:
                many = len(parts) * (DOWN if u[2] < 0.0 or c.run[i] > 0.0 else 1)
                return slice_flank(p, c, i, near, count, top, many, flank, levels, index, out, k)
        elif c.line[i] > 0:
            if inner < c.rho_to[i] and outer > c.rho[i] and top > c.z[i] and (u[2] < 0.0 or c.rise[i] > 0.0):
                k = bottom_sliced(c, i, max(inner, c.rho[i]), min(outer, c.rho_to[i]), top, len(parts), out, k)
        elif c.radius[i] > 0.0 and outer > c.rho[i] and inner < c.rho_to[i] and top > c.z[i]:
            k = arc_sliced(c, i, inner, outer, top, u, parts, flank, out, k)
    return k, False


@njit(cache=True, nogil=True)
def bottom_sliced(c, i, a, b, top, pieces, out, k):
    """Slices of the line i that is no flank, from rho = a to b."""
    if c.rise[i] > 0.0:
        b = min(b, c.rho[i] + (top - c.z[i]) * c.run[i])
    n = max(pieces // 2, 1)
    size = math.hypot(1.0, c.rise[i])
    for j in range(n):
        r0 = a + (b - a) * j / n
        r1 = a + (b - a) * (j + 1) / n
        mid = 0.5 * (r0 + r1)
        k = add_slice(
            out, k, c.s[i] + (r0 - c.rho[i]) * size, c.s[i] + (r1 - c.rho[i]) * size, mid,
            c.z[i] + (r0 - c.rho[i]) * c.rise[i], c.sin[i], c.cos[i], c.z[i] + (mid - c.rho[i]) * c.rise[i], r0, r1,
        )  # fmt: skip
    return k


@njit(cache=True, nogil=True)
def arc_sliced(c, i, inner, outer, top, u, parts, flank, out, k):
    """Slices of the arc i; an arc of a larger radius than the cutter has as many as a flank."""
    pieces = len(parts)
    r = c.radius[i]
    a = c.kappa[i] if inner <= c.rho[i] else max(c.kappa[i], math.asin((inner - c.e[i]) / r))
    b = c.kappa_to[i] if outer >= c.rho_to[i] else min(c.kappa_to[i], math.asin((outer - c.e[i]) / r))
    if top < c.z_to[i]:
        b = min(b, math.acos((c.f[i] - top) / r))
    # where the normal leans against the motion the front ends: none below on the way up, all round on the way down
    turn = math.atan2(abs(u[2]), math.hypot(u[0], u[1]))
    if u[2] > 0.0:
        a = max(a, turn)
    elif a < turn < b:
        for j in range(ROUND):
            k0 = a + (turn - a) * j / ROUND
            k1 = a + (turn - a) * (j + 1) / ROUND
            k = add_arc(out, k, c, i, k0, k1, 0.5 * (k0 + k1))
        a = turn
    if b <= a:
        return k
    times = max(math.ceil(r * (b - a) / flank / pieces - 1e-9), 1) if r > c.wide else 1
    size = (b - a) / times
    for n in range(times):
        from_k = a + n * size
        for j in range(pieces):
            k = add_arc(
                out, k, c, i, from_k + size * parts[j, 0], from_k + size * parts[j, 1], from_k + size * parts[j, 2]
            )
    return k


@njit(cache=True, nogil=True)
def floors_of_moves(p, c, at, near, count, top, levels, n, index):
    """Write the heights above the tip of the floors that moves left beside the flank, the line ``at``, behind the first
    ``n`` of ``levels``, the lowest of them where there is no room for all: the number of levels, and whether there are
    floors that are not level.
    """
    index = borrow_arrays(index)
    lists = index[3]
    kept = index[4]
    moves = index[6]
    of = index[7]
    cutters = index[8]
    begin = n
    askew = False
    for i in range(count):
        if near[i, 1] < c.rho[at]:
            continue
        cell = int(near[i, 6])
        # beside upright faces of a mesh
        askew = askew or near[i, 5] == -math.inf
        last = math.inf
        for k in range(lists[cell, 0], lists[cell, 0] + lists[cell, 1]):
            m = kept[k]
            low = moves[m, 2] + min(moves[m, 5], 0.0)
            if moves[m, 5] != 0.0 and moves[m, 6] > 0.0:
                # a floor that falls along the move
                low -= p[2]
                askew = askew or (low < top and low + abs(moves[m, 5]) > c.z[at])
                continue
            if low == last:
                continue
            last = low
            if cutters[of[m]].kind != FLAT:
                askew = True
                continue
            h = low - p[2]
            if not c.z[at] < h < top:
                continue
            fresh = True
            highest = begin
            for j in range(n):
                if abs(levels[j] - h) < SAME:
                    fresh = False
                if j >= begin and levels[j] > levels[highest]:
                    highest = j
            if fresh and n < len(levels):
                levels[n] = h
                n += 1
            elif fresh and begin < n and h < levels[highest]:
                levels[highest] = h
    return n, askew


@njit(cache=True, nogil=True)
def slice_flank(p, c, at, near, count, top, pieces, flank, levels, index, out, k):
    """Slices of the flank, the line ``at``: between the heights of the stock beside it, none longer than ``flank``;
    where the cells have too many heights, ``pieces`` equal ones between the floors of level moves. Returns as
    :func:`slice_profile`.
    """
    index = borrow_arrays(index)
    n = np.int64(2)
    levels[0] = c.z[at]
    levels[1] = top
    many = False
    for i in range(count):
        if near[i, 1] < c.rho[at]:
            continue
        for h in (near[i, 4], near[i, 5]):
            if not c.z[at] < h < top:
                continue
            fresh = True
            for j in range(n):
                if abs(levels[j] - h) < SAME:
                    fresh = False
            if fresh and 2 * n == len(levels):
                many = True
            elif fresh:
                levels[n] = h
                n += 1
    if many:
        # no level floors around: a surface that rises and falls
        n = np.int64(2)
    n, askew = floors_of_moves(p, c, at, near, count, top, levels, n, index)
    if many or c.run[at] > 0.0:
        # beside an upright wall the contact of a cone changes all along it
        flank = min(flank, (top - c.z[at]) / pieces)
    levels[:n].sort()
    sk = c.sin[at]
    ck = c.cos[at]
    start = c.s[at]
    for j in range(n - 1):
        parts = max(1, math.ceil((levels[j + 1] - levels[j]) / sk / flank - 1e-9))
        for i in range(parts):
            z0 = levels[j] + (levels[j + 1] - levels[j]) * i / parts
            z1 = levels[j] + (levels[j + 1] - levels[j]) * (i + 1) / parts
            mid = 0.5 * (z0 + z1)
            rho0 = c.rho[at] + (z0 - c.z[at]) * c.run[at]
            rho1 = c.rho[at] + (z1 - c.z[at]) * c.run[at]
            k = add_slice(
                out, k, start + (z0 - c.z[at]) / sk, start + (z1 - c.z[at]) / sk, 0.5 * (rho0 + rho1), z0, sk, ck, mid,
                rho0, rho1,
            )  # fmt: skip
            out[k - 1, FLANK] = 1.0 if i == 0 else 0.0
    return k, askew or many
