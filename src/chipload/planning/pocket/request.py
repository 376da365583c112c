"""Request for a pocket: depths, feeds, walls, finish passes, and free space.

Notation: R cutter radius, s radial depth, a* = arccos(1 - s/R) the constant engagement.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from chipload.cutting.rigid import OF_DEPTH, OF_FEED
from chipload.cutting.wall_error import Milling
from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.offset import offset_region
from chipload.planning.pocket.clearing import STEP, Entry
from chipload.planning.pocket.free_space import cleared_by, hole, outside_of, without_leftover, without_stock
from chipload.planning.pocket.motions import Heights
from chipload.planning.pocket.tabs import Tabs

#: height of a link above the floor where none is stated [mm]
LINK_LIFT_MM = 0.1
#: heights [mm] nearer to each other than this are one
LEVEL_MM = 1e-6
#: how far beside the stock the centre may go around a part that stands in it, in R
AROUND = 1.05


@dataclass(frozen=True)
class LargerCutter:
    """A cutter that cleared the same contours before: radius and allowance on the walls [mm], and closed contours of
    other material that it left, as far as it is known.
    """

    radius: float
    allowance: float
    left: tuple[Contour, ...] = ()


@dataclass(frozen=True)
class FloorFinish:
    """Floor finish: the last level of a pocket, which removes the allowance on the floor; feed [mm/s], spindle speed
    [rad/s].
    """

    feed: float
    spindle_speed: float


@dataclass(frozen=True)
class WallFinish:
    """Wall finish: passes that remove the allowance of clearing on the walls; mm, mm/s, rad/s.

    Parameters
    ----------
    axial_depth : greatest depth of a level; None: the whole depth of the pocket, or of a level that clears, in one
    allowance : that they leave in turn
    by_level : whether the walls beside each level that clears are finished before the next, while all below stands
    """

    feed: float
    spindle_speed: float
    axial_depth: float | None = None
    allowance: float = 0.0
    by_level: bool = False


@dataclass(frozen=True)
class Clearing:
    """Parameters of a pocket; mm, mm/s, rad/s, as in :class:`chipload.planning.contour.plan.Finishing`.

    Parameters
    ----------
    step : greatest step, taken as 0.06 R where it is less (the engagement is kept along the whole of each step)
    allowance : left on the walls
    link_feed : of links through cleared space [mm/s], None: the machine's greatest
    link_lift : how far links stay off the floor, where they are long enough
    depth : of the pocket, cut in equal depths of at most ``axial_depth``; None: one of ``axial_depth``
    level_depths : of the levels that clear, from above, in place of equal ones; none: equal ones
    stock : outline of the stock, closed contours; none: material everywhere
    around : the contours are those of a part that stands in the stock, which is cleared around it
    holes : (x, y, diameter) of pre-drilled holes as deep as the pocket
    larger : what cleared the contours before; None: nothing did
    standing : closed contours of the material as it stands over the whole depth; None: from the other keys
    floor_allowance : left on the floor by the levels that clear
    floor_finish, wall_finish : passes that take the allowances; None: they stay
    tabs : what stays over the floor; None: nothing
    strategies : among `pocket` (passes alone), `trochoidal` (circles along the middle lines, then passes)
    use : the strategy whose program is released
    entry : into the solid, `helix` or `ramp`
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
    depth: float | None = None
    level_depths: tuple[float, ...] = ()
    stock: tuple[Contour, ...] = ()
    around: bool = False
    holes: tuple[tuple[float, float, float], ...] = ()
    larger: LargerCutter | None = None
    standing: tuple[Contour, ...] | None = None
    floor_allowance: float = 0.0
    floor_finish: FloorFinish | None = None
    wall_finish: WallFinish | None = None
    tabs: Tabs | None = None
    strategies: tuple[str, ...] = ("pocket",)
    use: str = "pocket"
    entry: Entry = "helix"

    @property
    def bottom(self) -> float:
        """Height of the finished floor."""
        return self.top - (self.axial_depth if self.depth is None else self.depth)

    @property
    def levels(self) -> list[Heights]:
        """The heights of the program at each depth that clears, from above."""
        return self.clearing_levels(self.top, self.bottom + self.floor_allowance)

    @property
    def heights(self) -> Heights:
        """The heights at the first depth."""
        return self.levels[0]

    @property
    def left_on_walls(self) -> float:
        """The allowance that the last passes leave on the walls."""
        return self.allowance if self.wall_finish is None else self.wall_finish.allowance

    def levels_between(self, top: float, floor: float, axial_depth: float) -> list[Heights]:
        """The heights of equal levels of at most ``axial_depth`` [mm], from above."""
        count = max(1, math.ceil((top - floor) / axial_depth - 1e-9))
        return self._levels_at([top + (floor - top) * k / count for k in range(count)] + [floor])

    def clearing_levels(self, top: float, floor: float) -> list[Heights]:
        """The heights of the levels that clear between two heights [mm], from above."""
        if not self.level_depths:
            return self.levels_between(top, floor, self.axial_depth)
        ends = self.top - np.cumsum(self.level_depths)
        between = ends[(ends < top - LEVEL_MM) & (ends > floor + LEVEL_MM)].tolist()
        return self._levels_at([top, *between, floor])

    def _levels_at(self, edges: Sequence[float]) -> list[Heights]:
        """The heights of levels between neighbouring ``edges`` [mm], from above."""
        safe = self.top + self.clearance
        return [Heights(low, min(low + self.link_lift, high), high, safe) for high, low in pairwise(edges)]


