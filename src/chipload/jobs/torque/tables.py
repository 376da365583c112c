"""The tables of a job that holds the torque on a thin tube, a cone or a clamped workpiece: keys, units and ranges.

The keys of ``[torque_control]`` `override` and ``[spindle]`` are those of the file of ``chipload hal``.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from chipload.cutter.table import CutterTable
from chipload.jobs.simulation.tables import SolidTable, WorkpieceTable
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
)

Share = Annotated[Number, Field(gt=0.0, le=1.0)]
Angle = Annotated[Number, Field(ge=-360.0, le=720.0)]


class ShellProgramTable(Table):
    """An existing program: around the wall, or of any CAM on a [workpiece]."""

    file: Text
    dialect: Literal["linuxcnc", "fanuc", "sinumerik", "heidenhain", "apt"] | None = None
    feed_mm_min: Positive | None = Field(None, le=1e5, description="feed of cuts before the program states one")
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
    tool_comments: bool = Field(True, description="compare the diameters in the program's comments with the cutters")


class RoundTable(Table):
    """A program that is made: down the wall in a helix, then once round at the bottom."""

    cutter: Count = Field(description="number of a [[cutter]]")
    milling: Literal["down", "up"]
    top_mm: Number = Field(description="height of the tip where the helix begins")
    bottom_mm: Number = Field(description="height of the tip in the last round")
    pitch_mm: Positive = Field(description="lead of the helix")
    feed_mm_min: Positive = Field(le=1e5, description="feed of the tip")
    speed_rpm: Positive = Field(le=1e6, description="spindle speed")
    clearance_mm: Positive = Field(description="height of rapids above the top of the wall")
    lead_mm: Positive = Field(description="length of the straight lead-in and lead-out")


class BossTable(Table):
    """Stock that stands out over a part of the round, known beforehand."""

    from_deg: Angle
    to_deg: Angle = Field(description="above from_deg, counter-clockwise from +X")
    radial_mm: Positive = Field(description="radial stock in excess of stock_mm")


class ShellTable(Table):
    """The finished wall: a tube or cone about Z through X0 Y0, clamped at one end."""

    mean_radius_mm: Positive = Field(le=2000.0, description="of the middle of the wall at the clamped end")
    length_mm: Positive = Field(le=5000.0, description="along the wall, from the clamp to the free end")
    wall_mm: Positive = Field(description="thickness of the finished wall, along its normal")
    angle_deg: Number = Field(
        0.0, ge=-60.0, le=60.0, description="half angle of a cone; above 0: wider at its free end"
    )
    clamped: Literal["low", "high"] = Field(description="which end is clamped")
    clamp_z_mm: Number = Field(description="z of the clamped end")
    modulus_gpa: Number = Field(ge=0.1, le=1000.0, description="Young's modulus: aluminium 70, titanium 114, steel 210")
    poisson: Number = Field(ge=0.0, lt=0.5, description="Poisson's ratio")
    strength_mpa: Number = Field(ge=1.0, le=5000.0, description="stress that the wall must not exceed: its yield")
    stock_mm: Positive = Field(description="radial stock outside the finished wall")
    wall_tolerance_mm: NotNegative = Field(
        description="amount by which the wall may be thinner; the limit accounts for it"
    )
    boss: tuple[BossTable, ...] = Field((), max_length=20)


class SurpriseTable(Table):
    """Something true that the plan does not know."""

    kind: Literal["thicker-side", "hard-spot", "worn-cutter", "thinner-wall"]
    share: Number = Field(gt=0.0, le=3.0, description="0.3: 30 % more (of a thinner wall: less)")
    at_deg: Angle | None = Field(None, description="angle around the wall, counter-clockwise from +X")
    at_mm: Point | None = Field(None, description="middle of a hard spot of a [workpiece]")
    width_mm: Positive | None = Field(None, description="of a hard spot, round the wall; in a [workpiece] its diameter")
    ramp_mm: Positive | None = Field(None, description="length of path over which a hard spot begins and ends")
    edge_share: NotNegative | None = Field(
        None, le=9.0, description="of a worn cutter: the edge's part grows by so much"
    )


class OverrideTable(Table):
    """The rules of the controller; what it holds comes from the limit."""

    hold: Share = Field(description="set point, as a share of the limit of torque")
    overload_nm: Positive
    torque_most_nm: Positive
    light_nm: Positive
    floor: Share
    cap: Positive
    start: Share
    air_override: Positive
    lost_override: NotNegative
    lost_s: Positive
    above_programmed: bool = False
    slew_up_per_s: Positive = 1.0
    slew_down_per_s: Positive = 5.0
    gain_up_per_s: Positive = 1.5
    gain_down_per_s: Positive = 6.0
    error_span: Positive = 1.0
    change_span: Positive = 0.5
    pi_gain: NotNegative | None = Field(None, description="of the PI controller; none: by its tuning rule")
    pi_rate_per_s: NotNegative | None = Field(None, description="of the PI controller; none: by its tuning rule")
    overload_steps: Count = 3
    stuck_steps: Count = 10
    air_steps: Count = 3
    settle_steps: Count = 5
    low_share: NotNegative = Field(0.5, le=1.0, description="a reading below this share of the prediction is rejected")
    low_steps: Count = Field(50, description="number of such readings in a cut that stops the machine")
    off_path_steps: Count = Field(10, description="number of steps under load off the path that stops the machine")
    timeout_s: Positive = Field(0.5, le=10.0, description="a longer time between steps counts as a start")


class SpindleDeviationTable(Table):
    """How the real spindle of the simulation differs from what the controller believes."""

    torque_constant_percent: Number = Field(
        0.0, ge=-90.0, le=900.0, description="above 0: more torque for a current, so more than is estimated"
    )
    idle_percent: Number = Field(0.0, ge=-100.0, le=900.0, description="more current for the free spindle")
    idle_drift_percent_per_min: Number = Field(
        0.0, ge=-1000.0, le=1000.0, description="the same, growing while the program runs"
    )
    inertia_percent: Number = Field(0.0, ge=-90.0, le=900.0, description="more inertia")
    sensor_lag_ms: Number = Field(0.0, ge=-1000.0, le=1000.0, description="a longer lag of the sensor")


class SpindleTable(Table):
    """The spindle that the torque is estimated from.

    Keys that ``chipload spindle`` identifies may stand in its file. Of a spindle that is identified from its power all
    currents are torques, power over speed [N m].
    """

    file: Text | None = Field(None, description="file of `chipload spindle`; keys that are stated here override it")
    inertia_kg_m2: Positive | None = Field(None, description="of the rotor")
    torque_constant_nm_a: Positive | None = Field(None, description="torque for an ampere")
    torque_constant_error_share: NotNegative | None = Field(
        None, le=0.5, description="share by which the torque constant may differ: its interval"
    )
    idle_a: tuple[Number, Number] | None = Field(
        None, description="current of the free spindle: [A], [A s] times the speed"
    )
    stiffness_a_s: Positive
    reset_a: NotNegative
    most_current_a: Positive
    sensor_lag_s: NotNegative | None = Field(None, description="time constant of the current sensor")
    smoothing_s: NotNegative | None = Field(None, description="time constant of the filter, about a revolution")
    noise_a: NotNegative | None = Field(None, description="standard deviation of a reading of the current")
    current_step_a: NotNegative | None = Field(None, description="step of a reading of the current; 0: none")
    idle_error_share: NotNegative | None = Field(
        None, le=1.0, description="share by which the idle current may differ from idle_a"
    )
    deviation: SpindleDeviationTable = Field(default_factory=SpindleDeviationTable.model_construct)


class LoopTable(Table):
    """Times of the loop; the second comparison is made with the latency and the steps that are stated here."""

    period_ms: Positive = Field(le=1000.0, description="between two steps of the controller")
    latency_ms: NotNegative = Field(le=10_000.0, description="until an override acts")
    override_step: NotNegative = Field(le=0.1, description="step of the override that the controller takes, 0.01: 1 %")
    acceleration_mm_s2: Positive | None = Field(
        None, description="of the axes along the path; else the machine's least"
    )
    seed: Annotated[int, Field(ge=0, le=2**32 - 1)] = 0


class TorqueControlTable(Table):
    """The wall, and the controller that holds the torque on it."""

    file: Text | None = Field(None, description="sets and rules (TOML); none: the standard ones")
    shell: ShellTable | None = Field(None, description="the wall; none: state [stock] and [workpiece]")
    override: OverrideTable


class SimulationTable(Table):
    """How fine the chips are looked at."""

    step_mm: Positive = Field(le=10.0, description="longest step of the tip")
    layer_mm: Positive = Field(le=10.0, description="thickness of the layers of the stock where the cutter comes")
    tolerance_mm: Positive = Field(0.005, ge=1e-6, le=0.1, description="how far chords may leave the edges of chips")


class TorqueLimitsTable(Limits):
    """The limits of the wall or the workpiece."""

    form_error_um: Positive = Field(
        le=5000.0, description="by the deflection of wall, or workpiece, and cutter along the normal"
    )
    strength_share: Share = Field(
        description="share of its strength (strength_mpa, yield_mpa) that the wall or workpiece may be strained to"
    )
    deflection_workpiece_um: Positive | None = Field(
        None, le=5000.0, description="deflection of the [workpiece] itself, in any direction"
    )
    torque_nm: Positive | None = Field(None, description="of the cutter or the spindle, if less")
    torque_over_percent: NotNegative = Field(le=50.0, description="the torque may exceed its limit by so much")


class TorqueJobTable(Table):
    """The whole file."""

    program: ShellProgramTable | None = None
    round: RoundTable | None = None
    stock: SolidTable | None = Field(None, description="what the program is planned for; goes with [workpiece]")
    real_stock: SolidTable | None = Field(None, description="the stock as it really is; none: as planned")
    workpiece: WorkpieceTable | None = Field(None, description="whose deflection and strength limit the torque")
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
