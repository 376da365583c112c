"""Lines on a surface: their places, the valid pallet angles on them, their tracks, and the spans that are not reached.

Notation: a line runs along one parameter p of the surface, at fixed stations, at q(p) of the other. The pallet angles
come from the exact ranges at its stations (``pallet.py``), searched first near those of the line before. Where a line
comes to a point that is not reached, its end is found by bisection. Points are added where a straight row would leave
the path (``refinement.py``).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import scipy
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.pallet import Turned, pallet_angles
from chipload.planning.impeller.pallet_ranges import valid_ranges
from chipload.planning.impeller.refinement import Refinement
from chipload.planning.impeller.scene import Floats, Ints, Scene
from chipload.planning.impeller.step_over import contact_of, width
from chipload.planning.impeller.steps import Flags, runs
from chipload.planning.impeller.track import ToolTrack, pose_cutter, written_angles

#: points of a line whose pallet angles are searched together, and greatest distance from those of the line before [rad]
_GROUP, _WINDOW = 6, math.radians(10.0)
#: width about an angle that meets a wall within which ranges are exact, and the narrowest range [rad]
_EXACT, _LEAST = math.radians(12.0), 1e-9
#: stations and bisections in the search for the first line that is reached
_KNOTS, _BISECT = 17, 4
#: where n is within this of 1, the axis is along the normal and there is no step-over
_FLAT = 1e-9


@dataclass(frozen=True)
class LineMotion:
    """Motion data of lines: feed, tolerances and clearance.

    Parameters
    ----------
    chord : greatest distance of the tip from its path between two points [mm]
    feed : feed of the tip [mm/s]
    rate : greatest angular speed of the pallet [rad/s]
    clearance : of neck, shank and holder [mm]
    wanted : distance [rad] of the pallet from the ends of its ranges, where they are wide enough
    scallop : height [mm] for which angles with a wide step-over are preferred; None: no preference, as in roughing
    """

    chord: float
    feed: float
    rate: float
    clearance: float
    wanted: float = math.radians(4.0)
    scallop: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("chord", "mm"), ("feed", "mm/s"), ("rate", "rad/s")):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InputError(f"{name} = {value:g} {unit}: must be above 0")
        if not (0.0 <= self.clearance < math.inf and 0.0 <= self.wanted < math.inf):
            raise InputError("motion: clearance and wanted must be at least 0")


@dataclass(frozen=True)
class UnreachedSpan:
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
    """Tracks of one cutter on one surface at one table angle.

    Parameters
    ----------
    tracks : in the order of the lines
    missed : spans that are not reached, and places at which lines are split
    lines : number of lines
    """

    tracks: tuple[ToolTrack, ...]
    missed: tuple[UnreachedSpan, ...]
    lines: int

    @property
    def length(self) -> float:
        """Length of the paths in the cut [mm]."""
        return math.fsum(t.length for t in self.tracks)


@dataclass(frozen=True, eq=False)
class Line:
    """A line at the stations: (u, v), S, N, K, its direction d and e = N x d, the sections with B, B at every station
    (nan: none), and the length (n - 1,) [mm] from station to station.
    """

    q: Floats
    at: Floats
    S: Floats
    N: Floats
    K: Floats
    d: Floats
    e: Floats
    size: Floats
    sections: tuple[Turned, ...]
    pallet: Floats


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of one cutter on one surface at one table angle.

    Parameters
    ----------
    surface, along, scene, number, cutter, table, pallets : as for :func:`finishing`
    p : (n,) the stations, values of the parameter ``along``
    sign : 1; -1: all places q are those of the surface with the sign turned, so that lines follow each other from its
        high border to its low one
    """

    surface: BSplinePatch
    along: str
    p: Floats
    scene: Scene
    number: int
    cutter: CatalogueCutter
    table: float
    how: LineMotion
    pallets: tuple[tuple[float, float], ...]
    workers: int
    sign: float = 1.0

    def places(self, p: Floats, q: Floats) -> tuple[Floats, Floats]:
        """Parameters u and v of the surface."""
        q = self.sign * q
        return (p, q) if self.along == "u" else (q, p)

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the surface as places q."""
        return min(0.0, self.sign), max(0.0, self.sign)

    @property
    def refinement(self) -> Refinement:
        """Refinement of the tracks: it adds points between those of a track."""
        return Refinement(
            self.surface, self.scene, self.number, self.cutter, self.table, self.how.chord, self.how.clearance
        )

    def line(self, q: Floats, before: Floats) -> Line:
        """The line at q, with pallet angles near those (n,) of the line ``before`` where these are known."""
        S, N, K, d, at = self.on(q)
        scene = self.scene.at_contacts(S, N, K, self.number)
        step = np.linalg.norm(np.diff(S, axis=0), axis=1)
        widths = partial(self._widths, N, K, d)
        pieces = self._line_sections(scene, step, before, widths)
        if np.isfinite(before).any() and any(a.last == b.first for a, b in itertools.pairwise(pieces)):
            # other angles than those of the line before may give a line with fewer pieces
            free = np.full(len(q), np.nan)
            pieces = min((pieces, self._line_sections(scene, step, free, widths)), key=len)
        pallet = np.full(len(q), np.nan)
        for piece in pieces:
            pallet[piece.first : piece.last] = piece.pallet
        return Line(q, at, S, N, K, d, np.cross(N, d), step, pieces, pallet)

    def _line_sections(
        self, scene: Scene, step: Floats, before: Floats, widths: Callable[[Ints, Floats], Floats]
    ) -> tuple[Turned, ...]:
        """Pieces of a line with their pallet angles, near those ``before``, from the ranges at the check points.

        Where the cutter at such an angle meets a wall between check points, exact ranges replace those about that
        angle; a station that then has no range is searched at all angles.
        """
        most = self.how.rate * step / self.how.feed
        plain = replace(scene, covering=None, known=scene.tree)
        ranges = list(self._ranges(plain, before))
        exact: list[list[float]] = [[] for _ in ranges]
        whole: set[int] = set()
        while True:
            pieces = pallet_angles(tuple(ranges), step, most, self.how.wanted, before, widths)
            contacts = self._wall_contacts(scene.contact, scene.normal, pieces, exact)
            if not contacts:
                return pieces
            windows = [window_ranges(ranges[k], B, _EXACT) for k, B in contacts.items()]
            got = self._clear_ranges(scene, [*contacts], tuple(inside for inside, _ in windows))
            for (k, B), (_, outside), inside in zip(contacts.items(), windows, got, strict=True):
                ranges[k] = merge_ranges(np.vstack([outside, inside]))
                exact[k].append(B)
                if not len(ranges[k]) and k not in whole:
                    whole.add(k)
                    exact[k].clear()
                    ranges[k] = self._valid(plain, np.array([k]), self.pallets)[0]

    def _widths(self, N: Floats, K: Floats, d: Floats, point: Ints, pallet: Floats) -> Floats:
        """Step-overs (k,) [mm] of points (k,) of a line at pallet angles (k,); 0 where there is no step-over."""
        if self.how.scallop is None:
            return np.ones(len(point))
        T = axis_at(self.table, pallet)
        n = (N[point] * T).sum(axis=1)
        out = np.zeros(len(point))
        ok = np.flatnonzero((n >= 0.0) & (n < 1.0 - _FLAT))
        at = point[ok]
        contact = contact_of(N[at], T[ok], d[at], K[at])
        out[ok] = width(contact, self.cutter.rho, self.cutter.corner_radius, self.how.scallop)
        return out

    def border(self, Q: tuple[float, float], need: Flags | None = None) -> Floats:
        """Places q of a line from Q[0] towards Q[1] where the cutter first reaches the surface at each station,
        smoothed.

        Only the stations in ``need`` are examined.
        """
        among = np.arange(len(self.p)) if need is None else np.flatnonzero(need)
        knots = among[np.unique(np.linspace(0, len(among) - 1, min(len(among), _KNOTS)).round().astype(int))]
        low, high = np.zeros(len(knots)), np.full(len(knots), np.nan)
        for f in np.concatenate([[0.0], np.geomspace(0.02, 0.6, 9)]):
            open_ = np.flatnonzero(np.isnan(high))
            if not len(open_):
                break
            got = self._reached_stations(knots[open_], np.full(len(open_), Q[0] + f * (Q[1] - Q[0])))
            high[open_[got]], low[open_[~got]] = f, f
        some = np.isfinite(high) & (high > 0.0)
        for _ in range(_BISECT if some.any() else 0):
            f = 0.5 * (low[some] + high[some])
            got = self._reached_stations(knots[some], Q[0] + f * (Q[1] - Q[0]))
            high[some] = np.where(got, f, high[some])
            low[some] = np.where(got, low[some], f)
        known = np.isfinite(high)
        if not some.any():
            return np.full(len(self.p), Q[0])
        f = np.interp(self.p, self.p[knots[known]], high[known])
        f = np.minimum(
            np.maximum(scipy.ndimage.gaussian_filter1d(scipy.ndimage.maximum_filter1d(f, 3), 1.0, mode="nearest"), f),
            1.0,
        )
        out: Floats = Q[0] + f * (Q[1] - Q[0])
        return out

    def strip(self, q: Floats, border: float) -> UnreachedSpan:
        """The strip between the border and the first line."""
        k, edge = int(q.argmax()), (self.on(np.full(len(q), border)))
        length = float(np.linalg.norm(np.diff(edge[0], axis=0), axis=1).sum())
        (a, b), (c, d) = edge[4][0].tolist(), self.on(q)[4][k].tolist()
        return UnreachedSpan(-1, (a, b), (c, d), length, "no pallet angle")

    def _reached_stations(self, stations: Ints, q: Floats) -> Flags:
        u, v = self.places(self.p[stations], q)
        scene = self.scene.at_contacts(*self.surface.shape(u, v)[:3], self.number)
        got = self._valid(scene, np.arange(len(stations)), self.pallets)
        return np.array([len(r) > 0 for r in got])

    def tracks(
        self, line: Line, use: Flags, number: int, need: Flags | None = None
    ) -> tuple[list[ToolTrack], list[UnreachedSpan]]:
        """Tracks of a line at the stations in ``use``, and the spans that they miss between stations in ``need``.

        A piece that ends between two stations extends from the last one as far as the cutter reaches; if the next piece
        begins so far back that they meet, nothing is missed.
        """
        tracks: list[ToolTrack] = []
        missed: list[UnreachedSpan] = []
        need = use if need is None else use & need
        covered = np.zeros(len(use), dtype=np.bool_)
        refinement = self.refinement
        owner = np.full(len(use), -1)
        for k, piece in enumerate(line.sections):
            owner[piece.first : piece.last] = k
        shares: dict[tuple[int, int], float] = {}  # (first station, towards the next 1 or back -1): share of the step
        for mine, piece in enumerate(line.sections):
            for a, b in runs(use[piece.first : piece.last]):
                i, j = piece.first + a, piece.first + b
                covered[i:j] = True
                at, B = [*line.at[i:j]], [*piece.pallet[a:b]]
                for side, here, there in ((-1, i, i - 1), (1, j - 1, j)):
                    if not (0 <= there < len(use) and use[there] and owner[there] != mine):
                        continue
                    more = refinement.furthest(line.at[here], B[0 if side < 0 else -1], line.at[there])
                    shares[here, side] = 0.0 if more is None else more[2]
                    if more is not None:
                        k = 0 if side < 0 else len(at)
                        at.insert(k, more[0])
                        B.insert(k, more[1])
                if len(at) < 2:
                    continue
                parts, bad = refinement.refined(refinement.track(np.array(at), np.array(B), number))
                tracks += parts
                for row in bad[:1]:
                    k = i + min(int(row), j - i - 1)
                    if need[k]:
                        missed.append(self._unreached_span(number, line.at[k : min(k + 2, j)], "touches"))
        for a, b in runs(need & ~covered):
            ends = [*line.at[a:b]]
            if a and use[a - 1]:
                ends.insert(0, line.at[a - 1] + shares.get((a - 1, 1), 0.0) * (line.at[a] - line.at[a - 1]))
            if b < len(use) and use[b]:
                ends.append(line.at[b] + shares.get((b, -1), 0.0) * (line.at[b - 1] - line.at[b]))
            missed.append(self._unreached_span(number, np.array(ends), "no pallet angle"))
        for k in range(1, len(use)):
            if need[k - 1] and need[k] and covered[k - 1] and covered[k] and owner[k - 1] != owner[k]:
                first, last = shares.get((k - 1, 1), 0.0), 1.0 - shares.get((k, -1), 0.0)
                if first < last:
                    step = line.at[k] - line.at[k - 1]
                    between = line.at[k - 1] + np.array([[first], [last]]) * step
                    missed.append(self._unreached_span(number, between, "cannot follow"))
        return tracks, missed

    def _unreached_span(self, number: int, at: Floats, reason: str) -> UnreachedSpan:
        (a, b), (c, d) = at[0].tolist(), at[-1].tolist()
        return UnreachedSpan(number, (a, b), (c, d), self._length(at), reason)

    def _length(self, at: Floats) -> float:
        return float(np.linalg.norm(np.diff(self.surface.at(*at.T), axis=0), axis=1).sum())

    def on(self, q: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """S, N, K, direction of the line and (u, v) at the stations."""
        u, v = self.places(self.p, q)
        S, N, K, tangents = self.surface.shape(u, v)
        Sp, Sq = tangents if self.along == "u" else tangents[::-1]
        d = Sp + self.sign * np.gradient(q, self.p)[:, None] * Sq
        d /= np.linalg.norm(d, axis=1)[:, None]
        return S, N, K, d, np.column_stack([u, v])

    def _wall_contacts(
        self, S: Floats, N: Floats, pieces: tuple[Turned, ...], exact: Sequence[Sequence[float]]
    ) -> dict[int, float]:
        """Stations and angles at which the cutter meets a wall between the check points; none that are ``exact``."""
        covering = self.scene.covering
        out: dict[int, float] = {}
        if covering is None:
            return out
        for piece in pieces:
            own = slice(piece.first, piece.last)
            tips, axes = pose_cutter(S[own], N[own], self.table, written_angles(piece.pallet), self.cutter)
            for k in np.flatnonzero(covering.node_depth(self.cutter, tips, axes, self.how.clearance) > 0.0).tolist():
                at, B = piece.first + k, float(piece.pallet[k])
                if not any(abs(math.remainder(B - one, math.tau)) <= _EXACT for one in exact[at]):
                    out[at] = B
        return out

    def _clear_ranges(self, scene: Scene, points: Sequence[int], ranges: tuple[Floats, ...]) -> tuple[Floats, ...]:
        """Parts of the ranges of points that are clear of the walls between the check points."""
        if scene.covering is None:
            return ranges
        clear, _ = scene.covering.clear_ranges(
            scene, self.cutter, np.full(len(points), self.table), self.how.clearance, np.array(points), ranges, _LEAST,
            self.workers,
        )  # fmt: skip
        return clear

    def _ranges(self, scene: Scene, before: Floats) -> tuple[Floats, ...]:
        """Ranges of every point, near the angles of the line ``before`` first, else everywhere."""
        points = np.arange(len(before))
        out: dict[int, Floats] = {}
        for a in range(0, len(points), _GROUP):
            group = points[a : a + _GROUP]
            known = before[group]
            if not np.isfinite(known).all():
                continue
            low, high = known.min() - _WINDOW, known.max() + _WINDOW
            spans = _parts_within(low, high, self.pallets)
            if high - low > math.pi or not spans:
                continue
            got = self._valid(scene, group, spans)
            out |= {int(k): r for k, r in zip(group, got, strict=True) if len(r)}
        rest = np.array([k for k in points if int(k) not in out], dtype=np.int64)
        if len(rest):
            out |= {int(k): r for k, r in zip(rest, self._valid(scene, rest, self.pallets), strict=True)}
        return tuple(out[int(k)] for k in points)

    def _valid(self, scene: Scene, points: Ints, spans: tuple[tuple[float, float], ...]) -> tuple[Floats, ...]:
        got = valid_ranges(scene, self.cutter, self.table, self.how.clearance, spans, points, workers=self.workers)
        return got.ranges

    def facing(self, p: Floats, q: Floats) -> tuple[Floats, Floats]:
        """Points and normals (n, 3) of the surface."""
        return self.surface.facing(*self.places(p, q))


def stations(
    surface: BSplinePatch, along: str, P: tuple[float, float], Q: tuple[float, float], chord: float, apart: float
) -> int:
    """Number of points of a line with chords within half of ``chord`` of the surface, at most ``apart`` [mm]."""
    lines = np.linspace(*Q, 5)
    p = np.linspace(*P, 33)
    longest = max(
        float(np.linalg.norm(np.diff(surface.at(p, q) if along == "u" else surface.at(q, p), axis=0), axis=1).sum())
        for q in lines
    )
    least = math.ceil(longest / apart) + 1
    for count in (9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513):
        p = np.linspace(*P, 2 * count - 1)
        worst = 0.0
        for q in lines:
            S = surface.at(p, q) if along == "u" else surface.at(q, p)
            middle = 0.5 * (S[:-2:2] + S[2::2])
            worst = max(worst, float(np.linalg.norm(S[1::2] - middle, axis=1).max()))
        if worst <= 0.5 * chord:
            return max(count, least)
    raise InputError(f"finish.chord = {chord:g} mm: more than 513 points a line: raise it")


def stretch_stations(
    surface: BSplinePatch, along: str, P: tuple[float, float], Q: tuple[float, float], count: int, overrun: float
) -> Floats:
    """Even stations from P[0] to P[1], and more beyond by ``overrun`` [mm] where the surface extends so far."""
    p = np.linspace(*P, count)
    lines = np.linspace(*Q, 5)
    size = np.linalg.norm(
        [(surface.at(x, lines, 1, 0) if along == "u" else surface.at(lines, x, 0, 1)) for x in P], axis=2
    ).min(axis=1)
    out = [p]
    for end, sign, mm in ((P[0], -1.0, size[0]), (P[1], 1.0, size[1])):
        more = min(overrun / mm, end if sign < 0.0 else 1.0 - end)
        if more > 1e-6:
            steps = math.ceil(more / (p[1] - p[0]) - 1e-9)
            out.append(end + sign * more * np.arange(1, steps + 1) / steps)
    return np.sort(np.concatenate(out))


def window_ranges(ranges: Floats, angle: float, width: float) -> tuple[Floats, Floats]:
    """Parts of ranges (k, 2) within a width of an angle, modulo whole turns, and the remaining parts.

    >>> inside, outside = window_ranges(np.array([[0.0, 2.0], [3.0, 4.0]]), 1.0 + math.tau, 0.5)
    >>> inside.round(9).tolist(), outside.round(9).tolist()
    ([[0.5, 1.5]], [[0.0, 0.5], [1.5, 2.0], [3.0, 4.0]])
    """
    inside: list[tuple[float, float]] = []
    outside: list[tuple[float, float]] = []
    for low, high in ranges.tolist():
        at = low
        first = math.ceil((low - width - angle) / math.tau)
        for turn in range(first, math.floor((high + width - angle) / math.tau) + 1):
            middle = angle + math.tau * turn
            a, b = max(at, middle - width), min(high, middle + width)
            if b > a:
                outside += [(at, a)] * (a > at)
                inside.append((a, b))
                at = b
        outside += [(at, high)] * (high > at)
    return np.array(inside).reshape(-1, 2), np.array(outside).reshape(-1, 2)


def merge_ranges(ranges: Floats) -> Floats:
    """Ranges (k, 2) in ascending order, joined where one ends and the next begins.

    >>> merge_ranges(np.array([[1.5, 2.0], [0.0, 0.5], [0.5, 1.0]])).tolist()
    [[0.0, 1.0], [1.5, 2.0]]
    """
    out: list[list[float]] = []
    for low, high in sorted(ranges.tolist()):
        if out and low <= out[-1][1] + _LEAST:
            out[-1][1] = max(out[-1][1], high)
        else:
            out.append([low, high])
    return np.array(out).reshape(-1, 2)


def _parts_within(low: float, high: float, pallets: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Parts of low..high, shifted by whole turns, that lie in the ``pallets``."""
    out = []
    for a, b in pallets:
        first = math.ceil((a - high) / math.tau)
        for turn in range(first, first + 3):
            x, y = max(a, low + math.tau * turn), min(b, high + math.tau * turn)
            if y > x:
                out.append((x, y))
    return tuple(sorted(out))
