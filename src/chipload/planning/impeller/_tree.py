"""Compiled: the walk through a tree of balls.

Notation: as in ``tree.py``.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def next_node(node: int, leaves: int, enter: bool) -> int:
    """Next node of a depth-first walk, right child before left; -1 at its end.

    ``enter``: the walk goes into the subtree of ``node``, else past it. A leaf has no subtree.
    """
    if enter and node < leaves:
        return 2 * node + 2
    # a left child is the last of its parent's subtree
    while node & 1:
        node >>= 1
    return node - 1
