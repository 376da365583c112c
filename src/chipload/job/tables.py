"""The tables of a job file: which keys there are, their units and their ranges.

Every key carries its unit in its name. Nothing that matters is guessed: a feed, a tool, a side or a limit that is not
stated is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from chipload.cutter.table import CutterTable


def _only_number(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("must be a number")
    if not math.isfinite(value):
        raise ValueError("must be a finite number")
    return value


def _only_count(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError("must be a whole number")
    return value


def _only_face(value: Any) -> Any:
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value <= 1_000_000:
            raise ValueError("must be from 1")
        return value
    if isinstance(value, (list, tuple)) and len(value) == 3:
        return tuple(float(_only_number(x)) for x in value)
    raise ValueError("must be the number of a face or a point [x, y, z] on it, in mm")


Number = Annotated[float, BeforeValidator(_only_number), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0.0)]
NotNegative = Annotated[Number, Field(ge=0.0)]
Point = Annotated[tuple[Number, Number, Number], Field()]
Count = Annotated[int, BeforeValidator(_only_count), Field(ge=1, le=1000)]
#: a face of a STEP file, by its number or by a point [mm] on it
FaceName = Annotated[int | tuple[float, float, float], BeforeValidator(_only_face)]
Text = Annotated[str, Field(min_length=1)]
Unit = Literal["um", "mm", "cm", "m", "inch", "foot"]
Strategy = Literal["plain", "backward", "feed"]


class Table(BaseModel):
    """A table of the file: unknown keys are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True)


class PartTable(Table):
    """What is to be made: a drawing (DXF) or a model (STEP)."""

    file: Text
    units: Unit | None = Field(None, description="overrides the units of the drawing")
    units_if_unsaid: Unit | None = Field(None, description="units of a drawing that names none")
    layers: tuple[Text, ...] = Field((), description="layers that are read; none: all")
    join_mm: NotNegative = Field(0.01, le=10.0, description="gaps up to this are closed and reported")
    tolerance_mm: Positive = Field(0.001, le=1.0, description="how far arcs may leave splines and ellipses")
    face_z_mm: Number | None = Field(None, description="height of the planar face of a STEP file")


class StockTable(Table):
    """What it is made from."""

    top_mm: Number = Field(description="z of the top of the stock")


class SourceTable(Table):
    """A shipped thing by name, or a file of one's own."""

    name: Text | None = None
    file: Text | None = None


class OperationTable(Table):
    """One operation; which keys it needs depends on its kind, see :data:`NEEDS`."""

    kind: Literal["contour", "forward", "front"]
    cutter: Count = Field(description="number of a [[cutter]]")
    milling: Literal["down", "up"]
    radial_depth_mm: Positive = Field(description="depth of cut across the wall")
    axial_depth_mm: Positive = Field(description="depth of cut along the axis")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the cutter's centre")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    step_mm: Positive = Field(le=10.0, description="step of the history")
    clearance_mm: Positive = Field(description="height of rapids above the top of the stock")
    side: Literal["inside", "outside", "left", "right"] | None = None
    strategies: tuple[Strategy, ...] | None = None
    use: Strategy | None = Field(None, description="the strategy whose program is released")
    joint: Literal["sharp", "clothoid"] | None = None
    semifinish_depth_mm: Positive | None = Field(None, description="radial depth of the first pass on a straight wall")
    passes: Count | None = Field(None, description="passes before the finish pass, or passes of forward")
    tolerance_mm: Positive | None = Field(None, le=1.0, description="how far eased joints may leave the drawing")
    lead_mm: Positive | None = Field(None, description="radius of the lead-in")
    allowance_mm: NotNegative | None = Field(None, description="left on the wall")


class Limits(Table):
    """Limits by name; what is not stated is not checked, and the report says so."""

    @property
    def stated(self) -> dict[str, float]:
        """The limits that are stated, by name."""
        return {k: v for k, v in self.model_dump().items() if v is not None}

    @property
    def unstated(self) -> tuple[str, ...]:
        """Names of the others, so that nothing holds the job against them."""
        return tuple(k for k, v in self.model_dump().items() if v is None)


class LimitsTable(Limits):
    """What a planned program must not exceed."""

    engagement_deg: Positive | None = Field(None, le=180.0)
    force_xy_n: Positive | None = None
    torque_nm: Positive | None = None
    error_um: Positive | None = None


class ProgramTable(Table):
    """A program that exists: NC text or CL data."""

    file: Text
    dialect: Literal["linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"] | None = None
    tools: Text | None = Field(None, description="LinuxCNC tool table")
    feed_mm_min: Positive | None = Field(None, le=1e5, description="feed of CL data that state none")
    tolerance_mm: Positive = Field(
        0.001, le=1.0, description="how far the tip may leave its path where a move is cut up"
    )


class SolidTable(Table):
    """What a program starts from: a block, a mesh (STL), a model (STEP), or what an earlier run left."""

    low_mm: Point | None = Field(None, description="lower corner of a block")
    high_mm: Point | None = Field(None, description="upper corner of a block")
    file: Text | None = Field(None, description=".stl, .step or an earlier result's .npz")
    units: Unit | None = Field(None, description="unit of an STL file, which does not say it")
    chord_mm: Positive = Field(0.01, le=1.0, description="how far facets may leave a model's faces")
    layer_mm: Positive | None = Field(None, description="thickness of the layers; an earlier result has its own")


