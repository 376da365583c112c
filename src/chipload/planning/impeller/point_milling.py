"""Point milling of a surface on five simultaneous axes: zigzag lines with a constant scallop height.

Notation: lines run along one parameter p of the surface at q(p) of the other; T(u, v) the axis (``axis_field.py``),
which is known over the whole surface before the lines are laid out. h height of the scallop, w step-over across a line.

Line follows line from one border to the other: the next one lies at w from the one before, at each station its own.
w is first that of two neighbouring passes (``scallop_width.py``). Then it is corrected by the scallop between the poses
of both lines (``scallop_height.py``): w times sqrt(h / scallop), repeatedly, without jumps along the line
(``steps.py``). A line is milled as far as the one before it does not cover the border: where the surface needs fewer
lines, lines end. The outermost lines lie inside the border, so far that the scallop of their pass stays below h there.

From line to line the cutter stays on the surface. Between two rows the tip moves straight and the axis turns
uniformly; rows are added until the tip half-way is within the chord.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.lazy import scipy
from chipload.planning.impeller.axis_field import AxisField, pose
from chipload.planning.impeller.clearance import interpolated_axes
from chipload.planning.impeller.pass_order import pass_order
from chipload.planning.impeller.scallop_height import profile_scallops, scallop_heights, shares
from chipload.planning.impeller.scallop_width import reaches
from chipload.planning.impeller.scene import Floats
from chipload.planning.impeller.steps import Flags, even_steps, runs, straighten_line

#: distance between the stations of a line [mm]
_SPACING = 0.5
#: distance of the outermost lines from the border, as a share of the reach of a pass below the scallop
_INSIDE = 0.85
#: share of the scallop that steps are laid out for, and that no station is above
_AIM, _MOST = 0.945, 0.97
#: rounds in which a step is corrected, and the share by which it may still change; rounds more while a scallop is too
#: high, and the share of it that is aimed at from one of them to the next
_ROUNDS, _CONVERGED, _MORE, _LESS = 8, 0.01, 12, 0.985
#: smoothness of borders and steps along a line [mm]
_SMOOTH = 1.5
#: number of neighbouring stations whose narrowest step counts, before steps are smoothed
_NEAR = 5
#: greatest number of lines, and of halvings of a row
_LINES, _HALVINGS = 5000, 6
#: how far a line extends where the one before it covers the border [mm]; of a step, how far inside it that one may lie
_BEYOND, _COVERS = 1.0, 0.05
#: greatest distance of a line from the chords between its rows [mm]
_BEND = 0.01


class PathLine(NamedTuple):
    """A line of a path: its places (n, 2), u and v, and its number."""

    at: Floats
    line: int


@dataclass(frozen=True, eq=False)
class PointPath:
    """One path over a surface.

    Parameters
    ----------
    at : (n, 2) u and v
    normal : (n, 3) of the surface
    tip, axis : (n, 3) [mm], unit
    line : (n,) number of the line; -1: from one to the next
    """

    at: Floats
    normal: Floats
    tip: Floats
    axis: Floats
    line: NDArray[np.int64]

    @property
    def lines(self) -> int:
        """Number of lines."""
        return len(np.unique(self.line[self.line >= 0]))

    @property
    def each_line(self) -> tuple[PathLine, ...]:
        """Its lines, one by one; a line that is milled in two pieces twice."""
        edges = [0, *(np.flatnonzero(np.diff(self.line)) + 1).tolist(), len(self.line)]
        return tuple(
            PathLine(self.at[a:b], int(self.line[a])) for a, b in itertools.pairwise(edges) if self.line[a] >= 0
        )

    @property
    def length(self) -> float:
        """Length of the tip's path [mm]."""
        return float(np.linalg.norm(np.diff(self.tip, axis=0), axis=1).sum())

    @property
    def turn(self) -> float:
        """Greatest turn of the axis per millimetre of the contact's path [rad/mm]."""
        angle = np.arccos(np.clip((self.axis[1:] * self.axis[:-1]).sum(axis=1), -1.0, 1.0))
        size = np.linalg.norm(np.diff(self.tip, axis=0), axis=1)
        moving = size > 1e-3
        return float((angle[moving] / size[moving]).max()) if moving.any() else 0.0

    def back(self) -> PointPath:
        """The same path from its end to its beginning."""
        return PointPath(**{f.name: getattr(self, f.name)[::-1] for f in fields(self)})


