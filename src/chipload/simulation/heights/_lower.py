"""Compiled loop that lowers a height map by the steps of upright tools and finds what their shanks and holders meet.

Notation: a column (i, j) stands at (x, y) = (X + i HX, Y + j HY); ``top`` is the height of its material. d is the
distance of a column from the tool's axis in the plan, g(d) the height of the cutting part above its tip. A band
(radius, z) is a cylinder of the shank or of the holder that begins z above the tip. Columns lie in square tiles, of
which ``ceiling`` bounds the tops. Oracle: closed forms in tests/simulation/test_height_map.py.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.engagement.moves._uncounted_arrays import borrow_arrays

#: columns of ``found``: depth of a rapid, depth of a contact, its band, its place
RAPID_DEPTH, CONTACT, BAND, PLACE_X, PLACE_Y, PLACE_Z = range(6)
#: what a height may differ by rounding [mm]
EPS = 1e-7
#: places along a step at which a contact on a slope is examined, and thirds of the search for the lowest height; share
#: of the time beside an end at which the height rises from it: the lowest is within 2e-6 of the radius
PLACES, SEARCHES, BESIDE = 17, 16, 1e-3
#: a step that is shorter than this share of the radius is short
SHORT = 0.1
#: share by which rounding may lengthen a short step
ROUNDED = 1e-9

_F1, _F2, _F3 = "float64[::1]", "float64[:,::1]", "float64[:,:,::1]"


@njit(cache=True, nogil=True, inline="always")
def height(d2, radius, table):
    """Height g at the square of a distance, by a table (2, m).

    Its rows are over the distance, up to sqrt(1/2) of the radius, and over its square: neither a point nor an upright
    rim is coarse.
    """
    share = d2 / (radius * radius)
    if share < 0.5:
        row = 0
        at = math.sqrt(2.0 * share)
    else:
        row = 1
        at = min(2.0 * share - 1.0, 1.0)
    at *= table.shape[1] - 1
    k = min(int(at), table.shape[1] - 2)
    return table[row, k] + (at - k) * (table[row, k + 1] - table[row, k])


@njit(cache=True, nogil=True, inline="always")
def at_time(t, qx, qy, ux, uy, uz, radius, table):
    """Height of the tool's surface over a point at a time of a step, above the tip at its start."""
    dx = qx - t * ux
    dy = qy - t * uy
    return t * uz + height(dx * dx + dy * dy, radius, table)


@njit(cache=True, nogil=True)
def lowest(qx, qy, ux, uy, uz, radius, table, near, flat):
    """Least height of the tool's surface over a point during a step, above the tip at its start.

    (qx, qy): the point from the start; (ux, uy, uz): the motion; ``near``: time at which the axis is nearest to the
    point, which is then within ``radius`` of it.
    """
    h2 = ux * ux + uy * uy
    if h2 == 0.0:
        return min(uz, 0.0) + height(qx * qx + qy * qy, radius, table)
    if uz == 0.0:
        return at_time(near, qx, qy, ux, uy, uz, radius, table)
    # the times at which the point is under the tool
    along = qx * ux + qy * uy
    off2 = (qx * uy - qy * ux) ** 2 / h2
    span = math.sqrt(max(radius * radius - off2, 0.0) / h2)
    a = max(along / h2 - span, 0.0)
    b = min(along / h2 + span, 1.0)
    if flat:
        return (a if uz > 0.0 else b) * uz
    best = at_time(near, qx, qy, ux, uy, uz, radius, table)
    at_a = at_time(a, qx, qy, ux, uy, uz, radius, table) if a != near else best
    at_b = at_time(b, qx, qy, ux, uy, uz, radius, table) if b != near else best
    best = min(best, at_a, at_b)
    # convex in the time: a short step is known by its ends and its nearest place
    if h2 > (SHORT * radius) ** 2 * (1.0 + ROUNDED) and a < b:
        # lowest at an end from which it rises: most columns are before or behind the tool
        beside = BESIDE * (b - a)
        if at_time(a + beside, qx, qy, ux, uy, uz, radius, table) >= at_a:
            return best
        if at_time(b - beside, qx, qy, ux, uy, uz, radius, table) >= at_b:
            return best
        for _ in range(SEARCHES):
            t0 = a + (b - a) / 3.0
            t1 = b - (b - a) / 3.0
            v0 = at_time(t0, qx, qy, ux, uy, uz, radius, table)
            v1 = at_time(t1, qx, qy, ux, uy, uz, radius, table)
            best = min(best, v0, v1)
            if v0 < v1:
                b = t1
            else:
                a = t0
    return best


