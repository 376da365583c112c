"""Job tables of a thin-wall job: a plate, a blade or a part with stock on its walls.

A value outside the range of its key is refused when the file is read; the message names key, value and limit. Keys that
depend on one another are checked in :mod:`chipload.jobs.thinwall.job`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag

from chipload.cutter.table import CutterTable
from chipload.jobs.simulation.tables import ClampTable, FixtureTable
from chipload.jobs.tables import (
    ChecksTable,
    Count,
    FaceName,
    LimitsTable,
    NotNegative,
    Number,
    Positive,
    SourceTable,
    Table,
    Text,
    Unit,
)
from chipload.jobs.thinwall.chatter_tables import WallDynamicsTable


def _range(low: float, high: float, unit: str, hint: tuple[str, str]) -> BeforeValidator:
    """Refuse a value outside the range of all metals; the message names the unit that was probably meant."""

    def checked(value: Any) -> Any:
        if isinstance(value, (int, float)) and not isinstance(value, bool) and not low <= value <= high:
            meant = hint[0] if value > high else hint[1]
            raise ValueError(f"must be from {low:g} to {high:g} {unit}; {meant}")
        return value

    return BeforeValidator(checked)


#: elastic modulus, density and strength within the ranges of all metals
Gigapascal = Annotated[Number, _range(1.0, 1000.0, "GPa", ("is it in MPa or Pa?", "is it in MPa / 1e6?"))]
Density = Annotated[Number, _range(500.0, 25000.0, "kg/m3", ("is it in g/m3?", "is it in g/cm3?"))]
Megapascal = Annotated[Number, _range(10.0, 5000.0, "MPa", ("is it in Pa?", "is it in GPa?"))]

#: keys that each shape requires, and those that it accepts besides
SHAPES: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "plate": (("length_mm", "height_mm", "thickness_mm"), ()),
    "blade": (
        (
            "chord_root_mm",
            "chord_tip_mm",
            "height_mm",
            "thickness_root_mm",
            "thickness_tip_mm",
            "edge_share",
            "camber_deg",
            "stagger_root_deg",
            "stagger_tip_deg",
        ),
        (),
    ),
    "sections": (("files", "unit", "edge_share"), ("columns", "span")),
    "step": (("file", "front", "back", "clamp"), ("edge_share", "span", "fit_mm")),
}
#: keys that every shape requires
EVERY = ("shape", "foot_mm", "allowance_mm", "elements")


class WallTable(Table):
    """One wall, clamped at its lower edge. `shape` states which keys it needs; any other key is refused."""

    shape: Literal["plate", "blade", "sections", "step"] = Field(
        description="plate or blade: by formula; sections: by files of points; step: by two faces of a STEP file"
    )
    foot_mm: Positive = Field(
        description="height above the clamp up to which the stock stays; below 0.8 of the wall's height"
    )
    allowance_mm: tuple[NotNegative, NotNegative] = Field(
        description="stock on the side towards +y, and on the side towards -y; 0: that side is not cut"
    )
    elements: tuple[Count, Count] = Field(
        description="number of finite elements along the wall, and from the clamp to the free edge"
    )
    length_mm: Positive | None = Field(None, le=5000.0, description="plate: length along x")
    height_mm: Positive | None = Field(None, le=5000.0, description="plate, blade: height above the clamp")
    thickness_mm: Positive | None = Field(None, le=5000.0, description="plate: finished thickness")
    chord_root_mm: Positive | None = Field(None, le=5000.0, description="blade: chord at the clamp")
    chord_tip_mm: Positive | None = Field(None, le=5000.0, description="blade: chord at the free edge")
    thickness_root_mm: Positive | None = Field(
        None, le=5000.0, description="blade: thickness in the middle of the chord, at the clamp"
    )
    thickness_tip_mm: Positive | None = Field(
        None, le=5000.0, description="blade: thickness in the middle of the chord, at the free edge"
    )
    edge_share: NotNegative | None = Field(
        None,
        description="blade: thickness at the edges over that in the middle, above 0 and at most 1; sections, step: "
        "share of the width that is left out at each edge, below 0.5",
    )
    camber_deg: Number | None = Field(
        None, description="blade: angle by which its camber line turns, between -90 and 90"
    )
    stagger_root_deg: Number | None = Field(None, description="blade: angle of the chord about z at the clamp")
    stagger_tip_deg: Number | None = Field(None, description="blade: angle of the chord about z at the free edge")
    files: tuple[Text, ...] | None = Field(
        None, description="sections: files with the sections, from the clamp to the free edge"
    )
    unit: Unit | None = Field(None, description="sections: unit of the files, which do not state it")
    columns: Text | None = Field(None, description="sections: columns of files that do not name them, such as X Y Z")
    span: tuple[NotNegative, NotNegative] | None = Field(
        None, description="sections, step: range of the span that is the wall, rising from 0 to 1; none: the whole span"
    )
    file: Text | None = Field(None, description="step: STEP file; `chipload check FILE` lists its faces")
    front: FaceName | None = Field(None, description="step: face towards +y, by its number or a point [mm] on it")
    back: FaceName | None = Field(None, description="step: the opposite face, towards -y")
    clamp: FaceName | None = Field(
        None, description="step: clamped edge of the front face: the face next to it, or a point [mm] on the edge"
    )
    fit_mm: Positive | None = Field(
        None, le=0.1, description="step: greatest deviation of a fitted patch from its face; none: 0.001"
    )


class FacePartTable(Table):
    """The finished part with the walls of [[wall]], in the coordinates of the program; z points up."""

    file: Text = Field(description="STEP file; `chipload check FILE` lists its faces")
    chord_mm: Positive = Field(0.01, le=1.0, description="greatest deviation of facets from the part's faces")
    places: tuple[Count, Count] = Field(
        (8, 6), description="number of places along each face, and up it, at which the compliance is calculated"
    )
    spacing_mm: Positive = Field(
        1.0,
        description="distance between the points of the stock from which the clearance of shank and holder is measured",
    )


class FaceWallTable(Table):
    """A wall of a part, given by one side or both, or a floor. Walls are cut in the order of the file."""

    face: FaceName = Field(description="side or floor that is cut, by its number or a point [mm] on it")
    opposite: FaceName | None = Field(None, description="the other side of the wall, if it has stock too")
    foot_mm: Positive | None = Field(
        None,
        description="height above the lower edge of a side up to which the stock stays; required for a side, "
        "refused for a floor",
    )
    allowance_mm: tuple[Positive, ...] = Field(
        min_length=1, max_length=2, description="stock on the face, and on the opposite face if it is stated"
    )
    fit_mm: Positive = Field(0.001, le=0.1, description="greatest deviation of a fitted patch from its face")


def _one_or_several(value: Any) -> str:
    """Tag of a value of `wall`: a list is several walls. Messages leave tags out, which are not keys."""
    return "several walls" if isinstance(value, list | tuple) else "one wall"


#: ``[wall]``, one wall that is clamped at its foot, or ``[[wall]]``, walls of a part in its clamps
Walls = Annotated[
    Annotated[WallTable, Tag("one wall")] | Annotated[tuple[FaceWallTable, ...], Tag("several walls")],
    Discriminator(_one_or_several),
]


class WallWorkpieceTable(Table):
    """Material of the wall, and the clamps of a part."""

    name: Text = Field(description="name of the material")
    modulus_gpa: Gigapascal = Field(description="Young's modulus, from 1 to 1000")
    poisson: NotNegative = Field(lt=0.5, description="Poisson's ratio")
    density_kg_m3: Density = Field(description="density, from 500 to 25000")
    yield_mpa: Megapascal = Field(description="yield strength, from 10 to 5000")
    clamp: tuple[ClampTable, ...] = Field(
        (), description="clamps of a part, required with [[wall]]; together they must prevent every rigid motion"
    )
    order: Literal[2, 3] | None = Field(None, description="polynomial order of the cells of a part; none: 2")
    cell_mm: Positive | None = Field(None, description="side of the cells of a part; none: from the thinnest wall")


class ThresholdTable(Table):
    """Experiments that measure the allowable force. Without this table the allowable force is modelled."""

    file: Text = Field(
        description="table (CSV): u, v, normal_force_n, and deflection_um if it was measured; "
        "`chipload cuts` proposes one"
    )
    deviations: NotNegative = Field(description="reserve in standard deviations of the scatter of the experiments")


class WallOperationTable(Table):
    """How the walls are cut."""

    kind: Literal["thinwall"] = Field(description="kind of the operation")
    cutter: Count = Field(description="number of a [[cutter]]")
    rows: Text | None = Field(
        None,
        description="finishing program (CL data or NC) in the coordinates of the wall, whose rows the passes follow; "
        "it sets direction, lean and step-over; none: rows are planned",
    )
    milling: Literal["down", "up"] | None = Field(None, description="direction of milling; required without rows")
    contact: Literal["corner", "flank", "end"] = Field(
        "corner",
        description="what touches the surface: the corner radius of a ball or bull nose, the flank of an end mill "
        "whose axis stands along the wall, or the end of an upright end mill or bull nose on a level floor",
    )
    ramp_deg: Positive | None = Field(
        None,
        le=30.0,
        description="end contact: angle of the ramp on which the cutter enters stock along a row; none: 2",
    )
    axial_depth_mm: Positive | None = Field(
        None, description="flank contact: distance between rows along the axis; required there"
    )
    feed_mm_min: Positive = Field(le=1e5, description="feed of the centre of the cutter's corner radius")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    lean_deg: Positive | None = Field(
        None,
        lt=89.0,
        description="angle of the axis from the surface's normal towards the free edge; required without rows",
    )
    lead_deg: Number | None = Field(None, description="angle of the axis forward along the feed; required without rows")
    step_over_mm: Positive | None = Field(None, description="distance between rows; state this or scallop_um")
    scallop_um: Positive | None = Field(
        None, ge=0.01, description="scallop height between rows; state this or step_over_mm"
    )
    depth_min_mm: Positive = Field(
        description="smallest depth of cut; where the allowable force permits less, the verdict is exceeds"
    )
    depth_max_mm: Positive = Field(description="greatest depth of cut, above depth_min_mm")
    leave_mm: NotNegative = Field(
        0.0, description="stock that is left on every side for the next operation; 0 in the last operation"
    )
    slope: Positive | None = Field(
        None,
        le=1.0,
        description="greatest change of depth per length along the surface; with flank contact from row to row up the "
        "wall; required except with end contact, whose passes are level",
    )
    reserve: NotNegative = Field(
        lt=1.0,
        description="share of the allowable force that the planner leaves unused, for what its force model leaves out",
    )
    clearance_mm: Positive = Field(description="distance of links from the surface; above the stock")
    step_mm: Positive = Field(
        ge=1e-3, le=10.0, description="distance between contact points; the length of a step of the simulation"
    )
    chord_mm: Positive = Field(
        0.005, le=0.1, description="greatest deviation of rows from the surface between contact points"
    )
    least_error: bool = Field(
        False, description="true: also plan the least form error in the time of a constant depth of cut"
    )
    compensate_um: Number = Field(
        0.0,
        ge=0.0,
        le=200.0,
        description="greatest shift of the last passes that corrects their form error; 0: no plan with shifted passes",
    )
    refine: bool = Field(
        True,
        description="true: plan and simulate again until a plan uses 95 % of the limit; false: take the first plan "
        "that holds",
    )
    layer_mm: Positive = Field(
        le=1.0, description="thickness of the layers in which the remaining stock is compared with the wall"
    )
    tolerance_mm: Positive = Field(
        0.001, ge=1e-6, le=0.05, description="greatest deviation of chords from the edges of chips"
    )
    corner_slices: Count = Field(48, le=400, description="number of slices of the corner radius in the simulation")


class ThinWallLimitsTable(LimitsTable):
    """Limits of the plan. The report lists a limit that is not stated as not checked."""

    deflection_workpiece_um: Positive = Field(description="greatest deflection of the wall normal to its surface")
    form_error_um: Positive | None = Field(None, description="greatest form error of the finished surface")
    torque_nm: Positive | None = Field(None, description="greatest torque on the cutter")


class ThinWallJobTable(Table):
    """The whole file of a job that cuts a thin wall."""

    wall: Walls
    part: FacePartTable | None = Field(None, description="the part; required with [[wall]]")
    neighbour: tuple[FixtureTable, ...] = Field(
        (),
        description="a body next to one [wall], in its coordinates, such as the next blade of a blisk; no part of a "
        "tool may touch it",
    )
    workpiece: WallWorkpieceTable
    machine: SourceTable
    material: SourceTable
    threshold: ThresholdTable | None = None
    cutter: tuple[CutterTable, ...] = Field(min_length=1)
    dynamics: WallDynamicsTable | None = Field(
        None, description="vibration of wall and cutter; none: chatter is not calculated"
    )
    operation: tuple[WallOperationTable, ...] = Field(
        min_length=1,
        max_length=4,
        description="operations in the order of cutting; more than one: semi-finishing, then finishing",
    )
    limits: ThinWallLimitsTable
    checks: ChecksTable = Field(default_factory=ChecksTable.model_construct)
