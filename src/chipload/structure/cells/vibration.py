"""Natural frequencies and mode shapes of a clamped workpiece in cells.

Notation: K (3 u, 3 u) stiffness, M (3 u, 3 u) mass of the material, of the same moments; K x = w^2 M x, w [rad/s],
x^T M x = 1 t. Lanczos on K^-1 M uses the factors that the compliance has already.

A clamp has no mass and no damping. Modes above those requested count as rigid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.structure.cells.grid import Array, Indices
from chipload.structure.cells.workpiece import CellWorkpiece, line_means

#: relative error of w^2 at which Lanczos stops
TOLERANCE = 1e-7
#: greatest number of iterations of Lanczos
ITERATIONS = 400


@dataclass(frozen=True, eq=False)
class VibrationModes:
    """Lowest modes of one state of a workpiece.

    Attributes
    ----------
    frequency : (m,) float [Hz], rising
    lattice : (u,) int, rising, lattice numbers of the modes of the cells
    shapes : (u, 3, m) float [1/sqrt(t)], x of each
    momenta : (u, 3, m) float [sqrt(t)], M x of each
    """

    frequency: Array
    lattice: Indices
    shapes: Array
    momenta: Array


def vibration_modes(work: CellWorkpiece, count: int) -> VibrationModes:
    """The lowest modes, O(3 count) solutions.

    Raises
    ------
    InputError
        The workpiece has no density, or fewer modes than requested.
    """
    if work.mass is None:
        raise InputError("workpiece.density_kg_m3: missing: modes need the mass of the workpiece")
    u = len(work.modes)
    if not 1 <= count < 3 * u - 1:
        raise InputError(f"workpiece: {count} modes of {3 * u} unknowns: must be from 1 to {3 * u - 2}")
    inverse = scipy.sparse.linalg.LinearOperator(
        work.stiffness.shape, matvec=lambda x: work.solve(np.asarray(x).reshape(-1, 1))[:, 0], dtype=np.float64
    )
    begin = np.random.default_rng(0).standard_normal(3 * u)
    try:
        values, vectors = scipy.sparse.linalg.eigsh(
            work.stiffness, k=count, M=work.mass, sigma=0.0, OPinv=inverse, v0=begin, tol=TOLERANCE, maxiter=ITERATIONS
        )
    except scipy.sparse.linalg.ArpackNoConvergence:
        raise InputError("workpiece: its modes were not found: state a larger workpiece.cell_mm") from None
    rising = np.argsort(values)
    values, vectors = values[rising], vectors[:, rising]
    vectors = vectors / np.sqrt(np.einsum("um,um->m", vectors, work.mass @ vectors))
    momenta = np.asarray(work.mass @ vectors)
    lattice = np.ravel_multi_index(tuple(work.modes.lattice.T), work.grid.lattice)
    frequency = np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)
    return VibrationModes(
        frequency, np.asarray(lattice, dtype=np.int64), vectors.reshape(u, 3, count), momenta.reshape(u, 3, count)
    )


def shapes_along(work: CellWorkpiece, found: VibrationModes, lines: Array) -> Array:
    """Mean of mode shapes along contact lines (c, 2, 3) [mm], as a force is spread: (c, 3, m) float [1/sqrt(t)]."""
    if not len(lines):
        return np.zeros((0, 3, len(found.frequency)))
    mean = line_means(work, lines)
    return np.asarray((mean @ found.shapes.reshape(len(work.modes), -1)).reshape(len(lines), 3, -1))


def overlap(a: VibrationModes, b: VibrationModes) -> Array:
    """Products x_a^T M_b x_b, (m, m) float: agreement of the modes of state a with those of state b of the same cells,
    with sign.
    """
    _, p, q = np.intersect1d(a.lattice, b.lattice, assume_unique=True, return_indices=True)
    return np.asarray(np.einsum("udi,udj->ij", a.shapes[p], b.momenta[q]))
