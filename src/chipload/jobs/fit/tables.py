"""The tables of a job that identifies force coefficients from measured cuts.

Notation: T is the unit feed direction, n = Rot(+90 deg) T points to the left of the feed, seen from above, and the axis
points from the tip to the holder, all for a clockwise spindle. A channel is named with its sign: with
``across = "-Fx"``, the component along n is -Fx. ``on`` states on which body the measured force acts: on the work, as
with a dynamometer under it, or on the cutter.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from chipload.cutter.table import CutterTable
from chipload.jobs.tables import LimitsTable, Number, Positive, Table, Text


class EngagementTable(Table):
    """Engagement of the cutter, the same in all measurement files."""

    milling: Literal["slot", "up", "down"] = Field(description="kind of cut")
    axial_depth_mm: Positive = Field(description="axial depth of cut")
    radial_depth_mm: Positive | None = Field(None, description="radial depth of cut; required unless slot")


class ChannelsTable(Table):
    """Columns of the files that contain the force components, with their signs."""

    feed: str | None = Field(None, description='column of the force along the feed, with its sign, as "-Fy"')
    across: str | None = Field(None, description="column of the force across the feed")
    axis: str | None = Field(None, description="column of the force along the axis of the cutter")
    on: Literal["work", "cutter"] = Field(description="body on which the measured force acts")


class DynamometerTable(Table):
    """Natural frequencies of the dynamometer; a direction that is not stated is taken as rigid."""

    feed_hz: Positive | None = Field(None, description="approximate natural frequency along the feed")
    across_hz: Positive | None = Field(None, description="approximate natural frequency across the feed")
    axis_hz: Positive | None = Field(None, description="approximate natural frequency along the axis of the cutter")


class MeasurementTable(Table):
    """One file of measured forces and its cutting conditions."""

    file: Text = Field(description="file with the measured forces")
    use: Literal["fit", "predict"] = Field(description="fit: coefficients are fitted to it; predict: compared only")
    feed_mm_min: Positive = Field(le=100_000.0, description="feed of the cut")
    speed_rpm: Positive = Field(le=1_000_000.0, description="spindle speed of the cut")
    window_s: tuple[Number, Number] | None = Field(None, description="time range that is used; default: the whole file")
    channels: ChannelsTable | None = Field(None, description="channels of this file; default: those of the job")


class AxialTable(Table):
    """Axial coefficients from another source, if the axial force was not measured."""

    kac_mpa: Number = Field(description="axial cutting coefficient")
    kae_n_mm: Number = Field(description="axial edge coefficient")
    source: Text = Field(description="where the coefficients come from")


class FitLimitsTable(LimitsTable):
    """Greatest errors of the predicted forces."""

    mean_percent: Positive | None = Field(None, description="greatest error of a predicted mean force")
    peak_percent: Positive | None = Field(None, description="greatest error of a predicted peak force")


class FitJobTable(Table):
    """The job file of a job that fits force coefficients to measured forces."""

    name: Text = Field(description="name of the material that is written")
    source: Text = Field(description="where the measurements come from")
    workpiece: str = Field("", description="material of the workpiece that was cut")
    conditions: str = Field("", description="cutting conditions, e.g. dry or flood")
    method: Literal["average", "instantaneous"] = Field(
        description="average: fits mean forces; instantaneous: fits forces over whole turns"
    )
    band_hz: Positive | None = Field(
        None, description="highest frequency of the harmonics that are used; required with instantaneous"
    )
    runout: Literal["seek", "given"] = Field(
        "seek", description="seek: the runout is fitted too; given: the runout of the cutter is used"
    )
    zero: bool = Field(False, description="true: a constant offset of each channel is fitted too")
    cutter: CutterTable
    engagement: EngagementTable
    channels: ChannelsTable
    dynamometer: DynamometerTable = Field(default_factory=DynamometerTable.model_construct)
    axial: AxialTable | None = None
    limits: FitLimitsTable = Field(default_factory=FitLimitsTable.model_construct)
    measurement: tuple[MeasurementTable, ...] = Field(min_length=1)
