"""Places that the 3D view marks: limits that are exceeded, collisions, else the limit with the least margin."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chipload.errors import Finding
from chipload.number_text import number_text
from chipload.report.view import ViewMark
from chipload.result import LimitCheck, Result, Track, Verdict
from chipload.result.first_lines import critical_check

#: collisions that are marked at most
MARKED = 200
#: code of the finding of a collision
COLLISION = "collision"
#: kind of the mark of the limit with the least margin
CRITICAL = "critical"


def marks_of(
    result: Result, track: Track, row: Callable[[LimitCheck | Finding], int | None], place: NDArray[np.float64]
) -> tuple[ViewMark, ...]:
    """The marks of a track: collisions, the deepest first, then limits, the worst first; where there is none, the place
    of the limit with the least margin that has one.

    Parameters
    ----------
    row : of a check or a finding in the history; None: it has none
    place : (n, 3) [mm] of each row
    """
    out = []
    worst = [c for c in track.limits if c.state is Verdict.EXCEEDS and c.worst is not None]
    for c in sorted(worst, key=lambda c: -_share(c)):
        k = row(c)
        if k is not None:
            limit = number_text(c.limit, 6)
            text = f"{c.column.label} {c.worst_text} {c.column.unit}, limit {limit}"
            out.append(ViewMark(k, _place_of(place[k]), text, "limit"))
    touched = []
    for f in track.findings:
        k = row(f) if f.code == COLLISION else None
        if k is not None:
            touched.append(_collision(result, track, f, k, place))
    touched.sort(key=lambda m: -m.depth_mm)
    if not touched and not out:
        critical = critical_check(check for check in track.limits if row(check) is not None)
        k = None if critical is None else row(critical)
        if critical is not None and k is not None:
            out.append(ViewMark(k, _place_of(place[k]), _critical_text(critical), CRITICAL))
    return (*touched[:MARKED], *out)


def _collision(result: Result, track: Track, f: Finding, k: int, place: NDArray[np.float64]) -> ViewMark:
    """The mark of a collision: which bodies touch, and how deep, is in the numbers of the operation."""
    at = f.place if f.place is not None else _place_of(place[k])
    operation = result.operations[track.operation] if track.operation < len(result.operations) else {}
    text = f"line {f.line}: {f.text}" if f.line else f.text
    for one in operation.get("collisions") or ():
        if one.get("line") == f.line and np.allclose(one.get("place"), at, atol=1e-6):
            return ViewMark(k, at, text, COLLISION, (str(one["what"]), str(one["into"])), float(one["depth_mm"]))
    return ViewMark(k, at, text, COLLISION)


def _critical_text(check: LimitCheck) -> str:
    """The critical limit in a few words."""
    return ", ".join(filter(None, (check.value_text, f"line {check.line}" if check.line else "")))


def _share(c: LimitCheck) -> float:
    """Return the relative amount by which a value exceeds its limit."""
    value = abs(c.worst or 0.0)
    if c.column.least:
        return c.limit / value if value > 0.0 else np.inf
    return value / c.limit if c.limit > 0.0 else np.inf


def _place_of(p: NDArray[np.float64]) -> tuple[float, float, float]:
    return float(p[0]), float(p[1]), float(p[2])
