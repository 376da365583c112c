"""Writing of history.parquet (the histories of all tracks) and of the arrays of maps.npz.

A row is a step of a program. The first columns are ``operation`` and ``track``; a column that a track lacks is null
there. Every field has its unit, label and meaning as metadata. Blocks are written one after another, so that memory
does not grow with the program.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import IO, Any

import numpy as np

from chipload.arrow import arrow_array
from chipload.lazy import pa, pq
from chipload.result.columns import COLUMNS
from chipload.result.limits import Columns
from chipload.result.result import Result
from chipload.result.track import Track


def write_history(result: Result, file: IO[bytes] | io.RawIOBase) -> dict[str, int]:
    """Write history.parquet and return the number of rows of each track.

    Raises
    ------
    ValueError
        A column has no entry in :data:`chipload.result.columns.COLUMNS`, a track's time falls or is not finite, or a
        later block has a column that the first has not.
    """
    schema = _schema(result)
    rows = {}
    with pq.ParquetWriter(file, schema, compression="zstd") as writer:
        for track in result.tracks:
            rows[track.name], last = 0, -np.inf
            for block in track.blocks():
                t = np.asarray(block["t_s"]) if "t_s" in block else np.zeros(0)
                if not np.isfinite(t).all():
                    raise ValueError(f"track {track.name}: a time is not finite")
                if len(t) and (t[0] < last or (np.diff(t) < 0.0).any()):
                    raise ValueError(f"track {track.name}: its time falls")
                last = float(t[-1]) if len(t) else last
                table = _table(track, block, schema)
                writer.write_table(table)
                rows[track.name] += table.num_rows
    return rows


def maps_bytes(result: Result) -> bytes:
    """Return maps.npz: ``points``, ``values``, ``faces`` and ``displacement`` (if any) of each map, by its number."""
    sink = io.BytesIO()
    names = ("points", "values", "faces", "displacement")
    arrays = {
        f"{k}-{name}": values
        for k, one in enumerate(result.maps)
        for name in names
        if (values := getattr(one, name)) is not None
    }
    np.savez_compressed(sink, **arrays)
    return sink.getvalue()


def _schema(result: Result) -> pa.Schema:
    fields: dict[str, pa.Field] = {
        "operation": _field("operation", pa.int32()),
        "track": _field("track", pa.dictionary(pa.int32(), pa.string())),
    }
    for track in result.tracks:
        first = next(iter(track.blocks()), None)
        for name, values in (first or {}).items():
            kind = arrow_array(np.asarray(values)[:1]).type
            if name not in fields:
                fields[name] = _field(name, kind)
            elif fields[name].type != kind:
                fields[name] = _field(name, pa.float64())
    return pa.schema(list(fields.values()))


def _field(name: str, kind: Any) -> pa.Field:
    if name not in COLUMNS:
        raise ValueError(f"column {name}: not in the table of columns: add it to result/columns.py")
    c = COLUMNS[name]
    return pa.field(name, kind, metadata={"unit": c.unit, "label": c.label, "meaning": c.meaning})


def _table(track: Track, block: Columns, schema: pa.Schema) -> pa.Table:
    n = len(next(iter(block.values())))
    extra = sorted(set(block) - set(schema.names))
    if extra:
        raise ValueError(f"track {track.name}: columns {extra} are not in its first block")
    given: Mapping[str, Any] = {
        "operation": np.full(n, track.operation, dtype=np.int32),
        "track": np.full(n, track.name, dtype=object),
        **block,
    }
    arrays = [
        arrow_array(np.asarray(given[f.name])).cast(f.type) if f.name in given else pa.nulls(n, f.type) for f in schema
    ]
    return pa.Table.from_arrays(arrays, schema=schema)
