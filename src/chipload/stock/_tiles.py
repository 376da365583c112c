"""Compiled loops over the tiles of a layered stock: removal of areas, pieces of the removed area, edges, points.

Notation: rings and areas as in :mod:`chipload.stock._clip`. ``slots`` (n, 3) the first ring, the number of
rings and the number of points of each area; ``boxes`` (n, 4) its least x and y and greatest x and y. ``slot_of``
(layers, rows, columns) the slot of each tile's area: NONE where it is not read yet, 0 the empty area. Areas never
change: a tile that loses material is given another area, so that layers that are cut alike share areas. ``used`` the
numbers of points, rings and slots in use. An **entry** is a layer and the area that a step removes from it; an
**operation** is an entry and a tile under it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from chipload.stock._clip import CUT, clip, ring_size
from chipload.stock._crossings import FULL

NONE = -1
#: result of :func:`list_operations` other than the number and FULL: a tile was not read
MISSING = -3
#: columns of an operation: entry, layer, row, column, slot before and after, first ring of the chip and the one after
#: the last, and the earlier operation with the same result, or itself
ENTRY, LAYER, J, I, OLD, NEW, CHIP_0, CHIP_1, AS = range(9)
#: an end of an edge within this distance of a border is on it [mm]
ON_BORDER = 1e-9
#: greatest displacement of an edge by simplification, as a share of the width of a film
SIMPLER = 0.125
#: columns of the result of an entry: removed area, number of pieces that are not films, their least and total area
AREA, PIECES, LEAST, WHOLE = range(4)


@njit(
    "int64(int64[::1], int64[::1], float64[:,::1], float64[::1], float64[::1], int64[:,:,::1], float64[:,::1],"
    " int64[:,::1])",
    cache=True,
    nogil=True,
)
def list_operations(layers, shapes, shape_boxes, xs, ys, slot_of, boxes, ops):
    """Write the operations of the entries (layer, shape) to ``ops``; their number, FULL or MISSING."""
    n = 0
    for e in range(len(layers)):
        x0, y0, x1, y1 = shape_boxes[shapes[e]]
        if not (x1 > x0 and y1 > y0):
            continue
        i0, i1 = max(np.searchsorted(xs, x0, "right") - 1, 0), min(np.searchsorted(xs, x1, "left"), len(xs) - 1)
        j0, j1 = max(np.searchsorted(ys, y0, "right") - 1, 0), min(np.searchsorted(ys, y1, "left"), len(ys) - 1)
        for j in range(j0, j1):
            for i in range(i0, i1):
                slot = slot_of[layers[e], j, i]
                if slot == NONE:
                    return MISSING
                if slot == 0 or not (
                    boxes[slot, 0] < x1 and boxes[slot, 2] > x0 and boxes[slot, 1] < y1 and boxes[slot, 3] > y0
                ):
                    continue
                if n == len(ops):
                    return FULL
                ops[n, ENTRY], ops[n, LAYER], ops[n, J], ops[n, I] = e, layers[e], j, i
                n += 1
    return n


@njit(
    "int64(float64[:,::1], int64[:,::1], int64[:,::1], float64[:,::1], int64[::1], int64[::1])", cache=True, nogil=True
)
def add_slot(P, rings, slots, boxes, used, own):
    """Add the rings from ``used`` up to ``own`` (points, rings) as a new slot; its number, 0 if there are none."""
    if own[1] == used[1]:
        return 0
    slot = used[2]
    slots[slot, 0], slots[slot, 1], slots[slot, 2] = used[1], own[1] - used[1], own[0] - used[0]
    boxes[slot, 0] = boxes[slot, 1] = math.inf
    boxes[slot, 2] = boxes[slot, 3] = -math.inf
    for k in range(used[0], own[0]):
        for axis in range(2):
            boxes[slot, axis] = min(boxes[slot, axis], P[k, axis])
            boxes[slot, 2 + axis] = max(boxes[slot, 2 + axis], P[k, axis])
    used[0], used[1] = own[0], own[1]
    used[2] += 1
    return slot


@njit(
    "int64(int64, int64, int64[::1], int64[::1], float64[:,::1], int64[:,::1], int64[:,::1], float64[:,::1],"
    " float64[:,::1], int64[:,::1], int64[:,::1], float64[:,::1], int64[:,:,::1], int64[::1], float64[:,::1],"
    " int64[:,::1], int64[::1], int64[:,::1], float64[:,::1], int64[:,::1])",
    cache=True,
    nogil=True,
)
def cut_tiles(begin, count, layers, shapes, Q, C, first, shape_boxes, P, rings, slots, boxes, slot_of, used, chip,
              chip_rings, chip_used, ops, X, cross):  # fmt: skip
    """Carry out the operations from ``begin`` on; the number of the first that is not done, ``count`` if all are.

    ``used[3]`` receives the reason for an early end: DEGENERATE or FULL.
    """
    areas = np.empty(3)
    own = np.empty(2, dtype=np.int64)
    # range of the operations of the previous entry, one of which may have the same result
    before, next_entry = 0, 0
    for k in range(begin, count):
        e, layer, j, i = ops[k, ENTRY], ops[k, LAYER], ops[k, J], ops[k, I]
        while ops[next_entry, ENTRY] < e:
            before, previous = next_entry, ops[next_entry, ENTRY]
            while ops[next_entry, ENTRY] == previous:
                next_entry += 1
        slot, shape = slot_of[layer, j, i], shapes[e]
        ops[k, OLD] = slot
        same = -1
        for b in range(before, next_entry):
            if ops[b, OLD] == slot and shapes[ops[b, ENTRY]] == shape:
                same = b
        if same >= 0:
            for c in (NEW, CHIP_0, CHIP_1, AS):
                ops[k, c] = ops[same, c]
            slot_of[layer, j, i] = ops[k, NEW]
            continue
        ops[k, AS], ops[k, NEW], ops[k, CHIP_0], ops[k, CHIP_1] = k, slot, chip_used[1], chip_used[1]
        if used[2] == len(slots):
            used[3] = FULL
            return k
        own[0], own[1] = used[0], used[1]
        a0 = slots[slot, 0]
        status = clip(P, rings, a0, a0 + slots[slot, 1], Q, C, first[shape, 0], first[shape, 1], shape_boxes[shape],
                      P, rings, own, chip, chip_rings, chip_used, X, cross, areas)  # fmt: skip
        if status < 0:
            used[3] = status
            return k
        if status == CUT:
            ops[k, CHIP_1] = chip_used[1]
            ops[k, NEW] = add_slot(P, rings, slots, boxes, used, own)
            slot_of[layer, j, i] = ops[k, NEW]
    return count


@njit("int64(int64[::1], int64)", cache=True, nogil=True)
def root(parent, a):
    """Representative of the pieces with which piece a is joined."""
    while parent[a] != a:
        a = parent[a]
    return a


@njit("boolean(float64[:,::1], int64[:,::1], int64, int64, float64, float64)", cache=True, nogil=True)
def contains(points, rings, first, last, x, y):
    """Whether the area of the rings ``first``..``last`` - 1 contains the point (x, y)."""
    odd = False
    for r in range(first, last):
        start, count = rings[r, 0], rings[r, 1]
        k = start + count - 1
        for n in range(start, start + count):
            ux, uy, vx, vy = points[k, 0], points[k, 1], points[n, 0], points[n, 1]
            k = n
            if (uy > y) != (vy > y) and x < ux + (y - uy) / (vy - uy) * (vx - ux):
                odd = not odd
    return odd


@njit("int64(int64, int64, int64, float64[::1], int64[::1], float64[:,::1], int64[:,::1])", cache=True, nogil=True)
def enclosing_ring(h, n0, n1, area, ring, points, rings):
    """Smallest of the rings n0 to n1 - 1 that encloses the hole h; h itself if none does."""
    x, y = points[rings[ring[h], 0], 0], points[rings[ring[h], 0], 1]
    smallest = h
    for k in range(n0, n1):
        if area[k] <= -area[h] or (smallest != h and area[k] >= area[smallest]):
            continue
        if contains(points, rings, ring[k], ring[k] + 1, x, y):
            smallest = k
    return smallest


@njit(
    "float64(int64[::1], int64[::1], float64[::1], float64[::1], float64[:,::1], int64[::1], int64[::1], float64)",
    cache=True,
    nogil=True,
)
def shared_border(a, b, xs, ys, points, ring_a, ring_b, near):
    """Length [mm] that two rings of the tiles of operations a and b share on the tiles' border, within ``near``."""
    if a[J] == b[J] and abs(a[I] - b[I]) == 1:
        across, at = 0, xs[max(a[I], b[I])]
    elif a[I] == b[I] and abs(a[J] - b[J]) == 1:
        across, at = 1, ys[max(a[J], b[J])]
    else:
        return 0.0
    along, total = 1 - across, 0.0
    p = ring_a[0] + ring_a[1] - 1
    for q in range(ring_a[0], ring_a[0] + ring_a[1]):
        if abs(points[p, across] - at) <= near and abs(points[q, across] - at) <= near:
            low, high = min(points[p, along], points[q, along]), max(points[p, along], points[q, along])
            r = ring_b[0] + ring_b[1] - 1
            for s in range(ring_b[0], ring_b[0] + ring_b[1]):
                if abs(points[r, across] - at) <= near and abs(points[s, across] - at) <= near:
                    least, most = min(points[r, along], points[s, along]), max(points[r, along], points[s, along])
                    total += max(min(high, most) - max(low, least), 0.0)
                r = s
        p = q
    return total


