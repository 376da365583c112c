"""Job tables of vibration in a thin-wall job."""

from __future__ import annotations

from pydantic import Field

from chipload.jobs.tables import Count, Positive, Table


class WallModeTable(Table):
    """A mode of the cutter with holder and spindle, equal in all directions across its axis."""

    frequency_hz: Positive = Field(description="natural frequency")
    damping_ratio: Positive = Field(lt=1.0, description="damping ratio; there is no default")
    stiffness_n_um: Positive = Field(description="modal stiffness at the tip")


class WallDynamicsTable(Table):
    """Vibration of wall and cutter. It limits the depth of each pass, and sets the spindle speed of each."""

    damping_ratio: Positive = Field(lt=1.0, description="damping ratio of the wall's modes; there is no default")
    modes: Count = Field(4, le=12, description="number of lowest modes of the wall in each state of removal")
    mode: tuple[WallModeTable, ...] = Field(
        (), description="modes of the cutter; none: the cutter is rigid, and the stability margin is unproven"
    )
    margin: Positive = Field(1.0, ge=1.0, description="least stability margin that every pass must have")
    least_rpm: Positive | None = Field(
        None, description="least spindle speed of a pass; none: speed_rpm of the operation"
    )
    most_rpm: Positive | None = Field(
        None, description="greatest spindle speed of a pass; none: speed_rpm of the operation"
    )
