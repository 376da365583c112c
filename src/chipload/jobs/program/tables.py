"""The tables of a job that reads a program or runs it through a stock, in one setup or in several."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from chipload.jobs.simulation.tables import (
    MachineTableTable,
    SimulationJobTable,
    SolidTable,
    TargetTable,
    WorkholdingTable,
)
from chipload.jobs.tables import LineNumber, Number, Point, Table, Text


class FlipTable(Table):
    """How the part is turned from the setup before: about an axis of the coordinates of that setup."""

    axis: Literal["x", "y", "z"] = Field(description="axis about which the part is turned")
    angle_deg: Number = Field(
        180.0,
        ge=-360.0,
        le=360.0,
        description="counter-clockwise, seen from the positive side of the axis; about x and y a multiple of 90",
    )


class SetupTable(Table):
    """A setup of the part. Setups run in their order; each begins with the stock that the one before leaves."""

    file: Text | None = Field(None, description="its program; default: that of [program]")
    lines: tuple[LineNumber, LineNumber] | None = Field(
        None, description="first and last line of the program that it runs; default: all"
    )
    work_offset: Text | None = Field(
        None, description="work offset whose coordinates stock, part and fixtures use; default: the first it uses"
    )
    flip: FlipTable | None = Field(None, description="turn of the part from the setup before; default: none")
    zero: tuple[Literal["x-", "x0", "x+"], Literal["y-", "y0", "y+"], Literal["z-", "z0", "z+"]] | None = Field(
        None,
        description="place of the program's zero on the turned stock that is left: lower side, middle or upper side of "
        "the box around it",
    )
    zero_mm: Point | None = Field(None, description="the same as a point of the turned coordinates of the setup before")
    stock: SolidTable | None = Field(None, description="a new stock; default: what the setup before leaves")
    part: TargetTable | None = Field(None, description="the part after this setup, in its coordinates")
    fixture: tuple[WorkholdingTable, ...] = Field((), description="fixtures of this setup, in its coordinates")
    machine_table: MachineTableTable | None = Field(None, description="table or pallet under the workpiece")


class ProgramJobTable(SimulationJobTable):
    """The job file of a job with an existing program; an operation simulates it."""

    setup: tuple[SetupTable, ...] = Field((), max_length=20)
