"""The simulation of a program in its stock, shared by the jobs ``program`` and ``feeds``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.simulation.dynamics_tables import DynamicsTable, ModeTable
    from chipload.jobs.simulation.job import ProgramJob, program_job
    from chipload.jobs.simulation.limits import program_limits
    from chipload.jobs.simulation.outcome import ChangedText, ProgramResult, SimulationResult, SpeedResult, ToolSpeed
    from chipload.jobs.simulation.result import program_result
    from chipload.jobs.simulation.run import simulated
    from chipload.jobs.simulation.stability import StabilityResult
    from chipload.jobs.simulation.tables import FixtureTable, SimulateTable, SimulationJobTable, SolidTable, TargetTable
    from chipload.jobs.simulation.workpiece_compliance import WorkpieceCompliance

__all__ = [
    "ChangedText",
    "DynamicsTable",
    "FixtureTable",
    "ModeTable",
    "ProgramJob",
    "ProgramResult",
    "SimulateTable",
    "SimulationJobTable",
    "SimulationResult",
    "SolidTable",
    "SpeedResult",
    "StabilityResult",
    "TargetTable",
    "ToolSpeed",
    "WorkpieceCompliance",
    "program_job",
    "program_limits",
    "program_result",
    "simulated",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "dynamics_tables": "DynamicsTable ModeTable",
        "job": "ProgramJob program_job",
        "limits": "program_limits",
        "outcome": "ChangedText ProgramResult SimulationResult SpeedResult ToolSpeed",
        "result": "program_result",
        "run": "simulated",
        "stability": "StabilityResult",
        "tables": "FixtureTable SimulateTable SimulationJobTable SolidTable TargetTable",
        "workpiece_compliance": "WorkpieceCompliance",
    },
)