@njit("float64(float64, float64, float64, float64[::1], float64, float64)", cache=True, nogil=True)
def depth_in(qx, qy, over, u, radius, z):
    """Depth to which a column stands in a band during a step: the least distance to its side and its bottom.

    ``over``: top of the column above the tip at the start of the step.
    """
    deepest = 0.0
    count = 2 if u[2] == 0.0 and u[0] == 0.0 and u[1] == 0.0 else PLACES
    h2 = u[0] * u[0] + u[1] * u[1]
    near = min(max((qx * u[0] + qy * u[1]) / h2, 0.0), 1.0) if h2 > 0.0 else 0.0
    for k in range(count + 1):
        t = near if k == count else k / (count - 1)
        d = math.hypot(qx - t * u[0], qy - t * u[1])
        deepest = max(deepest, min(radius - d, over - t * u[2] - z))
    return deepest


@njit(
    f"void(int64, {_F2}, {_F2}, int64[::1], boolean[::1], {_F2}, {_F3}, {_F3}, {_F1}, {_F2}, {_F2}, {_F2}, int64,"
    f" int64[:,::1], int64[:,::1], float64, {_F2})",
    cache=True,
    nogil=True,
)
def lower(first, p0, p1, tool, rapid, cutters, tables, bands, grid, top, low, ceiling, tile, gone, last, film, found):
    """Lower ``top`` by steps, one after the other, and write what each meets into ``found`` (n, 6).

    Parameters
    ----------
    first : number of the first step
    p0, p1 : (n, 3) tip at both ends [mm]; tool, rapid : (n,) row of the cutter, whether the step is a rapid
    cutters : (k, 3) radius, height up to which it cuts, whether it is flat; tables : (k, 2, m) see :func:`height`
    bands : (k, b, 2) radius and height above the tip of each cylinder of shank and holder; radius 0: none
    grid : (5,) X, Y, HX, HY, greatest height of the stock
    top, low : (nx, ny) heights of the material; low is above top where there is none
    ceiling : (tx, ty) of tiles of ``tile`` columns
    gone, last : (nx, ny) step that cut a column through, and that cut it last
    film : what is less deep is none [mm]
    """
    # the caller keeps all of them
    p0, p1, cutters, tables, bands, grid = borrow_arrays((p0, p1, cutters, tables, bands, grid))
    top, low, ceiling, found = borrow_arrays((top, low, ceiling, found))
    nx, ny = top.shape
    wx = grid[2] * tile
    wy = grid[3] * tile
    half = 0.5 * math.hypot(wx, wy)
    for s in range(len(tool)):
        k = tool[s]
        radius = cutters[k, 0]
        flat = cutters[k, 2] > 0.0
        table = borrow_arrays(tables[k])
        ux = p1[s, 0] - p0[s, 0]
        uy = p1[s, 1] - p0[s, 1]
        uz = p1[s, 2] - p0[s, 2]
        bottom = p0[s, 2] + min(uz, 0.0)
        upper = p0[s, 2] + max(uz, 0.0)
        if bottom >= grid[4]:
            continue
        reach = radius
        for b in range(bands.shape[1]):
            if bands[k, b, 0] > 0.0 and bottom + bands[k, b, 1] < grid[4]:
                reach = max(reach, bands[k, b, 0])
        # beyond it there is nothing of the tool, whatever is rounded
        far2 = reach * reach * (1.0 + 1e-12)
        h2 = ux * ux + uy * uy
        i0 = max(math.floor((p0[s, 0] + min(ux, 0.0) - reach - grid[0]) / wx), 0)
        i1 = min(math.floor((p0[s, 0] + max(ux, 0.0) + reach - grid[0]) / wx), ceiling.shape[0] - 1)
        j0 = max(math.floor((p0[s, 1] + min(uy, 0.0) - reach - grid[1]) / wy), 0)
        j1 = min(math.floor((p0[s, 1] + max(uy, 0.0) + reach - grid[1]) / wy), ceiling.shape[1] - 1)
        for ti in range(i0, i1 + 1):
            for tj in range(j0, j1 + 1):
                highest = ceiling[ti, tj]
                if highest <= bottom:
                    continue
                qx = grid[0] + (ti + 0.5) * wx - 0.5 * grid[2] - p0[s, 0]
                qy = grid[1] + (tj + 0.5) * wy - 0.5 * grid[3] - p0[s, 1]
                t = min(max((qx * ux + qy * uy) / h2, 0.0), 1.0) if h2 > 0.0 else 0.0
                away = math.hypot(qx - t * ux, qy - t * uy) - half
                # the surface rises with the distance from the axis
                near = away <= radius and (
                    flat or highest > bottom + height(max(away, 0.0) * max(away, 0.0), radius, table)
                )
                for b in range(bands.shape[1]):
                    if away <= bands[k, b, 0] and bottom + bands[k, b, 1] < highest:
                        near = True
                if not near:
                    continue
                rest = -math.inf
                for i in range(ti * tile, min((ti + 1) * tile, nx)):
                    for j in range(tj * tile, min((tj + 1) * tile, ny)):
                        c = top[i, j]
                        if c <= bottom:
                            rest = max(rest, c)
                            continue
                        qx = grid[0] + i * grid[2] - p0[s, 0]
                        qy = grid[1] + j * grid[3] - p0[s, 1]
                        t = min(max((qx * ux + qy * uy) / h2, 0.0), 1.0) if h2 > 0.0 else 0.0
                        d2 = (qx - t * ux) ** 2 + (qy - t * uy) ** 2
                        if d2 > far2:
                            rest = max(rest, c)
                            continue
                        d = math.sqrt(d2)
                        # what stands above the flutes stays
                        inside = d <= radius and c <= upper + cutters[k, 1] + EPS
                        if inside and not flat and c <= bottom + height(d * d, radius, table):
                            inside = False
                        if inside:
                            z = p0[s, 2] + lowest(qx, qy, ux, uy, uz, radius, table, t, flat)
                            if z < c:
                                top[i, j] = z
                                # a film that chords left beside the way is narrow, however high
                                beside = abs(qx * uy - qy * ux) / math.sqrt(h2) if h2 > 0.0 else d
                                if c - z > film and radius - beside > film:
                                    last[i, j] = first + s
                                    if rapid[s] and c - z > found[s, RAPID_DEPTH]:
                                        found[s, RAPID_DEPTH] = c - z
                                c = z
                                if z <= low[i, j] + film:
                                    gone[i, j] = first + s
                                    top[i, j] = -math.inf
                                    continue
                        for b in range(bands.shape[1]):
                            r = bands[k, b, 0]
                            if d < r and c > bottom + bands[k, b, 1] + film:
                                depth = depth_in(qx, qy, c - p0[s, 2], p1[s] - p0[s], r, bands[k, b, 1])
                                if depth > film and depth > found[s, CONTACT]:
                                    found[s, CONTACT] = depth
                                    found[s, BAND] = b
                                    found[s, PLACE_X] = grid[0] + i * grid[2]
                                    found[s, PLACE_Y] = grid[1] + j * grid[3]
                                    found[s, PLACE_Z] = c
                        rest = max(rest, c)
                ceiling[ti, tj] = rest


