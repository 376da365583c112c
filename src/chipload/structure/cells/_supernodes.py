"""Compiled sums of dense supernodes. Oracle: dense algebra, in tests/structure/cells."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def add_columns(indptr, indices, data, order, position, first, last, place, own, border):
    """Add the nodes ``first`` to ``last`` of an order of elimination, with later ones, to their supernode.

    ``indptr``, ``indices``, ``data`` the rows of a symmetric matrix by blocks (s, s), one for a pair of nodes;
    ``order`` (u,) and ``position`` (u,) its inverse; ``place`` (u,) by position the block of a node in the supernode;
    ``own`` (n s, n s) and ``border`` (b s, n s) its dense parts.
    """
    s, n = data.shape[1], own.shape[0]
    for j in range(first, last):
        column = (j - first) * s
        for p in range(indptr[order[j]], indptr[order[j] + 1]):
            i = position[indices[p]]
            if i < j:
                continue
            r = place[i] * s
            if r < n:
                for a in range(s):
                    for b in range(s):
                        own[r + b, column + a] += data[p, a, b]
            else:
                for a in range(s):
                    for b in range(s):
                        border[r - n + b, column + a] += data[p, a, b]


@njit(cache=True, nogil=True)
def mark_rows(indptr, indices, order, position, first, last, touched):
    """Mark in ``touched`` (u,) the positions that the nodes ``first`` to ``last`` meet."""
    for j in range(first, last):
        for p in range(indptr[order[j]], indptr[order[j] + 1]):
            touched[position[indices[p]]] = True


@njit(cache=True, nogil=True)
def add_update(update, rows, own, border, rest):
    """Add the lower triangle of what an eliminated supernode leaves (m, m) to that above it.

    ``rows`` (m,) its rows there, rising; ``own`` (n, n), ``border`` (b, n), ``rest`` (b, b) lower triangles.
    """
    n = len(own)
    split = 0
    while split < len(rows) and rows[split] < n:
        split += 1
    for i in range(split):
        r = rows[i]
        for j in range(i + 1):
            own[r, rows[j]] += update[i, j]
    for i in range(split, len(rows)):
        r = rows[i] - n
        for j in range(split):
            border[r, rows[j]] += update[i, j]
        for j in range(split, i + 1):
            rest[r, rows[j] - n] += update[i, j]
