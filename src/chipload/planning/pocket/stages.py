"""Stages of a pocket: clearing in levels, floor finish, wall finish.

Each stage runs one path of the centre at one or more heights. The path of the walls is planned in the stock that the
clearing path left, with the same greatest engagement; that of the floor is the clearing path once more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.planning.hand import clockwise_milling
from chipload.planning.pocket.clearing import clear_region
from chipload.planning.pocket.clearing_path import ClearingPath, EarlierPath
from chipload.planning.pocket.motions import Heights
from chipload.planning.pocket.reach import centre_region
from chipload.planning.pocket.request import Clearing, ClearingTask
from chipload.planning.pocket.tabs import without_tabs
from chipload.progress import Progress

Floats = NDArray[np.float64]

#: names of the stages, which are the `pass` of their rows
CLEARING, FLOOR, WALL = "pocket", "floor", "wall"
#: the strategy that cuts channels by circles first
TROCHOIDAL = "trochoidal"
#: least axial depth of a finish pass of the floor [mm]
LEAST_FLOOR_MM = 1e-3


@dataclass(frozen=True, eq=False)
class PocketSection:
    """Heights [mm] between which the region of a pocket is the same."""

    top: float
    floor: float
    task: ClearingTask


@dataclass(frozen=True, eq=False)
class PocketStage:
    """One path of the centre at one or more heights.

    Parameters
    ----------
    name : `pocket`, `floor` or `wall`
    section : number of its section, from 0
    task : region, free space and engagement
    path : of the centre
    heights : of each level, from above
    feed, spindle_speed : [mm/s], [rad/s]
    allowance : left on the walls [mm]
    makes_wall : whether no later stage cuts the walls that it leaves
    before : segments (n, 7) along which the same cutter has cut at these heights
    """

    name: str
    section: int
    task: ClearingTask
    path: ClearingPath
    heights: tuple[Heights, ...]
    feed: float
    spindle_speed: float
    allowance: float
    makes_wall: bool
    before: Floats | None = None

    @property
    def depth(self) -> float:
        """Greatest axial depth of a level [mm]."""
        return max(h.top - h.floor for h in self.heights)


def require_finish(setting: Clearing) -> None:
    """Refuse allowances and finish passes that contradict one another.

    Raises
    ------
    InputError
        A finish pass finds nothing to cut, or an allowance is as deep as the pocket.
    """
    whole = setting.top - setting.bottom
    if setting.floor_allowance >= whole:
        raise InputError(
            f"operation.floor_allowance_mm = {setting.floor_allowance:g}: must be below the depth of the "
            f"pocket, {whole:g}"
        )
    if setting.floor_finish is not None and setting.floor_allowance < LEAST_FLOOR_MM:
        raise InputError(
            f"operation.floor_allowance_mm = {setting.floor_allowance:g}: must be at least {LEAST_FLOOR_MM:g} with "
            "operation.floor_finish: state what the finish pass of the floor cuts"
        )
    tabs = setting.tabs
    if tabs is not None and not tabs.height < whole:
        raise InputError(
            f"operation.tabs.height_mm = {tabs.height:g}: must be below the depth of the pocket, {whole:g}"
        )
    if tabs is not None and not tabs.height > setting.floor_allowance:
        raise InputError(
            f"operation.tabs.height_mm = {tabs.height:g}: must be above operation.floor_allowance_mm = "
            f"{setting.floor_allowance:g}"
        )
    if tabs is not None and setting.around:
        raise InputError(
            "operation.tabs: with side = 'outside' all of the stock around the part is cleared, and a tab would hold "
            "nothing: draw the outline of what is cleared as a contour of the part and state side = 'inside'"
        )
    wall = setting.wall_finish
    if wall is not None and not wall.allowance < setting.allowance:
        raise InputError(
            f"operation.wall_finish.allowance_mm = {wall.allowance:g}: must be below operation.allowance_mm = "
            f"{setting.allowance:g}: state what the finish passes of the walls cut"
        )


def stage_order(stages: Sequence[PocketStage], by_level: bool) -> list[tuple[int, int]]:
    """Number of the stage and of its level, in the order of the program.

    With ``by_level`` the levels of each section run from above: what clears a level, then the floor, then its walls.
    """
    pairs = [(k, j) for k, stage in enumerate(stages) for j in range(len(stage.heights))]
    if not by_level:
        return pairs
    starts = {stage.section: [h.top for h in stage.heights] for stage in stages if stage.name == CLEARING}

    def place(pair: tuple[int, int]) -> tuple[int, int, int, int]:
        stage = stages[pair[0]]
        top = stage.heights[pair[1]].top
        level = sum(start >= top - LEAST_FLOOR_MM for start in starts[stage.section]) - 1
        return stage.section, level, *pair

    return sorted(pairs, key=place)


def sections_of(task: ClearingTask, setting: Clearing) -> list[PocketSection]:
    """The whole depth, or what lies above the tops of the tabs and what lies below."""
    if setting.tabs is None:
        return [PocketSection(setting.top, setting.bottom, task)]
    height = setting.bottom + setting.tabs.height
    region = without_tabs(task.region, setting.tabs)
    return [
        PocketSection(setting.top, height, task),
        PocketSection(height, setting.bottom, replace(task, region=region)),
    ]


def stages_of(
    sections: Sequence[PocketSection], setting: Clearing, cutter: Cutter, strategy: str, progress: Progress
) -> list[PocketStage]:
    """The stages of a pocket in their order, with their paths; ``strategy`` is that of the clearing."""
    out = []
    for k, section in enumerate(sections):

        def part(done: float, what: str, start: int = k) -> None:
            progress((start + done) / len(sections), what)

        out += _stages(k, section, setting, cutter, strategy, part)
    return out


def _stages(
    number: int, section: PocketSection, setting: Clearing, cutter: Cutter, strategy: str, progress: Progress
) -> list[PocketStage]:
    """The stages of one section."""
    task, radius = section.task, cutter.radius

    def path_of(allowance: float, earlier: EarlierPath | None, share: tuple[float, float]) -> ClearingPath:
        return clear_region(
            task.region,
            radius,
            task.engagement,
            milling=clockwise_milling(setting.milling, cutter),
            step=task.step,
            allowance=allowance,
            free=task.free,
            earlier=earlier,
            trochoidal=strategy == TROCHOIDAL and earlier is None,
            entry=setting.entry,
            progress=lambda done, what: progress(share[0] + share[1] * done, what),
        )

    wall, last = setting.wall_finish, section.floor == setting.bottom
    left = setting.floor_allowance if last else 0.0
    path = path_of(setting.allowance, None, (0.0, 1.0 if wall is None else 0.7))
    clearing = PocketStage(
        CLEARING,
        number,
        task,
        path,
        tuple(setting.clearing_levels(section.top, section.floor + left)),
        setting.feed,
        setting.spindle_speed,
        setting.allowance,
        wall is None,
    )
    out = [clearing]
    if setting.floor_finish is not None and last:
        own = setting.floor_finish
        heights = setting.levels_between(section.floor + left, section.floor, setting.axial_depth)
        out.append(
            replace(clearing, name=FLOOR, heights=tuple(heights), feed=own.feed, spindle_speed=own.spindle_speed)
        )
    if wall is not None:
        floor = out[-1].heights[-1].floor
        tops = [h.top for h in clearing.heights] if wall.by_level else [section.top]
        levels = [
            level
            for top, low in pairwise([*tops, floor])
            for level in setting.levels_between(top, low, wall.axial_depth or top - low)
        ]
        earlier = EarlierPath.of(path, centre_region(task.region, radius + setting.allowance))
        out.append(
            PocketStage(
                WALL,
                number,
                task,
                path_of(wall.allowance, earlier, (0.7, 0.3)),
                tuple(levels),
                wall.feed,
                wall.spindle_speed,
                wall.allowance,
                True,
                earlier.segments,
            )
        )
    return out
