"""The job tables of a simulation: program, stock, part, fixtures, stiffness, workpiece, operation and limits.

Jobs with `[program]` use them, whether or not they change feeds or speeds.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from chipload.cutter.table import CutterTable
from chipload.jobs.simulation.dynamics_tables import DynamicsTable, SpeedsTable
from chipload.jobs.tables import (
    Count,
    Limits,
    NotNegative,
    Number,
    Point,
    Positive,
    ProgramChecksTable,
    SourceTable,
    Table,
    Text,
    Unit,
)


class ProgramTable(Table):
    """The program: an NC program or CL data."""

    file: Text = Field(description="path of the program")
    dialect: Literal["linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"] | None = Field(
        None, description="controller whose rules apply; default: that of the machine"
    )
    tools: Text | None = Field(None, description="LinuxCNC tool table")
    feed_mm_min: Positive | None = Field(None, le=1e5, description="feed of cuts before the program states one")
    speed_rpm: Positive | None = Field(
        None, le=1e6, description="clockwise spindle speed until the program starts the spindle"
    )
    tolerance_mm: Positive = Field(
        0.001, ge=1e-6, le=1.0, description="greatest deviation of the tip where a move is divided"
    )
    parameters: dict[str, Number] = Field(
        default_factory=dict, description='variables of the controller, e.g. "#100" = 2.5, "#<depth>", R10 or Q10'
    )
    work_offsets: dict[str, tuple[Number, ...]] = Field(
        default_factory=dict,
        description="origins of the work offsets in machine coordinates, X Y Z A B C U V W in mm and degrees",
    )
    placed_in: Text | None = Field(
        None, description="work offset whose coordinates stock and part use; default: the first of the program"
    )
    tool_comments: bool = Field(True, description="compare the diameters in the program's comments with the cutters")


class SolidTable(Table):
    """The initial stock: a block, a mesh (STL), a model (STEP), or the remaining stock of an earlier run."""

    low_mm: Point | None = Field(None, description="lower corner of a block")
    high_mm: Point | None = Field(None, description="upper corner of a block")
    file: Text | None = Field(None, description=".stl, .step or stock.npz of an earlier result")
    units: Unit | None = Field(None, description="unit of an STL file, which does not state its unit")
    chord_mm: Positive = Field(0.01, le=1.0, description="greatest deviation of facets from the faces of a model")
    layer_mm: Positive | None = Field(
        None,
        description="thickness of the layers; default: from the depths of cut and the smallest cutter, at most 400 "
        "layers; an earlier result keeps its layers",
    )


class TargetTable(Table):
    """The part that the program should produce. Material missing from it is a gouge, material left on it is excess."""

    file: Text = Field(description=".stl or .step, a closed body")
    units: Unit | None = Field(None, description="unit of an STL file, which does not state its unit")
    chord_mm: Positive = Field(0.01, le=1.0, description="greatest deviation of facets from the faces of a model")
    spacing_mm: Positive = Field(description="longest side of the triangles whose corners are compared")
    excess_range_mm: Positive = Field(1.0, description="greatest excess that is measured")


class FixtureTable(Table):
    """A fixture, which no part of a tool may touch."""

    file: Text = Field(description=".stl or .step, a closed body")
    units: Unit | None = Field(None, description="unit of an STL file, which does not state its unit")
    chord_mm: Positive = Field(0.1, le=1.0, description="greatest deviation of facets from the faces of a model")
    spacing_mm: Positive = Field(description="longest side of the triangles whose corners are compared")


class MachineTableTable(Table):
    """The table or pallet under the workpiece, which no part of a tool may touch. It moves with the workpiece, and
    replaces the table of the machine file.
    """

    low_mm: Point = Field(description="lower corner, in workpiece coordinates")
    high_mm: Point = Field(description="upper corner; its height is that of the top face of the table")
    spacing_mm: Positive = Field(5.0, description="longest side of the triangles whose corners are compared")


class SimulateTable(Table):
    """Simulate the program in the stock: chips, forces, torque, power."""

    kind: Literal["simulate"] = Field(description="kind of the operation")
    step_mm: Positive = Field(le=100.0, description="longest step of the tip")
    tolerance_mm: Positive = Field(
        0.001, ge=1e-6, le=0.1, description="greatest deviation of chords from the edges of chips"
    )
    interpolation: Literal["slerp", "lerp"] = Field(
        "slerp", description="how the tool axis turns within a step: at constant rate, or along a straight line"
    )
    engine: Literal["auto", "moves", "layers"] = Field(
        "auto",
        description="moves: exact; layers: polygons in layers of the stock; auto: moves, or layers if moves cannot "
        "simulate the program",
    )
    workers: Annotated[Count, Field(le=64)] = Field(
        1, description="processes that share a layered stock in strips; does not change the result"
    )
    corner_slices: Count | None = Field(
        None,
        le=200,
        description="slices of a corner radius, of equal angle; default: 24, narrower near the bottom, or 48 equal "
        "ones if the axis leans",
    )
    flank_mm: Positive | None = Field(
        None, description="length of a slice of the flank; default: half the radius, or a tenth of it if the axis leans"
    )
    resolution_error: bool = Field(
        True,
        description="estimate the error of the loads by steps and slices from some steps that are computed again; "
        "false: limits on loads are unproven",
    )
    stock_points_mm: Positive | None = Field(
        None,
        description="distance of the points of the stock that are compared with shank and holder; default: not checked",
    )
    speeds: SpeedsTable | None = Field(None, description="new spindle speeds; needs [dynamics]; default: unchanged")
    confidence: Number = Field(
        0.5,
        ge=0.5,
        lt=1.0,
        description="one-sided confidence of the loads that are compared with limits; 0.5: mean loads",
    )


class ProgramLimitsTable(Limits):
    """Limits of the simulated loads and of the part."""

    force_n: Positive | None = Field(None, description="greatest force on the cutter")
    torque_nm: Positive | None = Field(None, description="greatest torque on the cutter")
    power_w: Positive | None = Field(None, description="greatest mean power over a revolution")
    chip_max_mm: Positive | None = Field(None, description="greatest undeformed chip thickness")
    deflection_um: Positive | None = Field(
        None, description="greatest displacement between tool and workpiece, see [stiffness]"
    )
    deflection_workpiece_um: Positive | None = Field(None, description="greatest deflection of the [workpiece]")
    form_error_um: Positive | None = Field(
        None, description="greatest thickness left on, or removed from, the [part] by deflection"
    )
    gouge_mm: Positive | None = Field(None, description="deepest cut into the [part]")
    excess_mm: Positive | None = Field(
        None, description="greatest thickness left on the [part] where the tool came near it"
    )
    stability_margin: Positive | None = Field(
        None, le=3.0, description="least stability margin, see [dynamics]; default 1 with [dynamics]"
    )
    stable_probability: Positive | None = Field(
        None, lt=1.0, description="least probability of stability; needs deviations in [dynamics]"
    )
    sle_um: Positive | None = Field(
        None, description="greatest thickness left on, or removed from, a wall by forced vibration"
    )


#: limits that new feeds can keep
LOADS = ("force_n", "torque_nm", "power_w", "chip_max_mm", "deflection_um", "deflection_workpiece_um")


def _stiff(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
        raise ValueError("must be a number, or inf where it is rigid")
    return float(value)


Stiff = Annotated[float, BeforeValidator(_stiff), Field(gt=0.0)]


class StiffnessTable(Table):
    """Stiffness of holder, spindle and workpiece. `inf` means rigid. A value that is not stated counts as rigid, and
    deflections are then unproven.
    """

    holder_gpa: Stiff | None = Field(None, description="Young's modulus of the holders, solid parts of holder_mm")
    grip_n_um: Stiff | None = Field(None, description="stiffness of the cutter in its holder, across the axis")
    grip_nm_rad: Stiff | None = Field(None, description="stiffness of the cutter in its holder, against tilting")
    spindle_n_um: Stiff | None = Field(None, description="stiffness of the spindle nose, across the axis")
    spindle_nm_rad: Stiff | None = Field(None, description="stiffness of the spindle nose, against tilting")
    work_n_um: Stiff | None = Field(
        None, description="stiffness of the workpiece where it is cut, the same in every direction"
    )


class ClampTable(Table):
    """A clamp. It holds the stock on a face, in a box, or around a point such as a screw."""

    face: Literal["x-", "x+", "y-", "y+", "z-", "z+"] | None = Field(
        None, description="side of the stock; with low_mm and high_mm only the area between them"
    )
    low_mm: Point | None = Field(None, description="lower corner of a box")
    high_mm: Point | None = Field(None, description="upper corner of a box")
    point_mm: Point | None = Field(None, description="centre of an upright cylinder")
    diameter_mm: Positive | None = Field(None, description="diameter and height of the cylinder")
    directions: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = Field(
        "xyz", description="directions in which the clamp holds"
    )
    stiffness_n_um: Positive | None = Field(
        None, description="stiffness of the whole clamp in each direction, e.g. of soft jaws or vacuum; default: rigid"
    )


class WorkpieceTable(Table):
    """Elastic properties of the workpiece and its clamps. The deflection of each step accounts for the material that is
    left at that step.
    """

    modulus_gpa: Positive = Field(le=1000.0, description="Young's modulus")
    poisson: NotNegative = Field(lt=0.5, description="Poisson's ratio")
    clamp: tuple[ClampTable, ...] = Field(min_length=1, description="clamps; together they allow no rigid motion")
    density_kg_m3: Positive | None = Field(
        None, ge=500.0, le=25000.0, description="density; required for natural frequencies of the workpiece"
    )
    damping_ratio: Positive | None = Field(
        None,
        lt=0.5,
        description="damping ratio of the clamped workpiece; without it, stability with [dynamics] is unproven",
    )
    yield_mpa: Positive | None = Field(
        None, ge=10.0, le=5000.0, description="yield stress; if stated, it limits the stress of the workpiece"
    )
    modes: Count = Field(4, le=20, description="number of lowest modes that are tracked as material is removed")
    order: Literal[2, 3] = Field(
        2, description="polynomial order of a cell; 3 takes longer and is more accurate in corners"
    )
    cell_mm: Positive | None = Field(None, description="side of the cells; default: from the thinnest remaining wall")
    states: Count = Field(16, le=200, description="greatest number of states of removal that are solved")
    state_change_percent: Positive = Field(
        5.0,
        le=100.0,
        description="a state is added between two whose deflections differ by more than this share of the greatest",
    )


class SimulationJobTable(Table):
    """The job file of a job that simulates a program. Without an operation, the program is only read and checked."""

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
    checks: ProgramChecksTable = Field(default_factory=ProgramChecksTable.model_construct)
    operation: tuple[SimulateTable, ...] = Field((), max_length=1)
    limits: ProgramLimitsTable = Field(default_factory=ProgramLimitsTable.model_construct)
