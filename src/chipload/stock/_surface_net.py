"""The quads of a window of a surface net, compiled; arrays and scalars only.

Notation: as in :mod:`chipload.stock.surface_net`; k is the axis of an edge, u and v the axes that follow it.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def edge_crossing(k, at, first, pitch, count, ends, known):
    """Where the edge along ``k`` from the point ``at`` crosses: the end of its ray that is nearest to its middle."""
    u, v = (k + 1) % 3, (k + 2) % 3
    middle = first[k] + (at[k] - 1) * pitch[k] + 0.5 * pitch[k]
    ray = (at[u] - 1) * count[v] + at[v] - 1
    best, least = middle, np.inf
    for n in range(known[ray]):
        for side in range(2):
            far = abs(ends[ray, n, side] - middle)
            if far < least:
                best, least = ends[ray, n, side], far
    half = 0.5 * pitch[k]
    return min(max(best, middle - half), middle + half)


@njit(cache=True, nogil=True)
def changed_edges(solid, a, b, edges):
    """How many edges of the window have ends that differ; their axes and lower points, axis by axis, into ``edges``."""
    many = 0
    for k in range(3):
        dx, dy, dz = int(k == 0), int(k == 1), int(k == 2)
        for x in range(a[0], b[0] - dx):
            for y in range(a[1], b[1] - dy):
                for z in range(a[2], b[2] - dz):
                    if solid[x, y, z] != solid[x + dx, y + dy, z + dz]:
                        if many < len(edges):
                            edges[many, 0], edges[many, 1], edges[many, 2], edges[many, 3] = k, x, y, z
                        many += 1
    return many


@njit(cache=True, nogil=True)
def vertices(edges, a, b, first, pitch, count, low, high, steps, ends0, known0, ends1, known1, ends2, known2):
    """(cells of the window) vertices, the means of the crossings of their edges, in ``steps`` of the box."""
    cx, cy, cz = b[0] - a[0] - 1, b[1] - a[1] - 1, b[2] - a[2] - 1
    sums, number = np.zeros((cx, cy, cz, 3)), np.zeros((cx, cy, cz), np.int64)
    at, place, c = np.zeros(3, np.int64), np.zeros(3), np.zeros(3, np.int64)
    for e in range(len(edges)):
        k = edges[e, 0]
        u, v = (k + 1) % 3, (k + 2) % 3
        for i in range(3):
            at[i] = edges[e, 1 + i]
            place[i] = first[i] + (at[i] - 1) * pitch[i]
        if k == 0:
            place[k] = edge_crossing(k, at, first, pitch, count, ends0, known0)
        elif k == 1:
            place[k] = edge_crossing(k, at, first, pitch, count, ends1, known1)
        else:
            place[k] = edge_crossing(k, at, first, pitch, count, ends2, known2)
        for n in range(4):
            for i in range(3):
                c[i] = at[i] - a[i]
            c[u] -= int(n == 0 or n == 3)
            c[v] -= int(n < 2)
            if c.min() >= 0 and c[0] < cx and c[1] < cy and c[2] < cz:
                number[c[0], c[1], c[2]] += 1
                for i in range(3):
                    sums[c[0], c[1], c[2], i] += place[i]
    out = np.zeros((cx, cy, cz, 3), np.uint16)
    for x in range(cx):
        for y in range(cy):
            for z in range(cz):
                if number[x, y, z]:
                    for i in range(3):
                        mean = sums[x, y, z, i] / number[x, y, z]
                        step = np.rint((mean - low[i]) / (high[i] - low[i]) * steps)
                        out[x, y, z, i] = np.uint16(min(max(step, 0.0), float(steps)))
    return out


@njit(cache=True, nogil=True)
def replace_quads(edges, places, solid, a, least, most, quad, corners, seen, size, frame, never):
    """Quads of the edges of a window that are gone, new or moved; ``places`` of :func:`vertices`; the new ``size``.

    Only edges with four cells from ``least`` to before ``most`` have their quads in the window; ``quad`` numbers the
    quads of all edges, ``corners`` and ``seen`` have room for one quad an edge.
    """
    now = np.full((3, most[0] + 1, most[1] + 1, most[2] + 1), -1, np.int32)
    new, c = np.zeros((4, 3), np.uint16), np.zeros(3, np.int64)
    for e in range(len(edges)):
        k = edges[e, 0]
        u, v = (k + 1) % 3, (k + 2) % 3
        x, y, z = edges[e, 1], edges[e, 2], edges[e, 3]
        at = (x - a[0], y - a[1], z - a[2])
        if not (least[k] <= at[k] < most[k]):
            continue
        if not (at[u] - 1 >= least[u] and at[u] < most[u] and at[v] - 1 >= least[v] and at[v] < most[v]):
            continue
        for n in range(4):
            for i in range(3):
                c[i] = at[i]
            c[u] -= int(n == 0 or n == 3)
            c[v] -= int(n < 2)
            to = n if solid[x, y, z] else 3 - n
            for i in range(3):
                new[to, i] = places[c[0], c[1], c[2], i]
        old = quad[k, x, y, z]
        if old < 0 or (corners[old] != new).any():
            corners[size], seen[size, 0], seen[size, 1] = new, frame, never
            now[k, at[0], at[1], at[2]] = size
            size += 1
        else:
            now[k, at[0], at[1], at[2]] = old
    for k in range(3):
        fx, fy, fz = least[0] + int(k != 0), least[1] + int(k != 1), least[2] + int(k != 2)
        for x in range(fx, most[0]):
            for y in range(fy, most[1]):
                for z in range(fz, most[2]):
                    old = quad[k, a[0] + x, a[1] + y, a[2] + z]
                    if old >= 0 and old != now[k, x, y, z]:
                        seen[old, 1] = frame
                    quad[k, a[0] + x, a[1] + y, a[2] + z] = now[k, x, y, z]
    return size
