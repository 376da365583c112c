"""Starts of passes: places on the edge of the cleared space from which a pass can continue.

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

_pass_steps = LateModule("chipload.planning.pocket._pass_steps")

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
    """All places of the path so far, and the live ones, which may still be open.

    ``live`` are the indices of these, ascending; ``fresh``: the stock near it has changed since its last check.
    After :meth:`search` all of them are open. The arrays of all places are views of buffers that double when they are
    full: a pass costs the time of its own places, and of those that are live.
    """

    def __init__(self, radius: float, step: float) -> None:
        self.radius, self.step = radius, step
        self.count = 0
        self.live = np.zeros(0, dtype=np.int64)
        self.fresh = np.zeros(0, dtype=bool)
        self._buffers: dict[str, NDArray[Any]] = {
            "p": np.zeros((0, 2)),
            "normal": np.zeros((0, 2)),
            "rank": np.zeros(0, dtype=np.int64),
            "first": np.zeros(0, dtype=bool),
        }
        self._show()

    def _show(self) -> None:
        """The views of the places that there are."""
        used = {name: values[: self.count] for name, values in self._buffers.items()}
        self.p, self.normal, self.rank, self.first = used["p"], used["normal"], used["rank"], used["first"]

    def add(self, points: Floats, headings: Floats) -> None:
        """Add the places of a pass: its right side in order, its left side in reverse, and those ahead of its end."""
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
        p = self.p[self.live]
        near = ((p >= points.min(axis=0) - reach) & (p <= points.max(axis=0) + reach)).all(axis=1)
        self.live = np.concatenate([self.live, np.arange(before, self.count)])
        self.fresh = np.concatenate([self.fresh | near, np.ones(self.count - before, dtype=bool)])

    def revive(self) -> None:
        """Make every place live again."""
        self.live, self.fresh = np.arange(self.count), np.ones(self.count, dtype=bool)

    def search(self, stock: PlanarStock, reach: Reach, depth: float) -> None:
        """Find the open places: material within ``depth`` x R beside them that the cutter may go to.

        Only those near the last pass are searched again: elsewhere the stock is as it was.
        """
        searched = np.flatnonzero(self.fresh)
        out = np.zeros(len(searched), dtype=bool)
        _pass_steps.open_sides(
            self.p, self.normal, self.live[searched], depth * self.radius, LEAST, self.radius, TOUCH,
            stock.grid, stock.head, stock.link, stock.axis, stock.rim, *reach.arguments(), out,
        )  # fmt: skip
        kept = ~self.fresh
        kept[searched] = out
        self.live = self.live[kept]
        self.fresh = np.zeros(len(self.live), dtype=bool)

    def nearest(self, at: Floats, linked: Callable[[Floats], bool]) -> int | None:
        """The start to go to: of the long runs on the right side, else of the short ones, else of the left side, else
        ahead of a pass's end, the nearest that a straight link reaches, else the nearest.
        """
        if len(self.live) == 0:
            return None
        begins = np.flatnonzero(self.first[self.live] | np.append(True, np.diff(self.live) != 1))
        k = self.live[begins]
        length = np.diff(np.append(begins, len(self.live)))
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
        """Remove a start from which nothing could be cut: it and its near followers are not tried again."""
        n = max(1, round(0.2 * self.radius / self.step))
        at = int(np.searchsorted(self.live, k))
        end = at + 1
        while end < min(at + n, len(self.live)) and self.live[end] == k + end - at and not self.first[self.live[end]]:
            end += 1
        self._forget(np.arange(at, end))

    def abandon(self, centre: Floats, far: float) -> None:
        """Exclude places within ``far`` of a centre until :meth:`revive`."""
        self._forget(np.flatnonzero(np.hypot(*(self.p[self.live] - centre).T) <= far))

    def _forget(self, which: NDArray[np.int64]) -> None:
        self.live, self.fresh = np.delete(self.live, which), np.delete(self.fresh, which)

    def candidates(self, k: int) -> Iterator[tuple[float, float, float]]:
        """Poses (x, y, heading) to begin with for the start k: a little before it on its own path, then at it."""
        back = round(BACK * self.radius / self.step)
        i = k
        while i > 0 and k - i < back and not self.first[i]:
            i -= 1
        for j in dict.fromkeys((i, k)):
            nx, ny = self.normal[j]
            yield float(self.p[j, 0]), float(self.p[j, 1]), math.atan2(nx, -ny)
