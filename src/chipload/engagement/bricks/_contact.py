"""Compiled loops of the engaged front of a cutter whose axis leans or turns; arrays and scalars only.

Notation: as in :mod:`chipload.engagement.bricks._sweep`; at an instant T is the direction across the axis A in which
the tip goes, N = A x T, W the rate of the axis. The point p + w A + rho e of a circle with the normal
n = sin(kappa) e - cos(kappa) A moves by

    v.n = (sin(kappa) (u + w W) + cos(kappa) rho W).e - cos(kappa) u.A,

a sinusoid of its direction e, and the front is where that is above 0. The profile consists of lines (along rho or w)
and arcs (kappa). On each the contact is looked at on circles that are evenly apart; where it begins, ends or jumps the
place is halved. Between these places slices lie at the weights and nodes of Gauss and Legendre.
Oracles: the upright engine for turned programs, points in the swept volume, in tests/engagement/bricks.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.cutter.record import BY_KAPPA, BY_Z, FLANK_LINE
from chipload.engagement.bricks._contact_places import (
    ALONG_N,
    ALONG_T,
    AXIS,
    BRICKS,
    LOOKS,
    RATE,
    SLICES,
    TAU,
    TIP,
    WAY,
    contact,
    reach,
)
from chipload.engagement.bricks._index import INDEX, enter
from chipload.engagement.bricks._line_chain import continues_move
from chipload.engagement.bricks._slices import slice_part
from chipload.engagement.bricks._sweep import A0, LENGTH, THETA, B, turn
from chipload.engagement.moves._circle import APART
from chipload.engagement.moves._contact import JUMP, STEADY, turns
from chipload.engagement.moves._uncounted_arrays import borrow_arrays

__all__ = ["APART", "BRICKS", "SLICES", "run"]

#: share of the engaged surface below which an area is a film, such as turning moves leave along a rim
FILM = 1e-3
#: greatest distance of the ends of consecutive slices [mm]
BESIDE = 1e-9
#: greatest motion to both sides of a step's middle, over the greatest radius, for which one search of moves is enough
NEAR = 0.4


@njit(cache=True, nogil=True)
def instant(m, t, height, at):
    """Pose and motion of the cutter at the time t, into ``at`` (18,): tip, T, N, A, W, u."""
    cosine, sine = turn(m, t)
    for d in range(3):
        at[TIP + d] = m[d] + t * m[3 + d]
        at[AXIS + d] = m[A0 + d] * cosine + m[B + d] * sine
        at[RATE + d] = m[THETA] * (m[B + d] * cosine - m[A0 + d] * sine)
        at[WAY + d] = m[3 + d]
    size = math.sqrt(at[AXIS] ** 2 + at[AXIS + 1] ** 2 + at[AXIS + 2] ** 2)
    for d in range(3):
        at[AXIS + d] /= size
    # across the axis: the tip's way, else that of the middle of the flutes, else any
    for k in range(5):
        if k < 2:
            x = at[WAY] if k == 0 else at[WAY] + 0.5 * height * at[RATE]
            y = at[WAY + 1] if k == 0 else at[WAY + 1] + 0.5 * height * at[RATE + 1]
            z = at[WAY + 2] if k == 0 else at[WAY + 2] + 0.5 * height * at[RATE + 2]
        else:
            x = 1.0 if k == 2 else 0.0
            y = 1.0 if k == 3 else 0.0
            z = 1.0 if k == 4 else 0.0
        whole = math.sqrt(x * x + y * y + z * z)
        along = x * at[AXIS] + y * at[AXIS + 1] + z * at[AXIS + 2]
        x -= along * at[AXIS]
        y -= along * at[AXIS + 1]
        z -= along * at[AXIS + 2]
        size = math.sqrt(x * x + y * y + z * z)
        if size > 1e-9 * whole and size > 0.0:
            break
    at[ALONG_T] = x / size
    at[ALONG_T + 1] = y / size
    at[ALONG_T + 2] = z / size
    at[ALONG_N] = at[AXIS + 1] * at[ALONG_T + 2] - at[AXIS + 2] * at[ALONG_T + 1]
    at[ALONG_N + 1] = at[AXIS + 2] * at[ALONG_T] - at[AXIS] * at[ALONG_T + 2]
    at[ALONG_N + 2] = at[AXIS] * at[ALONG_T + 1] - at[AXIS + 1] * at[ALONG_T]


@njit(cache=True, nogil=True)
def engage_profile(at, c, nodes, flank, index, work, slices, rows, owner, row_at, out):
    """What is engaged at an instant, within the ranges of the profile that :func:`reach` gave.

    Spans (psi from, to, from T) go to ``rows`` from ``row_at[0]`` on, their slices to ``slices`` from ``row_at[1]``: s
    from, s to, rho, w from, sin, cos kappa, along, across and rise of the motion. ``out``: volume of the step, pieces,
    least and greatest height, sum of the normals at ends of the front by length (x, y, z), that length, 1 where there
    is material above the flutes, length of the edge. False: no room.
    """
    spans, to, ring, front, ranges, wait = work[0], work[1], work[2], work[3], work[4], work[6]
    known, counts = work[5], work[10]
    out[:] = 0.0
    out[2] = math.inf
    out[3] = -math.inf
    # share of the angle between two samples
    front[8] = min(SLICES / (len(nodes) - 1), 1.0)
    begin = row_at[0]
    most = len(nodes) - 1
    for part in range(c.count):
        a = max(ranges[part, 0], c.q[part])
        b = min(ranges[part, 1], c.q_to[part])
        if not a < b or (c.by[part] == BY_KAPPA and c.radius[part] == 0.0):
            continue
        size = b - a
        if c.by[part] == BY_Z:
            size /= c.sin[part]
        elif c.by[part] == BY_KAPPA:
            size *= c.radius[part]
        looks = max(LOOKS, 2 * most // 3)
        if c.line[part] == FLANK_LINE or c.radius[part] > c.wide:
            looks = max(looks, min(math.ceil(size / flank), 4 * looks))
        found = slice_part(
            at, c, part, a, b, looks, flank, known[part], counts[part], nodes, index, work, slices, rows, owner, row_at,
            out,
        )  # fmt: skip
        if found < 0:
            return False
        counts[part] = found
    # above the flutes
    end = c.count
    if ranges[end - 1, 1] >= c.q_to[end - 1] and contact(at, c, end, c.z[end], index, wait, to, ring, front, spans) > 0:
        out[8] = 1.0
    total = row_at[0] - begin
    if total > 0:
        out[1] = areas_of(rows, owner, slices, begin, total, np.empty(total, np.int64), np.empty(total))
    return True


@njit(cache=True, nogil=True)
def areas_of(rows, owner, slices, first, count, room, area):
    """Number of separate areas that are engaged, films apart: spans of slices that follow one another along the profile
    and overlap, whole turns apart, belong together.
    """
    whole = 0.0
    for i in range(count):
        k = owner[first + i]
        room[i] = i
        area[i] = (rows[first + i, 1] - rows[first + i, 0]) * slices[k, 2] * (slices[k, 1] - slices[k, 0])
        whole += area[i]
        for j in range(i - 1, -1, -1):
            before = owner[first + j]
            if k - before > 1:
                break
            if k == before or abs(slices[k, 0] - slices[before, 1]) > BESIDE:
                continue
            turned = TAU * math.floor((rows[first + j, 1] - rows[first + i, 0]) / TAU)
            if rows[first + j, 0] < rows[first + i, 1] + turned:
                a = i
                while room[a] != a:
                    a = room[a]
                b = j
                while room[b] != b:
                    b = room[b]
                if a != b:
                    # the surface of both is that of the earlier one
                    room[max(a, b)] = min(a, b)
                    area[min(a, b)] += area[max(a, b)]
    areas = 0
    for i in range(count):
        if room[i] == i and area[i] >= FILM * whole:
            areas += 1
    return areas


_F1, _F2, _F3, _I1, _I2 = (
    types.float64[::1],
    types.float64[:, ::1],
    types.float64[:, :, ::1],
    types.int64[::1],
    types.int64[:, ::1],
)
#: room for :func:`run`: spans, place, ring, front, ranges, places of each part, intervals that wait, instant, rate so
#: far, rows and slices so far, number of places of each part
WORK = types.Tuple((_F2, _F1, _F1, _F1, _F2, _F3, _F2, _F1, _F1, _I1, _I1))


@njit(cache=True, nogil=True)
def engage_rows(q, group, t, once, index, work, nodes, flank, slices, rows, owner, row_at, out):
    """What ``group`` rows of teeth engage at a time t of a step, of which row r makes the move q + r; as
    :func:`engage_profile`, T, N and A of the lowest row to the end of ``out``. A row continues the profile of the one
    below it. False: no room.
    """
    at = work[7]
    c = index[8][index[7][q]]
    instant(index[6][q], t, c.height, at)
    if not once:
        reach(at, c, index, 0.0, work[4])
    if not engage_profile(at, c, nodes, flank, index, work, slices, rows, owner, row_at, out):
        return False
    for d in range(9):
        out[10 + d] = at[ALONG_T + d]
    if group == 1:
        return True
    more = np.empty(len(out))
    along = c.s[c.count] - c.s[0]
    for r in range(1, group):
        instant(index[6][q + r], t, c.height, at)
        # directions count from those of the lowest row
        for d in range(6):
            at[ALONG_T + d] = out[10 + d]
        reach(at, c, index, 0.0, work[4])
        begin = row_at[1]
        if not engage_profile(at, c, nodes, flank, index, work, slices, rows, owner, row_at, more):
            return False
        for j in range(begin, row_at[1]):
            slices[j, 0] += r * along
            slices[j, 1] += r * along
            slices[j, 3] += r * c.height
        out[0] += more[0]
        out[1] += more[1]
        out[2] = min(out[2], more[2])
        out[3] = max(out[3], more[3])
        for d in range(4, 8):
            out[d] += more[d]
        # the neck begins above the last row
        out[8] = more[8] if r == group - 1 else 0.0
        out[9] += more[9]
    return True


@njit(cache=True, nogil=True)
def instants_of(
    k, q, n, group, count, each, once, state, index, work, nodes, flank, slices, rows, owner, entry, out, entries
):
    """Find what step ``k``, the move ``q``, engages at ``count`` instants and, where it ends in a corner, at its end.

    ``each``: 1, or into how many parts each part was divided, the middles of which are known. Returns the entries so
    far, -1 where room ran out, and the engaged volume a length at the middle instant, the least and the greatest.
    """
    m = index[6][q]
    tool = index[7][q]
    c = index[8][tool]
    row_at = work[9]
    middle = 0.0
    low = math.inf
    high = -math.inf
    way = m[LENGTH] + m[THETA] * c.height
    ends = 1 if each == 1 and turns(index[6], q + group - 1, state[0] + n) else 0
    for i in range(count + ends):
        # the middle of each part was looked at
        if each > 1 and i % each == each // 2:
            continue
        if entries == len(out):
            return -1, middle, low, high
        t = (i + 0.5) / count if i < count else 1.0 - 0.5 / (count * state[6])
        before = row_at[0]
        slices_before = row_at[1]
        if not engage_rows(
            q, group, t, once, index, work, nodes, flank[tool], slices, rows, owner, row_at, out[entries]
        ):
            return -1, middle, low, high
        now = out[entries, 0] / way
        if i == count // 2:
            middle = now
        low = min(low, now)
        high = max(high, now)
        if out[entries, 8] > 0.0:
            low = -math.inf
        if i == count:
            row_at[0] = before
            row_at[1] = slices_before
        elif row_at[0] > before or out[entries, 8] > 0.0:
            entry[entries, 0] = k
            entry[entries, 1] = i
            entry[entries, 2] = before
            entries += 1
    return entries, middle, low, high


@njit(
    types.int64(types.int64, _I1, _I1, _I1, INDEX, WORK, _F3, _F1, _F2, _F2, _I1, _I2, _F2, _I1),
    cache=True,
    nogil=True,
)
def run(begin, group, instants, state, index, work, nodes, flank, slices, rows, owner, entry, out, used):
    """Find what each step from ``begin`` on engages at its instants and enter it into the index.

    Parameters
    ----------
    group : (n,) number of rows of teeth whose moves begin here, which are looked at together; 0: not the first of them
    instants : (n,) at how many times a step is looked at, the middles of so many equal parts of it; 0: not at all.
        Steps that do not cut as the one before them, or not alike all along, get more
    state : number of the move that is the first step; 1 where the engagement of step ``begin`` is known, 2 where it is
        joined with the one before it, too; rows, slices
        and entries so far; instants of a step that gets more, and of one that enters or leaves, of each of its parts
    index : see :mod:`chipload.engagement.bricks._index`; the moves of these steps are in it
    nodes : (N + 1, N, 3) from, to and node of so many parts of 0..1
    flank : longest slice of the flank of each cutter [mm]
    slices, rows, owner, out : see :func:`engage_profile`; ``out`` has 9 more columns: T, N and A
    entry : (m, 3) step, instant and first row of each instant that cuts
    used : (3,) room taken of lists, and of blocks, and the number of the last move

    Returns
    -------
    The number of steps, or the one at which room ran out: ``state[1]`` 0: of rows, 2: of lists or blocks.
    """
    # the caller keeps all of them
    index = borrow_arrays(index)
    work = borrow_arrays(work)
    at, rate, row_at = work[7], work[8], work[9]
    group, instants, state = borrow_arrays((group, instants, state))
    nodes, flank = borrow_arrays((nodes, flank))
    slices, rows, owner = borrow_arrays((slices, rows, owner))
    entry, out, used = borrow_arrays((entry, out, used))
    n = len(instants)
    for k in range(begin, n):
        q = state[0] + k
        m = index[6][q]
        tool = index[7][q]
        c = index[8][tool]
        if state[1] == 0:
            count = instants[k]
            each = 1
            row_at[0] = state[2]
            row_at[1] = state[3]
            entries = state[4]
            # what of the profile is near material is found once, unless the cutter goes far
            slack = 0.5 * (m[LENGTH] + m[THETA] * (c.height + c.wide))
            once = slack < c.wide * NEAR and group[k] == 1
            if once and count > 0:
                instant(m, 0.5, c.height, at)
                reach(at, c, index, slack, work[4])
            while count > 0:
                entries, middle, low, high = instants_of(
                    k, q, n, group[k], count, each, once, state, index, work, nodes, flank, slices, rows, owner, entry,
                    out, entries,
                )  # fmt: skip
                if entries < 0:
                    return k
                if instants[k] == 1 and each == 1:
                    low = min(low, rate[0])
                    high = max(high, rate[0])
                    rate[0] = middle
                if each > 1 or state[6] == 1 or high - low <= STEADY * high:
                    break
                each = state[5] if high - low < JUMP * high else state[6]
                count *= each
                for i in range(state[4], entries):
                    entry[i, 1] = entry[i, 1] * each + each // 2
                if each == 1:
                    break
            instants[k] = count
            if count > 0:
                state[2] = row_at[0]
                state[3] = row_at[1]
                state[4] = entries
            state[1] = 1
        if state[1] == 1:
            last = used[2]
            if last < 0 or index[7][last] != tool or not continues_move(index[6][last], m, c):
                used[2] = q
            state[1] = 2
        if not enter(used[2], m, c, index, used, work[6]):
            return k
        state[1] = 0
    return n
