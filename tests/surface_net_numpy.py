"""The quads of a surface net by NumPy: oracle of the compiled ones.

Notation: as in :mod:`chipload.stock.surface_net`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.stock.surface_net import NEVER, STEPS, SurfaceNet

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Points = NDArray[np.uint16]


class PlainNet(SurfaceNet):
    """A surface net that compares a window in arrays of all of its edges."""

    def _quads(self, a: Ints, b: Ints, frame: int) -> None:
        """Compare the quads in the window of points from a to before b with what is there now."""
        window = self.solid[tuple(slice(int(i), int(j)) for i, j in zip(a, b, strict=True))]
        cells = b - a - 1
        edges = [_changes(window, k) for k in range(3)]
        places = [self._crossings(k, a + found) for k, found in enumerate(edges)]
        around = [_cells_around(k, found, cells) for k, found in enumerate(edges)]
        cell = np.concatenate([x[0].ravel() for x in around])
        inside = np.concatenate([x[1].ravel() for x in around])
        place = np.concatenate([np.repeat(p, 4, axis=0) for p in places])[inside]
        total = int(np.prod(cells))
        number = np.bincount(cell[inside], minlength=total)
        used = np.maximum(number, 1)
        vertex = np.stack([np.bincount(cell[inside], place[:, i], total) / used for i in range(3)], axis=1)
        stored = np.clip(np.round((vertex - self.low) / (self.high - self.low) * STEPS), 0, STEPS).astype(np.uint16)
        # vertices on the outermost cells of the window lack edges, unless the lattice ends there
        least, most = np.where(a > 0, 1, 0), cells - np.where(b < self.count + 2, 1, 0)
        for k in range(3):
            own, whole = around[k]
            at, u, v = edges[k], (k + 1) % 3, (k + 2) % 3
            good = whole.all(axis=1) & (at[:, k] >= least[k]) & (at[:, k] < most[k])
            for i in (u, v):
                good &= (at[:, i] - 1 >= least[i]) & (at[:, i] < most[i])
            at, own = at[good], own[good]
            turned = ~window[tuple(at.T)]
            own = np.where(turned[:, None], own[:, ::-1], own)
            self._replace(k, a, cells, least, most, at, stored[own], frame)

    def _replace(
        self, k: int, a: Ints, cells: Ints, least: Ints, most: Ints, at: Ints, corners: Points, frame: int
    ) -> None:
        """Quads of edges along k that are gone, and those that are new or have moved."""
        first = a + least + np.where(np.arange(3) == k, 0, 1)
        box = tuple(slice(int(i), int(j)) for i, j in zip(first, a + most, strict=True))
        before = self.quad[k][box]
        now = np.full(before.shape, -1, dtype=np.int32)
        local = tuple((at + a - first).T)
        old = before[local]
        known = old >= 0
        same = known.copy()
        same[known] = (self._corners[old[known]] == corners[known]).all(axis=(1, 2))
        fresh = self._add(corners[~same], frame)
        ids = old.copy()
        ids[~same] = fresh
        now[local] = ids
        gone = before[(before >= 0) & (before != now)]
        self._seen[gone, 1] = frame
        self.quad[k][box] = now

    def _add(self, corners: Points, frame: int) -> NDArray[np.int32]:
        n = len(corners)
        while self.size + n > len(self._corners):
            self._corners = np.concatenate([self._corners, np.zeros_like(self._corners)])
            self._seen = np.concatenate([self._seen, np.zeros_like(self._seen)])
        rows = slice(self.size, self.size + n)
        self._corners[rows] = corners
        self._seen[rows] = frame, NEVER
        self.size += n
        return np.arange(rows.start, rows.stop, dtype=np.int32)

    def _crossings(self, k: int, at: Ints) -> Floats:
        """(e, 3) [mm] where edges along k from the points ``at`` cross: the end of a ray that is nearest."""
        rays, u, v = self.rays[k], (k + 1) % 3, (k + 2) % 3
        out: Floats = self.first + (at - 1) * self.pitch
        if not len(at):
            return np.asarray(out)
        middle = out[:, k] + 0.5 * self.pitch[k]
        which = (at[:, u] - 1) * self.count[v] + at[:, v] - 1
        room = rays.ends.shape[1]
        there = np.repeat(np.arange(room) < rays.count[which][:, None], 2, axis=1)
        ends = np.where(there, rays.ends[which].reshape(-1, 2 * room), np.inf)
        far = np.abs(ends - middle[:, None])
        best = far.argmin(axis=1)
        found = ends[np.arange(len(at)), best]
        half = 0.5 * self.pitch[k]
        out[:, k] = np.where(np.isfinite(found), np.clip(found, middle - half, middle + half), middle)
        return np.asarray(out)


def _changes(window: NDArray[np.bool_], k: int) -> Ints:
    """(e, 3) lower points of edges along k whose ends differ."""
    low = [slice(None)] * 3
    high = [slice(None)] * 3
    low[k], high[k] = slice(0, -1), slice(1, None)
    return np.argwhere(window[tuple(low)] != window[tuple(high)])


def _cells_around(k: int, at: Ints, cells: Ints) -> tuple[Ints, NDArray[np.bool_]]:
    """(e, 4) numbers of the cells around edges along k, counter-clockwise about k, and whether they are there."""
    u, v = (k + 1) % 3, (k + 2) % 3
    out = np.zeros((len(at), 4), dtype=np.int64)
    inside = np.ones((len(at), 4), dtype=np.bool_)
    for n, (du, dv) in enumerate(((-1, -1), (0, -1), (0, 0), (-1, 0))):
        c = at.copy()
        c[:, u] += du
        c[:, v] += dv
        inside[:, n] = ((c >= 0) & (c < cells)).all(axis=1)
        out[:, n] = (c[:, 0] * cells[1] + c[:, 1]) * cells[2] + c[:, 2]
    out[~inside] = 0
    return out, inside
