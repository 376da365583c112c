"""Process damping: the force of a worn edge that displaces material under its wear land.

Notation: K_sp indentation coefficient [N/mm^3], L_w width of the wear land [mm], mu friction, v cutting speed, r' speed
of the cutter from the work, nu outward normal of the slice, e as everywhere. Under the land lies the volume
L_w^2 r' / (2 v) for each mm of edge, so that

    dF = -C_p (nu + mu e) (nu . r'),   C_p = K_sp L_w^2 / (2 v),

for small amplitudes. It always damps, most at low speeds; it is included if the job states it, and never assumed.

Reference: [Altintas2008].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.engagement.tooth_engagement import ToothEngagement
from chipload.errors import InputError

Floats = NDArray[np.float64]

#: values that are believed: K_sp [N/mm^3], L_w [mm], mu
INDENTATION, WEAR_LAND, FRICTION = (1e2, 1e7), (1e-4, 1.0), (0.0, 2.0)


@dataclass(frozen=True)
class ProcessDamping:
    """Process damping of a worn edge: wear land, indentation coefficient and friction.

    Parameters
    ----------
    indentation : K_sp [N/mm^3] of workpiece and edge
    wear_land : L_w [mm]
    friction : mu between edge and workpiece

    Raises
    ------
    InputError
        A value is outside of what is believed.
    """

    indentation: float
    wear_land: float
    friction: float = 0.0

    def __post_init__(self) -> None:
        for key, value, (low, high) in (
            ("indentation_n_mm3", self.indentation, INDENTATION),
            ("wear_land_mm", self.wear_land, WEAR_LAND),
            ("friction", self.friction, FRICTION),
        ):
            if not (math.isfinite(value) and low <= value <= high):
                raise InputError(f"dynamics.process_damping.{key} = {value:g}: must be from {low:g} to {high:g}")

    def rows(self, engagement: ToothEngagement, rows: Floats) -> Floats:
        """(b, 11) float: kernel rows whose coefficients give the force by r' in place of the displacement, in
        N s/mm^2 where the spindle turns by 1 rad/s; at w rad/s they are 1 / w of that.
        """
        own = engagement.slices[engagement.slice]
        radius, sine = own[:, 1], own[:, 3]
        per_edge = np.divide(
            0.5 * self.indentation * self.wear_land**2 * sine, radius, out=np.zeros(len(own)), where=radius > 0.0
        )
        out = rows[:, :11].copy()
        out[:, 5], out[:, 6], out[:, 7] = self.friction * per_edge, per_edge * sine, 0.0
        return out
