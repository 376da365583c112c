"""Simulation and checks of a program: stock, cutters, material, machine and limits in, loads and verdict out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.checking.default_checks import DefaultChecks
    from chipload.checking.limits import program_limits
    from chipload.checking.outcome import ChangedText, ProgramResult, SimulationResult, SpeedResult, ToolSpeed
    from chipload.checking.result import program_result
    from chipload.checking.run import simulated
    from chipload.checking.stability import StabilityResult
    from chipload.checking.workpiece_compliance import WorkpieceCompliance

__all__ = [
    "ChangedText",
    "DefaultChecks",
    "ProgramResult",
    "SimulationResult",
    "SpeedResult",
    "StabilityResult",
    "ToolSpeed",
    "WorkpieceCompliance",
    "program_limits",
    "program_result",
    "simulated",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "default_checks": "DefaultChecks",
        "limits": "program_limits",
        "outcome": "ChangedText ProgramResult SimulationResult SpeedResult ToolSpeed",
        "result": "program_result",
        "run": "simulated",
        "stability": "StabilityResult",
        "workpiece_compliance": "WorkpieceCompliance",
    },
)
