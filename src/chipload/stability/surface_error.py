"""Surface location error: the form error that forced vibration of a stable cut leaves on the wall.

Notation: a stable motion without runout has the tooth period, so that r(t) = r(t - tau) and the regenerative force is
0: the motion is that of the modes under the force of the rigid model, r_k = G(i k 2 pi / tau) F_k for each harmonic.
The wall at a height is made when the edge passes there at phi = 0 (up milling) or pi (down milling). The error is
positive where material is left, as a form error is. It changes sign where the tooth frequency passes that of a mode.

It is not valid for a cut that chatters. Modes that are not stated count as rigid.

Reference: [Schmitz2009] ch. 5 for the effect.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.stability.cuts import DynamicCuts, dynamic_cuts
from chipload.stability.margin import share_chunks
from chipload.stability.modes import Modes

_surface_location = LateModule("chipload.stability._surface_location")

Floats = NDArray[np.float64]

#: how many times the highest mode the harmonics of the force reach at least; the rest of a jump is then 1 % of it
RESOLVED = 4.0


def harmonics_reach(cuts: DynamicCuts) -> NDArray[np.bool_]:
    """Return a mask (n,) of the cuts whose harmonics reach :data:`RESOLVED` times the highest of their modes."""
    highest = cuts.omega.max(axis=1, initial=0.0)
    return np.asarray(_surface_location.HARMONICS * math.tau / cuts.period >= RESOLVED * highest)


def force_rows(engagement: ToothEngagement, material: Material) -> Floats:
    """Return rows (b, 11) for the kernel.

    Raises
    ------
    InputError
        The material has a size effect.
    """
    if any(material.exponents):
        raise InputError(
            f"material {material.name}: has a size effect: the surface location error is known for coefficients "
            "without exponents only"
        )
    own = engagement.slices[engagement.slice]
    low, high, s_from, s_to, along, offset, across = engagement.rows.T
    sine, cosine, lag, rate = own[:, 3], own[:, 4], own[:, 5], own[:, 6]
    first = lag + rate * (s_from - own[:, 0])
    cut, edge = material.Krc * sine + material.Kac * cosine, material.Kre * sine + material.Kae * cosine
    tangential = (material.Ktc * offset + material.Kte, material.Ktc * along, material.Ktc * across)
    radial = (cut * offset + edge, cut * along, cut * across)
    ends = (low, high, first, first + rate * (s_to - s_from), s_to - s_from)
    return np.ascontiguousarray(np.column_stack([*ends, *tangential, *radial]))


def location_error(
    engagement: ToothEngagement,
    cutter: Cutter,
    material: Material,
    modes: Modes,
    speed: ArrayLike,
    T: ArrayLike | None = None,
    n: ArrayLike | None = None,
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the wall's error of greatest size over its height, (n,) [mm], and whether a cut makes a wall, (n,) bool.

    Parameters as :func:`chipload.stability.cuts.dynamic_cuts`. A cut that makes no wall has the error 0.
    """
    cuts = dynamic_cuts(engagement, cutter, material, modes, speed, T, n)
    return wall_errors(cuts, force_rows(engagement, material))


def wall_errors(cuts: DynamicCuts, rows: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return :func:`location_error` of cuts and the rows of :func:`force_rows`."""
    out = np.zeros((len(cuts), 2))
    teeth = round(math.tau / cuts.pitch)

    def part(first: int, last: int) -> None:
        _surface_location.wall_errors(
            first, last, cuts.start, rows, cuts.period, teeth, cuts.omega, np.array(cuts.damping), cuts.U,
            out,
        )  # fmt: skip

    share_chunks(part, len(cuts))
    return out[:, 0], out[:, 1] > 0.0
