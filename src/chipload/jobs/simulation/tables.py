"""The job tables of a simulation: program, stock, part, fixtures, stiffness, workpiece, operation and limits.

Jobs with `[program]` use them, whether or not they change feeds or speeds.
"""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, create_model

from chipload.checking.clamped import Workpiece
from chipload.checking.settings import Limits, SimulationSettings
from chipload.checking.stiffness import MachineStiffness
from chipload.checking.workpiece import FinishedPart
from chipload.cutter.table import CutterTable
from chipload.jobs.simulation.dynamics_tables import DynamicsTable, SpeedsTable
from chipload.jobs.tables import (
    LimitsTable,
    Number,
    Point,
    Positive,
    SourceTable,
    StockChecksTable,
    Table,
    Text,
    Unit,
    Whole,
    setting_field,
)
from chipload.program.control import CONTROLS

if TYPE_CHECKING:
    ControlName = str
else:
    # one of the profiles in program/controls
    ControlName = Literal[CONTROLS]


class ControlSettingsTable(Table):
    """Settings of the control that change how its programs are read. One that is not stated has the usual value of the
    control; where it matters, the result is then unproven.
    """

    point: Literal["increment", "whole"] | None = Field(
        None, description="numbers without a decimal point: least increments, or whole units (calculator type)"
    )
    feed_point: Literal["increment", "whole"] | None = Field(None, description="the same for F (Haas Setting 77)")
    dwell_s: Positive | None = Field(None, le=60.0, description="seconds in a unit of P of a dwell, e.g. 0.001")
    rotary_diameter_mm: Positive | None = Field(
        None, le=1e5, description="diameter at which degrees count as lengths for F (Haas Settings 34 and 79)"
    )


class ProgramTable(Table):
    """The program: an NC program or CL data."""

    file: Text = Field(description="path of the program")
    dialect: Literal["linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"] | None = Field(
        None, description="language of the program; default: by the file extension and by what the program shows"
    )
    control: ControlName | None = Field(
        None, description="control whose rules apply; default: by what the program shows and by the machine"
    )
    unit: Literal["mm", "inch"] | None = Field(
        None, description="unit of lengths before the program states one (G20, G21)"
    )
    compensation: Literal["control", "wear", "off"] | None = Field(
        None,
        description="what offsets for G41 and G42 hold: control: the radius of the cutter; wear: wear alone, so that "
        "the path is that of the centre; off: G41 and G42 are left out",
    )
    settings: ControlSettingsTable = Field(default_factory=ControlSettingsTable.model_construct)
    tools: Text | None = Field(None, description="LinuxCNC tool table")
    tools_unit: Literal["mm", "inch"] | None = Field(
        None, description="unit of the tool table; default: mm, or what agrees with the diameters in the program"
    )
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
    excess_range_mm: Positive = Field(FinishedPart.excess_range_mm, description="greatest excess that is measured")


class FixtureTable(Table):
    """A fixture, which no part of a tool may touch."""

    file: Text = Field(description=".stl or .step, a closed body")
    units: Unit | None = Field(None, description="unit of an STL file, which does not state its unit")
    chord_mm: Positive = Field(0.1, le=1.0, description="greatest deviation of facets from the faces of a model")
    spacing_mm: Positive = Field(description="longest side of the triangles whose corners are compared")


