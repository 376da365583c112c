"""The flank arc of a barrel cutter (circle-segment cutter), tangent to its corner and to its flank line.

Notation (APT, as in :mod:`chipload.cutter.cutter`): e, f, r corner circle; R > r radius of the flank arc, (E, F) its
centre, E below 0 where R is above half the diameter; n = (cos(beta), -sin(beta)) outward normal of the flank line in
(rho, z), u = (sin(beta), cos(beta)) along it; q depth of the corner's centre below the flank line; kappa angle of the
outward normal with the downward axis.

The arc touches the flank line if its centre lies R below it, and the corner circle from inside if the centres are
R - r apart: (E, F) = (e, f) - (R - q) n + t u, t^2 = (R - r)^2 - (R - q)^2. It runs from kappa = pi/2 - beta -
atan2(t, R - q), where the corner ends, to pi/2 - beta. The tangential form has beta = 0, the conical form beta > 0.
With r = 0 the arc begins at a sharp corner: the seven numbers of APT with the arc as their corner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from chipload.errors import InputError


@dataclass(frozen=True)
class FlankArc:
    """The flank arc of a barrel cutter.

    Parameters
    ----------
    e, f : E, F [mm]
    radius : R [mm]
    kappa_from, kappa_to : [rad]
    """

    e: float
    f: float
    radius: float
    kappa_from: float
    kappa_to: float

    def kappa_at(self, z: float) -> float:
        """Return kappa [rad] at the height z [mm]."""
        return math.acos(min(max((self.f - z) / self.radius, -1.0), 1.0))

    @property
    def z_from(self) -> float:
        """Height at which the arc begins [mm]."""
        return self.f - self.radius * math.cos(self.kappa_from)

    @property
    def z_to(self) -> float:
        """Height at which the flank line begins [mm]."""
        return self.f - self.radius * math.cos(self.kappa_to)


def tip_of_barrel(apt: Sequence[float]) -> float | None:
    """Return e [mm] of the sharp tip if the seven numbers are those of a barrel with a flat bottom, or None.

    >>> round(tip_of_barrel((10.0, 20.0, -15.0, 10.0, 0.0, 0.0, 16.0)), 4)
    2.3205
    """
    d, r, e, f, alpha, beta, _ = apt
    inside = r * r - f * f
    touches = abs((0.5 * d - e) * math.cos(beta) + f * math.sin(beta) - r) <= 1e-3
    if not (alpha == 0.0 and e < 0.0 < f and inside > 0.0 and touches):
        return None
    tip = e + math.sqrt(inside)
    return tip if 0.0 <= tip < 0.5 * d else None


def flank_arc(apt: tuple[float, float, float, float, float, float, float], radius: float) -> FlankArc:
    """Return the arc of this radius between the corner and the flank line of the seven numbers of APT.

    Examples
    --------
    Diameter 12, tip radius 3 on the axis, R = 85: E = 6 - 85, F = 3 + sqrt(82^2 - 79^2).

    >>> arc = flank_arc((12.0, 3.0, 0.0, 3.0, 0.0, 0.0, 25.0), 85.0)
    >>> arc.e, round(arc.f, 4), round(math.degrees(arc.kappa_from), 4)
    (-79.0, 24.9773, 74.4538)
    """
    d, r, e, f, alpha, beta, _ = apt
    foot = 0.5 * d * (1.0 - math.tan(alpha) * math.tan(beta))
    cb, sb = math.cos(beta), math.sin(beta)
    q = (foot - e) * cb + f * sb
    tiny = 1e-9 * d
    if not q > r + tiny:
        room = f * sb / cb
        raise InputError(
            f"cutter.corner_radius_mm = {r:g}: must be below {(foot - e + room) * cb:.6g}, the distance of the "
            "corner's centre from the flank, with barrel_radius_mm"
        )
    if not radius > q + tiny:
        raise InputError(
            f"cutter.barrel_radius_mm = {radius:g}: must be above {q:.6g}, the distance of the corner's centre from "
            "the flank"
        )
    t = math.sqrt((radius - r) ** 2 - (radius - q) ** 2)
    first = 0.5 * math.pi - beta - math.atan2(t, radius - q)
    if first < alpha - 1e-12:
        raise InputError(
            f"cutter.barrel_radius_mm = {radius:g}: its arc leaves the corner at {math.degrees(first):.4g} deg from "
            f"the axis: must be at least bottom_deg = {math.degrees(alpha):g}: state a larger radius"
        )
    return FlankArc(e - (radius - q) * cb + t * sb, f + (radius - q) * sb + t * cb, radius, first, 0.5 * math.pi - beta)
