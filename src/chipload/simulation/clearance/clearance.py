"""Least distance of every point of a surface from the tool along a program; below 0 the tool enters the surface.

Notation: a step as in :mod:`chipload.simulation.steps`; the distance of a point from the tool is its least over the
whole program, below 0 where the tool was around the point (gouge), above 0 where material is left over it (excess).

Method: the tool stands in places along each step, so near to one another that what passes between them lies within the
tolerance: places d apart leave d^2 / (8 r) between two circles of radius r, and at a sharp edge that moves obliquely d
times the sine and the cosine of its slope. Points wait in cells, so that a place looks at those around the tool alone.
Independent of the layers and of the chips.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.simulation.clearance.body import Body
from chipload.simulation.steps import Steps

_body_distance = LateModule("chipload.simulation.clearance._body_distance")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

Grid = tuple[Ints, Ints, Floats, float, Ints]

#: places that are looked at together, most cells, and points of a cell
BLOCK, CELLS, POINTS = 4096, 2_000_000, 32
#: a step after all others
NEVER = np.iinfo(np.int64).max


@dataclass(frozen=True, eq=False)
class Clearance:
    """Least distance of points from the tool.

    Parameters
    ----------
    distance : (p,) float [mm], below 0 inside the tool; inf: never as near as was looked
    step : (p,) int, at which; -1 where the distance is inf
    first : (p,) int, the first step that had the point deeper inside than the tolerance; the number of steps: none
    deepest : (n,) float [mm], least distance of any point at each step; inf: none as near as was looked
    """

    distance: Floats
    step: Ints
    first: Ints
    deepest: Floats


class LeastDistance:
    """The least distance of points from a tool so far; :meth:`take` lowers it by some steps.

    Parameters
    ----------
    bodies, points, far, tolerance, workers : as in :func:`clearance`

    It keeps ``distance``, ``step`` and ``first`` of :class:`Clearance`; ``first`` is ``NEVER`` where there is none.
    """

    def __init__(
        self, bodies: Mapping[int, Body], points: ArrayLike, far: float, tolerance: float, workers: int = 2
    ) -> None:
        self.points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
        for name, value in (("far", far), ("tolerance", tolerance)):
            if not 0.0 < value < math.inf:
                raise InputError(f"clearance: {name} = {value:g}: must be above 0 mm")
        self.bodies, self.far, self.tolerance, self.workers = bodies, far, tolerance, workers
        count = len(self.points)
        self.distance, self.step = np.full(count, np.inf), np.full(count, -1, dtype=np.int64)
        self.first = np.full(count, NEVER)
        self.done = 0
        self._sorted: Grid | None = None

    def take(self, steps: Steps, some: NDArray[np.bool_] | None = None) -> Floats:
        """(n,) float [mm], least distance of any point at each of the steps that follow; inf: none as near as looked.

        Parameters
        ----------
        some : (n,) bool, the steps that count; None: all
        """
        deepest = np.full(len(steps), np.inf)
        if not len(self.points):
            self.done += len(steps)
            return deepest
        for number in np.unique(steps.tool).tolist():
            body = self.bodies[number]
            own = np.flatnonzero((steps.tool == number) & (True if some is None else some))
            if len(body.lines):
                own = own[self._near(steps, own, body)]
                for begin in range(0, len(own), BLOCK):
                    self._lower(self._grid, steps, own[begin : begin + BLOCK], body, deepest)
        self.done += len(steps)
        return deepest

    def state(self) -> dict[str, NDArray[Any]]:
        """Return the state: ``distance``, ``step``, ``first`` (p,) and ``done`` (1,)."""
        return {"distance": self.distance, "step": self.step, "first": self.first, "done": np.array([self.done])}

    def restore(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Replace the state by one of :meth:`state` for the same points."""
        self.distance, self.step, self.first = (state[k].copy() for k in ("distance", "step", "first"))
        self.done = int(state["done"][0])

    @property
    def _grid(self) -> Grid:
        """The points in cells, sorted when a tool first comes near them."""
        if self._sorted is None:
            self._sorted = _cells(self.points, max(b.widest for b in self.bodies.values()) + self.far)
        return self._sorted

    def _near(self, steps: Steps, own: Ints, body: Body) -> NDArray[np.bool_]:
        """Whether the box round a tool in some steps meets that of the points; elsewhere no place can be near one."""
        p0, p1, a0, a1 = (x[own] for x in (steps.p0, steps.p1, steps.a0, steps.a1))
        (low0, high0), (low1, high1) = body.box(a0), body.box(a1)
        # between two axes that stand an angle t apart a ring of the tool leaves its chord by at most its size t^2 / 8
        more = self.far + 0.15 * (body.top + body.widest) * np.square(a1 - a0).sum(axis=1)[:, None]
        low, high = np.minimum(p0 + low0, p1 + low1) - more, np.maximum(p0 + high0, p1 + high1) + more
        meets = (low <= self.points.max(axis=0)) & (high >= self.points.min(axis=0))
        return np.asarray(meets.all(axis=1))

    def _lower(self, grid: Grid, steps: Steps, own: Ints, body: Body, deepest: Floats) -> None:
        tips, axes, rows = _places(steps, own, body, self.tolerance)
        meridian = (body.lines, body.arcs, body.top, body.widest)

        def lowered(span: Ints) -> tuple[Floats, Ints, Ints, Floats]:
            out = self.distance.copy(), self.step.copy(), self.first.copy(), deepest.copy()
            _body_distance.nearest(
                self.points, *grid, tips[span], axes[span], rows[span], *meridian, self.far, self.tolerance, self.done,
                out[0], out[1], out[3], out[2],
            )  # fmt: skip
            return out

        with ThreadPoolExecutor(self.workers) as pool:
            for out, where, early, deep in pool.map(lowered, np.array_split(np.arange(len(rows)), self.workers)):
                nearer = out < self.distance
                self.distance[nearer], self.step[nearer] = out[nearer], where[nearer]
                np.minimum(self.first, early, out=self.first)
                np.minimum(deepest, deep, out=deepest)


