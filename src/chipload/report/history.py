"""history.parquet: a row a step, all operations and strategies one after another."""

from __future__ import annotations

import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from chipload.report.outcome import Outcome

#: columns that come first
FIRST = ("operation", "strategy", "pass")


def history_table(outcome: Outcome) -> pa.Table:
    """All histories stacked; a column that a strategy lacks is null there."""
    tables = []
    for k, op in enumerate(outcome.operations):
        for name, strategy in op.result.strategies.items():
            columns = dict(strategy.history)
            n = len(columns["pass"])
            data = {
                "operation": pa.array(np.full(n, k, dtype=np.int32)),
                "strategy": _names(np.full(n, name, dtype=object)),
                "pass": _names(columns.pop("pass")),
            }
            data |= {key: pa.array(np.ascontiguousarray(values)) for key, values in columns.items()}
            tables.append(pa.table(data))
    return pa.concat_tables(tables, promote_options="default").combine_chunks()


def history_bytes(outcome: Outcome) -> bytes:
    """history.parquet."""
    sink = io.BytesIO()
    pq.write_table(history_table(outcome), sink, compression="zstd")
    return sink.getvalue()


def _names(values: object) -> pa.Array:
    return pa.array(np.asarray(values).astype(str).tolist(), type=pa.string())