def point_path(
    surface: BSplinePatch,
    along: str,
    box: tuple[tuple[float, float], tuple[float, float]],
    field: AxisField,
    cutter: CatalogueCutter,
    scallop: float,
    chord: float,
) -> PointPath:
    """Point-milling path over a part of a surface.

    Parameters
    ----------
    along : `u` or `v`, the parameter that the lines run along
    box : (low, high) of u, of v; lines run over the whole field, which may be longer
    scallop, chord : h [mm], greatest deviation of the tip between two rows [mm]

    Raises
    ------
    InputError
        A number is not above 0, or there would be more than 5,000 lines.
    """
    if not (scallop > 0.0 and chord > 0.0):
        raise InputError(f"scallop = {scallop:g} mm, chord = {chord:g} mm: must be above 0")
    stations = field.u if along == "u" else field.v
    P = float(stations[0]), float(stations[-1])
    Q = box[1] if along == "u" else box[0]
    middle = np.linspace(*P, 200)
    S = surface.at(middle, np.full(200, 0.5 * sum(Q))) if along == "u" else surface.at(0.5 * sum(Q), middle)
    length = float(np.linalg.norm(np.diff(S, axis=0), axis=1).sum())
    job = _Lines(surface, along, np.linspace(*P, max(math.ceil(length / _SPACING), 8) + 1), field, cutter, scallop)
    low, high = job.border(Q[0], 1.0), job.border(Q[1], -1.0)
    inner = box[0] if along == "u" else box[1]
    # also between the last station inside and the next one
    need = scipy.ndimage.binary_dilation((job.p >= inner[0] - 1e-9) & (job.p <= inner[1] + 1e-9))
    paths = [_join_lines(job, laid, chord) for laid in job.laid_out(low, high, need)]
    return min(paths, key=lambda path: path.length)


class _LinePiece(NamedTuple):
    """A part of a line that is milled: its number, its places p and q (n,)."""

    line: int
    p: Floats
    q: Floats


