"""Trochoidal cutting of channels: circles of the cutter's centre that advance along the middle line.

Notation: R cutter radius, rho [mm] radius of a circle, p [mm] its advance beyond the one before. With equal circles in
a straight channel the leading point P is where the cutter's circle about O = rho (cos t, sin t) crosses that of radius
rho + R about (-p, 0); the angle between P and the contact is the engagement, greatest near t = 0. Here the engagement
is that in the stock, and p is the greatest that keeps a*. Only the part of a circle that cuts is run; from its end a
link leads to the next one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from chipload.geometry.contour import Region
from chipload.geometry.distance import distance
from chipload.lazy import LateModule
from chipload.stock.planar import TOUCH, PlanarStock

_fit = LateModule("chipload.planning.pocket._fit")
_trochoid = LateModule("chipload.planning.pocket._trochoid")

Floats = NDArray[np.float64]

#: greatest radius of a circle / R; that of the bore
WIDEST = 0.9
#: what a circle keeps off the walls, over the room, for a pass along the wall; below a room / R only a film over R
OFF, NARROW, FILM = 0.02, 0.35, 1e-4
#: least radius, and greatest and least advance / R
LEAST, FARTHEST, SLOWEST = 0.005, 0.5, 2e-4
#: spacing / R of places on the middle line
SPACING = 0.05
#: spacing / R of the places on the walls that it lies between
WALLS = 0.03
#: places of a circle that are checked first, and halvings of the advance
PLACES, HALVINGS = 48, 9
#: greatest sweep of one arc [rad]
SWEEP = 2.0


class Trochoid:
    """Circles along one branch of the middle line, in the stock of a clearing."""

    def __init__(
        self, stock: PlanarStock, region: Region, radius: float, allowance: float, limits: tuple[float, float]
    ) -> None:
        self.stock, self.walls, self.radius = stock, region.segments, radius
        self.off = radius + allowance
        self.limit, self.most_engaged = limits
        self.seg = np.empty(7)
        self.met = np.zeros(PLACES, dtype=np.bool_)

    def circles(self, line: Floats, rho: float) -> Iterator[tuple[Floats, Floats]]:
        """The arcs (m, 7) of each circle along a polyline (k, 2), with the greatest engagement (m,) of each [rad].

        ``rho`` is the radius that is free about the beginning of the line. Each circle is taken from the stock when
        the next one is requested. It ends early where even the least advance would exceed the engagement.
        """
        R = self.radius
        at, s, room = self._places(line)
        along, advance = 0.0, FARTHEST * R
        while along < s[-1] - 1e-9 * R:
            low, high = 0.0, min(FARTHEST * R, 2.0 * advance, s[-1] - along)
            found = None
            trial = high
            for _ in range(HALVINGS):
                if high < SLOWEST * R and low == 0.0:
                    break
                centre, wide = self._circle(at, s, room, along + trial, rho + trial)
                if wide >= LEAST * R and self._most(centre, wide, self.limit) <= self.limit:
                    low, found = trial, (centre, wide)
                    if trial == high:
                        break
                else:
                    high = trial
                trial = 0.5 * (low + high)
                if low > 0.0 and high - low < 0.1 * low:
                    break
            if found is None:
                return
            centre, wide = found
            self._most(centre, wide, math.inf)
            arcs = self._cutting_arcs(centre, wide, line[-1] - line[0])
            along, advance, rho = along + low, low, wide
            if not len(arcs):
                continue
            engaged = np.array([self._engagement_along(seg) for seg in arcs])
            if engaged.max() > self.most_engaged:  # it is greater between the checked places
                along, rho, advance = along - low, max(LEAST * R, wide - low), 0.45 * low
                if advance < SLOWEST * R:
                    return
                continue
            yield arcs, engaged
            self.stock.remove_segments(arcs)

    def room(self, place: Floats) -> float:
        """Distance [mm] that the centre can move from a place in any direction."""
        return max(0.0, float(distance(self.walls, place)[0]) - self.off)

    def _places(self, line: Floats) -> tuple[Floats, Floats, Floats]:
        """Places of a line at most ``SPACING`` R apart, their lengths along it and the room about them."""
        step = np.hypot(*np.diff(line, axis=0).T)
        s = np.concatenate([[0.0], np.cumsum(step)])
        kept = np.append(True, step > 0.0)
        fine = np.union1d(s, np.linspace(0.0, s[-1], max(2, math.ceil(s[-1] / (SPACING * self.radius)) + 1)))
        at = np.column_stack([np.interp(fine, s[kept], line[kept, c]) for c in (0, 1)])
        return at, fine, distance(self.walls, at) - self.off

    def _circle(self, at: Floats, s: Floats, room: Floats, along: float, most: float) -> tuple[Floats, float]:
        """Centre and radius of the circle at a length along the line; the radius is at most ``most`` [mm]."""
        centre = np.array([np.interp(along, s, at[:, 0]), np.interp(along, s, at[:, 1])])
        wide = float(np.interp(along, s, room))
        if wide < NARROW * self.radius:  # the true room is not linear between two places
            wide = float(distance(self.walls, centre)[0]) - self.off - FILM * self.radius
        else:
            wide *= 1.0 - OFF
        return centre, min(wide, WIDEST * self.radius, most)

    def _most(self, centre: Floats, rho: float, limit: float) -> float:
        s = self.stock
        return float(
            _trochoid.circle_engagement(
                centre[0], centre[1], rho, PLACES, self.radius * (1.0 - TOUCH), self.radius, limit, s.grid, s.head,
                s.link, s.axis, s.rim, self.met,
            )
        )  # fmt: skip

    def _cutting_arcs(self, centre: Floats, rho: float, ahead: Floats) -> Floats:
        """Arcs (m, 7) of the part of a circle that meets stock, a place more at both ends; all of it where it meets
        stock nearly all round.
        """
        met = np.flatnonzero(self.met)
        if not len(met):
            return np.zeros((0, 7))
        gaps = np.diff(np.append(met, met[0] + PLACES))
        k = int(np.argmax(gaps))
        if gaps[k] <= 4:
            first, sweep = math.atan2(-ahead[1], -ahead[0]), math.tau
        else:
            begin, end = int(met[(k + 1) % len(met)]) - 1, int(met[k]) + 1
            first = math.tau * begin / PLACES
            sweep = math.tau * ((end - begin) % PLACES) / PLACES
        n = max(1, math.ceil(sweep / SWEEP))
        a = first + sweep * np.arange(n + 1) / n
        p = centre + rho * np.column_stack([np.cos(a), np.sin(a)])
        return np.column_stack([p[:-1], p[1:], np.tile(centre, (n, 1)), np.full(n, sweep / n)])

    def _engagement_along(self, seg: Floats) -> float:
        """Greatest engagement along an arc."""
        s, R = self.stock, self.radius
        return float(
            _fit.engagement_along(
                seg, SPACING * R, self.most_engaged, R * (1.0 - TOUCH), R, s.grid, s.head, s.link, s.axis, s.rim
            )
        )
