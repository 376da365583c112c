"""Standard deviation of force and torque that results from the errors of the force coefficients.

Notation: K = (Ktc, Krc, Kac, Kte, Kre, Kae) with the covariance C (6, 6); a load L (force along T, n, the axis, and
torque) is linear in K: L = B K, B (4, 6) the loads of unit coefficients, so that cov(L) = B C B', exactly.

A fitted material has its own C. If only a spread sigma / K is known, the same for all coefficients, their errors have
the correlation of :data:`chipload.cutting.material.CORRELATION`. The exponents of a size effect, runout and engagement
are taken as exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.lazy import LateModule

_tooth_force = LateModule("chipload.cutting._tooth_force")
bases = LateModule("chipload.cutting._unit_loads")

Floats = NDArray[np.float64]


def mean_band(
    engagement: ToothEngagement, cutter: Cutter, material: Material, frame: ArrayLike | None = None
) -> tuple[Floats, Floats]:
    """Return the standard deviation of the mean force and torque.

    Parameters
    ----------
    engagement, cutter, material : as :func:`chipload.cutting.force.mean_forces`; the material with a spread or a
        covariance
    frame : (n, 3, 3) float, see :func:`chipload.cutting.force.in_work`; None: along T, n and the axis

    Returns
    -------
    force : (n, 3) float [N]
    torque : (n,) float [N mm]

    Raises
    ------
    InputError
        The material states neither.

    Examples
    --------
    A full slot with two teeth, N depth Ktc f_z / 4 = 100 N across the feed, from a Ktc that is known to 10 %.

    >>> import math
    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.1)
    >>> force, torque = mean_band(engagement_of_arcs([0.0], [math.pi], 0.1, mill, 2.0), mill, plain)
    >>> force[0].round(9).tolist()
    [0.0, 10.0, 0.0]
    """
    deviation = deviations(mean_basis(engagement, cutter, material, frame), material)
    return deviation[:, :3], deviation[:, 3]


def mean_basis(
    engagement: ToothEngagement, cutter: Cutter, material: Material, frame: ArrayLike | None = None
) -> Floats:
    """Return B (n, 4, 6) of the mean loads: loads for 1 of each coefficient; B of a sum of loads is the sum of B."""
    basis = np.zeros((len(engagement), 4, 6))
    rows = (engagement.start, engagement.rows, engagement.tooth, engagement.slice, engagement.slices)
    if not any(material.exponents):
        bases.mean_bases(*rows, cutter.flutes, basis)
    else:
        for k, law in enumerate(_unit_laws(material)):
            out = np.zeros((len(engagement), 4))
            _tooth_force.means(*rows, cutter.flutes, law, out)
            basis[:, :, k] = out
    return basis if frame is None else turned_basis(basis, frame)


def deviations(basis: Floats, material: Material) -> Floats:
    """Return standard deviations (..., 4): the roots of the diagonal of B C B' for B (..., 4, 6)."""
    variance = np.einsum("...ik,kl,...il->...i", basis, material.variances, basis)
    return np.asarray(np.sqrt(np.clip(variance, 0.0, None)))


def band_over_turn(
    engagement: ToothEngagement, cutter: Cutter, material: Material, theta: ArrayLike, frame: ArrayLike | None = None
) -> tuple[Floats, Floats]:
    """Return the standard deviation of force and torque at given rotations.

    Parameters
    ----------
    engagement, cutter, material, theta : as :func:`chipload.cutting.force.forces_over_turn`
    frame : as :func:`mean_band`

    Returns
    -------
    force : (n, m, 3) float [N]
    torque : (n, m) float [N mm]
    """
    angles = np.ascontiguousarray(theta, dtype=np.float64)
    basis = np.zeros((len(engagement), len(angles), 4, 6))
    for k, law in enumerate(_unit_laws(material)):
        out = np.zeros((len(engagement), len(angles), 4))
        rows = (engagement.start, engagement.rows, engagement.tooth, engagement.slice, engagement.slices)
        _tooth_force.turn_of(*rows, angles, cutter.flutes, law, out)
        basis[..., k] = out
    deviation = deviations(basis if frame is None else turned_basis(basis, frame), material)
    return deviation[..., :3], deviation[..., 3]


