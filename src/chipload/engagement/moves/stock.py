"""The stock as the moves that cut it: an initial body less the volumes that earlier moves swept.

Notation: as in :mod:`chipload.engagement.moves._sweep`. A cell of the index is ``CELL`` of the smallest cutter radius
wide, or as much wider as memory requires; it decides which moves are searched at a point and what that costs, not the
answer. The axis stands along z; a cutter is open above: what lies above its flutes counts as swept, and a step with
material there is reported.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon

from chipload.cutter.cutter import Cutter
from chipload.cutter.record import cutter_record
from chipload.engagement.moves.net import area_of, nodes_of, rings
from chipload.lazy import LateModule, trimesh

_sweep = LateModule("chipload.engagement.moves._sweep")
circle = LateModule("chipload.engagement.moves._circle")
edge = LateModule("chipload.engagement.moves._edge")
flanks = LateModule("chipload.engagement.moves._flank")
front = LateModule("chipload.engagement.moves._contact")
initial = LateModule("chipload.engagement.moves._initial_faces")
outline = LateModule("chipload.engagement.moves._outline")
points_in = LateModule("chipload.engagement.moves._points")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: side of a cell over the smallest cutter radius, and most cells
CELL, CELLS = 0.1, 4_000_000
#: least side of a cell over that
THIN = 0.1
#: entries of lists: room that is made at least, and more if the lists take as much
ROOM = (1 << 17, 1 << 22)
#: a step is evaluated once every so many cutter radii, at its middle at least
INSTANT = 0.25
#: instants of a step that is evaluated once and does not cut as the one before it, and of one that enters or leaves;
#: of longer steps, of each of their parts
MORE = (3, 25)


@lru_cache(512)
def _gauss_nodes(count: int) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss and Legendre, which take longer to find than some steps; as many counts are kept as a
    step that is calculated a second time asks for.
    """
    return np.polynomial.legendre.leggauss(count)


def corner_parts(count: int) -> Floats:
    """(count, 3) parts of 0..1 into which the engaged part of a corner is cut: from, to, and where each is evaluated.

    They are the weights and nodes of Gauss and Legendre, so that a sum over the slices is that of a smooth engagement;
    the slices are narrow at both ends, where contact begins and where the chip is thickest.

    >>> corner_parts(2).round(6).tolist()
    [[0.0, 0.5, 0.211325], [0.5, 1.0, 0.788675]]
    """
    node, weight = _gauss_nodes(count)
    end = np.cumsum(0.5 * weight)
    return np.column_stack([end - 0.5 * weight, end, 0.5 + 0.5 * node])


@lru_cache(8)
def tables_of_parts(most: int) -> Floats:
    """(most + 1, most, 3) :func:`corner_parts` of every count up to ``most``: row n has n of them, then zeros. It is
    shared: nothing writes into it.

    >>> tables_of_parts(2)[1].round(6).tolist()
    [[0.0, 1.0, 0.5], [0.0, 0.0, 0.0]]
    """
    out = np.zeros((most + 1, most, 3))
    for count in range(1, most + 1):
        out[count, :count] = corner_parts(count)
    return out


def work_room(grid: Floats, cutters: Floats, pieces: int, flank: Floats) -> tuple[NDArray[Any], ...]:
    """Arrays that :func:`chipload.engagement.moves._contact.run` works in.

    Parameters
    ----------
    grid, cutters : of the index
    pieces, flank : slices of a corner, and longest slice of the flank of each cutter [mm]
    """
    cells, most, samples = 0, 0, 0
    for c, longest in zip(cutters, flank, strict=True):
        wide, count = float(c["wide"]), int(c["count"])
        cells = max(cells, (int(2.0 * wide / grid[2]) + 3) * (int(2.0 * wide / grid[3]) + 3))
        # of the flanks, lines or arcs, along the profile, and of all else
        length = float(np.hypot(c["rho_to"] - c["rho"], c["z_to"] - c["z"])[:count].sum())
        each = (1 + 2 * edge.DOWN + 2 * count) * pieces + 2 * front.LEVELS + count * edge.ROUND
        most = max(most, each + int(1.6 * length / longest) + 4)
        samples = max(samples, int(math.tau / min(min(grid[2], grid[3]) / wide, circle.APART)) + 4 + circle.FEWEST)
    spans = (most + flanks.SEARCHES) * (samples + 1)
    return (
        np.empty((cells, 7)), np.empty(front.LEVELS), np.empty((most, 12)), np.empty((spans, 2)),
        np.empty(spans, np.int64), np.empty(spans, np.int64), np.array([0.0, 0.0, 0.0, 0.0]),
        np.empty(2, np.int64), np.empty((most + 2 * flanks.SEARCHES, 12)),
    )  # fmt: skip


