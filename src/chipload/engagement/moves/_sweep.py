"""Compiled loops of swept volumes and of the index of moves; arrays and scalars only.

Notation: a move is a row (x, y, z, ux, uy, uz) of the tip at its start and of what it goes [mm], in the index followed
by 1 / (ux^2 + uy^2) and 1 / (ux^2 + uy^2 + uz^2), 0 where it does not go; a cutter is a record of
:mod:`chipload.cutter.record`; g(rho) [mm] is the height of the cutter's surface above its tip at
the distance rho from its axis. The axis stands along z. With d(t) the distance of a point (x, y, z) from the axis and
w(t) its height above the tip at the time t, the point was swept if F(t) = g(d(t)) - w(t) is below 0 somewhere in 0..1;
g rises and is convex, so that F is convex. A cell of the index is a square of the plan: above ``ceil`` is air, from
``base`` to ``floor`` is material, between them the moves kept in the cell and the initial stock decide.
Oracles: minimum of F over many t, height field, in tests/engagement/moves.
"""

from __future__ import annotations

import math

import numpy as np
from numba import from_dtype, njit

from chipload.cutter.record import BALL, CUTTER, FLAT

#: tolerance within which a point counts as swept [mm]: a second pass along the same path removes nothing
EPS = 1e-8
#: type of a cutter, and of an array of them
ONE_CUTTER = from_dtype(CUTTER)
CUTTERS = ONE_CUTTER[::1]
#: results for a point that no move swept: in material, in air
MATERIAL, AIR = -2, -1
#: a list is thinned when it is longer by this than twice its length after it was last thinned
SLACK = 8
#: steps of a height in which the reach of moves is stored, 2 bytes; tolerance of a height in steps
HEIGHTS, ROUNDED = 65535, 1e-2

_F2, _I2 = "float64[:,::1]", "int64[:,::1]"


@njit(cache=True, nogil=True)
def profile(c, rho):
    """g(rho): height of the cutter's surface above its tip; infinite beyond its greatest radius."""
    for i in range(c.count):
        if rho <= c.rho_to[i]:
            if c.line[i] > 0:
                return c.z[i] + (rho - c.rho[i]) * c.rise[i]
            gap = c.radius[i] * c.radius[i] - (rho - c.e[i]) ** 2
            return c.f[i] - (math.sqrt(gap) if gap > 0.0 else 0.0)
    return math.inf


@njit(cache=True, nogil=True)
def slope(c, rho):
    """g'(rho); infinite where the surface is upright."""
    for i in range(c.count):
        if c.line[i] > 0:
            if rho <= c.rho_to[i]:
                return c.rise[i]
        elif rho < c.rho_to[i]:
            gap = c.radius[i] * c.radius[i] - (rho - c.e[i]) ** 2
            return (rho - c.e[i]) / math.sqrt(gap) if gap > 0.0 else math.inf
    return math.inf


@njit(cache=True, nogil=True)
def times_within(qx, qy, ux, uy, h2, along, radius):
    """Times first, last in 0..1 between which the axis is nearer to a point than ``radius``; none: first > last.

    (qx, qy) the point from the start of the move, (ux, uy) the motion, h2 its square, along their product [mm, mm^2].
    """
    c = qx * qx + qy * qy - radius * radius
    if h2 == 0.0:
        return (0.0, 1.0) if c < 0.0 else (1.0, 0.0)
    disc = along * along - h2 * c
    if disc <= 0.0:
        return 1.0, 0.0
    root = math.sqrt(disc)
    return max((along - root) / h2, 0.0), min((along + root) / h2, 1.0)


@njit(cache=True, nogil=True)
def clamped_quotient(a, b):
    """Quotient a / b within 0..1; 0 if a is not above 0."""
    if a <= 0.0:
        return 0.0
    return a / b if a < b else 1.0


