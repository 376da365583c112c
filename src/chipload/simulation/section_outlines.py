"""Outlines of the swept area at many heights, each distinct one found once.

A cutter of :class:`~chipload.engagement.moves.stock.MoveStock` is open above, so that what it sweeps at a height it
sweeps at each greater height too. Where two heights have the same outlines, all heights between them have these. A
program that cuts level has a few distinct sections, and its stock hundreds of layers. Where all heights differ, a node
of the net of outlines that was swept at a height is swept at all greater ones: only nodes between are examined.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon

Floats = NDArray[np.float64]
Marks = NDArray[np.bool_]

#: heights that are found at once, whatever the number of threads: what is known of the nodes is the same for all
AT_ONCE = 16


def nested_outlines(
    outlines: Callable[[float, Marks | None, Marks | None], tuple[MultiPolygon, Marks]],
    heights: Sequence[float],
    levels: Floats,
    workers: int,
) -> list[MultiPolygon]:
    """Return the outlines at rising heights of an area that grows with the height.

    Between two heights with the same outlines none is calculated; the others are halved by number until each has its
    own. Equal heights share one object.

    Parameters
    ----------
    outlines : finds those at a height [mm] and the nodes that were swept there, from those that were swept at a
        lower and at a greater height (None: not known)
    heights : (n,) [mm], rising
    levels : (m,) float [mm], where the area is expected to grow; the result does not depend on them
    workers : threads

    Examples
    --------
    >>> from shapely import MultiPolygon, box
    >>> asked = []
    >>> def steps(z, below, above):
    ...     asked.append(z)
    ...     return MultiPolygon([box(0, 0, 1 + z // 10, 1)]), np.array([z >= 10])
    >>> found = nested_outlines(steps, range(20), np.array([10.0]), 1)
    >>> [shape.area for shape in found] == [1.0] * 10 + [2.0] * 10, sorted(asked)
    (True, [0, 9, 10, 19])
    """
    count = len(heights)
    if not count:
        return []
    first = np.unique(np.clip(np.searchsorted(np.asarray(heights, dtype=np.float64), levels), 1, count))
    ends = [0, *(int(k) for k in first.tolist()), count]
    spans = [(a, b - 1) for a, b in pairwise(ends) if b > a]
    known: dict[int, MultiPolygon] = {}
    nodes = _SweptNodes(count)
    with ThreadPoolExecutor(workers) as pool:
        while spans:
            wanted = sorted({k for span in spans for k in span} - known.keys())
            for begin in range(0, len(wanted), AT_ONCE):
                batch = wanted[begin : begin + AT_ONCE]
                found = list(pool.map(lambda k: outlines(heights[k], *nodes.around(k)), batch))
                for k, (shape, marks) in zip(batch, found, strict=True):
                    known[k] = shape
                    nodes.take(k, marks)
            wider = []
            for a, b in spans:
                if known[a] == known[b]:
                    known.update(dict.fromkeys(range(a, b + 1), known[a]))
                elif b - a > 1:
                    middle = (a + b) // 2
                    wider += [(a, middle), (middle, b)]
            spans = wider
    out = [known[0]]
    for k in range(1, count):
        out.append(out[-1] if known[k] is out[-1] or known[k] == out[-1] else known[k])
    return out


class _SweptNodes:
    """What is known of the nodes of a net: the lowest height at which each was swept, the greatest at which not."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.first: NDArray[np.int32] | None = None
        self.last: NDArray[np.int32] | None = None

    def around(self, k: int) -> tuple[Marks | None, Marks | None]:
        """Nodes that were swept at a height below number k, and those that may be at it."""
        if self.first is None or self.last is None:
            return None, None
        return self.first <= k, self.last < k

    def take(self, k: int, marks: Marks) -> None:
        """Keep what height number k shows."""
        if self.first is None or self.last is None:
            self.first = np.full(marks.shape, self.count, dtype=np.int32)
            self.last = np.full(marks.shape, -1, dtype=np.int32)
        np.minimum(self.first, k, out=self.first, where=marks)
        np.maximum(self.last, k, out=self.last, where=~marks)
