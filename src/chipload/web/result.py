"""A result in the form that the page needs: summary, and history by tracks.

The rows of a track follow one another in history.parquet. Columns are read from
history.parquet on request, so that a long history costs only what is shown.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import pa, pq
from chipload.result import Result, Track, load_result, read_summary
from chipload.result.load import HISTORY
from chipload.result.summary import TimesModel
from chipload.result.times import Times
from chipload.web.folder_access import resolve_name

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SCENE, REPORT = "scene.glb", "report.html"
PLACE, AXIS = ("x_mm", "y_mm", "z_mm"), ("axis_x", "axis_y", "axis_z")
#: columns that identify a row and are not drawn
BELONGS = ("operation", "track")
#: columns kept for a result at a time
KEPT = 24
#: rows that the page shows at most: a column of them takes 400 MB
ROWS = 50_000_000


class NoMotionError(InputError):
    """A result has no row of a motion; ``result`` is what it has."""

    def __init__(self, text: str, result: Result) -> None:
        super().__init__(text)
        self.result = result


@dataclass(frozen=True, eq=False)
class TextColumn:
    """A column of words: the code of each row, and what the codes mean."""

    codes: Ints
    words: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class PageTrack:
    """A track of the result with what the page needs at every row.

    Parameters
    ----------
    own : the track of the result: its limits, findings, programs
    title : what it is called on the page
    first : its first row in history.parquet
    t, s : (n,) time [s] and path [mm] at the end of each row, never falling
    place : (n, 3) [mm]
    axis : (n, 3) from the tip to the spindle
    line, tool : (n,), of the source and of the machine; None where the history has no such column
    apart : (n,) whether the path does not continue from the row before
    times : the time of its program by what the machine does; None: not known
    """

    own: Track
    title: str
    first: int
    t: Floats
    s: Floats
    place: Floats
    axis: Floats
    line: Ints | None
    tool: Ints | None
    apart: NDArray[np.bool_]
    times: Times | None = None

    def __len__(self) -> int:
        return len(self.t)

    @property
    def operation(self) -> int:
        """Number of its operation."""
        return self.own.operation


@dataclass(eq=False)
class PageResult:
    """A result folder: only its cache of columns changes.

    Parameters
    ----------
    name, root : of the folder, and the opened folder
    result : verdict, limits, findings, provenance
    columns : that can be drawn, in their order
    tracks : those with a history, the ones in use first
    count : rows of history.parquet
    """

    name: str
    root: Path
    result: Result
    columns: tuple[str, ...]
    tracks: tuple[PageTrack, ...]
    count: int
    _cache: dict[str, Floats | TextColumn] = field(default_factory=dict)

    @property
    def first(self) -> int:
        """Number of the track that is shown first: that of the critical limit."""
        critical = self.result.critical
        own = (k for k, track in enumerate(self.tracks) if any(check is critical for check in track.own.limits))
        return next(own, 0)

    def file(self, name: str) -> Path:
        """A file of the result.

        Raises
        ------
        InputError
            It is not there, or not in the opened folder.
        """
        return resolve_name(self.root, f"{self.name}/{name}")

    def column(self, track: PageTrack, name: str) -> Floats | TextColumn:
        """A column on the rows of a track.

        Raises
        ------
        InputError
            The history has no such column.
        """
        if name not in self.columns:
            raise InputError(f"{HISTORY}: no column {name}")
        if name not in self._cache:
            while len(self._cache) >= KEPT:
                self._cache.pop(next(iter(self._cache)))
            table = _table(self.file(HISTORY), [name])
            if table.num_rows != self.count:
                raise InputError(f"{self.name}/{HISTORY}: has changed: open the result again")
            self._cache[name] = _column(table, name)
        whole, some = self._cache[name], slice(track.first, track.first + len(track))
        return TextColumn(whole.codes[some], whole.words) if isinstance(whole, TextColumn) else whole[some]


def open_result(root: Path, name: str) -> PageResult:
    """Read a result.

    Raises
    ------
    InputError
        It is no result, or its history cannot be read.
    NoMotionError
        Its history has no place.
    """
    folder = resolve_name(root, name)
    models = {track.name: track for track in read_summary(folder).tracks}
    rows = {name: model.rows for name, model in models.items()}
    result = load_result(folder)
    path = resolve_name(root, f"{name}/{HISTORY}")
    try:
        found = pq.read_metadata(path)
        schema = pq.read_schema(path)
    except (OSError, pa.ArrowException, UnicodeDecodeError):
        raise InputError(f"{name}/{HISTORY}: cannot be read: run the job again") from None
    if found.num_rows > ROWS:
        raise InputError(
            f"{name}/{HISTORY}: {found.num_rows} rows: the page shows at most {ROWS}: run the job with longer steps"
        )
    drawn = tuple(f.name for f in schema if f.name not in BELONGS and _drawable(f.type))
    wanted = ["t_s", "s_mm", *PLACE, *AXIS, "line", "tool"]
    table = _table(path, [c for c in wanted if c in schema.names])
    missing = [c for c in (*PLACE, "t_s", "s_mm") if c not in table.column_names]
    if missing or table.num_rows == 0 or sum(rows.values()) != table.num_rows:
        why = "no row" if not missing else f"no {missing[0]}"
        text = f"{name}/{HISTORY}: {why}: nothing to show of its motion: open {name}/report.html"
        raise NoMotionError(text, result)
    tracks, first = [], 0
    for track in result.tracks:
        if rows[track.name]:
            tracks.append(_track(table, track, first, rows[track.name], models[track.name].times))
        first += rows[track.name]
    tracks.sort(key=lambda track: not track.own.in_use)
    return PageResult(name, root, result, drawn, tuple(tracks), table.num_rows)


# -- parts ------------------------------------------------------------------------------------------------------
def _drawable(kind: Any) -> bool:
    simple = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
    words = pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_dictionary(kind)
    return bool(simple or words)


def _table(path: Path, names: list[str]) -> Any:
    try:
        return pq.read_table(path, columns=names)
    except (OSError, pa.ArrowException, UnicodeDecodeError) as err:
        raise InputError(f"{path.name}: cannot be read: {err}") from None


def _column(table: Any, name: str) -> Floats | TextColumn:
    column = table[name].combine_chunks()
    if pa.types.is_boolean(column.type):
        return TextColumn(column.cast(pa.int64()).fill_null(0).to_numpy(zero_copy_only=False), ("no", "yes"))
    if pa.types.is_integer(column.type) or pa.types.is_floating(column.type):
        return np.asarray(column.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=np.float64)
    coded = column if pa.types.is_dictionary(column.type) else column.dictionary_encode()
    words = tuple(str(w) for w in coded.dictionary.to_pylist())
    return TextColumn(coded.indices.cast(pa.int64()).fill_null(-1).to_numpy(zero_copy_only=False), words)


def _track(table: Any, own: Track, first: int, count: int, times: TimesModel | None) -> PageTrack:
    have, rows = table.column_names, slice(first, first + count)

    def column(name: str) -> Floats:
        return np.asarray(table[name].combine_chunks().cast(pa.float64()).to_numpy(zero_copy_only=False))[rows]

    place = np.column_stack([column(c) for c in PLACE])
    leap = np.linalg.norm(np.diff(place, axis=0, prepend=place[:1]), axis=1)
    s = column("s_mm")
    # the path must be longer by the distance, else something between the rows is left out
    apart = leap > np.diff(s, prepend=s[:1]) * (1.0 + 1e-6) + 1e-3
    axis = np.column_stack([column(c) for c in AXIS]) if set(AXIS) <= set(have) else np.zeros((0, 3))
    if len(axis) == 0 or np.isnan(axis).all():
        axis = np.broadcast_to(np.array([0.0, 0.0, 1.0]), place.shape)
    if not np.isfinite(place).all():
        raise InputError(f"{HISTORY}: a place is not a number: nothing to show")
    parameters = ", ".join(f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in own.parameters.items())
    title = own.name + (f" ({parameters})" if parameters else "") + (", in use" if own.in_use else "")
    return PageTrack(
        own,
        title,
        first,
        np.maximum.accumulate(np.nan_to_num(column("t_s"))),
        np.maximum.accumulate(np.nan_to_num(s)),
        place,
        np.nan_to_num(axis),
        _whole(table, "line")[rows] if "line" in have else None,
        _whole(table, "tool")[rows] if "tool" in have else None,
        apart & (np.arange(count) > 0),
        None if times is None else Times(times.cut_s, times.air_s, times.rapid_s, times.dwell_s, times.other_s),
    )


def _whole(table: Any, name: str) -> Ints:
    return np.asarray(table[name].combine_chunks().cast(pa.int64()).fill_null(0).to_numpy(zero_copy_only=False))
