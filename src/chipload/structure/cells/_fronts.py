"""Compiled sums of dense fronts. Oracle: dense algebra, in tests/structure/cells."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def add_columns(indptr, indices, data, order, position, first, last, place, own, border):
    """Add the unknowns ``first`` to ``last`` of an order of elimination, with later ones, to their front.

    ``indptr``, ``indices``, ``data`` the rows of a symmetric matrix; ``order`` (f,) and ``position`` (f,) its inverse;
    ``place`` (f,) by position the row of an unknown in the front; ``own`` (n, n) and ``border`` (b, n) its dense parts.
    """
    n = last - first
    for j in range(first, last):
        for p in range(indptr[order[j]], indptr[order[j] + 1]):
            i = position[indices[p]]
            if i < j:
                continue
            r = place[i]
            if r < n:
                own[r, j - first] += data[p]
            else:
                border[r - n, j - first] += data[p]


@njit(cache=True, nogil=True)
def mark_rows(indptr, indices, order, position, first, last, touched):
    """Mark in ``touched`` (f,) the positions that the unknowns ``first`` to ``last`` meet."""
    for j in range(first, last):
        for p in range(indptr[order[j]], indptr[order[j] + 1]):
            touched[position[indices[p]]] = True


@njit(cache=True, nogil=True)
def add_update(update, rows, own, border, rest):
    """Add the lower triangle of what an eliminated front leaves (m, m) to that above it.

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
