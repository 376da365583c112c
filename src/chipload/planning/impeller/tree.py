"""Tree of bounding balls over points.

Notation: node k has the children 2 k + 1 and 2 k + 2; nodes from ``leaves`` on are leaves and hold points. A ball is a
row ``x, y, z, radius`` [mm]; a ball with a negative radius holds no point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Tree:
    """Complete binary tree of balls.

    Parameters
    ----------
    order : (m,) int, number of the point at each position of the tree's order
    nodes : (k, 4) float [mm], centre and radius of each ball
    spans : (k, 2) int, first position of each node's points and the one after the last
    leaves : number of the first leaf
    """

    order: Ints
    nodes: Floats
    spans: Ints
    leaves: int


def tree_of(points: Floats, most: int = 12) -> Tree:
    """Tree of the points (m, 3) [mm], at most ``most`` in a leaf.

    The points of each node are split at the median along the longest side of their bounding box.

    >>> tree = tree_of(np.arange(60.0).reshape(20, 3), most=8)
    >>> tree.leaves, len(tree.nodes), tree.spans[-1].tolist()
    (3, 7, [15, 20])
    """
    m = len(points)
    levels = 0
    while m > most << levels:
        levels += 1
    total, leaves = 2 ** (levels + 1) - 1, 2**levels - 1
    order = np.arange(m)
    nodes, spans = np.zeros((total, 4)), np.zeros((total, 2), dtype=np.int64)
    nodes[:, 3] = -1.0
    spans[0] = 0, m
    for k in range(total):
        a, b = spans[k]
        if b > a:
            p = points[order[a:b]]
            low, high = p.min(axis=0), p.max(axis=0)
            centre = 0.5 * (low + high)
            nodes[k, :3], nodes[k, 3] = centre, np.sqrt(((p - centre) ** 2).sum(axis=1).max())
            if k < leaves:
                along = np.argpartition(p[:, (high - low).argmax()], (b - a) // 2)
                order[a:b] = order[a:b][along]
        if k < leaves:
            middle = a + (b - a) // 2
            spans[2 * k + 1], spans[2 * k + 2] = (a, middle), (middle, b)
    return Tree(order, nodes, spans, leaves)