def peak_band(
    engagement: ToothEngagement, cutter: Cutter, material: Material, at_force: ArrayLike, at_torque: ArrayLike
) -> tuple[Floats, Floats]:
    """Return the standard deviation of the size of the force, and of the torque, at one rotation of each step.

    With F = B K at the rotation and e = F / |F|, that of |F| is sqrt(b C b') with b = e B: of first order in the errors
    of K, exact where they keep the direction of F.

    Parameters
    ----------
    engagement, cutter, material : the material with a spread or a covariance
    at_force, at_torque : (n,) float [rad], rotation of tooth 0 at which each is evaluated, as where it is greatest

    Returns
    -------
    force : (n,) float [N]
    torque : (n,) float [N mm]

    Examples
    --------
    >>> import math
    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, source="made up for this example", spread=0.1)
    >>> slot = engagement_of_arcs([0.0], [math.pi], 0.1, mill, 2.0)
    >>> [x.round(9).tolist() for x in peak_band(slot, mill, plain, [math.pi / 2], [math.pi / 2])]
    [[20.0], [100.0]]
    """
    return force_deviation(engagement, cutter, material, at_force), torque_deviation(
        engagement, cutter, material, at_torque
    )


def force_deviation(engagement: ToothEngagement, cutter: Cutter, material: Material, theta: ArrayLike) -> Floats:
    """Return the standard deviation (n,) [N] of the size of the force of each step at its rotation, see
    :func:`peak_band`.
    """
    return _deviation(force_factors(engagement, cutter, material, theta), material)


def force_factors(engagement: ToothEngagement, cutter: Cutter, material: Material, theta: ArrayLike) -> Floats:
    """Return dF/dK (n, 6) of the size F of the force of each step at its rotation, by coefficient."""
    loads = _bases_at(engagement, cutter, material, theta)
    force = loads[:, :3] @ np.array(material.coefficients)
    size = np.linalg.norm(force, axis=1)
    along = np.divide(force, size[:, None], out=np.zeros_like(force), where=size[:, None] > 0.0)
    return np.asarray(np.einsum("ni,nik->nk", along, loads[:, :3]))


def torque_deviation(engagement: ToothEngagement, cutter: Cutter, material: Material, theta: ArrayLike) -> Floats:
    """Return the standard deviation (n,) [N mm] of the torque of each step at its rotation, see :func:`peak_band`."""
    return _deviation(torque_factors(engagement, cutter, material, theta), material)


def torque_factors(engagement: ToothEngagement, cutter: Cutter, material: Material, theta: ArrayLike) -> Floats:
    """Return dT/dK (n, 6) of the torque of each step at its rotation, by coefficient."""
    return np.asarray(_bases_at(engagement, cutter, material, theta)[:, 3])


def _deviation(factors: Floats, material: Material) -> Floats:
    """Return the standard deviation of loads with the factors (n, 6) of the coefficients."""
    return np.asarray(np.sqrt(np.clip(np.einsum("nk,kl,nl->n", factors, material.variances, factors), 0.0, None)))


def _bases_at(engagement: ToothEngagement, cutter: Cutter, material: Material, theta: ArrayLike) -> Floats:
    """Return B (n, 4, 6) of every step at a rotation of its own."""
    out = np.zeros((len(engagement), 4, 6))
    angles = np.ascontiguousarray(theta, dtype=np.float64)
    rows = (engagement.start, engagement.rows, engagement.tooth, engagement.slice, engagement.slices)
    if not any(material.exponents):
        bases.bases_at(*rows, angles, cutter.flutes, out)
    else:
        _tooth_force.bases_at(*rows, angles, cutter.flutes, _unit_laws(material), out)
    return out


def _unit_laws(material: Material) -> Floats:
    """Return six force laws (6, 9), each with one coefficient of 1, the others 0, and the material's exponents."""
    return np.column_stack([np.eye(6), np.broadcast_to(material.exponents, (6, 3))])


def turned_basis(basis: Floats, frame: ArrayLike) -> Floats:
    """Return B (n, ..., 4, 6) with its forces in the frame of the work; ``frame`` (n, 3, 3) has rows T, n, A."""
    frames = np.asarray(frame, dtype=np.float64)
    across = np.swapaxes(frames, 1, 2).reshape(len(frames), *[1] * (basis.ndim - 3), 3, 3)
    return np.concatenate([across @ basis[..., :3, :], basis[..., 3:, :]], axis=-2)
