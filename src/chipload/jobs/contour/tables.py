"""The tables of a job that plans contours and pockets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from chipload.cutter.table import CutterTable
from chipload.jobs.tables import (
    ChecksTable,
    Count,
    Limits,
    LineNumber,
    NotNegative,
    Number,
    Positive,
    SourceTable,
    Table,
    Text,
    Unit,
)

Engagement = Annotated[float, Field(ge=2.0, le=150.0)]
Hole = tuple[Number, Number, Positive]
Strategy = Literal["plain", "backward", "feed", "pocket", "trochoidal"]
#: strategies by the kind of operation that compares them
STRATEGIES: Mapping[str, tuple[str, ...]] = {
    "contour": ("plain", "backward", "feed"),
    "pocket": ("pocket", "trochoidal"),
}


class PartTable(Table):
    """What is to be made: a drawing (DXF), a model (STEP), or the finish path of a program (NC, CL data)."""

    file: Text
    units: Unit | None = Field(None, description="overrides the units of the drawing")
    units_if_unstated: Unit | None = Field(None, description="units of a drawing that names none")
    layers: tuple[Text, ...] = Field(
        (), description="layers that are read; none: all that the drawing shows, neither off nor frozen"
    )
    join_mm: NotNegative = Field(0.01, le=10.0, description="gaps up to this are closed and reported")
    open_chains: Literal["kept", "dropped"] = Field(
        "kept", description="`dropped`: lines that close no contour, as centre lines, are left out and reported"
    )
    tolerance_mm: Positive = Field(0.001, ge=1e-6, le=1.0, description="how far arcs may leave splines and ellipses")
    stock_layers: tuple[Text, ...] = Field(
        (), description="layers of a drawing that hold the outline of the stock of a pocket; none: material everywhere"
    )
    lines: tuple[LineNumber, ...] = Field(
        (),
        description="first and last line of a program that make the wall, of each height in turn, from above; none: "
        "all that cuts below the stock's top",
    )
    labels: tuple[Text, ...] = Field(
        (),
        max_length=2,
        description="in place of lines: a text of the program (block number, comment) behind which the wall begins, at "
        "each height anew, and one before which it ends; none: where the cut ends",
    )
    face_z_mm: Number | None = Field(None, description="height of the planar face of a STEP file")
    origin_mm: tuple[Number, Number] = Field(
        (0.0, 0.0), description="place of a drawing or a model that is X0 Y0 of the job and of the program"
    )


class StockTable(Table):
    """What it is made from."""

    top_mm: Number = Field(description="z of the top of the stock")
    file: Text | None = Field(
        None,
        description="stock.npz of an earlier result: pockets cut what stands in it; none: material everywhere, or as "
        "part.stock_layers, holes_mm and rest_of say",
    )


class FloorFinishTable(Table):
    """The finish pass of the floor of a pocket, which takes floor_allowance_mm."""

    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's centre")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")


class WallFinishTable(Table):
    """The finish passes of the walls of a pocket, which take allowance_mm within the same engagement."""

    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's centre")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    axial_depth_mm: Positive | None = Field(
        None, description="greatest depth of a level; none: the whole depth of the pocket in one"
    )
    allowance_mm: NotNegative = Field(0.0, description="left on the walls in turn")


class TabsTable(Table):
    """Strips that stay over the floor of a pocket, straight across it, and hold what it cuts out."""

    at_mm: tuple[tuple[Number, Number], ...] = Field(
        min_length=1, description="x, y of each on the wall of what is held"
    )
    width_mm: Positive
    height_mm: Positive = Field(description="of their tops over the floor")


class OperationTable(Table):
    """One operation; which keys it needs depends on its kind, see :data:`NEEDS`."""

    kind: Literal["contour", "forward", "pocket"]
    cutter: Count = Field(description="number of a [[cutter]]")
    milling: Literal["down", "up"]
    radial_depth_mm: Positive | None = Field(None, description="depth of cut across the wall")
    axial_depth_mm: Positive = Field(description="depth of cut along the axis; of a pocket, the greatest of a level")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's centre")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    step_mm: Positive = Field(ge=1e-4, le=10.0, description="step of the history")
    clearance_mm: Positive = Field(description="height of rapids above the top of the stock")
    side: Literal["inside", "outside", "left", "right"] | None = Field(
        None, description="where the cutter runs; outside of a pocket: around the contours, within the stock"
    )
    strategies: tuple[Strategy, ...] | None = Field(
        None, description="compared: plain, backward, feed of a contour; pocket, trochoidal of a pocket, none: pocket"
    )
    use: Strategy | None = Field(None, description="the strategy whose program is released")
    joint: Literal["sharp", "clothoid"] | None = None
    semifinish_depth_mm: Positive | None = Field(
        None, le=100.0, description="radial depth of the first pass on a straight wall"
    )
    passes: Count | None = Field(None, description="passes before the finish pass, or passes of forward")
    tolerance_mm: Positive | None = Field(
        None, ge=1e-6, le=1.0, description="how far eased joints may leave the drawing"
    )
    lead_mm: Positive | None = Field(None, le=1000.0, description="radius of the lead-in")
    allowance_mm: NotNegative | None = Field(None, description="left on the wall, by clearing where it is finished")
    floor_allowance_mm: NotNegative | None = Field(None, description="left on the floor by clearing; none: 0")
    floor_finish: FloorFinishTable | None = Field(
        None, description="finish pass of the floor; none: it keeps floor_allowance_mm"
    )
    wall_finish: WallFinishTable | None = Field(
        None, description="finish passes of the walls; none: they keep allowance_mm"
    )
    tabs: TabsTable | None = Field(None, description="strips that stay over the floor; none: nothing stays")
    link_feed_mm_min: Positive | None = Field(
        None, le=1e5, description="feed of links through cleared space; none: the machine's greatest feed"
    )
    link_lift_mm: NotNegative | None = Field(None, description="clearance of long links above the floor; none: 0.1")
    engagement_deg: Literal["limit"] | Engagement | None = Field(
        None,
        description="engagement that a pocket keeps, instead of radial_depth_mm; limit: the greatest within all limits",
    )
    entry: Literal["helix", "ramp"] | None = Field(
        None, description="into the solid: a helical bore, or a ramp to and fro along a straight line; none: helix"
    )
    depth_mm: Positive | None = Field(
        None, description="of the pocket, cut in equal levels of at most axial_depth_mm; none: one level"
    )
    holes_mm: tuple[Hole, ...] | None = Field(
        None, description="pre-drilled holes to enter by, as deep as the pocket: x, y, diameter of each"
    )
    rest_of: int | None = Field(
        None,
        ge=0,
        description="number of an earlier pocket operation, from 0: rest machining of what its larger cutter left",
    )


class ContourLimitsTable(Limits):
    """What a planned program must not exceed."""

    engagement_deg: Positive | None = Field(None, le=180.0)
    force_xy_n: Positive | None = None
    torque_nm: Positive | None = None
    form_error_um: Positive | None = None


class ContourJobTable(Table):
    """The whole file of a job that is planned."""

    part: PartTable
    stock: StockTable
    machine: SourceTable
    material: SourceTable
    cutter: tuple[CutterTable, ...] = Field(min_length=1)
    operation: tuple[OperationTable, ...] = Field(min_length=1)
    limits: ContourLimitsTable = Field(default_factory=ContourLimitsTable.model_construct)
    checks: ChecksTable = Field(default_factory=ChecksTable.model_construct)


#: keys that every planned operation needs
ALWAYS = {"kind", "cutter", "milling", "axial_depth_mm", "feed_mm_min", "speed_rpm", "step_mm"}


#: keys that each kind needs beside those that all need
NEEDS: Mapping[str, tuple[str, ...]] = {
    "contour": ("side", "strategies", "joint", "radial_depth_mm", "semifinish_depth_mm", "tolerance_mm", "lead_mm"),
    "forward": ("side", "radial_depth_mm", "lead_mm"),
    "pocket": (),
}


#: keys that each kind also understands
MAY: Mapping[str, tuple[str, ...]] = {
    "contour": ("use", "passes"),
    "forward": ("passes",),
    "pocket": (
        "strategies",
        "use",
        "side",
        "radial_depth_mm",
        "engagement_deg",
        "depth_mm",
        "holes_mm",
        "rest_of",
        "allowance_mm",
        "floor_allowance_mm",
        "floor_finish",
        "wall_finish",
        "tabs",
        "entry",
        "link_feed_mm_min",
        "link_lift_mm",
    ),
}
