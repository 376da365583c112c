"""Reading of result folders: the summary, and the result with its histories."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from chipload.arrays import read_arrays
from chipload.errors import InputError
from chipload.files import hash_of
from chipload.lazy import pa, pq
from chipload.result.limits import Columns
from chipload.result.result import Result, SurfaceMap
from chipload.result.summary import SCHEMA_VERSION, Summary, TrackModel, finding_from, limit_from, provenance_from
from chipload.result.track import Track

SUMMARY, HISTORY, MAPS = "summary.json", "history.parquet", "maps.npz"
#: most bytes of a summary that is read
LARGEST_SUMMARY = 256 * 2**20
#: rows of a history that are read at once
ROWS = 65_536


def read_summary(folder: str | Path) -> Summary:
    """Read the summary of a result folder.

    Raises
    ------
    InputError
        It is no result, or of another version of the schema.
    """
    path = Path(folder) / SUMMARY
    try:
        if path.stat().st_size > LARGEST_SUMMARY:
            raise InputError(f"{path}: is larger than {LARGEST_SUMMARY} bytes: not a summary of chipload")
        return Summary.model_validate_json(path.read_bytes())
    except OSError as err:
        raise InputError(f"{path}: cannot be read: {err.strerror}: name a result folder") from None
    except ValidationError as err:
        count = err.error_count()
        differences = f"{count} difference{'s' if count > 1 else ''}"
        raise InputError(
            f"{path}: is not a result of schema version {SCHEMA_VERSION} ({differences}): run the job again"
        ) from None


def load_result(folder: str | Path) -> Result:
    """Load a result folder that ``chipload run`` wrote.

    The history of a track is read from history.parquet on first use.

    Raises
    ------
    InputError
        The folder holds no result that can be read.

    Examples
    --------
    >>> load_result("result")
    Traceback (most recent call last):
        ...
    chipload.errors.InputError: result/summary.json: cannot be read: No such file or directory: name a result folder
    """
    folder = Path(folder)
    summary = read_summary(folder)
    history = folder / HISTORY
    if summary.history_sha256 and history.exists() and hash_of(history) != summary.history_sha256:
        raise InputError(f"{history}: is not the history of this result, or has changed: run the job again")
    try:
        result, limits = _result(folder, summary), tuple(map(limit_from, summary.limits))
    except ValueError as err:
        raise InputError(f"{folder / SUMMARY}: {err}: run the job again") from None
    if result.limits != limits:
        raise InputError(f"{folder / SUMMARY}: limits differ from those of the tracks in use: run the job again")
    if result.verdict is not summary.verdict:
        raise InputError(
            f"{folder / SUMMARY}: verdict {summary.verdict.value} does not follow from its limits and findings, which "
            f"give {result.verdict.value}: run the job again"
        )
    return result


def _result(folder: Path, summary: Summary) -> Result:
    first, tracks = 0, []
    for model in summary.tracks:
        tracks.append(_track(folder, model, first))
        first += model.rows
    return Result(
        capability=summary.capability,
        title=summary.job,
        tracks=tuple(tracks),
        operations=summary.operations,
        findings=tuple(map(finding_from, summary.findings)),
        unchecked=summary.unchecked,
        provenance=provenance_from(summary.provenance),
        maps=_maps(folder, summary),
        note=summary.note,
    )


def _track(folder: Path, model: TrackModel, first: int) -> Track:
    return Track(
        name=model.name,
        kind=model.kind,
        in_use=model.in_use,
        time_s=model.time_s,
        time_high_s=model.time_high_s,
        limits=tuple(map(limit_from, model.limits)),
        findings=tuple(map(finding_from, model.findings)),
        programs=model.programs,
        operation=model.operation,
        parameters=model.parameters,
        energy_balance=model.energy_balance,
        blocks=partial(_blocks, folder / HISTORY, first, model.rows),
    )


def _blocks(path: Path, first: int, count: int) -> Iterator[Columns]:
    """Yield rows ``first`` to ``first + count`` of history.parquet in blocks, without the columns that are null."""
    if count == 0:
        return
    at = 0
    try:
        with pq.ParquetFile(path) as file:
            for batch in file.iter_batches(ROWS):
                low, high = max(first - at, 0), min(first + count - at, batch.num_rows)
                at += batch.num_rows
                if low < high:
                    yield _columns(pa.Table.from_batches([batch.slice(low, high - low)]))
    except (OSError, pa.ArrowException, UnicodeDecodeError) as err:
        raise InputError(f"{path.name}: cannot be read: {err}: run the job again") from None
    if at < first + count:
        raise InputError(f"{path.name}: has {at} rows, the summary states {first + count}: run the job again")


def _columns(table: pa.Table) -> Columns:
    own = [name for name in table.column_names if name not in ("operation", "track")]
    some = {name: table[name].combine_chunks() for name in own}
    return {name: np.asarray(a.to_numpy(zero_copy_only=False)) for name, a in some.items() if a.null_count < len(a)}


def _maps(folder: Path, summary: Summary) -> tuple[SurfaceMap, ...]:
    if not summary.maps:
        return ()
    stored = read_arrays(folder / MAPS)
    try:
        return tuple(
            SurfaceMap(
                m.name,
                m.column,
                stored[f"{k}-points"],
                stored[f"{k}-values"],
                stored[f"{k}-faces"],
                m.track,
                stored.get(f"{k}-displacement"),
            )
            for k, m in enumerate(summary.maps)
        )
    except (KeyError, ValueError) as err:
        raise InputError(f"{MAPS}: damaged: {err}: run the job again") from None
