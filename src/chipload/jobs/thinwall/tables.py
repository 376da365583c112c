"""Job tables of a thin-wall job: a plate, a blade or a part with stock on its walls."""

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
    Limits,
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
    """Refuse what is no number within a range that any metal is in; name the unit that was probably meant."""

    def checked(value: Any) -> Any:
        if isinstance(value, (int, float)) and not isinstance(value, bool) and not low <= value <= high:
            meant = hint[0] if value > high else hint[1]
            raise ValueError(f"must be from {low:g} to {high:g} {unit}; {meant}")
        return value

    return BeforeValidator(checked)


#: ranges that workpieces of metal are in
Gigapascal = Annotated[Number, _range(1.0, 1000.0, "GPa", ("is it in MPa or Pa?", "is it in MPa / 1e6?"))]
Density = Annotated[Number, _range(500.0, 25000.0, "kg/m3", ("is it in g/m3?", "is it in g/cm3?"))]
Megapascal = Annotated[Number, _range(10.0, 5000.0, "MPa", ("is it in Pa?", "is it in GPa?"))]

#: keys that a shape needs, and those that it also understands
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
#: keys of every shape
EVERY = ("shape", "foot_mm", "allowance_mm", "elements")


class WallTable(Table):
    """The wall, clamped below; which keys it needs depends on its shape, see :data:`SHAPES`."""

    shape: Literal["plate", "blade", "sections", "step"]
    foot_mm: Positive = Field(description="height above the clamp that keeps its stock")
    allowance_mm: tuple[NotNegative, NotNegative] = Field(description="stock on the side towards +y and towards -y")
    elements: tuple[Count, Count] = Field(description="finite elements along the wall and up it, the foot among them")
    length_mm: Positive | None = Field(None, le=5000.0, description="length of a plate")
    height_mm: Positive | None = Field(None, le=5000.0, description="height of a plate or blade above the clamp")
    thickness_mm: Positive | None = Field(None, le=5000.0, description="finished thickness of a plate")
    chord_root_mm: Positive | None = Field(None, le=5000.0, description="chord of a blade at the clamp")
    chord_tip_mm: Positive | None = Field(None, le=5000.0, description="chord of a blade at the free edge")
    thickness_root_mm: Positive | None = Field(
        None, le=5000.0, description="thickness of a blade in the middle of the chord, at the clamp"
    )
    thickness_tip_mm: Positive | None = Field(
        None, le=5000.0, description="thickness of a blade in the middle of the chord, at the free edge"
    )
    edge_share: NotNegative | None = Field(
        None,
        description="blade: thickness at the edges over that in the middle; else: share of u left out at each edge",
    )
    camber_deg: Number | None = Field(None, description="angle by which the camber line of a blade turns")
    stagger_root_deg: Number | None = Field(None, description="angle of the chord about z at the clamp")
    stagger_tip_deg: Number | None = Field(None, description="angle of the chord about z at the free edge")
    files: tuple[Text, ...] | None = Field(None, description="files with the sections, from the clamp to the free edge")
    unit: Unit | None = Field(None, description="unit of the files, which do not state it")
    columns: Text | None = Field(None, description="columns of files that do not name them, as X Y Z")
    span: tuple[NotNegative, NotNegative] | None = Field(None, description="range of the span that is the wall, 0 to 1")
    file: Text | None = Field(None, description="STEP file; `chipload check FILE` lists its faces")
    front: FaceName | None = Field(None, description="face, by number or point [mm] on it: the side towards +y")
    back: FaceName | None = Field(None, description="the face opposite: the side towards -y")
    clamp: FaceName | None = Field(
        None, description="clamped edge of the front: the face beside it, or a point on the edge"
    )
    fit_mm: Positive | None = Field(
        None, le=0.1, description="greatest deviation of a fitted patch from its face; none: 0.001"
    )


class FacePartTable(Table):
    """The finished part that the faces of walls belong to, in its setup: z up, the program has its coordinates."""

    file: Text = Field(description="STEP file; `chipload check FILE` lists its faces")
    chord_mm: Positive = Field(0.01, le=1.0, description="greatest deviation of facets from the part's faces")
    places: tuple[Count, Count] = Field((8, 6), description="places along a face and up it at which the part is solved")
    spacing_mm: Positive = Field(
        1.0, description="distance between the points of the stock that shank and holder are checked against"
    )


class FaceWallTable(Table):
    """A wall of a part by one of its sides, or both, or a floor; they are cut in the order of the file."""

    face: FaceName = Field(description="side or floor that is cut, by number or point [mm] on it")
    opposite: FaceName | None = Field(None, description="its other side, where that has stock too")
    foot_mm: Positive | None = Field(
        None, description="height above the lower edge of each side that keeps its stock; not for a floor"
    )
    allowance_mm: tuple[Positive, ...] = Field(
        min_length=1, max_length=2, description="stock on the face, and on the opposite one"
    )
    fit_mm: Positive = Field(0.001, le=0.1, description="greatest deviation of a fitted patch from its face")


def _one_or_several(value: Any) -> str:
    """Which of both kinds of tables a value is: tags are no keys, so that messages leave them out."""
    return "several walls" if isinstance(value, list | tuple) else "one wall"


