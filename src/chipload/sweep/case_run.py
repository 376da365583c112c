"""The run of one case of a sweep, which a worker executes: run its job, store its summary and history."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from chipload.errors import InputError, InputErrors
from chipload.files import read_regular, write_whole
from chipload.jobs import load_job, run_job
from chipload.progress import Progress, silent
from chipload.report.folder import write_files
from chipload.result import Result
from chipload.result.history import write_history
from chipload.result.provenance import sources
from chipload.result.summary import summary_bytes

#: version of the records
RECORD_VERSION = 1
#: [bytes]
LARGEST_RECORD = 10_000_000
#: states of a case besides the verdicts
REFUSED = "refused"

Record = dict[str, Any]


def case_record(
    job: str, overrides: tuple[str, ...], folder: str, key: str, progress: Progress = silent
) -> Record:  # fmt: skip
    """Run a job with overrides, write ``folder`` (summary and history) and ``folder.json``, and return its record.

    A job that is refused has a record too, with the reason. The record is written last: where it stands, the case is
    finished.

    Parameters
    ----------
    job : path of the job file
    key : of :func:`case_key`; kept in the record
    """
    record: Record = {"version": RECORD_VERSION, "key": key, "overrides": list(overrides)}
    try:
        done = run_job(load_job(job, overrides), progress)
    except InputError as err:
        text = "; ".join(map(str, err.args)) if isinstance(err, InputErrors) else str(err)
        record |= {"state": REFUSED, "message": text, "time_s": None, "use_of_limits": None, "limits": {}}
    else:
        record |= _numbers(done.result)
        rows: dict[str, int] = {}

        def history(file: Any) -> None:
            rows.update(write_history(done.result, file))

        write_files(
            [("history.parquet", lambda: history), ("summary.json", lambda: summary_bytes(done.result, rows))], folder
        )
    write_whole(f"{folder}.json", (json.dumps(record, indent=2, allow_nan=False) + "\n").encode())
    return record


def case_key(job: bytes, inputs: Mapping[str, str], overrides: tuple[str, ...]) -> str:
    """Return a hash of all inputs of a case: text of the job, hashes of its files, overrides and chipload itself."""
    values = [RECORD_VERSION, sources(), sha256(job).hexdigest(), dict(inputs), list(overrides)]
    return sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


def kept_record(folder: Path, key: str) -> Record | None:
    """Return the record of a case that an earlier sweep finished with the same key; None if there is none."""
    try:
        record = json.loads(read_regular(f"{folder}.json", "case", LARGEST_RECORD))
    except (InputError, ValueError):
        return None
    same = isinstance(record, dict) and record.get("key") == key
    return record if same and (record["state"] == REFUSED or (folder / "summary.json").is_file()) else None


def _numbers(result: Result) -> Record:
    """Return verdict, time and limits of a result."""
    times = [track.time_s for track in result.in_use if track.time_s is not None]
    limits = {
        check.name: {"limit": check.limit, "worst": check.worst, "state": check.state.value} for check in result.limits
    }
    shares = [c.worst / c.limit for c in result.limits if c.worst is not None and c.limit > 0.0]
    return {
        "state": result.verdict.value,
        "message": result.message,
        "time_s": sum(times) if times else None,
        "use_of_limits": max(shares) if shares else None,
        "limits": limits,
    }
