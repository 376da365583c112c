"""A clamped workpiece in one state of removal, and its compliance along contact lines.

Notation: u modes, K (3 u, 3 u) stiffness of material and clamps. A **contact line** is the segment along which a cutter
touches the surface, from its lowest to its highest point. The force is spread evenly over it, since under a point force
the displacement of an elastic body has no bound. With the load w = mean over the line of the modes' values, its
compliance at a **station** of the line with the modes' values v is C = (v x I)^T K^-1 (w x I), (3, 3) [mm/N].

K is factored in an order of nested dissection: planes of the lattice cut the workpiece in halves again and again, the
modes of a plane come after those of both sides. A line touches few of the factors, those from its cells to the last
plane; lines that lie near one another are solved together.

Reference: [George1973] for the order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.assembly import LEAST_SHARE, CellModes, mass, modes_of, shares, stiffness
from chipload.structure.cells.clamp import Clamp, clamp_stiffness
from chipload.structure.cells.grid import Array, CellGrid, Indices, shape_values
from chipload.structure.cells.moments import stock_moments
from chipload.structure.cells.nearest import StockSections
from chipload.structure.cells.supernodes import SupernodeFactors, factor_supernodes

#: points along a contact line over which the force is spread, at least, and a cell
SPREAD, PER_CELL = 4, 3
#: stations of a contact line, from its lower end (0) to its upper end (1)
STATIONS = (0.0, 0.5, 1.0)
#: number of modes from which on nested dissection stops
LEAF = 60
#: number of active cells around an empty one, of which the nearest takes a force
AROUND = 27
#: number of lines that are solved together, with three right-hand sides each
ABREAST = 21


@dataclass(frozen=True)
class Elastic:
    """Elastic constants and density of a workpiece.

    Parameters
    ----------
    modulus : Young's modulus [MPa]
    poisson : Poisson's ratio
    density : [t/mm^3]; None: its mass is not known
    """

    modulus: float
    poisson: float
    density: float | None = None

    def __post_init__(self) -> None:
        """Refuse moduli and densities that no elastic solid has."""
        if not 0.0 < self.modulus < np.inf or not 0.0 <= self.poisson < 0.5:
            raise InputError(f"workpiece: modulus {self.modulus:g} MPa: above 0; Poisson {self.poisson:g}: 0 to 0.5")
        if self.density is not None and not 0.0 < self.density < np.inf:
            raise InputError(f"workpiece: density {self.density:g} t/mm3: must be above 0")


class CellBody(Protocol):
    """What is left of a stock in cells, without its factors; see :class:`CellWorkpiece`."""

    @property
    def grid(self) -> CellGrid:
        """Its cells."""

    @property
    def modes(self) -> CellModes:
        """Their modes."""

    @property
    def share(self) -> Array:
        """(nx, ny, nz) of each cell that is material."""

    @property
    def sections(self) -> StockSections:
        """Sections of the stock."""


@dataclass(frozen=True, eq=False)
class CellWorkpiece:
    """A clamped workpiece, factored.

    Attributes
    ----------
    grid, modes : its cells and their modes
    share : (nx, ny, nz) float, of each cell that is material
    stiffness : (3 u, 3 u) sparse [N/mm]
    factors : of the stiffness with the modes in ``order``
    order : (3 u,) int
    place : (3 u,) int, the inverse of ``order``
    volume : [mm^3] of the material that is held
    loose : [mm^3] of pieces that the clamps do not hold against every rigid motion, which are left out
    clamped : [mm^3] that each clamp holds
    sections : of the stock, on which forces act
    mass : (3 u, 3 u) sparse [t]; None: the density is not known
    """

    grid: CellGrid
    modes: CellModes
    share: Array
    stiffness: scipy.sparse.bsr_array
    factors: SupernodeFactors
    order: Indices
    place: Indices
    volume: float
    loose: float
    clamped: Array
    sections: StockSections
    mass: scipy.sparse.bsr_array | None = None

    def solve(self, right: Array) -> Array:
        """(3 u, q) displacements of the modes under forces (3 u, q)."""
        return np.asarray(self.factors.solve(right[self.order])[self.place])


def cell_workpiece(
    stock: LayeredStock, grid: CellGrid, elastic: Elastic, clamps: Sequence[Clamp], held: ArrayLike | None = None
) -> CellWorkpiece:
    """A stock as it is now, clamped and factored.

    Parameters
    ----------
    held : (c,) float [mm^3] what each clamp held before the first cut; None: what it holds now

    Raises
    ------
    InputError
        A clamp holds nothing, a rigid motion is free, or the cells are too many.
    """
    moments = stock_moments(stock, grid)
    share, loose = shares(moments), 0.0
    modes = modes_of(grid, share)
    first = None if held is None else np.asarray(held, dtype=np.float64).tolist()
    springs = clamp_stiffness(clamps, stock, grid, modes, elastic.modulus, first)
    pieces, count = scipy.ndimage.label(share > LEAST_SHARE)
    if count > 1:
        touched = np.unique(pieces[springs.cells & (pieces > 0)]).tolist()
        fixed = [k for k in touched if _is_clamped(clamps, stock, grid, np.where(pieces == k, share, 0.0), elastic)]
        kept = np.isin(pieces, fixed or touched)
        loose = float((share * grid.volumes)[~kept].sum())
        if loose > 0.0:
            share = np.where(kept, share, 0.0)
            modes = modes_of(grid, share)
            springs = clamp_stiffness(clamps, stock, grid, modes, elastic.modulus, first)
    K = stiffness(grid, modes, moments, elastic.modulus, elastic.poisson) + springs.matrix
    factors, order, place = factor_modes(grid, modes, K)
    volume = float((share * grid.volumes).sum())
    return CellWorkpiece(
        grid, modes, share, K, factors, order, place, volume, loose, springs.volumes,
        StockSections(stock), None if elastic.density is None else mass(grid, modes, moments, elastic.density),
    )  # fmt: skip


def _is_clamped(
    clamps: Sequence[Clamp], stock: LayeredStock, grid: CellGrid, share: NDArray[np.float64], elastic: Elastic
) -> bool:
    """Whether the clamps leave a piece no rigid motion; ``share`` of each cell that it fills."""
    try:
        clamp_stiffness(clamps, stock, grid, modes_of(grid, share), elastic.modulus)
    except InputError:
        return False
    return True


def factor_modes(
    grid: CellGrid, modes: CellModes, K: scipy.sparse.bsr_array
) -> tuple[SupernodeFactors, Indices, Indices]:
    """Factors of a stiffness (3 u, 3 u) in an order of nested dissection, that order (3 u,), and its inverse."""
    pieces = dissect_modes(modes.lattice, grid.order)
    nodes = np.concatenate(pieces)
    order = (3 * nodes[:, None] + np.arange(3)).ravel()
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return factor_supernodes(K, nodes, [len(piece) for piece in pieces]), order, place


def dissect_modes(lattice: Indices, p: int) -> list[Indices]:
    """Modes (n,) int of pieces and planes by nested dissection, in the order of elimination.

    Parameters
    ----------
    lattice : (u, 3) int, places of the modes
    p : order of the cells
    """
    out: list[Indices] = []
    waiting: list[tuple[Indices, bool]] = [(np.arange(len(lattice)), False)]
    while waiting:
        some, done = waiting.pop()
        cut = None if done or len(some) <= LEAF else _separator(lattice[some], p)
        if cut is None:
            out.append(some)
            continue
        axis, at = cut
        v = lattice[some, axis]
        # taken from the end: below, above, then the plane between
        waiting += [(some[v == at], True), (some[v > at], False), (some[v < at], False)]
    return out


def _separator(at: Indices, p: int) -> tuple[int, int] | None:
    """The plane between cells with the fewest modes among those that leave at least a third on either side."""
    best: tuple[float, int, int] | None = None
    for axis in range(3):
        v = at[:, axis]
        low, size = int(v.min()), np.bincount(v - v.min())
        below = np.concatenate([[0], np.cumsum(size)[:-1]]) / len(v)
        planes = np.arange(1, len(size) - 1)
        planes = planes[(planes + low) % p == 0]
        if not len(planes):
            continue
        uneven = np.abs(below[planes] + 0.5 * size[planes] / len(v) - 0.5)
        cost = size[planes] + len(v) * np.maximum(uneven - 1.0 / 6.0, 0.0) * 10.0
        k = int(np.argmin(cost))
        if best is None or cost[k] < best[0]:
            best = (float(cost[k]), axis, int(planes[k]) + low)
    return None if best is None else best[1:]


def mode_weights(work: CellBody, points: Array) -> scipy.sparse.csr_array:
    """Values of the modes at points (n, 3), or at the nearest material to them: (n, u) sparse."""
    at = work.sections.nearest(points)
    cell, local = work.grid.cell_of(at)
    empty = work.share[tuple(cell.T)] <= LEAST_SHARE
    if empty.any():
        cell[empty], local[empty] = _nearest_cells(work, at[empty], cell[empty])
    rows = np.full(work.grid.counts, -1, dtype=np.int64)
    rows[tuple(work.modes.cells.T)] = np.arange(len(work.modes.cells))
    number = work.modes.number[rows[tuple(cell.T)]]
    values = shape_values(work.grid, local)
    n, some = len(points), number >= 0
    at = np.broadcast_to(np.arange(n)[:, None], number.shape)
    return scipy.sparse.csr_array((values[some], (at[some], number[some])), shape=(n, len(work.modes)))


def _nearest_cells(work: CellBody, points: Array, cells: Indices) -> tuple[Indices, Array]:
    """The nearest of the active cells about empty ones (n, 3), and local coordinates of points (n, 3) clipped to it.

    A point on a face of the material may lie on a plane between a full cell and an empty one.
    """
    active = work.modes.cells
    near = active[scipy.spatial.cKDTree(active).query(cells, k=min(AROUND, len(active)))[1].reshape(len(cells), -1)]
    low, high = (np.stack([v[near[..., d] + e] for d, v in enumerate(work.grid.planes)], axis=-1) for e in (0, 1))
    off = np.linalg.norm(np.maximum(np.maximum(low - points[:, None], points[:, None] - high), 0.0), axis=2)
    best = np.arange(len(cells)), off.argmin(axis=1)
    local = 2.0 * (points - low[best]) / (high - low)[best] - 1.0
    return near[best], np.clip(local, -1.0, 1.0)


def line_compliances(work: CellWorkpiece, lines: ArrayLike) -> Array:
    """Compliance of contact lines.

    Parameters
    ----------
    lines : (c, 2, 3) float [mm], lower and upper end

    Returns
    -------
    (c, s, 3, 3) float [mm/N] at the s :data:`STATIONS`: displacement (first of the two) per force.
    """
    ends = np.asarray(lines, dtype=np.float64).reshape(-1, 2, 3)
    c = len(ends)
    out = np.empty((c, len(STATIONS), 3, 3))
    if not c:
        return out
    loads, stations = line_means(work, ends), _modes_along(work, ends, np.array(STATIONS))
    cell = work.grid.cell_of(ends.mean(axis=1))[0]
    near = np.lexsort(cell.T)
    for at in range(0, c, ABREAST):
        some = near[at : at + ABREAST]
        out[some] = _solve_lines(work, scipy.sparse.csr_array(loads[some]), stations, some)
    return out


def line_means(work: CellWorkpiece, lines: Array) -> scipy.sparse.csr_array:
    """Mean of the modes along contact lines (c, 2, 3) [mm]: (c, u) sparse, a force of 1 that is spread evenly."""
    t = _spread(work, lines)
    c, count = len(lines), len(t)
    mean = scipy.sparse.csr_array((np.full(c * count, 1.0 / count), np.arange(c * count), np.arange(c + 1) * count))
    return scipy.sparse.csr_array(mean @ _modes_along(work, lines, t))


def displacements(work: CellWorkpiece, line: ArrayLike, points: ArrayLike) -> Array:
    """Displacement of points (n, 3) per force that is spread over a contact line (2, 3): (n, 3, 3) float [mm/N]."""
    ends = np.asarray(line, dtype=np.float64).reshape(1, 2, 3)
    w = _modes_along(work, ends, _spread(work, ends)).mean(axis=0)
    right = np.zeros((len(work.modes), 3, 3))
    for d in range(3):
        right[:, d, d] = w
    u = work.solve(right.reshape(-1, 3)).reshape(len(work.modes), 9)
    at = mode_weights(work, np.asarray(points, dtype=np.float64).reshape(-1, 3))
    return np.asarray((at @ u).reshape(-1, 3, 3))


def _spread(work: CellWorkpiece, ends: Array) -> Array:
    """Shares of contact lines (c, 2, 3) at which their force acts."""
    longest = float(np.linalg.norm(np.diff(work.grid.in_cells(ends), axis=1), axis=2).max())
    count = max(SPREAD, int(np.ceil(PER_CELL * longest)))
    return np.asarray((np.arange(count) + 0.5) / count)


def _modes_along(work: CellWorkpiece, ends: Array, t: Array) -> scipy.sparse.csr_array:
    """(c t, u) values of the modes at shares ``t`` of lines."""
    points = ends[:, None, 0] + t[:, None] * (ends[:, None, 1] - ends[:, None, 0])
    return mode_weights(work, points.reshape(-1, 3))


def _solve_lines(
    work: CellWorkpiece, loads: scipy.sparse.csr_array, stations: scipy.sparse.csr_array, some: NDArray[np.int64]
) -> Array:
    """(c, s, 3, 3) compliance of a few lines."""
    c, s, u = len(some), len(STATIONS), len(work.modes)
    dense = np.zeros((u, 3, c, 3))
    w = loads.T.toarray()
    for d in range(3):
        dense[:, d, :, d] = w
    right = dense.reshape(3 * u, 3 * c)
    rows = np.unique(stations[(some[:, None] * s + np.arange(s)).ravel()].indices)
    wanted = (3 * rows[:, None] + np.arange(3)).ravel()
    found = work.factors.solve(right[work.order], work.place[wanted]).reshape(len(rows), 3, c, 3)
    out = np.empty((c, s, 3, 3))
    for k, line in enumerate(some.tolist()):
        v = stations[line * s : (line + 1) * s][:, rows]
        out[k] = (v @ found[:, :, k].reshape(len(rows), 9)).reshape(s, 3, 3)
    return out
