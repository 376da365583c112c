"""Compiled loops of the index of moves in bricks; arrays and scalars only.

Notation: a brick is a cell of the initial body's box; 8 x 8 x 8 of them are a block. A block that no move has reached
has no bricks. A block that one move has swept completely has only the number of that move. In any other block a brick
has either the number e of the move that swept it completely, stored as the length -1 - e, or a list of the moves that
swept a part of it. A move sweeps a brick completely if the brick's centre lies within the cutter by at least half the
diagonal, and does not touch it if the centre lies outside by as much. Lists have no limit.

``index``: grid (sides from, sides of a brick), shape (bricks, blocks), blocks, bricks (where the list begins, its
length, its room), kept moves, bricks of each block that are no air, moves, cutter of each, cutters, and of the initial
body low, high, and, for a mesh, the grid and shape of its plan, levels, first, ids, faces as of the upright index.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types

from chipload.engagement.bricks._sweep import A0, THETA, B, U, chord, nearest_time, swept, swept_share_of_ball
from chipload.engagement.moves._sweep import AIR, CUTTERS, EPS, MATERIAL, in_solid, place

#: bricks along a side of a block, and in it
SIDE, MANY = 8, 512
#: of a block: no move has reached it; a place outside the box; BY less the number of the move that swept all of it
UNTOUCHED, OUTSIDE, BY = -1, -2, -3

_F1, _F2, _I1, _S1, _S2 = (
    types.float64[::1],
    types.float64[:, ::1],
    types.int64[::1],
    types.int32[::1],
    types.int32[:, ::1],
)
INDEX = types.Tuple((_F1, _I1, _S1, _S2, _S1, _S1, _F2, _I1, CUTTERS, _F1, _F1, _F1, _I1, _F2, _I1, _S1, _F2))


@njit(cache=True, nogil=True)
def solid(x, y, z, index):
    """Whether a point is in the initial body."""
    low = index[9]
    high = index[10]
    if not (
        low[0] + EPS <= x <= high[0] - EPS and low[1] + EPS <= y <= high[1] - EPS and low[2] + EPS <= z <= high[2] - EPS
    ):
        return False
    faces = index[16]
    if len(faces) == 0:
        return True
    cell = place(x, y, index[11], index[12])
    if cell < 0:
        return False
    level = index[13]
    if z >= level[cell, 1] - EPS:
        return False
    if level[cell, 2] <= z < level[cell, 0] - EPS:
        return True
    return in_solid(x, y, z, low, high, index[14], index[15], faces, cell)


@njit(cache=True, nogil=True)
def brick_of(x, y, z, grid, shape, blocks):
    """Row of a point's brick; below 0: what its block is, or OUTSIDE."""
    i = math.floor((x - grid[0]) / grid[3])
    j = math.floor((y - grid[1]) / grid[4])
    k = math.floor((z - grid[2]) / grid[5])
    # a point on the far border is in the last brick
    if i == shape[0]:
        i -= 1
    if j == shape[1]:
        j -= 1
    if k == shape[2]:
        k -= 1
    if i < 0 or j < 0 or k < 0 or i >= shape[0] or j >= shape[1] or k >= shape[2]:
        return OUTSIDE
    block = blocks[((i >> 3) * shape[4] + (j >> 3)) * shape[5] + (k >> 3)]
    if block < 0:
        return int(block)
    return int(block) * MANY + ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)


@njit(cache=True, nogil=True)
def what_is(x, y, z, index, hint, wait):
    """MATERIAL, AIR outside the body, or a move that swept the point (x, y, z); ``hint`` is tested first."""
    row = brick_of(x, y, z, index[0], index[1], index[2])
    if row == OUTSIDE:
        return AIR
    if row != UNTOUCHED:
        bricks = index[3]
        moves = index[6]
        of = index[7]
        cutters = index[8]
        by = int(-1 - bricks[row, 1] if row >= 0 else BY - row)
        if by >= 0:
            # hold on to the move that swept what is beside
            if hint >= 0 and hint != by and swept(moves[hint], cutters[of[hint]], x, y, z, wait):
                return hint
            return by
        if hint >= 0 and swept(moves[hint], cutters[of[hint]], x, y, z, wait):
            return hint
        kept = index[4]
        at = bricks[row, 0]
        for k in range(at + bricks[row, 1] - 1, at - 1, -1):
            e = int(kept[k])
            if e == hint:
                continue
            # most are far away
            x0, y0, w0, dx, dy, dw, bow = chord(moves[e], x, y, z)
            t = nearest_time(x0, y0, dx, dy)
            over = cutters[of[e]].wide + bow + EPS
            if (x0 + t * dx) ** 2 + (y0 + t * dy) ** 2 >= over * over or max(w0, w0 + dw) + bow <= -EPS:
                continue
            if swept(moves[e], cutters[of[e]], x, y, z, wait):
                return e
    return MATERIAL if solid(x, y, z, index) else AIR