@dataclass(frozen=True, eq=False)
class _Lines:
    surface: BSplinePatch
    along: str
    p: Floats
    field: AxisField
    cutter: CatalogueCutter
    scallop: float
    sign: float = 1.0

    def places(self, p: Floats, q: Floats) -> tuple[Floats, Floats]:
        q = self.sign * q
        return (p, q) if self.along == "u" else (q, p)

    def poses(self, p: Floats, q: Floats) -> tuple[Floats, Floats, Floats]:
        """Tips, axes and normals (n, 3)."""
        u, v = self.places(p, q)
        N, T = self.surface.normal(u, v), self.field.at(u, v)
        return pose(self.surface.at(u, v), N, T, self.cutter), T, N

    def across(self, q: Floats) -> tuple[Floats, Floats, Floats]:
        """N and d (n, 3) of a line, and S_q.e (n,): mm across it for a growth of q by 1."""
        u, v = self.places(self.p, q)
        N = self.surface.normal(u, v)
        Sp, Sq = self.surface.at(u, v, 1, 0), self.surface.at(u, v, 0, 1)
        if self.along == "v":
            Sp, Sq = Sq, Sp
        Sq = self.sign * Sq
        slope = np.gradient(q, self.p)
        d = Sp + slope[:, None] * Sq
        d /= np.linalg.norm(d, axis=1)[:, None]
        return N, d, (Sq * np.cross(N, d)).sum(axis=1)

    def across_at(self, p: Floats, q: Floats) -> Floats:
        """S_q (n,): mm for a growth of q by 1."""
        order = (0, 1) if self.along == "u" else (1, 0)
        out: Floats = np.linalg.norm(self.surface.at(*self.places(p, q), *order), axis=1)
        return out

    def reach(self, q: Floats) -> tuple[Floats, Floats]:
        """Widths (n,), (n,) [mm] over which a pass stays below the scallop, towards greater and smaller q."""
        u, v = self.places(self.p, q)
        N, d, sign = self.across(q)
        r, e, _ = self.cutter.contact_arc
        a, b = reaches(
            N, self.field.at(u, v), d, self.surface.curvature(u, v), e, r, _AIM * self.scallop,
            None if self.cutter.straight else self.cutter,
        )  # fmt: skip
        return np.where(sign > 0.0, a, b), np.where(sign > 0.0, b, a)

    def moved(self, q: Floats, w: Floats) -> Floats:
        """The places a step w (n,) [mm] across from a line."""
        _, _, size = self.across(q)
        ends = min(0.0, self.sign), max(0.0, self.sign)
        half = np.clip(q + 0.5 * w / np.abs(size), *ends)
        _, _, size = self.across(half)
        return np.clip(q + w / np.abs(size), *ends)

    def border(self, q: float, sign: float) -> Floats:
        """The outermost line: inside the border q by a share of the reach of its pass below the scallop."""
        line = np.full(len(self.p), q)
        out = line
        for _ in range(3):
            ahead, behind = self.reach(out)
            w = _INSIDE * scipy.ndimage.gaussian_filter1d(behind if sign > 0.0 else ahead, self.smooth, mode="nearest")
            out = self.moved(line, sign * w)
        return out

    @property
    def smooth(self) -> float:
        """Stations over which borders and steps are smoothed."""
        return _SMOOTH / _SPACING

    def laid_out(self, low: Floats, high: Floats, need: Flags) -> tuple[tuple[_LinePiece, ...], ...]:
        """Pieces of lines between ``low`` and ``high`` (n,): from the middle on, from either border on.

        ``need`` : stations (n,) at which the scallop counts; elsewhere lines continue as at the nearest of these.

        Raises
        ------
        InputError
            None of the three leaves no more than the scallop.
        """
        middle = 0.5 * (low + high)
        if (high <= low).all():
            return ((_LinePiece(0, self.p, middle),),)
        low, high = np.minimum(low, middle), np.maximum(high, middle)
        back = replace(self, sign=-1.0)
        out: list[tuple[_LinePiece, ...]] = []
        refused: list[InputError] = []
        for begin in (middle, low, high):
            try:
                up = self.from_line(begin, high, need)
                down = back.from_line(-begin, -low, need)
            except InputError as err:
                refused.append(err)
                continue
            n = max((k for k, *_ in down), default=0)
            below = [_LinePiece(n - k, p, -q) for k, p, q in reversed(down)]
            out.append((*below, _LinePiece(n, self.p, begin), *(_LinePiece(n + k, p, q) for k, p, q in up)))
        if not out:
            raise refused[0]
        return tuple(out)

    def from_line(self, line: Floats, high: Floats, need: Flags) -> list[_LinePiece]:
        """Pieces of the lines after a line, up to ``high``."""
        where = np.flatnonzero(need)
        near = where[np.abs(where - np.arange(len(need))[:, None]).argmin(axis=1)]
        on = np.ones(len(line), dtype=np.bool_)
        out: list[_LinePiece] = []
        w: Floats | None = None
        lines, whole = [line], np.ones(len(line))
        for number in range(1, _LINES):
            left = np.abs(self.across(line)[2]) * (high - line)
            on = on & (left > _COVERS * np.add(*self.reach(line)))[near]
            if not on.any():
                if len(lines) == len(out) + 1 and all(len(piece.p) == len(line) for piece in out):
                    out = [_LinePiece(k, self.p, q) for k, q in enumerate(_spread(lines, whole)[1:], 1)]
                return out
            on = scipy.ndimage.binary_dilation(on, iterations=round(_BEYOND / _SPACING))
            w = self.step(line, high, on, need, w)
            full = self.after(line, w)
            new = np.minimum(full, high)
            whole = (new - line) / np.where(full > line, full - line, 1.0)
            out += [_LinePiece(number, self.p[a:b], new[a:b]) for a, b in runs(on)]
            line = np.where(on, new, high)
            lines.append(line)
        raise InputError(f"scallop = {self.scallop:g} mm: more than {_LINES} lines: raise it")

    def step(self, line: Floats, high: Floats, on: Flags, need: Flags, known: Floats | None) -> Floats:
        """Step (n,) [mm] to the next line, at which the scallop between both has the height aimed for."""
        size = self.sizes(line)
        use = on & need if (on & need).any() else on
        w = self.even(np.add(*self.reach(line)), size, use) if known is None else known
        aim, most = _AIM * self.scallop, _MOST * self.scallop
        for turn in range(_ROUNDS + _MORE):
            new = np.minimum(self.after(line, w), high)
            height = np.where(use, self.scallops(np.where(on, line, np.nan), np.where(on, new, np.nan)), np.nan)
            highest = float(np.nanmax(height))
            free = new < high
            ratio = np.clip(np.sqrt(aim / np.clip(height, 0.1 * aim, None)), 0.6, 1.3)
            # a line at the border does not show a wider step
            wider = np.where(free, ratio, np.minimum(ratio, 1.0))
            then = self.even(w * wider, size, use)
            still = float(np.abs(then / w - 1.0)[use].max()) < _CONVERGED
            if highest <= most and (still or turn >= _ROUNDS):
                return w
            if turn >= _ROUNDS:
                aim *= _LESS
            w = then
        raise InputError(f"scallop = {self.scallop:g} mm: two lines leave {highest:.4f} mm: the cutter does not fit")

    def sizes(self, line: Floats) -> Floats:
        """(n - 1,) [mm] from station to station of a line."""
        out: Floats = np.linalg.norm(np.diff(self.surface.at(*self.places(self.p, line)), axis=0), axis=1)
        return out

    def even(self, w: Floats, size: Floats, use: Flags) -> Floats:
        """Steps without jumps along the line, of those in ``use``."""
        least = scipy.ndimage.minimum_filter1d(np.where(use, w, np.inf), _NEAR)
        out: Floats = scipy.ndimage.gaussian_filter1d(even_steps(least, size, self.smooth), self.smooth, mode="nearest")
        return out

    def after(self, line: Floats, w: Floats) -> Floats:
        """Places (n,) of the line w beyond another one."""
        return straighten_line(self.moved(line, w), line, self.across(line)[2], self.sizes(line), self.smooth)

    def scallops(self, line: Floats, other: Floats) -> Floats:
        """(n,) height of the scallop between two lines [mm]."""
        share = shares()
        P = np.repeat(self.p, len(share))
        Q = (line[:, None] + share * (other - line)[:, None]).ravel()
        u, v = self.places(P, Q)
        shape = (len(self.p), len(share), 3)
        one, two = self.poses(self.p, line), self.poses(self.p, other)
        places = self.surface.at(u, v).reshape(shape), self.surface.normal(u, v).reshape(shape)
        tips, axes = (one[0], two[0]), (one[1], two[1])
        if not self.cutter.straight:
            return profile_scallops(*places, tips, axes, self.cutter)
        return scallop_heights(*places, tips, axes, self.cutter.rho, self.cutter.corner_radius)


