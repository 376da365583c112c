"""Plan of a cleared pocket: its program, its columns and its totals.

Notation: R cutter radius, s radial depth, a* = arccos(1 - s/R) the constant engagement; phi immersion as in
:mod:`chipload.engagement.contact`.
"""

from __future__ import annotations

import math
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
from chipload.number_text import number_text
from chipload.planning.cost import CutConditions, cost
from chipload.planning.hand import clockwise_milling, engagement_of_hand, signed_speed
from chipload.planning.link_rows import row_ends, with_last_link
from chipload.planning.pocket.clearing import require_clearing
from chipload.planning.pocket.clearing_path import CUT, ENTRY, LIFT
from chipload.planning.pocket.motions import (
    HELIX,
    ZONES,
    Motions,
    MotionSamples,
    clock,
    entries,
    motions_of,
    programs_of,
    replay_motions,
    samples_of,
    speeds,
)
from chipload.planning.pocket.reach import CHORD
from chipload.planning.pocket.request import Clearing, ClearingTask, laid_out, material_before
from chipload.planning.pocket.stages import (
    FLOOR,
    TROCHOIDAL,
    PocketStage,
    require_finish,
    sections_of,
    stage_order,
    stages_of,
)
from chipload.planning.pocket.totals import summary_of
from chipload.planning.result import Columns, Event, OperationResult, StrategyResult
from chipload.program.program import Program
from chipload.progress import Progress, silent

Floats = NDArray[np.float64]

#: engagement above a* that counts as one [deg]
ABOVE_DEG = 0.01
#: places along a wall [mm] that are held against free space, and how near to its edge they are made already
WALL_STEP_MM, EDGE_MM = 0.05, 1e-3
#: digits of the depth of a level [mm] within which levels are alike
DEPTH_DIGITS = 9
#: share of the reachable area that must be cleared
CLEARED = 0.995
#: what clears channels that are hardly wider than the cutter
CIRCLES = f'strategies = ["pocket", "{TROCHOIDAL}"], or '


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
    task = laid_out(contours, setting, cutter.radius)
    require_finish(setting)
    results = {}
    for k, name in enumerate(setting.strategies):

        def part(done: float, what: str, start: int = k) -> None:
            progress((start + done) / len(setting.strategies), what)

        results[name] = _strategy(name, task, setting, cutter, material, machine, limits, part)
    progress(1.0, "pocket")
    return OperationResult("pocket", setting.use, results)


def _strategy(
    name: str,
    task: ClearingTask,
    setting: Clearing,
    cutter: Cutter,
    material: Material,
    machine: Machine,
    limits: Mapping[str, float],
    progress: Progress,
) -> StrategyResult:
    """One strategy with its program and its totals."""
    radius = cutter.radius
    sections = sections_of(task, setting)
    stages = stages_of(sections, setting, cutter, name, lambda done, what: progress(0.9 * done, what))
    history, program, whole, motions = _history(stages, setting, cutter, material, machine)
    on_front = np.isin(history["pass"], [stage.name for stage in stages])
    reaches = [_reach(section.task, setting, radius) for section in sections]
    areas, most = [_in_stock(reach, setting) for reach in reaches], limits.get("engagement_deg", 0.0)
    return StrategyResult(
        name,
        program,
        with_last_link(history, setting.heights.safe, whole),
        summary_of(stages, history, len(program), whole),
        (
            *(event for stage in _planned_stages(stages) for event in stage.path.events),
            *misses(name, stages, history, on_front, areas, most),
        ),
        np.append(on_front, False),
        {
            "wall": _walls(reaches[0], setting, task),
            "wall below": tuple(c for reach in reaches[1:] for c in _walls(reach, setting, sections[1].task)),
            "part": task.region.contours,
            "leftover": stages[-1].path.leftover,
            "front path": tuple(chain for one in motions for chain in _chains(one)),
            "stock before": material_before(task, setting, radius),
        },
    )


def _reach(task: ClearingTask, setting: Clearing, radius: float) -> Region:
    """What the cutter can reach of a region, with the allowance that stays on its walls."""
    return offset_region(offset_region(task.region, radius + setting.left_on_walls), -radius)


def _planned_stages(stages: Sequence[PocketStage]) -> list[PocketStage]:
    """The stages with a path of their own: the finish of the floor runs that of the clearing."""
    return [stage for stage in stages if stage.name != FLOOR]


def _history(
    stages: Sequence[PocketStage], setting: Clearing, cutter: Cutter, material: Material, machine: Machine
) -> tuple[Columns, Program, float, list[Motions]]:
    """Rows of all levels of all stages, the program, its time [s], and the motions of each path at its first level."""
    link_feed = machine.feed_max if setting.link_feed is None else setting.link_feed
    slope = HELIX if cutter.ramp_angle is None else min(HELIX, cutter.ramp_angle)
    each = [[motions_of(stage.path, h, stage.feed, link_feed, slope) for h in stage.heights] for stage in stages]
    parts = [
        [
            programs_of(m, stage.feed, signed_speed(stage.spindle_speed, cutter), cutter.number, stage.name)
            for m in levels
        ]
        for stage, levels in zip(stages, each, strict=True)
    ]
    order = stage_order(stages, setting.wall_finish is not None and setting.wall_finish.by_level)
    program = Program.join([p for k, j in order for p in parts[k][j]])
    ends = row_ends(program, machine)
    sampled = [samples_of(levels[0], stage.task.step) for stage, levels in zip(stages, each, strict=True)]
    deep = [[round(h.top - h.floor, DEPTH_DIGITS) for h in stage.heights] for stage in stages]
    made = [
        {
            depth: _columns(stage, depth, levels[depths.index(depth)], samples, setting, cutter, material, machine)
            for depth in dict.fromkeys(depths)
        }
        for stage, depths, levels, samples in zip(stages, deep, each, sampled, strict=True)
    ]
    rows, first, travelled = [], 0, 0.0
    for k, j in order:
        m, runs, samples, (columns, own) = each[k][j], parts[k][j], sampled[k], made[k][deep[k][j]]
        count = sum(len(p) for p in runs)
        time = clock(m, samples, own, runs, ends[first : first + count])
        z = m.height[samples.motion]
        rows.append({**columns, "z_mm": z, "t_s": time, "s_mm": columns["s_mm"] + travelled})
        first, travelled = first + count, travelled + float(columns["s_mm"][-1])
    history = {name: np.concatenate([r[name] for r in rows]) for name in rows[0]}
    return (
        history,
        program,
        float(ends[-1]),
        [m[0] for stage, m in zip(stages, each, strict=True) if stage.name != FLOOR],
    )


