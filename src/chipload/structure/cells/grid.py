"""A grid of equal box-shaped cells, the modes on it, and integrals of their products.

Notation: cell (i, j, k) spans ``origin`` + (i, j, k) h; local coordinates xi in -1..1. The modes of one direction are
N_0 = (1 - xi) / 2, N_p = (1 + xi) / 2 at the ends and in between integrated Legendre polynomials (bubbles), which
vanish at both ends; a mode of a cell is a product of three. Mode a of cell i has the lattice number i p + a in its
direction, so that neighbours share the modes of their common face. P_m is the Legendre polynomial of degree m.

Any set of lattice modes is continuous over the cells. That allows cells deep inside thick material to keep only the
modes of their corners (order 1) beside cells of a higher order, without any constraint.

Reference: [Szabo1991] for the modes, [Parvizian2007] for the cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: orders of the modes that can be used
ORDERS = (1, 2, 3)


#: of a workpiece: about 1 kB each for the moments, and the factors of their equations
MOST_CELLS = 500_000


@dataclass(frozen=True, eq=False)
class CellGrid:
    """Equal cells over a box.

    Parameters
    ----------
    origin, size : (3,) float [mm], low corner of the box and sides of one cell
    counts : cells along x, y, z
    order : p of the modes

    Raises
    ------
    InputError
        A side is not above 0, a count is below 1, or the order is not one of :data:`ORDERS`.
    """

    origin: Array
    size: Array
    counts: tuple[int, int, int]
    order: int = 2

    def __post_init__(self) -> None:
        """Refuse what is no grid."""
        if not (np.isfinite(self.origin).all() and np.isfinite(self.size).all() and (self.size > 0.0).all()):
            raise InputError(f"cells of {self.size.tolist()} mm: each side must be above 0")
        if min(self.counts) < 1 or self.order not in ORDERS:
            raise InputError(f"cells {self.counts} of order {self.order}: at least one each, of order 1, 2 or 3")

    @property
    def lattice(self) -> tuple[int, int, int]:
        """Modes along x, y, z."""
        a, b, c = (n * self.order + 1 for n in self.counts)
        return a, b, c

    def cell_of(self, points: Array) -> tuple[Indices, Array]:
        """(n, 3) int cell of each point, and (n, 3) float its local coordinates; points outside take the nearest."""
        u = (points - self.origin) / self.size
        cell = np.clip(np.floor(u).astype(np.int64), 0, np.array(self.counts) - 1)
        return cell, 2.0 * (u - cell) - 1.0

    def modes_of(self, cells: Indices) -> Indices:
        """(n, (p + 1)^3) int lattice numbers of the modes of cells (n, 3)."""
        q = np.arange(self.order + 1)
        local = np.stack(np.meshgrid(q, q, q, indexing="ij"), axis=-1).reshape(-1, 3)
        at = cells[:, None, :] * self.order + local
        _, ny, nz = self.lattice
        return np.asarray((at[..., 0] * ny + at[..., 1]) * nz + at[..., 2])


def grid_over(low: ArrayLike, high: ArrayLike, cell_mm: float, order: int = 2) -> CellGrid:
    """The grid with the fewest equal cells over a box whose sides are at most ``cell_mm``.

    >>> grid_over((0, 0, 0), (10, 5, 4), 2.5).counts
    (4, 2, 2)
    """
    a, b = (np.asarray(v, dtype=np.float64) for v in (low, high))
    if not cell_mm > 0.0:
        raise InputError(f"workpiece.cell_mm = {cell_mm:g}: must be above 0")
    x, y, z = (max(math.ceil(s / cell_mm * (1.0 - 1e-9)), 1) for s in (b - a).tolist())
    if x * y * z > MOST_CELLS:
        raise InputError(
            f"workpiece.cell_mm = {cell_mm:g}: {x * y * z:.4g} cells: must be at most {MOST_CELLS}: state larger cells"
        )
    return CellGrid(a, (b - a) / (x, y, z), (x, y, z), order)


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
    """(n, p + 1) values and derivatives of the modes of one direction at local coordinates (n,)."""
    values = np.stack([legendre.legval(xi, c) for c in _modes(order)], axis=-1)
    slopes = np.stack([legendre.legval(xi, legendre.legder(c)) + 0.0 * xi for c in _modes(order)], axis=-1)
    return np.asarray(values, dtype=np.float64), np.asarray(slopes, dtype=np.float64)


def shape_values(grid: CellGrid, local: Array) -> Array:
    """(n, (p + 1)^3) values of the modes of a cell at local coordinates (n, 3)."""
    x, y, z = (mode_values(grid.order, local[:, d])[0] for d in range(3))
    return np.asarray(np.einsum("ni,nj,nk->nijk", x, y, z).reshape(len(local), -1))


def shape_gradients(grid: CellGrid, local: Array) -> Array:
    """(n, (p + 1)^3, 3) gradients [1/mm] of the modes of a cell."""
    both = [mode_values(grid.order, local[:, d]) for d in range(3)]
    out = []
    for d in range(3):
        f = [both[e][1 if e == d else 0] for e in range(3)]
        out.append(np.einsum("ni,nj,nk->nijk", *f).reshape(len(local), -1) * (2.0 / grid.size[d]))
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


def product_tensors(grid: CellGrid) -> tuple[Array, Array]:
    """Integrals of products of the modes of a cell from the moments of its material.

    Returns
    -------
    gradients : (n^3, m, m, 3, 3) float [mm], with n = 2 p + 1 and m = (p + 1)^3 modes: times the moments M_klm of a
        cell, in its local coordinates, gives the integral of dN_a/dx_i dN_b/dx_j over its material
    values : (n^3, m, m) float [mm^3], likewise of N_a N_b
    """
    f, n, m = _products(grid.order), 2 * grid.order + 1, (grid.order + 1) ** 3
    jacobian = float(np.prod(grid.size)) / 8.0
    gradients = np.empty((n**3, m, m, 3, 3))
    for i in range(3):
        for j in range(3):
            x, y, z = (f[2 * (d == i) + (d == j)] for d in range(3))
            T = np.einsum("adk,bel,cfm->klmabcdef", x, y, z, optimize=True)
            gradients[..., i, j] = T.reshape(n**3, m, m) * (4.0 * jacobian / (grid.size[i] * grid.size[j]))
    T = np.einsum("adk,bel,cfm->klmabcdef", f[0], f[0], f[0], optimize=True)
    return gradients, T.reshape(n**3, m, m) * jacobian