def side_radii(cutters: NDArray[np.void]) -> Floats:
    """(n,) radius [mm] of each cutter where its last piece begins, for the net of an outline."""
    last = cutters["count"] - 1
    radii = cutters["rho"][np.arange(len(cutters)), last]
    return np.where(cutters["line"][np.arange(len(cutters)), last] > 0, radii, cutters["wide"])


def longer(values: NDArray[Any], used: int, count: int) -> NDArray[Any]:
    """An array of ``count`` rows that begins with the first ``used`` of another one."""
    out = np.empty((count, *values.shape[1:]), dtype=values.dtype)
    out[:used] = values[:used]
    return out


@dataclass(frozen=True, eq=False)
class Engaged:
    """Engagement of some steps, with an entry for each instant that cuts.

    Parameters
    ----------
    step, instant, instants : (m,) int, the step, which of its instants, and how many it has
    start : (m + 1,) int, rows of each entry
    span : (b, 2) float [rad], psi from and to, from the motion counter-clockwise
    slice : (b,) int, row of ``slices``
    slices : (k, 6) float: s from, s to, rho, z from, sin(kappa), cos(kappa)
    volume : (m,) float [mm^3], of the step if it cut all over as at the instant
    areas : (m,) int, of the engaged surface
    z : (m, 2) float [mm], least and greatest height of what is engaged
    left : (m, 3) sum of the outward normals where the front leaves a surface, times their length along the edge [mm]
    left_mm : (m,) float, that length
    edge_mm : (m,) float, length of the profile that is engaged
    above : (m,) bool, material above the flutes
    frames : (m, 3, 3) float, rows T, N = A x T and A of an axis that leans or turns: psi is then counted from T, and
        ``slices`` have three more columns, of the motion along T, along N and along the axis; None: the axis is z
    overrun : (m,) float [mm], greatest length of the shank in material in the step; None: not asked
    """

    step: Ints
    instant: Ints
    instants: Ints
    start: Ints
    span: Floats
    slice: Ints
    slices: Floats
    volume: Floats
    areas: Ints
    z: Floats
    left: Floats
    left_mm: Floats
    edge_mm: Floats
    above: NDArray[np.bool_]
    frames: Floats | None = None
    overrun: Floats | None = None