@njit(cache=True, nogil=True)
def from_ball(m, r, x, y, z):
    """Square of the distance [mm^2] of a point from the nearest centre of a ball of radius r on a move m (6,), or from
    the axis above it: the point was swept if this is below r^2.

    The square is convex in the time and smooth, so that its least value is where the point is below the nearest centre,
    if it is, and else where the axis is nearest.
    """
    qx = x - m[0]
    qy = y - m[1]
    w = z - m[2] - r
    ux = m[3]
    uy = m[4]
    uz = m[5]
    h2 = ux * ux + uy * uy
    along = qx * ux + qy * uy
    t = clamped_quotient(along + w * uz, h2 + uz * uz)
    dz = w - t * uz
    if dz > 0.0:
        t = clamped_quotient(along, h2)
        dz = 0.0
    dx = qx - t * ux
    dy = qy - t * uy
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, nogil=True, inline="always")
def off_ball(moves, e, r, x, y, z):
    """:func:`from_ball` of move e of the index (8 columns), without a division and with one branch."""
    qx = x - moves[e, 0]
    qy = y - moves[e, 1]
    w = z - moves[e, 2] - r
    ux = moves[e, 3]
    uy = moves[e, 4]
    uz = moves[e, 5]
    along = qx * ux + qy * uy
    t = (along + w * uz) * moves[e, 7]
    t = 0.0 if t < 0.0 else (1.0 if t > 1.0 else t)
    dz = w - t * uz
    if dz > 0.0:
        t = along * moves[e, 6]
        t = 0.0 if t < 0.0 else (1.0 if t > 1.0 else t)
        dz = 0.0
    dx = qx - t * ux
    dy = qy - t * uy
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, nogil=True)
def radius_at(c, w):
    """Greatest distance of the cutter from its axis at the height w above its tip; below 0 where there is none."""
    if w <= 0.0:
        return -1.0
    for i in range(c.count):
        if w < c.z_to[i]:
            if c.line[i] > 0:
                return c.rho[i] + (w - c.z[i]) * c.run[i]
            return c.e[i] + math.sqrt(max(c.radius[i] ** 2 - (c.f[i] - w) ** 2, 0.0))
    return c.wide


@njit(cache=True, nogil=True)
def section(m, c, z):
    """Disc that sweeps the section of a move at the height z [mm]: first and last time in 0..1, square of its radius
    [mm^2] (below 0: nothing is swept), and whether there is one: not for balls, nor for a corner or taper on a ramp.
    """
    uz = m[5]
    w = z - m[2] + EPS
    level = uz == 0.0 or (m[3] == 0.0 and m[4] == 0.0)
    if c.kind == BALL or not (level or c.kind == FLAT):
        return 0.0, 1.0, -1.0, False
    if level:
        r = radius_at(c, w - min(uz, 0.0))
        return 0.0, 1.0, (r + EPS) ** 2 if r >= 0.0 else -1.0, True
    first = 0.0
    last = 1.0
    if uz > 0.0:
        if w <= 0.0:
            return 0.0, 1.0, -1.0, True
        last = min(w / uz, 1.0)
    else:
        if w <= uz:
            return 0.0, 1.0, -1.0, True
        first = max(w / uz, 0.0)
    return first, last, (c.wide + EPS) ** 2, True


@njit(cache=True, nogil=True)
def from_track(m, first, last, x, y):
    """Square of the least distance [mm^2], in the plan, of a point (x, y) from the axis at the times first..last."""
    qx = x - m[0]
    qy = y - m[1]
    t = min(max(clamped_quotient(qx * m[3] + qy * m[4], m[3] * m[3] + m[4] * m[4]), first), last)
    dx = qx - t * m[3]
    dy = qy - t * m[4]
    return dx * dx + dy * dy


@njit(cache=True, nogil=True)
def swept(m, c, x, y, z):
    """Whether the point (x, y, z) is in the volume that a move m (6,) of a cutter c sweeps."""
    if c.kind == BALL:
        return from_ball(m, c.radius[0], x, y, z) < (c.radius[0] + EPS) ** 2
    first, last, far2, disc = section(m, c, z)
    if disc:
        return far2 >= 0.0 and from_track(m, first, last, x, y) < far2
    qx = x - m[0]
    qy = y - m[1]
    w = z - m[2]
    ux = m[3]
    uy = m[4]
    uz = m[5]
    h2 = ux * ux + uy * uy
    along = qx * ux + qy * uy
    first, last = times_within(qx, qy, ux, uy, h2, along, c.wide + EPS)
    if first > last:
        return False
    return falls_below_zero(c, qx, qy, w + EPS, ux, uy, uz, h2, along, first, last)


