"""Motions of a pocket's program, and rows of a history along them.

Notation: a **run** is the part of the program between two places where the cutter is lowered; a **piece** is a part of
a motion, with a row of the history at its end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chipload.engagement.contact import PIECES, Engagement
from chipload.geometry.contour import Region
from chipload.lazy import LateModule
from chipload.machine.feed import corner_speed, curvature_speed, limited_speed
from chipload.machine.machine import Machine
from chipload.planning.pocket.clearing_path import CUT, ENTRY, LIFT, LINK, ClearingPath, segment_lengths
from chipload.planning.pocket.free_space import take_free
from chipload.program.build import helix, plunge, rapid, retract, rows
from chipload.program.program import ARC_CCW, ARC_CW, LINE, Program
from chipload.stock.planar import PlanarStock

_replay = LateModule("chipload.planning.pocket._replay")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: kind of a motion beside those of a path: a link rises off the floor, or comes back to it
RAMP = 4
#: `pass` of a motion by its kind, of one that cuts where it does not belong to a finish pass
ZONES = {ENTRY: "entry", CUT: "pocket", LINK: "link", LIFT: "link", RAMP: "ramp"}
#: length of a ramp over its height, and the share of a link that each of its ramps takes at most
SLOPE, SHARE = 10.0, 0.25
#: greatest slope of a helical or ramped entry, where the cutter states none that is less [rad]
HELIX = math.radians(3.0)


@dataclass(frozen=True)
class Heights:
    """Heights of the tip [mm]: the floor, a link off it, the top of the stock, rapids."""

    floor: float
    link: float
    top: float
    safe: float


@dataclass(frozen=True, eq=False)
class Motions:
    """Motion after motion of a pocket's program.

    Parameters
    ----------
    segments : (n, 7) float [mm, rad], as in a contour; a LIFT begins a run and counts with its end only
    height : (n,) float [mm], of the tip at the end
    kind : (n,) int
    feed : (n,) float [mm/s], as programmed
    heights : the levels
    slope : greatest slope of entries [rad]
    """

    segments: Floats
    height: Floats
    kind: Ints
    feed: Floats
    heights: Heights
    slope: float = HELIX

    @cached_property
    def lengths(self) -> Floats:
        """Length in the plane (n,) [mm]; 0 of a LIFT."""
        return np.where(self.kind == LIFT, 0.0, segment_lengths(self.segments))

    @cached_property
    def runs(self) -> list[tuple[int, int]]:
        """First and last motion of each run."""
        first = np.flatnonzero(self.kind == LIFT)
        return list(zip(first.tolist(), [*(first[1:] - 1).tolist(), len(self.kind) - 1], strict=True))


def motions_of(path: ClearingPath, heights: Heights, feed: float, link_feed: float, slope: float = HELIX) -> Motions:
    """The motions of a path: links longer than their ramps run ``heights.link`` high, at ``link_feed`` [mm/s]."""
    rise = heights.link - heights.floor
    seg, z, kind = [], [], []
    for row, k in zip(path.segments, path.kind.tolist(), strict=True):
        p, q = row[0:2], row[2:4]
        length = float(np.hypot(*(q - p)))
        ramp = min(SLOPE * rise, SHARE * length)
        if k == LINK and rise > 0.0 and ramp >= 0.5 * SLOPE * rise:
            a, b = p + ramp / length * (q - p), q - ramp / length * (q - p)
            corners = [p, a, b, q]
            seg += [[*u, *v, 0.0, 0.0, 0.0] for u, v in pairwise(corners)]
            z += [heights.link, heights.link, heights.floor]
            kind += [RAMP, LINK, RAMP]
        else:
            seg.append(row.tolist())
            z.append(heights.floor)
            kind.append(k)
    kinds = np.array(kind, dtype=np.int64)
    speed = np.where((kinds == CUT) | (kinds == ENTRY), feed, link_feed)
    return Motions(np.array(seg), np.array(z), kinds, speed, heights, slope)


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """The rows of a history along motions, a sample at the end of each piece.

    Parameters
    ----------
    motion : (m,) int
    share : (m,) float, of the motion at the end of the piece
    centre, heading : (m, 2) float [mm], at the end
    begins : (m, 2) float, heading at the beginning
    length : (m,) float [mm], of the piece; 0 of a LIFT
    """

    motion: Ints
    share: Floats
    centre: Floats
    heading: Floats
    begins: Floats
    length: Floats


def samples_of(motions: Motions, step: float) -> MotionSamples:
    """Motions that cut in samples of at most ``step`` [mm], others whole."""
    seg, kind = motions.segments, motions.kind
    parts = np.ones(len(kind), dtype=np.int64)
    cuts = (kind == CUT) | (kind == ENTRY)
    parts[cuts] = np.maximum(1, np.ceil(motions.lengths[cuts] / step - 1e-9)).astype(np.int64)
    k = np.repeat(np.arange(len(kind)), parts)
    share = (np.arange(len(k)) - np.repeat(np.cumsum(parts) - parts, parts) + 1) / parts[k]
    centre, heading = places(seg[k], share)
    _, begins = places(seg[k], share - 1.0 / parts[k])
    still = motions.lengths[k] == 0.0
    heading[still] = begins[still] = (1.0, 0.0)
    return MotionSamples(k, share, centre, heading, begins, motions.lengths[k] / parts[k])


def places(seg: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Points (m, 2) [mm] and unit headings at the shares of segments (m, 7); heading +x of a segment without length."""
    p, q, centre, sweep = seg[:, 0:2], seg[:, 2:4], seg[:, 4:6], seg[:, 6]
    arc = sweep != 0.0
    v = p - centre
    c, s = np.cos(sweep * share), np.sin(sweep * share)
    w = np.column_stack([c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1]])
    at = np.where(arc[:, None], centre + w, p + share[:, None] * (q - p))
    at = np.where((share >= 1.0)[:, None], q, at)
    d = np.where(arc[:, None], np.sign(sweep)[:, None] * np.column_stack([-w[:, 1], w[:, 0]]), q - p)
    length = np.hypot(d[:, 0], d[:, 1])
    d[length == 0.0] = (1.0, 0.0)
    return at, d / np.where(length == 0.0, 1.0, length)[:, None]


