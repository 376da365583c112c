"""Clearing of a whole pocket at constant engagement: passes whose engagement never exceeds a*.

Notation: O centre of the cutter, T its heading, R radius; material lies on the RIGHT of travel (down milling; up
milling is the mirror image of it). a* the required engagement, 1 - cos a* = s / R. A **pass** turns at every step as
far towards the material as the exact engagement allows; where a wall limits it, it follows the wall. Where a pass ends
the cutter continues from the nearest place of the cleared edge that still has material beside it.

Reference: [Uddin2007] for the law da/ds = sin b / (R sin(a - b)) - kappa. Differs from source: the law only gives the
start of the root search; what is limited is the engagement itself, along the whole of each step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.contour import Region
from chipload.lazy import LateModule
from chipload.number_text import number_text
from chipload.planning.pocket import trochoid
from chipload.planning.pocket.clearing_path import (
    CUT,
    ENTRY,
    LIFT,
    LINK,
    ClearingPath,
    EarlierPath,
    mirrored_earlier,
    mirrored_path,
    mirrored_region,
    points_of_arcs,
    polyline,
    separate_polylines,
)
from chipload.planning.pocket.free_space import edge_places, places_along, take_free
from chipload.planning.pocket.leftover import PocketRemainder
from chipload.planning.pocket.reach import CHORD, Reach, centre_region, longest_line, reach_of, widest_places
from chipload.planning.pocket.skeleton import skeleton_of
from chipload.planning.pocket.starts import Starts
from chipload.planning.pocket.trochoid import Trochoid
from chipload.planning.result import Event
from chipload.progress import Progress, silent
from chipload.stock.planar import TOUCH, PlanarStock

_pass_steps = LateModule("chipload.planning.pocket._pass_steps")
_pass = LateModule("chipload.planning.pocket._pass")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: step length / R where none is given
STEP = 0.06
#: smallest turning radius / R, towards the material
TURN_RIGHT = 0.4
#: greatest turn away from the material at one place [rad]
TURN_LEFT = math.radians(100.0)
#: length / R without material that ends a pass
IDLE = 1.5
#: radius / R of the axis of a bore, where there is room
BORE = 0.9
#: how to get into the solid
Entry = Literal["helix", "ramp"]
#: longest ramp / R to either side of its middle, and the shortest in all: where there is less room a bore is
LONGEST, SHORTEST = 2.0, 0.2
#: entries at most besides the first of each part, and the room / R that one needs
ENTRIES, LEAST_ROOM = 50, 0.02
#: so many passes within 2 R that take less than this part of R^2 each are given up
SLOW_PASSES, SLOW_AREA = 30, 0.02
#: steps between two calls of ``progress``, and capsules that the stock has room for before them
CHUNK, ROOM = 2000, 1600
#: depth / R of the search for material beside the path, round after round
DEPTHS = (0.03, 0.006)
#: vertices of a pass lie within this part of R, of at most so many mm, from the lines and arcs that are written
FIT, FIT_UP_TO = 2e-4, 8.0
#: the steps keep this much [rad] below the engagement that what is written must keep
MARGIN = 2e-3
#: the written path is checked every 0.03 R, and stays this much [rad] below the limit there
BETWEEN = 4e-4
#: the written path may leave the centre region by this part of R, of at most so many mm: the middle of a chord of a
#: convex wall
SLACK, SLACK_UP_TO = 1e-4, 4.0
#: area / R^2 that a pass must take for its start to be used again
WORTH = 3e-4
#: passes begin so far / R inside the edge of what was cut before
INSIDE = 0.02
#: part of the reachable area that may be left without another round
ENOUGH = 5e-4


def clear_region(
    region: Region,
    radius: float,
    engagement: float,
    *,
    milling: Literal["down", "up"] = "down",
    step: float | None = None,
    allowance: float = 0.0,
    free: Sequence[Region] = (),
    earlier: EarlierPath | None = None,
    trochoidal: bool = False,
    entry: Entry = "helix",
    progress: Progress = silent,
) -> ClearingPath:
    """Path that clears ``region`` with a cutter of ``radius`` [mm] with at most ``engagement`` [rad].

    Parameters
    ----------
    step : greatest step [mm], <= R / 4; 0.06 R where none is given
    allowance : [mm] left on every wall, >= 0
    free : regions without material; passes begin at their edges, bores come only where these do not lead
    earlier : what the cutter has cut already; passes begin at its edge
    trochoidal : circles along the middle lines of the region first, passes for what they leave
    entry : into the solid, by a helical bore or by a ramp along a straight line, to and fro; circles need a bore

    Raises
    ------
    InputError
        An argument is out of its range, the cutter does not fit into the region anywhere, or nothing is left to clear.
    """
    step = STEP * radius if step is None else step
    centres = require_clearing(region, radius, engagement, milling, step, allowance)
    if milling == "up":
        return mirrored_path(
            clear_region(
                mirrored_region(region), radius, engagement, milling="down", step=step, allowance=allowance,
                free=[mirrored_region(r) for r in free],
                earlier=None if earlier is None else mirrored_earlier(earlier),
                trochoidal=trochoidal, entry=entry, progress=progress,
            )
        )  # fmt: skip
    run = _Run(centres, radius, engagement, step, free, progress, entry)
    if earlier is not None:
        run.take_earlier(earlier)
    if free or earlier is not None:
        run.begin_at_edges(free)
        if trochoidal:
            run.cut_channels(region, allowance, None)
        run.clear()
    else:
        for x, y, room in widest_places(centres, CHORD * radius):
            run.enter(x, y, room)
            if trochoidal:
                run.cut_channels(region, allowance, (x, y, min(BORE * radius, 0.98 * room)))
            run.clear()
    run.enter_elsewhere()
    return run.result()


def require_clearing(
    region: Region, radius: float, engagement: float, milling: str, step: float, allowance: float
) -> Region:
    """Region of the cutter's centre, if :func:`clear_region` can clear ``region``.

    Raises
    ------
    InputError
        As :func:`clear_region`.
    """
    if not 0.0 < radius < math.inf:
        raise InputError(f"radius = {radius:g} mm: must be above 0")
    if not math.radians(2.0) <= engagement <= math.radians(150.0):
        raise InputError(f"engagement = {math.degrees(engagement):.4g} deg: must be between 2 and 150")
    if not 0.0 < step <= 0.25 * radius:
        raise InputError(f"step = {step:g} mm: must be above 0 and at most radius / 4 = {0.25 * radius:g}")
    if not 0.0 <= allowance < math.inf:
        raise InputError(f"allowance = {allowance:g} mm: must be at least 0")
    if milling not in ("down", "up"):
        raise InputError(f"milling = {milling!r}: must be 'down' or 'up'")
    centres = centre_region(region, radius + allowance)
    if not centres.contours:
        raise InputError(f"radius = {radius:g} mm: the cutter fits nowhere into the region; take a smaller one")
    return centres


class _Run:
    """The state of one clearing: stock, path so far, places from which to continue."""

    def __init__(
        self, centres: Region, radius: float, limit: float, step: float, free: Sequence[Region], progress: Progress,
        entry: Entry,
    ) -> None:  # fmt: skip
        self.entry = entry
        xmin, ymin, xmax, ymax = centres.bounds
        self.centres, self.radius, self.step = centres, radius, step
        self.most_engaged, self.limit = limit - BETWEEN, limit - MARGIN
        self.progress = progress
        self.stock = PlanarStock((xmin - radius, ymin - radius, xmax + radius, ymax + radius), radius)
        self.reach: Reach = reach_of(centres, self.stock.grid, CHORD * radius)
        take_free(self.stock, free, radius)
        self.reachable = centre_region(centres, -radius)
        self.rows: list[Floats] = []
        self.remainder, self.taken = PocketRemainder(self.reachable, radius, free), 0
        self.whole = self.remainder.rest.area
        self.events: list[Event] = []
        self.starts = Starts(radius, step)
        self.passes = 0
        self.at = np.zeros(2)
        self.area = 0.0
        self.lately: list[tuple[float, float, float]] = []
        self.made: set[int] = set()
        self.steps = 0
        self.room = tuple(np.empty((CHUNK, columns)) for columns in (5, 8, 3))
        self.most = 100_000 + int(20.0 * self.reachable.area / (step * radius * (1.0 - math.cos(limit))))

    # -- rows -----------------------------------------------------------------------------------------------
    def add(self, points: Floats, kind: int, e_max: Floats | float = 0.0, arcs: Floats | None = None) -> None:
        """Rows of the path: x, y, kind, greatest E, pass, centre and sweep."""
        rows = np.zeros((len(points), 8))
        rows[:, 0:2], rows[:, 2], rows[:, 3] = points, kind, e_max
        rows[:, 4] = self.passes if kind == CUT else 0
        if arcs is not None:
            rows[:, 5:8] = arcs
        self.rows.append(rows)
        self.at = points[-1].copy()

    # -- moves ----------------------------------------------------------------------------------------------
    def enter(self, x: float, y: float, room: float) -> None:
        """Into the solid at the widest place, by a ramp or by a bore."""
        ends = longest_line(self.centres.flatten(1e-4 * self.radius), np.array([x, y]), LONGEST * self.radius)
        if self.entry == "ramp" and np.hypot(*(ends[1] - ends[0])) > SHORTEST * self.radius:
            self._ramp(ends)
        else:
            self._bore(x, y, room)

    def _ramp(self, ends: Floats) -> None:
        """A ramp to and fro along a straight line, to its floor and once more along it."""
        line, (x, y) = ends[::-1], ends.mean(axis=0).tolist()
        self.add(line[1:], LIFT)
        self.add(line, ENTRY, math.pi)
        self.stock.remove_segments(np.column_stack([ends[:1], ends[1:], np.zeros((1, 3))]))
        long = float(np.hypot(*(ends[1] - ends[0])))
        self.events.append(Event("pocket-entry", x, y, f"ramp of {long:.4g} mm to and fro: cuts a full slot"))
        n = max(2, math.ceil(long / self.step))
        for p, q in (ends, line):
            points = p + np.linspace(0.0, 1.0, n + 1)[:, None] * (q - p)
            self.starts.add(points, np.full(n + 1, math.atan2(*(q - p)[::-1])))

    def _bore(self, x: float, y: float, room: float) -> None:
        """A helical bore: its circle is as wide as there is room for, so that it leaves no core."""
        R = self.radius
        rh = min(BORE * R, 0.98 * room)
        n = max(12, math.ceil(2.0 * math.pi * rh / self.step))
        a = np.linspace(0.0, 2.0 * math.pi, n + 1)[1:]
        half = np.array([[x - rh, y], [x + rh, y]])
        circle = np.array([[x, y, math.pi], [x, y, math.pi]])
        self.add(half[1:], LIFT)
        self.add(half, ENTRY, math.pi, circle)
        self.stock.remove_segments(np.column_stack([half[::-1], half, circle]))
        self.events.append(
            Event("pocket-entry", x, y, f"helical bore of diameter {2.0 * (R + rh):.4g} mm: cuts a full slot")
        )
        self.starts.add(np.column_stack([x + rh * np.cos(a), y + rh * np.sin(a)]), a + 0.5 * math.pi)

    def take_earlier(self, earlier: EarlierPath) -> None:
        """Take what was cut before out of the stock, and let passes begin along its edge."""
        self.stock.remove_segments(earlier.segments)
        seg = earlier.segments
        points, breaks = separate_polylines(seg, 2.0 * CHORD * self.radius)
        self.remainder.take(points, breaks)
        self.whole = self.remainder.rest.area
        for contour in centre_region(earlier.centres, INSIDE * self.radius).contours:
            self._begin_along(*places_along(contour, self.step))

    def begin_at_edges(self, free: Sequence[Region]) -> None:
        """Let passes begin wherever the cutter may stand along the edge of free space."""
        for region in free:
            for points, headings in edge_places(region, self.radius, self.step):
                self._begin_along(points, headings)
        if len(self.starts.p):
            self.at = self.starts.p[0].copy()

    def _begin_along(self, points: Floats, headings: Floats) -> None:
        """Starts at those of some places where the cutter may be."""
        inside = np.array([self.reach.holds(x, y, self.stock.grid) for x, y in points.tolist()])
        cut = np.flatnonzero(np.diff(inside.astype(np.int64))) + 1
        for run in np.split(np.arange(len(points)), cut):
            if inside[run[0]]:
                self.starts.add(points[run], headings[run])

    def enter_elsewhere(self) -> None:
        """Bores into what no pass came to, the widest place first, as long as that clears anything."""
        allowed = self.centres.flatten(1e-4 * self.radius)
        for _ in range(ENTRIES):
            x, y, room = self._pocket_remainder().widest(allowed)
            if room < LEAST_ROOM * self.radius:
                break
            before = self.area
            self.enter(x, y, room)
            self.clear()
            if self.area - before < 1e-3 * self.radius**2:
                break

    def cut_channels(self, region: Region, allowance: float, bore: tuple[float, float, float] | None) -> None:
        """Trochoids along the middle lines that a bore (x, y, radius of its axis), or free space, leads to."""
        R = self.radius
        lines = skeleton_of(region, R + allowance + trochoid.LEAST * R, trochoid.WALLS * R)
        if not len(lines.points):
            return
        if bore is None:
            free = (k for k, p in enumerate(lines.points) if not len(self.stock.arcs(p, (1.0, 0.0), whole=True)))
            start, rho = next(free, -1), 0.0
        else:
            start, rho = int(np.argmin(np.hypot(*(lines.points - bore[:2]).T))), bore[2]
        if start < 0:
            return
        loops = Trochoid(self.stock, region, R, allowance, (self.limit, self.most_engaged))
        for k, line in enumerate(lines.branches(start)):
            path_line = line if k or bore is None else np.vstack([bore[:2], line])
            begins = rho if k == 0 else min(trochoid.WIDEST * R, 0.9 * loops.room(path_line[0]))
            places = []
            for arcs, engaged in loops.circles(path_line, begins):
                first = arcs[0, 0:2]
                clear = bool(self.rows) and self._link_to(first)
                self.add(first[None, :], LINK if clear else LIFT)
                self.passes += 1
                self.add(arcs[:, 2:4], CUT, engaged, arcs[:, 4:7])
                places.append(points_of_arcs(arcs, self.step))
                self.progress(0.0, f"trochoid, circle {self.passes}")
            if places:
                p, headings = (np.concatenate(part) for part in zip(*places, strict=True))
                self.starts.add(p, headings)

    def clear(self) -> None:
        """Passes until nothing more is found beside the path, or there are far more steps than there should be."""
        for depth in DEPTHS:
            self.starts.revive()
            while self.steps <= self.most:
                self.starts.search(self.stock, self.reach, depth)
                k = self.starts.nearest(self.at, self._link_to)
                if k is None:
                    break
                if not self._pass_from(k):
                    self.starts.drop(k)
                elif len(self.lately) >= SLOW_PASSES:
                    self._leave_if_slow()

    def _leave_if_slow(self) -> None:
        """Leave a channel hardly wider than the cutter, where pass after pass takes next to nothing."""
        took = np.array(self.lately)
        self.lately.clear()
        low, high = took[:, 1:].min(axis=0), took[:, 1:].max(axis=0)
        if took[:, 0].sum() > SLOW_AREA * SLOW_PASSES * self.radius**2 or (high - low).max() > 2.0 * self.radius:
            return
        x, y = 0.5 * (low + high)
        self.starts.abandon(np.array([x, y]), 2.0 * self.radius)
        text = (
            f"{SLOW_PASSES} passes took {number_text(took[:, 0].sum(), 3)} mm2 here, hardly wider than the "
            "cutter: the rest is left"
        )
        self.events.append(Event("pocket-narrow", float(x), float(y), text))

    def _link_to(self, p: Floats) -> bool:
        return self._clear_line(self.at, p)

    def _clear_line(self, p: Floats, q: Floats) -> bool:
        s = self.stock
        return bool(
            _pass_steps.line_clear(
                p[0],
                p[1],
                q[0],
                q[1],
                self.step,
                self.radius,
                TOUCH,
                s.grid,
                s.head,
                s.link,
                s.axis,
                s.rim,
                *self.reach.arguments(),
            )
        )

    def _pass_from(self, k: int) -> bool:
        """One pass from the start k; whether it took enough for the start to be tried again."""
        for x, y, heading in self.starts.candidates(k):
            start = np.array([x, y])
            clear = bool(self.rows) and self._link_to(start)  # of what is there before the pass
            segments, places, took, reason, at = self._pass(x, y, heading)
            if not len(segments):
                continue
            # a pass that was made before takes nothing, whatever its engagement counts
            made = hash((np.round(segments[:, 0:4], 6) + 0.0).tobytes())
            if made in self.made:
                continue
            self.made.add(made)
            if not self.rows or np.hypot(*(start - self.at)) > 1e-9:
                self.add(start[None, :], LINK if clear else LIFT)
            self.passes += 1
            self.add(segments[:, 2:4], CUT, segments[:, 7], segments[:, 4:7])
            self.area += took
            self.lately.append((took, *places[:, 0:2].mean(axis=0).tolist()))
            if reason == _pass.BLOCKED:
                text = (
                    f"pass {self.passes} stops: no direction keeps the engagement within "
                    f"{math.degrees(self.most_engaged):.4g} deg"
                )
                self.events.append(Event("pocket-blocked", float(at[0]), float(at[1]), text))
            self.starts.add(places[:, 0:2], places[:, 2])
            self.progress(min(0.99, self.area / self.whole), f"front, pass {self.passes}")
            return took > WORTH * self.radius**2
        return False

    def _pass(self, x: float, y: float, heading: float) -> tuple[Floats, Floats, float, int, Floats]:
        """One pass: its segments (m, 8), places (n, 3), mm^2 taken, why it ended, where."""
        s, R = self.stock, self.radius
        state = np.array([x, y, heading, 0.0, 0.0, 1e9])
        right = self.step / (TURN_RIGHT * R)
        segments, places, took, reason = [], [], 0.0, _pass.RUNNING
        while reason == _pass.RUNNING and self.steps <= self.most:
            s.reserve(ROOM)
            steps, made, at = self.room
            numbers = np.zeros(6)
            numbers[:2] = s.capsules, s.used
            reason = _pass.run_pass(
                state, self.step, self.limit, self.most_engaged, right, TURN_LEFT, IDLE * R,
                FIT * min(R, FIT_UP_TO), SLACK * min(R, SLACK_UP_TO), R, TOUCH, steps, made, at, numbers,
                s.grid, s.head, s.count, s.link, s.axis, s.rim, np.empty(7),
                *self.reach.arguments(),
            )  # fmt: skip
            s.capsules, s.used = int(numbers[0]), int(numbers[1])
            segments.append(made[: int(numbers[3])].copy())
            places.append(at[1 : int(numbers[2]) + 1].copy())
            took += float(numbers[4])
            self.steps += int(numbers[5])
            if reason == _pass.RUNNING:
                self.progress(min(0.99, self.area / self.whole), f"front, pass {self.passes + 1}")
        return np.vstack(segments), np.vstack(places), took, int(reason), state[0:2]

    def _pocket_remainder(self) -> PocketRemainder:
        """What the path so far has left."""
        new = self.rows[max(0, self.taken - 1) :]
        if self.taken < len(self.rows):
            rows = np.vstack(new)
            rows = rows if self.taken == 0 else rows[len(new[0]) - 1 :]
            raised = rows[:, 2] >= LIFT
            raised[0] = True
            sweep = np.where(raised, 0.0, rows[:, 7])
            points, breaks = polyline(rows[:, 0:2], rows[:, 5:7], sweep, raised, 2.0 * CHORD * self.radius)
            self.remainder.take_from(self.stock, points, breaks)
            self.taken = len(self.rows)
        return self.remainder

    # -- the end --------------------------------------------------------------------------------------------
    def result(self) -> ClearingPath:
        """The path with its areas."""
        if not self.rows:
            raise InputError("nothing is left for the cutter to clear: free space covers all that it can reach")
        rows = np.vstack(self.rows)
        kind = rows[:, 2].astype(np.int64)
        area, contours, places = self._pocket_remainder().parts()
        events = list(self.events)
        for mm2, (x, y) in places:
            events.append(Event("pocket-leftover", x, y, f"{number_text(mm2)} mm2 that the cutter can reach is left"))
        names = {"entry": ENTRY, "cut": CUT, "link": LINK, "lift": LIFT}
        whole = self.whole
        path = ClearingPath(
            x=rows[:, 0],
            y=rows[:, 1],
            centre=rows[:, 5:7],
            sweep=rows[:, 7],
            kind=kind,
            engagement_max=rows[:, 3],
            pass_number=rows[:, 4].astype(np.int64),
            events=tuple(events),
            reachable_mm2=whole,
            cleared_mm2=whole - area,
            leftover_mm2=area,
            leftover=contours,
            lengths_mm={},
        )
        return replace(path, lengths_mm={name: float(path.lengths[kind == k].sum()) for name, k in names.items()})
