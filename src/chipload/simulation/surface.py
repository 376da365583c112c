"""What a program leaves on the part, and what its tools run into.

Notation: steps as in :mod:`chipload.simulation.steps`; the distance of a point of the part from the tool, least over
the program, is below 0 where the part is cut into (gouge) and above 0 where material stands over it (excess).

The part, fixtures and what a stock fills are points: corners of triangles whose sides are at most ``spacing`` long, and
a grid of that pitch. What lies between them is not looked at: a rod thinner than the spacing may pass.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.errors import InputError
from chipload.progress import Progress, silent
from chipload.simulation.clearance.body import above_cutting, cutting_part
from chipload.simulation.clearance.clearance import clearance
from chipload.simulation.steps import Steps

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: what lies so many tolerances over a point of the part is over it
OVER = 4.0
#: points of a part or a fixture at most
MOST_POINTS = 4_000_000


@dataclass(frozen=True, eq=False)
class Difference:
    """The part as points, and what the program leaves at each.

    Parameters
    ----------
    points : (p, 3) float [mm]; faces : (f, 3) int, triangles of them
    distance : (p,) float [mm]; inf: more than was looked for
    step : (p,) int, nearest step; -1: none
    deepest : (n,) float [mm] of each step; inf: far from the part
    look : [mm]
    over : (p,) bool, whether the stock stood over the point before: elsewhere nothing can be left
    """

    points: Floats
    faces: Ints
    distance: Floats
    step: Ints
    deepest: Floats
    look: float
    over: NDArray[np.bool_]


@dataclass(frozen=True)
class Collision:
    """Something that touches what it must not: what, with what, how deep, at which step and line, where."""

    what: str
    into: str
    depth_mm: float
    step: int
    line: int
    at: tuple[float, float, float]


def fine(mesh: trimesh.Trimesh, spacing: float, name: str) -> tuple[Floats, Ints]:
    """Points (p, 3) and triangles (f, 3) of a mesh whose sides are at most ``spacing`` [mm].

    Raises
    ------
    InputError
        They would be too many.
    """
    sides = np.asarray(mesh.edges_unique_length)
    guess = float(np.asarray(mesh.area)) / (0.25 * spacing * spacing) + len(sides)
    if guess > MOST_POINTS:
        raise InputError(
            f"{name}: spacing_mm = {spacing:g}: gives about {guess:.0g} points, more than {MOST_POINTS}: state more"
        )
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, spacing, max_iter=30)
    points, back = np.unique(np.asarray(vertices).round(9), axis=0, return_inverse=True)
    return points, back.ravel()[np.asarray(faces)]


def difference(
    steps: Steps,
    cutters: Mapping[int, Cutter],
    part: trimesh.Trimesh,
    in_stock: Callable[[Floats], NDArray[np.bool_]],
    spacing: float,
    look: float,
    tolerance: float,
    progress: Progress = silent,
) -> Difference:
    """What the program leaves on the part; O(places of the tool x points around it).

    Parameters
    ----------
    in_stock : which points (p, 3) lay in the stock before the program
    spacing, look, tolerance : [mm], of the points; how far material is looked for; of the path
    """
    points, faces = fine(part, spacing, "part")
    normals = np.asarray(trimesh.Trimesh(points, faces, process=False).vertex_normals)
    over = in_stock(points + OVER * tolerance * normals)
    bodies = {n: cutting_part(c) for n, c in cutters.items()}
    found = clearance(steps, bodies, points, look, tolerance, progress=progress)
    return Difference(points, faces, found.distance, found.step, found.deepest, look, over)


def collisions(
    steps: Steps,
    cutters: Mapping[int, Cutter],
    solids: Mapping[str, Floats],
    tolerance: float,
    *,
    above_only: frozenset[str] = frozenset(),
    progress: Progress = silent,
) -> tuple[Collision, ...]:
    """Where shank and holder, and the cutting part too, come into solids; one entry for each line, tool part and solid.

    Parameters
    ----------
    solids : points (p, 3) [mm] by name
    tolerance : what is less deep [mm] is none
    above_only : names of solids that the cutting part may touch, as the part
    """
    out: list[Collision] = []
    kinds = (("shank or holder", above_cutting), ("cutting part", cutting_part))
    for name, points in solids.items():
        for what, body in kinds:
            if what == "cutting part" and name in above_only:
                continue
            bodies = {n: body(c) for n, c in cutters.items()}
            found = clearance(steps, bodies, points, tolerance, tolerance, progress=progress)
            out += _by_line(steps, what, name, found.deepest, tolerance)
    return tuple(sorted(out, key=lambda c: (c.step, c.what, c.into)))


def in_stock(
    steps: Steps, cutters: Mapping[int, Cutter], points: Floats, tolerance: float, progress: Progress = silent
) -> tuple[Collision, ...]:
    """Where shank and holder come into what is still there of the stock.

    A point of the stock is gone from the first step whose cutting part goes round it; a shank or holder round it
    before that, or where it is never cut, has run into it.

    Parameters
    ----------
    points : (p, 3) float [mm] of a grid in the stock
    """
    cut = clearance(steps, {n: cutting_part(c) for n, c in cutters.items()}, points, tolerance, tolerance).first
    above = {n: above_cutting(c) for n, c in cutters.items()}
    hit = clearance(steps, above, points, tolerance, tolerance, progress=progress)
    bad = (hit.first < cut) & (hit.first < len(steps))
    depth = np.full(len(steps), np.inf)
    np.minimum.at(depth, hit.first[bad], hit.distance[bad])
    return tuple(_by_line(steps, "shank or holder", "stock", depth, tolerance))


def _by_line(steps: Steps, what: str, into: str, deepest: Floats, tolerance: float) -> list[Collision]:
    """The deepest of each line."""
    best: dict[int, Collision] = {}
    for k in np.flatnonzero(deepest < -tolerance).tolist():
        tip = steps.p1[k]
        found = Collision(
            what, into, float(-deepest[k]), k, int(steps.line[k]), (float(tip[0]), float(tip[1]), float(tip[2]))
        )
        if found.line not in best or found.depth_mm > best[found.line].depth_mm:
            best[found.line] = found
    return list(best.values())
