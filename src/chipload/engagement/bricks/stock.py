"""The stock as the moves that cut it, for a cutter whose axis leans or turns: an index of bricks.

Notation: as in :mod:`chipload.engagement.bricks._sweep`. A brick is ``BRICK`` of the smallest cutter radius wide, or
as much wider as memory requires; it decides which moves are searched at a point and what that costs, not the answer.
Bricks are kept in blocks of 8 x 8 x 8 where moves left a surface: memory follows the surface. A cutter ends where its
flutes end; a step with material there is reported. Each row of teeth of a thread mill makes a move of its own, and is
looked at in the material before the step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon

from chipload.cutter.cutter import Cutter
from chipload.cutter.record import MOST, cutter_record
from chipload.engagement.moves.net import area_of, nodes_of, rings
from chipload.engagement.moves.stock import INSTANT, Engaged, faces_of, side_radii, tables_of_parts, walls_of
from chipload.lazy import LateModule, trimesh

_sweep = LateModule("chipload.engagement.bricks._sweep")
front = LateModule("chipload.engagement.bricks._contact")
index = LateModule("chipload.engagement.bricks._index")
outline = LateModule("chipload.engagement.bricks._outline")
points_in = LateModule("chipload.engagement.bricks._points")
moves_circle = LateModule("chipload.engagement.moves._circle")
initial = LateModule("chipload.engagement.moves._initial_faces")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: side of a brick over the smallest cutter radius; most blocks of bricks
BRICK, BLOCKS = 0.2, 4_000_000
#: instants of a step that does not cut as the one before it, and of one that enters or leaves; of longer steps, of each
#: of their parts
MORE = (3, 9)
#: most that the axis may turn in a step [rad], for which its sine is found to rounding
TURN = 0.1
#: axes that differ by less than this do not turn [rad]
FIXED = 1e-12
#: slices of a range in contact, at least: bottom and flank of a leaning cutter have slices as a corner has
FEW = 12
#: ranges of a part of the profile that are distinguished
RANGES = 32


def move_rows(p0: Floats, p1: Floats, a0: Floats, a1: Floats) -> Floats:
    """(n, 23) moves from tips and axes (n, 3) at their starts and ends.

    >>> move_rows(np.zeros((1, 3)), np.ones((1, 3)), np.eye(3)[2:], np.eye(3)[2:])[0, 3:9].tolist()
    [1.0, 1.0, 1.0, 0.0, 0.0, 1.0]
    """
    a0, a1 = (a / np.linalg.norm(a, axis=1)[:, None] for a in (a0, a1))
    theta = 2.0 * np.arctan2(np.linalg.norm(a1 - a0, axis=1), np.linalg.norm(a1 + a0, axis=1))
    theta = np.where(theta > FIXED, theta, 0.0)
    turns = theta > 0.0
    # any direction across an axis that does not turn
    least = np.eye(3)[np.argmin(np.abs(a0), axis=1)]
    across = np.where(turns[:, None], a1 - a0, least)
    across = across - (across * a0).sum(axis=1)[:, None] * a0
    b = across / np.linalg.norm(across, axis=1)[:, None]
    cosine, sine = np.cos(theta)[:, None], np.sin(theta)[:, None]
    u, n = p1 - p0, np.cross(a0, b)
    length = np.linalg.norm(u, axis=1)
    products = (-(u * v).sum(axis=1) for v in (n, b * cosine - a0 * sine, a0 * cosine + b * sine))
    bend = (theta + 2.0) * length
    return np.column_stack(
        [p0, u, a0, b, theta, length, n, *products, -2.0 * np.sin(0.5 * theta) ** 2, np.sin(theta), bend]
    )


class BrickStock:
    """An initial body and the moves that were made in it, whose axes may lean and turn.

    Parameters
    ----------
    low, high : (3,) float [mm], of the body
    cutters : by tool number
    body : closed mesh; None: the block from ``low`` to ``high``

    Attribute ``more``: instants of steps that are unlike the one before, as :data:`MORE`.

    Examples
    --------
    A mill of 10 mm that leans 45 degrees across its way along y, its tip 10 mm deep: 10 x 10 x sqrt(2) mm^3 a mm.

    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    >>> stock = BrickStock(np.array([-20.0, -20.0, -20.0]), np.array([20.0, 20.0, 10.0]), {1: mill})
    >>> p = np.array([[0.0, -26.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> axis = np.tile([0.5**0.5, 0.0, 0.5**0.5], (2, 1))
    >>> found = stock.take(p[:-1], p[1:], axis, axis, np.array([1, 1]), corner_slices=12, flank_mm={1: 2.0})
    >>> float(found.volume[found.step == 1].round(0)[0])
    141.0
    """

    def __init__(
        self, low: Floats, high: Floats, cutters: Mapping[int, Cutter], body: trimesh.Trimesh | None = None
    ) -> None:
        self.low, self.high = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
        self.table = dict(cutters)
        self.tools = {n: i for i, n in enumerate(sorted(cutters))}
        self.tooth_rows = {n: c.tooth_rows for n, c in cutters.items() if c.tooth_rows > 1}
        self.cutters = np.concatenate([cutter_record(cutters[n]) for n in self.tools])
        size = self.high - self.low
        side = max(
            BRICK * float(self.cutters["wide"].min()),
            (float(size.prod()) / (index.MANY * BLOCKS)) ** (1.0 / 3.0),
        )
        count = np.maximum(np.ceil(size / side - 1e-9), 1.0)
        self.grid = np.array([*self.low, *(size / count)])
        blocks = np.ceil(count / index.SIDE)
        self.shape = np.array([*count, *blocks], dtype=np.int64)
        self.blocks = np.full(int(blocks.prod()), index.UNTOUCHED, dtype=np.int32)
        self.bricks, self.alive = np.empty((64 * index.MANY, 3), dtype=np.int32), np.empty(64, dtype=np.int32)
        self.kept, self.used = np.empty(1 << 16, dtype=np.int32), np.array([0, 0, -1])
        self.moves, self.of, self.count = np.empty((1024, 23)), np.empty(1024, dtype=np.int64), 0
        self.body, self.more, self.floor = body, MORE, math.inf
        self.plan, self.plan_shape = self.grid[[0, 1, 3, 4]].copy(), self.shape[:2].copy()
        cells = int(self.plan_shape.prod()) if body is not None else 1
        self.level, self.first = np.empty((cells, 3)), np.zeros(cells + 1, dtype=np.int64)
        self.ids, self.faces = np.empty(0, dtype=np.int32), np.empty((0, 12))
        if body is not None:
            self.faces = faces_of(body)
            initial.faces_over_cells(self.faces, self.plan, self.plan_shape, self.first, self.ids)
            self.ids = np.empty(int(self.first[-1]), dtype=np.int32)
            initial.faces_over_cells(self.faces, self.plan, self.plan_shape, self.first, self.ids)
            initial.levels(self.faces, self.plan, self.plan_shape, self.first, self.ids, self.level)
            initial.mark_upright_faces(walls_of(body), self.plan, self.plan_shape, self.level)

    def cropped(self, low: Floats, high: Floats) -> BrickStock | None:
        """The initial body in a box, in which no move was made; None where it does not reach into it.

        Parameters
        ----------
        low, high : (3,) float [mm], of the box; above and below it the body stays
        """
        a, b = self.low.copy(), self.high.copy()
        a[:2], b[:2] = np.maximum(a[:2], low[:2]), np.minimum(b[:2], high[:2])
        return BrickStock(a, b, self.table, self.body) if (a < b).all() else None

    def _index(self) -> tuple[NDArray[np.generic], ...]:
        lists = (self.blocks, self.bricks, self.kept, self.alive)
        body = (self.low, self.high, self.plan, self.plan_shape, self.level, self.first, self.ids, self.faces)
        return (self.grid, self.shape, *lists, self.moves, self.of, self.cutters, *body)

    def _enter(self, rows: Floats, tool: Ints) -> None:
        while self.count + len(rows) > len(self.moves):
            self.moves = np.concatenate([self.moves, np.empty_like(self.moves)])
            self.of = np.concatenate([self.of, np.empty_like(self.of)])
        end = self.count + len(rows)
        self.moves[self.count : end] = rows
        numbers, at = np.unique(tool, return_inverse=True)
        of = np.array([self.tools[n] for n in numbers.tolist()], dtype=np.int64)[at.ravel()]
        self.of[self.count : end] = of
        self.count = end
        if len(rows):
            wide, tall = self.cutters["wide"][of], self.cutters["height"][of]
            # the axis leans at most by what it turns more than at the start
            down = np.maximum(-rows[:, 8], 0.0) + rows[:, 12]
            tips = np.minimum(rows[:, 2], rows[:, 2] + rows[:, 5])
            self.floor = min(self.floor, float((tips - wide - down * tall).min()))

    def _grow(self) -> None:
        """Extend the lists by half, and double the space for blocks."""
        blocks = int(self.used[1])
        if 2 * blocks > len(self.alive):
            self.bricks = np.concatenate([self.bricks, np.empty_like(self.bricks)])
            self.alive = np.concatenate([self.alive, np.empty_like(self.alive)])
        need = int(np.maximum(self.bricks[: blocks * index.MANY, 1], 0).sum())
        fresh = np.empty((1 << 17) + 3 * need, dtype=np.int32)
        self.used[0] = index.pack_lists(self.bricks, self.kept, fresh, blocks)
        self.kept = fresh

    def forget(self) -> None:
        """Drop the index and the moves, which grow with the program, when the stock is no longer used."""
        self.kept = self.alive = self.blocks = np.empty(0, dtype=np.int32)
        self.bricks = np.empty((0, 3), dtype=np.int32)
        self.moves, self.of = np.empty((0, 23)), np.empty(0, dtype=np.int64)

    def instants(self, rows: Floats, tool: Ints, finer: Floats | float = 1.0) -> Ints:
        """Return the number of instants (n,) at which each step is calculated: odd, to include the middle.

        Parameters
        ----------
        finer : (n,) float, how many times as close
        """
        of = np.array([self.tools[n] for n in tool.tolist()], dtype=np.int64)
        length = finer * (rows[:, 13] + rows[:, 12] * self.cutters["height"][of])
        more = np.maximum(0.5 * (length / (INSTANT * self.cutters["wide"][of]) - 1.0), 0.0)
        return np.asarray(2 * np.ceil(more - 1e-9).astype(np.int64) + 1)

    def skip(self, p0: Floats, p1: Floats, a0: Floats, a1: Floats, tool: Ints) -> None:
        """Make steps without calculating their engagement."""
        rows, tool, group = self._moves(p0, p1, a0, a1, tool)
        self._run(rows, tool, group, np.zeros(len(rows), dtype=np.int64), 1, dict.fromkeys(self.tools, 1.0))

    def take(
        self,
        p0: Floats,
        p1: Floats,
        a0: Floats,
        a1: Floats,
        tool: Ints,
        *,
        corner_slices: int,
        flank_mm: Mapping[int, float],
        finer: Floats | float = 1.0,
        looked: NDArray[np.bool_] | bool = True,
    ) -> Engaged:
        """Make steps one after the other and return the engagement of each.

        Parameters
        ----------
        p0, p1 : (n, 3) float [mm], tip at the start and the end of each
        a0, a1 : (n, 3) float, axis there; it turns evenly between them, by at most ``TURN``
        tool : (n,) int
        corner_slices : slices of a range of a corner in contact, taken as ``FEW`` at least
        flank_mm : longest slice of the flank by tool number [mm]
        finer : (n,) float, how many times as close its instants are
        looked : (n,) bool, False: it is made without looking at what it engages
        """
        each, seen = np.broadcast_to(finer, len(tool)), np.broadcast_to(looked, len(tool))
        rows, tool, group = self._moves(p0, p1, a0, a1, tool)
        of = np.cumsum(group > 0) - 1
        count = np.where((group > 0) & seen[of], self.instants(rows, tool, each[of]), 0)
        found = self._run(rows, tool, group, count, corner_slices, flank_mm)
        if not self.tooth_rows:
            return found
        return replace(found, step=(np.cumsum(group > 0) - 1)[found.step])

    def _moves(self, p0: Floats, p1: Floats, a0: Floats, a1: Floats, tool: Ints) -> tuple[Floats, Ints, Ints]:
        """Moves, the tool of each, and of how many rows of teeth it begins a step: 1, or of a thread mill with several
        all at its lowest row, 0 at the others.
        """
        if not self.tooth_rows:
            return move_rows(p0, p1, a0, a1), tool, np.ones(len(tool), dtype=np.int64)
        count = np.array([self.tooth_rows.get(n, 1) for n in tool.tolist()], dtype=np.int64)
        of = np.repeat(np.arange(len(tool)), count)
        up = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
        tall = self.cutters["height"][[self.tools[n] for n in tool[of].tolist()]]
        q0, q1 = (p[of] + (up * tall)[:, None] * a[of] for p, a in ((p0, a0), (p1, a1)))
        return move_rows(q0, q1, a0[of], a1[of]), tool[of], np.where(up == 0, count[of], 0)

    def _work(self, pieces: int) -> tuple[NDArray[Any], ...]:
        wide = float(self.cutters["wide"].max())
        apart = min(front.BRICKS * float(self.grid[3:].min()) / wide, moves_circle.APART)
        room = int(math.tau / (apart * min(front.SLICES / pieces, 1.0))) + 8
        return (
            np.empty((room, 2)), np.empty(5), np.empty(9), np.empty(9), np.empty((MOST, 2)),
            np.zeros((MOST, RANGES, 7)), np.empty((_sweep.WAIT, 6)), np.empty(18), np.zeros(1),
            np.empty(2, dtype=np.int64), np.zeros(MOST, dtype=np.int64),
        )  # fmt: skip

    def _run(
        self, moves: Floats, tool: Ints, group: Ints, instants: Ints, pieces: int, flank_mm: Mapping[int, float]
    ) -> Engaged:
        begin, pieces = self.count, max(pieces, FEW)
        self._enter(moves, tool)
        flank = np.array([flank_mm[n] for n in self.tools])
        capacity = 16 * max(int(instants.sum()), 1) + 256
        slices, rows, owner = (
            np.empty((capacity, 9)),
            np.empty((2 * capacity, 2)),
            np.empty(2 * capacity, dtype=np.int64),
        )
        entry, out = np.empty((capacity, 3), dtype=np.int64), np.empty((capacity, 19))
        state = np.array([begin, 0, 0, 0, 0, *self.more])
        nodes = tables_of_parts(pieces)
        at, work = 0, self._work(pieces)
        while True:
            at = int(
                front.run(
                    at,
                    group,
                    instants,
                    state,
                    self._index(),
                    work,
                    nodes,
                    flank,
                    slices,
                    rows,
                    owner,
                    entry,
                    out,
                    self.used,
                )
            )
            if at == len(moves):
                break
            if state[1] > 0:
                self._grow()
            else:
                slices = np.concatenate([slices, np.empty_like(slices)])
                rows, owner = np.concatenate([rows, np.empty_like(rows)]), np.concatenate([owner, np.empty_like(owner)])
                entry, out = np.concatenate([entry, np.empty_like(entry)]), np.concatenate([out, np.empty_like(out)])
        _, _, b, k, m, *_ = state.tolist()
        step, out = entry[:m, 0], out[:m]
        return Engaged(
            step.copy(), entry[:m, 1].copy(), instants[step], np.append(entry[:m, 2], b), rows[:b], owner[:b],
            slices[:k], out[:, 0], out[:, 1].astype(np.int64), out[:, 2:4], out[:, 4:7], out[:, 7], out[:, 9],
            out[:, 8] > 0.0, out[:, 10:19].reshape(-1, 3, 3),
        )  # fmt: skip

    def contains(self, points: Floats) -> NDArray[np.bool_]:
        """Return which points (n, 3) [mm] are in material: in the initial body, and in no volume that a move swept."""
        at = np.ascontiguousarray(points, dtype=np.float64)
        inside = np.empty(len(at), dtype=np.bool_)
        points_in.mark_points(at, self._index(), inside)
        # of a stock thinner than a cell the one cell reaches beyond it
        return inside & (at >= self.low).all(axis=1) & (at <= self.high).all(axis=1)

    def lowest(self) -> float:
        """Return a height [mm] below which nothing was cut."""
        return max(self.floor, float(self.low[2]))

    def outlines(self, z: float, tolerance: float) -> MultiPolygon:
        """Return the outlines of the swept area at a height, within the box of the body and a little beyond: see
        :meth:`chipload.engagement.moves.stock.MoveStock.outlines`.
        """
        xs, ys = nodes_of(
            self.low, self.high, float(self.grid[3:5].min()), float(side_radii(self.cutters).min()), tolerance
        )
        inside = np.empty((len(xs), len(ys)), dtype=np.bool_)
        found = self._index()
        outline.mark_nodes(z, xs, ys, found, inside)
        sides, first = rings(inside)
        points = np.empty((len(sides), 2))
        outline.place_borders(z, xs, ys, found, inside, sides, points)
        return area_of(points, first, tolerance)
