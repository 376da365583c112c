"""Shapes of FreeCAD's tool bits beside end mills: points, V-bits, and bodies whose chips are not simulated.

The names are FreeCAD's: of the shape file, and of the sizes [mm, deg] that it has.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from chipload.cutter.bodies import cylinder, dovetail, one_thread, saw, tap_core
from chipload.errors import InputError

#: gives a size by its name; None: the tool bit does not state it
Size = Callable[[str], float | None]
#: shapes that :func:`special_shape` knows
SPECIAL = ("drill", "vbit", "reamer", "tap", "threadmill", "dovetail", "slittingsaw")
#: the smallest tip that can be simulated [mm]
_TIP = 0.01


def special_shape(shape: str, size: Size, label: str) -> dict[str, Any]:
    """Keys of the ``[[cutter]]`` that the sizes of a shape of :data:`SPECIAL` mean, beside diameter, flutes, lengths.

    Raises
    ------
    InputError
        A size is missing.

    >>> special_shape("drill", {"Diameter": 3.0, "TipAngle": 118.0}.get, "bit")
    {'bottom_deg': 31.0}
    """

    def need(*names: str) -> float:
        for name in names:
            value = size(name)
            if value is not None and value > 0.0:
                return value
        raise InputError(f"{label}: shape {shape}: {' or '.join(names)}: must be given and above 0")

    if shape == "drill":
        return {"bottom_deg": max(90.0 - 0.5 * need("TipAngle"), 0.0)}
    d = need("Diameter")
    if shape == "vbit":
        tip = max(size("TipDiameter") or 0.0, _TIP)
        half = 0.5 * need("CuttingEdgeAngle")
        if not (tip < d and half < 90.0):
            raise InputError(f"{label}: TipDiameter {tip:g}, CuttingEdgeAngle {2.0 * half:g}: must be below {d:g}, 180")
        high = 0.5 * (d - tip) / math.tan(math.radians(half))
        return {"diameter_mm": tip, "taper_deg": half, "shank_diameter_mm": d, "flute_length_mm": high}
    if shape == "slittingsaw":
        cap = size("CapDiameter") or 0.0, size("CapHeight") or 0.0
        return _body(saw(d, need("BladeThickness"), cap if min(cap) > 0.0 else (0.0, 0.0)))
    if shape in ("threadmill", "dovetail"):
        neck, high, crest = need("NeckDiameter"), size("NeckLength") or 0.0, size("Crest") or 0.0
        angle = math.radians(need("cuttingAngle", "CuttingAngle"))
        if not (neck < d and 0.0 < angle < 0.5 * math.pi):
            raise InputError(f"{label}: shape {shape}: NeckDiameter, CuttingAngle: must be below {d:g} mm and 90 deg")
        if shape == "threadmill":
            return _body(one_thread(d, neck, crest, angle, high))
        return _body(dovetail(d, neck, need("DovetailHeight"), angle, high))
    high = need("CuttingEdgeLength", "CuttingEdgeHeight", "Length")
    if shape == "tap":
        pitch = size("Pitch") or 0.0
        return _body(tap_core(d, pitch, high) if 0.0 < pitch < 0.5 * d else cylinder(d, high))
    return _body(cylinder(d, high))


def _body(points: tuple[tuple[float, float], ...]) -> dict[str, Any]:
    """A body, whose diameter and length are its own."""
    return {"body_mm": points, "diameter_mm": 2.0 * max(r for r, _ in points), "flute_length_mm": points[-1][1]}
