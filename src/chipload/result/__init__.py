"""The result contract: verdict, limits, columns, tracks, maps, findings and provenance of every capability."""

from chipload.result.columns import COLUMNS, Column, ErrorSource, column_of, error_of
from chipload.result.coverage import Coverage, CoveredRows
from chipload.result.limits import LimitCheck, check_limit, state_of
from chipload.result.load import load_result, read_summary
from chipload.result.release import release_of
from chipload.result.result import Provenance, Result, SurfaceMap
from chipload.result.summary import SCHEMA_VERSION, Summary
from chipload.result.track import Track, TrackKind, in_memory
from chipload.result.verdict import Verdict

__all__ = [
    "COLUMNS",
    "SCHEMA_VERSION",
    "Column",
    "Coverage",
    "CoveredRows",
    "ErrorSource",
    "LimitCheck",
    "Provenance",
    "Result",
    "Summary",
    "SurfaceMap",
    "Track",
    "TrackKind",
    "Verdict",
    "check_limit",
    "column_of",
    "error_of",
    "in_memory",
    "load_result",
    "read_summary",
    "release_of",
    "state_of",
]
