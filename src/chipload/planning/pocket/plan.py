"""A pocket cleared by the front, as a program with what it costs.

Notation: R cutter radius, s radial depth, a* = arccos(1 - s/R) the engagement that is held; phi immersion as in
:mod:`chipload.engagement.contact`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.cutting.rigid import OF_DEPTH, OF_FEED
from chipload.cutting.wall_error import Milling
from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.distance import distance
from chipload.geometry.offset import offset_region
from chipload.machine.machine import Machine
from chipload.planning.cost import CutConditions, cost
from chipload.planning.link_rows import row_ends, with_last_link
from chipload.planning.pocket.clearing import CUT, ENTRY, LIFT, STEP, ClearingPath, clear_region, require_clearing
from chipload.planning.pocket.motions import (
    ZONES,
    Heights,
    Motions,
    clock,
    motions_of,
    programs_of,
    replayed,
    samples_of,
    speeds,
)
from chipload.planning.pocket.reach import CHORD
from chipload.planning.result import Columns, Event, OperationResult, StrategyResult
from chipload.program.program import Program
from chipload.progress import Progress, silent

Floats = NDArray[np.float64]

#: engagement above a* that counts as one [deg]
ABOVE_DEG = 0.01
#: share of the reachable area that must be cleared
CLEARED = 0.995
#: height of a link above the floor where none is stated [mm]
LINK_LIFT_MM = 0.1


@dataclass(frozen=True)
class Clearing:
    """What the engineer asks of a pocket; mm, mm/s, rad/s, as in :class:`chipload.planning.contour.plan.Finishing`.

    ``step`` greatest step, taken as 0.06 R where it is less (the engagement is kept along the whole of each step);
    ``allowance`` left on the walls; ``link_feed`` of links through cleared space [mm/s], None: the machine's greatest;
    ``link_lift`` how far links stay off the floor, where they are long enough.
    """

    milling: Milling
    radial_depth: float
    axial_depth: float
    feed: float
    spindle_speed: float
    top: float
    clearance: float
    step: float
    allowance: float = 0.0
    rigid: tuple[float, float] = (OF_FEED, OF_DEPTH)
    link_feed: float | None = None
    link_lift: float = LINK_LIFT_MM

    @property
    def heights(self) -> Heights:
        """The levels of the program."""
        floor = self.top - self.axial_depth
        return Heights(floor, min(floor + self.link_lift, self.top), self.top, self.top + self.clearance)


def plan_pocket(
    contours: Sequence[Contour],
    setting: Clearing,
    cutter: Cutter,
    material: Material,
    machine: Machine,
    limits: Mapping[str, float],
    progress: Progress = silent,
) -> OperationResult:
    """Clear the region inside closed ``contours`` (islands by even-odd) at constant engagement.

    Raises
    ------
    InputError
        A contour is open, the cutter fits nowhere, s is 2 R or more.
    """
    radius = cutter.radius
    region, wanted, step = _asked(contours, setting, radius)
    path = clear_region(
        region,
        radius,
        wanted,
        milling=setting.milling,
        step=step,
        allowance=setting.allowance,
        progress=lambda done, what: progress(0.9 * done, what),
    )
    cut = CutConditions(cutter, material, setting.axial_depth, setting.spindle_speed, setting.milling, *setting.rigid)
    link_feed = machine.feed_max if setting.link_feed is None else setting.link_feed
    motions = motions_of(path, setting.heights, setting.feed, link_feed)
    samples = samples_of(motions, step)
    met, most = replayed(motions, samples, radius)
    length, speed, own = speeds(motions, samples, machine)
    programs = programs_of(motions, setting.feed, setting.axial_depth, setting.spindle_speed, cutter.number)
    program = Program.join(programs)
    ends = row_ends(program, machine)
    time = clock(motions, samples, own, programs, ends)
    kind = motions.kind[samples.motion]
    zone = np.array([ZONES[int(k)] for k in kind], dtype=object)
    zone[:-1][(kind[:-1] == LIFT) & (kind[1:] == ENTRY)] = "entry"
    on_front = kind == CUT
    walls = np.abs(distance(region.segments, samples.centre) - radius - setting.allowance) <= 2.0 * CHORD * radius
    history: Columns = {
        **cost(
            cut,
            zone,
            length,
            time,
            samples.centre,
            samples.heading,
            setting.heights.floor,
            met,
            speed,
            walls & on_front,
        ),
        "z_mm": motions.height[samples.motion],
        "engagement_max_deg": np.degrees(most),
    }
    reach = offset_region(offset_region(region, radius + setting.allowance), -radius)
    result = StrategyResult(
        "pocket",
        program,
        with_last_link(history, setting.heights.safe, float(ends[-1])),
        {**_summary(path, history, on_front, wanted), **_times(history, program, float(ends[-1]))},
        (*path.events, *_failures(path, history, on_front, wanted)),
        np.append(on_front, False),
        {
            "wall": reach.contours,
            "part": region.contours,
            "leftover": path.leftover,
            "front path": _chains(motions),
        },
    )
    progress(1.0, "pocket")
    return OperationResult("pocket", "pocket", {"pocket": result})


def check_pocket(contours: Sequence[Contour], setting: Clearing, cutter: Cutter) -> float:
    """The area of the region [mm^2] if :func:`plan_pocket` can clear it; nothing is planned.

    Raises
    ------
    InputError
        As :func:`plan_pocket`.
    """
    region, wanted, step = _asked(contours, setting, cutter.radius)
    require_clearing(region, cutter.radius, wanted, setting.milling, step, setting.allowance)
    return region.area


def _asked(contours: Sequence[Contour], setting: Clearing, radius: float) -> tuple[Region, float, float]:
    """The region, the engagement that is held [rad] and the step [mm]."""
    if not 0.0 < setting.radial_depth < 2.0 * radius:
        raise InputError(
            f"operation.radial_depth_mm = {setting.radial_depth:g}: must be above 0 and below the cutter's "
            f"diameter_mm = {2.0 * radius:g}"
        )
    region = Region.of(Region(tuple(contours)).contours)
    wanted = math.acos(1.0 - setting.radial_depth / radius)
    return region, wanted, min(max(setting.step, STEP * radius), 0.25 * radius)


def _chains(motions: Motions) -> tuple[Contour, ...]:
    """The runs as contours, for pictures."""
    out = []
    for a, b in motions.runs:
        keep = motions.lengths[a + 1 : b + 1] > 1e-6
        if keep.any():
            seg = motions.segments[a + 1 : b + 1][keep].copy()
            seg[1:, 0:2] = seg[:-1, 2:4]
            out.append(Contour(seg))
    return tuple(out)


def _times(history: Columns, program: Program, whole: float) -> dict[str, object]:
    """Time [s] by what the cutter does, and the number of motions. What is no cut and no entry is a link."""
    took = np.diff(history["t_s"], prepend=0.0)
    cutting = float(took[history["pass"] == "pocket"].sum())
    entry = float(took[history["pass"] == "entry"].sum())
    return {
        "time_s": whole,
        "cutting_s": cutting,
        "entry_s": entry,
        "link_s": whole - cutting - entry,
        "motions": len(program),
    }


def _failures(path: ClearingPath, history: Columns, on_front: NDArray[np.bool_], wanted: float) -> list[Event]:
    """What the clearing must keep by itself: the engagement it was asked for, and the pocket cleared."""
    out = []
    most = np.where(on_front, history["engagement_max_deg"], 0.0)
    k = int(np.argmax(most))
    if most[k] > math.degrees(wanted) + ABOVE_DEG:
        text = f"engagement {most[k]:.4f} deg, wanted at most {math.degrees(wanted):.4f} deg"
        out.append(Event("pocket-engagement", float(history["x_mm"][k]), float(history["y_mm"][k]), text, failure=True))
    if path.cleared_share < CLEARED:
        x, y = path.leftover[0].start if path.leftover else (float(path.x[-1]), float(path.y[-1]))
        text = (
            f"only {path.cleared_share:.2%} of what the cutter can reach is cleared, {path.leftover_mm2:.4g} mm2 left"
        )
        out.append(Event("pocket-uncleared", float(x), float(y), text, failure=True))
    return out


def _summary(path: ClearingPath, history: Columns, on_front: NDArray[np.bool_], wanted: float) -> dict[str, object]:
    a, force = history["engagement_max_deg"][on_front], history["force_xy_n"][on_front]
    error = history["form_error_um"][on_front]
    return {
        "engagement_deg": {
            "min": float(a.min()),
            "max": float(a.max()),
            "p95": float(np.percentile(a, 95.0)),
            "wanted": math.degrees(wanted),
        },
        "force_xy_n": {"min": float(force.min()), "max": float(force.max())},
        "torque_nm": {"min": 0.0, "max": float(history["torque_nm"].max())},
        "form_error_um": {"max": float(error.max())},
        "path_mm": float(sum(v for k, v in path.lengths_mm.items() if k != "lift")),
        "lengths_mm": dict(path.lengths_mm),
        "passes": path.passes,
        "lifts": int((path.kind == LIFT).sum()) - 1,
        "reachable_mm2": path.reachable_mm2,
        "cleared_mm2": path.cleared_mm2,
        "cleared_share": path.cleared_share,
        "cleared_percent": 100.0 * path.cleared_share,
        "leftover_mm2": path.leftover_mm2,
        "events": dict(Counter(e.code for e in path.events)),
    }
