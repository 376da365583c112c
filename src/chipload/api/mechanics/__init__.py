"""The mechanics of milling as functions on values: chip, forces, stability, surface error, compliance, modes and fit.

Each function takes a cutter, a material, the engagement of a cut, its feed and its speed, and returns arrays of float64
with their units in the names. They call the functions with which the simulation of a program works.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.api.mechanics.bodies import ClampedPart, NaturalModes, Plate, compliance, modes
    from chipload.api.mechanics.chip import UndeformedChip, undeformed_chip
    from chipload.api.mechanics.coefficients import fit, measured_cut
    from chipload.api.mechanics.cut import CutEngagement, engagement_of_cut
    from chipload.api.mechanics.forces import TurnForces, tooth_forces
    from chipload.api.mechanics.layer_chip import ChipPiece, chip_on_layer
    from chipload.api.mechanics.learning import learn, spindle_log
    from chipload.api.mechanics.stability import (
        LocationErrors,
        SpeedMargins,
        StabilityLobes,
        stability_chart,
        stability_margin,
        surface_location_error,
    )
    from chipload.api.mechanics.wall import WallErrors, wall_form_error

__all__ = [
    "ChipPiece",
    "ClampedPart",
    "CutEngagement",
    "LocationErrors",
    "NaturalModes",
    "Plate",
    "SpeedMargins",
    "StabilityLobes",
    "TurnForces",
    "UndeformedChip",
    "WallErrors",
    "chip_on_layer",
    "compliance",
    "engagement_of_cut",
    "fit",
    "learn",
    "measured_cut",
    "modes",
    "spindle_log",
    "stability_chart",
    "stability_margin",
    "surface_location_error",
    "tooth_forces",
    "undeformed_chip",
    "wall_form_error",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "bodies": "ClampedPart NaturalModes Plate compliance modes",
        "chip": "UndeformedChip undeformed_chip",
        "coefficients": "fit measured_cut",
        "cut": "CutEngagement engagement_of_cut",
        "forces": "TurnForces tooth_forces",
        "layer_chip": "ChipPiece chip_on_layer",
        "learning": "learn spindle_log",
        "stability": "LocationErrors SpeedMargins StabilityLobes stability_chart stability_margin "
        "surface_location_error",
        "wall": "WallErrors wall_form_error",
    },
)
