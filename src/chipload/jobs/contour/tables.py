"""The tables of a job that plans contours and pockets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from chipload.cutter.table import CutterTable
from chipload.jobs.simulation.tables import StiffnessTable, WorkpieceTable
from chipload.jobs.tables import (
    Count,
    LimitsTable,
    LineNumber,
    NotNegative,
    Number,
    Positive,
    SourceTable,
    Table,
    Text,
    Unit,
    WallChecksTable,
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
    """The contours to be milled: a drawing (DXF), a model (STEP), or the finish path of a program (NC, CL data)."""

    file: Text = Field(description="path of the drawing, the model or the program")
    units: Unit | None = Field(None, description="unit that replaces the unit of the drawing")
    units_if_unstated: Unit | None = Field(None, description="unit of a drawing that states none")
    layers: tuple[Text, ...] = Field(
        (), description="layers to read; default: all layers that are neither off nor frozen"
    )
    join_mm: NotNegative = Field(0.01, le=10.0, description="gaps up to this width are closed and reported")
    open_chains: Literal["kept", "dropped"] = Field(
        "kept", description="dropped: lines that close no contour, such as centre lines, are left out and reported"
    )
    tolerance_mm: Positive = Field(
        0.001, ge=1e-6, le=1.0, description="greatest deviation of arcs from splines and ellipses"
    )
    stock_layers: tuple[Text, ...] = Field(
        (), description="layers with the outline of the stock of a pocket; default: material everywhere"
    )
    lines: tuple[LineNumber, ...] = Field(
        (),
        description="first and last line of a program that mill the wall, for each height in turn from the top; "
        "default: all lines that cut below the top of the stock",
    )
    labels: tuple[Text, ...] = Field(
        (),
        max_length=2,
        description="instead of lines: a text of the program (block number, comment) after which the wall begins at "
        "each height, and one before which it ends; without the second it ends where the cut ends",
    )
    face_z_mm: Number | None = Field(None, description="height of the planar face of a STEP file")
    origin_mm: tuple[Number, Number] = Field(
        (0.0, 0.0), description="point of the drawing or model that becomes X0 Y0 of the job and the program"
    )


class StockTable(Table):
    """Top of the stock, and the stock that an earlier job left."""

    top_mm: Number = Field(description="z of the top of the stock")
    file: Text | None = Field(
        None,
        description="stock.npz of an earlier result, which pockets continue to cut; default: material everywhere, "
        "except as stated by part.stock_layers, holes_mm and rest_of",
    )


class FloorFinishTable(Table):
    """The finish pass of the floor of a pocket, which removes floor_allowance_mm."""

    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's centre")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")


class WallFinishTable(Table):
    """The finish passes of the walls of a pocket, which remove allowance_mm within the same engagement."""

    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's centre")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    axial_depth_mm: Positive | None = Field(
        None,
        description="greatest depth of a level; default: the whole depth of the pocket, with by_level of a level, at "
        "once",
    )
    allowance_mm: NotNegative = Field(0.0, description="allowance that the wall finish leaves on the walls")
    by_level: bool = Field(
        False,
        description="whether the walls beside a level are finished, in all pockets, before the next level is cleared: "
        "thin walls stand on uncut stock",
    )


class TabsTable(Table):
    """Tabs: strips straight across the floor of a pocket that hold the piece that is cut out."""

    at_mm: tuple[tuple[Number, Number], ...] = Field(
        min_length=1, description="x, y of each tab on the wall of the piece that it holds"
    )
    width_mm: Positive = Field(description="width of a tab")
    height_mm: Positive = Field(description="height of a tab above the floor")


class OperationTable(Table):
    """One operation. The required keys depend on its kind."""

    kind: Literal["contour", "forward", "pocket"] = Field(description="kind of the operation")
    cutter: Count = Field(description="number of a [[cutter]]")
    milling: Literal["down", "up"] = Field(description="down milling (climb) or up milling (conventional)")
    radial_depth_mm: Positive | None = Field(None, description="depth of cut across the wall")
    axial_depth_mm: Positive = Field(
        description="depth of cut along the axis; for a pocket, the greatest depth of a level"
    )
    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's centre")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    step_mm: Positive = Field(ge=1e-4, le=10.0, description="longest step of the history")
    clearance_mm: Positive = Field(description="height of rapids above the top of the stock")
    side: Literal["inside", "outside", "left", "right"] | None = Field(
        None,
        description="side of the contour on which the cutter runs; outside for a pocket: around the contours, within "
        "the stock",
    )
    strategies: tuple[Strategy, ...] | None = Field(
        None,
        description="strategies to compare: plain, backward, feed for a contour; pocket, trochoidal for a pocket "
        "(default pocket)",
    )
    use: Strategy | None = Field(None, description="strategy whose program is released")
    joint: Literal["sharp", "clothoid"] | None = Field(
        None, description="how the parts of a reshaped path are joined: with a corner, or with a clothoid"
    )
    semifinish_depth_mm: Positive | None = Field(
        None, le=100.0, description="radial depth of the first pass on a straight wall"
    )
    passes: Count | None = Field(
        None, description="number of passes before the finish pass; for kind forward, number of passes"
    )
    tolerance_mm: Positive | None = Field(
        None, ge=1e-6, le=1.0, description="greatest deviation of rounded joints from the drawing"
    )
    lead_mm: Positive | None = Field(None, le=1000.0, description="radius of the lead-in")
    allowance_mm: NotNegative | None = Field(
        None, description="allowance on the wall; with wall_finish, the allowance that clearing leaves"
    )
    floor_allowance_mm: NotNegative | None = Field(
        None, description="allowance that clearing leaves on the floor; default 0"
    )
    floor_finish: FloorFinishTable | None = Field(
        None, description="finish pass of the floor; default: the floor keeps floor_allowance_mm"
    )
    wall_finish: WallFinishTable | None = Field(
        None, description="finish passes of the walls; default: the walls keep allowance_mm"
    )
    tabs: TabsTable | None = Field(None, description="tabs that hold what is cut out; default: no tabs")
    link_feed_mm_min: Positive | None = Field(
        None, le=1e5, description="feed of links through cleared space; default: the greatest feed of the machine"
    )
    link_lift_mm: NotNegative | None = Field(None, description="height of long links above the floor; default 0.1")
    engagement_deg: Literal["limit"] | Engagement | None = Field(
        None,
        description="engagement of a pocket, instead of radial_depth_mm; limit: the greatest that all limits allow",
    )
    entry: Literal["helix", "ramp"] | None = Field(
        None, description="entry into the solid: helical bore, or ramp to and fro along a straight line; default helix"
    )
    depth_mm: Positive | None = Field(
        None, description="depth of the pocket, cut in equal levels of at most axial_depth_mm; default: one level"
    )
    levels_mm: Literal["limit"] | tuple[Positive, ...] | None = Field(
        None,
        description="depths of the levels of a pocket from above, in place of equal ones; limit: the fewest, each at "
        "most axial_depth_mm deep, at which cutter and part keep limits.form_error_um at the walls (needs [workpiece])",
    )
    levels_reserve: float | None = Field(
        None,
        ge=0.0,
        le=0.9,
        description="share of limits.form_error_um that planned levels leave to the error of their simulation; "
        "default 0.3",
    )
    holes_mm: tuple[Hole, ...] | None = Field(
        None, description="pre-drilled holes for the entry, as deep as the pocket: x, y and diameter of each"
    )
    rest_of: int | None = Field(
        None,
        ge=0,
        description="rest machining after an earlier pocket operation with a larger cutter: its number, from 0",
    )


class ContourLimitsTable(LimitsTable):
    """Limits of a planned program."""

    engagement_deg: Positive | None = Field(None, le=180.0, description="greatest engagement angle")
    force_xy_n: Positive | None = Field(None, description="greatest force across the axis")
    torque_nm: Positive | None = Field(None, description="greatest torque on the cutter")
    form_error_um: Positive | None = Field(None, description="greatest form error by deflection of the cutter")


class ContourJobTable(Table):
    """The job file of a job that plans contours or pockets."""

    part: PartTable
    stock: StockTable
    machine: SourceTable
    material: SourceTable
    cutter: tuple[CutterTable, ...] = Field(min_length=1)
    operation: tuple[OperationTable, ...] = Field(min_length=1)
    stiffness: StiffnessTable | None = None
    workpiece: WorkpieceTable | None = None
    limits: ContourLimitsTable = Field(default_factory=ContourLimitsTable.model_construct)
    checks: WallChecksTable = Field(default_factory=WallChecksTable.model_construct)


#: keys that every planned operation needs
ALWAYS = {"kind", "cutter", "milling", "axial_depth_mm", "feed_mm_min", "speed_rpm", "step_mm"}


#: further keys that each kind needs
NEEDS: Mapping[str, tuple[str, ...]] = {
    "contour": ("side", "strategies", "joint", "radial_depth_mm", "semifinish_depth_mm", "tolerance_mm", "lead_mm"),
    "forward": ("side", "radial_depth_mm", "lead_mm"),
    "pocket": (),
}


#: optional keys of each kind
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
        "levels_mm",
        "levels_reserve",
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