def replay_motions(
    motions: Motions,
    samples: MotionSamples,
    radius: float,
    free: Sequence[Region] = (),
    before: Floats | None = None,
) -> tuple[Engagement, Floats]:
    """The engaged arcs at the end of every piece, from the stock as the motions before it left it, and the greatest
    engagement (m,) [rad] along it; ``free`` regions hold no material, nor does what the cutter met along the segments
    ``before`` (n, 7). O(m).
    """
    c = samples.centre
    low, high = c.min(axis=0) - 2.0 * radius, c.max(axis=0) + 2.0 * radius
    stock = PlanarStock((low[0], low[1], high[0], high[1]), radius)
    take_free(stock, free, radius)
    if before is not None:
        stock.remove_segments(before)
    m = len(c)
    angle, most, count, phi = np.zeros(m), np.zeros(m), np.zeros(m, dtype=np.int64), np.zeros((m, PIECES, 2))
    cuts = (motions.kind == CUT) | (motions.kind == ENTRY)
    first = np.flatnonzero(cuts[samples.motion])
    for block in np.array_split(first, max(1, len(first) // 1000)):
        if len(block):
            need = np.ceil(2.0 * samples.length[block] / radius) + 5.0
            stock.reserve(int(need.sum()) + 8)
            stock.capsules, stock.used = _replay.replay(
                motions.segments, samples.motion, samples.share, block, radius, angle, most, count, phi,
                stock.capsules, stock.used, stock.grid, stock.head, stock.count, stock.link, stock.axis, stock.rim,
                np.empty(7),
            )  # fmt: skip
    return Engagement(angle, count, np.clip(phi, 0.0, math.pi)), most


def speeds(motions: Motions, samples: MotionSamples, machine: Machine) -> tuple[Floats, Floats, Floats]:
    """Length [mm] along the path, speed [mm/s] and time within the run [s] at the end of every piece."""
    acceleration = machine.acceleration_xy
    t, u = samples.heading[:-1], samples.begins[1:]
    theta = np.arctan2(t[:, 0] * u[:, 1] - t[:, 1] * u[:, 0], (t * u).sum(axis=1))
    seg, k = motions.segments, samples.motion
    rho = np.hypot(seg[:, 0] - seg[:, 4], seg[:, 1] - seg[:, 5])
    bend = np.where(seg[:, 6] == 0.0, 0.0, 1.0 / np.where(seg[:, 6] == 0.0, 1.0, rho))
    within = np.minimum(motions.feed, curvature_speed(bend, acceleration))[k]
    limit = np.minimum(within, np.append(within[1:], np.inf))
    limit = np.minimum(limit, np.append(corner_speed(theta, acceleration, machine.corner_tolerance), np.inf))
    length = np.cumsum(samples.length)
    speed, time = np.zeros(len(k)), np.zeros(len(k))
    for a, b in runs_of(motions, samples):
        if b > a:
            speed[a : b + 1], time[a : b + 1] = limited_speed(
                length[a : b + 1] - length[a], limit[a : b + 1], acceleration, between=within[a + 1 : b + 1]
            )
    return length, speed, time


def runs_of(motions: Motions, samples: MotionSamples) -> list[tuple[int, int]]:
    """First and last piece of each run."""
    first = np.searchsorted(samples.motion, [a for a, _ in motions.runs])
    return list(zip(first.tolist(), [*(first[1:] - 1).tolist(), len(samples.motion) - 1], strict=True))


def clock(motions: Motions, samples: MotionSamples, time: Floats, programs: list[Program], ends: Floats) -> Floats:
    """Time at the end of every piece [s], (m,), counted like that at the ends of the program's rows; of a LIFT the time
    when the cutter is down again.

    Within a motion each piece takes its time at the feed. What the program takes longer is shared as the planned
    slowing down; a motion that a rounded corner shortens is faster in equal shares. The program of a run ends with its
    motions and the way up.

    Parameters
    ----------
    time : (m,) at the end of every piece within its run, as planned [s]
    ends : (n,) at the end of every row of all programs [s]
    """
    out, first = np.zeros(len(samples.motion)), 0
    last_piece = np.append(samples.motion[1:] != samples.motion[:-1], True)
    for (a, b), (i, j), program in zip(motions.runs, runs_of(motions, samples), programs, strict=True):
        first += len(program)
        at = ends[first - 2 - (b - a) : first - 1]
        own, last = time[i : j + 1], np.flatnonzero(last_piece[i : j + 1])
        at_feed = samples.length[i : j + 1] / motions.feed[samples.motion[i : j + 1]]
        at_feed[0] = 0.0
        slow = np.clip(np.diff(own, prepend=own[0]) - at_feed, 0.0, None)
        begin = np.concatenate([[0], last[:-1] + 1])
        whole, planned = (np.add.reduceat(v, begin) for v in (at_feed, slow))
        spare = np.diff(at, prepend=at[0]) - whole
        late = (spare > 0.0) & (planned > 0.0)
        by_feed = np.divide(spare, whole, out=np.zeros(len(begin)), where=(whole > 0.0) & ~late)
        by_slow = np.divide(spare, planned, out=np.zeros(len(begin)), where=late)
        count = np.diff(begin, append=len(own))
        out[i : j + 1] = at[0] + np.cumsum(at_feed * np.repeat(1.0 + by_feed, count) + slow * np.repeat(by_slow, count))
    return out


def bore_turns(radius: float, depth: float, slope: float) -> int:
    """Turns of a helical bore ``depth`` [mm] deep, the axis on a circle of ``radius`` [mm], at most ``slope`` [rad]."""
    return max(1, math.ceil(depth / (math.tau * radius * math.tan(slope)) - 1e-9))


def ramp_strokes(length: float, depth: float, slope: float) -> int:
    """Legs of a ramp to and fro ``depth`` [mm] deep along a line of ``length`` [mm], at most ``slope`` [rad]: an even
    number of them.
    """
    return 2 * max(1, math.ceil(depth / (2.0 * length * math.tan(slope)) - 1e-9))


def entries(motions: Motions, depth: float) -> tuple[float, float]:
    """Greatest axial depth [mm] of any entry and greatest slope [rad]; the depth is what a turn of a bore goes down, or
    two legs of a ramp where it turns.
    """
    first = np.array([a + 1 for a, b in motions.runs if b > a and motions.kind[a + 1] == ENTRY])
    seg = motions.segments[first]
    radii = np.hypot(seg[:, 0] - seg[:, 4], seg[:, 1] - seg[:, 5])
    straight = np.hypot(seg[:, 2] - seg[:, 0], seg[:, 3] - seg[:, 1])
    down = [
        (depth / bore_turns(r, depth, motions.slope), math.tau * r)
        if sweep
        else (2.0 * depth / ramp_strokes(line, depth, motions.slope), 2.0 * line)
        for r, line, sweep in zip(radii.tolist(), straight.tolist(), seg[:, 6].tolist(), strict=True)
    ]
    return max(z for z, _ in down), max(math.atan2(z, along) for z, along in down)


def _bore(
    at: Floats, seg: Floats, heights: tuple[float, float], slope: float, feed: float, spindle: float, tool: int
) -> Program:
    """Turns around the centre of an arc ``seg`` (7,), from one height evenly down to the other."""
    x, y, sweep = seg[4:7].tolist()
    depth = heights[0] - heights[1]
    pitch = depth / bore_turns(math.hypot(at[0] - x, at[1] - y), depth, slope)
    sense: Literal[1, -1] = 1 if sweep > 0.0 else -1
    return helix(at, (x, y), heights, pitch, feed, spindle, tool, "entry", sense=sense, level=False)


def _ramp(
    at: Floats, seg: Floats, heights: tuple[float, float], slope: float, feed: float, spindle: float, tool: int
) -> Program:
    """Legs to and fro along a line ``seg`` (7,), from one height evenly down to the other, the last back to ``at``."""
    strokes = ramp_strokes(float(np.hypot(*(seg[2:4] - at))), heights[0] - heights[1], slope)
    z = np.linspace(*heights, strokes + 1)[1:]
    to = np.where((np.arange(strokes) % 2 == 0)[:, None], seg[2:4], at)
    line = np.full(strokes, LINE)
    return rows(line, np.column_stack([to, z]), np.zeros((strokes, 2)), np.full(strokes, feed), spindle, tool, "entry")


def programs_of(
    motions: Motions, setting_feed: float, spindle: float, tool: int, zone: str = ZONES[CUT]
) -> list[Program]:
    """A program a run: rapid above the stock, helical bore from its top or straight down where it is clear, the motions
    at depth, up. ``zone`` is the label of those that cut.
    """
    h, out, zones = motions.heights, [], {**ZONES, CUT: zone}
    for a, b in motions.runs:
        seg = motions.segments[a + 1 : b + 1]
        at = motions.segments[a, 2:4]
        parts = [rapid([*at, h.safe], spindle, tool, "link")]
        if b > a and motions.kind[a + 1] == ENTRY:
            parts.append(plunge([*at, h.top], setting_feed, spindle, tool, "entry"))
            descend = _ramp if seg[0, 6] == 0.0 else _bore
            parts.append(descend(at, seg[0], (h.top, h.floor), motions.slope, setting_feed, spindle, tool))
        else:
            parts.append(plunge([*at, h.floor], motions.feed[a], spindle, tool, "entry"))
        for first, last, name in _stretches([zones[int(k)] for k in motions.kind[a + 1 : b + 1]]):
            part, sweep = seg[first:last], seg[first:last, 6]
            motion = np.where(sweep == 0.0, LINE, np.where(sweep > 0.0, ARC_CCW, ARC_CW))
            to = np.column_stack([part[:, 2:4], motions.height[a + 1 + first : a + 1 + last]])
            feed = motions.feed[a + 1 + first : a + 1 + last]
            parts.append(rows(motion, to, part[:, 4:6], feed, spindle, tool, name))
        x, y = motions.segments[b, 2:4]
        parts.append(retract([x, y, h.safe], spindle, tool, "link"))
        out.append(Program.join(parts))
    return out


def _stretches(names: list[str]) -> list[tuple[int, int, str]]:
    """(first, last + 1, name) of equal neighbours."""
    cut = [0, *(k for k in range(1, len(names)) if names[k] != names[k - 1]), len(names)]
    return [(a, b, names[a]) for a, b in pairwise(cut) if b > a]
