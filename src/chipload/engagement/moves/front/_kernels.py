"""Compiled loops of the engaged front of a cutter that moves along a line; arrays and scalars only.

Notation: psi [rad] angle in the plan from the direction of the motion, counter-clockwise; v the motion of a step, n the
outward normal of the cutter; the front is where v.n > 0: sin(kappa) |v_xy| cos(psi) > cos(kappa) v_z. A slice of the
edge is a circle rho at a height z on the cutter's surface; a candidate is a cell of the index in which the surface may
be in material: least and greatest distance from the axis, angle and half the angle that it takes, height of its
``ceil`` above the tip.
Oracle: sampling of the front by brute force, in tests/engagement/moves.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.engagement.moves._kernels import (
    AIR,
    FLUTE,
    MATERIAL,
    TB,
    WIDE,
    keep,
    swept,
    what_is,
)
from chipload.engagement.moves.edge._kernels import candidates, sliced

PI = math.pi
TAU = 2.0 * math.pi
#: beside the end of the front, where the contact is judged [rad]
BESIDE = 1e-4
#: square of the angle [rad^2] to which the border of the material is found, and most moves that are asked for it
NARROW, TURNS = 1e-8, 200
#: greatest angle between two samples [rad]
APART = 0.35
#: heights of the stock that cut the flank into slices; where there are more they are evenly thick
LEVELS = 16
#: least sine of the front's end that counts
ALONG = 1e-9


@njit(cache=True, nogil=True)
def window(near, count, rho0, rho1, z0, end):
    """Range of psi in -end .. end in which candidates touch a slice; the first above the second where none does."""
    low = math.inf
    high = -math.inf
    for i in range(count):
        if near[i, 1] >= rho0 and near[i, 0] <= rho1 and near[i, 4] > z0:
            a = near[i, 2] - near[i, 3]
            b = near[i, 2] + near[i, 3]
            if a < -PI or b > PI:
                return -end, end
            low = min(low, a)
            high = max(high, b)
    return max(low, -end), min(high, end)


@njit(cache=True, nogil=True)
def border(px, py, z, rho, T, cm, sm, ca, sa, e, index):
    """Psi between a direction (cos, sin) in material (cm, sm) and one in air (ca, sa) where the material ends; ``e``
    the move that swept the latter, or AIR.

    The border is that of one move, found by halving, unless what is left beside it was swept by another.
    """
    for _ in range(TURNS):
        if (cm - ca) ** 2 + (sm - sa) ** 2 < NARROW:
            break
        lc = cm
        ls = sm
        hc = ca
        hs = sa
        while (lc - hc) ** 2 + (ls - hs) ** 2 >= NARROW:
            c = lc + hc
            s = ls + hs
            size = 1.0 / math.sqrt(c * c + s * s)
            c *= size
            s *= size
            if e < 0:
                lc = c
                ls = s
                break
            x = px + rho * (c * T[0] - s * T[1])
            y = py + rho * (c * T[1] + s * T[0])
            if swept(index[6][e], index[8][index[7][e]], x, y, z):
                hc = c
                hs = s
            else:
                lc = c
                ls = s
        f = what_is(px + rho * (lc * T[0] - ls * T[1]), py + rho * (lc * T[1] + ls * T[0]), z, index, e)
        if f == MATERIAL:
            cm = lc
            sm = ls
            ca = hc
            sa = hs
        else:
            ca = lc
            sa = ls
            e = f
    return math.atan2(sm + sa, cm + ca)


@njit(cache=True, nogil=True)
def ridge(px, py, z, rho, T, ca, sa, cb, sb, ea, eb, index):
    """Whether there is material between two directions (cos, sin of psi) in air, a swept by the move ``ea``, b by
    ``eb``, and a direction in it: from the border of one move on to that of the next until b is reached.
    """
    if ea < 0:
        ca, sa, cb, sb, ea, eb = cb, sb, ca, sa, eb, ea
    if ea < 0:
        return False, 0.0, 0.0
    for _ in range(TURNS):
        m = index[6][ea]
        cutter = index[8][index[7][ea]]
        if swept(m, cutter, px + rho * (cb * T[0] - sb * T[1]), py + rho * (cb * T[1] + sb * T[0]), z):
            return False, 0.0, 0.0
        hc = cb
        hs = sb
        while (ca - hc) ** 2 + (sa - hs) ** 2 >= NARROW:
            c = ca + hc
            s = sa + hs
            size = 1.0 / math.sqrt(c * c + s * s)
            c *= size
            s *= size
            if swept(m, cutter, px + rho * (c * T[0] - s * T[1]), py + rho * (c * T[1] + s * T[0]), z):
                ca = c
                sa = s
            else:
                hc = c
                hs = s
        f = what_is(px + rho * (hc * T[0] - hs * T[1]), py + rho * (hc * T[1] + hs * T[0]), z, index, eb)
        if f == MATERIAL:
            return True, hc, hs
        if f < 0 or f == eb:
            return False, 0.0, 0.0
        ca = hc
        sa = hs
        ea = f
    return False, 0.0, 0.0


@njit(cache=True, nogil=True)
def intervals(p, T, rho, z, low, high, end, apart, index, out):
    """Parts of low .. high in material on the circle of a slice: rows (from, to) of ``out``; their number.

    -end .. end is the front; where it ends the contact is judged just beside.
    """
    first = max(low, BESIDE - end) if end < PI else low
    last = min(high, end - BESIDE) if end < PI else high
    if last <= first:
        return 0
    n = max(math.ceil((last - first) / apart), 1)
    d = (last - first) / n
    c = math.cos(first)
    s = math.sin(first)
    cd = math.cos(d)
    sd = math.sin(d)
    count = 0
    before = AIR
    inside = False
    c0 = c
    s0 = s
    for i in range(n + 1):
        f = what_is(p[0] + rho * (c * T[0] - s * T[1]), p[1] + rho * (c * T[1] + s * T[0]), z, index, before)
        if i > 0 and f != MATERIAL and not inside and f != before:
            found, cr, sr = ridge(p[0], p[1], z, rho, T, c0, s0, c, s, before, f, index)
            if found:
                out[count, 0] = border(p[0], p[1], z, rho, T, cr, sr, c0, s0, before, index)
                out[count, 1] = border(p[0], p[1], z, rho, T, cr, sr, c, s, f, index)
                count += 1
        if f == MATERIAL and not inside:
            if i > 0:
                psi = border(p[0], p[1], z, rho, T, c, s, c0, s0, before, index)
            else:
                psi = -end if first < 2.0 * BESIDE - end else first
            out[count, 0] = psi
            inside = True
        elif f != MATERIAL and inside:
            out[count, 1] = border(p[0], p[1], z, rho, T, c0, s0, c, s, f, index)
            count += 1
            inside = False
        if f != MATERIAL:
            before = f
        c0 = c
        s0 = s
        c, s = c * cd - s * sd, c * sd + s * cd
    if inside:
        out[count, 1] = end if last > end - 2.0 * BESIDE else last
        count += 1
    return count


@njit(cache=True, nogil=True)
def parts_of(spans, slice_of, first, count, room):
    """Number of pieces of what is engaged: spans of slices that follow one another and overlap belong together."""
    for i in range(count):
        room[i] = i
    pieces = count
    for i in range(count):
        for j in range(i):
            if slice_of[first + i] - slice_of[first + j] != 1:
                continue
            if spans[i, 0] < spans[j, 1] and spans[j, 0] < spans[i, 1]:
                a = i
                while room[a] != a:
                    a = room[a]
                b = j
                while room[b] != b:
                    b = room[b]
                if a != b:
                    room[a] = b
                    pieces -= 1
    return pieces


@njit(cache=True, nogil=True)
def engaged(p, u, c, T, pieces, flank, index, near, levels, scratch, spans, mine, room, slices, rows, owner, at, out):
    """What is engaged at the tip position p of a step u.

    Spans (psi from, to) of ``mine`` slices go to ``rows`` from ``at[0]`` on, their slices to ``slices`` from ``at[1]``;
    ``out``: volume of the step, pieces, least and greatest height of a slice, sum of the normals at ends of the front
    by length (x, y, z), that length, 1 where there is material above the flutes, length of the edge. False: no room.
    """
    out[:] = 0.0
    hu = math.hypot(u[0], u[1])
    grid = index[0]
    count = candidates(p, T, u[2] >= 0.0, c, grid, index[1], index[2], near)
    if count == 0:
        return True
    number = sliced(c, near, count, u[2] < 0.0, pieces, flank, levels, scratch)
    apart = 2.5 * min(grid[2], grid[3])
    row = at[0]
    have = at[1]
    total = 0
    out[2] = math.inf
    out[3] = -math.inf
    for k in range(number + 1):
        probe = k == number
        if probe:
            # above the flutes
            scratch[k, 2] = c[WIDE]
            scratch[k, 3] = c[FLUTE]
            scratch[k, 6] = c[FLUTE]
            scratch[k, 4] = 1.0
            scratch[k, 5] = 0.0
            scratch[k, 7] = c[WIDE]
            scratch[k, 8] = c[WIDE]
        rho = scratch[k, 2]
        sk = scratch[k, 4]
        ck = scratch[k, 5]
        side = sk * hu
        rise = ck * u[2]
        if side <= rise + ALONG * (hu + abs(u[2])):
            continue
        end = PI if rise <= -side else math.acos(rise / side)
        low, high = window(near, count, scratch[k, 7], scratch[k, 8], scratch[k, 3], end)
        if low >= high:
            continue
        found = intervals(
            p, T, rho, p[2] + scratch[k, 6], low, high, end, min(apart / rho, APART), index, spans[total:]
        )
        if found == 0:
            continue
        if probe:
            out[8] = 1.0
            break
        if have == len(slices) or row + found > len(rows):
            return False
        ds = scratch[k, 1] - scratch[k, 0]
        for i in range(total, total + found):
            a = spans[i, 0]
            b = spans[i, 1]
            out[0] += (side * (math.sin(b) - math.sin(a)) - rise * (b - a)) * rho * ds
            rows[row, 0] = a
            rows[row, 1] = b
            owner[row] = have
            mine[i] = k
            row += 1
            for e in (a, b):
                if end < PI and abs(abs(e) - end) < 1e-12:
                    out[4] += ds * sk * (math.cos(e) * T[0] - math.sin(e) * T[1])
                    out[5] += ds * sk * (math.cos(e) * T[1] + math.sin(e) * T[0])
                    out[6] -= ds * ck
                    out[7] += ds
        total += found
        for i in range(6):
            slices[have, i] = scratch[k, i]
        have += 1
        out[2] = min(out[2], p[2] + scratch[k, 3])
        out[3] = max(out[3], p[2] + 2.0 * scratch[k, 6] - scratch[k, 3])
        out[9] += ds
    if total > 0:
        out[1] = parts_of(spans, mine, 0, total, room)
    at[0] = row
    at[1] = have
    return True


@njit(cache=True, nogil=True)
def rooms(index, pieces, flank):
    """Most candidates, slices and samples of a slice of any cutter."""
    grid = index[0]
    cells = 0
    most = 0
    samples = 0
    for k in range(len(index[8])):
        c = index[8][k]
        cells = max(cells, (int(2.0 * c[WIDE] / grid[2]) + 3) * (int(2.0 * c[WIDE] / grid[3]) + 3))
        sk = math.cos(math.atan(c[TB]))
        most = max(most, 3 * pieces + LEVELS + int(c[FLUTE] / sk / flank[k]) + 4)
        samples = max(samples, int(TAU / min(min(grid[2], grid[3]) / c[WIDE], APART)) + 4)
    return cells, most, samples


_F1, _F2, _I1, _I2, _S = (
    types.float64[::1],
    types.float64[:, ::1],
    types.int64[::1],
    types.int64[:, ::1],
    types.int32[::1],
)
INDEX = types.Tuple((_F1, _I1, _F2, _I2, _S, _F1, _F2, _I1, _F2, _F1, _F1, _I1, _S, _F2))


@njit(
    types.int64(types.int64, _F2, _I1, _I1, INDEX, types.int64, _F1, _F2, _F2, _I1, _I2, _F2, _I1),
    cache=True,
    nogil=True,
)
def run(begin, frame, instants, state, index, pieces, flank, slices, rows, owner, entry, out, used):
    """Find what each step from ``begin`` on engages at its instants and enter it into the index.

    Parameters
    ----------
    frame : (n, 2) direction in the plan from which psi is counted, of each step
    instants : (n,) at how many times a step is looked at: the middles of so many equal parts of it
    state : number of the move that is the first step; 1 where the engagement of step ``begin`` is known; rows, slices
        and entries so far
    index : see :func:`chipload.engagement.moves._kernels.what_is`; the moves of these steps are in it
    pieces, flank : slices of a corner, and longest slice of the flank of each cutter [mm]
    slices, rows, owner, out : see :func:`engaged`
    entry : (m, 3) step, instant and first row of each instant that cuts
    used : (1,) room taken of the lists

    Returns
    -------
    The number of steps, or the one at which room ran out: ``state[1]`` 0: of rows, 1: of lists.
    """
    n = len(instants)
    cells, most, samples = rooms(index, pieces, flank)
    near = np.empty((cells, 6))
    levels = np.empty(LEVELS)
    scratch = np.empty((most, 9))
    spans = np.empty((most * (samples + 1), 2))
    mine = np.empty(len(spans), np.int64)
    room = np.empty(len(spans), np.int64)
    p = np.empty(3)
    at = np.empty(2, np.int64)
    for k in range(begin, n):
        q = state[0] + k
        m = index[6][q]
        c = index[8][index[7][q]]
        if state[1] == 0:
            at[0] = state[2]
            at[1] = state[3]
            entries = state[4]
            for i in range(instants[k]):
                t = (i + 0.5) / instants[k]
                for d in range(3):
                    p[d] = m[d] + t * m[3 + d]
                if entries == len(out):
                    return k
                before = at[0]
                if not engaged(
                    p, m[3:], c, frame[k], pieces, flank[index[7][q]], index, near, levels, scratch, spans, mine, room,
                    slices, rows, owner, at, out[entries],
                ):  # fmt: skip
                    return k
                if at[0] > before or out[entries, 8] > 0.0:
                    entry[entries, 0] = k
                    entry[entries, 1] = i
                    entry[entries, 2] = before
                    entries += 1
            state[2] = at[0]
            state[3] = at[1]
            state[4] = entries
            state[1] = 1
        if not keep(q, m, c, index[0], index[1], index[2], index[3], index[4], index[5], used):
            return k
        state[1] = 0
    return n
