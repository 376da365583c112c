"""The surface of dexels as quads, kept up to date while material is removed: each quad knows when it is seen.

Notation: the rays of a :class:`chipload.stock.dexel.TriDexel` along x, y and z run through the points of one lattice; a
point is solid or not. An edge of the lattice whose ends differ crosses the surface where the ray along it ends. A cell
between eight points that has such edges gets one vertex, the mean of its crossings; an edge that crosses the surface
gets a quad through the vertices of the four cells around it. The lattice has a border of points outside, so that the
surface is closed.

Reference: [Gibson1998] (surface nets). Differs from source: vertices stay the means, they are not relaxed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.stock.dexel import Rays, TriDexel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Points = NDArray[np.uint16]

#: steps of a stored coordinate from one side of the box to the other
STEPS = 65_535
#: the frame up to which a quad is seen that never goes
NEVER = 65_535


class SurfaceNet:
    """Quads of a stock that changes; :meth:`update` changes it.

    Parameters
    ----------
    stock : with rays along x, y and z

    Notes
    -----
    ``corners`` (q, 4, 3) are places in the box from ``low`` to ``high`` [mm] in 1 / :data:`STEPS` of its sides,
    counter-clockwise from outside; a quad is seen from frame ``seen[:, 0]`` to before frame ``seen[:, 1]``.

    Examples
    --------
    >>> net = SurfaceNet(TriDexel.block((0.0, 0.0, 0.0), (4.0, 4.0, 4.0), 1.0))
    >>> net.corners.shape, round(net.volume(0), 2)
    ((96, 4, 3), 53.87)
    """

    def __init__(self, stock: TriDexel) -> None:
        self.rays: dict[int, Rays] = {r.k: r for r in stock.rays}
        z = self.rays[2].grid
        x = self.rays[1].grid
        # z: u = x, v = y; y: u = z, v = x
        self.first = np.array([z[0], z[1], x[0]])
        self.pitch = np.array([z[2], z[3], x[2]])
        self.count = np.array([z[4], z[5], x[4]]).astype(np.int64)
        self.low = self.first - 0.5 * self.pitch
        self.high = self.low + self.count * self.pitch
        self.solid = np.zeros(tuple(self.count + 2), dtype=np.bool_)
        self.quad = [np.full(tuple(self.count + 2), -1, dtype=np.int32) for _ in range(3)]
        self._corners = np.zeros((1024, 4, 3), dtype=np.uint16)
        self._seen = np.zeros((1024, 2), dtype=np.uint16)
        self.size = 0
        self.update(self.low, self.high, 0)

    @property
    def corners(self) -> Points:
        """(q, 4, 3) uint16, see the class."""
        return self._corners[: self.size]

    @property
    def seen(self) -> NDArray[np.uint16]:
        """(q, 2) frames, see the class."""
        return self._seen[: self.size]

    def volume(self, frame: int) -> float:
        """Volume [mm^3] within the surface of a frame."""
        here = (self.seen[:, 0] <= frame) & (frame < self.seen[:, 1])
        p = self.corners[here] * ((self.high - self.low) / STEPS)
        a, b, c, d = p[:, 0], p[:, 1], p[:, 2], p[:, 3]
        six = np.einsum("ij,ij->i", a, np.cross(b, c)) + np.einsum("ij,ij->i", a, np.cross(c, d))
        return float(six.sum()) / 6.0

    def update(self, low: Floats, high: Floats, frame: int) -> None:
        """See what has changed in the box from ``low`` to ``high`` (3,) [mm] since the last frame."""
        a = np.floor((low - self.first) / self.pitch).astype(np.int64)
        b = np.ceil((high - self.first) / self.pitch).astype(np.int64) + 2
        if (b < 0).any() or (a > self.count + 1).any():
            return
        self._solids(np.clip(a, 0, self.count), np.clip(b, 0, self.count))
        # edges of changed points are in cells beside them, and these in quads of edges farther out
        a, b = np.clip(a - 2, 0, self.count + 1), np.clip(b + 3, 0, self.count + 2)
        if (b - a < 2).any():
            return
        self._quads(a, b, frame)

    def _solids(self, a: Ints, b: Ints) -> None:
        """Set the points from number a to before b, the border not counted."""
        rays, (_, ny, nz) = self.rays[2], self.count.tolist()
        if (b <= a).any():
            return
        which = (np.arange(a[0], b[0])[:, None] * ny + np.arange(a[1], b[1])).ravel()
        ends, many = rays.ends[which], rays.count[which]
        z = self.first[2] + self.pitch[2] * np.arange(a[2], min(b[2], nz))
        here = np.zeros((len(which), len(z)), dtype=np.bool_)
        for n in range(int(many.max(initial=0))):
            own = (many > n)[:, None]
            here |= own & (z >= ends[:, n, 0, None]) & (z <= ends[:, n, 1, None])
        box = tuple(slice(int(i) + 1, int(j) + 1) for i, j in zip(a, b, strict=True))
        self.solid[box] = here.reshape(b[0] - a[0], b[1] - a[1], len(z))

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
