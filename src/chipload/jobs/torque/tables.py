"""The job tables of torque control on a thin tube, a cone or a clamped workpiece.

``[torque_control.override]`` and ``[spindle]`` have the same keys as the file of ``chipload hal``.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from chipload.cutter.table import CutterTable
from chipload.jobs.simulation.tables import SolidTable, WorkpieceTable
from chipload.jobs.tables import (
    ChecksTable,
    Count,
    LimitsTable,
    NotNegative,
    Number,
    Point,
    Positive,
    SourceTable,
    Table,
    Text,
)

Share = Annotated[Number, Field(gt=0.0, le=1.0)]
Angle = Annotated[Number, Field(ge=-360.0, le=720.0)]


class ShellProgramTable(Table):
    """An existing program: around the wall, or any program for a [workpiece]."""

    file: Text = Field(description="path of the program")
    dialect: Literal["linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"] | None = Field(
        None, description="controller whose rules apply; default: that of the machine"
    )
    feed_mm_min: Positive | None = Field(None, le=1e5, description="feed of cuts before the program states one")
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
    tool_comments: bool = Field(True, description="compare the diameters in the program's comments with the cutters")


class RoundTable(Table):
    """A generated program: a helix down the wall, then one full turn at the bottom."""

    cutter: Count = Field(description="number of a [[cutter]]")
    milling: Literal["down", "up"] = Field(description="down milling (climb) or up milling (conventional)")
    top_mm: Number = Field(description="height of the tip where the helix begins")
    bottom_mm: Number = Field(description="height of the tip in the last turn")
    pitch_mm: Positive = Field(description="lead of the helix")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the tip")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    clearance_mm: Positive = Field(description="height of rapids above the top of the wall")
    lead_mm: Positive = Field(description="length of the straight lead-in and lead-out")


class BossTable(Table):
    """A boss: additional stock over a part of the circumference, known to the plan."""

    from_deg: Angle = Field(description="angle at which the boss begins, counter-clockwise from +X")
    to_deg: Angle = Field(description="angle at which the boss ends, above from_deg")
    radial_mm: Positive = Field(description="radial stock in excess of stock_mm")


class ShellTable(Table):
    """The finished wall: a tube or cone about Z through X0 Y0, clamped at one end."""

    mean_radius_mm: Positive = Field(le=2000.0, description="mean radius of the wall at the clamped end")
    length_mm: Positive = Field(le=5000.0, description="length along the wall, from the clamp to the free end")
    wall_mm: Positive = Field(description="thickness of the finished wall, along its normal")
    angle_deg: Number = Field(
        0.0, ge=-60.0, le=60.0, description="half angle of a cone; above 0: the free end is wider"
    )
    clamped: Literal["low", "high"] = Field(description="end that is clamped")
    clamp_z_mm: Number = Field(description="z of the clamped end")
    modulus_gpa: Number = Field(ge=0.1, le=1000.0, description="Young's modulus: aluminium 70, titanium 114, steel 210")
    poisson: Number = Field(ge=0.0, lt=0.5, description="Poisson's ratio")
    strength_mpa: Number = Field(ge=1.0, le=5000.0, description="yield stress of the wall")
    stock_mm: Positive = Field(description="radial stock outside the finished wall")
    wall_tolerance_mm: NotNegative = Field(
        description="amount by which the wall may be thinner; the torque limit accounts for it"
    )
    boss: tuple[BossTable, ...] = Field((), max_length=20)


class SurpriseTable(Table):
    """A difference between the real part and the plan, which the controller does not know."""

    kind: Literal["thicker-side", "hard-spot", "worn-cutter", "thinner-wall"] = Field(description="kind of difference")
    share: Number = Field(
        gt=0.0, le=3.0, description="size of the difference; 0.3: 30 % more (thinner-wall: 30 % less)"
    )
    at_deg: Angle | None = Field(None, description="angle around the wall, counter-clockwise from +X")
    at_mm: Point | None = Field(None, description="centre of a hard spot in a [workpiece]")
    width_mm: Positive | None = Field(
        None, description="width of a hard spot around the wall; its diameter in a [workpiece]"
    )
    ramp_mm: Positive | None = Field(None, description="length of path over which a hard spot begins and ends")
    edge_share: NotNegative | None = Field(
        None, le=9.0, description="increase of the edge force of a worn cutter; 0.3: 30 % more"
    )


class OverrideTable(Table):
    """The rules of the controller. The torque that it holds follows from the limits."""

    hold: Share = Field(description="set point, as a share of the torque limit")
    overload_nm: Positive = Field(description="torque that stops the machine")
    torque_most_nm: Positive = Field(
        description="greatest torque that the spindle can give; a reading above it is invalid"
    )
    light_nm: Positive = Field(description="torque below which the estimate is not trusted")
    floor: Share = Field(description="least override while the controller runs")
    cap: Positive = Field(description="greatest override while the controller runs")
    start: Share = Field(description="override after a start")
    air_override: Positive = Field(description="greatest override in air, without a model")
    lost_override: NotNegative = Field(description="greatest override without a valid reading; 0: stop")
    lost_s: Positive = Field(description="time without a valid reading after which the machine stops")
    above_programmed: bool = Field(False, description="allow a cap above 1")
    slew_up_per_s: Positive = Field(1.0, description="greatest rise of the override per second")
    slew_down_per_s: Positive = Field(5.0, description="greatest fall of the override per second")
    gain_up_per_s: Positive = Field(
        1.5, description="greatest relative rise of the fuzzy controller's output per second"
    )
    gain_down_per_s: Positive = Field(
        6.0, description="greatest relative fall of the fuzzy controller's output per second"
    )
    error_span: Positive = Field(1.0, description="relative torque error at which the fuzzy sets end")
    change_span: Positive = Field(0.5, description="change of that error per step at which the fuzzy sets end")
    pi_gain: NotNegative | None = Field(
        None, description="proportional gain of the PI controller; default: by a tuning rule"
    )
    pi_rate_per_s: NotNegative | None = Field(
        None, description="integral gain of the PI controller; default: by a tuning rule"
    )
    overload_steps: Count = Field(3, description="steps above overload_nm that stop the machine")
    stuck_steps: Count = Field(10, description="steps with the same reading after which the reading is invalid")
    air_steps: Count = Field(3, description="low readings in a cut after which the override no longer rises")
    settle_steps: Count = Field(5, description="valid readings after a start before the override rises")
    low_share: NotNegative = Field(
        0.5, le=1.0, description="share of the predicted torque below which a reading is rejected"
    )
    low_steps: Count = Field(50, description="rejected low readings in a cut that stop the machine")
    off_path_steps: Count = Field(10, description="steps under load off the path that stop the machine")
    timeout_s: Positive = Field(
        0.5, le=10.0, description="time between two steps above which the controller starts again"
    )


class SpindleDeviationTable(Table):
    """Differences between the simulated real spindle and the controller's model of it."""

    torque_constant_percent: Number = Field(
        0.0, ge=-90.0, le=900.0, description="increase of the torque constant; above 0 the torque exceeds its estimate"
    )
    idle_percent: Number = Field(0.0, ge=-100.0, le=900.0, description="increase of the idle current")
    idle_drift_percent_per_min: Number = Field(
        0.0, ge=-1000.0, le=1000.0, description="increase of the idle current per minute of the program"
    )
    inertia_percent: Number = Field(0.0, ge=-90.0, le=900.0, description="increase of the inertia")
    sensor_lag_ms: Number = Field(0.0, ge=-1000.0, le=1000.0, description="increase of the sensor's time constant")


