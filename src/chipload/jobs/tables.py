"""Types and tables that the job files of all capabilities share: numbers, sources, limits, checks.

The name of a key contains its unit. A missing feed, tool, side or limit is an error; it is never guessed.
"""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo, field_validator

from chipload.checking.settings import CheckSettings
from chipload.errors import InputError
from chipload.ranges import bounds_of

Value = TypeVar("Value")

#: [mm] greatest length, and greatest number of any other unit, of a job file
FARTHEST_MM, GREATEST = 1e6, 1e15


def _only_number(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("must be a number")
    if not math.isfinite(value):
        raise ValueError("must be a finite number")
    if abs(value) > GREATEST:
        raise ValueError(f"must be within {GREATEST:g}")
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


Whole = Annotated[int, BeforeValidator(_only_count)]
Count = Annotated[Whole, Field(ge=1, le=1000)]
LineNumber = Annotated[int, BeforeValidator(_only_count), Field(ge=1, le=10_000_000)]


#: a face of a STEP file, by its number or by a point [mm] on it
FaceName = Annotated[int | tuple[float, float, float], BeforeValidator(_only_face)]


def _side_faces(value: Any) -> Any:
    """One face, or a list of several; three numbers are a point."""
    several = isinstance(value, list | tuple) and len(value) > 0
    if several and not (len(value) == 3 and all(isinstance(x, int | float) for x in value)):
        return tuple(_only_face(x) for x in value)
    return _only_face(value)


#: a side of a blade: a face, or several that make it together
SideFaces = Annotated[int | tuple[float, float, float] | tuple[FaceName, ...], BeforeValidator(_side_faces)]


Text = Annotated[str, Field(min_length=1)]


Unit = Literal["um", "mm", "cm", "m", "inch", "foot"]


def _is_within(value: Any, most: float) -> bool:
    """Whether a number, or each of a list of lists of them, is at most that large."""
    if isinstance(value, list | tuple):
        return all(_is_within(x, most) for x in value)
    return not isinstance(value, int | float) or abs(value) <= most


class Table(BaseModel):
    """A table of the file: unknown keys are refused, values do not change."""

    # a validator is built when a table of its kind is read: a job reads few kinds
    model_config = ConfigDict(extra="forbid", frozen=True, hide_input_in_errors=True, defer_build=True)

    @field_validator("*")
    @classmethod
    def _near(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse a length beyond any machine."""
        if str(info.field_name).endswith("_mm") and not _is_within(value, FARTHEST_MM):
            raise ValueError(f"must be within {FARTHEST_MM:g} mm")
        return value


def setting_field(kind: type, name: str, description: str) -> Any:
    """The field of a table that has default and range of a field of a settings class.

    Parameters
    ----------
    kind, name : the class of :mod:`chipload.checking`, and its field
    """
    return Field(description=description, **bounds_of(kind, name))


def value_of(kind: type[Value], table: BaseModel, **other: Any) -> Value:
    """A table as a value: each field of ``kind`` has the value of the key of its name.

    Parameters
    ----------
    other : fields in place of those of the table, or that it has not
    """
    names = [f.name for f in fields(kind)]  # type: ignore[arg-type]
    own = {name: getattr(table, name) for name in names if name in type(table).model_fields}
    return kind(**{**own, **other})


def require_stated(value: Value | None, key: str) -> Value:
    """The value of a key that another key makes necessary.

    Raises
    ------
    InputError
        It is not stated.

    Examples
    --------
    >>> require_stated(0.2, "wall.edge_share")
    0.2
    """
    if value is None:
        raise InputError(f"{key}: missing: state it")
    return value


class SourceTable(Table):
    """The name of one that comes with chipload, or the path of your own file."""

    name: Text | None = None
    file: Text | None = None


class LimitsTable(Table):
    """Limits by name. The report lists a limit that the job does not state as not checked."""

    @property
    def stated(self) -> dict[str, float]:
        """The limits that are stated, by name."""
        return {k: v for k, v in self.model_dump().items() if v is not None}

    @property
    def unstated(self) -> tuple[str, ...]:
        """Names of the limits that the job does not state; they are not checked."""
        return tuple(k for k, v in self.model_dump().items() if v is None)


def _switch(name: str, description: str) -> Any:
    return Field(description=description, strict=True, **bounds_of(CheckSettings, name))


class ChecksTable(Table):
    """Default checks. `false` switches a check off; the report lists the checks that are off."""

    confidence: Number = setting_field(
        CheckSettings,
        "confidence",
        "one-sided confidence at which limits of loads are held, with runout that is not known, coefficients, bending, "
        "thin chips and turns; 0.5: at nominal values, so that the spread of coefficients and runout is not counted",
    )
    cutter_strength: bool = _switch("cutter_strength", "check the stress of the cutter against its strength")
    flute_length: bool = _switch("flute_length", "check that the cutter does not cut above its flutes")
    chip_space: bool = _switch("chip_space", "check the chip space, if gullet_mm2 is stated")
    chip_range: bool = _switch(
        "chip_range", "check that chip thickness and cutting speed are within the range of the coefficients"
    )
    spindle: bool = _switch("spindle", "check torque and power of the machine's spindle")
    rigid_model: bool = _switch("rigid_model", "check that the deflection is within the range of the rigid force model")
    deflection_of_feed: Number = setting_field(
        CheckSettings,
        "deflection_of_feed",
        "range of the rigid model: greatest ratio of the deflection to the feed per tooth",
    )
    deflection_of_depth: Number = setting_field(
        CheckSettings,
        "deflection_of_depth",
        "range of the rigid model: greatest ratio of the deflection to the radial depth",
    )

    @property
    def off(self) -> tuple[str, ...]:
        """Names of the checks that are switched off."""
        return tuple(name for name, value in self.model_dump().items() if value is False)


class ProgramChecksTable(ChecksTable):
    """Default checks. `false` switches a check off; the report lists the checks that are off."""

    plunge: bool = _switch("plunge", "check that the cutters can plunge and ramp into material as the program does")


class WallChecksTable(ProgramChecksTable):
    """Default checks. `false` switches a check off; the report lists the checks that are off."""

    shank_in_stock: bool = _switch(
        "shank_in_stock", "check shank, neck and holder against the stock as it is at each moment"
    )
    slender_walls: bool = _switch(
        "slender_walls",
        "report walls that are left more slender than wall_slenderness, where no [workpiece] states how they deflect",
    )
    wall_slenderness: Number = setting_field(
        CheckSettings,
        "wall_slenderness",
        "height over thickness up to which a wall counts as rigid; 5 of aluminium 2 mm thick, clamped at its foot: "
        "0.33 um/N at its edge",
    )
    stress_wall_mm: Number = setting_field(
        CheckSettings,
        "stress_wall_mm",
        "thickness of walls below which the result lists distortion by residual stress as not checked",
    )


class StockChecksTable(WallChecksTable):
    """Default checks. `false` switches a check off; the report lists the checks that are off."""

    gouge: bool = _switch(
        "gouge",
        "check the deepest cut into the [part] against 0.1 mm, the least medium deviation of ISO 2768-1, if no limit "
        "is stated",
    )
    loose_stock: bool = _switch(
        "loose_stock", "check that no piece is cut on that the program has cut free of the stock"
    )
