"""A cutter: the seven numbers of APT, its teeth, and how far it stands out of the holder.

Notation (APT): d diameter, r corner radius, e radial and f axial distance of the corner circle's centre from the tip,
alpha [rad] angle of the bottom with the plane normal to the axis, beta [rad] angle of the flank with the axis,
h height of the cutting part. A flat end mill has r = e = ... = 0 but e = d/2; a ball has r = d/2, e = 0, f = r.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from chipload.errors import InputError


@dataclass(frozen=True)
class Cutter:
    """A milling cutter.

    Parameters
    ----------
    diameter : d > 0 [mm]
    flutes : number of teeth, >= 1
    helix : helix angle [rad], 0 <= helix < 80 deg, right-handed
    flute_length : length that cuts [mm]
    overhang : length out of the holder [mm], >= flute_length
    modulus : Young's modulus of the cutter [MPa]
    corner_radius : r [mm], 0 <= r <= d / 2
    corner_e, corner_f : APT e and f [mm]; None: those of a bull nose, e = d/2 - r, f = r
    bottom : alpha [rad]
    taper : beta [rad]
    runout : (offset [mm], direction [rad] from tooth 0): the axis of the teeth beside that of the spindle
    shank_diameter : [mm]; None: as the diameter
    number : tool number, >= 1
    name : as the shop calls it

    Raises
    ------
    InputError
        A number is out of range; the message names it, its value and its limit.
    """

    diameter: float
    flutes: int
    helix: float
    flute_length: float
    overhang: float
    modulus: float
    corner_radius: float = 0.0
    corner_e: float | None = None
    corner_f: float | None = None
    bottom: float = 0.0
    taper: float = 0.0
    runout: tuple[float, float] = (0.0, 0.0)
    shank_diameter: float | None = None
    number: int = 1
    name: str = ""

    def __post_init__(self) -> None:
        def need(ok: bool, key: str, value: float, limit: str) -> None:
            if not ok:
                raise InputError(f"cutter.{key} = {value:g}: {limit}")

        numbers = (self.diameter, self.helix, self.flute_length, self.overhang, self.modulus, self.corner_radius)
        if not all(math.isfinite(x) for x in numbers):
            raise InputError("cutter: a number is not finite")
        need(self.diameter > 0.0, "diameter_mm", self.diameter, "must be above 0")
        need(self.flutes >= 1, "flutes", self.flutes, "must be at least 1")
        need(
            0.0 <= self.helix < math.radians(80.0), "helix_deg", math.degrees(self.helix), "must be from 0 to below 80"
        )
        need(self.flute_length > 0.0, "flute_length_mm", self.flute_length, "must be above 0")
        need(
            self.overhang >= self.flute_length,
            "overhang_mm",
            self.overhang,
            f"must be at least flute_length_mm = {self.flute_length:g}",
        )
        need(
            1e4 <= self.modulus <= 1e6,
            "modulus_gpa",
            self.modulus / 1000.0,
            "must be from 10 to 1000 (steel 210, carbide 580)",
        )
        need(
            0.0 <= self.corner_radius <= self.diameter / 2.0,
            "corner_radius_mm",
            self.corner_radius,
            f"must be at most diameter_mm / 2 = {self.diameter / 2.0:g}",
        )
        need(self.runout[0] >= 0.0, "runout_mm", self.runout[0], "must be at least 0")

    @property
    def radius(self) -> float:
        """R = d / 2 [mm]."""
        return 0.5 * self.diameter
