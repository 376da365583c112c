"""Compiled loop that lays out the edges of rings by layer; arrays and scalars only.

Notation: ``points`` (n, 2) [mm] of closed rings, one after the other, ``ring`` (n,) the ring of each, ``layer`` of each
ring, rising.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def ring_edges(points, ring, layer, x0, y0, y1, edges, start):
    """Rows x0, y0, x1, y1 into ``edges`` (n, 4) and where each layer begins into ``start`` (l + 1,); their count.

    Left out are edges that no ray along +x from a place right of ``x0`` and between ``y0`` and ``y1`` meets.
    """
    count = 0
    here = 0
    for k in range(1, len(points)):
        if ring[k] != ring[k - 1]:
            continue
        while here < layer[ring[k]]:
            here += 1
            start[here] = count
        ax, ay, bx, by = points[k - 1, 0], points[k - 1, 1], points[k, 0], points[k, 1]
        if max(ax, bx) >= x0 and max(ay, by) >= y0 and min(ay, by) <= y1:
            edges[count, 0] = ax
            edges[count, 1] = ay
            edges[count, 2] = bx
            edges[count, 3] = by
            count += 1
    for k in range(here + 1, len(start)):
        start[k] = count
    return count
