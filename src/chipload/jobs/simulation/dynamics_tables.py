"""The tables of a job about vibration: modes of cutter and workpiece, and speeds that are asked for."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from chipload.jobs.tables import Count, NotNegative, Number, Positive, Table, Text


def _direction(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Direction = Annotated[
    Literal["x", "y", "z"] | tuple[Number, Number] | tuple[Number, Number, Number], BeforeValidator(_direction)
]


class ModeTable(Table):
    """A mode of vibration at the cutter's tip, or of the workpiece where it is cut."""

    tool: Count | None = Field(None, description="tool number; none: every tool")
    of: Literal["cutter", "workpiece"] = Field("cutter", description="cutter: with holder and spindle")
    frequency_hz: Positive = Field(description="natural frequency")
    damping_ratio: Positive | None = Field(None, lt=1.0, description="not stated: stability is unproven")
    stiffness_n_um: Positive | None = Field(None, description="modal stiffness")
    mass_kg: Positive | None = Field(None, description="modal mass, in place of stiffness_n_um")
    direction: Direction = Field(description="x, y, z, [x, y] or [x, y, z] of the machine")


class ProcessDampingTable(Table):
    """Damping by a worn edge that rubs, most at low speeds; without it none is counted, which is the safe side."""

    indentation_n_mm3: Positive = Field(description="force per volume that the edge displaces, of workpiece and edge")
    wear_land_mm: Positive = Field(description="width of the wear land: state the least that it will have")
    friction: NotNegative = Field(0.0, description="between edge and workpiece")


class DynamicsTable(Table):
    """Modes of vibration of cutter and workpiece: with them every step has a stability margin."""

    file: Text | None = Field(None, description="modes as [[mode]], as chipload tap writes them")
    mode: tuple[ModeTable, ...] = Field((), description="modes in the job")
    frequency_percent: NotNegative | None = Field(
        None, lt=100.0, description="standard deviation of the frequencies; stated with the next two: each step has a "
        "probability of stability",
    )  # fmt: skip
    damping_percent: NotNegative | None = Field(None, lt=100.0, description="of the damping ratios")
    stiffness_percent: NotNegative | None = Field(None, lt=100.0, description="of the stiffnesses")
    process_damping: ProcessDampingTable | None = Field(None, description="by worn edges; none: not counted")


class ModesFileTable(Table):
    """A file of modes."""

    mode: tuple[ModeTable, ...] = Field(min_length=1)
    source: str = ""


class SpeedsTable(Table):
    """New spindle speeds with the greatest stability margin, one a tool or one a zone; the feed per tooth stays."""

    by: Literal["tool", "zone"] = Field(
        "tool", description="zone: where one speed is not quiet for all passes of a tool, it changes between passes, "
        "out of the material",
    )  # fmt: skip
    least_rpm: Positive | None = Field(None, description="none: that of the machine")
    most_rpm: Positive | None = Field(None, description="none: that of the machine")
