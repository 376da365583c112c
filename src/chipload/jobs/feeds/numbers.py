"""The numbers of new feeds in summary.json."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.checking.outcome import SimulationResult
from chipload.jobs.feeds.outcome import FeedResult
from chipload.result import LimitCheck

#: columns of loads that are compared before and after new feeds
COMPARED = (
    "force_n", "force_axial_n", "torque_nm", "power_w", "chip_max_mm", "deflection_um", "deflection_workpiece_um",
    "cutter_stress_mpa",
)  # fmt: skip
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: places on the paths before and after agree within this [mm]: points at which lines are divided are rounded
SAME_MM = 0.01
#: lines that summary.json lists
MOST_LINES = 2000


def steps_before(after: Floats, before: Floats) -> Ints:
    """Return the step (n,) of the program as it was at the end of each step of the new one, by the path [mm].

    >>> steps_before(np.array([1.0, 1.5, 2.0, 4.0]), np.array([1.0, 2.0, 4.0])).tolist()
    [0, 1, 1, 2]
    """
    if len(after) == len(before):
        return np.arange(len(after))
    return np.searchsorted(before, after - SAME_MM).clip(0, len(before) - 1)


def lines_that_exceed(
    feeds: FeedResult, simulation: SimulationResult, checks: Sequence[LimitCheck]
) -> list[dict[str, Any]]:
    """Return the lines of the new program that exceed a load limit, each with its worst step."""
    c, before, out = simulation.removal.columns, feeds.before.columns, []
    factor = dict(zip(feeds.line.tolist(), zip(feeds.factor.tolist(), feeds.by, strict=True), strict=True))
    was = steps_before(np.asarray(c["s_mm"]), np.asarray(before["s_mm"]))
    place = np.column_stack([c[f"{x}_mm"] for x in "xyz"])
    for check in checks:
        column = check.column.name
        if column not in before or column in ("axial_overrun_mm", "deflection_share"):
            continue
        # what leaves a limit unproven by its resolution alone does not exceed it
        more = check.factor / (1.0 + check.error)
        values = more * np.abs(np.asarray(c[column], dtype=np.float64))
        allowed = simulation.checks.allowed_stress(c["tool"]) if column == "cutter_stress_mpa" else check.limit
        over = np.flatnonzero(values > allowed)
        order = over[np.argsort(-values[over], kind="stable")]
        lines, first = np.unique(c["line"][order], return_index=True)
        for line, k in zip(lines.tolist(), order[first].tolist(), strict=True):
            times, by = factor.get(line, (1.0, "programmed"))
            out.append(
                {
                    "line": line,
                    "limit": check.name,
                    "allowed": check.limit,
                    "worst": float(values[k]),
                    "before": float(before[column][was[k]]),
                    "feed_mm_min": float(c["feed_mm_min"][k]),
                    "factor": times,
                    "slowest": by == "slowest",
                    "place": place[k].tolist(),
                    "t_s": float(c["t_s"][k]),
                }
            )
    return sorted(out, key=lambda x: (x["line"], x["limit"]))


def feed_numbers(
    feeds: FeedResult, simulation: SimulationResult, checks: Sequence[LimitCheck], time_s: float, program: str
) -> dict[str, Any]:
    """Return the key ``feeds`` of the operation in summary.json.

    Parameters
    ----------
    checks : limits of the program with its new feeds
    time_s : time of that program
    program : its file
    """
    c, listed = simulation.removal.columns, lines_that_exceed(feeds, simulation, checks)

    def loads(columns: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        some = columns["feed_mm_min"][(columns["chip_areas"] > 0) & ~columns["rapid"]]
        span = {"min": float(some.min()), "max": float(some.max())} if len(some) else None
        return {k: float(columns[k].max(initial=0.0)) for k in COMPARED if k in columns} | {"feed_mm_min": span}

    return {
        "program": program,
        "time_before_s": feeds.seconds_before,
        "time_after_s": time_s,
        "before": loads(feeds.before.columns),
        "after": loads(c),
        "lines": len(feeds.line),
        "lines_changed": int((feeds.factor != 1.0).sum()),
        "lines_slower": int((feeds.factor < 1.0).sum()),
        "lines_faster": int((feeds.factor > 1.0).sum()),
        "by": dict(sorted(Counter(feeds.by).items())),
        "still_exceeding": listed[:MOST_LINES],
        "still_exceeding_count": len(listed),
        "rubbing": [{"line": line, "tooth_feed_mm": feed} for line, feed in feeds.rubs[:MOST_LINES]],
        "rubbing_count": len(feeds.rubs),
        "lines_divided": len(feeds.segments),
        "segments": sum(len(lines) for lines in feeds.segments.values()),
        "not_divided": dict(sorted(feeds.not_divided.items())),
    }
