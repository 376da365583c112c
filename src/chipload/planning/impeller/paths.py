"""Finishing paths of a patch: lines with scallops of the same height between them.

Notation: a line runs along one parameter p of the surface at q(p) of the other; d its direction, N normal, e = N x d; h
height of the scallop. The next line lies at the step w across e, q + w / (S_q.e) with the derivative half-way. w is the
distance over which the pass stays below h on this side, plus that of the next pass on its own side
(``scallop_width.py``). It is then refined until the scallop between the poses of both (``scallop_height.py``) is as
high as required. The pallet angles of the next line are not known in advance: they are first taken to be those of this
line.

The pallet angles of a line come from the exact ranges at its points (``pallet.py``). Points without a range are left
out and reported; the line is split there. A line that reaches the border of the patch ends there; a part of a line
along the border is the last.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import scipy
from chipload.planning.impeller.closed_form import axis_at
from chipload.planning.impeller.lines import Line, LineMotion, Lines, Tracks, UnreachedSpan, stations, stretch_stations
from chipload.planning.impeller.pallet_ranges import FULL
from chipload.planning.impeller.patch import Begin
from chipload.planning.impeller.scallop_height import pose_distance, scallop_heights, shares
from chipload.planning.impeller.scallop_width import reaches
from chipload.planning.impeller.scene import Floats, Scene
from chipload.planning.impeller.steps import Flags, even_steps, straighten_line
from chipload.planning.impeller.track import ToolTrack, pose_cutter
from chipload.progress import Progress, silent

_MENDS, _ROUNDS = 6, 12
_LINES = 5000
#: of how far a pass stays below the scallop, how far from the border the outermost lines lie
_INSIDE = 0.9
_LESS = 0.6  # least share of a step that is tried where a line came out too high
_USED = 0.9  # of what is aimed at, the mean scallop that is enough
_STILL = 5e-3  # share by which a step may still change
_SPLIT = math.radians(45.0)  # from station to station: further the pallet does not turn in one piece of a line
#: stations of a line are no farther apart than this [mm]
_STATION = 1.5
#: widths of a part along it that differ more: lines may begin in its middle
_NARROWS = 1.25


@dataclass(frozen=True)
class PatchFinish:
    """Parameters of the finishing path of a patch.

    Parameters
    ----------
    scallop : greatest height h [mm]
    motion : what the lines are milled with
    overrun : length of the lines beyond the patch at their ends [mm], where the surface does and the cutter reaches
    aim : share of h that the step is laid out for; the rest is for what is not of second order
    """

    scallop: float
    motion: LineMotion
    overrun: float = 0.0
    aim: float = 0.97

    def __post_init__(self) -> None:
        if not (0.0 < self.scallop < math.inf and 0.0 < self.aim <= 1.0):
            raise InputError(f"scallop_mm = {self.scallop:g}, aim {self.aim:g}: must be above 0, aim at most 1")


def finish_tracks(
    surface: BSplinePatch,
    along: str,
    box: tuple[tuple[float, float], tuple[float, float]],
    scene: Scene,
    number: int,
    cutter: CatalogueCutter,
    table: float,
    how: PatchFinish,
    pallets: tuple[tuple[float, float], ...] = FULL,
    workers: int = 1,
    progress: Progress = silent,
    begin: Begin = "low",
) -> Tracks:
    """Tracks over a part of a surface at constant scallop height.

    Parameters
    ----------
    along : `u` or `v`, the parameter that the lines run along
    box : (low, high) of u, (low, high) of v, within 0..1
    scene : its check points; its contact points are not used
    number : of the surface among those of the check points
    table : alpha [rad]
    pallets : (k, 2) [rad] where B may be
    begin : border at which lines begin, or `middle`, where they run half as askew; the low border where the middle is
        not reached. `any`: low or middle, where they are shorter, if the width of the part differs much along it
    """
    if along not in ("u", "v"):
        raise InputError(f"along = {along!r}: must be u or v")
    P, Q = box if along == "u" else box[::-1]
    if not (0.0 <= P[0] < P[1] <= 1.0 and 0.0 <= Q[0] < Q[1] <= 1.0):
        raise InputError(f"box = {box}: must be ascending, within 0..1")
    count = stations(surface, along, P, Q, how.motion.chord, _STATION)
    p = stretch_stations(surface, along, P, Q, count, how.overrun)
    need = (p >= P[0]) & (p <= P[1])
    job = Lines(surface, along, p, scene, number, cutter, table, how.motion, pallets, workers)
    up = _March(_Stepper(job, how.scallop, how.aim, need), Q, progress)
    down = _March(_Stepper(replace(job, sign=-1.0), how.scallop, how.aim, need), (-Q[1], -Q[0]), progress)
    if begin == "high":
        return down.from_border()
    if begin == "middle" or (begin == "any" and _narrows(job, Q, need)):
        middle = job.line(np.full(len(p), 0.5 * sum(Q)), np.full(len(p), np.nan))
        if np.isfinite(middle.pallet[need]).all():
            before, after = down.after(replace(middle, q=-middle.q), 1), up.after(middle, 1)
            found = _stack_lines(before, up.alone(middle), after)
            # which way lines run also decides how wide their passes are
            return found if begin == "middle" else min(up.from_border(), found, key=_rank)
    return up.from_border()


def _rank(one: Tracks) -> tuple[float, float]:
    """Order of lines over the same part: what they miss, to 10 mm, then their length [mm]."""
    return round(math.fsum(x.length for x in one.missed), -1), one.length


def _narrows(job: Lines, Q: tuple[float, float], need: Flags) -> bool:
    """Whether the width of a part between its borders differs along it by more than :data:`_NARROWS`."""
    q = np.linspace(*Q, 9)
    p = job.p[need]
    S = job.surface.at(*job.places(np.repeat(p, len(q)), np.tile(q, len(p)))).reshape(len(p), len(q), 3)
    width = np.linalg.norm(np.diff(S, axis=1), axis=2).sum(axis=1)
    return bool(width.max() > _NARROWS * width.min())


def _stack_lines(before: Tracks, middle: Tracks, after: Tracks) -> Tracks:
    """Lines on either side of one, numbered from the first to the last; ``before`` goes away from it, from 1 on."""
    n = before.lines
    low = [replace(t, line=n - t.line) for t in reversed(before.tracks)]
    shifted = [replace(x, line=n - x.line) for x in before.missed]
    high, own = ([replace(t, line=n + t.line) for t in x.tracks] for x in (after, middle))
    missed = [replace(x, line=n + x.line) for x in (*middle.missed, *after.missed)]
    return Tracks((*low, *own, *high), (*shifted, *missed), n + 1 + after.lines)


@dataclass(frozen=True, eq=False)
class _March:
    """Line after line, towards the end of a range Q of places q."""

    step: _Stepper
    Q: tuple[float, float]
    progress: Progress

    def from_border(self) -> Tracks:
        """All lines from Q[0] on."""
        job, need = self.step.lines, self.step.need
        q = job.border(self.Q, need)
        line = self.step.first(q, self.Q[0])
        strip = (job.strip(q, self.Q[0]),) if (q > self.Q[0]).any() else ()
        first, rest = self.alone(line), self.after(line, 1)
        return Tracks((*first.tracks, *rest.tracks), (*strip, *first.missed, *rest.missed), 1 + rest.lines)

    def alone(self, line: Line) -> Tracks:
        """The tracks of the line number 0."""
        new, missed = self.step.lines.tracks(line, np.ones(len(line.q), dtype=np.bool_), 0, self.step.need)
        return Tracks(tuple(new), tuple(missed), 1)

    def after(self, line: Line, number: int) -> Tracks:
        """The lines after one, counted from ``number`` on."""
        tracks: list[ToolTrack] = []
        missed: list[UnreachedSpan] = []
        use, need = np.ones(len(line.q), dtype=np.bool_), self.step.need
        low, high = self.Q
        for k in range(_LINES):
            self.progress(float(np.clip((line.q.min() - low) / (high - low), 0.0, 1.0)), f"{k + 1} lines")
            reach = self.step.reach(line)
            open_ = use & ~self.step.done(line, reach, high)
            if not open_[need].any():
                return Tracks(tuple(tracks), tuple(missed), k)
            # where the pass of the line before has reached the border there is nothing left
            use = scipy.ndimage.binary_dilation(open_)
            line = self.step.next(line, reach, high, use & need)
            new, refused = self.step.lines.tracks(line, use, number + k, need)
            tracks += new
            missed += refused
        raise InputError(f"finish.scallop = {self.step.scallop:g} mm: more than {_LINES} lines: raise it")


@dataclass(frozen=True, eq=False)
class _Stepper:
    """From line to line at the scallop height, within ``aim`` of it, at the stations that ``need`` it."""

    lines: Lines
    scallop: float
    aim: float
    need: Flags

    def first(self, q: Floats, border: float) -> Line:
        """The first line: as far inside the border as its pass stays below the scallop on its side.

        Where the cutter does not reach the border, at ``q``, the line lies there.
        """
        line = self.lines.line(q, np.full(len(q), np.nan))
        if not (q == border).all() or not np.isfinite(line.pallet).any():
            return line
        w = np.full(len(q), np.inf)
        for _ in range(_MENDS):
            _, behind = self.reach(line)
            w = np.minimum(w, self._even(line, _INSIDE * behind))
            inside = self.lines.line(q + self._dq(line, w), line.pallet)
            if len(inside.sections) > len(line.sections):
                break
            _, behind = self.reach(inside)
            known = np.isfinite(behind)
            if (behind[known] >= w[known]).all() and known.sum() >= np.isfinite(line.pallet).sum():
                return inside
            w = np.where(known, np.minimum(w, behind), w)
        return line

    def done(self, line: Line, reach: tuple[Floats, Floats], border: float) -> Flags:
        """(n,) stations at which the pass of a line stays below the scallop to the border; its :meth:`reach`."""
        ahead, _ = reach
        w = np.where(np.isfinite(ahead), _INSIDE * ahead, 0.0)
        # beyond the patch lines continue as at its ends
        inner = np.flatnonzero(self.need)
        near = inner[np.abs(inner - np.arange(len(w))[:, None]).argmin(axis=1)]
        out: Flags = (line.q + self._dq(line, w) >= border)[near]
        return out

    def next(self, line: Line, reach: tuple[Floats, Floats], border: float, use: Flags) -> Line:
        """The next line, so that the scallop between has the required height, by the :meth:`reach` of this one.

        It may lie beyond the border, as the last one of a patch does, if all that is in ``use`` is reached there.
        """
        ahead, behind = reach
        w = self._step(line, self._even(line, ahead + behind), line.pallet)
        free = self._next(line, w, self.lines.ends[1])
        blocked = int((use & np.isnan(free.pallet)).sum())
        # a line in one piece that loses nothing is not worse than any other
        if not (free.q[use] > border).any() or (blocked == 0 and len(free.sections) <= 1):
            return free
        inside = self._next(line, w, border)
        less = int((use & np.isnan(inside.pallet)).sum())
        return free if (blocked, len(free.sections)) <= (less, len(inside.sections)) else inside

    def _next(self, line: Line, w: Floats, end: float) -> Line:
        """The next line, no farther than ``end``, by the step ``w`` for the pallet angles of this line.

        The step is then laid out for the pallet angles of the new one.
        """
        B, most = line.pallet, self.scallop * (0.5 + 0.5 * self.aim)
        less = np.ones(len(w))
        best: tuple[float, Line] | None = None
        for turn in range(_MENDS):
            if turn:
                w = self._step(line, w, B)
            out = self.lines.line(self._move_line(line, self._even(line, less * w), end), B)
            scallop = self._scallop(line, out.q, out.pallet)
            # what is used of the scallop where the line is not at the border; below 0: by how much it is too high
            inner = scallop[np.isfinite(scallop) & (out.q < end)]
            share = float(inner.mean() / self.scallop) if len(inner) else 1.0
            over = float(np.nanmax(scallop, initial=0.0)) / most
            score = share if over <= 1.0 else 1.0 - over
            if best is None or score > best[0]:
                best = score, out
            if not np.isfinite(out.pallet).any() or (over <= 1.0 and share > _USED * self.aim):
                break
            if over > 1.0:
                # the new line has other angles than the step was laid out for
                there = np.sqrt(most / np.where(scallop > most, scallop, most))
                less *= np.clip(scipy.ndimage.minimum_filter1d(there, 3), _LESS, 1.0)
            B = out.pallet
        return line if best is None else best[1]

    def _move_line(self, line: Line, w: Floats, end: float) -> Floats:
        out: Floats = np.minimum(self._straight(line, line.q + self._dq(line, w)), end)
        return out

    def _step(self, line: Line, w: Floats, pallet: Floats) -> Floats:
        """The step at which the scallop is as high as aimed, if the next line is milled at these pallet angles."""
        aim = self.aim * self.scallop
        for _ in range(_ROUNDS):
            scallop = self._scallop(line, self._move_line(line, w, self.lines.ends[1]), pallet)
            ratio = np.clip(np.sqrt(aim / np.clip(scallop, 0.1 * aim, None)), 0.6, 1.3)
            if not np.isfinite(ratio).any() or (np.nanmin(ratio) > 0.99 and np.nanmax(ratio) < 1.03):
                break
            new = np.minimum(
                self._even(line, np.where(np.isfinite(ratio), w * ratio, np.nan)),
                self.lines.cutter.rho + self.lines.cutter.corner_radius,
            )
            still = np.abs(new - w).max() < _STILL * w.max()
            w = new
            if still:
                break
        return w

    def _scallop(self, line: Line, q: Floats, pallet: Floats) -> Floats:
        """(n,) scallop between a line and one at q, the highest near each station; nan: one of them is not milled."""
        n = len(q)
        length = float(line.size.mean())
        sub = 2 * max(1, math.ceil(0.5 * length / pose_distance(self.lines.cutter.corner_radius)))
        at = np.arange((n - 1) * sub + 1) / sub
        p, q0, q1 = (np.interp(at, np.arange(n), x) for x in (self.lines.p, line.q, q))
        B0, B1 = (_blend_pallet(x, at) for x in (line.pallet, pallet))
        share = shares()
        P, Q = np.repeat(p, len(share)), (q0[:, None] + share * (q1 - q0)[:, None]).ravel()
        points, normals = (x.reshape(len(at), len(share), 3) for x in self.lines.facing(P, Q))
        one, two = self._poses(*self.lines.facing(p, q0), B0), self._poses(*self.lines.facing(p, q1), B1)
        heights = scallop_heights(
            points, normals, (one[0], two[0]), (one[1], two[1]), self.lines.cutter.rho, self.lines.cutter.corner_radius
        )
        near = np.pad(np.where(np.isfinite(heights), heights, -np.inf), sub // 2, constant_values=-np.inf)
        worst = sliding_window_view(near, sub + 1)[::sub].max(axis=1)
        both = np.isfinite(line.pallet) & np.isfinite(pallet) & np.isfinite(worst)
        return np.where(both & self.need, worst, np.nan)

    def _poses(self, S: Floats, N: Floats, pallet: Floats) -> tuple[Floats, Floats]:
        known = np.isfinite(pallet)
        tip, axis = pose_cutter(S, N, self.lines.table, np.where(known, pallet, 0.0), self.lines.cutter)
        return np.where(known[:, None], tip, np.nan), np.where(known[:, None], axis, np.nan)

    def reach(self, line: Line) -> tuple[Floats, Floats]:
        """How far a line reaches towards a growing q and against it; nan where it has no pallet angle."""
        ahead, behind = np.full(len(line.q), np.nan), np.full(len(line.q), np.nan)
        k = np.flatnonzero(np.isfinite(line.pallet) & self.need)
        if len(k):
            T = axis_at(self.lines.table, line.pallet[k])
            a, b = reaches(
                line.N[k], T, line.d[k], line.K[k], self.lines.cutter.rho, self.lines.cutter.corner_radius,
                self.aim * self.scallop,
            )  # fmt: skip
            left = self._sign(line)[k] > 0.0
            ahead[k], behind[k] = np.where(left, a, b), np.where(left, b, a)
        return ahead, behind

    def _sign(self, line: Line) -> Floats:
        """(n,) S_q.e: mm across the line for a growth of q by 1."""
        return self._distance_across(line, line.q)

    def _distance_across(self, line: Line, q: Floats) -> Floats:
        u, v = self.lines.places(self.lines.p, q)
        Sq = self.lines.sign * self.lines.surface.at(u, v, *((0, 1) if self.lines.along == "u" else (1, 0)))
        out: Floats = (Sq * line.e).sum(axis=1)
        return out

    def _even(self, line: Line, w: Floats) -> Floats:
        """Steps without jumps along the line, nowhere above those given; where there are none, of the nearest."""
        known = np.flatnonzero(np.isfinite(w))
        if len(known) == 0:
            r, h = self.lines.cutter.corner_radius, self.scallop
            return np.full(len(w), 2.0 * math.sqrt(2.0 * max(r, h) * h))
        return even_steps(w, line.size)

    def _straight(self, line: Line, q: Floats) -> Floats:
        """Places (n,) of the line after ``line``, held back where it would run askew to the parameter lines."""
        return straighten_line(q, line.q, self._distance_across(line, line.q), line.size)

    def _dq(self, line: Line, w: Floats) -> Floats:
        first = w / np.abs(self._distance_across(line, line.q))
        middle = np.clip(line.q + 0.5 * first, *self.lines.ends)
        out: Floats = w / np.abs(self._distance_across(line, middle))
        return out


def _blend_pallet(pallet: Floats, at: Floats) -> Floats:
    """Pallet angles between stations; nan next to a station that has none, and where a line is split."""
    i = np.minimum(at.astype(np.int64), len(pallet) - 2)
    w = at - i
    turn = pallet[i + 1] - pallet[i]
    turn = turn - math.tau * np.round(turn / math.tau)
    out: Floats = pallet[i] + w * turn
    out = np.where(np.abs(turn) > _SPLIT, np.nan, out)
    return np.where(w == 0.0, pallet[i], np.where(w == 1.0, pallet[i + 1], out))
