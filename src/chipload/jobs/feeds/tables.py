"""The tables of a job that gives a program new feeds: those of a simulation, and ``[operation.feeds]``."""

from __future__ import annotations

from pydantic import Field

from chipload.jobs.simulation.tables import SimulateTable, SimulationJobTable
from chipload.jobs.tables import NotNegative, Positive, Table


class FeedsTable(Table):
    """New feeds for the lines of the program, as fast as the stated limits allow. The path does not change."""

    slowest_percent: Positive = Field(
        le=100.0, description="least feed of a line that cuts, in percent of the programmed feed"
    )
    fastest_percent: Positive = Field(
        ge=100.0, le=1e4, description="greatest feed of a line that cuts, in percent of the programmed feed"
    )
    fastest_mm_min: Positive | None = Field(None, le=1e6, description="greatest feed of a line that cuts")
    tooth_feed_least_mm: Positive | None = Field(
        None, description="least feed per tooth of a line that cuts, to avoid rubbing"
    )
    air_mm_min: Positive | None = Field(
        None, le=1e6, description="feed of a line that cuts nothing, if it is slower; default: unchanged"
    )
    change_least_percent: NotNegative = Field(
        5.0,
        lt=100.0,
        description="a line keeps the feed of the previous line if its own could be faster by less than this",
    )
    divide: bool = Field(
        True, description="divide lines into segments of one feed each where the engagement changes; the path stays"
    )


class FeedsOperationTable(SimulateTable):
    """Simulate the program, give its lines new feeds, and simulate the new program from fresh stock."""

    feeds: FeedsTable = Field(description="new feeds for the lines of the program")


class FeedsJobTable(SimulationJobTable):
    """The job file of a job that changes the feeds of a program."""

    operation: tuple[FeedsOperationTable, ...] = Field(min_length=1, max_length=1)
