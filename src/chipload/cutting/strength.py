"""Stress in the fluted part and the shank of the cutter under the cutting force.

Notation: z [mm] height above the tip; a section at z carries what cuts below it: dF_l the lateral force and dF_a the
axial one (along A, into the holder) of a piece of edge at the height z' and the radius rho, u its radial direction,

    B(z) = integral of (z - z') dF_l + rho dF_a u   [N mm],   N(z) = integral of dF_a,   M_t(z) that of the torque;

the size of B is the bending moment. In a round section of the diameter D, at its most stretched fibre,

    sigma = 32 |B| / (pi D^3) - 4 N / (pi D^2),   tau = 16 M_t / (pi D^3),

and at the opposite one with + N. D is ``fluted_factor`` times the envelope's diameter in the fluted part, that of the
shank above it. Equivalent stress: of carbide, which is brittle, the greatest normal stress
sigma / 2 + sqrt(sigma^2 / 4 + tau^2); of high-speed steel von Mises sqrt(sigma^2 + 3 tau^2) with the greater |sigma|;
both times K_t. It is the greatest over a revolution, and over the sections: the end of the flutes, the clamp in the
holder, and where the cutter is tapered :data:`TAPER_SECTIONS` of its flank.

Not included: chipping of the corner and the edge (they are not a beam), impact when a tooth enters, chatter, and a neck
thinner than the shank.

Reference: [Kops1990] for the equivalent diameter, [Altintas2012] ch. 2 for the forces; bending and torsion of a round
bar in closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutter.profile import UPRIGHT
from chipload.cutter.strength import ToolMaterial
from chipload.cutting.levers import greatest_height, has_lever_loads, lever_loads_in_blocks
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError
from chipload.lazy import LateModule

_strength = LateModule("chipload.cutting._strength")

Floats = NDArray[np.float64]

#: sections of a tapered flank, evenly from the end of its corner to the end of the flutes
TAPER_SECTIONS = 9
#: between two evaluated rotations [rad]
ROTATION = math.radians(2.0)


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections of a cutter, from the tip upwards: ``height`` (h,) above the tip and ``diameter`` (h,) that carries,
    both [mm].
    """

    height: Floats
    diameter: Floats

    def __post_init__(self) -> None:
        for name in ("height", "diameter"):
            value = np.array(getattr(self, name), dtype=np.float64)
            value.flags.writeable = False
            object.__setattr__(self, name, value)


def sections_of(cutter: Cutter) -> Sections:
    """Return the sections of a cutter at which the stress is calculated.

    Examples
    --------
    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 35.0, 5.8e5)
    >>> sections_of(mill).height.tolist(), sections_of(mill).diameter.tolist()
    ([20.0, 35.0], [8.0, 10.0])
    """
    top = cutter.flute_length
    if cutter.shape:
        end = cutter.segments[-1]
        narrow = end.kappa[1] > UPRIGHT
        height = np.unique(np.linspace(end.z[0], top, TAPER_SECTIONS)[1:]) if narrow else np.array([top])
    elif cutter.taper > 0.0 or cutter.flank_arc is not None:
        _, r, _, f, _, _, _ = cutter.apt
        low = min(max(f - r * math.cos(cutter.corner_end), 0.0), top)
        height = np.unique(np.linspace(low, top, TAPER_SECTIONS))
    else:
        height = np.array([top])
    diameter = 2.0 * cutter.fluted_factor * cutter.radius_at(height)
    if cutter.overhang > top:
        shank = cutter.diameter if cutter.shank_diameter is None else cutter.shank_diameter
        height, diameter = np.append(height, cutter.overhang), np.append(diameter, shank)
    return Sections(height, diameter)


