"""Fillets between the sides of an impeller's bodies and its hub.

Notation: a [mm] radius of the fillets; s, theta place on the hub as in ``revolve.py`` of the geometry. The sides of the
impeller begin above their fillets, its floors end at them.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.fillet import Filleted, add_fillet
from chipload.geometry.sections import Blade
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.surfaces import hub_range

Floats = NDArray[np.float64]

_PLACES = 201


def with_fillets(impeller: Impeller, radius: float) -> tuple[Impeller, tuple[str, ...]]:
    """An impeller with fillets between its sides and its hub, and a line for each side that states what they take.

    Raises
    ------
    InputError
        A fillet is larger than half of the channel, or reaches above a blade.
    """
    blades: list[Blade] = []
    fillets: list[Blade] = []
    lines = []
    for body, name in zip(impeller.bodies, ("blade", "splitter"), strict=False):
        sides: list[Filleted] = []
        for key, side in (("plus", body.plus), ("minus", body.minus)):
            try:
                made = add_fillet(side, impeller.hub, radius)
            except InputError as err:
                raise InputError(f"impeller.fillet_mm = {radius:g}: {name} {key}: {err}: state a smaller one") from None
            sides.append(made)
            lines.append(
                f"{name} {key} fillet: {radius:g} mm, up to {made.height:.4g} mm of the side are under it, within "
                f"{made.off:.2g} mm"
            )
        blades.append(Blade(sides[0].side, sides[1].side))
        fillets.append(Blade(sides[0].fillet, sides[1].fillet))
    out = replace(impeller, blade=blades[0], splitter=blades[1] if len(blades) > 1 else None, fillets=tuple(fillets))
    least = min(_floor_width(impeller, out, index) for index in range(len(blades)))
    if least <= 0.0:
        raise InputError(
            f"impeller.fillet_mm = {radius:g}: larger than half of the channel: two fillets overlap by "
            f"{-least:.4g} mm on the hub: state a smaller one"
        )
    return out, (*lines, f"floor: at least {least:.4g} mm wide between two fillets, round the axis")


def _floor_width(plain: Impeller, made: Impeller, index: int) -> float:
    """Least width [mm] round the axis of the floor beyond a body, below 0 where fillets overlap."""
    s = np.linspace(*hub_range(plain, 0.0), _PLACES)
    ends = plain.across(index, s, [0.0, 1.0])
    inner = [_foot(made, index, 1, s), _foot(made, index + 1, -1, s)]
    # how far each fillet reaches into the channel, a few degrees at most
    taken = [np.angle(np.exp(1j * w * (x - ends[:, k]))) for k, (x, w) in enumerate(zip(inner, (1, -1), strict=True))]
    gap: Floats = ends[:, 1] - ends[:, 0] - taken[0] - taken[1]
    return float((gap * made.hub.curve(s)[:, 0]).min())


def _foot(impeller: Impeller, index: int, sign: int, s: Floats) -> Floats:
    """Theta (k,) [rad] of a foot at places along the hub, but for whole turns."""
    out: Floats = impeller.across(index, s, [0.0], sign)[:, 0]
    return np.mod(out, math.tau)