class TargetTable(Table):
    """The part that the program should leave: what is cut into it is a gouge, what stands over it is excess."""

    file: Text = Field(description=".stl or .step, closed")
    units: Unit | None = Field(None, description="unit of an STL file, which does not say it")
    chord_mm: Positive = Field(0.01, le=1.0, description="how far facets may leave a model's faces")
    spacing_mm: Positive = Field(description="longest side of the triangles whose corners are looked at")
    look_mm: Positive = Field(1.0, description="material over the part is measured up to this")


class FixtureTable(Table):
    """What no part of a tool may touch."""

    file: Text = Field(description=".stl or .step, closed")
    units: Unit | None = Field(None, description="unit of an STL file, which does not say it")
    chord_mm: Positive = Field(0.1, le=1.0, description="how far facets may leave a model's faces")
    spacing_mm: Positive = Field(description="longest side of the triangles whose corners are looked at")


class FeedsTable(Table):
    """New feeds for the lines of the program, as fast as the stated limits of loads allow; the path stays."""

    slowest_percent: Positive = Field(le=100.0, description="least feed of a line that cuts, of the programmed one")
    fastest_percent: Positive = Field(ge=100.0, le=1e4, description="greatest feed of a line that cuts, likewise")
    fastest_mm_min: Positive | None = Field(None, le=1e6, description="greatest feed of a line that cuts")
    tooth_feed_least_mm: Positive | None = Field(
        None, description="least feed per tooth of a line that cuts, so that it does not rub"
    )
    air_mm_min: Positive | None = Field(
        None, le=1e6, description="feed of a line that touches nothing, if it is slower; none: it keeps its own"
    )
    change_least_percent: NotNegative = Field(
        5.0, lt=100.0, description="a feed that could rise by less than this stays that of the line before"
    )


class SimulateTable(Table):
    """Run the program through the stock: chips, forces, torque, power."""

    kind: Literal["simulate"]
    step_mm: Positive = Field(le=100.0, description="longest step of the tip")
    tolerance_mm: Positive = Field(0.001, le=0.1, description="how far chords may leave the edges of chips")
    interpolation: Literal["slerp", "lerp"] = Field("slerp", description="how the axis turns within a step")
    corner_slices: Count = Field(12, le=200, description="slices of a corner radius")
    flank_mm: Positive | None = Field(None, description="length of a slice of the flank; else half the radius")
    stock_points_mm: Positive | None = Field(
        None, description="pitch of the points of the stock that shank and holder are held against; none: they are not"
    )
    feeds: FeedsTable | None = Field(None, description="new feeds for the lines of the program; none: they stay")


class LoadLimitsTable(Limits):
    """What the simulated loads must not exceed."""

    force_n: Positive | None = None
    torque_nm: Positive | None = None
    power_w: Positive | None = None
    chip_mm: Positive | None = None
    deflection_um: Positive | None = Field(None, description="how far tool and work part, see [stiffness]")
    form_error_um: Positive | None = Field(None, description="what giving way leaves on, or takes from, the [part]")
    gouge_mm: Positive | None = Field(None, description="deepest cut into the [part]")
    excess_mm: Positive | None = Field(None, description="most material over the [part] where the tool came near it")


#: limits that feeds can hold
LOADS = ("force_n", "torque_nm", "power_w", "chip_mm", "deflection_um")


def _stiff(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
        raise ValueError("must be a number, or inf where it is rigid")
    return float(value)


Stiff = Annotated[float, BeforeValidator(_stiff), Field(gt=0.0)]


class StiffnessTable(Table):
    """What gives way beside the cutter; inf: rigid. What is not stated counts as rigid and leaves deflections
    unproven.
    """

    holder_gpa: Stiff | None = Field(None, description="Young's modulus of the holders, solid parts of holder_mm")
    grip_n_um: Stiff | None = Field(None, description="cutter in its holder, across the axis")
    grip_nm_rad: Stiff | None = Field(None, description="cutter in its holder, against tilting")
    spindle_n_um: Stiff | None = Field(None, description="end of the spindle, across the axis")
    spindle_nm_rad: Stiff | None = Field(None, description="end of the spindle, against tilting")
    work_n_um: Stiff | None = Field(None, description="work where it is cut, the same in every direction")


class ProgramJobTable(Table):
    """The whole file of a job that runs a program instead of a plan; with an operation it is simulated."""

    program: ProgramTable
    machine: SourceTable
    stock: SolidTable | None = None
    part: TargetTable | None = None
    fixture: tuple[FixtureTable, ...] = ()
    material: SourceTable | None = None
    cutter: tuple[CutterTable, ...] = ()
    stiffness: StiffnessTable | None = None
    operation: tuple[SimulateTable, ...] = Field((), max_length=1)
    limits: LoadLimitsTable = Field(default_factory=LoadLimitsTable.model_construct)


class JobTable(Table):
    """The whole file of a job that is planned."""

    part: PartTable
    stock: StockTable
    machine: SourceTable
    material: SourceTable
    cutter: tuple[CutterTable, ...] = Field(min_length=1)
    operation: tuple[OperationTable, ...] = Field(min_length=1)
    limits: LimitsTable = Field(default_factory=LimitsTable.model_construct)


#: keys that every planned operation needs
ALWAYS = {"kind", "cutter", "milling", "radial_depth_mm", "axial_depth_mm", "feed_mm_min", "speed_rpm", "step_mm"}
#: keys that each kind needs beside those that all need
NEEDS: Mapping[str, tuple[str, ...]] = {
    "contour": ("side", "strategies", "joint", "semifinish_depth_mm", "tolerance_mm", "lead_mm"),
    "forward": ("side", "lead_mm"),
    "front": (),
}
#: keys that each kind also understands
MAY: Mapping[str, tuple[str, ...]] = {"contour": ("use", "passes"), "forward": ("passes",), "front": ("allowance_mm",)}
