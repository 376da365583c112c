"""The surface of dexels as quads, updated while material is removed; each quad has the frames in which it is visible.

Notation: the rays of a :class:`chipload.stock.dexel.TriDexel` along x, y and z run through the points of one lattice; a
point is solid or not. An edge of the lattice whose ends differ crosses the surface where the ray along it ends. A cell
between eight points that has such edges gets one vertex, the mean of its crossings; an edge that crosses the surface
gets a quad through the vertices of the four cells around it. The lattice has a border of points outside, so that the
surface is closed.

Reference: [Gibson1998] (surface nets). Differs from source: vertices remain at the means; they are not relaxed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.lazy import LateModule
from chipload.stock.dexel import Rays, TriDexel

_surface_net = LateModule("chipload.stock._surface_net")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Points = NDArray[np.uint16]

#: steps of a stored coordinate from one side of the box to the other
STEPS = 65_535
#: last frame of a quad that is never removed
NEVER = 65_535


class SurfaceNet:
    """Quads of the surface of a stock; :meth:`update` replaces those that material removal changed.

    Parameters
    ----------
    stock : dexels with rays along x, y and z

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
        self.quad = np.full((3, *(self.count + 2)), -1, dtype=np.int32)
        self._edges = np.zeros((1024, 4), dtype=np.int64)
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
        """Update the quads in the box from ``low`` to ``high`` (3,) [mm] for a new frame."""
        a = np.floor((low - self.first) / self.pitch).astype(np.int64)
        b = np.ceil((high - self.first) / self.pitch).astype(np.int64) + 2
        if (b < 0).any() or (a > self.count + 1).any():
            return
        self._solids(np.clip(a, 0, self.count), np.clip(b, 0, self.count))
        # edges of changed points lie in neighbouring cells, whose vertices belong to quads of edges farther out
        a, b = np.clip(a - 2, 0, self.count + 1), np.clip(b + 3, 0, self.count + 2)
        if (b - a < 2).any():
            return
        self._quads(a, b, frame)

    def _solids(self, a: Ints, b: Ints) -> None:
        """Set which of the points a to b - 1, numbered without the border, are solid."""
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
        """Update the quads in the window of the points a to b - 1."""
        while (many := _surface_net.changed_edges(self.solid, a, b, self._edges)) > len(self._edges):
            self._edges = np.zeros((2 * many, 4), dtype=np.int64)
        edges, rays = self._edges[:many], self.rays
        places = _surface_net.vertices(
            edges, a, b, self.first, self.pitch, self.count, self.low, self.high, STEPS,
            rays[0].ends, rays[0].count, rays[1].ends, rays[1].count, rays[2].ends, rays[2].count,
        )  # fmt: skip
        while self.size + many > len(self._corners):
            self._corners = np.concatenate([self._corners, np.zeros_like(self._corners)])
            self._seen = np.concatenate([self._seen, np.zeros_like(self._seen)])
        # vertices on the outermost cells of the window lack edges, unless the lattice ends there
        least, most = np.where(a > 0, 1, 0), b - a - 1 - np.where(b < self.count + 2, 1, 0)
        self.size = _surface_net.replace_quads(
            edges, places, self.solid, a, least, most, self.quad, self._corners, self._seen, self.size, frame, NEVER
        )