@njit(cache=True, nogil=True)
def falls_below_zero(c, qx, qy, w, ux, uy, uz, h2, along, first, last):
    """Whether the convex F is below 0 at a time first..last: tangents at both ends bound it from below.

    w is the height of the point over the tip at the start; the other arguments are those of :func:`times_within`.
    """
    value = np.empty(2)
    rate = np.empty(2)
    ends = (first, last)
    for i in range(2):
        t = ends[i]
        rho = min(max(math.hypot(qx - t * ux, qy - t * uy) - EPS, 0.0), c.wide)
        value[i] = profile(c, rho) - w + t * uz
        if value[i] < 0.0:
            return True
        turn = (t * h2 - along) / rho if rho > EPS else 0.0
        rate[i] = uz if turn == 0.0 else slope(c, rho) * turn + uz
    if rate[0] >= 0.0 or rate[1] <= 0.0:
        return False
    for n in range(80):
        t = 0.5 * (first + last)
        fall = rate[1] - rate[0]
        if fall < math.inf and n % 3 < 2:
            t = (value[0] - value[1] + rate[1] * last - rate[0] * first) / fall
            if value[0] + rate[0] * (t - first) >= 0.0:
                return False
            if not first < t < last:
                t = 0.5 * (first + last)
        if not first < t < last:
            return False
        rho = min(max(math.hypot(qx - t * ux, qy - t * uy) - EPS, 0.0), c.wide)
        v = profile(c, rho) - w + t * uz
        if v < 0.0:
            return True
        turn = (t * h2 - along) / rho if rho > EPS else 0.0
        r = uz if turn == 0.0 else slope(c, rho) * turn + uz
        if r == 0.0:
            return False
        if r < 0.0:
            first = t
            value[0] = v
            rate[0] = r
        else:
            last = t
            value[1] = v
            rate[1] = r
    return False


@njit(cache=True, nogil=True)
def in_solid(x, y, z, low, high, first, ids, faces, cell):
    """Whether a point is in the initial stock: within the block, or by the faces of the mesh that a ray along +z meets:
    it leaves bodies more often than it enters them. Bodies that overlap are joined.

    low, high : (3,) corners of the block [mm]; faces (f, 12) corners and normal; those of a cell are the rows
    ids[first[cell]] .. ids[first[cell + 1] - 1].
    """
    if len(faces) == 0:
        return low[0] <= x <= high[0] and low[1] <= y <= high[1] and low[2] <= z < high[2]
    left = 0
    for k in range(first[cell], first[cell + 1]):
        f = faces[ids[k]]
        over = False
        for i in range(3):
            a = 3 * i
            b = 3 * ((i + 1) % 3)
            if (f[a + 1] > y) != (f[b + 1] > y):
                # the same edge in the same order in both of its faces
                if f[a + 1] > f[b + 1]:
                    a, b = b, a
                if f[a] + (y - f[a + 1]) / (f[b + 1] - f[a + 1]) * (f[b] - f[a]) > x:
                    over = not over
        if over and f[2] - (f[9] * (x - f[0]) + f[10] * (y - f[1])) / f[11] > z:
            left += 1 if f[11] > 0.0 else -1
    return left > 0


@njit(cache=True, nogil=True)
def place(x, y, grid, shape):
    """Number of the cell of a point (x, y); -1: outside the index."""
    i = math.floor((x - grid[0]) / grid[2])
    j = math.floor((y - grid[1]) / grid[3])
    # a point on the far border is in the last cell
    if i == shape[0] and x <= grid[0] + grid[2] * shape[0]:
        i -= 1
    if j == shape[1] and y <= grid[1] + grid[3] * shape[1]:
        j -= 1
    if i < 0 or j < 0 or i >= shape[0] or j >= shape[1]:
        return -1
    return i * shape[1] + j


@njit(cache=True, nogil=True, inline="always")
def swept_by(e, x, y, z, index):
    """Whether the point (x, y, z) is in the volume that move e of the index swept."""
    moves = index[6]
    of = index[7]
    cutters = index[8]
    k = of[e]
    if cutters[k].kind == BALL:
        r = cutters[k].radius[0]
        return off_ball(moves, e, r, x, y, z) < (r + EPS) * (r + EPS)
    return swept(moves[e], cutters[k], x, y, z)


