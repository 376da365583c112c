"""A job: one TOML file that names part, stock, machine, material and cutters, what to do, and the limits.

Every key carries its unit in its name; inside chipload the planner gets mm, mm/s and rad/s. A refused job gives one
line: the file, the dotted key, the value, the limit and what to do. Nothing that matters is guessed: a feed, a tool,
a side or a limit that is not stated is asked for.
"""

from __future__ import annotations

import difflib
import math
import re
import tomllib
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from chipload.cutter.cutter import Cutter
from chipload.cutter.table import CutterTable
from chipload.errors import InputError


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


Number = Annotated[float, BeforeValidator(_only_number), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0.0)]
NotNegative = Annotated[Number, Field(ge=0.0)]
Count = Annotated[int, BeforeValidator(_only_count), Field(ge=1, le=1000)]
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


class LimitsTable(Table):
    """What must not be exceeded; what is not stated is not checked, and the report says so."""

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


class ProgramJobTable(Table):
    """The whole file of a job that runs a program instead of a plan."""

    program: ProgramTable
    machine: SourceTable


class JobTable(Table):
    """The whole file of a job that is planned."""

    part: PartTable
    stock: StockTable
    machine: SourceTable
    material: SourceTable
    cutter: tuple[CutterTable, ...] = Field(min_length=1)
    operation: tuple[OperationTable, ...] = Field(min_length=1)
    limits: LimitsTable = Field(default_factory=LimitsTable.model_construct)


_ALWAYS = {"kind", "cutter", "milling", "radial_depth_mm", "axial_depth_mm", "feed_mm_min", "speed_rpm", "step_mm"}
#: keys that each kind needs beside those that all need
NEEDS: Mapping[str, tuple[str, ...]] = {
    "contour": ("side", "strategies", "joint", "semifinish_depth_mm", "tolerance_mm", "lead_mm"),
    "forward": ("side", "lead_mm"),
    "front": (),
}
#: keys that each kind also understands
MAY: Mapping[str, tuple[str, ...]] = {"contour": ("use", "passes"), "forward": ("passes",), "front": ("allowance_mm",)}


@dataclass(frozen=True)
class Job:
    """A job that was read and found whole; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    cutters : by number
    part_file : the drawing or model
    machine, material : a shipped name or a file
    findings : what was noticed and does not stop the job
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: JobTable
    cutters: Mapping[int, Cutter]
    part_file: Path
    machine: str | Path
    material: str | Path
    findings: tuple[str, ...]
    overrides: tuple[str, ...]

    @property
    def operations(self) -> tuple[OperationTable, ...]:
        """The operations in their order."""
        return self.table.operation

    @property
    def limits(self) -> dict[str, float]:
        """The limits that are stated, by name."""
        return {k: v for k, v in self.table.limits.model_dump().items() if v is not None}

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Names of the limits that are not stated, so that nothing holds the job against them."""
        return tuple(k for k, v in self.table.limits.model_dump().items() if v is None)


@dataclass(frozen=True)
class ProgramJob:
    """A job that runs a program; paths are absolute.

    Parameters
    ----------
    path : the job file
    table : its values
    program_file : NC text or CL data
    tools_file : tool table; None: none
    machine : a shipped name or a file
    overrides : the `--set` texts that were applied
    """

    path: Path
    table: ProgramJobTable
    program_file: Path
    tools_file: Path | None
    machine: str | Path
    overrides: tuple[str, ...]


def load_job(path: str | Path, overrides: Sequence[str] = ()) -> Job | ProgramJob:
    """Read a job file and apply ``key.path=value`` overrides; one with a ``[program]`` runs that.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a value is out of range: one line that names it.
    """
    path = Path(path).absolute()
    label = path.name
    try:
        raw = tomllib.loads(path.read_bytes().decode("utf-8"))
    except OSError as err:
        raise InputError(f"{path}: cannot be read: {err.strerror}") from None
    except (ValueError, RecursionError) as err:
        raise InputError(f"{label}: not a TOML file: {err}") from None
    for text in overrides:
        _override(raw, text)
    try:
        if "program" in raw:
            return _program_job(path, ProgramJobTable.model_validate(raw), overrides)
        table = JobTable.model_validate(raw)
    except ValidationError as err:
        raise InputError(f"{label}: {_first(err)}") from None
    except OverflowError:
        raise InputError(f"{label}: a number is too large: write it below 1e300") from None
    try:
        cutters = _cutters(table, path.parent)
        _check(table, cutters)
    except InputError as err:
        raise InputError(f"{label}: {err}") from None
    return Job(
        path,
        table,
        cutters,
        path.parent / table.part.file,
        _source("machine", table.machine, path.parent, label),
        _source("material", table.material, path.parent, label),
        _unused(table),
        tuple(overrides),
    )


def _program_job(path: Path, table: ProgramJobTable, overrides: Sequence[str]) -> ProgramJob:
    folder, tools = path.parent, table.program.tools
    machine = _source("machine", table.machine, folder, path.name)
    return ProgramJob(
        path, table, folder / table.program.file, None if tools is None else folder / tools, machine, tuple(overrides)
    )


