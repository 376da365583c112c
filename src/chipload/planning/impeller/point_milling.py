"""Point milling of a surface on five simultaneous axes: zigzag lines with a constant scallop height.

Notation: lines run along one parameter p of the surface at q(p) of the other; T(u, v) the axis (``axis_field.py``),
which is known over the whole surface before the lines are laid out. h height of the scallop, w step-over across a line.

A station p needs N(p) steps from border to border, the integral of 1 / w across the lines. All stations get the same
number M, the greatest N, each with its own share 1 / (w N) of them at every place. So lines begin and end together, and
never become skew. Where N differs much the surface is divided into bands of stations, each with an M of its own, so
that the path is shortest. The widths w are first those of two neighbouring passes (``scallop_width.py``). Then they are
corrected by the scallop between the poses of every two lines (``scallop_height.py``): the distance of the lines times
sqrt(h / scallop), repeatedly. M grows until no scallop is above h. The first and the last line lie inside the border,
as far as their pass stays below h there.

From line to line the cutter stays on the surface. Between two rows the tip goes straight and the axis turns evenly;
rows are added until the tip of the middle is within the chord.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.geometry.bspline import BSplinePatch
from chipload.planning.impeller.axis_field import AxisField, pose
from chipload.planning.impeller.clearance.clearance import between
from chipload.planning.impeller.scallop_height import profile_scallops, scallop_heights, shares
from chipload.planning.impeller.scallop_width import reaches
from chipload.planning.impeller.scene import Floats

#: distance of the stations of a line [mm]
_APART = 0.5
#: of how far a pass reaches below the scallop, how far inside the border the outermost lines lie
_INSIDE = 0.85
#: share of the scallop that steps are laid out for, and that no station is above
_AIM, _MOST = 0.95, 0.98
#: rounds in which widths are taken anew; steps more that are tried; places across the lines; smoothness along them [mm]
_ROUNDS, _MORE, _ACROSS, _EVEN = 6, 12, 81, 2.0
#: lines, and halvings of a row, at most
_LINES, _HALVINGS = 5000, 6
#: bands at most; by how much they go on into their neighbours [mm]; what a step costs beside its stations
_EDGES, _OVERLAP, _CHANGE = 24, 1.0, 2


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
    line : (n,) number of the line, those of two bands one apart; -1: from one to the next
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
        """Its lines, one by one."""
        return tuple(PathLine(self.at[self.line == k], int(k)) for k in np.unique(self.line[self.line >= 0]))

    @property
    def length(self) -> float:
        """Length of the tip's path [mm]."""
        return float(np.linalg.norm(np.diff(self.tip, axis=0), axis=1).sum())

    @property
    def turn(self) -> float:
        """Greatest turn of the axis per millimetre of the contact's path [rad/mm]."""
        angle = np.arccos(np.clip((self.axis[1:] * self.axis[:-1]).sum(axis=1), -1.0, 1.0))
        size = np.linalg.norm(np.diff(self.tip, axis=0), axis=1)
        far = size > 1e-3
        return float((angle[far] / size[far]).max()) if far.any() else 0.0

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
    box : (low, high) of u, of v; lines run over all of the field, which may be longer
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
    job = _Lines(surface, along, np.linspace(*P, max(math.ceil(length / _APART), 8) + 1), field, cutter, scallop)
    low, high = job.border(Q[0], 1.0), job.border(Q[1], -1.0)
    inner = box[0] if along == "u" else box[1]
    need = (job.p >= inner[0] - 1e-9) & (job.p <= inner[1] + 1e-9)
    whole, steps = job.laid_out(low, high, need)
    laid: list[tuple[Floats, list[Floats]]] = []
    bands = _bands(steps, max(round(_OVERLAP / _APART), 1))
    for first, last, inside in bands:
        band = replace(job, p=job.p[first:last])
        own = need[first:last] & inside
        lines = whole if len(bands) == 1 else band.laid_out(low[first:last], high[first:last], own)[0]
        laid.append((band.p, lines if len(laid) % 2 == 0 else lines[::-1]))
    return _joined(job, laid, chord)


