"""The tables of a job that runs a program through a stock, whatever is then done with its feeds."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from chipload.cutter.table import CutterTable
from chipload.jobs.simulation.dynamics_tables import DynamicsTable, SpeedsTable
from chipload.jobs.tables import (
    ChecksTable,
    Count,
    Limits,
    NotNegative,
    Number,
    Point,
    Positive,
    SourceTable,
    Table,
    Text,
    Unit,
)


class ProgramTable(Table):
    """A program that exists: NC text or CL data."""

    file: Text
    dialect: Literal["linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"] | None = None
    tools: Text | None = Field(None, description="LinuxCNC tool table")
    feed_mm_min: Positive | None = Field(None, le=1e5, description="feed of cuts before the program states one")
    speed_rpm: Positive | None = Field(
        None, le=1e6, description="speed of the spindle, clockwise, before the program starts it, or if it never does"
    )
    tolerance_mm: Positive = Field(
        0.001, ge=1e-6, le=1.0, description="greatest deviation of the tip where a move is divided"
    )
    parameters: dict[str, Number] = Field(
        default_factory=dict, description='variables of the controller, e.g. "#100" = 2.5, "#<depth>", R10 or Q10'
    )
    work_offsets: dict[str, tuple[Number, ...]] = Field(
        default_factory=dict,
        description="origins of work offsets in the machine, X Y Z A B C U V W in mm and degrees, as G55 = [80, 0, 0]",
    )
    placed_in: Text | None = Field(
        None, description="work offset in whose coordinates stock and part are; none: the first of the program"
    )
    tool_comments: bool = Field(True, description="compare the diameters in the program's comments with the cutters")


class SolidTable(Table):
    """What a program starts from: a block, a mesh (STL), a model (STEP), or what an earlier run left."""

    low_mm: Point | None = Field(None, description="lower corner of a block")
    high_mm: Point | None = Field(None, description="upper corner of a block")
    file: Text | None = Field(None, description=".stl, .step or an earlier result's .npz")
    units: Unit | None = Field(None, description="unit of an STL file, which does not state it")
    chord_mm: Positive = Field(0.01, le=1.0, description="greatest deviation of facets from a model's faces")
    layer_mm: Positive | None = Field(
        None,
        description="thickness of the layers; none: from depths of cut and the smallest cutter, at most 400 layers; an "
        "earlier result has its own",
    )


class TargetTable(Table):
    """The part that the program should leave: material missing from it is a gouge, material left on it is excess."""

    file: Text = Field(description=".stl or .step, closed")
    units: Unit | None = Field(None, description="unit of an STL file, which does not state it")
    chord_mm: Positive = Field(0.01, le=1.0, description="greatest deviation of facets from a model's faces")
    spacing_mm: Positive = Field(description="longest side of the triangles whose corners are compared")
    excess_range_mm: Positive = Field(1.0, description="material over the part is measured up to this")


class FixtureTable(Table):
    """What no part of a tool may touch."""

    file: Text = Field(description=".stl or .step, closed")
    units: Unit | None = Field(None, description="unit of an STL file, which does not state it")
    chord_mm: Positive = Field(0.1, le=1.0, description="greatest deviation of facets from a model's faces")
    spacing_mm: Positive = Field(description="longest side of the triangles whose corners are compared")


class MachineTableTable(Table):
    """The table or pallet under the work, in the place of that of the machine file; it moves with the work, and no part
    of a tool may touch it.
    """

    low_mm: Point = Field(description="lower corner, in the coordinates of the work")
    high_mm: Point = Field(description="upper corner; its height is that of the face of the table")
    spacing_mm: Positive = Field(5.0, description="longest side of the triangles whose corners are compared")


class SimulateTable(Table):
    """Run the program through the stock: chips, forces, torque, power."""

    kind: Literal["simulate"]
    step_mm: Positive = Field(le=100.0, description="longest step of the tip")
    tolerance_mm: Positive = Field(0.001, ge=1e-6, le=0.1, description="how far chords may leave the edges of chips")
    interpolation: Literal["slerp", "lerp"] = Field("slerp", description="how the axis turns within a step")
    engine: Literal["auto", "moves", "layers"] = Field(
        "auto",
        description="auto: moves, or layers if moves cannot do it; moves: exact; layers: polygons",
    )
    workers: Annotated[Count, Field(le=64)] = Field(
        1, description="processes that share a layered stock in strips; the result does not depend on them"
    )
    corner_slices: Count | None = Field(
        None,
        le=200,
        description="slices of a corner radius, of equal angle; none: 24, narrower near the "
        "bottom; 48 alike where the axis leans",
    )
    flank_mm: Positive | None = Field(
        None, description="length of a slice of the flank; none: half the radius, a tenth where the axis leans"
    )
    stock_points_mm: Positive | None = Field(
        None, description="pitch of the points of the stock for the clearance of shank and holder; none: not checked"
    )
    speeds: SpeedsTable | None = Field(None, description="new spindle speeds; needs [dynamics]; none: they stay")
    confidence: Number = Field(
        0.5,
        ge=0.5,
        lt=1.0,
        description="one-sided confidence of the loads that limits are compared with; 0.5: their mean",
    )


class ProgramLimitsTable(Limits):
    """What the simulated loads must not exceed."""

    force_n: Positive | None = None
    torque_nm: Positive | None = None
    power_w: Positive | None = None
    chip_max_mm: Positive | None = None
    deflection_um: Positive | None = Field(None, description="displacement between tool and workpiece, see [stiffness]")
    deflection_workpiece_um: Positive | None = Field(None, description="deflection of the [workpiece]")
    form_error_um: Positive | None = Field(
        None, description="material left on, or removed from, the [part] by deflection"
    )
    gouge_mm: Positive | None = Field(None, description="deepest cut into the [part]")
    excess_mm: Positive | None = Field(None, description="most material over the [part] where the tool came near it")
    stability_margin: Positive | None = Field(
        None, le=3.0, description="least stability margin, see [dynamics]; 1 where it is not stated"
    )
    stable_probability: Positive | None = Field(
        None, lt=1.0, description="least probability of stability; needs spreads in [dynamics]"
    )
    sle_um: Positive | None = Field(None, description="material left on, or removed from, a wall by forced vibration")


#: limits that feeds can hold
LOADS = ("force_n", "torque_nm", "power_w", "chip_max_mm", "deflection_um", "deflection_workpiece_um")


def _stiff(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
        raise ValueError("must be a number, or inf where it is rigid")
    return float(value)


Stiff = Annotated[float, BeforeValidator(_stiff), Field(gt=0.0)]


class StiffnessTable(Table):
    """Stiffness of holder, spindle and workpiece; inf: rigid. A value that is not stated counts as rigid, and
    deflections are then unproven.
    """

    holder_gpa: Stiff | None = Field(None, description="Young's modulus of the holders, solid parts of holder_mm")
    grip_n_um: Stiff | None = Field(None, description="cutter in its holder, across the axis")
    grip_nm_rad: Stiff | None = Field(None, description="cutter in its holder, against tilting")
    spindle_n_um: Stiff | None = Field(None, description="end of the spindle, across the axis")
    spindle_nm_rad: Stiff | None = Field(None, description="end of the spindle, against tilting")
    work_n_um: Stiff | None = Field(None, description="work where it is cut, the same in every direction")


class ClampTable(Table):
    """A part of the stock that is held: on a face of it, in a box, or round a point such as a screw."""

    face: Literal["x-", "x+", "y-", "y+", "z-", "z+"] | None = Field(
        None, description="side of the stock; with low_mm and high_mm only what lies between them"
    )
    low_mm: Point | None = Field(None, description="lower corner of a box")
    high_mm: Point | None = Field(None, description="upper corner of a box")
    point_mm: Point | None = Field(None, description="middle of an upright cylinder")
    diameter_mm: Positive | None = Field(None, description="of the cylinder; it is as high as that")
    directions: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = Field(
        "xyz", description="directions in which it clamps"
    )
    stiffness_n_um: Positive | None = Field(
        None, description="of the whole clamp in each direction, e.g. soft jaws or vacuum; none: rigid"
    )


class WorkpieceTable(Table):
    """Elastic properties of the stock and its clamps: the deflection is that of the state of removal of each step."""

    modulus_gpa: Positive = Field(le=1000.0, description="Young's modulus")
    poisson: NotNegative = Field(lt=0.5, description="Poisson's ratio")
    clamp: tuple[ClampTable, ...] = Field(min_length=1, description="all of them together allow no rigid motion")
    density_kg_m3: Positive | None = Field(
        None, ge=500.0, le=25000.0, description="with it the workpiece has natural frequencies, in each state"
    )
    damping_ratio: Positive | None = Field(
        None, lt=0.5, description="of its modes in the clamps; needed by [dynamics]: without it stability is unproven"
    )
    yield_mpa: Positive | None = Field(
        None, ge=10.0, le=5000.0, description="stress up to which it springs back; with it that is a limit"
    )
    modes: Count = Field(4, le=20, description="lowest modes that are followed through the removal")
    order: Literal[2, 3] = Field(
        2, description="order of the modes of a cell; 3 takes longer and is more exact in corners"
    )
    cell_mm: Positive | None = Field(None, description="side of the cells; none: by the thinnest wall that is left")
    states: Count = Field(16, le=200, description="greatest number of states of removal that are solved")
    state_change_percent: Positive = Field(
        5.0,
        le=100.0,
        description="a state is added between two that differ by more, of the greatest deflection",
    )


class SimulationJobTable(Table):
    """What every job that runs a program has; with an operation the program is simulated."""

    program: ProgramTable
    machine: SourceTable
    stock: SolidTable | None = None
    part: TargetTable | None = None
    fixture: tuple[FixtureTable, ...] = ()
    machine_table: MachineTableTable | None = None
    material: SourceTable | None = None
    cutter: tuple[CutterTable, ...] = ()
    stiffness: StiffnessTable | None = None
    dynamics: DynamicsTable | None = None
    workpiece: WorkpieceTable | None = None
    checks: ChecksTable = Field(default_factory=ChecksTable.model_construct)
    operation: tuple[SimulateTable, ...] = Field((), max_length=1)
    limits: ProgramLimitsTable = Field(default_factory=ProgramLimitsTable.model_construct)
