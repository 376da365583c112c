"""Simulation and checks of a program: stock, cutters, material, machine and limits in, loads and verdict out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.checking.clamped import Workpiece, WorkpieceClamp
    from chipload.checking.default_checks import DefaultChecks
    from chipload.checking.dynamics import Mode, Vibration
    from chipload.checking.history import History
    from chipload.checking.inputs import CheckInputs, Elasticity
    from chipload.checking.limits import program_limits
    from chipload.checking.outcome import ChangedText, ProgramResult, SimulationResult, SpeedResult, ToolSpeed
    from chipload.checking.result import program_result
    from chipload.checking.run import simulate_program
    from chipload.checking.settings import CheckSettings, Limits, SimulationSettings
    from chipload.checking.stability import StabilityResult
    from chipload.checking.stiffness import MachineStiffness
    from chipload.checking.workpiece import FinishedPart, Fixture, Stock, Surroundings
    from chipload.checking.workpiece_compliance import WorkpieceCompliance

__all__ = [
    "ChangedText",
    "CheckInputs",
    "CheckSettings",
    "DefaultChecks",
    "Elasticity",
    "FinishedPart",
    "Fixture",
    "History",
    "Limits",
    "MachineStiffness",
    "Mode",
    "ProgramResult",
    "SimulationResult",
    "SimulationSettings",
    "SpeedResult",
    "StabilityResult",
    "Stock",
    "Surroundings",
    "ToolSpeed",
    "Vibration",
    "Workpiece",
    "WorkpieceClamp",
    "WorkpieceCompliance",
    "program_limits",
    "program_result",
    "simulate_program",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "clamped": "Workpiece WorkpieceClamp",
        "default_checks": "DefaultChecks",
        "dynamics": "Mode Vibration",
        "history": "History",
        "inputs": "CheckInputs Elasticity",
        "limits": "program_limits",
        "outcome": "ChangedText ProgramResult SimulationResult SpeedResult ToolSpeed",
        "result": "program_result",
        "run": "simulate_program",
        "settings": "CheckSettings Limits SimulationSettings",
        "stability": "StabilityResult",
        "stiffness": "MachineStiffness",
        "workpiece": "FinishedPart Fixture Stock Surroundings",
        "workpiece_compliance": "WorkpieceCompliance",
    },
)