def _spread(lines: list[Floats], last: Floats) -> Floats:
    """Lines (m, n) that all go from end to end, with steps of one size; the last step was a share (n,) of a whole one.

    >>> _spread([np.zeros(1), np.ones(1), np.full(1, 1.5)], np.full(1, 0.5)).ravel().tolist()
    [0.0, 0.75, 1.5]
    """
    steps = len(lines) - 1
    if not steps:
        return np.array(lines)
    at = np.concatenate([np.repeat(np.arange(steps)[:, None], len(last), axis=1), [steps - 1.0 + last]])
    every = np.arange(steps + 1) / steps
    return np.array([np.interp(every * x[-1], x, q) for x, q in zip(at.T, np.array(lines).T, strict=True)]).T


def _join_lines(job: _Lines, laid: tuple[_LinePiece, ...], chord: float) -> PointPath:
    """All lines in alternate directions, joined on the surface, with as many rows as the chord requires."""
    p: list[Floats] = []
    q: list[Floats] = []
    number: list[NDArray[np.int64]] = []
    for k, forward in _order(job, laid):
        piece = laid[k]
        order = slice(None) if forward else slice(None, None, -1)
        if p:
            share = np.linspace(0.0, 1.0, 6)[1:-1]
            p.append(p[-1][-1] + share * (piece.p[order][0] - p[-1][-1]))
            q.append(q[-1][-1] + share * (piece.q[order][0] - q[-1][-1]))
            number.append(np.full(len(share), -1))
        p.append(piece.p[order])
        q.append(piece.q[order])
        number.append(np.full(len(piece.p), piece.line))
    P, Q, of = np.concatenate(p), np.concatenate(q), np.concatenate(number)
    keep = _needed_rows(P, Q, of, np.abs(job.across_at(P, Q)))
    P, Q, of = P[keep], Q[keep], of[keep]
    for _ in range(_HALVINGS):
        tip, axis, _ = job.poses(P, Q)
        half = 0.5 * (P[1:] + P[:-1]), 0.5 * (Q[1:] + Q[:-1])
        there, turned, _ = job.poses(*half)
        even = interpolated_axes(axis[:-1], axis[1:], np.full(len(half[0]), 0.5))
        r, e, f = job.cutter.contact_arc
        lever = 2.0 * max(e + r, f)
        off = np.linalg.norm(there - 0.5 * (tip[1:] + tip[:-1]), axis=1)
        off += lever * np.linalg.norm(turned - even, axis=1)
        more = np.flatnonzero(off > chord)
        if not len(more):
            break
        P, Q = np.insert(P, more + 1, half[0][more]), np.insert(Q, more + 1, half[1][more])
        of = np.insert(of, more + 1, np.where(of[more] == of[more + 1], of[more], -1))
    tip, axis, normal = job.poses(P, Q)
    return PointPath(np.column_stack(job.places(P, Q)), normal, tip, axis, of)


