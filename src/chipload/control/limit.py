"""Allowable force and torque on a thin wall.

Notation: s [mm] place along the wall; C_w, C_t [mm/N] compliances of the wall and of the cutter along the wall's
normal; d [mm] deflection that is allowed, S [MPa] stress that is; F_r, F_t [N] radial and tangential force on the
cutter; R its radius; A [mm^2] area of the chip, b [mm] depth of cut.

    F_r <= min(d / (C_t + C_w), S / stress of the wall under 1 N),
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
from chipload.structure.shell import Ritz, compliance, greatest_stress, left_out

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WallLimit:
    """Allowable force at places along a wall.

    Parameters
    ----------
    s : (k,) float [mm]
    compliance : (k,) float [mm/N], of the wall, along its normal
    stress : (k,) float [MPa/N], the greatest equivalent one, at the clamp or under the cutter
    by_deflection, by_strength : (k,) float [N], radial force at each limit
    """

    s: Floats
    compliance: Floats
    stress: Floats
    by_deflection: Floats
    by_strength: Floats

    @property
    def force(self) -> Floats:
        """The allowable radial force (k,) [N]."""
        return np.minimum(self.by_deflection, self.by_strength)


def wall_limit(
    modes: Ritz,
    s: ArrayLike,
    tool_compliance: float,
    deflection: float,
    stress: float,
    length: float,
    width: float,
) -> WallLimit:
    """Return the allowable radial force on the wall with the cutter at ``s``.

    Parameters
    ----------
    modes : of the wall, from :func:`chipload.structure.shell.ritz`
    s : float [mm], (k,) or a number, middle of the depth of cut
    tool_compliance : C_t [mm/N], cutter and holder; 0: rigid
    deflection : d [mm]
    stress : S [MPa]
    length, width : area on which the cutter acts [mm]: depth of cut along s, contact round

    Raises
    ------
    InputError
        A limit is not above 0, or the area does not lie on the wall.
    """
    for name, value, unit in (
        ("deflection", deflection, "mm"),
        ("stress", stress, "MPa"),
        ("length", length, "mm"),
        ("width", width, "mm"),
    ):
        if not value > 0.0:
            raise InputError(f"wall_limit.{name} = {value:g}: must be above 0 {unit}")
    if not tool_compliance >= 0.0:
        raise InputError(f"wall_limit.tool_compliance = {tool_compliance:g}: must be at least 0 mm/N")
    at = np.atleast_1d(np.asarray(s, dtype=np.float64))
    # the deflection is taken at a point: that is what the cutter's edge leaves
    wall = compliance(modes, at)[:, 2, 2] + left_out(modes, at)
    per_newton = np.array([max(greatest_stress(modes, float(x), length, width)) for x in at])
    return WallLimit(at, wall, per_newton, deflection / (tool_compliance + wall), stress / per_newton)


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
    force : float [N], (k,) or a number, from :class:`WallLimit`
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