def section_loads(
    engagement: ToothEngagement, cutter: Cutter, material: Material, theta: ArrayLike, height: ArrayLike
) -> Floats:
    """Return bending moment, axial force and torque of sections at given rotations.

    Parameters
    ----------
    engagement : of n steps
    theta : (m,) float [rad], rotation of tooth 0 at the tip
    height : (h,) float [mm] above the tip, rising

    Returns
    -------
    (n, m, h, 4) float: B along T and n [N mm], N [N], M_t [N mm]

    Examples
    --------
    One straight tooth ahead, 2 mm deep: 110 N/mm across the feed and 35 along it, at a mean height of 1 mm.

    >>> from chipload.engagement.tooth_engagement import engagement_of_arcs
    >>> mill = Cutter(10.0, 1, 0.0, 20.0, 30.0, 6e5)
    >>> plain = Material("plain", 1000.0, 300.0, 0.0, 10.0, 5.0, 0.0, source="made up for this example")
    >>> slot = engagement_of_arcs([0.0], [math.pi], 0.1, mill, 2.0)
    >>> section_loads(slot, mill, plain, [math.pi / 2], [30.0])[0, 0, 0].round(9).tolist()
    [-2030.0, 6380.0, 0.0, 1100.0]
    """
    angles, heights = (np.ascontiguousarray(x, dtype=np.float64) for x in (theta, height))
    if not (np.diff(heights) > 0.0).all():
        raise InputError("section_loads: height: must rise")
    out = np.zeros((len(engagement), len(angles), len(heights), 4))
    rows = (engagement.start, engagement.rows, engagement.tooth, engagement.slice, engagement.slices)
    _strength.in_sections_over_turn(*rows, angles, cutter.flutes, np.array(material.law), heights, out)
    return out


def normal_stress(loads: ArrayLike, diameter: ArrayLike) -> Floats:
    """Return the greatest normal stress [MPa] of sections (h,) [mm] under loads (..., h, 4) of :func:`section_loads`.

    >>> float(normal_stress([[1000.0, 0.0, 0.0, 0.0]], [10.0])[0].round(6))
    10.185916
    """
    bending, axial, tau = _stresses(loads, diameter)
    sigma = np.maximum(bending - axial, 0.0)
    return np.asarray(0.5 * sigma + np.sqrt(0.25 * sigma**2 + tau**2))


def von_mises_stress(loads: ArrayLike, diameter: ArrayLike) -> Floats:
    """Return the greatest von Mises equivalent stress [MPa]; parameters as :func:`normal_stress`.

    >>> float(von_mises_stress([[0.0, 0.0, 0.0, 1000.0]], [10.0])[0].round(6))
    8.821262
    """
    bending, axial, tau = _stresses(loads, diameter)
    return np.asarray(np.sqrt((bending + np.abs(axial)) ** 2 + 3.0 * tau**2))


def cutter_stress(
    engagement: ToothEngagement, cutter: Cutter, material: Material, rotation: float = ROTATION
) -> Floats:
    """Return the column ``cutter_stress_mpa``: greatest equivalent stress of each step over a revolution, (n,) [MPa].

    Parameters
    ----------
    rotation : angle between two calculated rotations [rad]

    Raises
    ------
    InputError
        ``rotation`` is not above 0.
    """
    if not 0.0 < rotation <= math.radians(15.0):
        raise InputError(f"rotation = {math.degrees(rotation):g} deg: must be above 0 and at most 15")
    pitch = math.tau / cutter.flutes if cutter.teeth_alike else math.tau
    count = max(math.ceil(pitch / rotation), 8)
    at = sections_of(cutter)
    brittle = cutter.strength.material_at(cutter.modulus) is ToolMaterial.CARBIDE
    if has_lever_loads(engagement, cutter, material) and greatest_height(engagement) <= at.height[0] * (1.0 + 1e-12):
        # all that cuts is below the sections: the force and its moment about the tip are sufficient
        out = np.empty(len(engagement))
        for some, loads in lever_loads_in_blocks(engagement, cutter, material, count, np.eye(4)[:2]):
            _strength.greatest_stress(loads, at.height, at.diameter, brittle, out[some])
        return cutter.strength.concentration * out
    loads = section_loads(engagement, cutter, material, np.arange(count) * (pitch / count), at.height)
    stress = normal_stress(loads, at.diameter) if brittle else von_mises_stress(loads, at.diameter)
    return np.asarray(cutter.strength.concentration * stress.max(axis=(1, 2), initial=0.0))


def allowed_stress(cutter: Cutter) -> float:
    """Return the limit of the column [MPa]: the strength over the safety factor.

    >>> allowed_stress(Cutter(10.0, 4, 0.5, 20.0, 35.0, 5.8e5))
    1500.0
    """
    return cutter.strength.allowed(cutter.modulus)


def _stresses(loads: ArrayLike, diameter: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Return bending stress (at least 0), axial stress (pressure above 0) and shear stress."""
    load, d = np.asarray(loads, dtype=np.float64), np.asarray(diameter, dtype=np.float64)
    bending = 32.0 * np.hypot(load[..., 0], load[..., 1]) / (math.pi * d**3)
    return bending, 4.0 * load[..., 2] / (math.pi * d**2), 16.0 * load[..., 3] / (math.pi * d**3)
