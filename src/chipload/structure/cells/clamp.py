"""Clamps of a workpiece: regions in which its material is fixed, rigidly or by springs.

Notation: a clamp holds the material of the stock within an upright prism, in some of the directions x, y, z. Springs
are spread over that material: k_v = k / V [N/mm per mm^3], with the stiffness k of the whole clamp in each direction
and the volume V that it holds of the stock before the first cut. A stiff clamp has k_v = :data:`STIFF` E / (h d) with
the longest side h of a cell and its own least side d, at most h: far stiffer than the material beneath it. A face is a
thin slab of the stock along it.

Rigid motions: S (6, 6) is the stiffness of all clamps, each scaled to a total of 1, against translations and rotations
about the middle of the clamped material, with lengths divided by the diagonal of the stock. A motion with a stiffness
below :data:`LOOSE` is free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.assembly import CellModes, springs
from chipload.structure.cells.grid import Array, CellGrid
from chipload.structure.cells.moments import StockRegion, stock_moments

#: k_v h d / E of a stiff clamp
STIFF = 1e4
#: least eigenvalue of S of a clamped workpiece
LOOSE = 1e-8
#: names of the rigid motions
MOTIONS = tuple(f"{kind} {axis}" for kind in ("motion along", "rotation about") for axis in "xyz")


@dataclass(frozen=True, eq=False)
class Clamp:
    """Region of the stock that is fixed.

    Parameters
    ----------
    name : name of the clamp in messages
    region : region of the stock
    directions : (3,) bool, fixed directions among x, y, z
    stiffness : [N/mm] of the whole clamp in each of them; inf: stiff
    """

    name: str
    region: StockRegion
    directions: NDArray[np.bool_]
    stiffness: float = np.inf

    def __post_init__(self) -> None:
        """Refuse a clamp that holds nothing."""
        if not self.stiffness > 0.0 or not self.directions.any():
            raise InputError(f"{self.name}: a clamp holds at least one direction with a stiffness above 0")


@dataclass(frozen=True, eq=False)
class ClampStiffness:
    """Springs of clamps in the modes of a workpiece.

    Attributes
    ----------
    matrix : (3 u, 3 u) sparse [N/mm]
    volumes : (c,) float [mm^3] that each clamp holds now
    rigid : (6, 6) float, S
    cells : (nx, ny, nz) bool, cells with clamped material
    """

    matrix: scipy.sparse.bsr_array
    volumes: Array
    rigid: Array
    cells: NDArray[np.bool_]


def clamp_stiffness(
    clamps: Sequence[Clamp],
    stock: LayeredStock,
    grid: CellGrid,
    modes: CellModes,
    modulus: float,
    first: Sequence[float] | None = None,
) -> ClampStiffness:
    """Stiffness of the springs of all clamps in the modes of a workpiece.

    Parameters
    ----------
    modulus : [MPa] of the workpiece
    first : (c,) [mm^3] volume in each clamp before the first cut; None: the present volume

    Raises
    ------
    InputError
        A clamp holds no material, or a rigid motion is free.
    """
    count = 3 * len(modes)
    whole, cells = scipy.sparse.bsr_array((count, count), blocksize=(3, 3)), np.zeros(grid.counts, dtype=np.bool_)
    volumes, unit = [], []
    for k, clamp in enumerate(clamps):
        moments = stock_moments(stock, grid, clamp.region)
        volume = float((moments[..., 0, 0, 0] * grid.volumes).sum() / 8.0)
        if not volume > 0.0:
            x0, y0, x1, y1 = clamp.region.outline.bounds
            cut = first is not None and first[k] > 0.0
            raise InputError(
                f"{clamp.name}: holds nothing{' after the program has cut it away' if cut else ''}: no stock between "
                f"({x0:g}, {y0:g}, {clamp.region.low:g}) and ({x1:g}, {y1:g}, {clamp.region.high:g}) mm: place it on "
                f"{'what is left of the stock' if cut else 'the stock'}"
            )
        fixed = np.diag(clamp.directions.astype(np.float64))
        size = grid.widest
        per_volume = STIFF * modulus / (size * min(size, clamp.region.thickness(stock)))
        if np.isfinite(clamp.stiffness):
            per_volume = clamp.stiffness / (volume if first is None else first[k])
        one = springs(grid, modes, moments, fixed)
        whole = whole + per_volume * one
        cells |= moments[..., 0, 0, 0] > 0.0
        volumes.append(volume)
        unit.append(one / volume)
    R = rigid_motions(grid, modes, _middle(grid, cells))
    S = sum((R.T @ (one @ R) for one in unit), np.zeros((6, 6)))
    require_clamped(S)
    return ClampStiffness(whole, np.array(volumes), S, cells)


def require_clamped(S: Array) -> None:
    """Refuse a workpiece that can move as a rigid body.

    Raises
    ------
    InputError
        A rigid motion has no stiffness; the message names it.
    """
    values, vectors = np.linalg.eigh(S)
    free = vectors[:, values < LOOSE]
    if free.shape[1]:
        part = (free**2).sum(axis=1)
        named = [MOTIONS[k] for k in np.argsort(-part, kind="stable")[: free.shape[1]]]
        raise InputError(
            f"workpiece.clamp: {', '.join(named)} {'is' if len(named) == 1 else 'are'} free: add a clamp that holds "
            f"{'it' if len(named) == 1 else 'them'}"
        )


def rigid_motions(grid: CellGrid, modes: CellModes, about: Array) -> Array:
    """(3 u, 6) float coefficients of three translations and three rotations; rotations per diagonal of the grid."""
    at = modes.lattice
    vertex = (at % grid.order == 0).all(axis=1)
    scale = float(np.linalg.norm(grid.high - grid.low))
    corner = np.stack([v[at[:, d] // grid.order] for d, v in enumerate(grid.planes)], axis=1)
    x = np.where(vertex[:, None], (corner - about) / scale, 0.0)
    out = np.zeros((len(modes), 3, 6))
    for d in range(3):
        out[vertex, d, d] = 1.0
        e, f = (d + 1) % 3, (d + 2) % 3
        out[:, e, 3 + d], out[:, f, 3 + d] = -x[:, f], x[:, e]
    return out.reshape(-1, 6)


def _middle(grid: CellGrid, cells: NDArray[np.bool_]) -> Array:
    """Middle [mm] of the clamped cells."""
    at = np.argwhere(cells)
    ends = zip(grid.planes, at.min(axis=0).tolist(), at.max(axis=0).tolist(), strict=True)
    return np.array([0.5 * (v[a] + v[b + 1]) for v, a, b in ends])
