"""The schema of summary.json, with a version, the same for every capability; source of docs/summary.schema.json."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, JsonValue

from chipload.errors import Finding, Severity
from chipload.result.budget import ErrorBudget, ErrorPart
from chipload.result.columns import column_of
from chipload.result.coverage import Coverage
from chipload.result.feed_law import FeedLaw
from chipload.result.limits import LimitCheck
from chipload.result.result import Provenance, Result, SurfaceMap
from chipload.result.track import Track, TrackKind
from chipload.result.verdict import Verdict

#: version of the schema; it changes when a key moves or changes its meaning
SCHEMA_VERSION: Literal[1] = 1
Place = tuple[float, float, float]


class _SummaryPart(BaseModel):
    """A part of summary.json: no other keys, finite numbers only; every key is written."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, json_schema_serialization_defaults_required=True
    )


class CoverageModel(_SummaryPart):
    """The rows of the track's history that a limit covers."""

    name: str = Field(description="name of the covered rows, such as all cuts or finish pass")
    reason: str = Field(description="why the limit does not count for the other rows; empty: it counts for all")
    ranges: tuple[tuple[int, int], ...] | None = Field(
        description="first row and end of each range of covered rows, from 0; null: all rows"
    )
    excluded_s: float = Field(description="time in the cut of the rows that are not covered")
    excluded_worst: float | None = Field(
        description="worst value in the cuts that are not covered; null: there are none"
    )


class ErrorPartModel(_SummaryPart):
    """A part of the error of a load, relative to its nominal value."""

    name: str = Field(description="name of the part")
    bound: float = Field(description="its greatest size; bounds add linearly")
    rise: float = Field(description="what it adds on average; it multiplies")
    deviation: float = Field(description="standard deviation; random parts add as the root of their squares")
    remedy: str = Field(description="what can be stated to make it less; empty: nothing")
    grows: bool = Field(default=False, description="whether it grows as chips become thinner")


class BudgetModel(_SummaryPart):
    """The error budget of a load."""

    confidence: float = Field(description="confidence at which the limit is held; 0.5: at the nominal value")
    shown_at: float = Field(description="confidence of value")
    value: float = Field(description="value at that confidence, in the unit of the limit")
    parts: tuple[ErrorPartModel, ...] = Field(description="parts of the error, the greatest first")


class FeedLawModel(_SummaryPart):
    """How the column of a limit changes with the feed: edge forces do not depend on it, chips and their forces do."""

    edge_low: float = Field(description="least edge force over the cutting force of a chip of 1 mm")
    edge_high: float = Field(description="greatest of these ratios")
    exponent: float = Field(description="exponent of the size effect")
    runout_mm: float = Field(description="part of the chip that runout makes, at most")


class LimitModel(_SummaryPart):
    """A limit, and the worst value of its column."""

    name: str = Field(description="name of the limit, as in [limits] of the job")
    column: str = Field(description="column of the history that it bounds")
    unit: str = Field(description="unit of limit and worst")
    limit: float = Field(description="value of the limit")
    worst: float | None = Field(description="worst value; null: not known")
    state: Verdict = Field(description="result of the check")
    track: str = Field(description="name of the track")
    row: int | None = Field(description="row of the track's history, from 0; null: not a row of it")
    line: int = Field(description="line of the program; 0: none")
    place: Place | None = Field(description="x, y, z in mm in the workpiece frame")
    t_s: float | None = Field(description="time of the row from the start of the program; null: not a row of it")
    resolution_error: float = Field(description="relative error of worst that the resolution of the calculation causes")
    absolute_error: float = Field(description="how much worse a value between the checked points may be")
    margin: float | None = Field(
        description="how far worst lies within the limit, over the limit; below 0: beyond it; null: it has none"
    )
    coverage: CoverageModel = Field(description="rows that the limit covers")
    reason: str = Field(description="why the limit is unproven")
    budget: BudgetModel | None = Field(description="parts of the error of worst; null: it is not that of a load")
    feed_law: FeedLawModel | None = Field(
        default=None, description="how the column changes with the feed; null: not known, or it does not"
    )


class FindingModel(_SummaryPart):
    """An observation of a reader, a planner or a check."""

    code: str = Field(description="code of the kind of finding")
    text: str = Field(description="the finding in a sentence")
    severity: Literal["note", "unproven", "exceeds"] = Field(description="effect on the verdict; note: none")
    line: int = Field(description="line of the program; 0: none")
    place: Place | None = Field(description="x, y, z in mm in the workpiece frame")
    row: int | None = Field(description="row of the track's history, from 0; null: not a row of it")


class TimesModel(_SummaryPart):
    """The time of a program by what the machine does; the parts add up to the time of the program."""

    cut_s: float = Field(description="motions at a feed that remove material")
    air_s: float = Field(description="motions at a feed that remove nothing, or of which it is not known")
    rapid_s: float = Field(description="rapids")
    dwell_s: float = Field(description="standing in a dwell")
    other_s: float = Field(description="tool change, start-up and the approach to the first point")


class TrackModel(_SummaryPart):
    """One program along its path."""

    name: str = Field(description="name of the track, unique in the result")
    kind: TrackKind = Field(description="kind of the track")
    operation: int = Field(description="number of its [[operation]], from 0")
    in_use: bool = Field(description="whether its program is the one that is released")
    verdict: Verdict = Field(description="verdict of this track")
    time_s: float | None = Field(description="cycle time of the program; null: not calculated")
    time_high_s: float | None = Field(
        default=None,
        description="what the program takes at most, where the jerk of the machine is not stated; null: time_s",
    )
    times: TimesModel | None = Field(description="parts of time_s; null: the track has no history")
    parameters: dict[str, float | str] = Field(description="parameters that distinguish the track from the others")
    programs: tuple[str, ...] = Field(description="files in the result folder")
    rows: int = Field(description="number of its rows in history.parquet")
    energy_balance: dict[int, float] = Field(
        default_factory=dict,
        description="work over the specific energy of the removed volume, less 1, by tool; empty: not simulated",
    )
    limits: tuple[LimitModel, ...] = Field(description="limit checks of this track")
    findings: tuple[FindingModel, ...] = Field(description="findings of this track")


