"""Compiled sum of the blocks of cells in a sparse matrix. Oracle: the energy of rigid motions and of closed forms."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def _position(indices, low, high, column):
    """Place of ``column`` among the rising ``indices`` from ``low`` to ``high``."""
    while low < high:
        middle = (low + high) // 2
        if indices[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low


@njit(cache=True, nogil=True)
def add_blocks(number, a, blocks, indptr, indices, data):
    """Add blocks (e, c, 3, 3) of the modes a and a, a + 1, ... of each cell, and their transposes.

    ``number`` (e, m) of the modes, -1: not used; ``indptr``, ``indices`` of the matrix by blocks, ``data`` its blocks.
    """
    for e in range(len(number)):
        p = number[e, a]
        if p < 0:
            continue
        for k in range(blocks.shape[1]):
            q = number[e, a + k]
            if q < 0:
                continue
            at = _position(indices, indptr[p], indptr[p + 1], q)
            for i in range(3):
                for j in range(3):
                    data[at, i, j] += blocks[e, k, i, j]
            if k > 0:
                at = _position(indices, indptr[q], indptr[q + 1], p)
                for i in range(3):
                    for j in range(3):
                        data[at, j, i] += blocks[e, k, i, j]
