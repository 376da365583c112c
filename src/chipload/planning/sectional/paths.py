"""Finishing paths of a patch: lines that leave a scallop of the same height between them.

Notation: a line runs along one parameter p of the surface at q(p) of the other; d its direction, N normal, e = N x d; h
height of the scallop. The next line lies at the step w across e, q + w / (S_q.e) with the derivative half-way; w is how
far the pass reaches below h on this side and how far the next one does on its own (``cusp.py``), then mended until
the crest between the poses of both (``crest.py``) is as high as aimed. The next line's pallet angles are not known before
it lies: they are first taken for those of this line.

The pallet angles of a line come from the exact ranges at its points (``pallet.py``). Points without a range are left
out and told; the line is split there. A line that reaches the border of the patch ends there; a part of a line along
the border is the last.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, minimum_filter1d

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import Patch
from chipload.planning.sectional.closed import axis_at
from chipload.planning.sectional.crest import crests, shares
from chipload.planning.sectional.cusp import reaches
from chipload.planning.sectional.mend import Mender
from chipload.planning.sectional.pallet import Turned, pallet_angles
from chipload.planning.sectional.ranges.ranges import FULL, valid_ranges
from chipload.planning.sectional.scene import Floats, Ints, Scene
from chipload.planning.sectional.track import Track, posed
from chipload.progress import Progress, silent

#: points of a line whose pallet angles are looked for together, and how far from those of the line before [rad]
_GROUP, _WINDOW = 6, math.radians(20.0)
_MENDS, _ROUNDS, _FINE = 3, 12, 0.5
#: stations and halvings by which the first line that is reached is looked for
_KNOTS, _BISECT = 17, 4
_LINES = 5000

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Finish:
    """How a patch is finished.

    Parameters
    ----------
    scallop : greatest height h [mm]
    chord : greatest distance of the tip from its path between two points [mm]
    feed : of the tip [mm/s]
    rate : greatest of the pallet [rad/s]
    clearance : of neck, shank and holder [mm]
    wanted : [rad] by which the pallet keeps away from the ends of its ranges, where they are wide enough
    aim : share of h that the step is laid out for; the rest is for what is not of second order
    """

    scallop: float
    chord: float
    feed: float
    rate: float
    clearance: float
    wanted: float = math.radians(4.0)
    aim: float = 0.95

    def __post_init__(self) -> None:
        for name, unit in (("scallop", "mm"), ("chord", "mm"), ("feed", "mm/s"), ("rate", "rad/s")):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InputError(f"finish.{name} = {value:g} {unit}: must be above 0")
        if not (0.0 <= self.clearance < math.inf and 0.0 < self.aim <= 1.0 and 0.0 <= self.wanted < math.inf):
            raise InputError("finish: must be clearance and wanted at least 0, aim above 0, at most 1")


@dataclass(frozen=True)
class Missed:
    """Points of a line that the cutter does not reach: from ``first`` to ``last`` (u, v), ``length`` [mm].

    ``reason``: `no pallet angle` is valid there, the pallet `cannot follow` from the point before in time, or the row
    between two points `touches` the part.
    """

    line: int
    first: tuple[float, float]
    last: tuple[float, float]
    length: float
    reason: str


@dataclass(frozen=True, eq=False)
class Tracks:
    """What one cutter mills on one surface at one table angle.

    Parameters
    ----------
    tracks : in the order of the lines
    missed : what is not reached, and where lines are split
    lines : how many lines there are
    """

    tracks: tuple[Track, ...]
    missed: tuple[Missed, ...]
    lines: int

    @property
    def length(self) -> float:
        """Of the paths in the cut [mm]."""
        return math.fsum(t.length for t in self.tracks)


@dataclass(frozen=True, eq=False)
class _Line:
    """A line at the stations: (u, v), S, N, K, its direction, the pieces with B, B at every station (nan: none)."""

    q: Floats
    at: Floats
    S: Floats
    N: Floats
    K: Floats
    d: Floats
    pieces: tuple[Turned, ...]
    pallet: Floats


def finishing(
    surface: Patch,
    along: str,
    box: tuple[tuple[float, float], tuple[float, float]],
    scene: Scene,
    number: int,
    cutter: CatalogueCutter,
    table: float,
    how: Finish,
    pallets: tuple[tuple[float, float], ...] = FULL,
    workers: int = 1,
    progress: Progress = silent,
) -> Tracks:
    """Tracks over a part of a surface at constant scallop.

    Parameters
    ----------
    along : `u` or `v`, the parameter that the lines run along
    box : (low, high) of u, (low, high) of v, within 0..1
    scene : its check points; its contact points are not looked at
    number : of the surface among those of the check points
    table : alpha [rad]
    pallets : (k, 2) [rad] where B may be
    """
    if along not in ("u", "v"):
        raise InputError(f"along = {along!r}: must be u or v")
    P, Q = box if along == "u" else box[::-1]
    if not (0.0 <= P[0] < P[1] <= 1.0 and 0.0 <= Q[0] < Q[1] <= 1.0):
        raise InputError(f"box = {box}: must be ascending, within 0..1")
    p = np.linspace(*P, _stations(surface, along, P, Q, how.chord))
    job = _Job(surface, along, p, scene, number, cutter, table, how, pallets, workers)
    tracks: list[Track] = []
    missed: list[Missed] = []
    q = job.first(Q)
    line = job.line(q, np.full(len(p), np.nan))
    if (q > Q[0]).any():
        missed.append(job.strip(q, Q[0]))
    use = np.ones(len(p), dtype=np.bool_)
    for number_of in range(_LINES):
        new, gone = job.tracks(line, use, number_of)
        tracks += new
        missed += gone
        progress(float(np.clip((line.q.min() - Q[0]) / (Q[1] - Q[0]), 0.0, 1.0)), f"{number_of + 1} lines")
        open_ = line.q < Q[1]
        if not open_.any():
            return Tracks(tuple(tracks), tuple(missed), number_of + 1)
        line = job.next(line, Q[1])
        # where the line before has reached the border there is nothing left
        use = (
            open_ | np.roll(open_, 1) & (np.arange(len(p)) > 0) | np.roll(open_, -1) & (np.arange(len(p)) < len(p) - 1)
        )
    raise InputError(f"finish.scallop = {how.scallop:g} mm: more than {_LINES} lines: raise it")


def _stations(surface: Patch, along: str, P: tuple[float, float], Q: tuple[float, float], chord: float) -> int:
    """Points of a line, so that its chords are within a half of ``chord`` of the surface."""
    lines = np.linspace(*Q, 5)
    for count in (9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513):
        p = np.linspace(*P, 2 * count - 1)
        worst = 0.0
        for q in lines:
            S = surface.at(p, q) if along == "u" else surface.at(q, p)
            middle = 0.5 * (S[:-2:2] + S[2::2])
            worst = max(worst, float(np.linalg.norm(S[1::2] - middle, axis=1).max()))
        if worst <= 0.5 * chord:
            return count
    raise InputError(f"finish.chord = {chord:g} mm: more than 513 points a line: raise it")


@dataclass(frozen=True, eq=False)
class _Job:
    surface: Patch
    along: str
    p: Floats
    scene: Scene
    number: int
    cutter: CatalogueCutter
    table: float
    how: Finish
    pallets: tuple[tuple[float, float], ...]
    workers: int

    def line(self, q: Floats, before: Floats) -> _Line:
        """The line at q, its pallet angles near those of the line ``before`` where there are any."""
        S, N, K, d, at = self._on(q)
        scene = self.scene.milled_at(S, N, K, self.number)
        step = np.linalg.norm(np.diff(S, axis=0), axis=1)
        most = self.how.rate * step / self.how.feed
        pieces = pallet_angles(self._ranges(scene, before), step, most, self.how.wanted, before)
        if any(a.last == b.first for a, b in itertools.pairwise(pieces)):
            # a line that can be followed with other angles than those of the line before
            ranges = self._valid(scene, np.arange(len(q)), self.pallets)
            pieces = min((pieces, pallet_angles(ranges, step, most, self.how.wanted)), key=len)
        pallet = np.full(len(q), np.nan)
        for piece in pieces:
            pallet[piece.first : piece.last] = piece.pallet
        return _Line(q, at, S, N, K, d, pieces, pallet)

    @property
    def mender(self) -> Mender:
        return Mender(
            self.surface, self.scene, self.number, self.cutter, self.table, self.how.chord, self.how.clearance
        )

    def first(self, Q: tuple[float, float]) -> Floats:
        """Where the first line lies: at the border, or where the cutter first reaches the surface, evened out."""
        knots = np.unique(np.linspace(0, len(self.p) - 1, min(len(self.p), _KNOTS)).round().astype(int))
        low, high = np.full(len(knots), Q[0]), np.full(len(knots), np.nan)
        for f in np.concatenate([[0.0], np.geomspace(0.02, 0.6, 9)]):
            open_ = np.isnan(high)
            if not open_.any():
                break
            q = np.full(len(knots), Q[0] + f * (Q[1] - Q[0]))
            got = self._reached(knots[open_], q[open_])
            high[np.flatnonzero(open_)[got]] = q[0]
            low[np.flatnonzero(open_)[~got]] = q[0]
        some = np.isfinite(high) & (high > Q[0])
        for _ in range(_BISECT if some.any() else 0):
            q = 0.5 * (low[some] + high[some])
            got = self._reached(knots[some], q)
            high[some] = np.where(got, q, high[some])
            low[some] = np.where(got, low[some], q)
        known = np.isfinite(high)
        if not known.any() or not some.any():
            return np.full(len(self.p), Q[0])
        q = np.interp(self.p, self.p[knots[known]], high[known])
        return np.minimum(np.maximum(gaussian_filter1d(maximum_filter1d(q, 3), 1.0, mode="nearest"), q), Q[1])

    def strip(self, q: Floats, border: float) -> Missed:
        """What lies between the border and the first line."""
        k, edge = int(q.argmax()), (self._on(np.full(len(q), border)))
        length = float(np.linalg.norm(np.diff(edge[0], axis=0), axis=1).sum())
        (a, b), (c, d) = edge[4][0].tolist(), self._on(q)[4][k].tolist()
        return Missed(-1, (a, b), (c, d), length, "no pallet angle")

    def _reached(self, stations: Ints, q: Floats) -> Flags:
        u, v = (self.p[stations], q) if self.along == "u" else (q, self.p[stations])
        S, N, K = (f(u, v) for f in (self.surface.at, self.surface.normal, self.surface.curvature))
        scene = self.scene.milled_at(S, N, K, self.number)
        got = self._valid(scene, np.arange(len(stations)), self.pallets)
        return np.array([len(r) > 0 for r in got])

    def next(self, line: _Line, end: float) -> _Line:
        """The next line towards ``end``, so that the scallop between is as high as asked.

        The step is first laid out for the pallet angles of this line, then for those of the new one.
        """
        ahead, behind = self._reach(line)
        w = self._even(ahead + behind)
        B, out = line.pallet, line
        for _ in range(_MENDS):
            w = self._step(line, w, B)
            out = self.line(self._moved(line, w, end), B)
            crest = self._crest(line, out.q, out.pallet)
            off = crest > self.how.scallop * (0.5 + 0.5 * self.how.aim)
            if not off.any() or not np.isfinite(out.pallet).any():
                break
            B = out.pallet
        return out

    def _moved(self, line: _Line, w: Floats, end: float) -> Floats:
        out: Floats = np.minimum(line.q + self._dq(line, w), end)
        return out

    def _step(self, line: _Line, w: Floats, pallet: Floats) -> Floats:
        """The step at which the crest is as high as aimed, if the next line is milled at these pallet angles."""
        aim = self.how.aim * self.how.scallop
        for _ in range(_ROUNDS):
            crest = self._crest(line, self._moved(line, w, 1.0), pallet)
            ratio = np.clip(np.sqrt(aim / np.clip(crest, 0.1 * aim, None)), 0.6, 1.3)
            if not np.isfinite(ratio).any() or (np.nanmin(ratio) > 0.99 and np.nanmax(ratio) < 1.03):
                break
            w = np.minimum(self._even(np.where(np.isfinite(ratio), w * ratio, np.nan)), self.cutter.rho + self.cutter.corner_radius)
        return w

    def _crest(self, line: _Line, q: Floats, pallet: Floats) -> Floats:
        """(n,) crest between a line and one at q, the highest near each station; nan: one of them is not milled."""
        n = len(q)
        length = float(np.linalg.norm(np.diff(line.S, axis=0), axis=1).mean())
        sub = 2 * max(1, math.ceil(0.5 * length / _FINE))
        at = np.arange((n - 1) * sub + 1) / sub
        p, q0, q1 = (np.interp(at, np.arange(n), x) for x in (self.p, line.q, q))
        B0, B1 = (_blended(x, at) for x in (line.pallet, pallet))
        share = shares()
        P, Q = np.repeat(p, len(share)), (q0[:, None] + share * (q1 - q0)[:, None]).ravel()
        points, normals = (x.reshape(len(at), len(share), 3) for x in self._facing(P, Q))
        one, two = self._poses(*self._facing(p, q0), B0), self._poses(*self._facing(p, q1), B1)
        fine = crests(points, normals, (one[0], two[0]), (one[1], two[1]), self.cutter.rho, self.cutter.corner_radius)
        near = np.pad(np.where(np.isfinite(fine), fine, -np.inf), sub // 2, constant_values=-np.inf)
        worst = np.array([near[k * sub : k * sub + sub + 1].max() for k in range(n)])
        return np.where(np.isfinite(line.pallet) & np.isfinite(pallet) & np.isfinite(worst), worst, np.nan)

    def _facing(self, p: Floats, q: Floats) -> tuple[Floats, Floats]:
        u, v = (p, q) if self.along == "u" else (q, p)
        return self.surface.at(u, v), self.surface.normal(u, v)

    def _poses(self, S: Floats, N: Floats, pallet: Floats) -> tuple[Floats, Floats]:
        known = np.isfinite(pallet)
        tip, axis = posed(S, N, self.table, np.where(known, pallet, 0.0), self.cutter)
        return np.where(known[:, None], tip, np.nan), np.where(known[:, None], axis, np.nan)

    def tracks(self, line: _Line, use: Flags, number: int) -> tuple[list[Track], list[Missed]]:
        """Tracks of the pieces of a line where it is in ``use``, and what is missed."""
        tracks: list[Track] = []
        missed: list[Missed] = []
        covered = np.zeros(len(use), dtype=np.bool_)
        ways = self.mender
        for piece in line.pieces:
            for a, b in _runs(use[piece.first : piece.last]):
                i, j = piece.first + a, piece.first + b
                covered[i:j] = True
                at, B = [*line.at[i:j]], [*piece.pallet[a:b]]
                for k, there in ((0, i - 1), (len(at), j)):
                    open_ = 0 <= there < len(use) and use[there] and not math.isfinite(line.pallet[there])
                    end = at[0] if k == 0 else at[-1]
                    more = ways.furthest(end, B[0 if k == 0 else -1], line.at[there]) if open_ else None
                    if more is not None:
                        at.insert(k and len(at), more[0])
                        B.insert(k and len(B), more[1])
                if len(at) < 2:
                    continue
                parts, bad = ways.mended(ways.track(np.array(at), np.array(B), number))
                tracks += parts
                if len(bad):
                    k = i + min(int(bad[0]), j - i - 1)
                    missed.append(self._missed(line, number, k, min(k + 1, j - 1), "touches"))
        missed += [
            self._missed(line, number, max(a - 1, 0), min(b, len(use) - 1), "no pallet angle")
            for a, b in _runs(use & ~covered)
        ]
        joints = [x.last for x, y in zip(line.pieces[:-1], line.pieces[1:], strict=True) if x.last == y.first]
        missed += [self._missed(line, number, k - 1, k, "cannot follow") for k in joints if use[k - 1] and use[k]]
        return tracks, missed

    def _missed(self, line: _Line, number: int, i: int, j: int, reason: str) -> Missed:
        length = float(np.linalg.norm(np.diff(line.S[i : j + 1], axis=0), axis=1).sum())
        (a, b), (c, d) = line.at[i].tolist(), line.at[j].tolist()
        return Missed(number, (a, b), (c, d), length, reason)

    def _on(self, q: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        u, v = (self.p, q) if self.along == "u" else (q, self.p)
        Sp, Sq = (self.surface.at(u, v, *x) for x in (((1, 0), (0, 1)) if self.along == "u" else ((0, 1), (1, 0))))
        d = Sp + np.gradient(q, self.p)[:, None] * Sq
        d /= np.linalg.norm(d, axis=1)[:, None]
        return (
            self.surface.at(u, v),
            self.surface.normal(u, v),
            self.surface.curvature(u, v),
            d,
            np.column_stack([u, v]),
        )

    def _ranges(self, scene: Scene, before: Floats) -> tuple[Floats, ...]:
        """Ranges of every point, near the angles of the line ``before`` first, else everywhere."""
        n = len(before)
        out: list[Floats] = [np.zeros((0, 2))] * n
        left = np.ones(n, dtype=np.bool_)
        for a in range(0, n, _GROUP):
            group = np.arange(a, min(a + _GROUP, n))
            known = before[group]
            if not np.isfinite(known).all():
                continue
            low, high = known.min() - _WINDOW, known.max() + _WINDOW
            spans = _within(low, high, self.pallets)
            if high - low > math.pi or not spans:
                continue
            got = self._valid(scene, group, spans)
            for k, r in zip(group, got, strict=True):
                out[k], left[k] = r, not len(r)
        rest = np.flatnonzero(left)
        if len(rest):
            for k, r in zip(rest, self._valid(scene, rest, self.pallets), strict=True):
                out[k] = r
        return tuple(out)

    def _valid(self, scene: Scene, points: Ints, spans: tuple[tuple[float, float], ...]) -> tuple[Floats, ...]:
        got = valid_ranges(scene, self.cutter, self.table, self.how.clearance, spans, points, workers=self.workers)
        return got.ranges

    def _reach(self, line: _Line) -> tuple[Floats, Floats]:
        """How far a line reaches towards a growing q and against it; nan where it has no pallet angle."""
        ahead, behind = np.full(len(line.q), np.nan), np.full(len(line.q), np.nan)
        k = np.flatnonzero(np.isfinite(line.pallet))
        if len(k):
            T = axis_at(self.table, line.pallet[k])
            a, b = reaches(
                line.N[k], T, line.d[k], line.K[k], self.cutter.rho, self.cutter.corner_radius,
                self.how.aim * self.how.scallop,
            )  # fmt: skip
            left = self._sign(line)[k] > 0.0
            ahead[k], behind[k] = np.where(left, a, b), np.where(left, b, a)
        return ahead, behind

    def _sign(self, line: _Line) -> Floats:
        """(n,) S_q.e: mm across the line for a growth of q by 1."""
        return self._across(line, line.q)

    def _across(self, line: _Line, q: Floats) -> Floats:
        u, v = (self.p, q) if self.along == "u" else (q, self.p)
        Sq = self.surface.at(u, v, *((0, 1) if self.along == "u" else (1, 0)))
        out: Floats = (Sq * np.cross(line.N, line.d)).sum(axis=1)
        return out

    def _even(self, w: Floats) -> Floats:
        """Steps without jumps along the line, nowhere above those given; where there are none, of the nearest."""
        known = np.flatnonzero(np.isfinite(w))
        if len(known) == 0:
            r, h = self.cutter.corner_radius, self.how.scallop
            return np.full(len(w), 2.0 * math.sqrt(2.0 * max(r, h) * h))
        near = known[np.abs(known[None] - np.arange(len(w))[:, None]).argmin(axis=1)]
        out: Floats = np.minimum(gaussian_filter1d(minimum_filter1d(w[near], 3), 1.0, mode="nearest"), w[near])
        return out

    def _dq(self, line: _Line, w: Floats) -> Floats:
        first = w / np.abs(self._across(line, line.q))
        middle = np.clip(line.q + 0.5 * first, 0.0, 1.0)
        out: Floats = w / np.abs(self._across(line, middle))
        return out


def _blended(pallet: Floats, at: Floats) -> Floats:
    """Pallet angles between stations; nan next to a station that has none."""
    i = np.minimum(at.astype(np.int64), len(pallet) - 2)
    w = at - i
    turn = pallet[i + 1] - pallet[i]
    turn = turn - math.tau * np.round(turn / math.tau)
    out: Floats = pallet[i] + w * turn
    return np.where(w == 0.0, pallet[i], np.where(w == 1.0, pallet[i + 1], out))


def _runs(flags: Flags) -> list[tuple[int, int]]:
    """(first, after the last) of each run of True."""
    edge = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int64), [0]])))
    return [(int(a), int(b)) for a, b in zip(edge[::2], edge[1::2], strict=True)]


def _within(low: float, high: float, pallets: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Parts of low..high, taken round by whole turns, that lie in the ``pallets``."""
    out = []
    for a, b in pallets:
        first = math.ceil((a - high) / math.tau)
        for turn in range(first, first + 3):
            x, y = max(a, low + math.tau * turn), min(b, high + math.tau * turn)
            if y > x:
                out.append((x, y))
    return tuple(sorted(out))