class MapModel(_SummaryPart):
    """A quantity over a surface; its arrays are in maps.npz."""

    name: str = Field(description="name of the map")
    column: str = Field(description="column that it shows")
    track: str = Field(description="name of its track; empty: the whole result")
    points: int = Field(description="number of points")
    least: float | None = Field(description="least value; null: no point has a value")
    greatest: float | None = Field(description="greatest value; null: no point has a value")
    greatest_place: Place | None = Field(description="place of the greatest value, x, y, z in mm")


class ProvenanceModel(_SummaryPart):
    """Files, settings and versions from which the numbers of the result come."""

    inputs: dict[str, str] = Field(description="file name and hash of each input, by name")
    overrides: tuple[str, ...] = Field(description="keys of the job that were overridden")
    machine: str = Field(description="name of the machine, and a note")
    materials: dict[str, str] = Field(description="source of the coefficients of each material")
    versions: dict[str, str] = Field(
        description="versions of chipload, Python and the libraries that may change a number"
    )


class Summary(_SummaryPart):
    """The content of summary.json."""

    schema_version: Literal[1] = Field(description="version of this schema")
    capability: str = Field(description="kind of job")
    job: str = Field(description="title of the job")
    verdict: Verdict = Field(
        description="worst verdict of the tracks in use and the findings; unproven if no limit was checked"
    )
    message: str = Field(description="the verdict in one or two sentences")
    note: str = Field(description="addition to the message if everything holds")
    limits: tuple[LimitModel, ...] = Field(description="limit checks of the tracks in use")
    tracks: tuple[TrackModel, ...] = Field(description="all tracks")
    findings: tuple[FindingModel, ...] = Field(description="findings that belong to no track")
    unchecked: tuple[str, ...] = Field(description="limits that are not stated, and checks that are switched off")
    maps: tuple[MapModel, ...] = Field(description="surface maps")
    operations: tuple[dict[str, JsonValue], ...] = Field(description="values of this capability, by operation")
    history_sha256: str = Field("", description="hash of history.parquet; empty: the result was not written")
    provenance: ProvenanceModel


def summary_of(result: Result, rows: Mapping[str, int], history_sha256: str = "") -> Summary:
    """Return the summary of a result.

    Parameters
    ----------
    rows : rows of the history by track
    history_sha256 : of history.parquet

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
        findings=tuple(map(_finding_model, result.findings)),
        unchecked=result.unchecked,
        maps=tuple(map(_map, result.maps)),
        operations=tuple(plain(x) for x in result.operations),
        history_sha256=history_sha256,
        provenance=ProvenanceModel(**vars(result.provenance)),
    )


def summary_bytes(result: Result, rows: Mapping[str, int], history_sha256: str = "") -> bytes:
    """Return the bytes of summary.json; equal results give equal bytes.

    Raises
    ------
    ValueError
        As :func:`summary_of`.
    """
    values = summary_of(result, rows, history_sha256).model_dump(mode="json")
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
    own = model.model_dump(exclude={"column", "unit", "margin", "coverage", "budget", "feed_law"})
    law = None if model.feed_law is None else FeedLaw(**model.feed_law.model_dump())
    coverage = Coverage(**model.coverage.model_dump())
    return LimitCheck(**own, coverage=coverage, budget=_budget_from(model.budget), feed_law=law)


def _budget_from(model: BudgetModel | None) -> ErrorBudget | None:
    if model is None:
        return None
    return ErrorBudget(model.confidence, tuple(ErrorPart(**part.model_dump()) for part in model.parts))


def finding_from(model: FindingModel) -> Finding:
    """Return the finding that a summary contains."""
    severity = Severity[model.severity.upper()]
    return Finding(model.code, model.line, model.text, severity, model.place, model.row)


def provenance_from(model: ProvenanceModel) -> Provenance:
    """Return the provenance that a summary contains."""
    return Provenance(**model.model_dump())


def _limit(check: LimitCheck) -> LimitModel:
    law = None if check.feed_law is None else FeedLawModel(**vars(check.feed_law))
    coverage = CoverageModel(**vars(check.coverage))
    own = {**vars(check), "coverage": coverage, "budget": _budget(check), "feed_law": law}
    return LimitModel(**own, column=check.column.name, unit=check.column.unit, margin=check.margin)


def _budget(check: LimitCheck) -> BudgetModel | None:
    own, value = check.budget, check.value_at_confidence
    if own is None or value is None:
        return None
    parts = tuple(ErrorPartModel(**vars(part)) for part in own.parts)
    return BudgetModel(confidence=own.confidence, shown_at=own.shown_at, value=value, parts=parts)


def _finding_model(f: Finding) -> FindingModel:
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
        time_high_s=track.time_high_s,
        times=_times(track),
        parameters=dict(track.parameters),
        programs=track.programs,
        rows=rows,
        energy_balance={int(tool): float(value) for tool, value in track.energy_balance.items()},
        limits=tuple(map(_limit, track.limits)),
        findings=tuple(map(_finding_model, track.findings)),
    )


def _times(track: Track) -> TimesModel | None:
    own = track.times
    return None if own is None else TimesModel(**{f"{name}_s": value for name, value in vars(own).items()})


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
