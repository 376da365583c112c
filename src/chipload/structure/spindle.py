"""Compliance of the tool tip with holder and spindle: a chain of bars and joints.

Notation: z [mm] height above the tip; E I [N mm^2] of each bar, from the tip upwards; a joint at height z_j has the
compliances c_ff [mm/N] for a force, c_mm [rad/(N mm)] for a moment, and the cross compliance c_fm [1/N].

The chain is clamped at its upper end and statically determinate, so the compliances of joints and bending add up (unit
load method):

    C(a, b) = integral from max(a, b) of (z - a)(z - b) / (E I) dz
              + sum over joints above both of c_ff + c_fm (z_j - a + z_j - b) + c_mm (z_j - a)(z_j - b).

Shear is neglected, as in :mod:`chipload.structure.beam`; a clamped cutter agrees with that module to rounding.

Reference: [Altintas2012] ch. 2 and 4; [Schmitz2009] ch. 9 for the joint between cutter and holder.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.structure.beam import flexibilities
from chipload.structure.hexa import Array


@dataclass(frozen=True)
class Joint:
    """Compliances of a joint between two bars: c_ff [mm/N], c_mm [rad/(N mm)], c_fm [1/N]; all 0: rigid.

    Raises
    ------
    InputError
        The compliances are not those of a passive joint (c_ff, c_mm >= 0, c_fm^2 <= c_ff c_mm).
    """

    c_ff: float = 0.0
    c_mm: float = 0.0
    c_fm: float = 0.0

    def __post_init__(self) -> None:
        ok = self.c_ff >= 0.0 and self.c_mm >= 0.0 and self.c_fm**2 <= self.c_ff * self.c_mm * (1.0 + 1e-12)
        if not (ok and all(math.isfinite(c) for c in (self.c_ff, self.c_mm, self.c_fm))):
            raise InputError(
                f"joint: c_ff = {self.c_ff:g}, c_mm = {self.c_mm:g}, c_fm = {self.c_fm:g}: c_ff and c_mm must be at "
                "least 0, c_fm^2 at most c_ff c_mm"
            )


RIGID = Joint()


def springs(translation: float = math.inf, rotation: float = math.inf) -> Joint:
    """Joint of two springs, [N/mm] and [N mm/rad]; infinite: rigid.

    Examples
    --------
    >>> springs(2e4, 5e7)
    Joint(c_ff=5e-05, c_mm=2e-08, c_fm=0.0)
    """
    for name, k in (("translation", translation), ("rotation", rotation)):
        if not k > 0.0:
            raise InputError(f"joint.{name} = {k:g}: a stiffness must be above 0; inf for a rigid one")
    return Joint(1.0 / translation, 1.0 / rotation)


def bearings(front: float, rear: float, span: float, bending: float = math.inf) -> Joint:
    """Spindle on two bearings, as a joint at the front bearing.

    Parameters
    ----------
    front, rear : stiffness of the bearings [N/mm]
    span : distance between them [mm]
    bending : E I of the spindle between them [N mm^2]

    Examples
    --------
    >>> round(bearings(1e5, 1e5, 100.0).c_mm * 1e9, 9)
    2.0
    """
    for name, k in (("front", front), ("rear", rear), ("span", span), ("bending", bending)):
        if not k > 0.0:
            raise InputError(f"bearings.{name} = {k:g}: must be above 0")
    return Joint(1.0 / front, (1.0 / front + 1.0 / rear) / span**2 + span / (3.0 * bending), 1.0 / (front * span))


@dataclass(frozen=True)
class Bar:
    """A bar of one section: length [mm], 1 / (E I) [1/(N mm^2)], and the joint at its upper end."""

    length: float
    flexibility: float
    joint: Joint = RIGID

    def __post_init__(self) -> None:
        if not (self.length >= 0.0 and self.flexibility >= 0.0 and math.isfinite(self.length)):
            raise InputError(f"bar: length_mm = {self.length:g}, 1/(E I) = {self.flexibility:g}: must be at least 0")


def tube(length: float, outer: float, modulus: float, inner: float = 0.0, joint: Joint = RIGID) -> Bar:
    """Bar of a round section, diameters [mm], modulus [MPa]: 1 / (E I) = 64 / (pi E (D^4 - d^4)).

    Examples
    --------
    >>> round(1.0 / tube(30.0, 10.0, 6e5).flexibility / 6e5, 3)
    490.874
    """
    if not (outer > inner >= 0.0 and modulus > 0.0):
        raise InputError(
            f"tube: outer_mm = {outer:g}, inner_mm = {inner:g}, modulus = {modulus:g} MPa: must be outer > inner >= 0, "
            "modulus > 0"
        )
    return Bar(length, 64.0 / (math.pi * modulus * (outer**4 - inner**4)), joint)


def cutter_bars(cutter: Cutter, joint: Joint = RIGID, fluted_factor: float | None = None) -> tuple[Bar, ...]:
    """Fluted part and shank of a cutter, with the joint by which the holder grips it."""
    fluted, shank = flexibilities(cutter, fluted_factor)
    return Bar(cutter.flute_length, fluted), Bar(cutter.overhang - cutter.flute_length, shank, joint)


def tool_bars(cutter: Cutter) -> tuple[Bar, ...]:
    """Bars of the cutter, with the additional compliance of the machine if the tip was measured.

    Raises
    ------
    InputError
        The measured tip is stiffer than the cutter alone.
    """
    bars = cutter_bars(cutter)
    return bars if cutter.tip_stiffness is None else as_measured(bars, 1.0 / cutter.tip_stiffness)


def as_measured(bars: tuple[Bar, ...], compliance: float) -> tuple[Bar, ...]:
    """The chain with the additional compliance of a measured tip, e.g. that of holder and spindle.

    The difference is added to the last joint as a translation. This is exact at the tip whatever its cause. Loads
    higher up receive the same addition, which is too large where holder and spindle tilt.

    Parameters
    ----------
    bars : from the tip upwards
    compliance : [mm/N] of the tip across the axis under a slow force, e.g. of
        :func:`chipload.structure.receptance.static_compliance`

    Raises
    ------
    InputError
        The measured tip is stiffer than the chain alone.

    Examples
    --------
    >>> bars = as_measured((Bar(50.0, 0.0),), 1e-4)
    >>> round(float(chain_compliance(bars, 0.0, 0.0)) * 1e6, 6)
    100.0
    """
    own = float(chain_compliance(bars, 0.0, 0.0))
    if not own <= compliance < math.inf:
        raise InputError(
            f"tip: measured compliance {1e3 * compliance:.4g} um/N: must be at least that of cutter and holder alone, "
            f"{1e3 * own:.4g} um/N: check the calibration of hammer and sensor, or the overhang and modulus"
        )
    joint = bars[-1].joint
    return (*bars[:-1], replace(bars[-1], joint=replace(joint, c_ff=joint.c_ff + compliance - own)))


def chain_compliance(bars: tuple[Bar, ...], z_force: ArrayLike, z_point: ArrayLike) -> Array:
    """Lateral deflection at one height under a unit lateral force at another, [mm/N].

    O(bars) for each pair.

    Parameters
    ----------
    bars : from the tip upwards; the last joint is fastened to a rigid base
    z_force, z_point : float [mm], any shapes that broadcast, 0 .. length of the chain

    Raises
    ------
    InputError
        A height lies outside the chain.

    Examples
    --------
    A rigid bar of 50 mm on a joint of 20 kN/mm and 50 kN m/rad:

    >>> round(float(chain_compliance((Bar(50.0, 0.0, springs(2e4, 5e7)),), 0.0, 0.0)) * 1e6, 6)
    100.0
    """
    a = np.asarray(z_force, dtype=np.float64)
    b = np.asarray(z_point, dtype=np.float64)
    length = sum(bar.length for bar in bars)
    for name, z in (("z_force", a), ("z_point", b)):
        bad = ~((z >= 0.0) & (z <= length))
        if bad.any():
            raise InputError(f"chain_compliance: {name} = {z[bad].flat[0]:g} mm: must be from 0 to {length:g}")
    top, c = np.maximum(a, b), np.abs(a - b)
    out: Array = np.zeros(top.shape)
    end = 0.0
    for bar in bars:
        low = np.maximum(end - top, 0.0)
        end += bar.length
        high = np.maximum(end - top, 0.0)
        out = out + bar.flexibility * ((high**3 - low**3) / 3.0 + c * (high**2 - low**2) / 2.0)
        j = bar.joint
        out = out + np.where(end >= top, j.c_ff + j.c_fm * (2.0 * end - a - b) + j.c_mm * (end - a) * (end - b), 0.0)
    return out


def tip_compliance(bars: Sequence[Bar]) -> Array:
    """(4,) coefficients of the compliance [mm/N] between the tip and a height z [mm] of the first bar: a polynomial.

    With e the height of the end of a bar and s that of its start, z <= e_0:

        C(z, 0) = sum of ((e^3 - s^3) / 3 - (e^2 - s^2) z / 2) / (E I) + z^3 / 6 / (E I)_0
                  + sum of c_ff + c_fm (2 e - z) + c_mm e (e - z).

    Oracle: :func:`chain_compliance`.

    Examples
    --------
    >>> bar = Bar(3.0, 6.0)
    >>> tip_compliance([bar]).tolist()
    [54.0, -27.0, 0.0, 1.0]
    """
    out, s = np.zeros(4), 0.0
    for bar in bars:
        e, j = s + bar.length, bar.joint
        out[0] += bar.flexibility * (e**3 - s**3) / 3.0 + j.c_ff + 2.0 * j.c_fm * e + j.c_mm * e * e
        out[1] -= bar.flexibility * (e**2 - s**2) / 2.0 + j.c_fm + j.c_mm * e
        s = e
    out[3] = bars[0].flexibility / 6.0
    return out
