"""How sure a force is: the standard deviation that the coefficients' own errors give it.

Notation: K = (Ktc, Krc, Kac, Kte, Kre, Kae) with the covariance C (6, 6); a load L (force along T, n, the axis, and
torque) is linear in K: L = B K, B (4, 6) the loads of unit coefficients, so that cov(L) = B C B', exactly.

A fitted material has its C. One of which only a spread is known, sigma / K the same for all, is taken to have
coefficients that err each by itself: C = diag(spread^2 K^2). Real errors hang together, and then the band is wider or
narrower. Exponents of a size effect, runout and the engagement are taken as sure.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting import _kernels
from chipload.cutting.force import in_work
from chipload.cutting.material import Material
from chipload.engagement.bites import Bites

Floats = NDArray[np.float64]


def mean_band(
    bites: Bites, cutter: Cutter, material: Material, frame: ArrayLike | None = None
) -> tuple[Floats, Floats]:
    """Standard deviation of the mean force and torque.

    Parameters
    ----------
    bites, cutter, material : as :func:`chipload.cutting.force.mean_forces`; the material with a spread or a covariance
    frame : (n, 3, 3) float, see :func:`chipload.cutting.force.in_work`; None: along T, n and the axis

    Returns
    -------
    force : (n, 3) float [N]
    torque : (n,) float [N mm]

    Raises
    ------
    InputError
        The material says neither.

    Examples
    --------
    A full slot with two teeth, N depth Ktc f_z / 4 = 100 N across the feed, from a Ktc that is known to 10 %.

    >>> import math
    >>> from chipload.engagement.bites import bites_of_arcs
    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.1)
    >>> force, torque = mean_band(bites_of_arcs([0.0], [math.pi], 0.1, mill, 2.0), mill, plain)
    >>> force[0].round(9).tolist()
    [0.0, 10.0, 0.0]
    """
    deviation = deviations(mean_basis(bites, cutter, material, frame), material)
    return deviation[:, :3], deviation[:, 3]


def mean_basis(bites: Bites, cutter: Cutter, material: Material, frame: ArrayLike | None = None) -> Floats:
    """B of the mean loads, (n, 4, 6): force and torque for 1 of each coefficient; for the band of a sum add B first."""
    basis = np.zeros((len(bites), 4, 6))
    for k, law in enumerate(_unit_laws(material)):
        out = np.zeros((len(bites), 4))
        _kernels.means(bites.start, bites.rows, bites.tooth, bites.slice, bites.slices, cutter.flutes, law, out)
        basis[:, :, k] = out
    return basis if frame is None else _turned(basis, frame)


def deviations(basis: Floats, material: Material) -> Floats:
    """Roots of the diagonal of B C B' for B (..., 4, 6): standard deviations (..., 4)."""
    variance = np.einsum("...ik,kl,...il->...i", basis, material.variances, basis)
    return np.asarray(np.sqrt(np.clip(variance, 0.0, None)))


def band_over_turn(
    bites: Bites, cutter: Cutter, material: Material, theta: ArrayLike, frame: ArrayLike | None = None
) -> tuple[Floats, Floats]:
    """Standard deviation of force and torque at given rotations.

    Parameters
    ----------
    bites, cutter, material, theta : as :func:`chipload.cutting.force.forces_over_turn`
    frame : as :func:`mean_band`

    Returns
    -------
    force : (n, m, 3) float [N]
    torque : (n, m) float [N mm]
    """
    angles = np.ascontiguousarray(theta, dtype=np.float64)
    basis = np.zeros((len(bites), len(angles), 4, 6))
    for k, law in enumerate(_unit_laws(material)):
        out = np.zeros((len(bites), len(angles), 4))
        rows = (bites.start, bites.rows, bites.tooth, bites.slice, bites.slices)
        _kernels.turn_of(*rows, angles, cutter.flutes, law, out)
        basis[..., k] = out
    deviation = deviations(basis if frame is None else _turned(basis, frame), material)
    return deviation[..., :3], deviation[..., 3]


def _unit_laws(material: Material) -> Floats:
    """Laws of one coefficient at a time, 1 each, with the material's exponents: (6, 9)."""
    return np.column_stack([np.eye(6), np.broadcast_to(material.exponents, (6, 3))])


def _turned(basis: Floats, frame: ArrayLike) -> Floats:
    """B with its forces turned into ``frame``."""
    for k in range(6):
        basis[..., :3, k] = in_work(basis[..., :3, k], frame)
    return basis