def faces_of(body: trimesh.Trimesh) -> Floats:
    """(n, 12) corners and normals of the faces that a ray along z meets."""
    corners = np.asarray(body.vertices, dtype=np.float64)[np.asarray(body.faces)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    seen = np.abs(normal[:, 2]) > 1e-12 * np.linalg.norm(normal, axis=1)
    return np.ascontiguousarray(np.hstack([corners[seen].reshape(-1, 9), normal[seen]]))


def walls_of(body: trimesh.Trimesh) -> Floats:
    """(m, 4) ends x, y of the segment in the plan of each upright face, one of those that share it.

    >>> len(walls_of(trimesh.creation.box((4.0, 3.0, 2.0))))
    4
    """
    corners = np.asarray(body.vertices, dtype=np.float64)[np.asarray(body.faces)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    plan = corners[np.abs(normal[:, 2]) <= 1e-12 * np.linalg.norm(normal, axis=1), :, :2]
    length = np.linalg.norm(np.roll(plan, -1, axis=1) - plan, axis=2)
    row, first = np.arange(len(plan)), length.argmax(axis=1)
    ends = np.stack([plan[row, first], plan[row, (first + 1) % 3]], axis=1)
    # either end first, so that both triangles of a rectangle give one segment
    later = (ends[:, 0, 0] > ends[:, 1, 0]) | ((ends[:, 0, 0] == ends[:, 1, 0]) & (ends[:, 0, 1] > ends[:, 1, 1]))
    ends[later] = ends[later][:, ::-1]
    return np.ascontiguousarray(np.unique(ends.reshape(-1, 4), axis=0))


class MoveStock:
    """An initial body and the moves that were made in it.

    Parameters
    ----------
    low, high : (3,) float [mm], of the body
    cutters : by tool number
    body : closed mesh; None: the block from ``low`` to ``high``

    Attribute ``more``: instants of steps that are unlike the one before, as :data:`MORE`.

    Examples
    --------
    A slot of 10 x 2 mm, 1 mm of the way: 20 mm^3.

    >>> mill = Cutter(10.0, 2, 0.5, 20.0, 30.0, 6e5)
    >>> stock = MoveStock(np.array([0.0, -20.0, -9.0]), np.array([40.0, 20.0, 0.0]), {1: mill})
    >>> p = np.array([[-6.0, 0.0, -2.0], [10.0, 0.0, -2.0], [11.0, 0.0, -2.0]])
    >>> found = stock.take(p[:-1], p[1:], np.array([1, 1]), corner_slices=12, flank_mm={1: 9.0})
    >>> float(found.volume[found.step == 1].round(6)[0])
    20.0
    """

    def __init__(
        self, low: Floats, high: Floats, cutters: Mapping[int, Cutter], body: trimesh.Trimesh | None = None
    ) -> None:
        self.low, self.high = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
        self.table = dict(cutters)
        self.tools = {n: i for i, n in enumerate(sorted(cutters))}
        self.cutters = np.concatenate([cutter_record(cutters[n]) for n in self.tools])
        self.sides = side_radii(self.cutters)
        size = self.high - self.low
        self.radii = np.array([0.5 * cutters[n].resolved_diameter for n in self.tools])
        side = max(CELL * float(self.radii.min()), math.sqrt(size[0] * size[1] / CELLS))
        count = np.maximum(np.ceil(size[:2] / side - 1e-9), 1.0)
        self.shape = count.astype(np.int64)
        # of a stock that is thinner than a cell the one cell reaches beyond it: what cutters cover is counted in cells
        self.grid = np.array(
            [*self.low[:2], *np.maximum(size[:2] / count, THIN * side), self.low[2], _sweep.HEIGHTS / size[2]]
        )
        cells = int(self.shape.prod())
        self.level = np.empty((cells, 3))
        self.level[:] = (self.high[2], self.high[2], self.low[2])
        self.lists = np.zeros((cells, 4), dtype=np.int64)
        self.kept, self.reach = np.empty(1 << 16, dtype=np.int32), np.empty(1 << 16, dtype=np.uint16)
        self.used = np.zeros(1, dtype=np.int64)
        self.moves, self.of, self.count = np.empty((1024, 8)), np.empty(1024, dtype=np.int64), 0
        self.body, self.more = body, MORE
        self.first, self.ids = np.zeros(cells + 1, dtype=np.int64), np.empty(0, dtype=np.int32)
        self.faces = np.empty((0, 12))
        if body is not None:
            self._body(body)
        self.tops = self.level[:, 1].copy()

    def cropped(self, low: Floats, high: Floats) -> MoveStock | None:
        """The initial body in a box, in which no move was made; None where it does not reach into it.

        Parameters
        ----------
        low, high : (3,) float [mm], of the box; above and below it the body stays
        """
        a, b = self.low.copy(), self.high.copy()
        a[:2], b[:2] = np.maximum(a[:2], low[:2]), np.minimum(b[:2], high[:2])
        if not (a < b).all():
            return None
        return MoveStock(a, b, self.table, self.body)

    def _body(self, body: trimesh.Trimesh) -> None:
        """Faces over each cell, and what they leave open there."""
        self.faces = faces_of(body)
        initial.faces_over_cells(self.faces, self.grid, self.shape, self.first, self.ids)
        self.ids = np.empty(int(self.first[-1]), dtype=np.int32)
        initial.faces_over_cells(self.faces, self.grid, self.shape, self.first, self.ids)
        initial.levels(self.faces, self.grid, self.shape, self.first, self.ids, self.level)
        initial.mark_upright_faces(walls_of(body), self.grid, self.shape, self.level)

    def _index(self) -> tuple[NDArray[np.generic], ...]:
        body = (self.low, self.high, self.first, self.ids, self.faces)
        lists = (self.level, self.lists, self.kept, self.reach)
        return (self.grid, self.shape, *lists, self.moves, self.of, self.cutters, *body)

    def _enter(self, p0: Floats, p1: Floats, tool: Ints) -> None:
        while self.count + len(p0) > len(self.moves):
            self.moves = np.concatenate([self.moves, np.empty_like(self.moves)])
            self.of = np.concatenate([self.of, np.empty_like(self.of)])
        end = self.count + len(p0)
        vector = p1 - p0
        square = np.column_stack([(vector[:, :2] ** 2).sum(axis=1), (vector**2).sum(axis=1)])
        over = np.divide(1.0, square, out=np.zeros_like(square), where=square > 0.0)
        self.moves[self.count : end] = np.hstack([p0, vector, over])
        numbers, at = np.unique(tool, return_inverse=True)
        self.of[self.count : end] = np.array([self.tools[n] for n in numbers.tolist()], dtype=np.int64)[at.ravel()]
        self.count = end

    def _grow(self) -> None:
        """Pack the lists where they are, less what is no longer needed, and make room for more of them."""
        order = np.argsort(self.lists[:, 0], kind="stable")
        used = int(_sweep.pack_lists(order, self.grid, self.lists, self.kept, self.reach, self.level))
        need = used + ROOM[0] + max(used // 8, min(used // 2, ROOM[1]))
        if need > len(self.kept):
            # one after the other: the old array of the first is free when the second is made
            self.kept = longer(self.kept, used, need)
            self.reach = longer(self.reach, used, need)
        self.used[0] = used

    def forget(self) -> None:
        """Drop the index and the moves, which grow with the program, when the stock is no longer used."""
        self.kept, self.reach = np.empty(0, dtype=np.int32), np.empty(0, dtype=np.uint16)
        self.moves, self.of = np.empty((0, 8)), np.empty(0, dtype=np.int64)
        self.lists, self.level, self.tops = np.empty((0, 4), dtype=np.int64), np.empty((0, 3)), np.empty(0)

    def instants(self, p0: Floats, p1: Floats, tool: Ints, finer: Floats | float = 1.0) -> Ints:
        """Return the number of instants (n,) at which each step is calculated: odd, to include the middle.

        Parameters
        ----------
        finer : (n,) float, how many times as close
        """
        radius = np.array([self.radii[self.tools[n]] for n in tool.tolist()]).reshape(len(p0))
        length = finer * np.linalg.norm(p1 - p0, axis=1)
        more = np.maximum(0.5 * (length / (INSTANT * radius) - 1.0), 0.0)
        return np.asarray(2 * np.ceil(more - 1e-9).astype(np.int64) + 1)

    def skip(self, p0: Floats, p1: Floats, tool: Ints) -> None:
        """Make steps without calculating their engagement."""
        self._run(p0, p1, tool, np.zeros(len(p0), dtype=np.int64), 1, dict.fromkeys(self.tools, 1.0))

    def take(
        self,
        p0: Floats,
        p1: Floats,
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
        tool : (n,) int
        corner_slices : slices of the engaged part of a corner
        flank_mm : longest slice of the flank by tool number [mm]
        finer : (n,) float, how many times as close its instants are
        looked : (n,) bool, False: it is made without looking at what it engages
        """
        instants = np.where(looked, self.instants(p0, p1, tool, finer), 0)
        return self._run(p0, p1, tool, instants, corner_slices, flank_mm)

    def _run(
        self, p0: Floats, p1: Floats, tool: Ints, instants: Ints, pieces: int, flank_mm: Mapping[int, float]
    ) -> Engaged:
        begin = self.count
        self._enter(p0, p1, tool)
        u = p1 - p0
        size = np.hypot(u[:, 0], u[:, 1])
        upright = size <= 1e-12 * np.abs(u[:, 2])
        frame = np.where(upright[:, None], [[1.0, 0.0]], u[:, :2] / np.where(upright, 1.0, size)[:, None])
        frame = np.ascontiguousarray(frame)
        flank = np.array([flank_mm[n] for n in self.tools])
        capacity = 16 * max(int(instants.sum()), 1) + 256
        slices, rows, owner = (
            np.empty((capacity, 6)),
            np.empty((2 * capacity, 2)),
            np.empty(2 * capacity, dtype=np.int64),
        )
        entry, out = np.empty((capacity, 3), dtype=np.int64), np.empty((capacity, 10))
        state = np.array([begin, 0, 0, 0, 0, *self.more])
        parts = corner_parts(pieces)
        at, work = 0, work_room(self.grid, self.cutters, pieces, flank)
        while True:
            at = int(
                front.run(
                    at,
                    frame,
                    instants,
                    state,
                    self._index(),
                    work,
                    parts,
                    flank,
                    slices,
                    rows,
                    owner,
                    entry,
                    out,
                    self.used,
                )
            )
            if at == len(p0):
                break
            if state[1] == 1:
                self._grow()
            else:
                _, _, b, k, m, *_ = state.tolist()
                slices = longer(slices, k, 2 * len(slices))
                rows, owner = longer(rows, b, 2 * len(rows)), longer(owner, b, 2 * len(owner))
                entry, out = longer(entry, m, 2 * len(entry)), longer(out, m, 2 * len(out))
        _, _, b, k, m, *_ = state.tolist()
        step, out = entry[:m, 0], out[:m]
        return Engaged(
            step.copy(), entry[:m, 1].copy(), instants[step], np.append(entry[:m, 2], b), rows[:b], owner[:b],
            slices[:k], out[:, 0], out[:, 1].astype(np.int64), out[:, 2:4], out[:, 4:7], out[:, 7], out[:, 9],
            out[:, 8] > 0.0,
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
        cut = self.level[:, 1] > -math.inf
        return float(np.where(cut, self.level[:, 0], math.inf).min()) if self.body is None else float(self.low[2])

    def outlines(self, z: float, tolerance: float) -> MultiPolygon:
        """Return the outlines of the swept area at a height, within the box of the body and a little beyond.

        Borders are found where they cross the sides of a net; between them they are chords, within ``tolerance`` of the
        smallest cutter's circle unless the net would have more than ``NODES`` nodes. Corners are cut off by a chord.
        ``tolerance`` [mm]: by which the outline is made simpler.
        """
        return self.outlines_between(z, tolerance, None, None)[0]

    def outlines_between(
        self, z: float, tolerance: float, below: NDArray[np.bool_] | None, above: NDArray[np.bool_] | None
    ) -> tuple[MultiPolygon, NDArray[np.bool_]]:
        """Return the outlines at a height as :meth:`outlines`, and the nodes of their net that were swept there.

        Parameters
        ----------
        below, above : (n, m) nodes that were swept at a lower, and at a greater height, so that only the others are
            examined; None: not known
        """
        xs, ys = nodes_of(self.low, self.high, float(self.grid[2:4].min()), float(self.sides.min()), tolerance)
        inside, index = np.empty((len(xs), len(ys)), dtype=np.bool_), self._index()
        below = np.zeros_like(inside) if below is None else below
        above = np.ones_like(inside) if above is None else above
        outline.mark_nodes(z, xs, ys, index, self.tops, below, above, inside)
        sides, first = rings(inside)
        points = np.empty((len(sides), 2))
        outline.place_borders(z, xs, ys, index, self.tops, inside, sides, points)
        return area_of(points, first, tolerance), inside