@njit(cache=True, nogil=True, inline="always")
def grid_height_above(z, grid):
    """Height z in steps of the grid, rounded so that it is above the stored reach of every move that comes below z.

    Moves that come below the initial body have the reach 0, and are below every height.
    """
    return max((z - grid[4] + EPS) * grid[5], 0.0) + ROUNDED


@njit(cache=True, nogil=True, inline="always")
def what_is(x, y, z, index, hint):
    """MATERIAL, AIR, or the number of a move that swept the point (x, y, z); move ``hint`` is tested first.

    ``index`` is a tuple: grid (6,) corner and sides of the cells in the plan [mm], height from which the reach counts
    [mm], steps per mm; shape (2,) number of cells; level (cells, 3) floor, ceil, base [mm]; list_at (cells, 4) begin,
    length and room of a cell's list, its length when last thinned; kept, reach (k,) moves of the lists, their least
    heights in steps; moves (m, 8), cutter of each, cutters; low, high, first, ids, faces: :func:`in_solid`.
    """
    grid = index[0]
    level = index[2]
    cell = place(x, y, grid, index[1])
    if cell < 0 or z >= level[cell, 1] - EPS:
        return AIR
    if level[cell, 2] <= z < level[cell, 0] - EPS:
        return MATERIAL
    if hint >= 0 and swept_by(hint, x, y, z, index):
        return hint
    kept = index[4]
    reach = index[5]
    lists = index[3]
    at = lists[cell, 0]
    high = grid_height_above(z, grid)
    for k in range(at + lists[cell, 1] - 1, at - 1, -1):
        if reach[k] < high:
            e = kept[k]
            if e != hint and swept_by(e, x, y, z, index):
                return e
    return MATERIAL if in_solid(x, y, z, index[9], index[10], index[11], index[12], index[13], cell) else AIR


@njit(cache=True, nogil=True, inline="always")
def cells_near(m, qx, far, first, last, grid):
    """The first and the last cell of a row of cells along y to which a move comes near; none: the first is greater.

    qx is x of the row's middle less that of the start of the move m (6,), far the greatest distance from the axis of
    the middle of a cell that the move may shape [mm]; the whole move comes near the cells first..last.
    """
    ux = m[3]
    uy = m[4]
    aside = max(min(ux, 0.0) - qx, qx - max(ux, 0.0), 0.0)
    if aside >= far:
        return 0, -1
    room = math.sqrt(far * far - aside * aside)
    a = max(first, math.floor((m[1] + min(uy, 0.0) - room - grid[1]) / grid[3]))
    b = min(last, math.floor((m[1] + max(uy, 0.0) + room - grid[1]) / grid[3]))
    if ux != 0.0:
        # the part of the move near this row of cells
        t0 = (qx - far) / ux
        t1 = (qx + far) / ux
        if t0 > t1:
            t0, t1 = t1, t0
        t0 = min(max(t0, 0.0), 1.0)
        t1 = min(max(t1, 0.0), 1.0)
        y0 = m[1] + min(t0 * uy, t1 * uy) - room
        y1 = m[1] + max(t0 * uy, t1 * uy) + room
        a = max(a, math.floor((y0 - grid[1]) / grid[3]))
        b = min(b, math.floor((y1 - grid[1]) / grid[3]))
    return a, b


