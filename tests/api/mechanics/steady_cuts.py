"""A cutter, a material and engagements of steady cuts for the tests of the mechanics library."""

from __future__ import annotations

import chipload

#: coefficients without a source in the world, chosen so that each term of a sum shows
METAL = chipload.Material("plain", 1000.0, 300.0, 200.0, 10.0, 5.0, 2.0, source="made up for tests")


def mill(**changed) -> chipload.Cutter:
    """A flat end mill, its tool number not stated."""
    numbers = {
        "diameter_mm": 10.0, "flutes": 4, "helix_deg": 0.0, "flute_length_mm": 22.0, "overhang_mm": 35.0,
        "modulus_gpa": 580.0,
    }  # fmt: skip
    return chipload.Cutter(**{**numbers, **changed})


def engagement(milling="slot", ap=2.0, ae=None, **cutter) -> chipload.CutEngagement:
    return chipload.engagement_of_cut(mill(**cutter), axial_depth_mm=ap, radial_depth_mm=ae, milling=milling)
