"""Tooth engagement of some steps of planned passes, from the engaged arcs of the planner."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from chipload.engagement.tooth_engagement import engagement_of_arcs
from chipload.jobs.contour.outcome import ContourResult, Operation
from chipload.jobs.contour.result import takes_time, track_name
from chipload.planning.result import StrategyResult
from chipload.simulation.engagement_samples import STEPS, EngagementSamples, engagement_samples
from chipload.units import mm_s_from_mm_min, rad_s_from_rpm

#: columns of the planner that are needed
NEEDED = ("arcs", "arc_from_rad", "arc_to_rad", "heading_x", "heading_y", "engagement_deg", "feed_mm_min")
#: passes whose depth or speed is not that of the operation: the entry, and the finish passes of a pocket
OTHER_DEPTH = ("entry", "floor", "wall")


def samples_of(outcome: ContourResult) -> dict[str, EngagementSamples]:
    """Samples of each strategy by the name of its track; steps with several engaged arcs are left out."""
    out = {}
    for k, op in enumerate(outcome.operations):
        for name, strategy in op.result.strategies.items():
            found = _samples(op, strategy)
            if found is not None:
                out[track_name(outcome, k, name)] = found
    return out


def _samples(op: Operation, strategy: StrategyResult) -> EngagementSamples | None:
    """The samples of a strategy; None: nothing is cut, or the planner kept no arcs."""
    rows = strategy.history
    if op.checks is None or not set(NEEDED) <= set(rows):
        return None
    depth = _depth(op.settings)
    if depth is None:
        return None
    t = np.asarray(rows["t_s"], dtype=np.float64)
    kept = takes_time({"duration_s": np.diff(t, prepend=0.0)})
    column = {name: np.asarray(rows[name])[kept] for name in (*NEEDED, "pass")}
    cuts = (column["arcs"] == 1) & (column["engagement_deg"] > 0.0) & ~np.isin(column["pass"], OTHER_DEPTH)
    cuts &= column["feed_mm_min"] > 0.0
    stride = 1
    while np.count_nonzero(cuts[::stride]) > STEPS:
        stride *= 2
    k = np.flatnonzero(cuts)
    k = k[k % stride == 0]
    if not len(k):
        return None
    speed = rad_s_from_rpm(float(op.settings["speed_rpm"]))
    tooth = 2.0 * np.pi * mm_s_from_mm_min(1.0) * column["feed_mm_min"][k] / (op.cutter.flutes * speed)
    x, y = column["heading_x"][k], column["heading_y"][k]
    zero, one = np.zeros(len(k)), np.ones(len(k))
    frame = np.stack([np.stack(v, axis=1) for v in ((x, y, zero), (-y, x, zero), (zero, zero, one))], axis=1)
    found = engagement_of_arcs(column["arc_from_rad"][k], column["arc_to_rad"][k], tooth, op.cutter, depth)
    return engagement_samples(replace(found, frame=frame), op.cutter, op.checks.material, k, op.cutter.number, stride)


def _depth(settings: Mapping[str, Any]) -> float | None:
    """Depth of cut of a pass, or of a level of a pocket, [mm]; None where tabs make levels of different depth."""
    greatest = float(settings["axial_depth_mm"])
    if settings["kind"] != "pocket":
        return greatest
    if settings.get("tabs") is not None:
        return None
    whole = float(settings.get("depth_mm", greatest)) - float(settings.get("floor_allowance_mm", 0.0))
    return whole / max(1, math.ceil(whole / greatest - 1e-9))