@njit(
    "void(int64, int64, int64[:,::1], float64[::1], float64[::1], float64[:,::1], int64[:,::1], float64, float64[::1])",
    cache=True,
    nogil=True,
)
def join_over_tiles(k0, k1, ops, xs, ys, chip, chip_rings, film, out):
    """Join the pieces that one entry removes, of its operations k0 to k1 - 1, over the tiles; their sums in ``out``.

    A piece is a film if twice its area is at most ``film`` times its perimeter. Pieces are joined over a border of
    tiles if they are as near to it as simplification may move an edge.
    """
    near = max(ON_BORDER, SIMPLER * film)
    n = 0
    for k in range(k0, k1):
        n += ops[k, CHIP_1] - ops[k, CHIP_0]
    out[:] = 0.0
    if n == 0:
        return
    area, length = np.zeros(n), np.zeros(n)
    parent, of, ring = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    n = 0
    for k in range(k0, k1):
        n0 = n
        for r in range(ops[k, CHIP_0], ops[k, CHIP_1]):
            area[n], length[n] = ring_size(chip, chip_rings[r, 0], chip_rings[r, 1])
            out[AREA] += area[n]
            parent[n], of[n], ring[n] = n, k, r
            n += 1
        for h in range(n0, n):
            if area[h] < 0.0:
                parent[h] = enclosing_ring(h, n0, n, area, ring, chip, chip_rings)
    for a in range(n):
        for b in range(a + 1, n):
            if of[a] == of[b] or area[a] <= 0.0 or area[b] <= 0.0:
                continue
            shared = shared_border(ops[of[a]], ops[of[b]], xs, ys, chip, chip_rings[ring[a]], chip_rings[ring[b]], near)
            if shared > ON_BORDER:
                length[a] -= 2.0 * shared
                p, q = root(parent, a), root(parent, b)
                parent[max(p, q)] = min(p, q)
    for a in range(n):
        p = root(parent, a)
        if p != a:
            area[p] += area[a]
            length[p] += length[a]
    for a in range(n):
        if parent[a] == a and 2.0 * area[a] > film * length[a]:
            out[LEAST] = area[a] if out[PIECES] == 0.0 else min(out[LEAST], area[a])
            out[PIECES] += 1.0
            out[WHOLE] += area[a]


