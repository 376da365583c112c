"""The job tables of vibration: modes of cutter and workpiece, process damping and new spindle speeds."""

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
    """A mode of vibration at the tip of the cutter, or of the workpiece where it is cut."""

    tool: Count | None = Field(None, description="tool number; default: every tool")
    of: Literal["cutter", "workpiece"] = Field(
        "cutter", description="vibrating body; cutter includes holder and spindle"
    )
    frequency_hz: Positive = Field(description="natural frequency")
    damping_ratio: Positive | None = Field(None, lt=1.0, description="damping ratio; without it, stability is unproven")
    stiffness_n_um: Positive | None = Field(None, description="modal stiffness")
    mass_kg: Positive | None = Field(None, description="modal mass, instead of stiffness_n_um")
    direction: Direction = Field(description="direction in machine coordinates: x, y, z, [x, y] or [x, y, z]")


class ProcessDampingTable(Table):
    """Damping by a worn edge that rubs, greatest at low speeds. To leave it out is the safe assumption."""

    indentation_n_mm3: Positive = Field(description="indentation force of the edge per displaced volume")
    wear_land_mm: Positive = Field(description="least width of the wear land during the cut")
    friction: NotNegative = Field(0.0, description="coefficient of friction between edge and workpiece")


class DynamicsTable(Table):
    """Modes of vibration of cutter and workpiece. They give each step a stability margin."""

    file: Text | None = Field(None, description="file with [[mode]] tables, as chipload tap writes it")
    mode: tuple[ModeTable, ...] = Field((), description="modes stated in the job")
    frequency_percent: NotNegative | None = Field(
        None, lt=100.0, description="standard deviation of the natural frequencies; with it and the next two keys, "
        "each step has a probability of stability",
    )  # fmt: skip
    damping_percent: NotNegative | None = Field(None, lt=100.0, description="standard deviation of the damping ratios")
    stiffness_percent: NotNegative | None = Field(
        None, lt=100.0, description="standard deviation of the modal stiffnesses"
    )
    process_damping: ProcessDampingTable | None = Field(None, description="damping by worn edges; default: left out")


class ModesFileTable(Table):
    """A file of modes."""

    mode: tuple[ModeTable, ...] = Field(min_length=1)
    source: str = ""


class SpeedsTable(Table):
    """New spindle speeds with the greatest stability margin for each tool or zone, at unchanged feed per tooth."""

    by: Literal["tool", "zone"] = Field(
        "tool", description="tool: one speed for each tool; zone: if no speed is quiet for all passes of a tool, the "
        "speed changes between passes, outside the material",
    )  # fmt: skip
    least_rpm: Positive | None = Field(None, description="least speed; default: that of the machine")
    most_rpm: Positive | None = Field(None, description="greatest speed; default: that of the machine")
