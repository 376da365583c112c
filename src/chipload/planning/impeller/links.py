"""Links: proved clear moves to a track, from one track to the next, and away.

Notation: p tip [mm], T axis, N normal at the contact; alpha table angle, H(alpha) the height along T above which
nothing of the part lies, whatever the pallet angle: the part is within a body of revolution, H = max of r sin(alpha) +
z cos(alpha). With its tip above H the cutter is clear wherever it stands.

Tracks that end and begin close together are one pass: the cutter stays down between them (``passes.py``). The order of
passes keeps the time between their ends short (``pass_order.py``).

The cutter leaves a pass along N + T, T or N by the lift, and approaches one on the same line. It touches the surface
there, so these moves are checked in small steps, and may be as deep as ``touch``. The first ``lead`` of a lift is at
the feed of the cut. Where a channel is too narrow for a lift the cutter retracts along T to H at once, and may be as
deep as ``touch`` over the whole retract, which is proved. From a lift it moves straight to the lifted beginning of the
next pass where that is near and proved clear (``clearance/``), else along T to H, round above the part, and down. The
retract and the approach are along the spindle. They are rapid where they are proved clear of the allowance on the walls
too, else at the feed of links.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.planning.impeller.clearance import clearance, interpolated_axes, moves_clear
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.pass_order import pass_order
from chipload.planning.impeller.passes import Joint, Pass, join_tracks, single
from chipload.planning.impeller.scene import Floats, Ints, Scene
from chipload.planning.impeller.track import ToolTrack, pallet_of, written_angles
from chipload.program.program import LINE, RAPID

_SMALL = 24  # places at which a lift is checked
_TURN = math.radians(3.0)  # of the pallet in one row above the part
_LIFTS = (1.0, 0.5, 0.25)  # of the lift that are tried
_OVER = 0.5  # [s] of ramps and turns of the pallet on a way over the part, when ways are compared


@dataclass(frozen=True)
class Link:
    """Parameters of links between tracks.

    Parameters
    ----------
    lift : off the surface at the ends of a track [mm], > 0
    margin : that links keep from the part [mm], > 0, below the lift
    touch : how deep a lift may be in the check points [mm], >= 0; above 0 a narrow channel can be left
    near : longest direct link [mm]
    feed : of links and lifts [mm/s]
    above : of the safe height over the part [mm], > 0
    lead : of a lift that is at the feed of the cut [mm], > 0
    allowance : that may stand on the walls [mm]: rapids keep the margin from that
    rapid : speed of rapids [mm/s], by which ways are compared
    """

    lift: float
    margin: float
    touch: float
    near: float
    feed: float
    above: float
    lead: float = 1.0
    allowance: float = 0.0
    rapid: float = 400.0

    def __post_init__(self) -> None:
        if not (0.0 < self.margin < self.lift < math.inf and 0.0 <= self.touch < self.margin):
            raise InputError(
                f"link: lift {self.lift:g}, margin {self.margin:g}, touch {self.touch:g} mm: "
                "must be touch < margin < lift"
            )
        if not (self.near >= 0.0 and 0.0 < self.feed < math.inf and 0.0 < self.above < math.inf):
            raise InputError("link: must be near at least 0, feed and above above 0")
        if not (0.0 < self.lead < math.inf and 0.0 <= self.allowance < math.inf and 0.0 < self.rapid < math.inf):
            raise InputError("link: must be lead and rapid above 0, allowance at least 0")


@dataclass(frozen=True, eq=False)
class Moves:
    """Moves in columns: motion, tip (n, 3) [mm], axis (n, 3), feed [mm/s], label."""

    motion: tuple[int, ...]
    tip: Floats
    axis: Floats
    feed: Floats
    label: tuple[str, ...]

    @staticmethod
    def of(motion: int, tip: Floats, axis: Floats, feed: float, label: str) -> Moves:
        """Moves of one kind."""
        n = len(tip)
        return Moves((motion,) * n, tip, axis, np.full(n, feed), (label,) * n)

    @staticmethod
    def join(parts: list[Moves]) -> Moves:
        """Moves that follow one another."""
        return Moves(
            tuple(m for x in parts for m in x.motion), np.vstack([x.tip for x in parts]),
            np.vstack([x.axis for x in parts]), np.concatenate([x.feed for x in parts]),
            tuple(t for x in parts for t in x.label),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Linked:
    """All moves of one cutter at one table angle.

    Parameters
    ----------
    moves : from the safe height to it again
    refused : (number of the track, why) of tracks that the cutter cannot come to or leave: they are not in the moves
    direct, retracts : how many links go straight and how many over the part
    track : (n,) of each move the number of the track that it leads to, mills or leaves; -1: none
    stayed : how many links stay down on the surface
    """

    moves: Moves
    refused: tuple[tuple[int, str], ...]
    direct: int
    retracts: int
    track: Ints
    stayed: int = 0


def safe_height(points: Floats, table: float) -> float:
    """H(alpha) [mm] of points (n, 3): no point is higher along T(B) at any B.

    >>> round(safe_height(np.array([[3.0, 4.0, 2.0]]), 0.5 * np.pi), 9)
    5.0
    """
    return float((np.hypot(points[:, 0], points[:, 1]) * math.sin(table) + points[:, 2] * math.cos(table)).max())


def link_tracks(
    tracks: tuple[ToolTrack, ...],
    scene: Scene,
    cutter: CatalogueCutter,
    table: float,
    feed: float,
    how: Link,
    clear_of: float,
    label: str = "finish",
    rate: float = math.inf,
    one_way: bool = False,
    outline: Floats | None = None,
    joint: Joint | None = None,
    stages: Sequence[int] = (),
) -> Linked:
    """All tracks with their links: in the given order where ``one_way``, else in the order of :mod:`.pass_order`.

    Parameters
    ----------
    tracks : as :func:`finishing` gives them
    feed : in the tracks [mm/s]
    clear_of : clearance of neck, shank and holder [mm]
    rate : greatest of the pallet [rad/s]: rows on which it would be faster are fed more slowly
    one_way : each track in its own direction, never from its end; nothing but ways over the part is rapid
    outline : (k, 3) more points that the safe height is above, as of the blank
    joint : what the cutter mills between two tracks where it stays down; None: it does not
    stages : numbers of tracks before which all others are milled, ascending, as the first rest pass
    """
    T = axis_at(table, 0.0)
    points = scene.check if outline is None else np.vstack([scene.check, outline])
    top = safe_height(points, table) + how.above
    job = _LinkJob(scene, cutter, table, how, clear_of, top)
    passes, stayed = [single(k, t, label) for k, t in enumerate(tracks)], 0
    if joint is not None and not one_way:
        # a lifted link: both leads, both lifts, up and down again
        seconds = 2.0 * how.lead / feed + 2.0 * max(how.lift - how.lead, 0.0) / how.feed + _OVER
        passes, stayed = join_tracks(tracks, joint, seconds * feed, label)
    if not one_way:
        passes = _in_order(job, passes, stages)
    parts: list[Moves] = []
    of: list[int] = []
    refused: list[tuple[int, str]] = []
    direct = retracts = 0
    away: _Pose | None = None  # lifted pose at the end of the last pass

    def add(number: int, *moves: Moves) -> None:
        for move in moves:
            parts.append(move)
            of.extend([number] * len(move.tip))

    for one in passes:
        begin, end = job.away(one, 0), job.away(one, -1)
        if begin is None or end is None:
            why = "the cutter cannot leave the surface at its " + ("beginning" if begin is None else "end")
            refused += [(k, why) for k in one.numbers]
            continue
        first, last = int(one.of[0]), int(one.of[-1])
        short = None if away is None or one_way else job.direct(away, begin)
        if short is not None:
            add(first, Moves.of(LINE, short[0], short[1], how.feed, "link"))
            direct += 1
        else:
            over = job.over(begin.tip, begin.axis)
            if away is None:
                add(first, Moves.of(RAPID, over[None], begin.axis[None], 0.0, "link"))
            else:
                up = job.over(away.tip, away.axis)
                add(of[-1], job.along(up, away.axis, one_way or not away.free))
                add(first, job.round((up, away.axis), (over, begin.axis)))
                retracts += 1
            add(first, job.along(begin.tip, begin.axis, one_way or not begin.free))
        add(first, *(Moves.of(LINE, p[None], begin.axis[None], how.feed, "link") for p in begin.tips[-2::-1]))
        add(first, Moves.of(LINE, one.tip[:1], one.axis[:1], feed, "lead"))
        for a, b, kind in one.runs():
            add(int(one.of[a]), Moves.of(LINE, one.tip[a:b], one.axis[a:b], feed, kind))
        add(last, Moves.of(LINE, end.tips[0][None], end.axis[None], feed, "lead"))
        add(last, *(Moves.of(LINE, p[None], end.axis[None], how.feed, "link") for p in end.tips[1:]))
        away = end
    if away is not None:
        add(of[-1], job.along(job.over(away.tip, away.axis), away.axis, one_way or not away.free))
    else:
        add(-1, Moves.of(RAPID, (top * T)[None], T[None], 0.0, "link"))
    return Linked(_within_rate(Moves.join(parts), rate), tuple(refused), direct, retracts, np.array(of), stayed)


def _in_order(job: _LinkJob, passes: Sequence[Pass], stages: Sequence[int]) -> list[Pass]:
    """The passes in the order of a tour, stage after stage."""
    edges = [0, *stages, math.inf]
    out: list[Pass] = []
    for a, b in itertools.pairwise(edges):
        some = [x for x in passes if a <= x.numbers[0] < b]
        if not some:
            continue
        ends = np.array([[x.tip[0], x.tip[-1]] for x in some])
        axes = np.array([[x.axis[0], x.axis[-1]] for x in some])
        start = None if not out else (out[-1].tip[-1], out[-1].axis[-1])
        order = pass_order(ends, axes, job.top, job.how.near, job.how.feed, job.how.rapid, start)
        out += [some[k] if forth else some[k].back() for k, forth in order]
    return out


class _Pose(NamedTuple):
    """A lift off the end of a pass: its tips, the last one at its end; the axis; whether it is clear of allowances."""

    tips: tuple[Floats, ...]
    axis: Floats
    free: bool

    @property
    def tip(self) -> Floats:
        """The last tip."""
        return self.tips[-1]


@dataclass(frozen=True, eq=False)
class _LinkJob:
    scene: Scene
    cutter: CatalogueCutter
    table: float
    how: Link
    clear_of: float
    top: float

    def away(self, track: Pass, k: int) -> _Pose | None:
        """Lift off the end ``k`` of a pass, whose last tip has a clear retract; None: there is none."""
        p, T, N = track.tip[k], track.axis[k], track.normal[k]
        share = np.arange(1, _SMALL + 1)[:, None] / _SMALL
        found: _Pose | None = None
        for size in _LIFTS:
            for direction in (N + T, T, N, N + 2.0 * T, 2.0 * N + T):
                length = self.how.lift * size
                step = length * direction / np.linalg.norm(direction)
                tips = p + share * step
                got, _ = clearance(
                    self.scene, self.cutter, tips, np.tile(T, (_SMALL, 1)), self.how.lift + 1.0, self.clear_of
                )
                if got.min() < -self.how.touch or got[-1] <= self.how.margin:
                    continue
                lead = min(self.how.lead / length, 1.0)
                tips_off = (p + step,) if lead == 1.0 else (p + lead * step, p + step)
                if got[-1] > self.how.margin + self.how.allowance and self._retract_is_clear(
                    tips[-1], T, self.how.margin + self.how.allowance
                ):
                    return _Pose(tips_off, T, True)
                if found is None and self._retract_is_clear(tips[-1], T, self.how.margin):
                    found = _Pose(tips_off, T, False)
        # too narrow for a lift: up along the axis as it stands, where it may touch what it touches now
        if found is not None or not self._retract_is_clear(p, T, -self.how.touch):
            return found
        return _Pose((p + min(self.how.lead, self._rise(p, T)) * T, self.over(p, T)), T, False)

    def _rise(self, tip: Floats, axis: Floats) -> float:
        return max(self.top - float(tip @ axis), 0.0)

    def _retract_is_clear(self, tip: Floats, axis: Floats, margin: float) -> bool:
        tips = [tip, self.over(tip, axis)]
        return bool(moves_clear(self.scene, self.cutter, tips, [axis, axis], margin, self.clear_of).all())

    def over(self, tip: Floats, axis: Floats) -> Floats:
        """Tip above the part along the axis."""
        up: Floats = tip + self._rise(tip, axis) * axis
        return up

    def along(self, tip: Floats, axis: Floats, fed: bool) -> Moves:
        """Retract or approach along the axis, ``fed``: at a feed, because the blank may stand there."""
        motion, feed = (LINE, self.how.feed) if fed else (RAPID, 0.0)
        return Moves.of(motion, tip[None], axis[None], feed, "link")

    def direct(self, a: _Pose, b: _Pose) -> tuple[Floats, Floats] | None:
        """Tips and axes of a straight link, None: too far, slower than over the part, or not clear.

        The axis stays at the table angle.
        """
        far = float(np.linalg.norm(b.tip - a.tip))
        rise = self._rise(a.tip, a.axis) + self._rise(b.tip, b.axis)
        speed = self.how.rapid if a.free and b.free else self.how.feed
        if far > self.how.near or far / self.how.feed > rise / speed + _OVER:
            return None
        B0, B1 = pallet_of(self.table, a.axis), pallet_of(self.table, b.axis)
        turn = (B1 - B0 + math.pi) % math.tau - math.pi
        count = max(1, math.ceil(abs(turn) / _TURN))
        share = np.arange(1, count + 1) / count
        tips = a.tip + share[:, None] * (b.tip - a.tip)
        axes = np.vstack([axis_at(self.table, written_angles(B0 + share[:-1] * turn)).reshape(-1, 3), b.axis[None]])
        ok = moves_clear(
            self.scene, self.cutter, np.vstack([a.tip, tips]), np.vstack([a.axis, axes]), self.how.margin, self.clear_of
        )
        return (tips, axes) if ok.all() else None

    def round(self, a: tuple[Floats, Floats], b: tuple[Floats, Floats]) -> Moves:
        """Rapids above the part: the pallet turns, the cutter keeps its height."""
        B0, B1 = pallet_of(self.table, a[1]), pallet_of(self.table, b[1])
        turn = (B1 - B0 + math.pi) % math.tau - math.pi
        count = max(1, math.ceil(abs(turn) / _TURN))
        share = np.arange(1, count + 1) / count
        B = written_angles(B0 + share * turn)
        p0, p1 = _turn_point(a[0], -B0), _turn_point(b[0], -(B0 + turn))
        tips = np.array([_turn_point(p0 + s * (p1 - p0), x) for s, x in zip(share, B, strict=True)])
        tips[-1] = b[0]
        axes = axis_at(self.table, B)
        axes[-1] = b[1]
        return Moves.of(RAPID, tips, axes, 0.0, "link")


def _within_rate(moves: Moves, rate: float) -> Moves:
    """The moves, with feeds at which the pallet keeps its rate."""
    if math.isinf(rate):
        return moves
    B = np.arctan2(moves.axis[:, 1], moves.axis[:, 0])
    turn = np.abs((np.diff(B, prepend=B[:1]) + math.pi) % math.tau - math.pi)
    length = np.linalg.norm(np.diff(moves.tip, axis=0, prepend=moves.tip[:1]), axis=1)
    with np.errstate(divide="ignore"):
        most = np.where(turn > 0.0, length * rate * (1.0 - 1e-9) / np.where(turn > 0.0, turn, 1.0), np.inf)
    return replace(moves, feed=np.where((moves.feed > 0.0) & (length > 0.0), np.minimum(moves.feed, most), moves.feed))


def deepest(moves: Moves, scene: Scene, cutter: CatalogueCutter, above: float, places: int = 3) -> tuple[float, int]:
    """Least distance [mm] of the check points from the cutter at the rows and ``places`` between, and the row."""
    share = np.arange(1, places + 2) / (places + 1)
    tips = (moves.tip[:-1, None] + share[:, None] * (moves.tip[1:] - moves.tip[:-1])[:, None]).reshape(-1, 3)
    row = np.repeat(np.arange(1, len(moves.tip)), len(share))
    axes = interpolated_axes(moves.axis[row - 1], moves.axis[row], np.tile(share, len(moves.tip) - 1))
    got, _ = clearance(scene, cutter, tips, axes, 1.0, above)
    k = int(got.argmin())
    return float(got[k]), int(row[k])


def _turn_point(p: Floats, angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    out: Floats = np.array([c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]])
    return out
