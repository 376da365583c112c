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

from chipload.engagement.moves._circle import ALONG, APART, intervals
from chipload.engagement.moves._edge import (
    FLANK,
    SAME,
    add_slice,
    arc_of,
    candidates,
    slice_arc_again,
    slice_profile,
    windows,
)
from chipload.engagement.moves._flank import BEGIN, COUNT, divide_flank
from chipload.engagement.moves._sweep import CUTTERS, keep
from chipload.engagement.moves._uncounted_arrays import borrow_arrays

PI = math.pi
#: greatest number of heights of the stock at which the flank is divided: those of cells, above which the slices are
#: equally thick, and as many floors of moves
LEVELS = 32
#: greatest relative change of the volume per length between two steps that cut alike, and least change of one that
#: enters or leaves the material
STEADY, JUMP = 0.03, 0.3
#: halvings of the distance between two slices for the border of a hole under a tool that goes down its axis
HALVINGS = 12
#: slices at an end of an arc that are not in contact, from which on its slices are placed again beyond the last of
#: them, and how often at most: in a thin layer most of the part of the arc that may be in contact is not
FREE, AGAIN = 2, 2
#: cosine of the least angle between two moves that make a corner
CORNER = 0.985


@njit(cache=True, nogil=True)
def parts_of(rows, first, slice_of, count, room):
    """Number of connected areas that are engaged: overlapping spans of consecutive slices are one area.

    Parameters
    ----------
    rows : spans from and to [rad], from row ``first`` on
    slice_of : (count,) numbers of their slices
    room : (count,) working array
    """
    for i in range(count):
        room[i] = i
    pieces = count
    for i in range(count):
        for j in range(i - 1, -1, -1):
            apart = slice_of[i] - slice_of[j]
            if apart > 1:
                break
            if apart < 1:
                continue
            if rows[first + i, 0] < rows[first + j, 1] and rows[first + j, 0] < rows[first + i, 1]:
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


@njit(cache=True, nogil=True, inline="always")
def leading_angle(side, rise, whole):
    """Psi at which the front of a slice ends; below 0 where it has none. ``whole`` is the size of the motion."""
    if side <= rise + ALONG * whole:
        return -1.0
    return PI if rise <= -side else math.acos(rise / side)


@njit(cache=True, nogil=True, inline="always")
def add_ranges(table, k, spans, begin, found, place, end, p, u, T, slices, rows, owner, first_row, mine, at, out):
    """Add the ranges of row k of a table of slices to what an instant engages; False: no room.

    Parameters
    ----------
    table : (m, 7 or more) see :func:`chipload.engagement.moves._edge.add_slice`
    spans, begin, found : ranges of the slice, the first of them and their number
    place : number of the slice, by which slices follow one another
    end : of the front [rad]
    first_row : of the instant
    p, u, T, slices, rows, owner, mine, at, out : see :func:`find_engagement`
    """
    row = at[0]
    have = at[1]
    if have == len(slices) or row + found > len(rows):
        return False
    rho = table[k, 2]
    sk = table[k, 4]
    ck = table[k, 5]
    side = sk * math.hypot(u[0], u[1])
    rise = ck * u[2]
    ds = table[k, 1] - table[k, 0]
    for i in range(begin, begin + found):
        a = spans[i, 0]
        b = spans[i, 1]
        out[0] += (side * (math.sin(b) - math.sin(a)) - rise * (b - a)) * rho * ds
        rows[row, 0] = a
        rows[row, 1] = b
        owner[row] = have
        mine[row - first_row] = place
        row += 1
        for e in (a, b):
            if end < PI and abs(abs(e) - end) < 1e-12:
                out[4] += ds * sk * (math.cos(e) * T[0] - math.sin(e) * T[1])
                out[5] += ds * sk * (math.cos(e) * T[1] + math.sin(e) * T[0])
                out[6] -= ds * ck
                out[7] += ds
    for i in range(6):
        slices[have, i] = table[k, i]
    out[2] = min(out[2], p[2] + table[k, 3])
    out[3] = max(out[3], p[2] + 2.0 * table[k, 6] - table[k, 3])
    out[9] += ds
    at[0] = row
    at[1] = have + 1
    return True


@njit(cache=True, nogil=True, inline="always")
def on_line(table, k):
    """Whether slice k is of a line that widens: its middle lies on the line of its angle through its lower end."""
    return (
        table[k, 5] > 0.0
        and abs((table[k, 6] - table[k, 3]) * table[k, 5] - (table[k, 2] - table[k, 7]) * table[k, 4]) < 1e-9
    )