# -- what one model cannot see ----------------------------------------------------------------------------------
def _source(key: str, table: SourceTable, folder: Path, label: str) -> str | Path:
    if (table.name is None) == (table.file is None):
        said = "none is" if table.name is None else "both are"
        raise InputError(f"{label}: {key}: {said} stated: state either {key}.name or {key}.file")
    return table.name if table.name is not None else folder / str(table.file)


def _cutters(table: JobTable, folder: Path) -> dict[int, Cutter]:
    out: dict[int, Cutter] = {}
    for k, entry in enumerate(table.cutter):
        try:
            cutter = entry.cutter(folder)
        except InputError as err:
            raise InputError(str(err).replace("cutter", f"cutter.{k}", 1)) from None
        if cutter.number in out:
            raise InputError(f"cutter.{k}.number = {cutter.number}: is taken by another cutter: give each its own")
        out[cutter.number] = cutter
    return out


def _check(table: JobTable, cutters: Mapping[int, Cutter]) -> None:
    """What an operation needs by its kind and by its cutter, and that something is checked at all."""
    for k, op in enumerate(table.operation):
        at = f"operation.{k}"
        for key in NEEDS[op.kind]:
            if getattr(op, key) is None:
                raise InputError(f"{at}.{key}: missing: state it (kind = {op.kind} needs it)")
        if op.kind == "contour":
            _check_strategies(at, op)
        if op.cutter not in cutters:
            known = ", ".join(str(n) for n in sorted(cutters))
            raise InputError(f"{at}.cutter = {op.cutter}: no [[cutter]] has this number: state one of {known}")
        cutter = cutters[op.cutter]
        if op.radial_depth_mm >= cutter.diameter:
            raise InputError(
                f"{at}.radial_depth_mm = {op.radial_depth_mm:g}: must be below the cutter's diameter_mm = "
                f"{cutter.diameter:g}: take several passes or a larger cutter"
            )
        if op.axial_depth_mm > cutter.flute_length:
            raise InputError(
                f"{at}.axial_depth_mm = {op.axial_depth_mm:g}: must be at most the cutter's flute_length_mm = "
                f"{cutter.flute_length:g}: take several depths or a longer cutter"
            )
    if all(v is None for v in table.limits.model_dump().values()):
        names = ", ".join(LimitsTable.model_fields)
        raise InputError(f"limits: none is stated, so nothing would be checked: state at least one of {names}")


def _check_strategies(at: str, op: OperationTable) -> None:
    listed = op.strategies or ()
    if not listed:
        raise InputError(f"{at}.strategies = []: must name at least one of plain, backward, feed")
    if len(set(listed)) < len(listed):
        raise InputError(f"{at}.strategies = {list(listed)}: a strategy is listed twice: list each once")
    if op.use is None and len(listed) > 1:
        raise InputError(f"{at}.use: missing: state which of {', '.join(listed)} is released")
    if op.use is not None and op.use not in listed:
        raise InputError(f"{at}.use = '{op.use}': must be one of {at}.strategies = {', '.join(listed)}")


def _unused(table: JobTable) -> tuple[str, ...]:
    """Keys that are stated but mean nothing to the kind of their operation."""
    out = []
    for k, op in enumerate(table.operation):
        known = {*_ALWAYS, "clearance_mm", *NEEDS[op.kind], *MAY[op.kind]}
        stated = [key for key in type(op).model_fields if getattr(op, key) is not None]
        out += [f"operation.{k}.{key}: not used by kind = {op.kind}" for key in stated if key not in known]
    return tuple(out)


# -- messages ---------------------------------------------------------------------------------------------------
def _first(err: ValidationError) -> str:
    """One line for the error that explains most: a misspelt key before the key that it leaves missing."""
    found = err.errors(include_url=False)
    # a list whose entry is refused is also called too short: the entry says more
    errors = [e for e in found if not any(o["loc"][: len(e["loc"])] == e["loc"] and o is not e for o in found)]
    unknown = [e for e in errors if e["type"] == "extra_forbidden"]
    if err.title == ProgramJobTable.__name__:
        planned = [e["loc"][0] for e in unknown if len(e["loc"]) == 1 and e["loc"][0] in JobTable.model_fields]
        if planned:
            return f"{planned[0]}: not used where a [program] is run: leave it out"
    others = [e for e in errors if e["type"] != "extra_forbidden"]
    meant = {(*e["loc"][:-1], _nearest(str(e["loc"][-1]), _keys(e["loc"][:-1]))) for e in unknown}
    rest = unknown + [e for e in others if not (e["type"] == "missing" and e["loc"] in meant)]
    more = f" (and {len(rest) - 1} more)" if len(rest) > 1 else ""
    return _line(rest[0]) + more


