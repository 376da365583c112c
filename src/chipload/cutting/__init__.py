"""Cutting: force coefficients, force, torque and power, cutter stress, and the form error of a wall."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.cutting.fit import Fit, fit_average, predict, predict_forces
    from chipload.cutting.fit_turns import fit_instantaneous
    from chipload.cutting.force import forces_along, forces_over_turn, mean_forces
    from chipload.cutting.material import Material, material_named, material_names, read_material
    from chipload.cutting.measured import read_forces
    from chipload.cutting.strength import allowed_stress, cutter_stress
    from chipload.cutting.turns import MeasuredCut, turns_of

__all__ = [
    "Fit",
    "Material",
    "MeasuredCut",
    "allowed_stress",
    "cutter_stress",
    "fit_average",
    "fit_instantaneous",
    "forces_along",
    "forces_over_turn",
    "material_named",
    "material_names",
    "mean_forces",
    "predict",
    "predict_forces",
    "read_forces",
    "read_material",
    "turns_of",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "material": "Material material_named material_names read_material",
        "force": "forces_over_turn mean_forces forces_along",
        "strength": "cutter_stress allowed_stress",
        "measured": "read_forces",
        "turns": "MeasuredCut turns_of",
        "fit": "Fit fit_average predict predict_forces",
        "fit_turns": "fit_instantaneous",
    },
)
