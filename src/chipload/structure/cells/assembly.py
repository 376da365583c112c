"""Stiffness and mass of the material in cells: sums of fixed tensors times moments.

Notation: M (e, n^3) moments of the active cells, V and h their volumes and sides, alpha the share of stiffness that
the empty part of a cut cell keeps; a, b modes of a cell, i, j directions; G_ab,ij the integral of dN_a/dx_i dN_b/dx_j,
V / (2 h_i h_j) of that in local coordinates; la, mu the constants of Lame. Then
K_ai,bj = la G_ij + mu G_ji + mu delta_ij trace(G).

Cells of thick material keep only the modes of their corners: where a block of :data:`BULK` cells in each direction is
full, and no other cell touches it, the error of order 1 is below that of the thin walls (docs/design/workpiece.md).

Reference: [Parvizian2007] for alpha; [Duester2008].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule, scipy
from chipload.structure.cells.grid import Array, CellGrid, Indices, product_tensors

_assembly = LateModule("chipload.structure.cells._assembly")

#: stiffness of the empty part of a cut cell over that of the material
ALPHA = 1e-9
#: share of material below which a cell is left out
LEAST_SHARE = 1e-6
#: cells along each side of a full block that keep the modes of their corners only
BULK = 4
#: least share of material of a full cell
FULL = 1.0 - 1e-9
#: greatest number of modes of a structure, three directions each
MOST_MODES = 150_000


@dataclass(frozen=True, eq=False)
class CellModes:
    """Numbering of the modes of a workpiece.

    Attributes
    ----------
    cells : (e, 3) int, active cells
    number : (e, m) int, number of each of their modes; -1: not used
    lattice : (u, 3) int, place of each mode in the lattice, in the order of the numbers
    """

    cells: Indices
    number: Indices
    lattice: Indices

    def __len__(self) -> int:
        return len(self.lattice)


def shares(moments: Array) -> Array:
    """Share of material of each cell, (nx, ny, nz)."""
    return np.asarray(moments[..., 0, 0, 0] / 8.0)


def modes_of(grid: CellGrid, share: Array, bulk: int = BULK, *, limited: bool = True) -> CellModes:
    """The modes of the cells that hold material.

    Parameters
    ----------
    share : (nx, ny, nz) of material
    bulk : see :data:`BULK`; 0: every mode is used
    limited : refuse more than :data:`MOST_MODES`

    Raises
    ------
    InputError
        There are more than :data:`MOST_MODES`.
    """
    active = share > LEAST_SHARE
    cells = np.argwhere(active)
    numbers = grid.modes_of(cells)
    used = np.ones(numbers.shape, dtype=np.bool_)
    if bulk > 0 and grid.order > 1:
        deep = scipy.ndimage.binary_opening(share >= FULL, np.ones((bulk,) * 3, dtype=np.bool_))
        # what stands on it bends its surface
        deep &= ~scipy.ndimage.binary_dilation(active & ~deep, np.ones((3, 3, 3), dtype=np.bool_))
        used = ~deep[active][:, None] | _corners(grid.order)
    kept = np.unique(numbers[used])
    if limited and len(kept) > MOST_MODES:
        raise InputError(
            f"workpiece: {3 * len(kept)} unknowns in cells of at most {grid.widest:.4g} mm: at most "
            f"{3 * MOST_MODES}: state a larger workpiece.cell_mm"
        )
    at = np.searchsorted(kept, numbers)
    at[at == len(kept)] = 0
    number = np.where(kept[at] == numbers, at, -1)
    return CellModes(cells, number, np.stack(np.unravel_index(kept, grid.lattice), axis=1))


def _corners(order: int) -> NDArray[np.bool_]:
    """(m,) which modes of a cell belong to a corner."""
    end = np.isin(np.arange(order + 1), (0, order))
    return np.asarray((end[:, None, None] & end[:, None] & end).ravel())


def stiffness(
    grid: CellGrid, modes: CellModes, moments: Array, modulus: float, poisson: float, alpha: float = ALPHA
) -> scipy.sparse.bsr_array:
    """(3 u, 3 u) sparse stiffness [N/mm], all three directions of a mode side by side.

    Parameters
    ----------
    moments : (nx, ny, nz, n, n, n), see :func:`chipload.structure.cells.moments.stock_moments`
    modulus, poisson : [MPa], of the material
    alpha : see :data:`ALPHA`
    """
    la, mu = modulus * poisson / (1.0 + poisson) / (1.0 - 2.0 * poisson), modulus / 2.0 / (1.0 + poisson)
    gradients, _ = product_tensors(grid.order)
    M = _cells_of(moments, modes)
    M *= 1.0 - alpha
    M[:, 0] += 8.0 * alpha
    slopes = 2.0 / grid.sides(modes.cells)
    scale = _volumes(grid, modes)[:, None, None] / 8.0 * slopes[:, :, None] * slopes[:, None, :]

    def law(G: Array, own: Indices) -> Array:
        G = G * scale[own, None]
        trace = mu * np.einsum("eaii->ea", G)
        out = la * G + mu * G.swapaxes(2, 3)
        for i in range(3):
            out[..., i, i] += trace
        return out

    return _assemble_cells(modes, M, gradients, law)


def springs(grid: CellGrid, modes: CellModes, moments: Array, per_volume: Array) -> scipy.sparse.bsr_array:
    """(3 u, 3 u) sparse stiffness [N/mm] of springs in the material.

    Parameters
    ----------
    moments : of the material that the springs hold
    per_volume : (3, 3) float [N/mm per mm^3]
    """
    _, values = product_tensors(grid.order)
    M = _cells_of(moments, modes) * (_volumes(grid, modes) / 8.0)[:, None]
    return _assemble_cells(modes, M, values, lambda N, own: N[..., None, None] * per_volume)


def mass(grid: CellGrid, modes: CellModes, moments: Array, density: float) -> scipy.sparse.bsr_array:
    """(3 u, 3 u) sparse mass [t]; ``density`` [t/mm^3]."""
    return springs(grid, modes, moments, density * np.eye(3))


def _cells_of(moments: Array, modes: CellModes) -> Array:
    """(e, n^3) moments of the active cells."""
    x, y, z = modes.cells.T
    return np.array(moments[x, y, z].reshape(len(modes.cells), -1))


def _volumes(grid: CellGrid, modes: CellModes) -> Array:
    """(e,) volumes [mm^3] of the active cells."""
    return np.asarray(grid.volumes[tuple(modes.cells.T)])


def _assemble_cells(
    modes: CellModes, M: Array, tensors: Array, law: Callable[[Array, Indices], Array]
) -> scipy.sparse.bsr_array:
    """The sum over cells of blocks (e, m, 3, 3) that ``law`` makes of M (e, n^3) times ``tensors`` (n^3, m, m, ...).

    Parameters
    ----------
    law : is also given the numbers of the cells
    """
    some = np.flatnonzero(M.any(axis=1))
    M, number, u = M[some], modes.number[some], len(modes)
    m = number.shape[1]
    meets = scipy.sparse.csr_array(
        (np.ones(int((number >= 0).sum())), number[number >= 0], np.append(0, np.cumsum((number >= 0).sum(axis=1)))),
        shape=(len(number), u),
    )
    pattern = scipy.sparse.csr_array(meets.T @ meets)
    pattern.sort_indices()
    indptr, indices = pattern.indptr, pattern.indices
    data = np.zeros((len(indices), 3, 3))
    for a in range(m):
        part = tensors[:, a, a:]
        blocks = law((M @ part.reshape(len(part), -1)).reshape(len(M), *part.shape[1:]), some)
        _assembly.add_blocks(number, a, np.ascontiguousarray(blocks), indptr, indices, data)
    return scipy.sparse.bsr_array((data, indices, indptr), shape=(3 * u, 3 * u))