@njit(cache=True, nogil=True)
def span(m, c, d, low, side, count):
    """First and last brick along the axis d that a move may reach."""
    a = m[d]
    b = m[d] + m[U + d]
    height = c.height
    theta = m[THETA]
    # the top goes along a curve, and the axis leans by no more than it turns
    slack = 0.125 * theta * theta * height + 1e-6
    cosine = math.cos(theta)
    sine = math.sin(theta)
    first = m[A0 + d]
    last = first * cosine + m[B + d] * sine
    lean = max(min(abs(first), abs(last)) - theta, 0.0)
    across = c.wide * math.sqrt(max(1.0 - lean * lean, 0.0)) + slack
    least_at = min(a + min(height * first, 0.0), b + min(height * last, 0.0)) - across
    most_at = max(a + max(height * first, 0.0), b + max(height * last, 0.0)) + across
    return max(0, math.floor((least_at - low) / side)), min(count - 1, math.floor((most_at - low) / side))


@njit(cache=True, nogil=True)
def append_move(q, row, bricks, kept, used):
    """Add a move to the list of a brick; False: no room."""
    at = bricks[row, 0]
    count = bricks[row, 1]
    if count > 0 and kept[at + count - 1] == q:
        return True
    if count == bricks[row, 2]:
        room = max(4, 2 * count)
        if used[0] + room > len(kept):
            return False
        to = used[0]
        for k in range(count):
            kept[to + k] = kept[at + k]
        bricks[row, 0] = to
        bricks[row, 2] = room
        used[0] += room
        at = to
    kept[at + count] = q
    bricks[row, 1] = count + 1
    return True


@njit(cache=True, nogil=True)
def enter(q, step, c, index, used, wait):
    """Enter the move q into the bricks that it may shape where it makes a ``step``, the last of it; False where lists
    (``used[0]``) or blocks (``used[1]``) have no room: then call again.
    """
    m = index[6][q]
    grid, shape, blocks, bricks, kept, alive = index[0], index[1], index[2], index[3], index[4], index[5]
    i0, i1 = span(step, c, np.int64(0), grid[0], grid[3], shape[0])
    j0, j1 = span(step, c, np.int64(1), grid[1], grid[4], shape[1])
    k0, k1 = span(step, c, np.int64(2), grid[2], grid[5], shape[2])
    r = 0.5 * math.sqrt(grid[3] * grid[3] + grid[4] * grid[4] + grid[5] * grid[5])
    far = SIDE * r
    if i0 > i1 or j0 > j1 or k0 > k1:
        return True
    for bi in range(i0 >> 3, (i1 >> 3) + 1):
        for bj in range(j0 >> 3, (j1 >> 3) + 1):
            for bk in range(k0 >> 3, (k1 >> 3) + 1):
                at = (bi * shape[4] + bj) * shape[5] + bk
                block = int(blocks[at])
                if block <= BY or (block >= 0 and alive[block] == 0):
                    continue
                x = grid[0] + SIDE * (bi + 0.5) * grid[3]
                y = grid[1] + SIDE * (bj + 0.5) * grid[4]
                z = grid[2] + SIDE * (bk + 0.5) * grid[5]
                covered = swept_share_of_ball(m, c, x, y, z, far, wait)
                if covered == 0:
                    continue
                if covered == 1:
                    blocks[at] = BY - q
                    continue
                a0, a1 = SIDE * bi, min(SIDE * bi + SIDE, shape[0])
                b0, b1 = SIDE * bj, min(SIDE * bj + SIDE, shape[1])
                c0, c1 = SIDE * bk, min(SIDE * bk + SIDE, shape[2])
                if block == UNTOUCHED:
                    if used[1] == len(alive):
                        return False
                    block = int(used[1])
                    used[1] += 1
                    blocks[at] = block
                    bricks[block * MANY : block * MANY + MANY] = 0
                    alive[block] = (a1 - a0) * (b1 - b0) * (c1 - c0)
                for i in range(max(a0, i0), min(a1, i1 + 1)):
                    x = grid[0] + (i + 0.5) * grid[3]
                    for j in range(max(b0, j0), min(b1, j1 + 1)):
                        y = grid[1] + (j + 0.5) * grid[4]
                        row = block * MANY + ((i & 7) << 6) + ((j & 7) << 3)
                        for k in range(max(c0, k0), min(c1, k1 + 1)):
                            if bricks[row + (k & 7), 1] < 0:
                                continue
                            z = grid[2] + (k + 0.5) * grid[5]
                            covered = swept_share_of_ball(m, c, x, y, z, r, wait)
                            if covered == 0:
                                continue
                            if covered == 1:
                                bricks[row + (k & 7), 1] = -1 - q
                                alive[block] -= 1
                            elif not append_move(q, row + (k & 7), bricks, kept, used):
                                return False
    return True


@njit(types.int64(_S2, _S1, _S1, types.int64), cache=True, nogil=True)
def pack_lists(bricks, kept, fresh, blocks):
    """Copy the lists close together into a new array, with half as much room again; the room that they take."""
    used = 0
    for row in range(blocks * MANY):
        at = bricks[row, 0]
        count = max(bricks[row, 1], 0)
        for k in range(count):
            fresh[used + k] = kept[at + k]
        bricks[row, 0] = used
        bricks[row, 2] = count
        used += count
    return used
