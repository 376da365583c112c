"""The tables of a job that predicts the distortion of a part by the residual stress of its plate.

Notation: z is the height, along the thickness of the plate. The stock is a blank of the plate over its whole thickness:
``[stock]`` states where the part lies in it.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from chipload.jobs.simulation.tables import ClampTable
from chipload.jobs.tables import LimitsTable, NotNegative, Number, Point, Positive, Table, Text, Unit

#: height, stress along the rolling direction and across it
StressPoint = tuple[NotNegative, Number, Number]
Percent = Annotated[Number, Field(ge=0.0, le=200.0)]


class ResidualStressTable(Table):
    """Residual stress of the plate over its thickness: a shape with its amplitude, points, or a file of points.

    A stress that is not in equilibrium is balanced, and the result says so; one far from it is refused.
    """

    shape: Literal["m"] | None = Field(
        None, description="m: compression at both faces and in the middle, tension between, as in stretched plate"
    )
    amplitude_mpa: Positive | None = Field(None, description="m: greatest stress along the rolling direction")
    across_share: Number | None = Field(
        None, ge=0.0, le=1.5, description="m: stress across the rolling direction over that along it"
    )
    points_mpa: tuple[StressPoint, ...] | None = Field(
        None,
        description="height above the underside of the plate in mm, stress along and across the rolling direction; "
        "linear between, tension positive",
    )
    file: Text | None = Field(None, description="table (CSV) of such points: height_mm, along_mpa, across_mpa")
    rolling: Literal["x", "y"] = Field(description="rolling direction of the plate")
    spread_percent: Percent = Field(50.0, description="half-width of the band of the stress from plate to plate")
    odd_percent: Percent = Field(
        25.0,
        description="greatest difference of the stress between the two faces of a plate that the profile does not "
        "state, in percent of the greatest stress",
    )
    source: Text = Field(description="where the stress comes from")


class DistortedPartTable(Table):
    """The finished part."""

    file: Text = Field(description="the part: STEP or STL")
    units: Unit | None = Field(None, description="unit of an STL file, which does not state its unit")
    chord_mm: Positive = Field(0.01, le=1.0, description="greatest deviation of facets from the faces of a model")
    spacing_mm: Positive | None = Field(
        None, description="longest side of the triangles whose corners are compared; default: 1/15 of the longest side"
    )


class PlateTable(Table):
    """The blank, cut from the plate over its whole thickness."""

    low_mm: Point = Field(description="lower corner; its height is the underside of the plate")
    high_mm: Point = Field(description="upper corner; its height is the upper side of the plate")


class ElasticTable(Table):
    """Elastic properties of the plate."""

    modulus_gpa: Positive = Field(le=1000.0, description="Young's modulus")
    poisson: Number = Field(ge=0.0, lt=0.5, description="Poisson's ratio")
    cell_mm: Positive | None = Field(None, description="side of the cells; default: 1/15 of the longest side")


class ClampingTable(Table):
    """One clamping: the part is released before and after it."""

    side: Literal["z+", "z-"] = Field(description="side that is milled: all that is open to it")
    stock_mm: NotNegative = Field(0.0, description="stock left on the part; 0: its faces are finished")
    clamp: tuple[ClampTable, ...] = Field(
        (), description="clamps; default: no surface moves until the part is released, as on a vacuum table"
    )
    hold: Literal["lies", "flat"] = Field(
        "lies", description="lies: the clamps take the part as it lies; flat: they press it into its undeformed shape"
    )


class ChoicesTable(Table):
    """What may be chosen: all combinations are compared, and the flattest is used. Without it, nothing is chosen."""

    offset_mm: tuple[NotNegative, ...] = Field(
        (), max_length=20, description="heights of the underside of the part above that of the plate"
    )
    flip: bool = Field(True, strict=True, description="the plate may be turned upside down")
    stock_mm: tuple[Positive, ...] = Field(
        (),
        max_length=8,
        description="stock to leave on all sides first: the part is released before its faces are finished",
    )
    first_side: bool = Field(True, strict=True, description="either side may be milled first")


class DistortionLimitsTable(LimitsTable):
    """Limits of the part after its release."""

    flatness_um: Positive | None = Field(None, description="flatness of the underside of the part")
    distortion_um: Positive | None = Field(
        None, description="greatest deviation of a face from where it was milled, over the best place of the part"
    )


class DistortionJobTable(Table):
    """The job file of a job that predicts the distortion of a part when it is released."""

    residual_stress: ResidualStressTable
    part: DistortedPartTable
    stock: PlateTable
    workpiece: ElasticTable
    setup: tuple[ClampingTable, ...] = Field(min_length=1, max_length=12)
    choices: ChoicesTable | None = None
    limits: DistortionLimitsTable = Field(default_factory=DistortionLimitsTable.model_construct)
