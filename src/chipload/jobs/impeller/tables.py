"""Job tables of an impeller job: its blades, the cutters, the machine with its index table, the operation."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from chipload.jobs.tables import (
    Count,
    FaceName,
    NotNegative,
    Number,
    Positive,
    SideFaces,
    SourceTable,
    Table,
    Text,
    Unit,
)

Share = Annotated[Number, Field(ge=0.0, le=1.0)]
Span = tuple[Share, Share]


class ShapeTable(Table):
    """An impeller by formula, see ``planning/impeller/parametric.py``."""

    channel_mm: Positive = Field(ge=0.1, description="narrowest width of a channel, round the axis at the inlet")
    hub_radius_mm: Positive = Field(ge=0.1, description="of the hub at the inlet")
    height_mm: Positive = Field(ge=0.1, description="of the hub from outlet to inlet")
    blade_height_mm: Positive = Field(ge=0.1, description="at the inlet")
    outlet_height_mm: Positive = Field(ge=0.1, description="of the blades at the outlet")
    wrap_deg: Number = Field(ge=-360.0, le=360.0, description="turn of a blade from inlet to outlet")
    lean_deg: Number = Field(0.0, ge=-180.0, le=180.0, description="turn of a blade from hub to shroud")


class SectionsTable(Table):
    """Blades by points: closed profiles from hub to shroud, and the curves of hub and shroud."""

    blade: tuple[Text, ...] = Field(min_length=1, description="files in the order hub to shroud")
    splitter: tuple[Text, ...] = Field((), description="likewise; none: there are no splitters")
    hub: Text = Field(description="file of points, or a table of all sections, whose first one lies on the hub")
    shroud: Text = Field(description="likewise; of a table the last one")
    unit: Unit = Field(description="unit of the files, which do not state it")
    columns: Literal["X R*THETA R", "X R THETA_DEG", "X Y Z"] | None = Field(
        None, description="of files that do not name them"
    )
    flow_along_x: bool = Field(description="true: the flow comes along +X of the files, and the part is turned over")
    hub_ahead_mm: NotNegative = Field(description="length of the hub ahead of the leading edge")


class StepTable(Table):
    """Blades by faces of a STEP file; a face is named by its number or by a point [mm] on it, in the file's frame.

    A side may be a list of faces; three numbers are one point.
    """

    file: Text = Field(description="`chipload check FILE` lists its faces")
    flow: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = Field(
        description="direction of the incoming flow along the axis of rotation, which contains the origin"
    )
    plus: SideFaces = Field(description="side that faces a growing angle about the axis, seen against the flow")
    minus: SideFaces = Field(description="side that faces a falling angle, of the same blade or of another")
    splitter_plus: SideFaces | None = Field(None, description="likewise of a splitter; none: there are no splitters")
    splitter_minus: SideFaces | None = None
    hub: tuple[FaceName, ...] | Text = Field(description="faces of revolution, or a file of points as of sections")
    shroud: tuple[FaceName, ...] | Text = Field(description="likewise; the tip of one blade is faces of it")
    unit: Unit | None = Field(None, description="of hub and shroud where they are files of points")
    fit_mm: Positive = Field(0.001, le=0.1, description="greatest deviation of a fitted patch from its face")
    hub_ahead_mm: NotNegative = Field(description="length of the hub ahead of the leading edge")


class ImpellerTable(Table):
    """The part."""

    blades: Annotated[Count, Field(ge=2)] = Field(description="how many, evenly round; as many splitters")
    outer_diameter_mm: Positive = Field(description="over the blades, as the drawing states it")
    shape: ShapeTable | None = None
    sections: SectionsTable | None = None
    step: StepTable | None = None
    fillet_mm: Positive | None = Field(
        None, description="fillets between sides and hub, which meet without them; sides begin above theirs"
    )

    @property
    def has_splitter(self) -> bool:
        """Whether splitters stand between the blades."""
        by_points = self.sections is not None and bool(self.sections.splitter)
        return by_points or (self.step is not None and self.step.splitter_plus is not None)


class SurfaceTable(Table):
    """One surface that is milled, and where on it."""

    body: Literal["blade", "splitter"]
    side: Literal["plus", "minus", "floor", "plus fillet", "minus fillet"] = Field(
        description="plus faces a growing angle; floor: the hub beyond it; fillet: between the side and the hub"
    )
    along: Span = Field(description="range along the surface, 0 to 1")
    up: Span = Field(description="from where to where up from the hub, across on a floor, 0 to 1")
    points: tuple[Count, Count] = Field(description="contact points along and up")


class PickedTable(Table):
    """A cutter of the catalogue that a programmer would take."""

    diameter_mm: Positive
    corner_radius_mm: NotNegative


class PathsTable(Table):
    """Finishing programs of the patches in the least time, checked by simulation."""

    check_mm: Positive = Field(ge=0.01, description="greatest distance of check points of the paths")
    chord_mm: Positive = Field(le=1.0, description="greatest deviation of the tip between two rows")
    overrun_mm: NotNegative = Field(1.0, description="of lines beyond the ends of their patch, where they can")
    lift_mm: Positive = Field(description="off the surface at the ends of a line")
    lead_mm: Positive | None = Field(
        None,
        description="of a lift that is fed at the feed of the cut, at most lift_mm; none: 1 mm, or the allowance of "
        "roughing where that is more, or lift_mm where that is less",
    )
    margin_mm: Positive = Field(description="that links keep from the part, rapids from the allowances on it too")
    touch_mm: NotNegative = Field(description="how deep a lift may touch the check points")
    near_mm: NotNegative = Field(description="longest direct link")
    above_mm: Positive = Field(description="of the safe height above the part")
    link_feed_mm_min: Positive = Field(le=1e5, description="feed of lifts and links")
    gouge_mm: Positive = Field(le=1.0, description="deepest that the check may find a program below a surface")


class RoughTable(Table):
    """Roughing programs of the channels by layers, before the finishing ones; links are those of the paths."""

    diameter_mm: Positive | None = Field(None, description="of a cutter of the catalogue; none: the largest that fits")
    corner_radius_mm: NotNegative | None = Field(None, description="of that cutter")
    share: Annotated[Number, Field(gt=0.0, le=1.0)] = Field(
        0.9, description="of the points of the channels at which the largest cutter that fits must go"
    )
    depth_mm: Positive = Field(description="greatest thickness of a layer")
    step_mm: Positive = Field(description="greatest distance of rows")
    blades_mm: NotNegative = Field(description="allowance on blades and splitters")
    hub_mm: NotNegative = Field(description="allowance on the hub")
    over_mm: NotNegative = Field(description="height of the blank over the shroud")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's tip")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    check_mm: Positive = Field(ge=0.01, description="greatest distance of check points")
    coarser: Annotated[Number, Field(ge=1.0, le=100.0)] = Field(
        10.0, description="factor on paths.chord_mm for roughing"
    )
    grid_mm: Positive = Field(description="distance of the lines by which the blank is simulated")
    touch_mm3: NotNegative = Field(description="what a rapid, or parts above the cutting part, may take in one row")


class ForcesTable(Table):
    """Feeds of the finishing passes by the force of their chips, at most `feed_mm_min`."""

    material: SourceTable = Field(description="force coefficients, in all directions")
    flutes: Annotated[Count, Field(le=20)] = Field(description="of every cutter")
    helix_deg: Annotated[Number, Field(ge=0.0, lt=80.0)] = Field(30.0, description="of every cutter")
    modulus_gpa: Annotated[Number, Field(ge=10.0, le=1000.0)] = Field(580.0, description="of the cutters' material")
    overhang_mm: Positive | None = Field(None, description="of cutters whose reach the catalogue does not state")
    allowance_mm: Positive | None = Field(
        None, description="that stands on the surfaces; none: the greater one of roughing"
    )
    deflection_um: Positive = Field(description="greatest deflection of a cutter at its contact")
    safety_factor: Annotated[Number, Field(ge=1.0, le=100.0)] = Field(
        2.0, description="strength of the cutters over the stress that is allowed"
    )


class FlankTable(Table):
    """Flank passes (swarf milling) of the sides on a machine with five simultaneous axes, beside the other programs."""

    machine: SourceTable = Field(description="with two rotary axes that move in the cut")
    excess_mm: Positive = Field(le=1.0, description="most that a pass may leave on its side")
    most_passes: Annotated[Count, Field(le=20)] = Field(
        1, description="greatest number of passes up a side; the fewest that keep excess_mm and gouge_mm are taken"
    )
    feed_mm_min: Positive | None = Field(
        None, le=1e5, description="of the tip; none: that of the operation, if it has no `forces`"
    )
    speed_rpm: Positive | None = Field(None, le=1e6, description="spindle speed; none: that of the operation")


class PointMillingTable(Table):
    """Point milling of the surfaces on a machine with five simultaneous axes, beside the other programs."""

    machine: SourceTable = Field(description="with two rotary axes that move in the cut")
    lean_deg: Annotated[Number, Field(ge=0.5, le=80.0)] = Field(
        10.0, description="least angle of the cutter's axis from the normal of the surface"
    )
    feed_mm_min: Positive | None = Field(
        None, le=1e5, description="of the tip; none: that of the operation, if it has no `forces`"
    )
    speed_rpm: Positive | None = Field(None, le=1e6, description="spindle speed; none: that of the operation")


class ImpellerOperationTable(Table):
    """The search for the largest cutters of all surfaces."""

    kind: Literal["impeller"]
    check_mm: Positive = Field(ge=0.01, description="greatest distance of check points")
    near_mm: Positive = Field(description="within this distance the curvature of the surface replaces check points")
    tolerance_mm: Positive = Field(
        0.05, le=1.0, description="how deep a wall may lie in a cutter between check points where it is certified"
    )
    around: Annotated[int, Field(ge=0, le=20)] = Field(1, description="bodies beyond the channel that are checked")
    table_deg: tuple[Number, ...] | None = Field(None, min_length=1, description="table angles; none: all")
    clearance_mm: NotNegative = Field(description="of neck, shank and holder")
    scallop_mm: Positive = Field(le=5.0, description="greatest height between two passes")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's tip; the greatest one with `forces`")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    most_cutters: Annotated[Count, Field(le=6)] = Field(
        description="greatest number of different cutters; fewer are compared too"
    )
    cutter_change_s: NotNegative = Field(description="time of a cutter change")
    table_change_s: NotNegative = Field(description="time of setting the index table to another angle")
    paths: PathsTable | None = Field(None, description="none: the search and the patches alone, no programs")
    rough: RoughTable | None = Field(None, description="none: the programs finish only")
    flank: FlankTable | None = Field(None, description="none: no flank passes")
    point_milling: PointMillingTable | None = Field(None, description="none: no point milling on five axes")
    forces: ForcesTable | None = Field(None, description="none: every pass has the same feed")
    hand_picked: PickedTable | None = Field(None, description="the cutter that is compared with")


class ImpellerJobTable(Table):
    """The whole file."""

    impeller: ImpellerTable
    surface: tuple[SurfaceTable, ...] = Field(min_length=1)
    catalogue: SourceTable
    machine: SourceTable
    operation: tuple[ImpellerOperationTable, ...] = Field(min_length=1, max_length=1)
