"""Places on the edge of the cleared space from which a pass can go on.

Notation: a **place** is a point of the path with a normal N to where material may lie; its heading has N on the right.
Places of one pass follow one another; a run of open places starts at its first one, so that the next pass follows
the whole of the edge that the pass before it left.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import LateModule
from chipload.planning.pocket.reach import Reach
from chipload.stock.planar import TOUCH, PlanarStock

_kernels = LateModule("chipload.planning.pocket._kernels")

Floats = NDArray[np.float64]

#: least engagement [rad] that makes a place open
LEAST = math.radians(1.0)
#: length / R before the first open place where the pass begins
BACK = 0.4
#: length / R of an open run that is short
SHORT = 0.5
#: starts whose link is tried before the nearest is lifted to
TRIES = 12


class Starts:
    """All places of the path so far; ``alive`` may still be open, ``open`` were when last looked at."""

    def __init__(self, radius: float, step: float) -> None:
        self.radius, self.step = radius, step
        self.p: Floats = np.zeros((0, 2))
        self.normal: Floats = np.zeros((0, 2))
        self.rank: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self.first: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self.alive: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self.open: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self.fresh: NDArray[np.bool_] = np.zeros(0, dtype=bool)  # not looked at since the stock near it changed

    def add(self, points: Floats, headings: Floats) -> None:
        """Places of a pass: right side in its order, left side in the other, and ahead of where it ended."""
        right = np.column_stack([np.sin(headings), -np.cos(headings)])
        fan = headings[-1] + np.radians([-45.0, 0.0, 45.0])
        p = np.vstack([points, points[::-1], np.repeat(points[-1:], 3, axis=0)])
        normal = np.vstack([right, -right[::-1], np.column_stack([np.cos(fan), np.sin(fan)])])
        n = len(points)
        first = np.zeros(len(p), dtype=bool)
        first[[0, n, 2 * n, 2 * n + 1, 2 * n + 2]] = True
        self.p = np.vstack([self.p, p])
        self.normal = np.vstack([self.normal, normal])
        self.rank = np.concatenate([self.rank, np.repeat([0, 2, 3], [n, n, 3])])
        self.first = np.concatenate([self.first, first])
        self.alive = np.concatenate([self.alive, np.ones(len(p), dtype=bool)])
        self.open = np.concatenate([self.open, np.zeros(len(p), dtype=bool)])
        self.fresh = np.concatenate([self.fresh, np.ones(len(p), dtype=bool)])
        reach = 2.2 * self.radius  # a rim that far away meets nothing that this pass took
        near = (self.p >= points.min(axis=0) - reach) & (self.p <= points.max(axis=0) + reach)
        self.fresh |= near.all(axis=1)

    def revive(self) -> None:
        """Let every place be looked at again."""
        self.alive[:] = self.fresh[:] = True

    def search(self, stock: PlanarStock, reach: Reach, depth: float) -> None:
        """Find the open places: material within ``depth`` x R beside them that the cutter may go to.

        Only those near the last pass are asked again: elsewhere the stock is as it was.
        """
        k = np.flatnonzero(self.alive & self.fresh)
        out = np.zeros(len(k), dtype=bool)
        _kernels.open_sides(
            self.p[k], self.normal[k], depth * self.radius, LEAST, self.radius, TOUCH,
            stock.grid, stock.head, stock.link, stock.axis, *reach.arguments(), out,
        )  # fmt: skip
        self.open[k] = self.alive[k] = out
        self.fresh[:] = False

    def nearest(self, at: Floats, linked: Callable[[Floats], bool]) -> int | None:
        """The start to go to: of the long runs on the right side, else of the short ones, else of the left side, else
        ahead of a pass's end, the nearest that a straight link reaches, else the nearest.
        """
        before = np.concatenate([[False], self.open[:-1]])
        k = np.flatnonzero(self.open & (self.first | ~before))
        if len(k) == 0:
            return None
        ends = np.flatnonzero(np.append(~self.open | self.first, True))
        length = ends[np.searchsorted(ends, k, side="right")] - k
        rank = self.rank[k]
        rank[(rank == 0) & (length < SHORT * self.radius / self.step)] = 1
        k = k[rank == rank.min()]
        far = np.hypot(*(self.p[k] - at).T)
        order = k[np.argsort(far, kind="stable")]
        for i in order[:TRIES]:
            x, y, _ = next(self.candidates(int(i)))
            if linked(np.array([x, y])):
                return int(i)
        return int(order[0])

    def drop(self, k: int) -> None:
        """A start from which nothing could be cut: it and its near followers are not tried again."""
        n = max(1, round(0.2 * self.radius / self.step))
        for i in range(k, min(k + n, len(self.p))):
            if i > k and (self.first[i] or not self.open[i]):
                break
            self.alive[i] = self.open[i] = False

    def abandon(self, centre: Floats, far: float) -> None:
        """Places within ``far`` of a centre are not tried again until :meth:`revive`."""
        near = np.hypot(*(self.p - centre).T) <= far
        self.alive[near] = self.open[near] = False

    def candidates(self, k: int) -> Iterator[tuple[float, float, float]]:
        """(x, y, heading) to begin with for the start k: a little before it on its own path, then at it."""
        back = round(BACK * self.radius / self.step)
        i = k
        while i > 0 and k - i < back and not self.first[i]:
            i -= 1
        for j in dict.fromkeys((i, k)):
            nx, ny = self.normal[j]
            yield float(self.p[j, 0]), float(self.p[j, 1]), math.atan2(nx, -ny)
