"""Forces of the residual stress of a plate in the cells of what is left of it, and bodies that lie free.

Notation: sigma_0 the stress of the uncut plate; what is left is in equilibrium at the displacements u of

    K u = f,  f_ai = - integral of dN_a/dx_i sigma_0,ii dV,  i = x, y.

sigma_0 depends on the height alone, and a layer is a prism: so the integral is that of the plane over the section times
that of the height over the layer, and it is exact for a stress that is linear between points. N_a are products of
modes of one direction, of order p, so Legendre polynomials up to degree p suffice.

A free body is held at six degrees of freedom that no deformation needs: forces in equilibrium cause no reaction there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.stock.layers import LayeredStock
from chipload.structure.cells.assembly import LEAST_SHARE, CellModes, modes_of, shares, stiffness
from chipload.structure.cells.clamp import rigid_motions
from chipload.structure.cells.grid import Array, CellGrid, Indices, mode_values
from chipload.structure.cells.moments import alike, section_moments, stock_moments
from chipload.structure.cells.nearest import StockSections
from chipload.structure.cells.workpiece import CellBody, CellWorkpiece, Elastic, factor_modes
from chipload.structure.stress_profile import StressProfile


@dataclass(frozen=True, eq=False)
class LayerSections:
    """Layers of a stock that share a section, with the moments of that section.

    Attributes
    ----------
    low, high : (s,) float [mm] their heights
    moments : (s, nx, ny, p + 1, p + 1) float
    """

    low: Array
    high: Array
    moments: Array


def layer_sections(stock: LayeredStock, grid: CellGrid) -> LayerSections:
    """Sections of a stock, those of layers that share their polygons once."""
    lows, highs, moments, low = list[float](), list[float](), list[Array](), 0
    n = grid.order + 1
    while low < stock.layers:
        high = low + 1
        while high < stock.layers and alike(stock, high):
            high += 1
        lows.append(float(stock.bounds[low]))
        highs.append(float(stock.bounds[high]))
        moments.append(section_moments(stock.tiles[low].ravel(), grid)[:, :, :n, :n])
        low = high
    return LayerSections(np.array(lows), np.array(highs), np.array(moments))


def stress_forces(
    layers: LayerSections, grid: CellGrid, modes: CellModes, profiles: Sequence[StressProfile], underside: float
) -> Array:
    """Forces of stress profiles in the modes of what is left of a plate, (3 u, q) float [N].

    Parameters
    ----------
    profiles : q of them
    underside : height [mm] of the underside of the plate in the frame of the stock
    """
    n, u = grid.order + 1, len(modes)
    values, slopes = _legendre_of_modes(grid.order)
    x, y, z = modes.cells.T
    hx, hy, hz = grid.sides(modes.cells).T
    out = np.zeros((3 * u, len(profiles)))
    some = modes.number >= 0
    for q, profile in enumerate(profiles):
        S = np.zeros((2, *grid.counts, n, n, n))
        for low, high, plane in zip(layers.low, layers.high, layers.moments, strict=True):
            first, heights = _height_integrals(grid, low, high, profile, underside)
            if heights.shape[1]:
                S[:, :, :, first : first + heights.shape[1]] += np.einsum("xykl,dzm->dxyzklm", plane, heights)
        own = S[:, x, y, z]
        for d, (f, g, side) in enumerate(((slopes, values, hy * hz / 4.0), (values, slopes, hx * hz / 4.0))):
            # dV = hx hy hz / 8 in local coordinates, dN/dx = 2 / hx dN/dxi
            part = np.einsum("ak,bl,cm,eklm->eabc", f, g, values, own[d], optimize=True) * -side[:, None, None, None]
            np.add.at(out[d::3, q], modes.number[some], part.reshape(len(x), -1)[some])
    return out


def _legendre_of_modes(order: int) -> tuple[Array, Array]:
    """(p + 1, p + 1) coefficients of the modes of one direction, and of their slopes."""
    at, weight = legendre.leggauss(order + 1)
    P = np.stack([legendre.legval(at, np.eye(order + 1)[m]) for m in range(order + 1)], axis=1)
    project = (P * weight[:, None]) * (2.0 * np.arange(order + 1) + 1.0) / 2.0
    values, slopes = mode_values(order, at)
    return np.asarray(values.T @ project), np.asarray(slopes.T @ project)


def _height_integrals(
    grid: CellGrid, low: float, high: float, profile: StressProfile, underside: float
) -> tuple[int, Array]:
    """The first cell along z that a slice meets, and (2, c, p + 1) integrals of P_m sigma over the slice in each."""
    n, planes = grid.order + 1, grid.planes[2]
    between = planes[(planes > low) & (planes < high)]
    heights = profile.height + underside
    breaks = np.unique(np.concatenate([[low, high], between, heights[(heights > low) & (heights < high)]]))
    # a polynomial of degree p times a line
    at, weight = legendre.leggauss(grid.order + 1)
    half = 0.5 * np.diff(breaks)
    z = (0.5 * (breaks[1:] + breaks[:-1]))[:, None] + half[:, None] * at
    cell = np.clip(np.searchsorted(planes, z[:, 0], side="right") - 1, 0, len(planes) - 2)
    size = planes[cell + 1] - planes[cell]
    local = 2.0 * (z - planes[cell][:, None]) / size[:, None] - 1.0
    stress = np.stack(profile.at(z.ravel() - underside)).reshape(2, *z.shape)
    P = np.stack([legendre.legval(local, np.eye(n)[m]) for m in range(n)], axis=-1)
    part = np.einsum("dsg,sgm,g,s->dsm", stress, P, weight, 2.0 * half / size)
    first = int(cell[0])
    out = np.zeros((2, int(cell[-1]) - first + 1, n))
    for d in range(2):
        np.add.at(out[d], cell - first, part[d])
    return first, out


@dataclass(frozen=True, eq=False)
class FreeBody:
    """What is left of a plate, lying free.

    Attributes
    ----------
    stock : what is left
    grid, modes, share, sections : see :class:`chipload.structure.cells.workpiece.CellWorkpiece`
    forces : (3 u, q) float [N] of q stress profiles in its modes
    moved : (3 u, q) float [mm] displacement of its modes
    """

    stock: LayeredStock
    grid: CellGrid
    modes: CellModes
    share: Array
    sections: StockSections
    forces: Array
    moved: Array


def free_body(
    stock: LayeredStock, grid: CellGrid, elastic: Elastic, profiles: Sequence[StressProfile], underside: float
) -> FreeBody:
    """What is left of a plate, in equilibrium; its factors are not kept.

    Raises
    ------
    InputError
        It is in several pieces.
    """
    work = free_workpiece(stock, grid, elastic)
    forces = stress_forces(layer_sections(stock, grid), grid, work.modes, profiles, underside)
    # few right-hand sides: SuperLU's own solution needs no copy of its factors
    moved = np.column_stack([work.solve(f) for f in forces.T])
    return FreeBody(stock, grid, work.modes, work.share, work.sections, forces, moved)


def free_workpiece(stock: LayeredStock, grid: CellGrid, elastic: Elastic) -> CellWorkpiece:
    """A stock that lies free, factored; forces on it must be in equilibrium.

    Raises
    ------
    InputError
        It is in several pieces.
    """
    moments = stock_moments(stock, grid)
    share = shares(moments)
    modes = modes_of(grid, share)
    bodies, count = scipy.ndimage.label(share > LEAST_SHARE)
    if count != 1:
        sizes = sorted((float((share * grid.volumes)[bodies == k + 1].sum()) for k in range(count)), reverse=True)
        listed = ", ".join(f"{v:.6g}" for v in sizes[:4])
        raise InputError(
            f"residual_stress: what is left is in {count} pieces of {listed} mm3: state setups that leave one body"
        )
    K = stiffness(grid, modes, moments, elastic.modulus, elastic.poisson)
    springs = np.zeros(3 * len(modes))
    springs[_six_of(grid, modes, share)] = elastic.modulus * grid.widest
    u = len(modes)
    held = springs.reshape(u, 3, 1) * np.eye(3)
    K = K + scipy.sparse.bsr_array((held, np.arange(u), np.arange(u + 1)), shape=K.shape)
    factors, order, place = factor_modes(grid, modes, K)
    volume = float((share * grid.volumes).sum())
    return CellWorkpiece(
        grid, modes, share, K, factors, order, place, volume, 0.0, np.zeros(0), StockSections(stock), None
    )


def _six_of(grid: CellGrid, modes: CellModes, share: Array) -> Indices:
    """Six degrees of freedom of corners of full cells that hold every rigid motion, as far apart as can be."""
    full = modes.cells[share[tuple(modes.cells.T)] >= 0.5 * share.max()]
    corners = np.unique((full[:, None] + np.indices((2, 2, 2)).reshape(3, -1).T).reshape(-1, 3), axis=0) * grid.order
    _, ny, nz = grid.lattice
    number = (modes.lattice[:, 0] * ny + modes.lattice[:, 1]) * nz + modes.lattice[:, 2]
    at = np.searchsorted(number, (corners[:, 0] * ny + corners[:, 1]) * nz + corners[:, 2])
    about = 0.5 * (grid.low + grid.high)
    motions = rigid_motions(grid, modes, about)
    candidates = (3 * at[:, None] + np.arange(3)).ravel()
    _, _, pivot = scipy.linalg.qr(motions[candidates].T, mode="economic", pivoting=True)
    return np.asarray(candidates[pivot[:6]])


def displacements_of_modes(work: CellBody, other: CellBody, u: Array) -> Array:
    """Displacements (3 u, q) of the modes of a body taken over to those of another in the same grid.

    A mode that the first does not have is 0: a corner that it does not have moves with nothing.
    """
    _, ny, nz = work.grid.lattice
    mine, theirs = ((m[:, 0] * ny + m[:, 1]) * nz + m[:, 2] for m in (work.modes.lattice, other.modes.lattice))
    at = np.clip(np.searchsorted(mine, theirs), 0, len(mine) - 1)
    found = mine[at] == theirs
    rows = u.reshape(len(mine), 3, -1)[at]
    rows[~found] = 0.0
    return np.asarray(rows.reshape(3 * len(theirs), -1))
