"""The schema of summary.json, with a version and the same for every capability; source of docs/summary.schema.json."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, JsonValue

from chipload.errors import Finding, Severity
from chipload.result.columns import column_of
from chipload.result.limits import LimitCheck
from chipload.result.result import Provenance, Result, SurfaceMap
from chipload.result.track import Track, TrackKind
from chipload.result.verdict import Verdict

#: version of the schema; it changes when a key moves or changes its meaning
SCHEMA_VERSION: Literal[1] = 1
Place = tuple[float, float, float]


class _SummaryPart(BaseModel):
    """A part of summary.json: no other keys, no number that is not finite; what is written has every key."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, json_schema_serialization_defaults_required=True
    )


class LimitModel(_SummaryPart):
    """A limit against the worst value that was found."""

    name: str = Field(description="name of the limit, as in [limits] of the job")
    column: str = Field(description="column of the history that it bounds")
    unit: str
    limit: float
    worst: float | None = Field(description="greatest value; null: not known")
    state: Verdict
    track: str
    row: int | None = Field(description="row of the track's history, from 0; null: not a row of it")
    line: int = Field(description="line of the program; 0: none")
    place: Place | None = Field(description="x, y, z in mm in the workpiece frame")
    t_s: float | None
    resolution_error: float = Field(description="relative error of worst by the resolution of the calculation")
    reason: str = Field(description="why the limit is unproven")


class FindingModel(_SummaryPart):
    """What was noticed."""

    code: str
    text: str
    severity: Literal["note", "unproven", "exceeds"]
    line: int
    place: Place | None
    row: int | None


class TrackModel(_SummaryPart):
    """One program along its path."""

    name: str
    kind: TrackKind
    operation: int
    in_use: bool
    verdict: Verdict
    time_s: float | None = Field(description="time of the program on the machine; null: it was not run")
    parameters: dict[str, float | str]
    programs: tuple[str, ...] = Field(description="files in the result folder")
    rows: int = Field(description="rows in history.parquet")
    energy_balance: dict[int, float] = Field(
        default_factory=dict,
        description="work over the specific energy of the volume removed, less 1, by tool; empty: not simulated",
    )
    limits: tuple[LimitModel, ...]
    findings: tuple[FindingModel, ...]


class MapModel(_SummaryPart):
    """A quantity over a surface; its arrays are in maps.npz."""

    name: str
    column: str
    track: str
    points: int
    least: float | None
    greatest: float | None
    greatest_place: Place | None


class ProvenanceModel(_SummaryPart):
    """Where the numbers come from."""

    inputs: dict[str, str]
    overrides: tuple[str, ...]
    machine: str
    materials: dict[str, str]
    versions: dict[str, str]


class Summary(_SummaryPart):
    """The content of summary.json."""

    schema_version: Literal[1]
    capability: str
    job: str
    verdict: Verdict
    message: str = Field(description="the verdict in a sentence or two")
    note: str = Field(description="what the message adds where everything holds")
    limits: tuple[LimitModel, ...] = Field(description="of the tracks in use")
    tracks: tuple[TrackModel, ...]
    findings: tuple[FindingModel, ...]
    unchecked: tuple[str, ...] = Field(description="limits that are not stated and checks that are switched off")
    maps: tuple[MapModel, ...]
    operations: tuple[dict[str, JsonValue], ...] = Field(description="numbers particular to the capability")
    provenance: ProvenanceModel


def summary_of(result: Result, rows: Mapping[str, int]) -> Summary:
    """Return the summary of a result.

    Parameters
    ----------
    rows : rows of the history by track

    Raises
    ------
    ValueError
        A number is not finite.
    """
    return Summary(
        schema_version=SCHEMA_VERSION,
        capability=result.capability,
        job=result.title,
        verdict=result.verdict,
        message=result.message,
        note=result.note,
        limits=tuple(map(_limit, result.limits)),
        tracks=tuple(_track(track, rows.get(track.name, 0)) for track in result.tracks),
        findings=tuple(map(_finding, result.findings)),
        unchecked=result.unchecked,
        maps=tuple(map(_map, result.maps)),
        operations=tuple(plain(x) for x in result.operations),
        provenance=ProvenanceModel(**vars(result.provenance)),
    )


def summary_bytes(result: Result, rows: Mapping[str, int]) -> bytes:
    """Return the bytes of summary.json; equal results give equal bytes.

    Raises
    ------
    ValueError
        As :func:`summary_of`.
    """
    values = summary_of(result, rows).model_dump(mode="json")
    return (json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def plain(value: Any) -> Any:
    """Convert NumPy scalars and arrays, tuples and enums to JSON values."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return [plain(v) for v in value.tolist()]
    if isinstance(value, Verdict):
        return value.value
    return value.item() if isinstance(value, np.generic) else value


def limit_from(model: LimitModel) -> LimitCheck:
    """Return the limit check that a summary contains.

    Raises
    ------
    InputError
        No column has the name of the limit.
    ValueError
        Its numbers do not agree.
    """
    column_of(model.name)
    return LimitCheck(**model.model_dump(exclude={"column", "unit"}))


def finding_from(model: FindingModel) -> Finding:
    """Return the finding that a summary contains."""
    severity = Severity[model.severity.upper()]
    return Finding(model.code, model.line, model.text, severity, model.place, model.row)


def provenance_from(model: ProvenanceModel) -> Provenance:
    """Return the provenance that a summary contains."""
    return Provenance(**model.model_dump())


def _limit(check: LimitCheck) -> LimitModel:
    return LimitModel(**vars(check), column=check.column.name, unit=check.column.unit)


def _finding(f: Finding) -> FindingModel:
    severity: Any = f.severity.name.lower()
    return FindingModel(code=f.code, text=f.text, severity=severity, line=f.line, place=f.place, row=f.row)


def _track(track: Track, rows: int) -> TrackModel:
    return TrackModel(
        name=track.name,
        kind=track.kind,
        operation=track.operation,
        in_use=track.in_use,
        verdict=track.verdict,
        time_s=track.time_s,
        parameters=dict(track.parameters),
        programs=track.programs,
        rows=rows,
        energy_balance={int(tool): float(value) for tool, value in track.energy_balance.items()},
        limits=tuple(map(_limit, track.limits)),
        findings=tuple(map(_finding, track.findings)),
    )


def _map(one: SurfaceMap) -> MapModel:
    known = np.flatnonzero(np.isfinite(one.values))
    if len(known) == 0:
        return MapModel(
            name=one.name, column=one.column, track=one.track, points=len(one.points), least=None, greatest=None,
            greatest_place=None,
        )  # fmt: skip
    k = int(known[np.argmax(one.values[known])])
    place = (float(one.points[k, 0]), float(one.points[k, 1]), float(one.points[k, 2]))
    return MapModel(
        name=one.name, column=one.column, track=one.track, points=len(one.points),
        least=float(one.values[known].min()), greatest=float(one.values[k]), greatest_place=place,
    )  # fmt: skip