@njit(cache=True, nogil=True)
def begin_at_border(p, T, table, k, inner, low, high, end, apart, index, spans):
    """Let slice k of a line begin where its contact does, from ``inner`` on to its middle: the number of its ranges. In
    a motion along the axis the contact ends at the wall of a hole.
    """
    outer = table[k, 2]
    rise = (table[k, 6] - table[k, 3]) / (outer - table[k, 7])
    run = (table[k, 1] - table[k, 0]) / (table[k, 8] - table[k, 7])
    for _ in range(HALVINGS):
        mid = 0.5 * (inner + outer)
        z = p[2] + table[k, 6] + (mid - table[k, 2]) * rise
        if intervals(p, T, mid, z, low, high, end, min(apart / mid, APART), index, spans, np.int64(0)) == 0:
            inner = mid
        else:
            outer = mid
    widest = table[k, 8]
    table[k, 0] += (outer - table[k, 7]) * run
    table[k, 3] += (outer - table[k, 7]) * rise
    table[k, 7] = outer
    rho = 0.5 * (outer + widest)
    table[k, 6] += (rho - table[k, 2]) * rise
    table[k, 2] = rho
    return intervals(p, T, rho, p[2] + table[k, 6], low, high, end, min(apart / rho, APART), index, spans, np.int64(0))


@njit(cache=True, nogil=True)
def find_engagement(
    p, u, c, T, parts, flank, index, near, levels, scratch, spans, mine, room, held, slices, rows, owner, at, out
):  # fmt: skip
    """Find the engagement at a tip position; False: no room in ``rows`` or ``slices``.

    Parameters
    ----------
    p, u : (3,) tip, and motion of the step [mm]
    c : cutter; T : (2,) unit vector of psi = 0
    parts, flank : slices of a corner; longest slice of the flank [mm]
    near, levels, scratch, spans, mine, room, held : working arrays, see ``WORK``
    slices, rows, owner : slices; spans (psi from, to) [rad]; slice of each span; from ``at[1]`` and ``at[0]`` on
    out : (10,) volume of the step [mm^3], number of areas, least and greatest height of a slice [mm], sum of the
        normals at ends of the front times their length (x, y, z), that length [mm], 1 if there is material above the
        flutes, length of the edge [mm]
    """
    # what a call passes counts again
    index = borrow_arrays(index)
    p, u, T, near, levels, scratch, spans = borrow_arrays((p, u, T, near, levels, scratch, spans))
    held = borrow_arrays(held)
    out[:] = 0.0
    hu = math.hypot(u[0], u[1])
    grid = index[0]
    count = candidates(p, T, u[2] >= 0.0, c, grid, index[1], index[2], near)
    if count == 0:
        return True
    number, askew = slice_profile(p, c, near, count, u, parts, flank, levels, index, scratch)
    apart = 2.5 * min(grid[2], grid[3])
    # above the flutes
    add_slice(scratch, number, 0.0, 0.0, c.wide, c.height, 1.0, 0.0, c.height, c.wide, c.wide)
    windows(near, count, 0.5 * math.hypot(grid[2], grid[3]), scratch, number + 1)
    first_row = at[0]
    first_slice = at[1]
    out[2] = math.inf
    out[3] = -math.inf
    flank_from = number
    while flank_from > 0 and scratch[flank_from - 1, FLANK] >= 0.0:
        flank_from -= 1
    # of a cutter that meets the material with one arc
    bow = arc_of(c, scratch[0, 0], scratch[number - 1, 1]) if number == len(parts) == flank_from else -1
    again = AGAIN if bow >= 0 else 0
    free = -1
    lowest = -1
    highest = -1
    n = 0
    while n <= flank_from:
        # last above the flutes
        k = n if n < flank_from else number
        n += 1
        if k == number and again > 0 and highest >= 0 and highest < number - FREE:
            # again below the lowest of the free slices at the upper end
            again -= 1
            slice_arc_again(c, bow, lowest - 1, highest + 1, parts, scratch)
            windows(near, count, 0.5 * math.hypot(grid[2], grid[3]), scratch, number + 1)
            at[0] = first_row
            at[1] = first_slice
            out[:] = 0.0
            out[2] = math.inf
            out[3] = -math.inf
            free = lowest = highest = -1
            n = 0
            continue
        rho = scratch[k, 2]
        end = leading_angle(scratch[k, 4] * hu, scratch[k, 5] * u[2], hu + abs(u[2]))
        low = max(scratch[k, 9], -end)
        high = min(scratch[k, 10], end)
        if low >= high:
            continue
        found = intervals(
            p, T, rho, p[2] + scratch[k, 6], low, high, end, min(apart / rho, APART), index, spans, np.int64(0)
        )
        if found == 0:
            free = k
            continue
        if again > 0 and lowest < 0 and FREE <= k < number:
            # again above the highest of the free slices at the lower end
            again -= 1
            slice_arc_again(c, bow, k - 1, number, parts, scratch)
            windows(near, count, 0.5 * math.hypot(grid[2], grid[3]), scratch, number + 1)
            free = -1
            n = 0
            continue
        if lowest < 0:
            lowest = k
        highest = k
        if hu == 0.0 and k < number and scratch[k, 7] > 0.0 and on_line(scratch, k):
            alike = k > 0 and scratch[k - 1, 1] == scratch[k, 0] and scratch[k - 1, 4] == scratch[k, 4]
            if not alike or free == k - 1:
                inner = scratch[k - 1, 2] if alike else scratch[k, 7]
                found = begin_at_border(p, T, scratch, k, inner, low, high, end, apart, index, spans)
        if k == number:
            out[8] = 1.0
        elif not add_ranges(
            scratch, k, spans, 0, found, k, end, p, u, T, slices, rows, owner, first_row, mine, at, out
        ):
            return False
    if flank_from < number:
        end = leading_angle(scratch[flank_from, 4] * hu, scratch[flank_from, 5] * u[2], hu + abs(u[2]))
        pieces = divide_flank(p, T, c, flank_from, number, end, askew, scratch, index, spans, held)
        place = flank_from
        for k in range(pieces):
            # pieces that do not follow one another are separate areas
            if k > 0:
                place += 1 if held[k, 3] - (2.0 * held[k - 1, 6] - held[k - 1, 3]) < SAME else 2
            begin = int(held[k, BEGIN])
            found = int(held[k, COUNT])
            if not add_ranges(
                held, k, spans, begin, found, place, end, p, u, T, slices, rows, owner, first_row, mine, at, out
            ):
                return False
    if at[0] > first_row:
        out[1] = parts_of(rows, first_row, mine, at[0] - first_row, room)
    return True