class WorkholdingTable(Table):
    """A fixture, which no part of a tool may touch: the body of a file, or a vise, a clamp or a block by its numbers.

    A vise holds the block of the stock between its jaws; a clamp is a strap with its bolt; a block is any box, such as
    a plate or a parallel.
    """

    kind: Literal["file", "vise", "clamp", "block"] = Field("file", description="what it is")
    file: Text | None = Field(None, description="file: .stl or .step, a closed body")
    units: Unit | None = Field(None, description="file: unit of an STL file, which does not state its unit")
    chord_mm: Positive = Field(0.1, le=1.0, description="file: greatest deviation of facets from the faces of a model")
    spacing_mm: Positive | None = Field(
        None, description="longest side of the triangles whose corners are compared; default: 2, of a file none"
    )
    closes: Literal["x", "y"] | None = Field(None, description="vise: axis along which it closes; default y")
    jaw_mm: Point | None = Field(None, description="vise: width, height and thickness of a jaw")
    grip_mm: Positive | None = Field(None, description="vise: height of the stock between the jaws")
    fixed: Literal["x-", "x+", "y-", "y+"] | None = Field(
        None, description="vise: side of the stock at the fixed jaw; default: the upper one"
    )
    opening_mm: Positive | None = Field(
        None, description="vise: distance between the jaws; default: the stock; must agree with it within 0.1"
    )
    step_mm: tuple[Positive, Positive] | None = Field(
        None, description="vise: height and depth of the step of the jaws that the stock rests on"
    )
    parallels_mm: Positive | None = Field(
        None, description="vise: thickness of the parallels that the stock rests on; as high as the jaw less grip_mm"
    )
    at_mm: Number | None = Field(None, description="vise: middle of the jaws along their width; default: of the stock")
    point_mm: Point | None = Field(None, description="clamp: middle of the end of the strap, on the stock")
    strap_mm: Point | None = Field(None, description="clamp: length, width and thickness of the strap")
    angle_deg: Number | None = Field(
        None, description="clamp: direction of the strap from point_mm, from X to Y; default 0, along X+"
    )
    bolt_mm: tuple[Positive, Positive] | None = Field(
        None, description="clamp: diameter of the bolt in the middle of the strap, and its height above the strap"
    )
    low_mm: Point | None = Field(None, description="block: lower corner")
    high_mm: Point | None = Field(None, description="block: upper corner")


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
    step_mm: Number = setting_field(SimulationSettings, "step_mm", "longest step of the tip")
    tolerance_mm: Number = setting_field(
        SimulationSettings, "tolerance_mm", "greatest deviation of chords from the edges of chips"
    )
    interpolation: Literal["slerp", "lerp"] = setting_field(
        SimulationSettings,
        "interpolation",
        "how the tool axis turns on a row: at constant rate, or along a straight line",
    )
    chip_diagram: bool = setting_field(
        SimulationSettings,
        "chip_diagram",
        "show the chip with most pieces on a layer of the stock, and the diagram of its boundary",
    )
    corner_slices: Whole | None = setting_field(
        SimulationSettings,
        "corner_slices",
        "slices of a corner radius, of equal angle; default: 24, narrower near the bottom, or 48 equal "
        "ones if the axis leans",
    )
    flank_mm: Number | None = setting_field(
        SimulationSettings,
        "flank_mm",
        "length of a slice of the flank; default: half the radius, or a tenth of it if the axis leans",
    )
    resolution_error: bool = setting_field(
        SimulationSettings,
        "resolution_error",
        "estimate the error of the loads by steps and slices from some steps that are computed again; false: limits on "
        "loads are unproven",
    )
    stock_points_mm: Number | None = setting_field(
        SimulationSettings,
        "stock_points_mm",
        "greatest distance of the columns, or where the axis leans of the points, of the stock that are compared with "
        "shank and holder; default: from the cutters and the size of the stock",
    )
    join_mm: Number | None = setting_field(
        SimulationSettings,
        "join_mm",
        "short straight cuts are simulated as one that is at most as far from them, which leaves the result unproven; "
        "default: each by itself",
    )
    speeds: SpeedsTable | None = Field(None, description="new spindle speeds; needs [dynamics]; default: unchanged")


if TYPE_CHECKING:

    class ProgramLimitsTable(LimitsTable):
        """Limits of the simulated loads and of the part."""

else:
    ProgramLimitsTable = create_model(
        "ProgramLimitsTable",
        __base__=LimitsTable,
        __module__=__name__,
        **{f.name: (Number | None, setting_field(Limits, f.name, f.metadata["text"])) for f in fields(Limits)},
    )
    ProgramLimitsTable.__doc__ = "Limits of the simulated loads and of the part."


