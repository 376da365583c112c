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
    # level by level: the spans of a level follow one another and hold all points
    for level in range(levels + 1):
        first = 2**level - 1
        of = slice(first, 2 * first + 1)
        some = np.flatnonzero(spans[of, 1] > spans[of, 0]) + first
        if len(some):
            begins = spans[some, 0]
            p = points[order]
            low, high = np.minimum.reduceat(p, begins), np.maximum.reduceat(p, begins)
            centre = 0.5 * (low + high)
            away = ((p - np.repeat(centre, spans[some, 1] - begins, axis=0)) ** 2).sum(axis=1)
            nodes[some, :3], nodes[some, 3] = centre, np.sqrt(np.maximum.reduceat(away, begins))
        if level == levels:
            break
        for k, axis in zip(some.tolist(), (high - low).argmax(axis=1).tolist() if len(some) else [], strict=True):
            a, b = spans[k].tolist()
            order[a:b] = order[a:b][np.argpartition(p[a:b, axis], (b - a) // 2)]
        middle = spans[of, 0] + (spans[of, 1] - spans[of, 0]) // 2
        below = slice(2 * first + 1, 4 * first + 3)
        spans[below] = np.column_stack([spans[of, 0], middle, middle, spans[of, 1]]).reshape(-1, 2)
    return Tree(order, nodes, spans, leaves)
