"""The strength of a cutter's material: the allowable stress of its sections.

Carbide is brittle: its greatest tensile stress is compared with the transverse rupture strength (ISO 3327, a bar
without notch in bending). High-speed steel yields first: its von Mises equivalent stress is compared with the yield
strength.

The shipped strengths are those of ordinary grades; a data sheet of the cutter's own grade is better. The default safety
factor of 2 covers effects that the check does not include: peaks of the force above the linear model (measured ones
were up to 1.7 times as high), the scatter of rupture strengths, and repeated load.

Reference: [HumphryBaker2019] for WC-Co, about 3 GPa at best for fine grain; [M2DataSheet] for high-speed steel M2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from chipload.errors import InputError

#: modulus [MPa] below which a cutter without a stated material is steel: steel 210 GPa, carbide 400 to 700
STEEL_BELOW = 3.5e5


class ToolMaterial(StrEnum):
    """Material of a cutter."""

    CARBIDE = "carbide"
    HSS = "hss"


#: strength [MPa]: transverse rupture strength of carbide, yield strength of high-speed steel
STRENGTHS = {ToolMaterial.CARBIDE: 3000.0, ToolMaterial.HSS: 3250.0}
#: sources of these strengths
SOURCES = {
    ToolMaterial.CARBIDE: "transverse rupture strength of fine-grained WC-Co, doi 10.1098/rsta.2017.0443, section 3a",
    ToolMaterial.HSS: "compressive yield strength of M2 at 62 to 65 HRC, trade data sheets",
}
STATED = "as stated in the job"


@dataclass(frozen=True)
class ToolStrength:
    """Stated strength of a cutter.

    Parameters
    ----------
    material : of the cutter; None: from its modulus, see :data:`STEEL_BELOW`
    mpa : strength [MPa]; None: that of :data:`STRENGTHS`
    safety_factor : strength over the stress that is allowed, at least 1
    concentration : K_t, stress at the root of a flute or a step over that of a smooth bar, at least 1. By default 1:
        the flutes run along the cutter and leave it round at their ends, and no value holds for all of them

    Raises
    ------
    InputError
        A number is out of range.
    """

    material: ToolMaterial | None = None
    mpa: float | None = None
    safety_factor: float = 2.0
    concentration: float = 1.0

    def __post_init__(self) -> None:
        if self.mpa is not None and not 100.0 <= self.mpa <= 1e4:
            raise InputError(f"cutter.strength_mpa = {self.mpa:g}: must be from 100 to 10000 (carbide 3000)")
        for key, value in (("safety_factor", self.safety_factor), ("stress_concentration", self.concentration)):
            if not 1.0 <= value <= 100.0:
                raise InputError(f"cutter.{key} = {value:g}: must be from 1 to 100")

    def material_at(self, modulus: float) -> ToolMaterial:
        """Return the stated material, or the one with this modulus [MPa].

        >>> ToolStrength().material_at(5.8e5).value
        'carbide'
        """
        if self.material is not None:
            return self.material
        return ToolMaterial.HSS if modulus < STEEL_BELOW else ToolMaterial.CARBIDE

    def allowed(self, modulus: float) -> float:
        """Return the allowed stress [MPa].

        >>> ToolStrength(mpa=3600.0, safety_factor=1.5).allowed(5.8e5)
        2400.0
        """
        own = STRENGTHS[self.material_at(modulus)] if self.mpa is None else self.mpa
        return own / self.safety_factor

    def source(self, modulus: float) -> str:
        """Return the source of the strength."""
        return SOURCES[self.material_at(modulus)] if self.mpa is None else STATED


def check_material(strength: ToolStrength, modulus: float) -> None:
    """Refuse a stated material that cannot have the modulus [MPa].

    Raises
    ------
    InputError
        Carbide softer than 350 GPa, or steel stiffer than that.
    """
    if strength.material is None or not math.isfinite(modulus):
        return
    if (strength.material is ToolMaterial.HSS) != (modulus < STEEL_BELOW):
        usual = "about 210" if strength.material is ToolMaterial.HSS else "400 to 700"
        raise InputError(
            f'cutter.tool_material = "{strength.material.value}" with modulus_gpa = {modulus / 1000.0:g}: it has '
            f"{usual}: state the other material or the right modulus"
        )
