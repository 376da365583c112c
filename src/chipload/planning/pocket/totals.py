"""Totals of a pocket for its summary: time, length and material left, over all stages and for each finish."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.planning.pocket.clearing_path import LIFT
from chipload.planning.pocket.stages import CLEARING, FLOOR, PocketStage
from chipload.planning.result import Columns
from chipload.units import mm_min_from_mm_s

Floats = NDArray[np.float64]


def summary_of(stages: Sequence[PocketStage], history: Columns, motions: int, whole: float) -> dict[str, object]:
    """JSON values of the stages; ``motions`` rows of the program, which takes ``whole`` [s].

    Areas are those of the first section: above the tabs, where there are any.
    """
    on_front = np.isin(history["pass"], [stage.name for stage in stages])
    own = [stage for stage in stages if stage.name != FLOOR]
    lengths: dict[str, float] = {}
    for stage in stages:
        for name, length in stage.path.lengths_mm.items():
            lengths[name] = lengths.get(name, 0.0) + len(stage.heights) * length
    top = [stage.path for stage in own if stage.section == 0]
    cleared, left = sum(path.cleared_mm2 for path in top), top[-1].leftover_mm2
    finish = {stage.name: _finish(stage, history) for stage in stages if stage.name != CLEARING}
    return {
        "engagement_deg": {
            **_span(history["engagement_max_deg"][on_front]),
            "p95": float(np.percentile(history["engagement_max_deg"][on_front], 95.0)),
            "wanted": math.degrees(stages[0].task.engagement),
        },
        "force_xy_n": _span(history["force_xy_n"][on_front]),
        "torque_nm": {"min": 0.0, "max": float(history["torque_nm"].max())},
        "form_error_um": {"max": float(history["form_error_um"][on_front].max())},
        "reachable_mm2": cleared + left,
        "cleared_mm2": cleared,
        "cleared_share": cleared / (cleared + left),
        "cleared_percent": 100.0 * cleared / (cleared + left),
        "leftover_mm2": left,
        "events": dict(Counter(e.code for stage in own for e in stage.path.events)),
        **_times(stages, history, motions, whole),
        "levels": sum(len(stage.heights) for stage in stages),
        "passes": sum(len(stage.heights) * stage.path.passes for stage in stages),
        "lifts": sum(len(stage.heights) * int((stage.path.kind == LIFT).sum()) for stage in stages) - 1,
        "lengths_mm": lengths,
        "path_mm": float(sum(v for k, v in lengths.items() if k != "lift")),
        **({"finish": finish} if finish else {}),
    }


def _finish(stage: PocketStage, history: Columns) -> dict[str, object]:
    """The numbers of one finish: of the floor, of the walls."""
    rows = history["pass"] == stage.name
    return {
        "levels": len(stage.heights),
        "axial_depth_mm": stage.depth,
        "passes": len(stage.heights) * stage.path.passes,
        "cutting_s": float(np.diff(history["t_s"], prepend=0.0)[rows].sum()),
        "feed_mm_min": mm_min_from_mm_s(1.0) * stage.feed,
        "engagement_deg": _span(history["engagement_max_deg"][rows]),
        "force_xy_n": _span(history["force_xy_n"][rows]),
    }


def _span(values: Floats) -> dict[str, float]:
    return {"min": float(values.min()), "max": float(values.max())}


def _times(stages: Sequence[PocketStage], history: Columns, motions: int, whole: float) -> dict[str, object]:
    """Time [s] by kind of motion, and the number of motions. Motions that are neither cut nor entry are links."""
    took = np.diff(history["t_s"], prepend=0.0)
    cutting = float(took[np.isin(history["pass"], [stage.name for stage in stages])].sum())
    entry = float(took[history["pass"] == "entry"].sum())
    return {
        "time_s": whole,
        "cutting_s": cutting,
        "entry_s": entry,
        "link_s": whole - cutting - entry,
        "motions": motions,
    }
