"""The tables of a job that identifies force coefficients from measured cuts.

Notation: T unit feed direction, n = Rot(+90 deg) T (to the left of the feed, seen from above), the axis from tip to
holder, all for a clockwise spindle. A channel is named with its sign: ``across = "-Fx"`` says that Fx, turned round, is
the component along n. ``on`` says whether the channels show the force on the work, as a dynamometer under it does, or
on the cutter.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from chipload.cutter.table import CutterTable
from chipload.jobs.tables import Limits, Number, Positive, Table, Text


class EngagementTable(Table):
    """What the cutter meets: the same in every file."""

    milling: Literal["slot", "up", "down"]
    axial_depth_mm: Positive
    radial_depth_mm: Positive | None = None


class ChannelsTable(Table):
    """Which column of the files is which component, with its sign."""

    feed: str | None = None
    across: str | None = None
    axis: str | None = None
    on: Literal["work", "cutter"]


class DynamometerTable(Table):
    """About where the dynamometer rings; what is not stated is taken as rigid."""

    feed_hz: Positive | None = None
    across_hz: Positive | None = None
    axis_hz: Positive | None = None


class MeasurementTable(Table):
    """One file."""

    file: Text
    use: Literal["fit", "predict"]
    feed_mm_min: Positive = Field(le=100_000.0)
    speed_rpm: Positive = Field(le=1_000_000.0)
    window_s: tuple[Number, Number] | None = None
    channels: ChannelsTable | None = None


class AxialTable(Table):
    """Axial coefficients from elsewhere, where the axis was not measured."""

    kac_mpa: Number
    kae_n_mm: Number
    source: Text


class FitLimitsTable(Limits):
    """How far the predictions may be off."""

    mean_percent: Positive | None = Field(None, description="greatest error of a predicted mean force")
    peak_percent: Positive | None = Field(None, description="greatest error of a predicted peak force")


class FitJobTable(Table):
    """The whole file of a job that identifies force coefficients from measured forces."""

    name: Text = Field(description="of the material that is made")
    source: Text = Field(description="where the measurements come from")
    workpiece: str = Field("", description="what was cut")
    conditions: str = Field("", description="cutting conditions, e.g. dry or flood")
    method: Literal["average", "instantaneous"] = Field(description="from mean forces, or from whole turns")
    band_hz: Positive | None = Field(None, description="harmonics up to here count; instantaneous needs it")
    runout: Literal["seek", "given"] = Field("seek", description="fitted too, or that of the cutter")
    zero: bool = Field(False, description="fit an offset of each channel too")
    cutter: CutterTable
    engagement: EngagementTable
    channels: ChannelsTable
    dynamometer: DynamometerTable = Field(default_factory=DynamometerTable.model_construct)
    axial: AxialTable | None = None
    limits: FitLimitsTable = Field(default_factory=FitLimitsTable.model_construct)
    measurement: tuple[MeasurementTable, ...] = Field(min_length=1)
