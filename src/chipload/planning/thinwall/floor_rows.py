"""Passes over a floor with an upright cutter: parallel rows, then a contour along the walls, with entries and links.

Notation: x, y [mm] coordinates in the frame of the floor, z over it; u, v parameters, x and y over the size of the
floor's box; D [mm] stock that a pass leaves at a place, H what it finds; R radius of the cutter, b step-over.

The tip follows z = D(x, y) at its own x, y: the stock that it leaves, the least of D within R, is nowhere above D. A
cutter at a place thus cuts at most H - D of that place, whatever the slope.

Rows run along x, at most b apart, all in the direction that the milling requires, within the area of centres in which
the cutter touches no wall. A row is cut where some point under the cutter has stock; such a part of a row is a stroke.
Rows leave stock at walls that they do not follow; the contour removes it, with the wall on the right of a clockwise
cutter in down milling.

The rows are also planned in the opposite order and direction; the plan with fewer strokes that begin in stock is used.
A stroke begins where the cutter is free: in air, or over an earlier stroke, from which the cutter moves sideways to the
first point. Where neither is near, the cutter ramps down along the stroke, to and fro within a radius of its beginning,
and returns to it. Links run at the clearance over the floor, or at the safe height where a wall lies between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely import MultiLineString, MultiPolygon, Polygon

from chipload.errors import InputError
from chipload.lazy import scipy
from chipload.planning.thinwall.blank import FinishSurface
from chipload.planning.thinwall.pass_program import Margins, PassPath, PassProgram
from chipload.planning.thinwall.passes import NOTHING, WallPass
from chipload.planning.thinwall.paths import PassMotion

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: lines and points count as within an area up to this distance from it [mm]
NEAR = 1e-6
#: parts of contours within this distance of a row [mm] are left out, and parts up to ten times as long
CUT = 1e-3
#: height above the surface that is left at which the feed begins [mm]
ABOVE = 0.2
#: greatest distance of a point of an earlier stroke from which a stroke is entered sideways, in step-overs
ASIDE = 1.5
#: points under an upright cutter at which its stock is read: circles in radii, and points on each
CIRCLES, ROUND = (0.0, 0.5, 1.0), 16
#: shortest ramp, in radii; a shorter stroke is entered straight down
SHORTEST = 0.1
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class FloorArea:
    """Area of the cutter's axis over a floor, in the frame of the floor.

    Attributes
    ----------
    origin, along, across : (3,) corner of the floor's box [mm], unit vectors of x and y
    size : of the box along x and y [mm]
    outline : of the floor, x and y [mm]
    centres : of the cutter, x and y [mm], also beyond edges without a wall
    walls : the part of its boundary at which the cutter touches a wall
    spacing : greatest distance of the points of a stroke [mm]
    ramp : angle of entries [rad]
    """

    origin: Floats
    along: Floats
    across: Floats
    size: tuple[float, float]
    outline: Polygon
    centres: MultiPolygon
    walls: MultiLineString
    spacing: float
    ramp: float

    def at(self, xy: Floats, z: ArrayLike) -> Floats:
        """Points (..., 3) [mm] of the part at x, y (..., 2) and the height z (...) over the floor."""
        return np.asarray(
            self.origin + xy[..., :1] * self.along + xy[..., 1:] * self.across + np.asarray(z)[..., None] * UP
        )


@dataclass(frozen=True, eq=False)
class FloorSide:
    """A floor as a side that is cut.

    Attributes
    ----------
    surface : (n, m) points over its box
    u, v : (n,), (m,) float, its parameters; v a step-over apart
    area : of the cutter's axis
    """

    surface: FinishSurface
    u: Floats
    v: Floats
    area: FloorArea


def points_under(radius: float) -> Floats:
    """Points (k, 2) [mm] under an upright cutter at which its stock is read, from its axis: circles of points."""
    angle = np.arange(ROUND) * (math.tau / ROUND)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([share * radius * circle for share in CIRCLES])


class _Heights:
    """Stock before and after a pass over a floor, at the places x, y [mm] of its frame."""

    def __init__(self, p: WallPass, places: tuple[Floats, Floats], area: FloorArea, radius: float) -> None:
        self.size, self.radius, self.outline = np.array(area.size), radius, area.outline
        shapely.prepare(self.outline)
        self._low, self._depth = (
            scipy.interpolate.RegularGridInterpolator(places, values) for values in (p.low, p.depth)
        )
        self.under = points_under(radius)

    def place(self, xy: Floats) -> Floats:
        """Parameters (..., 2) of places (..., 2) [mm]."""
        return np.asarray(np.clip(xy / self.size, 0.0, 1.0))

    def low(self, xy: Floats) -> Floats:
        """Stock D (...) [mm] after the pass at places (..., 2) [mm]."""
        return np.asarray(self._low(self.place(xy).reshape(-1, 2)).reshape(xy.shape[:-1]))

    def depth(self, xy: Floats) -> Floats:
        """Depth of cut H - D (...) [mm] at places (..., 2) [mm]."""
        return np.asarray(self._depth(self.place(xy).reshape(-1, 2)).reshape(xy.shape[:-1]))

    def cuts(self, xy: Floats) -> Bools:
        """Whether the cutter finds stock at places (n, 2) [mm] of its axis, (n,) bool."""
        under = xy[:, None] + self.under
        there = shapely.intersects_xy(self.outline, under[..., 0], under[..., 1])
        return np.asarray((there & (self.depth(under) > NOTHING)).any(axis=1))

    def top(self, xy: Floats) -> Floats:
        """Greatest stock H (n,) [mm] under the cutter at places (n, 2) [mm] of its axis."""
        under = xy[:, None] + self.under
        return np.asarray((self.low(under) + self.depth(under)).max(axis=1))


def floor_pass(
    p: WallPass,
    side: FloorSide,
    places: tuple[Floats, Floats],
    pass_motion: PassMotion,
    margins: Margins,
    label: str,
) -> PassProgram:
    """Program of a pass over a floor.

    Parameters
    ----------
    p : the pass
    side : the floor, with the area of the cutter's axis
    places : u (n,) and v (m,) of the pass
    pass_motion : cutter, feed, speed and clearance
    margins : safe height of links
    label : name of the pass

    Raises
    ------
    InputError
        The pass finds no stock.
    """
    area, posture = side.area, pass_motion.posture
    step = float(posture.step or 0.0)
    heights = _Heights(p, places, area, posture.cutter.radius)
    rows = rows_over(area, step)
    # the same rows from the other side, against them: milling and order are the same, entries are not
    orders = [_cut_strokes(some, heights) for some in (rows, [row[::-1] for row in reversed(rows)])]
    strokes = min(orders, key=lambda one: sum(bool(heights.cuts(stroke[:1])[0]) for stroke in one))
    along = [shapely.LineString(s) for s in strokes]
    strokes += _cut_strokes(_contours(area, along, step < 0.0), heights)
    if not strokes:
        raise InputError(f"{label}: the pass finds no stock")
    path = _FloorPath(area, heights, pass_motion.clearance, margins.safe, ASIDE * abs(step))
    for stroke in strokes:
        path.cut(stroke)
    path.retract()
    return path.path.pass_program(p.side, pass_motion, label)


def rows_over(area: FloorArea, step: float) -> list[Floats]:
    """Rows (k, 2) [mm], beginning with the least y, at most ``step`` [mm] apart, in the direction of the feed.

    If the step is above 0, the next row lies on the left of the feed, which is along x; otherwise it is against x.
    """
    over = area.centres.intersection(area.outline)
    (x0, _, x1, _), (_, y0, _, y1) = area.centres.bounds, over.bounds
    count = math.ceil((y1 - y0) / abs(step) - NEAR) + 1
    out: list[Floats] = []
    wide = area.centres.buffer(NEAR)
    for y in np.linspace(y0, y1, count) if count > 1 else [0.5 * (y0 + y1)]:
        parts = shapely.get_parts(wide.intersection(shapely.LineString([(x0 - 1.0, y), (x1 + 1.0, y)])))
        ends = sorted((float(q.bounds[0]), float(q.bounds[2])) for q in parts[shapely.intersects(parts, area.outline)])
        rows = [_sample_line(np.array([[a, y], [b, y]]), area.spacing) for a, b in ends]
        out += rows if step > 0.0 else [row[::-1] for row in reversed(rows)]
    return out


def _contours(area: FloorArea, rows: list[shapely.LineString], down: bool) -> list[Floats]:
    """Lines (k, 2) [mm] along the walls, without the parts that rows follow; ``down``: for down milling."""
    if area.walls.is_empty:
        return []
    left = area.walls.difference(shapely.union_all(rows).buffer(CUT)) if rows else area.walls
    # closed walls begin anywhere: joined where they meet
    lines = shapely.get_parts(shapely.line_merge(left, directed=True))
    found = [shapely.get_coordinates(line) for line in lines.tolist() if line.length > 10.0 * CUT]
    return [_sample_line(line if down else line[::-1], area.spacing) for line in found]


def _sample_line(line: Floats, spacing: float) -> Floats:
    """The line (k, 2) [mm] with points at most ``spacing`` [mm] apart."""
    out = [line[:1]]
    for a, b in pairwise(line):
        n = max(math.ceil(float(np.linalg.norm(b - a)) / spacing), 1)
        out.append(a + (b - a) * (np.arange(1, n + 1) / n)[:, None])
    return np.concatenate(out)


def _cut_strokes(lines: list[Floats], heights: _Heights) -> list[Floats]:
    """Parts of lines on which the cutter finds stock, with the points before and after them."""
    out: list[Floats] = []
    for line in lines:
        on = np.concatenate([[0], heights.cuts(line).astype(np.int64), [0]])
        for a, b in zip(np.flatnonzero(np.diff(on) == 1), np.flatnonzero(np.diff(on) == -1), strict=True):
            first, last = max(int(a) - 1, 0), min(int(b), len(line) - 1)
            if last == first:  # a single point: a short motion
                first, last = max(first - 1, 0), min(last + 1, len(line) - 1)
            out.append(line[first : last + 1])
    return [line for line in out if len(line) > 1]


class _FloorPath:
    """Path of a pass over a floor under construction, stroke after stroke."""

    def __init__(self, area: FloorArea, heights: _Heights, clearance: float, safe: float, aside: float) -> None:
        self.area, self.heights, self.clearance, self.aside = area, heights, clearance, aside
        self.safe = safe - float(area.origin[2])
        self.inside = area.centres.buffer(NEAR)
        self.path = PassPath()
        self.now: Floats | None = None
        self.free: list[Floats] = []

    def cut(self, stroke: Floats) -> None:
        """Add the entry into a stroke (k, 2) [mm] and the stroke."""
        start, cuts = stroke[0], bool(self.heights.cuts(stroke[:1])[0])
        entry = start if not cuts else self._sideways_entry(start)
        if entry is None:
            self._go(start, float(self.heights.top(start[None])[0]) + ABOVE)
            self._ramp(stroke)
        else:
            self._go(entry, float(self.heights.low(entry)) + ABOVE)
            self._feed(entry, float(self.heights.low(entry)))
            if entry is not start:
                self._feed_along(_sample_line(np.stack([entry, start]), self.area.spacing)[1:])
        self._feed_along(stroke[1:])
        self.free.append(stroke)
        self.now = stroke[-1]

    def retract(self) -> None:
        """Add a rapid to the safe height."""
        if self.now is not None:
            self._rapid(self.now, self.safe)

    def _sideways_entry(self, start: Floats) -> Floats | None:
        """Nearest point (2,) [mm] of earlier strokes from which the cutter reaches ``start`` sideways; None: none."""
        near = [p for line in self.free for p in line[np.linalg.norm(line - start, axis=1) <= self.aside]]
        for p in sorted(near, key=lambda q: float(np.linalg.norm(q - start))):
            if np.array_equal(p, start) or self.inside.covers(shapely.LineString([p, start])):
                return np.asarray(p)
        return None

    def _go(self, to: Floats, z: float) -> None:
        """Add rapids to a place (2,) [mm] and down to z [mm], at the safe height if a wall lies between."""
        if self.now is None:
            self._rapid(to, self.safe)
        else:
            clear = np.array_equal(self.now, to) or self.inside.covers(shapely.LineString([self.now, to]))
            high = self.clearance if clear else self.safe
            self._rapid(self.now, high)
            self._rapid(to, high)
        self._rapid(to, z)

    def _ramp(self, stroke: Floats) -> None:
        """Add a ramp to and fro along a stroke (k, 2) [mm], down to its depth, and the return to its beginning."""
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(stroke, axis=0), axis=1))])
        tangent = math.tan(self.area.ramp)
        z, k, turn = float(self.heights.top(stroke[:1])[0]) + ABOVE, 0, 1
        low = self.heights.low(stroke)
        # near the wall, where the floor is stiff: the bottom presses on it all the way down
        last = max(int(np.searchsorted(length, self.heights.radius, "right")) - 1, 1)
        z = min(z, self.clearance)
        if length[last] < SHORTEST * self.heights.radius:  # too short to go to and fro
            self._feed(stroke[0], float(low[0]), entry=True)
            return
        while z > low[k] + NOTHING:
            if not 0 <= k + turn <= last:
                turn = -turn
            z = max(z - tangent * abs(float(length[k + turn] - length[k])), float(low[k + turn]))
            k += turn
            self._feed(stroke[k], z, entry=True)
        self._feed_along(stroke[:k][::-1])

    def _feed_along(self, points: Floats) -> None:
        for xy, z in zip(points, self.heights.low(points), strict=True):
            self._feed(xy, float(z))

    def _feed(self, xy: Floats, z: float, entry: bool = False) -> None:
        tip = self.area.at(xy, z)
        self.path.line(tip, UP, tip, self.path.points[-1])
        # the force of an entry does not depend on the depth of the pass: its law is not corrected by it
        depth = 0.0 if entry else float(self.heights.low(xy) + self.heights.depth(xy)) - z
        self.path.known(tip, UP, self.heights.place(xy), max(depth, 0.0))

    def _rapid(self, xy: Floats, z: float) -> None:
        self.path.rapid(self.area.at(xy, z), UP)
