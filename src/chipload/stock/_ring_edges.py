"""Compiled: the edges of rings, sorted by layer.

Notation: ``points`` (n, 2) [mm] of successive closed rings, ``ring`` (n,) number of the ring of each point, ``layer``
(r,) layer of each ring, ascending.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def ring_edges(points, ring, layer, x0, y0, y1, edges, start):
    """Write the edges (x0, y0, x1, y1) to ``edges`` (n, 4), the first of each layer to ``start`` (l + 1,); the count.

    Edges that no ray along +x from a point with x >= ``x0`` and ``y0`` <= y <= ``y1`` meets are left out.
    """
    count = 0
    current = 0
    for k in range(1, len(points)):
        if ring[k] != ring[k - 1]:
            continue
        while current < layer[ring[k]]:
            current += 1
            start[current] = count
        ax, ay, bx, by = points[k - 1, 0], points[k - 1, 1], points[k, 0], points[k, 1]
        if max(ax, bx) >= x0 and max(ay, by) >= y0 and min(ay, by) <= y1:
            edges[count, 0] = ax
            edges[count, 1] = ay
            edges[count, 2] = bx
            edges[count, 3] = by
            count += 1
    for k in range(current + 1, len(start)):
        start[k] = count
    return count