class SpindleTable(Table):
    """The spindle from whose current or power the torque is estimated. A file of `chipload spindle` can state the keys
    that this command identifies. For a spindle identified from its power, all currents stand for torques: power over
    speed, in N m.
    """

    file: Text | None = Field(None, description="file of chipload spindle; keys stated in the job override it")
    inertia_kg_m2: Positive | None = Field(None, description="moment of inertia of the rotor")
    torque_constant_nm_a: Positive | None = Field(None, description="torque per ampere")
    torque_constant_error_share: NotNegative | None = Field(
        None, le=0.5, description="relative uncertainty of the torque constant"
    )
    idle_a: tuple[Number, Number] | None = Field(
        None, description="idle current: constant part [A], and part per angular speed [A s]"
    )
    stiffness_a_s: Positive = Field(description="proportional gain of the speed controller of the drive")
    reset_a: NotNegative = Field(description="integral gain of the speed controller of the drive")
    most_current_a: Positive = Field(description="greatest current of the drive")
    sensor_lag_s: NotNegative | None = Field(None, description="time constant of the current sensor")
    smoothing_s: NotNegative | None = Field(None, description="time constant of the filter, about one revolution")
    noise_a: NotNegative | None = Field(None, description="standard deviation of a current reading")
    current_step_a: NotNegative | None = Field(None, description="quantisation step of a current reading; 0: none")
    idle_error_share: NotNegative | None = Field(None, le=1.0, description="relative uncertainty of the idle current")
    deviation: SpindleDeviationTable = Field(default_factory=SpindleDeviationTable.model_construct)