@njit("void(int64[:,::1], float64[:,::1], int64, int64, float64[:,::1])", cache=True, nogil=True)
def attached_until(gone, low, i0, j0, until):
    """Step up to which each column is joined to the column (i0, j0) by its neighbours, into ``until``.

    A column is there before the step ``gone``; ``low`` is inf where the stock has none. The widest path: the greatest,
    over all ways from neighbour to neighbour, of the least step at which a column of the way is cut through.
    """
    nx, ny = gone.shape
    room = 1024
    key = np.empty(room)
    at = np.empty(room, dtype=np.int64)
    count = 1
    key[0] = math.inf
    at[0] = i0 * ny + j0
    until[i0, j0] = math.inf
    while count > 0:
        # greatest first, a heap
        best = key[0]
        cell = at[0]
        count -= 1
        k = 0
        moving = key[count]
        place = at[count]
        while 2 * k + 1 < count:
            child = 2 * k + 1
            if child + 1 < count and key[child + 1] > key[child]:
                child += 1
            if key[child] <= moving:
                break
            key[k] = key[child]
            at[k] = at[child]
            k = child
        key[k] = moving
        at[k] = place
        i = cell // ny
        j = cell % ny
        if best < until[i, j]:
            continue
        through = min(best, float(gone[i, j]))
        for n in range(4):
            a = i + (n == 0) - (n == 1)
            b = j + (n == 2) - (n == 3)
            if a < 0 or b < 0 or a >= nx or b >= ny or low[a, b] == math.inf or through <= until[a, b]:
                continue
            until[a, b] = through
            if count == room:
                bigger = np.empty(2 * room)
                bigger[:room] = key
                key = bigger
                more = np.empty(2 * room, dtype=np.int64)
                more[:room] = at
                at = more
                room *= 2
            k = count
            count += 1
            while k > 0 and key[(k - 1) // 2] < through:
                key[k] = key[(k - 1) // 2]
                at[k] = at[(k - 1) // 2]
                k = (k - 1) // 2
            key[k] = through
            at[k] = a * ny + b
