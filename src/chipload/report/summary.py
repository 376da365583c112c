"""summary.json: the verdict first, then every operation and strategy in numbers; equal runs give equal bytes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from chipload.report.outcome import Operation, Outcome, failures, released, verdict


def summary(outcome: Outcome) -> dict[str, Any]:
    """The content of summary.json as plain values."""
    holds, says = verdict(outcome)
    return {
        "holds": holds,
        "says": says,
        "job": outcome.title,
        "operations": [_operation(k, op) for k, op in enumerate(outcome.operations)],
        "unchecked": list(outcome.unchecked),
        "findings": list(outcome.findings),
        "provenance": dict(outcome.provenance),
    }


def summary_bytes(outcome: Outcome) -> bytes:
    """summary.json; a number that is not finite is a fault of ours and raises ValueError."""
    text = json.dumps(_plain(summary(outcome)), indent=2, ensure_ascii=False, allow_nan=False)
    return (text + "\n").encode()


def program_name(index: int, strategy: str) -> str:
    """File name of a program without its ending."""
    return f"{index}-{strategy}"


def _operation(index: int, op: Operation) -> dict[str, Any]:
    return {
        "kind": op.result.kind,
        "use": op.result.use,
        "holds": not failures(op, op.result.use),
        "strategies": {name: _strategy(index, op, name) for name in op.result.strategies},
        "findings": list(op.result.findings),
        "settings": dict(op.settings),
    }


def _strategy(index: int, op: Operation, name: str) -> dict[str, Any]:
    result, proof = op.result.strategies[name], op.proofs.get(name)
    return {
        **result.summary,
        "holds": not failures(op, name),
        "released": released(op, name),
        "fails": [str(f) for f in failures(op, name)],
        "limits": [
            {"name": c.name, "limit": c.limit, "worst": c.worst, "at_mm": list(c.at), "holds": c.holds}
            for c in result.limits
        ],
        "events": [
            {"code": e.code, "x_mm": e.x, "y_mm": e.y, "text": e.text, "failure": e.failure} for e in result.events
        ],
        "verification": None if proof is None else {"status": proof.status, "says": proof.says, **proof.numbers},
        "program": program_name(index, name),
    }


def _plain(value: Any) -> Any:
    """NumPy scalars, arrays and tuples as what JSON knows."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return [_plain(v) for v in value.tolist()]
    return value.item() if isinstance(value, np.generic) else value