def _line(e: Any) -> str:
    """`cutter.0.diameter_mm = -5: must be above 0`."""
    loc, kind, context = e["loc"], e["type"], e.get("ctx", {})
    # a union or a validator may add words of its own to the place: keep keys and indices of the file only
    key = ".".join(str(x) for x in loc if isinstance(x, int) or str(x).isidentifier())
    if kind == "extra_forbidden":
        known = _keys(loc[:-1])
        return f"{key}: unknown key; did you mean {_nearest(str(loc[-1]), known)}?"
    if kind == "missing":
        return f"{key}: missing: state it{_meaning(loc)}"
    value = _short(e["input"])
    bounds = {"greater_than": ("gt", "above"), "greater_than_equal": ("ge", "at least")}
    bounds |= {"less_than": ("lt", "below"), "less_than_equal": ("le", "at most")}
    if kind in bounds:
        name, word = bounds[kind]
        return f"{key} = {value}: must be {word} {context[name]:g}{_meaning(loc)}"
    if kind == "finite_number":
        return f"{key} = {value}: must be a finite number{_meaning(loc)}"
    if kind == "literal_error":
        return f"{key} = {value}: must be one of {str(context['expected']).replace(' or ', ', ')}"
    if kind in ("value_error", "assertion_error"):
        return f"{key} = {value}: {context['error']}{_meaning(loc)}"
    if kind == "too_short":
        return f"{key}: has no entry: state at least one [[{key}]]"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {value}: must be a table, [{key}]"
    words = {
        "string_type": "must be a text",
        "string_too_short": "must not be empty",
        "tuple_type": f"must be a list, as [{value}]",
        "float_type": "must be a number",
        "int_type": "must be a whole number",
    }
    return f"{key} = {value}: {words.get(kind, e['msg'])}"


def _short(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _meaning(loc: tuple[int | str, ...]) -> str:
    """The description of a key in brackets, where it has one."""
    model = _model_at(loc[:-1])
    field = model.model_fields.get(str(loc[-1])) if model is not None else None
    return f" ({field.description})" if field is not None and field.description else ""


def _model_at(loc: Iterable[int | str]) -> type[BaseModel] | None:
    """The model of the table at a place in the file."""
    loc = tuple(loc)
    model: type[BaseModel] | None = ProgramJobTable if loc[:1] == ("program",) else JobTable
    for key in loc:
        if isinstance(key, int):
            continue
        field = model.model_fields.get(key) if model is not None else None
        model = None if field is None else _model_in(field.annotation)
    return model


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    found = [m for m in map(_model_in, typing.get_args(annotation)) if m is not None]
    return found[0] if found else None


def _keys(loc: Iterable[int | str]) -> tuple[str, ...]:
    model = _model_at(loc)
    return tuple(model.model_fields) if model is not None else ()


def _nearest(key: str, known: Sequence[str]) -> str:
    """The known key with the same first word (so that a wrong unit finds its key), else the nearest in spelling."""
    word = key.split("_")[0]
    same = [k for k in known if k.split("_")[0] == word]
    return (difflib.get_close_matches(key, same or list(known), 1, 0.0) or ["none: this is no table"])[0]


# -- --set ------------------------------------------------------------------------------------------------------
def _override(raw: dict[str, Any], text: str) -> None:
    """Apply one ``key.path=value`` to the table of the file, in place."""
    path, equals, value = text.partition("=")
    keys = [k.strip() for k in path.split(".")]
    if not equals or not all(keys):
        raise InputError(f"--set {text}: must be key.path=value, as cutter.0.diameter_mm=12")
    here: Any = raw
    holder: Any
    slot: Any
    for depth, key in enumerate(keys):
        last = depth == len(keys) - 1
        name = ".".join(keys[: depth + 1])
        if isinstance(here, list):
            at = ".".join(keys[:depth])
            if not (key.isdecimal() and int(key) < len(here)):
                raise InputError(
                    f"--set {text}: {name}: {at} has {len(here)} "
                    f"{'entry' if len(here) == 1 else 'entries'}: count from 0 to {len(here) - 1}"
                )
            here, holder, slot = here[int(key)], here, int(key)
        elif isinstance(here, dict):
            known = _keys([int(k) if k.isdecimal() else k for k in keys[:depth]])
            if key not in here and key not in known:
                raise InputError(f"--set {text}: {name}: unknown key; did you mean {_nearest(key, known)}?")
            if not last:
                here, holder, slot = here.setdefault(key, {}), here, key
            else:
                holder, slot = here, key
        else:
            raise InputError(f"--set {text}: {'.'.join(keys[:depth])} is a value, it holds no key {key}")
        if last:
            holder[slot] = _value(value)
            # a source is one or the other: stating the one takes the place of the other
            if name in ("machine.file", "machine.name", "material.file", "material.name"):
                holder.pop("name" if key == "file" else "file", None)


def _value(text: str) -> Any:
    """A TOML value, or the text itself where it is none.

    A number may be written without a digit before or after its point, which TOML itself does not allow.

    >>> _value("12"), _value(".5"), _value("nan") != _value("nan"), _value("part.dxf"), _value('["a", "b"]')
    (12, 0.5, True, 'part.dxf', ['a', 'b'])
    """
    text = text.strip()
    if re.fullmatch(r"[+-]?(\.\d+|\d+\.)([eE][+-]?\d+)?", text):
        return float(text)
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text
