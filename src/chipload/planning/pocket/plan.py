"""A pocket cleared by the front, as a program with what it costs.

Notation: R cutter radius, s radial depth, a* = arccos(1 - s/R) the engagement that is held; phi immersion as in
:mod:`chipload.engagement.contact`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.cutting.material import Material
from chipload.geometry.contour import Contour, Region
from chipload.geometry.distance import distance
from chipload.geometry.offset import offset_region
from chipload.machine.machine import Machine
from chipload.planning.cost import CutConditions, cost
from chipload.planning.link_rows import row_ends, with_last_link
from chipload.planning.pocket.clearing import CUT, ENTRY, LIFT, ClearingPath, clear_region, require_clearing
from chipload.planning.pocket.motions import (
    ZONES,
    Motions,
    bore_pitch,
    clock,
    motions_of,
    programs_of,
    replayed,
    samples_of,
    speeds,
)
from chipload.planning.pocket.reach import CHORD
from chipload.planning.pocket.request import Asked, Clearing, laid_out, material_before
from chipload.planning.result import Columns, Event, OperationResult, StrategyResult
from chipload.program.program import Program
from chipload.progress import Progress, silent

Floats = NDArray[np.float64]

#: engagement above a* that counts as one [deg]
ABOVE_DEG = 0.01
#: places along a wall [mm] that are held against free space, and how near to its edge they are made already
WALL_STEP_MM, EDGE_MM = 0.05, 1e-3
#: share of the reachable area that must be cleared
CLEARED = 0.995


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
    asked = laid_out(contours, setting, radius)
    wanted = asked.engagement
    path = clear_region(
        asked.region,
        radius,
        wanted,
        milling=setting.milling,
        step=asked.step,
        allowance=setting.allowance,
        free=asked.free,
        progress=lambda done, what: progress(0.9 * done, what),
    )
    history, program, whole, motions = _history(path, asked, setting, cutter, material, machine)
    on_front = np.isin(history["pass"], ["pocket"])
    levels = len(setting.depths)
    reach = offset_region(offset_region(asked.region, radius + setting.allowance), -radius)
    summary = {
        **_summary(path, history, on_front, wanted),
        **_times(history, program, whole),
        "levels": levels,
        "passes": levels * path.passes,
        "lifts": levels * int((path.kind == LIFT).sum()) - 1,
        "lengths_mm": {name: levels * length for name, length in path.lengths_mm.items()},
        "path_mm": levels * float(sum(v for k, v in path.lengths_mm.items() if k != "lift")),
    }
    result = StrategyResult(
        "pocket",
        program,
        with_last_link(history, setting.heights.safe, whole),
        summary,
        (*path.events, *_failures(path, history, on_front, wanted, _in_stock(reach, setting))),
        np.append(on_front, False),
        {
            "wall": _walls(reach, setting, asked),
            "part": asked.region.contours,
            "leftover": path.leftover,
            "front path": _chains(motions),
            "stock before": material_before(asked, setting, radius),
        },
    )
    progress(1.0, "pocket")
    return OperationResult("pocket", "pocket", {"pocket": result})


def _history(
    path: ClearingPath, asked: Asked, setting: Clearing, cutter: Cutter, material: Material, machine: Machine
) -> tuple[Columns, Program, float, Motions]:
    """Rows of all depths, the program, its time [s], and the motions of the first depth."""
    radius, spindle = cutter.radius, setting.spindle_speed
    link_feed = machine.feed_max if setting.link_feed is None else setting.link_feed
    each = [motions_of(path, heights, setting.feed, link_feed) for heights in setting.levels]
    motions = each[0]
    samples = samples_of(motions, asked.step)
    met, most = replayed(motions, samples, radius, asked.free)
    length, speed, own = speeds(motions, samples, machine)
    programs = [programs_of(m, setting.feed, setting.depths[0], spindle, cutter.number) for m in each]
    program = Program.join([p for level in programs for p in level])
    ends = row_ends(program, machine)
    kind = motions.kind[samples.motion]
    zone = np.array([ZONES[int(k)] for k in kind], dtype=object)
    zone[:-1][(kind[:-1] == LIFT) & (kind[1:] == ENTRY)] = "entry"
    off = distance(asked.region.segments, samples.centre) - radius - setting.allowance
    makes_wall = (np.abs(off) <= 2.0 * CHORD * radius) & (kind == CUT)
    place = (zone, length, own, samples.centre, samples.heading, 0.0, met, speed, makes_wall)
    cut = CutConditions(cutter, material, setting.depths[0], spindle, setting.milling, *setting.rigid)
    columns: Columns = {**cost(cut, *place), "engagement_max_deg": np.degrees(most)}
    if (kind == ENTRY).any():  # a turn of a bore is as deep as its pitch
        thin = cost(replace(cut, axial_depth=bore_pitch(motions, setting.depths[0])), *place)
        columns = {k: np.where(kind == ENTRY, thin.get(k, v), v) for k, v in columns.items()}
    rows, first = [], 0
    for level, m, parts in zip(range(len(each)), each, programs, strict=True):
        count = sum(len(p) for p in parts)
        time = clock(m, samples, own, parts, ends[first : first + count])
        rows.append(
            {**columns, "z_mm": m.height[samples.motion], "t_s": time, "s_mm": columns["s_mm"] + level * length[-1]}
        )
        first += count
    history = {name: np.concatenate([r[name] for r in rows]) for name in rows[0]}
    return history, program, float(ends[-1]), motions


def _walls(reach: Region, setting: Clearing, asked: Asked) -> tuple[Contour, ...]:
    """The contours, or parts of them, that the cutter makes a wall of: inside the stock, and not where the edge of free
    space was made before.
    """
    if not asked.free:
        return reach.contours
    stock = Region.of(Region(setting.stock).contours) if setting.stock else None
    edges = np.vstack([region.segments for region in asked.free])
    out: list[Contour] = []
    for contour in reach.contours:
        s = np.linspace(0.0, contour.length, max(16, math.ceil(contour.length / WALL_STEP_MM)) + 1)
        points = contour.at(s)[0]
        made = distance(edges, points) > EDGE_MM
        for region in asked.free:
            made &= ~region.contains(points)
        if stock is not None:
            made &= stock.contains(points)
        if made.all():
            out.append(contour)
            continue
        cut = np.flatnonzero(np.diff(made.astype(np.int64))) + 1
        runs = [run for run in np.split(np.arange(len(s)), cut) if made[run[0]] and len(run) > 1]
        out += [contour.part(float(s[run[0]]), float(s[run[-1]])) for run in runs]
    return tuple(out)


def _in_stock(reach: Region, setting: Clearing) -> float:
    """Area [mm^2] that can be reached within the outline of the stock."""
    whole = reach.flatten(1e-3)
    if setting.stock:
        whole = shapely.intersection(whole, Region.of(Region(setting.stock).contours).flatten(1e-3))
    return float(whole.area)


def check_pocket(contours: Sequence[Contour], setting: Clearing, cutter: Cutter) -> float:
    """The area of the region [mm^2] if :func:`plan_pocket` can clear it; nothing is planned.

    Raises
    ------
    InputError
        As :func:`plan_pocket`.
    """
    asked = laid_out(contours, setting, cutter.radius)
    require_clearing(asked.region, cutter.radius, asked.engagement, setting.milling, asked.step, setting.allowance)
    return asked.region.area


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


def _failures(
    path: ClearingPath, history: Columns, on_front: NDArray[np.bool_], wanted: float, within: float
) -> list[Event]:
    """What the clearing must keep by itself: the engagement it was asked for, and the pocket cleared, in parts of the
    area ``within`` [mm^2] that a cutter can reach, whether an earlier one did or not.
    """
    out = []
    most = np.where(on_front, history["engagement_max_deg"], 0.0)
    k = int(np.argmax(most))
    if most[k] > math.degrees(wanted) + ABOVE_DEG:
        text = f"engagement {most[k]:.4f} deg, wanted at most {math.degrees(wanted):.4f} deg"
        out.append(Event("pocket-engagement", float(history["x_mm"][k]), float(history["y_mm"][k]), text, failure=True))
    if path.leftover_mm2 > (1.0 - CLEARED) * within:
        x, y = path.leftover[0].start if path.leftover else (float(path.x[-1]), float(path.y[-1]))
        text = (
            f"only {1.0 - path.leftover_mm2 / within:.2%} of what the cutter can reach is cleared, "
            f"{path.leftover_mm2:.4g} mm2 left"
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
        "reachable_mm2": path.reachable_mm2,
        "cleared_mm2": path.cleared_mm2,
        "cleared_share": path.cleared_share,
        "cleared_percent": 100.0 * path.cleared_share,
        "leftover_mm2": path.leftover_mm2,
        "events": dict(Counter(e.code for e in path.events)),
    }
