"""Torque limit of a thin wall, from the radial force that it allows.

Notation: F_r, F_t [N] radial and tangential force on the cutter; R its radius; A [mm^2] area of the chip, b [mm] depth
of cut.

    F_r = Krc A + Kre b,  F_t = Ktc A + Kte b,   T = R F_t with A from F_r at its limit.

T is the instantaneous torque. The controller holds the mean over a revolution, which is less by the ratio of mean to
peak of the cut; that ratio must be stated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutting.material import Material
from chipload.errors import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TorqueLimit:
    """Torque limit from a radial force.

    Parameters
    ----------
    torque : (k,) float [N mm], mean over a revolution; 0 where the limit is not attainable
    attainable : (k,) bool; False: the edge alone, at no feed, already takes more
    """

    torque: Floats
    attainable: NDArray[np.bool_]


def torque_limit(
    force: ArrayLike, radius: float, depth: float, material: Material, mean_over_peak: float
) -> TorqueLimit:
    """Return the torque T_ref at which the radial force reaches ``force``.

    Parameters
    ----------
    force : float [N], (k,) or a number, that the wall allows
    radius : of the cutter [mm]
    depth : of cut [mm]
    material : coefficients; its radial one must be above 0
    mean_over_peak : mean torque of a revolution over its peak, in (0, 1]; 1: teeth overlap so that it is constant

    Raises
    ------
    InputError
        A number is out of range, or the radial force does not grow with the chip.

    Examples
    --------
    Ktc 800, Krc 400 MPa, no edge: F_t = 2 F_r, so 100 N at R = 5 are 1000 N mm.

    >>> wax = Material("plain", 800.0, 400.0, 0.0, 0.0, 0.0, 0.0, source="made up")
    >>> float(torque_limit(100.0, 5.0, 2.0, wax, 1.0).torque)
    1000.0
    """
    for name, value in (("radius", radius), ("depth", depth)):
        if not value > 0.0:
            raise InputError(f"torque_limit.{name} = {value:g}: must be above 0 mm")
    if not 0.0 < mean_over_peak <= 1.0:
        raise InputError(f"torque_limit.mean_over_peak = {mean_over_peak:g}: must be above 0 and at most 1")
    if material.Krc <= 0.0:
        raise InputError(
            f"material.krc_mpa = {material.Krc:g}: must be above 0, else the radial force does not limit the torque"
        )
    area = (np.asarray(force, dtype=np.float64) - material.Kre * depth) / material.Krc
    attainable = area > 0.0
    torque = mean_over_peak * radius * (material.Ktc * area + material.Kte * depth)
    return TorqueLimit(np.where(attainable, torque, 0.0), attainable)
