"""Job tables of an impeller job: its blades, the cutters, the machine with its index table, the operation.

A value outside the range of its key is refused when the file is read; the message names key, value and limit. Keys that
depend on one another are checked in :mod:`chipload.jobs.impeller.job`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from chipload.jobs.simulation.tables import MachineTableTable, SolidTable, WorkholdingTable
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

    channel_mm: Positive = Field(
        ge=0.1, description="narrowest width of a channel, along the circumference at the inlet"
    )
    hub_radius_mm: Positive = Field(ge=0.1, description="radius of the hub at the inlet")
    height_mm: Positive = Field(ge=0.1, description="height of the hub from outlet to inlet")
    blade_height_mm: Positive = Field(ge=0.1, description="height of the blades at the inlet")
    outlet_height_mm: Positive = Field(ge=0.1, description="height of the blades at the outlet")
    wrap_deg: Number = Field(ge=-360.0, le=360.0, description="angle by which a blade turns from inlet to outlet")
    lean_deg: Number = Field(0.0, ge=-180.0, le=180.0, description="angle by which a blade turns from hub to shroud")


class SectionsTable(Table):
    """Blades by points: closed profiles from hub to shroud, and the curves of hub and shroud."""

    blade: tuple[Text, ...] = Field(min_length=1, description="files with the sections of a blade, from hub to shroud")
    splitter: tuple[Text, ...] = Field(
        (),
        description="files with the sections of a splitter, from hub to shroud; a file of `blade`: its second blade; "
        "none: no splitters",
    )
    hub: Text = Field(
        description="file of points of the hub, or a table of all sections, whose first section lies on it"
    )
    shroud: Text = Field(
        description="file of points of the shroud, or a table of all sections, whose last section lies on it"
    )
    unit: Unit = Field(description="unit of the files, which do not state it")
    columns: Literal["X R*THETA R", "X R THETA_DEG", "X Y Z"] | None = Field(
        None, description="columns of files that do not name them"
    )
    axis: Literal["x", "y", "z"] = Field("z", description="axis of rotation in files with columns X Y Z")
    flow_along_x: bool | None = Field(
        None,
        description="true: the flow comes along +X (the axis) of the files; the part is then turned over; default: by "
        "the shape, so that the narrow end of the hub is up",
    )
    hub_ahead_mm: NotNegative = Field(description="length of the hub upstream of the leading edge")


class StepTable(Table):
    """Blades by faces of a STEP file. A face is named by its number or by a point [mm] on it, in the file's frame.

    A side may be a list of faces. A list of three numbers is one point.
    """

    file: Text = Field(description="STEP file; `chipload check FILE` lists its faces")
    flow: Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None = Field(
        None,
        description="direction of the incoming flow along the axis of rotation, which contains the origin; default: "
        "by the faces of the hub, so that its narrow end is up",
    )
    plus: SideFaces = Field(
        description="side of a blade that faces a growing angle about the axis, seen against the flow"
    )
    minus: SideFaces = Field(description="side that faces a falling angle, of the same blade or of another one")
    splitter_plus: SideFaces | None = Field(None, description="plus side of a splitter; none: no splitters")
    splitter_minus: SideFaces | None = Field(None, description="minus side of a splitter; required with splitter_plus")
    hub: tuple[FaceName, ...] | Text = Field(description="faces of revolution of the hub, or a file of its points")
    shroud: tuple[FaceName, ...] | Text = Field(
        description="faces of revolution of the shroud, or a file of its points; faces of the tip of one "
        "blade are enough"
    )
    unit: Unit | None = Field(None, description="unit of hub and shroud; required if they are files of points")
    fit_mm: Positive = Field(0.001, le=0.1, description="greatest deviation of a fitted patch from its face")
    hub_ahead_mm: NotNegative = Field(description="length of the hub upstream of the leading edge")


class ImpellerTable(Table):
    """The part: shape, sections or step states its blades."""

    blades: Annotated[Count, Field(ge=2)] = Field(
        description="number of blades, evenly spaced; the number of splitters, if there are any, is the same"
    )
    outer_diameter_mm: Positive = Field(
        description="outer diameter over the blades, from the drawing; sections and step must agree with it"
    )
    shape: ShapeTable | None = None
    sections: SectionsTable | None = None
    step: StepTable | None = None
    fillet_mm: Positive | None = Field(
        None,
        description="radius of fillets between sides and hub that the model lacks; sides begin above them; "
        "none: no fillets",
    )

    @property
    def has_splitter(self) -> bool:
        """Whether splitters stand between the blades."""
        by_points = self.sections is not None and bool(self.sections.splitter)
        return by_points or (self.step is not None and self.step.splitter_plus is not None)


class SurfaceTable(Table):
    """One surface that is milled, and its milled range."""

    body: Literal["blade", "splitter"] = Field(description="body that the surface belongs to")
    side: Literal["plus", "minus", "floor", "plus fillet", "minus fillet"] = Field(
        description="plus: faces a growing angle about the axis; minus: a falling one; floor: the hub between this "
        "body and the next; fillet: between the side and the hub"
    )
    along: Span = Field(description="range along the surface, 0 to 1")
    up: Span = Field(description="range from the hub up, or across a floor, 0 to 1")
    points: tuple[Count, Count] = Field(description="number of contact points along and up")


class PickedTable(Table):
    """A cutter of the catalogue that a programmer would choose."""

    diameter_mm: Positive = Field(description="diameter")
    corner_radius_mm: NotNegative = Field(description="corner radius")


class PathsTable(Table):
    """Finishing programs of the patches, planned for the least time and checked by simulation."""

    check_mm: Positive = Field(ge=0.01, description="greatest distance between check points of the paths")
    chord_mm: Positive = Field(le=1.0, description="greatest deviation of the tip between two rows")
    overrun_mm: NotNegative = Field(
        1.0, description="length by which lines continue beyond the ends of their patch, if there is room"
    )
    lift_mm: Positive = Field(description="length of the lift off the surface at the ends of a line")
    lead_mm: Positive | None = Field(
        None,
        description="length of the part of a lift at the feed of the cut, at most lift_mm; none: the greater of "
        "1 mm and the allowance of roughing, at most lift_mm",
    )
    margin_mm: Positive = Field(
        description="least distance of links from the part, and of rapids from the allowances on it; between "
        "touch_mm and lift_mm"
    )
    touch_mm: NotNegative = Field(description="greatest depth of a check point of the part in the tool during a lift")
    near_mm: NotNegative = Field(description="greatest length of a direct link; longer links go over the part")
    above_mm: Positive = Field(description="height above the part at which the cutter moves safely")
    link_feed_mm_min: Positive = Field(le=1e5, description="feed of lifts and links")
    gouge_mm: Positive = Field(le=1.0, description="greatest gouge allowed in a program")


class RoughTable(Table):
    """Roughing programs of the channels in layers, before the finishing programs. Links follow the keys of `paths`."""

    diameter_mm: Positive | None = Field(
        None, description="diameter of a cutter of the catalogue; none: the largest that fits"
    )
    corner_radius_mm: NotNegative | None = Field(None, description="corner radius of the cutter with diameter_mm")
    share: Annotated[Number, Field(gt=0.0, le=1.0)] = Field(
        0.9, description="share of the points of the channels at which the largest cutter must fit"
    )
    depth_mm: Positive = Field(description="greatest thickness of a layer")
    step_mm: Positive = Field(description="greatest distance between rows")
    blades_mm: NotNegative = Field(description="allowance on blades and splitters")
    hub_mm: NotNegative = Field(description="allowance on the hub")
    over_mm: NotNegative = Field(description="height of the blank above the shroud")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's tip")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    check_mm: Positive = Field(ge=0.01, description="greatest distance between check points")
    coarser: Annotated[Number, Field(ge=1.0, le=100.0)] = Field(
        10.0, description="factor by which roughing multiplies paths.chord_mm"
    )
    grid_mm: Positive = Field(description="distance between the lines of the simulated blank")
    touch_mm3: NotNegative = Field(
        description="volume that a rapid, or the tool above its cutting part, may remove in one row"
    )


class ForcesTable(Table):
    """Feeds of the finishing passes from the cutting force, at most `feed_mm_min`."""

    material: SourceTable = Field(description="material with force coefficients in all directions")
    flutes: Annotated[Count, Field(le=20)] = Field(description="number of teeth of every cutter")
    helix_deg: Annotated[Number, Field(ge=0.0, lt=80.0)] = Field(30.0, description="helix angle of every cutter")
    modulus_gpa: Annotated[Number, Field(ge=10.0, le=1000.0)] = Field(
        580.0, description="Young's modulus of the cutters"
    )
    overhang_mm: Positive | None = Field(
        None, description="overhang of cutters whose reach the catalogue does not state"
    )
    allowance_mm: Positive | None = Field(
        None, description="allowance on the surfaces before finishing; none: the greatest allowance of roughing"
    )
    deflection_um: Positive = Field(description="greatest deflection of a cutter at its contact")
    safety_factor: Annotated[Number, Field(ge=1.0, le=100.0)] = Field(
        2.0, description="strength of the cutters over their allowable stress"
    )


class BladesTable(Table):
    """Finished blades as elastic bodies on a rigid hub, which the forces of the finishing programs bend."""

    modulus_gpa: Annotated[Number, Field(ge=1.0, le=1000.0)] = Field(description="Young's modulus of the part")
    poisson: Annotated[Number, Field(ge=0.0, lt=0.5)] = Field(0.3, description="Poisson's ratio of the part")
    deflection_um: Positive = Field(description="greatest deflection of a blade across its sides, where it is cut")


class FlankTable(Table):
    """Flank passes (swarf milling) of the sides on a machine with five simultaneous axes, as further programs."""

    machine: SourceTable = Field(description="machine with two rotary axes that move in the cut")
    excess_mm: Positive = Field(le=1.0, description="greatest excess that a pass may leave on its side")
    most_passes: Annotated[Count, Field(le=20)] = Field(
        1, description="greatest number of passes up a side; the plan has the fewest that keep excess_mm and gouge_mm"
    )
    feed_mm_min: Positive | None = Field(
        None, le=1e5, description="feed of the tip; none: that of the operation, if it has no `forces`"
    )
    speed_rpm: Positive | None = Field(None, le=1e6, description="spindle speed; none: that of the operation")


class PointMillingTable(Table):
    """Point milling of the surfaces on a machine with five simultaneous axes, as further programs."""

    machine: SourceTable = Field(description="machine with two rotary axes that move in the cut")
    lean_deg: Annotated[Number, Field(ge=0.5, le=80.0)] = Field(
        10.0, description="least angle of the cutter's axis from the normal of the surface"
    )
    feed_mm_min: Positive | None = Field(
        None, le=1e5, description="feed of the tip; none: that of the operation, if it has no `forces`"
    )
    speed_rpm: Positive | None = Field(None, le=1e6, description="spindle speed; none: that of the operation")


class ImpellerOperationTable(Table):
    """Choice of the largest cutters for all surfaces, and the programs with them."""

    kind: Literal["impeller"] = Field(description="kind of the operation")
    check_mm: Positive = Field(ge=0.01, description="greatest distance between check points")
    near_mm: Positive = Field(
        description="distance from a contact within which the curvature of the surface replaces check points"
    )
    tolerance_mm: Positive = Field(
        0.05, le=1.0, description="greatest depth of a wall in a certified cutter between two check points"
    )
    around: Annotated[int, Field(ge=0, le=20)] = Field(
        1,
        description="number of blades and splitters beyond the channel, on each side, from which the "
        "clearance is checked",
    )
    table_deg: tuple[Number, ...] | None = Field(
        None, min_length=1, description="table angles to choose from; none: all"
    )
    clearance_mm: NotNegative = Field(description="least clearance of neck, shank and holder")
    scallop_mm: Positive = Field(le=5.0, description="greatest scallop height between two passes")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's tip; with `forces` the greatest feed")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    most_cutters: Annotated[Count, Field(le=6)] = Field(
        description="greatest number of different cutters; plans with fewer are compared too"
    )
    cutter_change_s: NotNegative = Field(description="time of a cutter change")
    table_change_s: NotNegative = Field(description="time to turn the index table to another angle")
    paths: PathsTable | None = Field(
        None, description="finishing programs; none: only the cutters and the patches are planned"
    )
    rough: RoughTable | None = Field(None, description="roughing programs; none: finishing only")
    flank: FlankTable | None = Field(None, description="flank passes; none: not planned")
    point_milling: PointMillingTable | None = Field(None, description="point milling on five axes; none: not planned")
    forces: ForcesTable | None = Field(
        None, description="feeds from the cutting force; none: every pass has the same feed"
    )
    blades: BladesTable | None = Field(
        None, description="deflection of the blades under the forces of `forces`; none: not checked"
    )
    hand_picked: PickedTable | None = Field(None, description="cutter of a programmer, with which the plan is compared")


class ImpellerJobTable(Table):
    """The whole file of an impeller job."""

    impeller: ImpellerTable
    surface: tuple[SurfaceTable, ...] = Field(min_length=1)
    catalogue: SourceTable
    machine: SourceTable
    stock: SolidTable | None = Field(
        None,
        description="stock before finishing, where the job states no roughing: all programs are simulated in it; none "
        "of both: what they remove is unproven",
    )
    fixture: tuple[WorkholdingTable, ...] = ()
    machine_table: MachineTableTable | None = None
    operation: tuple[ImpellerOperationTable, ...] = Field(min_length=1, max_length=1)
