"""A result as the page shows it: its summary, and its history in tracks.

A **track** is the history of one operation by one strategy: n rows, one after another in time. Columns are read from
history.parquet when they are asked for, so that a long history costs only what is looked at.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.web.inside import inside, read_summary

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HISTORY, SCENE, REPORT = "history.parquet", "scene.glb", "report.html"
PLACE, AXIS = ("x_mm", "y_mm", "z_mm"), ("axis_x", "axis_y", "axis_z")
#: columns that say where a row belongs and are not drawn
BELONGS = ("operation", "strategy", "label")
#: columns kept for a result at a time
KEPT = 24


@dataclass(frozen=True, eq=False)
class Text:
    """A column of words: the code of each row, and what the codes mean."""

    codes: Ints
    words: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Track:
    """One operation by one strategy.

    Parameters
    ----------
    title : what it is called
    operation, strategy : of the summary
    rows : (n,) of history.parquet
    t, s : (n,) time [s] and path [mm] at the end of each row, never falling
    timed : whether the history states a time; else t is the row's number
    place : (n, 3) [mm]
    axis : (n, 3) from the tip to the spindle
    line, tool : (n,), of the source and of the machine; None where the history does not say
    apart : (n,) whether the path does not go on from the row before
    """

    title: str
    operation: int
    strategy: str
    rows: Ints
    t: Floats
    s: Floats
    timed: bool
    place: Floats
    axis: Floats
    line: Ints | None
    tool: Ints | None
    apart: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.rows)


@dataclass(eq=False)
class Result:
    """A result folder: only its cache of columns changes.

    Parameters
    ----------
    name, root : of the folder, and the opened folder
    summary : summary.json
    columns : that can be drawn, in their order
    tracks : the one in use of each operation first
    count : rows of history.parquet
    """

    name: str
    root: Path
    summary: dict[str, Any]
    columns: tuple[str, ...]
    tracks: tuple[Track, ...]
    count: int
    _cache: dict[str, Floats | Text] = field(default_factory=dict)

    def file(self, name: str) -> Path:
        """A file of the result.

        Raises
        ------
        InputError
            It is not there, or not in the opened folder.
        """
        return inside(self.root, f"{self.name}/{name}")

    def column(self, track: Track, name: str) -> Floats | Text:
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
        whole = self._cache[name]
        first, last = int(track.rows[0]), int(track.rows[-1])
        some = slice(first, last + 1) if last - first + 1 == len(track.rows) else track.rows
        return Text(whole.codes[some], whole.words) if isinstance(whole, Text) else whole[some]


def load_result(root: Path, name: str) -> Result:
    """Read a result.

    Raises
    ------
    InputError
        It is no result, or its history cannot be read.
    """
    folder = inside(root, name)
    summary = read_summary(folder)
    if not summary:
        raise InputError(f"{name}: is no result of chipload: its summary.json is missing or cannot be read")
    path = inside(root, f"{name}/{HISTORY}")
    try:
        schema = pq.read_schema(path)
    except (OSError, pa.ArrowException):
        raise InputError(f"{name}/{HISTORY}: cannot be read: run the job again") from None
    drawn = tuple(f.name for f in schema if f.name not in BELONGS and _drawable(f.type))
    wanted = [*BELONGS[:2], "t_s", "s_mm", *PLACE, *AXIS, "line", "tool", "pass"]
    table = _table(path, [c for c in wanted if c in schema.names])
    missing = [c for c in PLACE if c not in table.column_names]
    if missing or table.num_rows == 0:
        raise InputError(f"{name}/{HISTORY}: {'no row' if not missing else 'no ' + missing[0]}: nothing to show")
    return Result(name, root, summary, drawn, _tracks(table, summary), table.num_rows)


def released(summary: dict[str, Any], operation: int) -> str | None:
    """The strategy that an operation releases, where it has several."""
    operations = summary.get("operations")
    if isinstance(operations, list) and operation < len(operations) and isinstance(operations[operation], dict):
        use = operations[operation].get("use")
        return use if isinstance(use, str) else None
    return None


# -- parts ------------------------------------------------------------------------------------------------------
def _drawable(kind: Any) -> bool:
    simple = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
    words = pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_dictionary(kind)
    return bool(simple or words)


def _table(path: Path, names: list[str]) -> Any:
    try:
        return pq.read_table(path, columns=names)
    except (OSError, pa.ArrowException) as err:
        raise InputError(f"{path.name}: cannot be read: {err}") from None


def _column(table: Any, name: str) -> Floats | Text:
    column = table[name].combine_chunks()
    if pa.types.is_boolean(column.type):
        return Text(column.cast(pa.int64()).fill_null(0).to_numpy(zero_copy_only=False), ("no", "yes"))
    if pa.types.is_integer(column.type) or pa.types.is_floating(column.type):
        return np.asarray(column.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=np.float64)
    coded = column if pa.types.is_dictionary(column.type) else column.dictionary_encode()
    words = tuple(str(w) for w in coded.dictionary.to_pylist())
    return Text(coded.indices.cast(pa.int64()).fill_null(-1).to_numpy(zero_copy_only=False), words)


def _tracks(table: Any, summary: dict[str, Any]) -> tuple[Track, ...]:
    n = table.num_rows
    have = table.column_names
    operation = _whole(table, "operation") if "operation" in have else np.zeros(n, dtype=np.int64)
    named = _column(table, "strategy") if "strategy" in have else Text(np.zeros(n, dtype=np.int64), ("",))
    strategy = named if isinstance(named, Text) else Text(np.zeros(n, dtype=np.int64), ("",))
    if (strategy.codes < 0).any():
        nameless = np.where(strategy.codes < 0, len(strategy.words), strategy.codes)
        strategy = Text(nameless, (*strategy.words, ""))
    passes = _column(table, "pass") if "pass" in have else Text(np.zeros(n, dtype=np.int64), ("",))
    code = operation * len(strategy.words) + strategy.codes
    out = []
    for one in np.unique(code).tolist():
        rows = np.flatnonzero(code == one)
        op, name = one // len(strategy.words), strategy.words[one % len(strategy.words)]
        out.append(_track(table, rows, int(op), name, passes.codes if isinstance(passes, Text) else rows, summary))
    out.sort(key=lambda x: (x.operation, x.strategy != released(summary, x.operation)))
    return tuple(out)


def _track(table: Any, rows: Ints, op: int, strategy: str, passes: Ints, summary: dict[str, Any]) -> Track:
    have = table.column_names

    def column(name: str) -> Floats:
        return np.asarray(table[name].combine_chunks().cast(pa.float64()).to_numpy(zero_copy_only=False))[rows]

    place = np.column_stack([column(c) for c in PLACE])
    leap = np.linalg.norm(np.diff(place, axis=0, prepend=place[:1]), axis=1)
    if "s_mm" in have:
        s = column("s_mm")
        # what the path is longer by must bridge the distance, else something between the rows is left out
        apart = leap > np.diff(s, prepend=s[:1]) * (1.0 + 1e-6) + 1e-3
    else:
        s = np.cumsum(leap)
        apart = np.zeros(len(rows), dtype=np.bool_)
    t = column("t_s") if "t_s" in have else np.arange(len(rows), dtype=np.float64)
    axis = np.column_stack([column(c) for c in AXIS]) if set(AXIS) <= set(have) else np.zeros((0, 3))
    if len(axis) == 0:
        axis = np.broadcast_to(np.array([0.0, 0.0, 1.0]), place.shape)
    if not np.isfinite(place).all():
        raise InputError(f"{HISTORY}: a place is not a number: nothing to show")
    kind = _kind(summary, op)
    title = f"{op}: {kind}" + (f", {strategy}" if strategy and strategy != kind else "")
    return Track(
        title,
        op,
        strategy,
        rows,
        np.maximum.accumulate(np.nan_to_num(t)),
        np.maximum.accumulate(np.nan_to_num(s)),
        "t_s" in have,
        place,
        np.nan_to_num(axis),
        _whole(table, "line")[rows] if "line" in have else None,
        _whole(table, "tool")[rows] if "tool" in have else None,
        apart & (np.arange(len(rows)) > 0),
    )


def _whole(table: Any, name: str) -> Ints:
    return np.asarray(table[name].combine_chunks().cast(pa.int64()).fill_null(0).to_numpy(zero_copy_only=False))


def _kind(summary: dict[str, Any], op: int) -> str:
    operations = summary.get("operations")
    if isinstance(operations, list) and op < len(operations) and isinstance(operations[op], dict):
        return str(operations[op].get("kind", "operation"))
    return "program"