@njit(cache=True, nogil=True)
def keep(q, m, c, grid, shape, level, list_at, kept, reach, used):
    """Enter a move into the lists of the cells that it may shape; False where ``kept`` has no room: then call again.

    Parameters
    ----------
    q : number of the move
    m : (8,) of the move; c : its cutter
    grid, shape, level, list_at, kept, reach : of the index, see :func:`what_is`
    used : (1,) room taken of ``kept`` and ``reach``
    """
    gx = grid[2]
    gy = grid[3]
    half = 0.5 * math.hypot(gx, gy)
    ux = m[3]
    uy = m[4]
    uz = m[5]
    h2 = ux * ux + uy * uy
    length = math.sqrt(h2)
    wide = c.wide
    far = wide + half
    lowest = m[2] + min(uz, 0.0)
    j0 = max(0, math.floor((m[1] + min(uy, 0.0) - wide - grid[1]) / gy))
    j1 = min(shape[1] - 1, math.floor((m[1] + max(uy, 0.0) + wide - grid[1]) / gy))
    i0 = max(0, math.floor((m[0] + min(ux, 0.0) - wide - grid[0]) / gx))
    i1 = min(shape[0] - 1, math.floor((m[0] + max(ux, 0.0) + wide - grid[0]) / gx))
    spread = far / length if length > 0.0 else 1.0
    for i in range(i0, i1 + 1):
        qx = grid[0] + (i + 0.5) * gx - m[0]
        a, b = cells_near(m, qx, far, j0, j1, grid)
        for j in range(a, b + 1):
            cell = i * shape[1] + j
            if level[cell, 1] <= lowest:
                continue
            qy = grid[1] + (j + 0.5) * gy - m[1]
            t = (qx * ux + qy * uy) / h2 if h2 > 0.0 else (0.0 if uz > 0.0 else 1.0)
            t = min(max(t, 0.0), 1.0)
            d2 = (qx - t * ux) ** 2 + (qy - t * uy) ** 2
            if d2 >= far * far:
                continue
            d = math.sqrt(d2)
            bottom = m[2] + t * uz
            least = lowest
            if uz != 0.0 and h2 > 0.0:
                s = max(t - spread, 0.0) if uz > 0.0 else min(t + spread, 1.0)
                least = m[2] + s * uz
            least += profile(c, max(d - half, 0.0))
            if least >= level[cell, 1]:
                continue
            if least < level[cell, 0]:
                level[cell, 0] = least
            most = bottom + profile(c, d + half)
            if most < level[cell, 1]:
                level[cell, 1] = most
                if level[cell, 0] >= most:
                    # level floor: nothing in the cell reaches below it
                    list_at[cell, 1] = 0
                    list_at[cell, 3] = 0
                if least >= most:
                    continue
            at = list_at[cell, 0]
            count = list_at[cell, 1]
            if count > 0 and kept[at + count - 1] == q:
                continue
            if count == list_at[cell, 2] or count >= 2 * list_at[cell, 3] + SLACK:
                count = thin_list(at, count, grid_height_above(level[cell, 1], grid), kept, reach)
                list_at[cell, 1] = count
                list_at[cell, 3] = count
            if count == list_at[cell, 2]:
                size = count + max(count // 2, 4)
                if used[0] + size > len(kept):
                    return False
                to = used[0]
                for k in range(count):
                    kept[to + k] = kept[at + k]
                    reach[to + k] = reach[at + k]
                used[0] += size
                list_at[cell, 0] = to
                list_at[cell, 2] = size
                at = to
            kept[at + count] = q
            # rounded down
            reach[at + count] = np.uint16(min(max(math.floor((least - grid[4]) * grid[5]), 0), HEIGHTS))
            list_at[cell, 1] = count + 1
    return True


@njit(cache=True, nogil=True)
def thin_list(at, count, ceil, kept, reach):
    """Drop the moves of the list at ``at`` that do not come below ``ceil``, in steps; how many of ``count`` stay."""
    to = at
    for k in range(at, at + count):
        if reach[k] < ceil:
            kept[to] = kept[k]
            reach[to] = reach[k]
            to += 1
    return to - at


@njit(f"int64(int64[::1], float64[::1], {_I2}, int32[::1], uint16[::1], {_F2})", cache=True, nogil=True)
def pack_lists(order, grid, list_at, kept, reach, level):
    """Close the gaps between the lists in their own arrays; return the room that they take.

    ``order``: the cells in the order of their lists, so that no list overwrites a later one.
    """
    used = 0
    for cell in order:
        at = list_at[cell, 0]
        count = thin_list(at, list_at[cell, 1], grid_height_above(level[cell, 1], grid), kept, reach)
        for k in range(count):
            kept[used + k] = kept[at + k]
            reach[used + k] = reach[at + k]
        list_at[cell, 0] = used
        list_at[cell, 1] = count
        list_at[cell, 2] = count
        list_at[cell, 3] = count
        used += count
    return used