class LoopTable(Table):
    """Times of the control loop. Controllers are compared without, and then with, this latency and override step."""

    period_ms: Positive = Field(le=1000.0, description="time between two steps of the controller")
    latency_ms: NotNegative = Field(le=10_000.0, description="time until an override takes effect")
    override_step: NotNegative = Field(
        le=0.1, description="smallest change of the override that the machine accepts; 0.01: 1 %"
    )
    acceleration_mm_s2: Positive | None = Field(
        None, description="acceleration along the path; default: the least of the machine's axes"
    )
    seed: Annotated[int, Field(ge=0, le=2**32 - 1)] = Field(0, description="seed of the noise of the readings")


class TorqueControlTable(Table):
    """The wall, and the controller that limits the torque on it."""

    file: Text | None = Field(None, description="fuzzy sets and rules (TOML); default: the standard ones")
    shell: ShellTable | None = Field(None, description="the wall; without it, state [stock] and [workpiece]")
    override: OverrideTable


class SimulationTable(Table):
    """Resolution of the simulation."""

    step_mm: Positive = Field(le=10.0, description="longest step of the tip")
    layer_mm: Positive = Field(
        le=10.0,
        description="thickness of layers of stock in reach of the cutter, and step between depths of cut on a wall",
    )
    tolerance_mm: Positive = Field(
        0.005, ge=1e-6, le=0.1, description="greatest deviation of chords from the edges of chips"
    )


class TorqueLimitsTable(LimitsTable):
    """Limits of the wall or the workpiece. The torque limit follows from them."""

    form_error_um: Positive = Field(
        le=5000.0, description="greatest form error by deflection of wall, or workpiece, and cutter along the normal"
    )
    strength_share: Share = Field(
        description="greatest stress of the wall or workpiece over its strength (strength_mpa, yield_mpa)"
    )
    deflection_workpiece_um: Positive | None = Field(
        None, le=5000.0, description="greatest deflection of the [workpiece] itself, in any direction"
    )
    torque_nm: Positive | None = Field(None, description="greatest torque of the cutter or the spindle, if lower")
    torque_over_percent: NotNegative = Field(le=50.0, description="greatest excess of the torque over its limit")


class TorqueJobTable(Table):
    """The job file of a job that limits the torque."""

    program: ShellProgramTable | None = None
    round: RoundTable | None = None
    stock: SolidTable | None = Field(None, description="the stock of the plan; used with [workpiece]")
    real_stock: SolidTable | None = Field(None, description="the real stock; default: as planned")
    workpiece: WorkpieceTable | None = Field(
        None, description="workpiece whose deflection and strength limit the torque"
    )
    machine: SourceTable
    material: SourceTable
    cutter: tuple[CutterTable, ...] = Field(min_length=1)
    torque_control: TorqueControlTable
    surprise: tuple[SurpriseTable, ...] = Field((), max_length=50)
    spindle: SpindleTable
    loop: LoopTable
    simulation: SimulationTable
    limits: TorqueLimitsTable
    checks: ChecksTable = Field(default_factory=ChecksTable.model_construct)
