"""The tables of a job that reads a program or runs it through a stock."""

from __future__ import annotations

from chipload.jobs.simulation.tables import SimulationJobTable


class ProgramJobTable(SimulationJobTable):
    """The whole file of a job that runs a program instead of a plan; with an operation it is simulated."""