def _bands(steps: Floats, overlap: int) -> list[tuple[int, int, NDArray[np.bool_]]]:
    """Bands with the least path, by the steps (n,) that each station needs.

    Returns
    -------
    First station and last but one of each, and which of them are its own: the others are of its neighbours too.

    >>> [(a, b, int(own.sum())) for a, b, own in _bands(np.repeat([10.0, 4.0], 60), 2)]
    [(0, 62, 60), (58, 120, 60)]
    """
    n = len(steps)
    edges = np.unique(np.linspace(0, n, min(_EDGES, n // (4 * overlap) + 1) + 1).astype(int))
    best: list[tuple[float, list[int]]] = [(0.0, [0])]
    for k in range(1, len(edges)):
        found = []
        for j in range(k):
            first, last = max(edges[j] - overlap, 0), min(edges[k] + overlap, n)
            path = (math.ceil(float(steps[edges[j] : edges[k]].max()) - 1e-6) + 1) * (last - first + _CHANGE)
            found.append((best[j][0] + path, [*best[j][1], int(edges[k])]))
        best.append(min(found, key=lambda x: x[0]))
    out = []
    for a, b in itertools.pairwise(best[-1][1]):
        station = np.arange(max(a - overlap, 0), min(b + overlap, n))
        out.append((int(station[0]), int(station[-1]) + 1, (station >= a) & (station < b)))
    return out


@dataclass(frozen=True, eq=False)
class _Lines:
    surface: BSplinePatch
    along: str
    p: Floats
    field: AxisField
    cutter: CatalogueCutter
    scallop: float

    def places(self, p: Floats, q: Floats) -> tuple[Floats, Floats]:
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
        slope = np.gradient(q, self.p)
        d = Sp + slope[:, None] * Sq
        d /= np.linalg.norm(d, axis=1)[:, None]
        return N, d, (Sq * np.cross(N, d)).sum(axis=1)

    def reach(self, q: Floats) -> tuple[Floats, Floats]:
        """How far (n,), (n,) [mm] the pass of a line stays below the scallop towards a growing q, and against it."""
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
        half = np.clip(q + 0.5 * w / np.abs(size), 0.0, 1.0)
        _, _, size = self.across(half)
        return np.clip(q + w / np.abs(size), 0.0, 1.0)

    def border(self, q: float, sign: float) -> Floats:
        """The outermost line: inside the border q by how far its pass stays below the scallop."""
        line = np.full(len(self.p), q)
        out = line
        for _ in range(3):
            ahead, behind = self.reach(out)
            w = _INSIDE * gaussian_filter1d(behind if sign > 0.0 else ahead, self._even, mode="nearest")
            out = self.moved(line, sign * w)
        return out

    @property
    def _even(self) -> float:
        return _EVEN / _APART

    def density(self, low: Floats, high: Floats, t: Floats) -> Floats:
        """(k, n) steps for a growth of t (k,) by 1 on the way from ``low`` to ``high``, by two passes side by side."""
        out = np.empty((len(t), len(self.p)))
        for k, share in enumerate(t):
            q = low + share * (high - low)
            ahead, behind = self.reach(q)
            out[k] = np.abs(self.across(q)[2]) * (high - low) / np.maximum(ahead + behind, 1e-3)
        return out

    def laid_out(self, low: Floats, high: Floats, need: NDArray[np.bool_]) -> tuple[list[Floats], Floats]:
        """Lines from ``low`` to ``high`` (n,), all of which are milled, and N (n,) that each station needs.

        ``need`` : stations (n,) at which the scallop counts; elsewhere lines go on as at the nearest of these.
        """
        where = np.flatnonzero(need)
        near = where[np.abs(where - np.arange(len(need))[:, None]).argmin(axis=1)]
        if (high <= low).all():
            return [0.5 * (low + high)], np.zeros(len(self.p))
        high = np.maximum(high, low)
        t = np.linspace(0.0, 1.0, _ACROSS)
        density = self.density(low, high, t)[:, near]
        aim, more = _AIM * self.scallop, 0
        best: tuple[list[Floats], Floats] | None = None
        before = 0, 0.0
        for turn in range(_ROUNDS + _MORE):
            even = gaussian_filter1d(density, self._even, axis=1, mode="nearest")
            steps = np.concatenate([np.zeros((1, len(self.p))), 0.5 * (even[1:] + even[:-1]).cumsum(axis=0)]) * t[1]
            count = max(math.ceil(float(steps[-1].max()) - 1e-6), 1) + more
            if count > _LINES:
                raise InputError(f"scallop = {self.scallop:g} mm: more than {_LINES} lines: raise it")
            share = np.array([
                np.interp(np.arange(count + 1) / count * own[-1], own, t) if own[-1] > 0.0
                else np.linspace(0.0, 1.0, count + 1) for own in steps.T
            ]).T  # fmt: skip
            lines = [low + s * (high - low) for s in share]
            crest = np.array([self.scallops(a, b) for a, b in itertools.pairwise(lines)])
            highest = float(crest[:, need].max())
            if highest <= _MOST * self.scallop and (best is None or count < len(best[0]) - 1):
                best = lines, steps[-1]
            still = abs(count - before[0]) < 1 and abs(highest - before[1]) < 0.005 * highest
            before = count, highest
            if turn >= _ROUNDS or still or more:
                if best is not None:
                    return best
                more += 1
                continue
            # what the distance of two lines and the scallop between them say of the width there
            middle, size = 0.5 * (share[1:] + share[:-1]), np.diff(share, axis=0)
            found = np.sqrt(np.clip(crest, 0.1 * aim, None) / aim) / np.maximum(size, 1e-9)
            density = np.array([np.interp(t, x, y) for x, y in zip(middle.T, found.T, strict=True)]).T[:, near]
        raise InputError(
            f"scallop = {self.scallop:g} mm: {len(lines)} lines leave {highest:.4f} mm: the cutter does not fit"
        )

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


def _joined(job: _Lines, laid: list[tuple[Floats, list[Floats]]], chord: float) -> PointPath:
    """All lines there and back, from one to the next on the surface, with as many rows as the chord asks for."""
    p: list[Floats] = []
    q: list[Floats] = []
    number: list[NDArray[np.int64]] = []
    k = row = 0
    for places, lines in laid:
        for line in lines:
            way = slice(None) if row % 2 == 0 else slice(None, None, -1)
            if row:
                share = np.linspace(0.0, 1.0, 6)[1:-1]
                p.append(p[-1][-1] + share * (places[way][0] - p[-1][-1]))
                q.append(q[-1][-1] + share * (line[way][0] - q[-1][-1]))
                number.append(np.full(len(share), -1))
            p.append(places[way])
            q.append(line[way])
            number.append(np.full(len(line), k))
            k, row = k + 1, row + 1
        # lines of two bands are no neighbours
        k += 1
    P, Q, of = np.concatenate(p), np.concatenate(q), np.concatenate(number)
    # rows that the chord does not need are left out, and added again where it does
    keep = np.ones(len(P), dtype=np.bool_)
    keep[1:-1] = (np.arange(1, len(P) - 1) % 4 == 0) | (of[1:-1] != of[2:]) | (of[1:-1] != of[:-2])
    P, Q, of = P[keep], Q[keep], of[keep]
    for _ in range(_HALVINGS):
        tip, axis, _ = job.poses(P, Q)
        half = 0.5 * (P[1:] + P[:-1]), 0.5 * (Q[1:] + Q[:-1])
        there, turned, _ = job.poses(*half)
        even = between(axis[:-1], axis[1:], np.full(len(half[0]), 0.5))
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