_F1, _F2, _I1, _I2, _S = (
    types.float64[::1],
    types.float64[:, ::1],
    types.int64[::1],
    types.int64[:, ::1],
    types.int32[::1],
)
#: room for :func:`run`: candidates, levels, slices, spans, their slices, areas, place, rows and slices so far, and
#: pieces of the flank
WORK = types.Tuple((_F2, _F1, _F2, _F2, _I1, _I1, _F1, _I1, _F2))
INDEX = types.Tuple((_F1, _I1, _F2, _I2, _S, types.uint16[::1], _F2, _I1, CUTTERS, _F1, _F1, _I1, _S, _F2))


@njit(cache=True, nogil=True)
def turns(moves, q, end):
    """Whether move q is the last before number ``end``, or makes a corner with the next one."""
    if q + 1 >= end:
        return True
    dot = 0.0
    one = 0.0
    two = 0.0
    for d in range(3, 6):
        dot += moves[q, d] * moves[q + 1, d]
        one += moves[q, d] ** 2
        two += moves[q + 1, d] ** 2
    return dot < CORNER * math.sqrt(one * two)


@njit(cache=True, nogil=True, inline="always")
def put_tip(m, t, p):
    """Write the tip of a move m (6,) at a time t of 0..1 into p (3,) [mm]."""
    for d in range(3):
        p[d] = m[d] + t * m[3 + d]


