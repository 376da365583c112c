"""The job tables of a simulation and their checks, shared by the jobs ``program``, ``feeds`` and ``torque``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipload.lazy import attach

if TYPE_CHECKING:
    from chipload.jobs.simulation.dynamics_tables import DynamicsTable, ModeTable
    from chipload.jobs.simulation.job import ProgramJob, program_job
    from chipload.jobs.simulation.tables import FixtureTable, SimulateTable, SimulationJobTable, SolidTable, TargetTable

__all__ = [
    "DynamicsTable",
    "FixtureTable",
    "ModeTable",
    "ProgramJob",
    "SimulateTable",
    "SimulationJobTable",
    "SolidTable",
    "TargetTable",
    "program_job",
]

__getattr__, __dir__ = attach(
    __name__,
    {
        "dynamics_tables": "DynamicsTable ModeTable",
        "job": "ProgramJob program_job",
        "tables": "FixtureTable SimulateTable SimulationJobTable SolidTable TargetTable",
    },
)
