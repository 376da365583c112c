"""Time of each contact point of a side by cutter and table angle: first a lower bound, then the proved value on
request.

Notation: c contact point, k cutter, t table angle, B pallet angle; w step-over (``step_over.py``); the strips of a side
follow each other across u (order 0, the paths run along v) or across v (order 1).

The path of a contact point is its area / w, with the widest w of the B in its valid ranges, of a grid of ``STEP`` over
all B that the machine allows; where no B of the grid is valid, w at the middle of the widest range, but not above the
bound. Before the ranges are calculated, the widest w of the B of the grid at which the cutting part is clear (if there
is none: of all B) gives the bound: a cutter that the bounds of the search do not exclude takes at least that long.
Ranges are calculated once, and only for what is requested.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.catalogue import Catalogue
from chipload.errors import InputError
from chipload.planning.impeller.answer import Answer, left_open, shortest
from chipload.planning.impeller.kept import Keep, anew
from chipload.planning.impeller.pallet_grid import largest_on_grid
from chipload.planning.impeller.pallet_ranges import FULL, Ranges, valid_ranges
from chipload.planning.impeller.scene import Floats, Scene
from chipload.planning.impeller.step_over import Contact, contact_of, width

#: spacing of the pallet angles at which the step-over is calculated [rad]
STEP = math.radians(5.0)
_TOUCH = 1e-9  # [mm] the bounds are so much on the safe side
_ALONG = 1e-9  # n within this of 1: the axis stands along the normal, there is no trace


@dataclass(frozen=True)
class Terms:
    """Data from which the time of a path is calculated.

    Parameters
    ----------
    feed : [mm/s] of every cutter, or one for each of the catalogue
    scallop : height [mm]
    cutter_change, table_change : [s]
    repeats : how often each side is there (blades), milled before the cutter is changed
    """

    feed: float | tuple[float, ...]
    scallop: float
    cutter_change: float
    table_change: float
    repeats: int = 1

    def __post_init__(self) -> None:
        for value in self.feed if isinstance(self.feed, tuple) else (self.feed,):
            if not 0.0 < value < math.inf:
                raise InputError(f"feed_mm_s = {value:g}: must be above 0")
        if not 0.0 < self.scallop < math.inf:
            raise InputError(f"scallop_mm = {self.scallop:g}: must be above 0")
        if self.repeats < 1:
            raise InputError(f"repeats = {self.repeats}: must be at least 1")

    def feeds(self, cutters: int) -> Floats:
        """Feed of each cutter (cutters,) [mm/s]."""
        if isinstance(self.feed, tuple) and len(self.feed) != cutters:
            raise InputError(f"feed_mm_s: {len(self.feed)} numbers: must be one or {cutters}, one for each cutter")
        return np.broadcast_to(np.asarray(self.feed, dtype=np.float64), (cutters,))


@dataclass(frozen=True, eq=False)
class ChannelSide:
    """One side of a channel as a grid of contact points.

    Parameters
    ----------
    body, side : as :class:`Patch`
    scene : its contact points, a x b, v the faster
    u, v : (a,), (b,) of the contact points, ascending
    area : (a b,) what each stands for [mm2]
    answer : of :func:`largest_cutters` with ``every``
    clearance, pallets : of the search
    """

    body: int
    side: str
    scene: Scene
    u: Floats
    v: Floats
    area: Floats
    answer: Answer
    clearance: float = 0.0
    pallets: ArrayLike = FULL

    def __post_init__(self) -> None:
        points = len(self.scene.contact)
        if min(len(self.u), len(self.v)) < 2 or len(self.u) * len(self.v) != points:
            given = f"u {len(self.u)}, v {len(self.v)}, {points} contact points"
            raise InputError(f"side {self.side}: {given}: must be a grid of at least 2 x 2")
        if len(self.area) != points or len(self.answer.cutter) != points:
            raise InputError(f"side {self.side}: area and answer must have {points} contact points")

    @property
    def shape(self) -> tuple[int, int]:
        """Number of contact points (a, b) along u and v."""
        return len(self.u), len(self.v)

    def edges(self, order: int) -> Floats:
        """Edges of the strips of an order: half-way between the contact points."""
        x = self.u if order == 0 else self.v
        return np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])

    def points(self, order: int) -> NDArray[np.int64]:
        """Contact points of each strip (strips, cells)."""
        grid = np.arange(len(self.scene.contact)).reshape(self.shape)
        return grid if order == 0 else grid.T

    def along(self, order: int) -> Floats:
        """Direction of the paths of an order (c, 3)."""
        grid = self.scene.contact.reshape(*self.shape, 3)
        return np.array(np.gradient(grid, (self.u, self.v)[1 - order], axis=1 - order)).reshape(-1, 3)


class MeasuredCost(NamedTuple):
    """Time of a patch [s] in a program and as its contact points predict it; order, cutter, table of its side."""

    order: int
    cutter: int
    table: int
    predicted: float
    programmed: float


class Costs:
    """Times of one side, proved or bounded; :meth:`prove` adds proved ones.

    Attributes
    ----------
    time : (2, c, k, t) [s] of an order; inf: not valid
    known : (c, k, t) bool; else ``time`` is a bound from below
    ranges : of what is known and valid, by (c, k, t)
    computed : how many ranges were computed
    factor : (2, k, t) by what the programs take longer than ``time``, for an order of strips; 1 until it is measured
    """

    def __init__(self, side: ChannelSide, tables: Floats, terms: Terms, workers: int = 1) -> None:
        self.side, self.tables, self.terms = side, tables, terms
        self.catalogue: Catalogue = side.answer.catalogue
        self.ranges: dict[tuple[int, int, int], Floats] = {}
        self.computed = 0
        self.undecided = 0
        spans = np.asarray(side.pallets, dtype=np.float64).reshape(-1, 2)
        self._grid = np.concatenate(
            [np.linspace(lo, hi, max(math.ceil((hi - lo) / STEP), 1) + 1) for lo, hi in spans.tolist()]
        )
        where = [int(np.abs(tables - a).argmin()) for a in side.answer.tables]
        self._where = np.array(where)
        self._feed = terms.feeds(len(self.catalogue.cutters))
        points, K, T = len(side.scene.contact), len(self.catalogue.cutters), len(tables)
        reached = side.answer.cutter >= 0
        self.time: Floats = np.full((2, points, K, T), np.inf)
        allowed = self._open(reached)
        clear = self._clear(allowed, workers)
        for order in range(2):
            seen = self._see_contacts(order, np.repeat(np.arange(points), T), np.tile(tables, points), self._grid)
            for k in range(K):
                free = self._widths(seen, k)
                w = np.where(clear[:, k].reshape(free.shape), free, 0.0).max(axis=1)
                w = np.where(w > 0.0, w, free.max(axis=1)).reshape(points, T)
                self.time[order, :, k] = np.where(allowed[:, k], self._paid(w, np.arange(points), k), np.inf)
        self.time[:, ~reached] = 0.0
        self.factor: Floats = np.ones((2, K, T))
        self.known = np.array(np.isinf(self.time).all(axis=0), dtype=np.bool_)
        self.known[~reached] = True

    def cells(self, order: int) -> Floats:
        """Times of an order (strips, cells, k, t), as programs take them."""
        out: Floats = self.time[order][self.side.points(order)] * self.factor[order]
        return out

    def measured(self, rows: Sequence[MeasuredCost]) -> None:
        """Take the factors from programs; a patch that is in no program takes the mean of its order, or of all.

        A patch of which no contact point is reached predicts no time: its program does not describe the others.
        """
        rows = [r for r in rows if r.predicted > 0.0]
        if not rows:
            return

        def ratio(some: Sequence[MeasuredCost]) -> float:
            return math.fsum(r.programmed for r in some) / math.fsum(r.predicted for r in some)

        whole = ratio(rows)
        for order in range(2):
            own = [r for r in rows if r.order == order]
            self.factor[order] = ratio(own) if own else whole
            for key in {(r.cutter, r.table) for r in own}:
                self.factor[order, key[0], key[1]] = ratio([r for r in own if (r.cutter, r.table) == key])

    def prove(self, pairs: Sequence[tuple[int, int, int]], workers: int = 1, keep: Keep = anew) -> None:
        """Prove the times (c, k, t)."""
        groups: dict[int, list[tuple[int, int]]] = {}
        for point, cutter, table in sorted(set(pairs)):
            if not self.known[point, cutter, table]:
                groups.setdefault(cutter, []).append((point, table))
        for k, members in groups.items():
            which = np.array(members)
            c, t = which[:, 0], which[:, 1]
            got = self._prove_ranges(c, k, t, workers, keep)
            self.computed += len(c)
            self.undecided += int((~got.complete).sum())
            self.known[c, k, t] = True
            feasible = np.array([len(rows) > 0 for rows in got.ranges])
            self.time[:, c[~feasible], k, t[~feasible]] = np.inf
            if not feasible.any():
                continue
            c, t, rows = c[feasible], t[feasible], [r for r in got.ranges if len(r)]
            for one in zip(c.tolist(), t.tolist(), rows, strict=True):
                self.ranges[one[0], k, one[1]] = one[2]
            valid = np.array([_in_ranges(self._grid, r) for r in rows])
            middle = np.array([[r[(r[:, 1] - r[:, 0]).argmax()].mean()] for r in rows])
            for order in range(2):
                free = self._widths(self._see_contacts(order, c, self.tables[t], self._grid), k)
                inside = np.where(valid, free, 0.0).max(axis=1)
                w = np.where(
                    inside > 0.0, inside, self._widths(self._see_contacts(order, c, self.tables[t], middle), k)[:, 0]
                )
                # a step-over of nothing: the cutter does not fit there, whatever its ranges
                paid = np.where(w > 0.0, self._paid(w[:, None], c, k)[:, 0], np.inf)
                self.time[order, c, k, t] = np.maximum(self.time[order, c, k, t], paid)

    def _prove_ranges(self, c: NDArray[np.int64], k: int, t: NDArray[np.int64], workers: int, keep: Keep) -> Ranges:
        """Ranges of a cutter at contact points and table angles."""
        side, cutter = self.side, self.catalogue.cutters[k]
        return keep(
            ("ranges", side.body, side.side, cutter, self.tables[t], c),
            lambda: valid_ranges(side.scene, cutter, self.tables[t], side.clearance, side.pallets, c, workers=workers),
        )

    def _paid(self, w: Floats, points: NDArray[np.int64], k: int) -> Floats:
        """Time [s] (c, n) of contact points at step-overs (c, n)."""
        area = self.side.area[points][:, None]
        out: Floats = np.divide(area, w, out=np.full(w.shape, np.inf), where=w > 0.0) / self._feed[k]
        return out

    def _open(self, reached: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(c, k, t) what the bounds of the search leave open."""
        answer = self.side.answer
        out = np.zeros((len(reached), len(self.catalogue.cutters), len(self.tables)), dtype=np.bool_)
        for k, cutter in enumerate(self.catalogue.cutters):
            family = next(f for f in answer.families if f.corner_radius == cutter.corner_radius)
            out[:, k, self._where] = left_open(family, cutter.rho)
        return np.array(out & reached[:, None, None], dtype=np.bool_)

    def _clear(self, allowed: NDArray[np.bool_], workers: int) -> NDArray[np.bool_]:
        """(c, k, t, B) where the cutting part is clear on the grid, or touches."""
        answer, out = self.side.answer, np.zeros((*allowed.shape, len(self._grid)), dtype=np.bool_)
        limit = {}
        for f in answer.families:
            cut = shortest(self.catalogue.family(f.corner_radius))
            limit[f.corner_radius] = largest_on_grid(self.side.scene, f, self._grid, cut, workers)
        for k, cutter in enumerate(self.catalogue.cutters):
            out[:, k, self._where] = cutter.rho <= limit[cutter.corner_radius] + _TOUCH
        return np.array(out & allowed[..., None], dtype=np.bool_)

    def _see_contacts(self, order: int, points: NDArray[np.int64], tables: Floats, pallets: Floats) -> _Seen:
        """The contacts of points (n,) at table angles (n,) and pallet angles (B,) of all, or (n, B)."""
        scene = self.side.scene
        B = np.broadcast_to(pallets, (len(points), np.shape(pallets)[-1]))
        s, z = np.sin(tables)[:, None], np.cos(tables)[:, None]
        T = np.stack([s * np.cos(B), s * np.sin(B), np.broadcast_to(z, B.shape)], axis=-1)
        n = np.einsum("ci,cbi->cb", scene.normal[points], T)
        which = np.nonzero((n >= 0.0) & (n < 1.0 - _ALONG))
        at = points[which[0]]
        return _Seen(
            B.shape, which, contact_of(scene.normal[at], T[which], self.side.along(order)[at], scene.curvature[at])
        )

    def _widths(self, seen: _Seen, k: int) -> Floats:
        """Step-overs (n, B), 0 where the axis points into the surface or stands along its normal."""
        cutter = self.catalogue.cutters[k]
        out = np.zeros(seen.shape)
        out[seen.which] = width(seen.contact, cutter.rho, cutter.corner_radius, self.terms.scallop)
        return out


class _Seen(NamedTuple):
    shape: tuple[int, ...]
    which: tuple[NDArray[np.int64], ...]
    contact: Contact


def _in_ranges(grid: Floats, ranges: Floats) -> NDArray[np.bool_]:
    """(B,) whether an angle, or one that is whole turns from it, lies in a range."""
    turn = 2.0 * math.pi
    away = (grid[:, None] - ranges[None, :, 0]) % turn
    return np.array((away <= ranges[:, 1] - ranges[:, 0]).any(axis=1), dtype=np.bool_)