@dataclass(frozen=True, eq=False)
class ClearingTask:
    """Region, free space and engagement of a pocket in the plane.

    Parameters
    ----------
    region : inside of which the cutter may go
    free : regions without material
    engagement : that is held [rad]
    step : [mm]
    """

    region: Region
    free: tuple[Region, ...]
    engagement: float
    step: float


def laid_out(contours: Sequence[Contour], setting: Clearing, radius: float) -> ClearingTask:
    """Region, free space, constant engagement and step of a request.

    Raises
    ------
    InputError
        The radial depth is not below the diameter, a contour is open, a hole is no wider than the cutter, a part is to
        be cleared around and no stock is stated.
    """
    if not 0.0 < setting.radial_depth < 2.0 * radius:
        raise InputError(
            f"operation.radial_depth_mm = {setting.radial_depth:g}: must be above 0 and below the cutter's "
            f"diameter_mm = {2.0 * radius:g}"
        )
    drawn = Region.of(Region(tuple(contours)).contours)
    free: list[Region] = []
    region = drawn
    if setting.stock:
        stock = Region.of(Region(setting.stock).contours)
        free.append(outside_of(stock, radius))
        if setting.around:
            outside = offset_region(stock, -(radius + setting.allowance + AROUND * radius))
            region = Region.of([*outside.contours, *drawn.contours])
    elif setting.around:
        raise InputError("operation.side = 'outside': needs part.stock_layers: state the layers of the stock's outline")
    free += [hole(x, y, diameter, radius) for x, y, diameter in setting.holes]
    if setting.larger is not None:
        before = cleared_by(drawn, setting.larger.radius, setting.larger.allowance)
        if not before.contours:
            raise InputError(f"operation.rest_of: the larger cutter, radius {setting.larger.radius:g} mm, fits nowhere")
        free.append(without_leftover(before, setting.larger.left, radius))
    if setting.standing is not None:
        free += [r for r in [without_stock(drawn, setting.standing, radius, setting.left_on_walls)] if r.contours]
    wanted = math.acos(1.0 - setting.radial_depth / radius)
    return ClearingTask(region, tuple(free), wanted, min(max(setting.step, STEP * radius), 0.25 * radius))


def material_before(task: ClearingTask, setting: Clearing, radius: float) -> tuple[Contour, ...]:
    """The contours of the material that the first motion meets; none where it is everywhere."""
    if not task.free:
        return ()
    inner = task.free[1:] if setting.stock else task.free
    outer: Sequence[Contour] = setting.stock
    if not outer:
        xmin, ymin, xmax, ymax = task.region.bounds
        m = 8.0 * radius
        box = [(xmin - m, ymin - m), (xmax + m, ymin - m), (xmax + m, ymax + m), (xmin - m, ymax + m)]
        outer = (Contour.polyline(box, closed=True),)
    return Region.of([*outer, *(c for region in inner for c in region.contours)]).contours
