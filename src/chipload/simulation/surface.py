"""Differences of the part after a program (gouge, excess), and collisions of its tools.

Notation: steps as in :mod:`chipload.simulation.steps`; the distance of a point of the part from the tool, least over
the program, is below 0 where the part is cut into (gouge) and above 0 where material stands over it (excess).

The part, fixtures and what a stock fills are points: corners of triangles whose sides are at most ``spacing`` long, and
a grid of that pitch. The space between points is not examined: a rod of a fixture thinner than the spacing may be
missed; of a part the gouge between the points is bounded (:mod:`chipload.simulation.gouge_refinement`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.lazy import trimesh
from chipload.simulation.clearance.body import above_cutting, cutting_part
from chipload.simulation.clearance.clearance import NEVER, LeastDistance
from chipload.simulation.kept_pass import KeptPasses
from chipload.simulation.steps import Steps, blocks_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: a pass that keeps nothing
ALONE = KeptPasses()
#: what lies so many tolerances over a point of the part is over it
OVER = 4.0
ABOVE = "shank or holder"
#: points of a part or a fixture at most
MOST_POINTS = 4_000_000


@dataclass(frozen=True, eq=False)
class Difference:
    """The part as points, and the gouge or excess of the program at each.

    Parameters
    ----------
    points : (p, 3) float [mm]; faces : (f, 3) int, triangles of them
    distance : (p,) float [mm]; inf: beyond the search range
    step : (p,) int, nearest step; -1: none
    deepest : (n,) float [mm] of each step; inf: far from the part
    search_range : [mm]
    over : (p,) bool, whether the stock stood over the point before: elsewhere nothing can be left
    between : places (b, 3) [mm] between the points, their distance (b,) [mm] and nearest step (b,), see
        :mod:`chipload.simulation.gouge_refinement`
    hidden : [mm] by which a gouge may be deeper than at any point; inf: not known
    spacing : [mm] longest side of triangles where the tool goes
    """

    points: Floats
    faces: Ints
    distance: Floats
    step: Ints
    deepest: Floats
    search_range: float
    over: NDArray[np.bool_]
    between: tuple[Floats, Floats, Ints] = (np.empty((0, 3)), np.empty(0), np.empty(0, dtype=np.int64))
    hidden: float = math.inf
    spacing: float = math.inf


@dataclass(frozen=True)
class Collision:
    """A collision: the bodies that touch, the depth, below 0 where they are only too near, step, line and place."""

    what: str
    into: str
    depth_mm: float
    step: int
    line: int
    at: tuple[float, float, float]


def require_points(mesh: trimesh.Trimesh, spacing: float, name: str) -> None:
    """Refuse a spacing that :func:`fine` cannot make of a mesh.

    Raises
    ------
    InputError
        The points would be too many.
    """
    sides = np.asarray(mesh.edges_unique_length)
    guess = float(np.asarray(mesh.area)) / (0.25 * spacing * spacing) + len(sides)
    if guess > MOST_POINTS:
        raise InputError(
            f"{name}: spacing_mm = {spacing:g}: gives about {guess:.0g} points, more than {MOST_POINTS}: state "
            "a larger spacing"
        )


def fine(mesh: trimesh.Trimesh, spacing: float, name: str) -> tuple[Floats, Ints]:
    """Return points (p, 3) and triangles (f, 3) of a mesh with sides of at most ``spacing`` [mm].

    Raises
    ------
    InputError
        They would be too many.
    """
    require_points(mesh, spacing, name)
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, spacing, max_iter=30)
    points, back = np.unique(np.asarray(vertices).round(9), axis=0, return_inverse=True)
    return points, back.ravel()[np.asarray(faces)]


def difference(
    steps: Steps | Iterable[Steps],
    cutters: Mapping[int, Cutter],
    part: trimesh.Trimesh,
    in_stock: Callable[[Floats], NDArray[np.bool_]],
    spacing: float,
    search_range: float,
    tolerance: float,
    progress: Callable[[int], None] = lambda done: None,
    kept: KeptPasses = ALONE,
) -> Difference:
    """Return the difference of the part after a program; O(places of the tool x points around it).

    Parameters
    ----------
    steps : all, or block after block
    in_stock : which points (p, 3) lay in the stock before the program
    spacing, search_range, tolerance : [mm], of the points; how far material is looked for; of the path
    progress : is told how many steps are done
    kept : where the pass keeps what it has found, and goes on from
    """
    points, faces = fine(part, spacing, "part")
    normals = np.asarray(trimesh.Trimesh(points, faces, process=False).vertex_normals)
    over = in_stock(points + OVER * tolerance * normals)
    near = LeastDistance({n: cutting_part(c) for n, c in cutters.items()}, points, search_range, tolerance)
    deepest = [np.empty(0)]

    def restore(state: Mapping[str, NDArray[Any]]) -> None:
        near.restore(state)
        deepest[:] = [state["deepest"]]

    def state() -> dict[str, NDArray[Any]]:
        return {**near.state(), "deepest": np.concatenate(deepest)}

    for block in kept.blocks("part", steps, (points, search_range, tolerance), state, restore):
        progress(near.done)
        deepest.append(near.take(block))
    return Difference(points, faces, near.distance, near.step, np.concatenate(deepest), search_range, over)


def collisions(
    steps: Steps | Iterable[Steps],
    cutters: Mapping[int, Cutter],
    solids: Mapping[str, Floats],
    tolerance: float,
    *,
    above_only: frozenset[str] = frozenset(),
    clearance: float = 0.0,
    progress: Callable[[int], None] = lambda done: None,
    kept: KeptPasses = ALONE,
) -> tuple[Collision, ...]:
    """Return the collisions of shank, holder and cutting part with solids, one for each line, tool part and solid.

    Parameters
    ----------
    steps : all, or block after block
    solids : points (p, 3) [mm] by name
    tolerance : what is less deep [mm] is none
    above_only : names of solids that the cutting part may touch, as the part
    clearance : least distance of shank and holder from a solid [mm]
    progress : is told how many steps are done
    kept : where the pass keeps what it has found, and goes on from
    """
    watched: list[tuple[str, str, LeastDistance, dict[int, Collision]]] = []
    for name, points in solids.items():
        for what, body in ((ABOVE, above_cutting), ("cutting part", cutting_part)):
            if what == ABOVE or name not in above_only:
                bodies = {n: body(c) for n, c in cutters.items()}
                far = max(tolerance, clearance) if what == ABOVE else tolerance
                watched.append((what, name, LeastDistance(bodies, points, far, tolerance), {}))

    def state() -> dict[str, NDArray[Any]]:
        out = dict[str, NDArray[Any]]()
        for i, (_, _, near, best) in enumerate(watched):
            numbers = np.array([(c.step, c.line) for c in best.values()], dtype=np.int64).reshape(-1, 2)
            places = np.array([(c.depth_mm, *c.at) for c in best.values()], dtype=np.float64).reshape(-1, 4)
            own = {**near.state(), "numbers": numbers, "places": places}
            out |= {f"{k}_{i}": v for k, v in own.items()}
        return out

    def restore(found: Mapping[str, NDArray[Any]]) -> None:
        for i, (what, name, near, best) in enumerate(watched):
            near.restore({k: found[f"{k}_{i}"] for k in near.state()})
            for (step, line), (depth, *at) in zip(
                found[f"numbers_{i}"].tolist(), found[f"places_{i}"].tolist(), strict=True
            ):
                best[line] = Collision(what, name, depth, step, line, (at[0], at[1], at[2]))

    depends = (dict(solids), sorted(above_only), tolerance, clearance)
    for block in kept.blocks("collisions", steps, depends, state, restore) if watched else ():
        progress(watched[0][2].done)
        for what, name, near, best in watched:
            first = near.done
            apart = clearance if what == ABOVE else 0.0
            _by_line(block, first, what, name, near.take(block), tolerance - apart, best)
    return tuple(sorted((c for *_, best in watched for c in best.values()), key=lambda c: (c.step, c.what, c.into)))


def in_stock(
    steps: Steps | Iterable[Steps],
    cutters: Mapping[int, Cutter],
    points: Floats,
    tolerance: float,
    progress: Callable[[int], None] = lambda done: None,
    kept: KeptPasses = ALONE,
) -> tuple[Collision, ...]:
    """Return the collisions of shank and holder with the remaining stock.

    A point of the stock is gone from the first step whose cutting part goes round it; a shank or holder round it
    before that, or where it is never cut, has run into it.

    Parameters
    ----------
    steps : all, or block after block; gone through twice
    points : (p, 3) float [mm] of a grid in the stock
    progress : is told how many steps are done
    kept : where the pass keeps what it has found, and goes on from

    A tool that is a body without chips takes the points away at a feed, and runs into them in rapids.
    """
    parts, bodies = {n: cutting_part(c) for n, c in cutters.items()}, [n for n, c in cutters.items() if c.body]
    cut = LeastDistance(parts, points, tolerance, tolerance)
    hits = {ABOVE: LeastDistance({n: above_cutting(c) for n, c in cutters.items()}, points, tolerance, tolerance)}
    if bodies:
        hits["cutting part in a rapid"] = LeastDistance(parts, points, tolerance, tolerance)
    every = [cut, *hits.values()]

    def state() -> dict[str, NDArray[Any]]:
        return {f"{k}_{i}": v for i, near in enumerate(every) for k, v in near.state().items()}

    def restore(found: Mapping[str, NDArray[Any]]) -> None:
        for i, near in enumerate(every):
            near.restore({k: found[f"{k}_{i}"] for k in near.state()})

    for block in kept.blocks("stock", steps, (points, tolerance), state, restore):
        progress(cut.done)
        rapid = block.rapid & np.isin(block.tool, bodies)
        cut.take(block, ~rapid)
        for what, hit in hits.items():
            hit.take(block, None if what == ABOVE else rapid)
    out: list[Collision] = []
    for what, hit in hits.items():
        bad = (hit.first < cut.first) & (hit.first != NEVER)
        at, depth = hit.first[bad], hit.distance[bad]
        best: dict[int, Collision] = {}
        done = 0
        for block in blocks_of(steps) if len(at) else ():
            deepest, own = np.full(len(block), np.inf), (at >= done) & (at < done + len(block))
            np.minimum.at(deepest, at[own] - done, depth[own])
            _by_line(block, done, what, "stock", deepest, tolerance, best)
            done += len(block)
        out += best.values()
    return tuple(out)


def _by_line(
    steps: Steps, first: int, what: str, into: str, deepest: Floats, tolerance: float, best: dict[int, Collision]
) -> None:
    """Put the deepest of each line among ``best``, if deeper than ``tolerance``; the steps begin with ``first``."""
    for k in np.flatnonzero(deepest < -tolerance).tolist():
        line, depth, tip = int(steps.line[k]), float(-deepest[k]), steps.p1[k].tolist()
        if line not in best or depth > best[line].depth_mm:
            best[line] = Collision(what, into, depth, first + k, line, (tip[0], tip[1], tip[2]))