@njit(cache=True, nogil=True)
def step_engaged(k, frame, instants, state, index, work, parts, flank, slices, rows, owner, entry, out):
    """Find what step k engages at its instants, and count it in ``state``; False: no room.

    Parameters: see :func:`run`.
    """
    # what a call passes counts again
    index = borrow_arrays(index)
    near, levels, scratch, spans, mine, room, p, at, held = borrow_arrays(work)
    frame, instants, state, parts, flank = borrow_arrays((frame, instants, state, parts, flank))
    slices, rows, owner, entry, out = borrow_arrays((slices, rows, owner, entry, out))
    q = state[0] + k
    m = index[6][q]
    c = index[8][index[7][q]]
    longest = flank[index[7][q]]
    at[0] = state[2]
    at[1] = state[3]
    entries = state[4]
    length = math.sqrt(m[3] * m[3] + m[4] * m[4] + m[5] * m[5])
    count = instants[k]
    rate = 0.0
    least = math.inf
    most = 0.0
    i = 0
    while i < count:
        # the middle first: where a step of one instant cuts unlike the one before it, others beside the middle too
        j = (i + count // 2) % count
        put_tip(m, (j + 0.5) / count, p)
        if entries == len(out):
            return False
        before = at[0]
        if not find_engagement(
            p, m[3:], c, frame[k], parts, longest, index, near, levels, scratch, spans, mine, room, held,
            slices, rows, owner, at, out[entries],
        ):  # fmt: skip
            return False
        if i == 0 and length > 0.0:
            rate = out[entries, 0] / length
            change = abs(rate - p[3]) / max(rate, p[3]) if rate != p[3] else 0.0
            if instants[k] == 1 and change > STEADY:
                count = state[5] if change < JUMP else state[6]
                j = count // 2
        now = out[entries, 0] / length if length > 0.0 else 0.0
        if at[0] > before or out[entries, 8] > 0.0:
            entry[entries, 0] = k
            entry[entries, 1] = j
            entry[entries, 2] = before
            entries += 1
        if instants[k] > 1 and count == instants[k] and length > 0.0:
            least = min(least, now)
            most = max(most, now)
        last = i == count - 1 if instants[k] > 1 else i == 0
        if last and count == instants[k] and length > 0.0 and turns(index[6], q, state[0] + len(instants)):
            # a step that ends in a corner may meet the material at its very end
            put_tip(m, 1.0 - 0.5 / (count * state[6]), p)
            if entries == len(out):
                return False
            rows_before = at[0]
            slices_before = at[1]
            if not find_engagement(
                p, m[3:], c, frame[k], parts, longest, index, near, levels, scratch, spans, mine,
                room, held, slices, rows, owner, at, out[entries],
            ):  # fmt: skip
                return False
            end = out[entries, 0] / length
            at[0] = rows_before
            at[1] = slices_before
            if instants[k] > 1:
                least = -math.inf if out[entries, 8] > 0.0 else min(least, end)
                most = max(most, end)
            elif abs(end - rate) > STEADY * max(end, rate) or out[entries, 8] > 0.0:
                count = state[6]
                if entries > state[4]:
                    entry[entries - 1, 1] = count // 2
        i += 1
        if i == count == instants[k] and state[5] > 1 and most - least > STEADY * most:
            # a long step that does not cut alike all along: again from its beginning, each part as a step
            count *= state[5] if most - least < JUMP * most else state[6]
            at[0] = state[2]
            at[1] = state[3]
            entries = state[4]
            i = 0
    if length > 0.0 and count > 0:
        p[3] = rate
    instants[k] = count
    state[2] = at[0]
    state[3] = at[1]
    state[4] = entries
    state[1] = 1
    return True


@njit(
    types.int64(types.int64, _F2, _I1, _I1, INDEX, WORK, _F2, _F1, _F2, _F2, _I1, _I2, _F2, _I1),
    cache=True,
    nogil=True,
)
def run(begin, frame, instants, state, index, work, parts, flank, slices, rows, owner, entry, out, used):
    """Find what each step from ``begin`` on engages at its instants and enter it into the index.

    Parameters
    ----------
    frame : (n, 2) unit vector in the plan from which psi is counted, of each step
    instants : (n,) number of instants of each step: the middles of so many equal parts of it; a step of one instant
        that does not cut as the step before it gets more, and so does a longer one whose instants differ
    state : (7,) number of the move that is the first step; 1 where the engagement of step ``begin`` is known; rows,
        slices and entries so far; number of instants, or of parts of each instant, where the volume a length changes
        by more than ``STEADY``, and by more than ``JUMP``
    index : see :func:`chipload.engagement.moves._sweep.what_is`; the moves of these steps are in it
    work : working arrays, see ``WORK``
    parts, flank : slices of a corner; longest slice of the flank of each cutter [mm]
    slices, rows, owner, out : see :func:`find_engagement`
    entry : (m, 3) step, instant and first row of each instant that cuts
    used : (1,) room taken of the lists of the index

    Returns
    -------
    The number of steps, or the one at which room ran out: ``state[1]`` 0: of rows, 1: of lists.
    """
    # the caller keeps all of them
    index = borrow_arrays(index)
    work = borrow_arrays(work)
    frame, instants, state, parts, flank = borrow_arrays((frame, instants, state, parts, flank))
    slices, rows, owner = borrow_arrays((slices, rows, owner))
    entry, out, used = borrow_arrays((entry, out, used))
    n = len(instants)
    for k in range(begin, n):
        if state[1] == 0 and not step_engaged(
            k, frame, instants, state, index, work, parts, flank, slices, rows, owner, entry, out
        ):
            return k
        q = state[0] + k
        c = index[8][index[7][q]]
        if not keep(q, index[6][q], c, index[0], index[1], index[2], index[3], index[4], index[5], used):
            return k
        state[1] = 0
    return n
