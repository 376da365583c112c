"""chipload simulates, checks and plans CNC milling of parts that are hard to mill.

The public names are those of ``__all__``. Each is imported on first access, so that ``import chipload`` stays
light. The names of keys and columns state their units, as in the job file: ``Cutter(diameter_mm=10, ...)``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from chipload.api.contours import FlatStock, plan_contour, plan_pocket
    from chipload.api.jobs import check_job, load_result, run_job, write_result
    from chipload.api.loads import fit_coefficients, hold_torque, optimise_feeds
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
    from chipload.api.planning import plan_impeller, plan_thin_wall
    from chipload.api.reading import read_machine, read_material, read_program
    from chipload.api.simulation import simulate
    from chipload.checking.clamped import Workpiece, WorkpieceClamp
    from chipload.checking.dynamics import Mode, Vibration
    from chipload.checking.history import History
    from chipload.checking.settings import CheckSettings, Limits, SimulationSettings
    from chipload.checking.stiffness import MachineStiffness
    from chipload.checking.workpiece import FinishedPart, Fixture, Stock
    from chipload.control.learning import LearnedMaterial
    from chipload.control.logs import SpindleLog
    from chipload.cutter.table import CutterTable as Cutter
    from chipload.cutting.fit import Fit
    from chipload.cutting.material import Material
    from chipload.cutting.turns import MeasuredCut
    from chipload.errors import Finding, InputError
    from chipload.geometry.contour import Contour
    from chipload.geometry.dxf import read_dxf
    from chipload.jobs.contour.tables import ContourLimitsTable as ContourLimits
    from chipload.jobs.contour.tables import OperationTable as Operation
    from chipload.machine.machine import Machine
    from chipload.program.program import Program
    from chipload.result.columns import COLUMNS
    from chipload.result.limits import LimitCheck
    from chipload.result.result import Result
    from chipload.result.track import Track
    from chipload.result.verdict import Verdict

    __version__: str

__all__ = [
    "COLUMNS",
    "CheckSettings",
    "ChipPiece",
    "ClampedPart",
    "Contour",
    "ContourLimits",
    "CutEngagement",
    "Cutter",
    "Finding",
    "FinishedPart",
    "Fit",
    "Fixture",
    "FlatStock",
    "History",
    "InputError",
    "LearnedMaterial",
    "LimitCheck",
    "Limits",
    "LocationErrors",
    "Machine",
    "MachineStiffness",
    "Material",
    "MeasuredCut",
    "Mode",
    "NaturalModes",
    "Operation",
    "Plate",
    "Program",
    "Result",
    "SimulationSettings",
    "SpeedMargins",
    "SpindleLog",
    "StabilityLobes",
    "Stock",
    "Track",
    "TurnForces",
    "UndeformedChip",
    "Verdict",
    "Vibration",
    "WallErrors",
    "Workpiece",
    "WorkpieceClamp",
    "check_job",
    "chip_on_layer",
    "compliance",
    "engagement_of_cut",
    "fit",
    "fit_coefficients",
    "hold_torque",
    "learn",
    "load_result",
    "measured_cut",
    "modes",
    "optimise_feeds",
    "plan_contour",
    "plan_impeller",
    "plan_pocket",
    "plan_thin_wall",
    "read_dxf",
    "read_machine",
    "read_material",
    "read_program",
    "run_job",
    "simulate",
    "spindle_log",
    "stability_chart",
    "stability_margin",
    "surface_location_error",
    "tooth_forces",
    "undeformed_chip",
    "wall_form_error",
    "write_result",
]

#: module and name of each that is not a function of ``chipload.api``
_PLACES = {
    "COLUMNS": ("chipload.result.columns", "COLUMNS"),
    "CheckSettings": ("chipload.checking.settings", "CheckSettings"),
    "ChipPiece": ("chipload.api.mechanics.layer_chip", "ChipPiece"),
    "ClampedPart": ("chipload.api.mechanics.bodies", "ClampedPart"),
    "Contour": ("chipload.geometry.contour", "Contour"),
    "ContourLimits": ("chipload.jobs.contour.tables", "ContourLimitsTable"),
    "CutEngagement": ("chipload.api.mechanics.cut", "CutEngagement"),
    "Cutter": ("chipload.cutter.table", "CutterTable"),
    "Finding": ("chipload.errors", "Finding"),
    "FinishedPart": ("chipload.checking.workpiece", "FinishedPart"),
    "Fit": ("chipload.cutting.fit", "Fit"),
    "Fixture": ("chipload.checking.workpiece", "Fixture"),
    "FlatStock": ("chipload.api.contours", "FlatStock"),
    "History": ("chipload.checking.history", "History"),
    "InputError": ("chipload.errors", "InputError"),
    "LearnedMaterial": ("chipload.control.learning", "LearnedMaterial"),
    "LimitCheck": ("chipload.result.limits", "LimitCheck"),
    "Limits": ("chipload.checking.settings", "Limits"),
    "LocationErrors": ("chipload.api.mechanics.stability", "LocationErrors"),
    "SpindleLog": ("chipload.control.logs", "SpindleLog"),
    "Machine": ("chipload.machine.machine", "Machine"),
    "MachineStiffness": ("chipload.checking.stiffness", "MachineStiffness"),
    "Material": ("chipload.cutting.material", "Material"),
    "MeasuredCut": ("chipload.cutting.turns", "MeasuredCut"),
    "Mode": ("chipload.checking.dynamics", "Mode"),
    "NaturalModes": ("chipload.api.mechanics.bodies", "NaturalModes"),
    "Operation": ("chipload.jobs.contour.tables", "OperationTable"),
    "Plate": ("chipload.api.mechanics.bodies", "Plate"),
    "Program": ("chipload.program.program", "Program"),
    "Result": ("chipload.result.result", "Result"),
    "SimulationSettings": ("chipload.checking.settings", "SimulationSettings"),
    "SpeedMargins": ("chipload.api.mechanics.stability", "SpeedMargins"),
    "StabilityLobes": ("chipload.api.mechanics.stability", "StabilityLobes"),
    "Stock": ("chipload.checking.workpiece", "Stock"),
    "Track": ("chipload.result.track", "Track"),
    "TurnForces": ("chipload.api.mechanics.forces", "TurnForces"),
    "UndeformedChip": ("chipload.api.mechanics.chip", "UndeformedChip"),
    "Verdict": ("chipload.result.verdict", "Verdict"),
    "Vibration": ("chipload.checking.dynamics", "Vibration"),
    "WallErrors": ("chipload.api.mechanics.wall", "WallErrors"),
    "Workpiece": ("chipload.checking.clamped", "Workpiece"),
    "WorkpieceClamp": ("chipload.checking.clamped", "WorkpieceClamp"),
    "read_dxf": ("chipload.geometry.dxf", "read_dxf"),
}

#: module of ``chipload.api`` of each function
_FUNCTIONS = {
    name: module
    for module, names in {
        "jobs": "check_job load_result run_job write_result",
        "loads": "fit_coefficients hold_torque optimise_feeds",
        "contours": "plan_contour plan_pocket",
        "mechanics.bodies": "compliance modes",
        "mechanics.wall": "wall_form_error",
        "mechanics.chip": "undeformed_chip",
        "mechanics.cut": "engagement_of_cut",
        "mechanics.coefficients": "fit measured_cut",
        "mechanics.forces": "tooth_forces",
        "mechanics.layer_chip": "chip_on_layer",
        "mechanics.learning": "learn spindle_log",
        "mechanics.stability": "stability_chart stability_margin surface_location_error",
        "planning": "plan_impeller plan_thin_wall",
        "reading": "read_machine read_material read_program",
        "simulation": "simulate",
    }.items()
    for name in names.split()
}


def __getattr__(name: str) -> Any:
    """Import a public name on first access."""
    if name == "__version__":
        from importlib.metadata import version

        return version("chipload")
    if name not in __all__:
        raise AttributeError(f"module 'chipload' has no attribute {name!r}")
    from importlib import import_module

    module, own = _PLACES.get(name) or (f"chipload.api.{_FUNCTIONS[name]}", name)
    value = globals()[name] = getattr(import_module(module), own)
    return value


def __dir__() -> list[str]:
    """The public names."""
    return sorted([*__all__, "__version__"])
