"""Stock in the plane from which capsules are removed, with the exact engagement of the cutter's rim.

Notation: R [mm] cutter radius; a **capsule** is the disc of radius R swept along a straight step from A to B. The
cleared area is the union of the capsules. The rim of a cutter at O is covered by each capsule over ONE arc, in closed
form; the rest of the rim is uncut. A grid stores, for each cell, only the capsules that its cleared part needs; a cell
that is wholly cleared stores none. No boundary is built, so that tangencies cause no errors: an error of 1e-12 mm stays
that small.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule

_planar = LateModule("chipload.stock._planar")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: number of pieces in which half a rim is examined
PIECES = 48
#: cells along a cutter radius
CELLS = 8
#: most cells of a grid
CELL_LIMIT = 8_000_000
#: least depth of a contact of rim and material, as a share of R
TOUCH = 1e-9


class PlanarStock:
    """Solid plane within ``bounds`` from which capsules of radius R are removed.

    Parameters
    ----------
    bounds : (xmin, ymin, xmax, ymax) [mm]
        Rectangle that holds every rim of the cutter.
    radius : R [mm], > 0

    Examples
    --------
    >>> stock = PlanarStock((-5.0, -5.0, 5.0, 5.0), 1.0)
    >>> stock.remove([[-4.0, 0.0, 0.0, 0.0]])
    >>> arcs = stock.arcs((0.5, 0.0), (1.0, 0.0))
    >>> float(round(np.degrees(arcs[0, 1] - arcs[0, 0]), 9))  # a slot: the disc at the end covers nothing ahead
    180.0
    >>> arcs = stock.arcs((-1.0, 1.0), (1.0, 0.0))  # the centre on the wall of the slot
    >>> float(round(np.degrees(arcs[0, 1] - arcs[0, 0]), 9))
    90.0
    """

    def __init__(self, bounds: tuple[float, float, float, float], radius: float) -> None:
        if not 0.0 < radius < math.inf:
            raise InputError(f"radius = {radius:g} mm: must be above 0")
        self.radius = radius
        x0, y0, x1, y1 = bounds
        if not (math.isfinite(x0 + y0 + x1 + y1) and x1 > x0 and y1 > y0):
            raise InputError(f"stock: {x1 - x0:.4g} x {y1 - y0:.4g} mm: both sides must be above 0 and finite")
        margin = 0.5 * radius
        wide, high = x1 - x0 + 2.0 * margin, y1 - y0 + 2.0 * margin
        h = max(radius / CELLS, math.sqrt(wide * high / CELL_LIMIT))
        if h > 0.5 * radius:
            raise InputError(f"radius = {radius:g} mm: too small for a stock of {wide:.4g} x {high:.4g} mm")
        nx, ny = math.ceil(wide / h), math.ceil(high / h)
        piece = math.pi / PIECES
        reach = h * math.sqrt(0.5) + 0.5 * radius * piece
        side = (2.5 * radius + 2.0 * reach) / h + 2.0
        room = math.ceil(side * ((2.0 * radius + 2.0 * reach) / h + 2.0))
        self.grid: Floats = np.array([x0 - margin, y0 - margin, h, nx, ny, reach, piece, room])
        self.head = np.full(nx * ny, _planar.FULL, dtype=np.int64)
        self.count = np.full(nx * ny, _planar.MORE, dtype=np.int64)
        self.link = np.zeros((1 << 16, 2), dtype=np.int64)
        self.used = 0
        self.axis: Floats = np.zeros((1 << 12, 9))
        self.capsules = 0
        #: arcs of a rim, and the workspace of their calculation
        self.rim: Floats = np.zeros((_planar.RIM, 2))

    def reserve(self, capsules: int) -> None:
        """Reserve memory for a number of further capsules."""
        if self.capsules + capsules > len(self.axis):
            self.axis = np.vstack([self.axis, np.zeros((max(capsules, len(self.axis)), 9))])
        need = self.used + (2 * capsules + 2) * int(self.grid[7])
        if need > len(self.link):
            self.link = np.vstack(
                [self.link, np.zeros((max(need - len(self.link), len(self.link)), 2), dtype=np.int64)]
            )

    def state(self) -> tuple[Ints, Ints, int, int]:
        """Return the state with which :meth:`restore` undoes all later removals."""
        return self.head.copy(), self.count.copy(), self.capsules, self.used

    def restore(self, state: tuple[Ints, Ints, int, int]) -> None:
        """Restore the stock to a state: chain entries never change, so that the heads of the cells suffice."""
        self.head[:], self.count[:], self.capsules, self.used = state

    def cleared(self) -> NDArray[np.bool_]:
        """Which cells (ny * nx,) are wholly cleared."""
        return np.asarray(self.head == _planar.EMPTY)

    def remove(self, axes: ArrayLike) -> None:
        """Remove the capsules about ``axes`` (n, 4) [mm], rows ``ax, ay, bx, by``."""
        rows = np.asarray(axes, dtype=np.float64).reshape(-1, 4)
        self.remove_segments(np.column_stack([rows, np.zeros((len(rows), 3))]))

    def remove_segments(self, segments: ArrayLike) -> None:
        """Remove the capsules about ``segments`` (n, 7), lines and arcs of a contour; lines may have no length."""
        for row in np.asarray(segments, dtype=np.float64).reshape(-1, 7):
            length = math.hypot(row[2] - row[0], row[3] - row[1])
            if row[6] != 0.0:
                length = abs(row[6]) * math.hypot(row[0] - row[4], row[1] - row[5])
            self.reserve(2 + math.ceil(2.0 * length / self.radius) + math.ceil(4.0 * abs(row[6]) / math.pi))
            self.capsules, self.used = _planar.remove_segment(
                *row, self.capsules, self.radius, self.grid, self.head, self.count, self.link, self.used, self.axis
            )

    def arcs(self, centre: ArrayLike, heading: ArrayLike, whole: bool = False) -> Floats:
        """Return the uncut arcs (k, 2) [rad] of the rim about ``centre``, counter-clockwise from the unit ``heading``.

        Those of the front half, -pi/2 to pi/2; or of the ``whole`` rim, -pi/2 to 3 pi/2.
        """
        (ox, oy), (tx, ty) = np.asarray(centre, dtype=np.float64), np.asarray(heading, dtype=np.float64)
        r = self.radius * (1.0 - TOUCH)
        n = _planar.uncut(ox, oy, tx, ty, r, self.radius, whole, self.grid, self.head, self.link, self.axis, self.rim)
        return self.rim[:n].copy()

    def engagement(self, centre: ArrayLike, heading: ArrayLike) -> float:
        """Return the engagement angle [rad]: the sum of the uncut arcs on the front half of the rim."""
        a = self.arcs(centre, heading)
        return float((a[:, 1] - a[:, 0]).sum())