def _needed_rows(P: Floats, Q: Floats, of: NDArray[np.int64], size: Floats) -> Flags:
    """Which rows (n,) of lines are needed: every fourth, and more where a line bends between them.

    ``size`` (n,) [mm] across the line for a growth of q by 1. Rows are added again where the chord requires them.
    """
    ends = np.ones(len(P), dtype=np.bool_)
    ends[1:-1] = (of[1:-1] != of[2:]) | (of[1:-1] != of[:-2])
    at = np.arange(len(P))
    keep: Flags = ends | (at % 4 == 0)
    for every in (2, 1):
        rows = np.flatnonzero(keep)
        interval = np.searchsorted(rows, at, side="right") - 1
        first, last = rows[interval], rows[np.minimum(interval + 1, len(rows) - 1)]
        share = (P - P[first]) / np.where(P[last] != P[first], P[last] - P[first], 1.0)
        off = np.abs(Q - Q[first] - share * (Q[last] - Q[first])) * size
        bent = np.zeros(len(P), dtype=np.bool_)
        np.maximum.at(bent, first, off > _BEND)
        keep |= bent[first] & (at % every == 0)
    return keep


def _order(job: _Lines, laid: tuple[_LinePiece, ...]) -> list[tuple[int, bool]]:
    """Pieces of lines in the order of the shortest links, each with whether it is milled forward."""
    both = [job.poses(piece.p[[0, -1]], piece.q[[0, -1]]) for piece in laid]
    tips, axes = (np.array([x[k] for x in both]) for k in (0, 1))
    # the cutter stays on the surface: no link leads over the part
    return pass_order(tips, axes, math.inf, math.inf, 1.0, 1.0)
