"""Depth of the check's rays below the surfaces of an impeller: less than the thickness of its blades.

A ray that comes near the other side of a blade meets the cutter that mills there, by as much as that may gouge. It
would count as a gouge as deep as the ray.
"""

from __future__ import annotations

from chipload.errors import InputError
from chipload.geometry.blade_thickness import thickness
from chipload.planning.impeller.impeller import Impeller

#: greatest depth of a ray [mm]
MOST = 0.5
#: how far from the other side a ray ends, over the gouge that is allowed
_AWAY = 1.5
#: over the gouge that is allowed, the least depth at which it is recognised
_LEAST = 1.2


def ray_depth(impeller: Impeller, edge: float, gouge: float) -> float:
    """Greatest depth [mm] of rays into the metal that do not come out on its other side.

    Parameters
    ----------
    edge : share of a side that is left out next to its edges
    gouge : that is allowed [mm]

    Raises
    ------
    InputError
        The blades are too thin to distinguish such a gouge from a cutter on their other side.
    """
    least = min(thickness(body, edge) for body in impeller.bodies)
    depth = min(MOST, least - _AWAY * gouge)
    if depth < _LEAST * gouge:
        raise InputError(
            f"operation.0.paths.gouge_mm = {gouge:g}: the metal is {least:.3g} mm thick next to an edge of a blade: "
            f"must be at most {least / (_AWAY + _LEAST):.2g} mm"
        )
    return depth
