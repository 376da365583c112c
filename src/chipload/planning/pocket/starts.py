"""Places on the edge of the cleared space from which a pass can go on.

Notation: a **place** is a point of the path with a normal N to where material may lie; its heading has N on the right.
Places of one pass follow one another; a run of open places starts at its first one, so that the next pass follows
the whole of the edge that the pass before it left.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

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
    """All places of the path so far; ``alive`` may still be open, ``open`` were when last looked at.

    The arrays are views of buffers that double when they are full: a pass costs the time of its own places, and of
    those that are alive.
    """

    def __init__(self, radius: float, step: float) -> None:
        self.radius, self.step = radius, step
        self.count = 0
        self._buffers: dict[str, NDArray[Any]] = {
            "p": np.zeros((0, 2)),
            "normal": np.zeros((0, 2)),
            "rank": np.zeros(0, dtype=np.int64),
            "first": np.zeros(0, dtype=bool),
            "alive": np.zeros(0, dtype=bool),
            "open": np.zeros(0, dtype=bool),
            "fresh": np.zeros(0, dtype=bool),  # not looked at since the stock near it changed
        }
        self._show()

    def _show(self) -> None:
        """The views of the places that there are."""
        used = {name: values[: self.count] for name, values in self._buffers.items()}
        self.p, self.normal, self.rank = used["p"], used["normal"], used["rank"]
        self.first, self.alive, self.open, self.fresh = used["first"], used["alive"], used["open"], used["fresh"]

    def add(self, points: Floats, headings: Floats) -> None:
        """Places of a pass: right side in its order, left side in the other, and ahead of where it ended."""
        right = np.column_stack([np.sin(headings), -np.cos(headings)])
        fan = headings[-1] + np.radians([-45.0, 0.0, 45.0])
        n = len(points)
        first = np.zeros(2 * n + 3, dtype=bool)
        first[[0, n, 2 * n, 2 * n + 1, 2 * n + 2]] = True
        new = {
            "p": np.vstack([points, points[::-1], np.repeat(points[-1:], 3, axis=0)]),
            "normal": np.vstack([right, -right[::-1], np.column_stack([np.cos(fan), np.sin(fan)])]),
            "rank": np.repeat([0, 2, 3], [n, n, 3]),
            "first": first,
            "alive": True,
            "open": False,
            "fresh": True,
        }
        before, self.count = self.count, self.count + len(first)
        for name, values in self._buffers.items():
            if self.count > len(values):
                room = np.zeros((2 * self.count, *values.shape[1:]), dtype=values.dtype)
                room[:before] = values[:before]
                self._buffers[name] = room
            self._buffers[name][before : self.count] = new[name]
        self._show()
        reach = 2.2 * self.radius  # a rim that far away meets nothing that this pass took
        k = np.flatnonzero(self.alive)
        near = (self.p[k] >= points.min(axis=0) - reach) & (self.p[k] <= points.max(axis=0) + reach)
        self.fresh[k] |= near.all(axis=1)

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
