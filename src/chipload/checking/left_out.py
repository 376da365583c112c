"""What a result rests on where blocks of its text are not read: behind them nothing exceeds for sure."""

from __future__ import annotations

from dataclasses import replace

from chipload.errors import Finding, Severity
from chipload.program.left_out import first_left_out
from chipload.result import LimitCheck, Track, Verdict

#: findings on words of the text alone, whatever else of it is not read
OF_TEXT = ("machine-spindle", "machine-feed", "tap-pitch", "thread-pitch", "tap-cutter")


def rest_on_left_out(track: Track, findings: tuple[Finding, ...]) -> Track:
    """Return a track in which what exceeds behind the first block that is left out is unproven.

    Parameters
    ----------
    findings : of the reader
    """
    first = first_left_out(findings)
    if first is None:
        return track
    where = f"what is left out from line {first.line} on" if first.line else f"a guess of the reader ({first.code})"
    return replace(
        track,
        limits=tuple(_of_limit(check, first.line, where) for check in track.limits),
        findings=tuple(_of_finding(f, first.line, where) for f in track.findings),
    )


def _of_limit(check: LimitCheck, line: int, where: str) -> LimitCheck:
    if check.state is not Verdict.EXCEEDS or 0 < check.line < line:
        return check
    return replace(check, state=Verdict.UNPROVEN, reason=f"it exceeds the limit, but rests on {where}")


def _of_finding(f: Finding, line: int, where: str) -> Finding:
    if f.severity is not Severity.EXCEEDS or 0 < f.line < line or (line and f.code in OF_TEXT):
        return f
    return replace(f, severity=Severity.UNPROVEN, text=f"{f.text}; this rests on {where}")
