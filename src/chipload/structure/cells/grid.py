"""A grid of box-shaped cells, the modes on it, and integrals of their products.

Notation: cell (i, j, k) lies between planes i and i + 1 along x, j and j + 1 along y, k and k + 1 along z; h its sides,
xi in -1..1 its local coordinates. The modes of one direction are N_0 = (1 - xi) / 2, N_p = (1 + xi) / 2 at the ends and
in between integrated Legendre polynomials (bubbles), which vanish at both ends; a mode of a cell is a product of three.
Mode a of cell i has the lattice number i p + a in its direction, so that neighbours share the modes of their common
face. P_m is the Legendre polynomial of degree m.

Any set of lattice modes is continuous over the cells. That allows cells deep inside thick material to keep only the
modes of their corners (order 1) next to cells of a higher order, without any constraint.

Reference: [Szabo1991] for the modes, [Parvizian2007] for the cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.number_text import number_text

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
#: one array of each direction
Planes = tuple[Array, Array, Array]

#: orders of the modes that can be used
ORDERS = (1, 2, 3)


#: of a workpiece: about 1 kB each for the moments, and the factors of their equations
MOST_CELLS = 500_000


@dataclass(frozen=True, eq=False)
class CellGrid:
    """Cells between planes along x, y and z.

    Parameters
    ----------
    planes : (n + 1,) float [mm] of each direction, rising
    order : p of the modes
    faces : those of the planes that stay where they are in a wider grid: ends, and flat faces of a part

    Raises
    ------
    InputError
        Planes do not rise, there is no cell, or the order is not one of :data:`ORDERS`.
    """

    planes: Planes
    order: int = 2
    faces: Planes | None = None

    def __post_init__(self) -> None:
        """Refuse planes and orders that make no grid."""
        for name, x in zip("xyz", self.planes, strict=True):
            if len(x) < 2 or not np.isfinite(x).all() or not (np.diff(x) > 0.0).all():
                raise InputError(f"cells: planes along {name} at {x.tolist()} mm: two at least, each above the last")
        if self.order not in ORDERS:
            raise InputError(f"cells of order {self.order}: must be 1, 2 or 3")

    @property
    def counts(self) -> tuple[int, int, int]:
        """Cells along x, y, z."""
        x, y, z = (len(v) - 1 for v in self.planes)
        return x, y, z

    @property
    def low(self) -> Array:
        """(3,) low corner [mm]."""
        return np.array([v[0] for v in self.planes])

    @property
    def high(self) -> Array:
        """(3,) high corner [mm]."""
        return np.array([v[-1] for v in self.planes])

    @property
    def widest(self) -> float:
        """Longest side of a cell [mm]."""
        return float(max(np.diff(v).max() for v in self.planes))

    @cached_property
    def volumes(self) -> Array:
        """Volumes of the cells (nx, ny, nz) [mm^3]."""
        x, y, z = (np.diff(v) for v in self.planes)
        return np.asarray(x[:, None, None] * y[:, None] * z)

    @property
    def lattice(self) -> tuple[int, int, int]:
        """Modes along x, y, z."""
        a, b, c = (n * self.order + 1 for n in self.counts)
        return a, b, c

    def sides(self, cells: Indices) -> Array:
        """Sides (n, 3) [mm] of cells (n, 3)."""
        return np.stack([np.diff(v)[cells[:, d]] for d, v in enumerate(self.planes)], axis=1)

    def points(self, cells: Indices, local: Array) -> Array:
        """Places (n, 3) [mm] of local coordinates (n, 3) of cells (n, 3)."""
        low = np.stack([v[cells[:, d]] for d, v in enumerate(self.planes)], axis=1)
        return np.asarray(low + 0.5 * (local + 1.0) * self.sides(cells))

    def in_cells(self, points: Array) -> Array:
        """Places (..., 3) [mm] counted in cells, within the grid."""
        return np.stack([np.interp(points[..., d], v, np.arange(len(v))) for d, v in enumerate(self.planes)], axis=-1)

    def cell_of(self, points: Array) -> tuple[Indices, Array]:
        """Cell of each point, (n, 3) int, and its local coordinates, (n, 3); points outside take the nearest cell."""
        cell = np.stack(
            [
                np.clip(np.searchsorted(v, points[:, d], side="right") - 1, 0, len(v) - 2)
                for d, v in enumerate(self.planes)
            ],
            axis=1,
        )
        low = np.stack([v[cell[:, d]] for d, v in enumerate(self.planes)], axis=1)
        return cell, 2.0 * (points - low) / self.sides(cell) - 1.0

    def modes_of(self, cells: Indices) -> Indices:
        """Lattice numbers of the modes of cells (n, 3): (n, (p + 1)^3) int."""
        q = np.arange(self.order + 1)
        local = np.stack(np.meshgrid(q, q, q, indexing="ij"), axis=-1).reshape(-1, 3)
        at = cells[:, None, :] * self.order + local
        _, ny, nz = self.lattice
        return np.asarray((at[..., 0] * ny + at[..., 1]) * nz + at[..., 2])

    def wider(self, times: float) -> CellGrid:
        """The grid with cells so many times as wide, between the same faces."""
        faces = self.faces or tuple(v[[0, -1]] for v in self.planes)
        return grid_between(faces, times * self.widest, self.order)  # type: ignore[arg-type]


def grid_over(low: ArrayLike, high: ArrayLike, cell_mm: float, order: int = 2) -> CellGrid:
    """The grid with the fewest equal cells over a box whose sides are at most ``cell_mm``.

    >>> grid_over((0, 0, 0), (10, 5, 4), 2.5).counts
    (4, 2, 2)
    """
    ends = np.array([low, high], dtype=np.float64)
    return grid_between((ends[:, 0], ends[:, 1], ends[:, 2]), cell_mm, order)


def grid_between(faces: Planes, cell_mm: float, order: int = 2) -> CellGrid:
    """The grid with the fewest cells between planes, equal from plane to plane, with sides of at most ``cell_mm``.

    Parameters
    ----------
    faces : (m,) float [mm] of each direction, rising

    Raises
    ------
    InputError
        The cells are too many.

    >>> ends = np.array([0.0, 10.0])
    >>> grid_between((np.array([0.0, 2.0, 10.0]), ends, ends), 5.0).planes[0].tolist()
    [0.0, 2.0, 6.0, 10.0]
    """
    if not cell_mm > 0.0:
        raise InputError(f"workpiece.cell_mm = {cell_mm:g}: must be above 0")
    counts = [cells_between(v, cell_mm) for v in faces]
    total = math.prod(int(n.sum()) for n in counts)
    if total > MOST_CELLS:
        raise InputError(
            f"workpiece.cell_mm = {cell_mm:g}: {number_text(total)} cells: must be at most {MOST_CELLS}: "
            "state larger cells"
        )
    x, y, z = (_divide_planes(v, n) for v, n in zip(faces, counts, strict=True))
    return CellGrid((x, y, z), order, faces)


def cells_between(planes: Array, cell_mm: float) -> Indices:
    """Fewest equal cells between planes (m,) whose sides are at most ``cell_mm``, (m - 1,) int."""
    return np.maximum(np.ceil(np.diff(planes) / cell_mm * (1.0 - 1e-9)), 1.0).astype(np.int64)


def _divide_planes(planes: Array, counts: Indices) -> Array:
    """Planes with ``counts`` equal cells between each and the next."""
    parts = [
        np.linspace(a, b, n + 1)[:-1] for (a, b), n in zip(pairwise(planes.tolist()), counts.tolist(), strict=True)
    ]
    return np.concatenate([*parts, planes[-1:]])


@cache
def _modes(order: int) -> tuple[Array, ...]:
    """Legendre coefficients of the modes of one direction."""
    out = [np.array([0.5, -0.5])]
    for k in range(2, order + 1):
        c = np.zeros(k + 1)
        c[k], c[k - 2] = 1.0, -1.0
        out.append(c / math.sqrt(2.0 * (2.0 * k - 1.0)))
    return (*out, np.array([0.5, 0.5]))


def mode_values(order: int, xi: Array) -> tuple[Array, Array]:
    """Values and derivatives of the modes of one direction at local coordinates (n,), (n, p + 1) each."""
    values = np.stack([legendre.legval(xi, c) for c in _modes(order)], axis=-1)
    slopes = np.stack([legendre.legval(xi, legendre.legder(c)) + 0.0 * xi for c in _modes(order)], axis=-1)
    return np.asarray(values, dtype=np.float64), np.asarray(slopes, dtype=np.float64)


def shape_values(grid: CellGrid, local: Array) -> Array:
    """Values of the modes of a cell at local coordinates (n, 3), (n, (p + 1)^3)."""
    x, y, z = (mode_values(grid.order, local[:, d])[0] for d in range(3))
    return np.asarray(np.einsum("ni,nj,nk->nijk", x, y, z).reshape(len(local), -1))


def shape_gradients(grid: CellGrid, local: Array) -> Array:
    """Slopes of the modes of a cell in its local coordinates (n, 3), (n, (p + 1)^3, 3): times 2 / h they are per mm."""
    both = [mode_values(grid.order, local[:, d]) for d in range(3)]
    out = []
    for d in range(3):
        f = [both[e][1 if e == d else 0] for e in range(3)]
        out.append(np.einsum("ni,nj,nk->nijk", *f).reshape(len(local), -1))
    return np.stack(out, axis=-1)


@cache
def _products(order: int) -> tuple[Array, Array, Array, Array]:
    """(p + 1, p + 1, 2 p + 1) Legendre coefficients of N_a N_b, N_a N_b', N_a' N_b, N_a' N_b'."""
    n = 2 * order + 1
    values = _modes(order)
    slopes = tuple(np.asarray(legendre.legder(c), dtype=np.float64) for c in values)

    def table(left: tuple[Array, ...], right: tuple[Array, ...]) -> Array:
        out = np.zeros((order + 1, order + 1, n))
        for a, u in enumerate(left):
            for b, v in enumerate(right):
                c = legendre.legmul(u, v)
                out[a, b, : len(c)] = c[:n]
        return out

    return table(values, values), table(values, slopes), table(slopes, values), table(slopes, slopes)


@cache
def product_tensors(order: int) -> tuple[Array, Array]:
    """Integrals of products of the modes of a cell from the moments of its material, in its local coordinates.

    Returns
    -------
    gradients : (n^3, m, m, 3, 3) float, with n = 2 p + 1 and m = (p + 1)^3 modes: times the moments M_klm of a cell
        they give the integral of dN_a/dxi_i dN_b/dxi_j over its material
    values : (n^3, m, m) float, likewise of N_a N_b
    """
    f, n, m = _products(order), 2 * order + 1, (order + 1) ** 3
    gradients = np.empty((n**3, m, m, 3, 3))
    for i in range(3):
        for j in range(3):
            x, y, z = (f[2 * (d == i) + (d == j)] for d in range(3))
            T = np.einsum("adk,bel,cfm->klmabcdef", x, y, z, optimize=True)
            gradients[..., i, j] = T.reshape(n**3, m, m)
    T = np.einsum("adk,bel,cfm->klmabcdef", f[0], f[0], f[0], optimize=True)
    values = T.reshape(n**3, m, m)
    gradients.flags.writeable = values.flags.writeable = False
    return gradients, values