def clearance(
    steps: Steps,
    bodies: Mapping[int, Body],
    points: ArrayLike,
    far: float,
    tolerance: float,
    *,
    some: NDArray[np.bool_] | None = None,
    workers: int = 2,
) -> Clearance:
    """Return the least distance of each point from the tool over the steps; O(places x points around the tool).

    Parameters
    ----------
    bodies : by tool number
    points : (p, 3) float [mm], in the work frame
    far : [mm] distances above this are not looked for
    tolerance : of the path between two places [mm]
    some : (n,) bool, the steps that count; None: all

    Raises
    ------
    InputError
        ``far`` or ``tolerance`` is not above 0.
    """
    near = LeastDistance(bodies, points, far, tolerance, workers)
    deepest = near.take(steps, some)
    return Clearance(near.distance, near.step, np.minimum(near.first, len(steps)), deepest)


def _cells(p: Floats, reach: float) -> Grid:
    """Points sorted into cells: (order, where each cell begins, low corner, side, counts)."""
    low, high = p.min(axis=0), p.max(axis=0)
    volume = float(np.prod(np.maximum(high - low, reach / 8.0)))
    cell = max(min(reach / 8.0, math.cbrt(volume * POINTS / len(p))), math.cbrt(volume / CELLS))
    count = np.floor((high - low) / cell).astype(np.int64) + 1
    place = np.minimum(((p - low) / cell).astype(np.int64), count - 1)
    key = (place[:, 0] * count[1] + place[:, 1]) * count[2] + place[:, 2]
    order = np.argsort(key, kind="stable")
    starts = np.searchsorted(key[order], np.arange(int(count.prod()) + 1))
    return order, starts, low, cell, count


def _places(steps: Steps, own: Ints, body: Body, tolerance: float) -> tuple[Floats, Floats, Ints]:
    """Tips, axes and steps of places along some steps, both ends among them."""
    p0, p1, a0, a1 = (x[own] for x in (steps.p0, steps.p1, steps.a0, steps.a1))
    move = p1 - p0
    length = np.linalg.norm(move, axis=1)
    turn = np.linalg.norm(a1 - a0, axis=1)
    along = np.abs(np.einsum("ij,ij->i", move, a0))
    slope = np.where(length > 0.0, along / np.where(length > 0.0, length, 1.0), 0.0).clip(0.0, 1.0)
    oblique = slope * np.sqrt(1.0 - slope**2)
    span = length + turn * body.top
    with np.errstate(divide="ignore"):
        across = math.sqrt(8.0 * body.widest * tolerance)
        sharp = np.where(oblique > 1e-9, tolerance / np.maximum(oblique, 1e-9), np.inf)
        round_ = math.sqrt(8.0 * (body.arcs[:, 2].min() if len(body.arcs) else 0.0) * tolerance)
        apart = np.minimum(across, np.where(oblique > 1e-9, np.maximum(sharp, round_), np.inf))
    count = np.maximum(np.ceil(span / apart), 1.0).astype(np.int64)
    at = np.repeat(np.arange(len(own)), count + 1)
    k = np.arange(len(at)) - np.repeat(np.cumsum(count + 1) - count - 1, count + 1)
    u = (k / count[at])[:, None]
    axis = (1.0 - u) * a0[at] + u * a1[at]
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    return p0[at] + u * move[at], axis, own[at]