#: limits that new feeds can keep
LOADS = (
    "force_n", "force_axial_n", "torque_nm", "power_w", "chip_max_mm", "deflection_um", "deflection_workpiece_um",
)  # fmt: skip


def _stiff(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
        raise ValueError("must be a number, or inf where it is rigid")
    return float(value)


Stiff = Annotated[float, BeforeValidator(_stiff)]


def _stiffness(name: str, description: str) -> Any:
    return setting_field(MachineStiffness, name, description)


class StiffnessTable(Table):
    """Stiffness of holder, spindle and workpiece. `inf` means rigid. A value that is not stated counts as rigid, and
    deflections are then unproven.
    """

    holder_gpa: Stiff | None = _stiffness("holder_gpa", "Young's modulus of the holders, solid parts of holder_mm")
    grip_n_um: Stiff | None = _stiffness("grip_n_um", "stiffness of the cutter in its holder, across the axis")
    grip_nm_rad: Stiff | None = _stiffness("grip_nm_rad", "stiffness of the cutter in its holder, against tilting")
    spindle_n_um: Stiff | None = _stiffness("spindle_n_um", "stiffness of the spindle nose, across the axis")
    spindle_nm_rad: Stiff | None = _stiffness("spindle_nm_rad", "stiffness of the spindle nose, against tilting")
    work_n_um: Stiff | None = _stiffness(
        "work_n_um", "stiffness of the workpiece where it is cut, the same in every direction"
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

    modulus_gpa: Number = setting_field(Workpiece, "modulus_gpa", "Young's modulus")
    poisson: Number = setting_field(Workpiece, "poisson", "Poisson's ratio")
    clamp: tuple[ClampTable, ...] = Field(min_length=1, description="clamps; together they allow no rigid motion")
    density_kg_m3: Number | None = setting_field(
        Workpiece, "density_kg_m3", "density; required for natural frequencies of the workpiece"
    )
    damping_ratio: Number | None = setting_field(
        Workpiece,
        "damping_ratio",
        "damping ratio of the clamped workpiece; without it, stability with [dynamics] is unproven",
    )
    yield_mpa: Number | None = setting_field(
        Workpiece, "yield_mpa", "yield stress; if stated, it limits the stress of the workpiece"
    )
    modes: Whole = setting_field(Workpiece, "modes", "number of lowest modes that are tracked as material is removed")
    order: Literal[2, 3] = Field(
        Workpiece.order,
        description="polynomial order of a cell; 3 takes longer and is more accurate in corners",
    )
    cell_mm: Number | None = setting_field(
        Workpiece, "cell_mm", "side of the cells; default: from the thinnest remaining wall"
    )
    states: Whole = setting_field(Workpiece, "states", "greatest number of states of removal that are solved")
    state_change_percent: Number = setting_field(
        Workpiece,
        "state_change_percent",
        "a state is added between two whose deflections differ by more than this share of the greatest",
    )


class SimulationJobTable(Table):
    """The job file of a job that simulates a program. Without an operation, the program is only read and checked."""

    program: ProgramTable
    machine: SourceTable
    stock: SolidTable | None = None
    part: TargetTable | None = None
    fixture: tuple[WorkholdingTable, ...] = ()
    machine_table: MachineTableTable | None = None
    material: SourceTable | None = None
    cutter: tuple[CutterTable, ...] = ()
    stiffness: StiffnessTable | None = None
    dynamics: DynamicsTable | None = None
    workpiece: WorkpieceTable | None = None
    checks: StockChecksTable = Field(default_factory=StockChecksTable.model_construct)
    operation: tuple[SimulateTable, ...] = Field((), max_length=1)
    limits: ProgramLimitsTable = Field(default_factory=ProgramLimitsTable.model_construct)
