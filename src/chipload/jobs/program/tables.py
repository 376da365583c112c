"""The tables of a job that reads a program or runs it through a stock."""

from __future__ import annotations

from chipload.jobs.simulation.tables import SimulationJobTable


class ProgramJobTable(SimulationJobTable):
    """The job file of a job with an existing program; an operation simulates it."""
