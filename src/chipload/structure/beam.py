"""Deflection of the cutter as a stepped cantilever that is clamped at the holder.

Notation: z [mm] height above the tip; l overhang and l_f flute length [mm]; d diameter; E modulus [MPa];
I = pi D^4 / 64 [mm^4] with D = fluted_factor d (0.8 d unless stated) in the fluted part, the shank's diameter above it.

Valid for bending of slender cutters (l above about 4 d): shear, the holder and its clamping are taken as rigid.

Reference: [Kops1990] measured an equivalent diameter of about 0.8 d for two and four flutes; [Altintas2012] ch. 2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError


def flexibilities(cutter: Cutter, fluted_factor: float | None = None) -> tuple[float, float]:
    """Flexibility 1 / (E I) of the fluted part and of the shank, 1/(N mm^2); a factor of None is the cutter's own.

    Raises
    ------
    InputError
        ``fluted_factor`` is not in (0, 1].
    """
    if fluted_factor is None:
        fluted_factor = cutter.fluted_factor
    if not 0.0 < fluted_factor <= 1.0:
        raise InputError(
            f"cutter.fluted_factor = {fluted_factor:g}: must be above 0 and at most 1 (0.8 is usual for end mills)"
        )
    shank = cutter.diameter if cutter.shank_diameter is None else cutter.shank_diameter

    def flexibility(diameter: float) -> float:
        return 64.0 / (math.pi * diameter**4 * cutter.modulus)

    return flexibility(fluted_factor * cutter.diameter), flexibility(shank)


def compliance(
    cutter: Cutter, z_force: ArrayLike, z_point: ArrayLike, fluted_factor: float | None = None
) -> NDArray[np.float64]:
    """Lateral deflection at one height under a unit lateral force at another.

    C(a, b) = integral from max(a, b) to l of (z - a)(z - b) / (E I(z)) dz, in closed form: with t = z - max(a, b) and
    c = |a - b| each part of constant E I gives [t^3/3 + c t^2/2] / (E I). Symmetric in a and b (Maxwell).

    Parameters
    ----------
    cutter : its overhang, flute length, diameters and modulus are used
    z_force, z_point : float [mm], any shapes that broadcast, heights above the tip, 0 .. overhang
    fluted_factor : equivalent diameter of the fluted part over the diameter, (0, 1]; None: the cutter's own

    Returns
    -------
    float [mm/N], the broadcast shape.

    Raises
    ------
    InputError
        A height lies outside the overhang, or ``fluted_factor`` is out of range.

    Examples
    --------
    A plain bar, d 10, l 30, E 600 GPa, loaded at the tip: l^3 / (3 E I) = 27000 / (3 * 6e5 * 490.874).

    >>> bar = Cutter(10.0, 4, 0.0, 30.0, 30.0, 6e5)
    >>> round(float(compliance(bar, 0.0, 0.0, fluted_factor=1.0)) * 1e6, 4)
    30.5577
    """
    a = np.asarray(z_force, dtype=np.float64)
    b = np.asarray(z_point, dtype=np.float64)
    for name, z in (("z_force", a), ("z_point", b)):
        bad = ~((z >= 0.0) & (z <= cutter.overhang))
        if bad.any():
            raise InputError(
                f"compliance: {name} = {z[bad].flat[0]:g} mm: must be from 0 to cutter.overhang_mm = "
                f"{cutter.overhang:g}"
            )
    flex_fluted, flex_shank = flexibilities(cutter, fluted_factor)
    top = np.maximum(a, b)
    c = np.abs(a - b)

    def moment(t: NDArray[np.float64]) -> NDArray[np.float64]:
        return t**3 / 3.0 + c * t**2 / 2.0

    in_flutes = moment(np.maximum(cutter.flute_length - top, 0.0))
    return np.asarray(flex_fluted * in_flutes + flex_shank * (moment(cutter.overhang - top) - in_flutes))