#: ``[wall]``, clamped at its foot, or ``[[wall]]``, on a part in its clamps
Walls = Annotated[
    Annotated[WallTable, Tag("one wall")] | Annotated[tuple[FaceWallTable, ...], Tag("several walls")],
    Discriminator(_one_or_several),
]


class WallWorkpieceTable(Table):
    """Material of the wall, and the clamps of a part."""

    name: Text = Field(description="name of the material")
    modulus_gpa: Gigapascal = Field(description="Young's modulus")
    poisson: NotNegative = Field(lt=0.5, description="Poisson's ratio")
    density_kg_m3: Density
    yield_mpa: Megapascal = Field(description="yield strength")
    clamp: tuple[ClampTable, ...] = Field(
        (), description="clamps of a part with [[wall]]; together they must allow no rigid motion"
    )
    order: Literal[2, 3] | None = Field(None, description="polynomial order of the cells of a part; none: 2")
    cell_mm: Positive | None = Field(None, description="side of the cells of a part; none: by the thinnest wall")


class ThresholdTable(Table):
    """Experiments that find the allowable force of a place; without them the threshold is modelled."""

    file: Text = Field(description="CSV: u, v, normal_force_n, and deflection_um where that was measured")
    deviations: NotNegative = Field(description="reserve, in standard deviations of the scatter of the experiments")


class WallOperationTable(Table):
    """How the wall is cut."""

    kind: Literal["thinwall"]
    cutter: Count = Field(description="number of a [[cutter]]")
    rows: Text | None = Field(
        None,
        description="finishing program (CL data or NC) whose rows the passes follow, in the coordinates of the wall; "
        "it gives direction, lean and step-over; none: rows are planned",
    )
    milling: Literal["down", "up"] | None = Field(None, description="direction of milling; required without rows")
    contact: Literal["corner", "flank", "end"] = Field(
        "corner",
        description="what touches the surface: the corner radius of a ball or bull nose, the flank of an end mill "
        "whose axis stands along the wall, or the end of an upright end mill or bull nose on a level floor",
    )
    ramp_deg: Positive | None = Field(
        None, le=30.0, description="end contact: angle at which the cutter goes down into stock along a row; none: 2"
    )
    axial_depth_mm: Positive | None = Field(None, description="flank contact: distance between rows along the axis")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the centre of the cutter's corner radius")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    lean_deg: Positive | None = Field(
        None,
        lt=89.0,
        description="angle of the axis from the surface's normal towards the free edge; required without rows",
    )
    lead_deg: Number | None = Field(None, description="angle of the axis forward along the feed; required without rows")
    step_over_mm: Positive | None = Field(None, description="distance between rows; or scallop_um")
    scallop_um: Positive | None = Field(None, ge=0.01, description="scallop height between rows; or step_over_mm")
    depth_min_mm: Positive = Field(description="smallest depth of cut")
    depth_max_mm: Positive = Field(description="greatest depth of cut")
    leave_mm: NotNegative = Field(
        0.0, description="stock on every side for the operation after this one; 0 in the last one, which finishes"
    )
    slope: Positive | None = Field(
        None,
        le=1.0,
        description="greatest change of depth per length along the surface; flank contact: from row to row up the "
        "wall; not used by end contact, whose passes are level",
    )
    reserve: NotNegative = Field(
        lt=1.0, description="share of the threshold that the planner keeps free for what its force model leaves out"
    )
    clearance_mm: Positive = Field(description="distance of links from the surface")
    step_mm: Positive = Field(ge=1e-3, le=10.0, description="distance between contact points, a step of the simulation")
    chord_mm: Positive = Field(
        0.005, le=0.1, description="greatest deviation of rows from the surface between contact points"
    )
    least_error: bool = Field(False, description="also plan the least form error within the time of the constant depth")
    compensate_um: Number = Field(
        0.0,
        ge=0.0,
        le=200.0,
        description="greatest shift of the last passes against their form error; 0: no plan with shifted passes",
    )
    layer_mm: Positive = Field(le=1.0, description="thickness of the layers of the simulation")
    tolerance_mm: Positive = Field(
        0.001, ge=1e-6, le=0.05, description="greatest deviation of chords from the edges of chips"
    )
    corner_slices: Count = Field(48, le=400, description="slices of the corner radius in the simulation")


class ThinWallLimitsTable(Limits):
    """What the plan must keep."""

    deflection_workpiece_um: Positive = Field(description="greatest deflection of the wall normal to its surface")
    form_error_um: Positive | None = Field(None, description="greatest form error of the finished surface")
    torque_nm: Positive | None = Field(None, description="greatest torque on the cutter")


class ThinWallJobTable(Table):
    """The whole file of a job that cuts a thin wall."""

    wall: Walls
    part: FacePartTable | None = Field(None, description="required with [[wall]]")
    neighbour: tuple[FixtureTable, ...] = Field(
        (),
        description="what stands beside one [wall], in its coordinates, as the next blades of a blisk: no part of a "
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
        min_length=1, max_length=4, description="in the order of cutting; more than one: semi-finishing, then finishing"
    )
    limits: ThinWallLimitsTable
    checks: ChecksTable = Field(default_factory=ChecksTable.model_construct)