def _columns(
    stage: PocketStage,
    depth: float,
    motions: Motions,
    samples: MotionSamples,
    setting: Clearing,
    cutter: Cutter,
    material: Material,
    machine: Machine,
) -> tuple[Columns, Floats]:
    """Columns of one level of a stage, ``depth`` [mm] deep, and the time within its runs [s]."""
    radius, task = cutter.radius, stage.task
    met, most = replay_motions(motions, samples, radius, task.free, stage.before)
    met = engagement_of_hand(met, cutter)
    length, speed, own = speeds(motions, samples, machine)
    kind = motions.kind[samples.motion]
    zone = np.array([{**ZONES, CUT: stage.name}[int(k)] for k in kind], dtype=object)
    zone[:-1][(kind[:-1] == LIFT) & (kind[1:] == ENTRY)] = "entry"
    off = distance(task.region.segments, samples.centre) - radius - stage.allowance
    makes_wall = (np.abs(off) <= 2.0 * CHORD * radius) & (kind == CUT) & stage.makes_wall
    place = (zone, length, own, samples.centre, samples.heading, 0.0, met, speed, makes_wall)
    cut = CutConditions(cutter, material, depth, stage.spindle_speed, setting.milling, *setting.rigid)
    columns: Columns = {**cost(cut, *place), "engagement_max_deg": np.degrees(most), "ramp_deg": np.zeros(len(kind))}
    if (kind == ENTRY).any():  # a turn of a bore is as deep as its pitch, a leg of a ramp as two
        deep, steep = entries(motions, depth)
        thin = {**cost(replace(cut, axial_depth=deep), *place), "ramp_deg": np.full(len(kind), math.degrees(steep))}
        columns = {k: np.where(kind == ENTRY, thin.get(k, v), v) for k, v in columns.items()}
    return columns, own


def _walls(reach: Region, setting: Clearing, task: ClearingTask) -> tuple[Contour, ...]:
    """The contours, or parts of them, that the cutter makes a wall of: inside the stock, and not where the edge of free
    space was made before.
    """
    if not task.free:
        return reach.contours
    stock = Region.of(Region(setting.stock).contours) if setting.stock else None
    edges = np.vstack([region.segments for region in task.free])
    out: list[Contour] = []
    for contour in reach.contours:
        s = np.linspace(0.0, contour.length, max(16, math.ceil(contour.length / WALL_STEP_MM)) + 1)
        points = contour.at(s)[0]
        made = distance(edges, points) > EDGE_MM
        for region in task.free:
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
    task = laid_out(contours, setting, cutter.radius)
    require_finish(setting)
    for section in sections_of(task, setting):
        require_clearing(
            section.task.region,
            cutter.radius,
            task.engagement,
            clockwise_milling(setting.milling, cutter),
            task.step,
            setting.allowance,
        )
    return task.region.area


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


def misses(
    strategy: str,
    stages: Sequence[PocketStage],
    history: Columns,
    on_front: NDArray[np.bool_],
    areas: Sequence[float],
    limit_deg: float,
) -> list[Event]:
    """Where a strategy misses the required engagement, or leaves parts of the areas [mm^2] within its reach.

    An engagement within the limit that the job states is no failure.
    """
    out = []
    wanted = stages[0].task.engagement
    most = np.where(on_front, history["engagement_max_deg"], 0.0)
    k = int(np.argmax(most))
    if most[k] > math.degrees(wanted) + ABOVE_DEG:
        text = f"engagement {most[k]:.4f} deg: must be at most {math.degrees(wanted):.4f} deg"
        at = float(history["x_mm"][k]), float(history["y_mm"][k])
        out.append(Event("pocket-engagement", *at, text, failure=bool(most[k] > limit_deg)))
    for stage in _planned_stages(stages):
        path, within = stage.path, areas[stage.section]
        if not stage.makes_wall or path.leftover_mm2 <= (1.0 - CLEARED) * within:
            continue
        x, y = path.leftover[0].start if path.leftover else (float(path.x[-1]), float(path.y[-1]))
        text = (
            f"only {1.0 - path.leftover_mm2 / within:.2%} of what the cutter can reach is cleared, "
            f"{number_text(path.leftover_mm2)} mm2 left: state {'' if strategy == TROCHOIDAL else CIRCLES}a "
            "smaller cutter"
        )
        out.append(Event("pocket-uncleared", float(x), float(y), text, failure=True))
    return out
