"""The numbers of new spindle speeds in summary.json."""

from __future__ import annotations

from typing import Any

from chipload.checking.outcome import SimulationResult, SpeedResult
from chipload.checking.stability import StabilityResult, stability_numbers


def speed_numbers(
    speeds: SpeedResult, stability: StabilityResult, simulation: SimulationResult, time_s: float, program: str
) -> dict[str, Any]:
    """Return ``speeds`` of the operation in summary.json; ``program`` is the file with the new speeds."""
    before = stability_numbers(speeds.stability, speeds.before.columns)
    after = stability_numbers(stability, simulation.removal.columns)
    keys = ("margin_min", "line", "chatter_hz", "mode", "speed_rpm")
    return {
        "program": program,
        "time_before_s": speeds.seconds_before,
        "time_after_s": time_s,
        "tools": [
            {
                "tool": t.tool,
                "first_line": t.lines[0],
                "last_line": t.lines[1],
                "before_rpm": list(t.before),
                "rpm": t.rpm,
                "margin_expected": t.margin,
            }
            for t in speeds.tools
        ],
        "before": {key: before[key] for key in keys},
        "after": {key: after[key] for key in keys},
    }
