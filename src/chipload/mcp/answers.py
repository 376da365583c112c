"""Results, limits and listings as the values that a client receives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from chipload.errors import Finding, InputError
from chipload.jobs.shipped import Listing
from chipload.result.columns import COLUMNS, column_of
from chipload.result.limits import LimitCheck
from chipload.result.result import Result
from chipload.tables import nearest

#: most findings of an answer; the report has all
FINDINGS = 50


def result_answer(result: Result, folder: Path) -> dict[str, Any]:
    """Return the verdict of a result, its reason, limits, findings and files."""
    findings = [*result.findings, *(f for track in result.in_use for f in track.findings)]
    return {
        "verdict": result.verdict.value,
        "reason": result.message,
        "unchecked": list(result.unchecked),
        "limits": [limit_answer(check) for check in result.limits],
        "findings": [finding_answer(f) for f in findings[:FINDINGS]],
        "findings_left_out": max(len(findings) - FINDINGS, 0),
        "tracks": [
            {"name": t.name, "verdict": t.verdict.value, "time_s": t.time_s, "programs": list(t.programs)}
            for t in result.in_use
        ],
        "result": str(folder),
        "report": str(folder / "report.html"),
    }


def limit_answer(check: LimitCheck) -> dict[str, Any]:
    """Return a limit, its worst value and where it is."""
    return {
        "name": check.name, "label": check.column.label, "unit": check.column.unit, "limit": check.limit,
        "worst": check.worst, "state": check.state.value, "margin": check.margin_text, "track": check.track,
        "line": check.line, "place_mm": None if check.place is None else list(check.place), "t_s": check.t_s,
        "relative_error": check.error, "at_confidence": check.confidence_text, "reason": check.reason,
    }  # fmt: skip


def finding_answer(finding: Finding) -> dict[str, Any]:
    """Return a finding with its line and place."""
    return {
        "code": finding.code, "line": finding.line, "text": finding.text, "severity": finding.severity.name.lower(),
        "place_mm": None if finding.place is None else [float(x) for x in finding.place],
    }  # fmt: skip


def limit_explanation(name: str, result: Result | None) -> dict[str, Any]:
    """Return what a limit means, and what a result says of it.

    Raises
    ------
    InputError
        No limit has this name, or the result does not check it.
    """
    try:
        column = column_of(name)
    except InputError:
        raise InputError(f"limit {name}: not known; did you mean {nearest(name, list(COLUMNS))}?") from None
    bounds = "the least value that is allowed" if column.least else "the greatest value that is allowed"
    out: dict[str, Any] = {
        "name": name, "label": column.label, "unit": column.unit, "meaning": column.meaning, "bounds": bounds,
        "error": column.error.text,
    }  # fmt: skip
    if result is not None:
        checks = [limit_answer(check) for check in result.limits if check.name == name]
        if not checks:
            known = ", ".join(sorted({check.name for check in result.limits})) or "none"
            raise InputError(f"limit {name}: is not checked in this result, which checks {known}")
        out |= {"verdict": result.verdict.value, "reason": result.message, "checks": checks}
    return out


def listing_answer(listing: Listing) -> list[dict[str, str]]:
    """Return a listing, each row by the heads of its columns."""
    return [dict(zip(listing.head, row, strict=True)) for row in listing.rows]