@njit(
    "void(int64, int64, int64[:,::1], float64[::1], float64[::1], float64[:,::1], int64[:,::1], float64,"
    " float64[:,::1])",
    cache=True,
    nogil=True,
)
def removed_areas(entries, count, ops, xs, ys, chip, chip_rings, film, out):
    """Result of :func:`join_over_tiles` of each entry; it is copied if the previous entry has the same operations."""
    k, before, old = 0, 0, 0
    for e in range(entries):
        k0 = k
        while k < count and ops[k, ENTRY] == e:
            k += 1
        alike = k > k0 and k - k0 == old - before
        for n in range(k - k0):
            alike = alike and ops[k0 + n, AS] == ops[before + n, AS]
        if alike:
            out[e] = out[e - 1]
        else:
            join_over_tiles(k0, k, ops, xs, ys, chip, chip_rings, film, out[e])
        before, old = k0, k


@njit(
    "int64(int64, int64, int64, int64, int64, int64, float64, float64, float64, float64[:,::1], int64[:,::1],"
    " int64[:,::1], int64[:,:,::1], float64[:,::1], int64[::1])",
    cache=True,
    nogil=True,
)
def edges_under(l0, l1, j0, j1, i0, i1, x0, y0, y1, P, rings, slots, slot_of, edges, start):
    """Write the edges (x0, y0, x1, y1) in tiles to ``edges`` (n, 4), and the first of each layer to ``start``.

    Edges that no ray along +x from a point with x >= ``x0`` and ``y0`` <= y <= ``y1`` meets are left out. Returns their
    number, MISSING, or FULL.
    """
    n = 0
    for layer in range(l0, l1):
        start[layer - l0] = n
        for j in range(j0, j1):
            for i in range(i0, i1):
                slot = slot_of[layer, j, i]
                if slot == NONE:
                    return MISSING
                if n + slots[slot, 2] > len(edges):
                    return FULL
                for r in range(slots[slot, 0], slots[slot, 0] + slots[slot, 1]):
                    last = rings[r, 0] + rings[r, 1] - 1
                    ax, ay = P[last, 0], P[last, 1]
                    for k in range(rings[r, 0], last + 1):
                        bx, by = P[k, 0], P[k, 1]
                        if max(ax, bx) >= x0 and max(ay, by) >= y0 and min(ay, by) <= y1:
                            edges[n, 0], edges[n, 1], edges[n, 2], edges[n, 3] = ax, ay, bx, by
                            n += 1
                        ax, ay = bx, by
    start[l1 - l0] = n
    return n
