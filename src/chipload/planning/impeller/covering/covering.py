"""Covering of the walls of an impeller: points so close that a cutter clear of them is clear of the walls.

Notation: r corner radius; tolerance [mm]; nodes q of the walls as in ``nodes.py``, with reach t and bend e; sunk [mm]
how deep in the metal a node is put, c its place.

Lemma: let a wall have its deepest point p in a convex part of the tool that a ball of radius r rolls round inside, at
the depth d < r. There the wall is along the boundary of the part: a ball of radius r of the part has p at r - d from
its centre, and the step from p to its nearest node goes along the wall. So the node lies within
sqrt((r - d)^2 + t^2) + e + sunk of that centre, and in the part if that is below r. If no node is in the part,
d <= r - sqrt((r - e - sunk)^2 - t^2). On an edge of a wall the same holds along the edge, which has nodes too.

The cutting part rolls a ball of its corner radius. Neck, shank and holder are taken larger by their clearance; rolled
by a ball of that radius they still contain themselves, if they begin lower by what the bound is above the tolerance.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.planning.impeller.blocks import BLOCK, in_blocks
from chipload.planning.impeller.clearance.clearance import nearest
from chipload.planning.impeller.covering import _kernels
from chipload.planning.impeller.covering.nodes import Nodes, grid_of, hub_nodes, patch_nodes, turned
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.tree import Tree, tree_of
from chipload.progress import silent

Floats = NDArray[np.float64]

#: of the tolerance, how deep the nodes lie in the metal: what the cutter touches does not count as met
SUNK = 0.2
#: nodes in a leaf of the tree
_LEAF = 96
#: first width of the cells over the one of a plane wall; of the width that is right to first order, what is taken
_FIRST, _LESS = 0.98, 0.995
#: at once they are made narrower by no more than this share: the widest reach may be of another wall then
_STEP = 0.94
#: nodes nearer to the contact than this are tried one by one [mm]
_NEAR = 1.0
#: of a part of B for which nodes are collected at once [rad]
_WIDTH = math.radians(1.0)
#: so many nodes are made at most
_MOST_NODES = 5e6
#: lists of nodes that are kept at a time
_LISTS = 8
#: ranges of one contact point
_MOST = 32


@dataclass(frozen=True, eq=False)
class Covering:
    """Covering of all walls round a channel.

    Parameters
    ----------
    points : (m, 3) float [mm], sunk into the metal
    tolerance : how deep a wall may lie in a cutter that is clear of the nodes, a tapered one by its cylinders [mm]
    corner : least corner radius for which that holds [mm]
    reach, bend, sunk : of the nodes [mm]
    slack : by how much a tapered cutter may stand out of its cylinders [mm]; its corner is above ``corner`` by that
    """

    points: Floats
    tolerance: float
    corner: float
    reach: float
    bend: float
    sunk: float
    slack: float = 0.0
    tree: Tree = field(init=False, repr=False)
    ordered: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tree", tree_of(self.points, _LEAF))
        object.__setattr__(self, "ordered", np.ascontiguousarray(self.points[self.tree.order]))

    def depth(self, radius: float) -> float:
        """Greatest depth of a wall in a part of the tool inside which a ball of this radius rolls [mm]; inf: none."""
        return depth_of(radius, self.reach, self.bend, self.sunk)

    def proves(self, cutter: CatalogueCutter, clearance: float) -> bool:
        """Whether a cutter that is clear of the nodes is clear of the walls within the tolerance.

        A tapered cutter that stands out of its cylinders by c, less c all round, lies in them, and a ball of its corner
        radius less c rolls in it: no wall is deeper in that than the tolerance less ``slack``.
        """
        out = cutter.not_enclosed
        if cutter.corner_radius - out < self.corner or out > self.slack or cutter.barrel_radius is not None:
            return False
        radii = cutter.stages(0.0)[:, 1]
        return bool((np.diff(radii) <= 0.0).all()) or math.isfinite(self.depth(clearance))

    def stages(self, cutter: CatalogueCutter, clearance: float) -> Floats:
        """As :meth:`CatalogueCutter.stages`, each part above the cutting part begins lower by what its rim needs."""
        out = cutter.enclosing(clearance)
        drop = self.depth(clearance) - self.tolerance
        if len(out) > 1 and 0.0 < drop < math.inf:
            upper = cutter.stages(clearance)[1:]
            upper[:, 0] = np.maximum(upper[:, 0] - drop, 0.0)
            cone = out[: len(out) - len(upper)]
            # what the lowest part above the cone reaches down to is as wide as the wider of both
            upper[0, 1] = max(upper[0, 1], cone[-1, 1]) if len(cone) > 1 else upper[0, 1]
            out = np.vstack([cone[:1], cone[1:][cone[1:, 0] < upper[0, 0]], upper])
        return out

    def met(self, cutter: CatalogueCutter, tips: Floats, axes: Floats, clearance: float) -> Floats:
        """Depth of the deepest node in a cutter at each pose (n,) [mm]; 0: no node is in it."""
        away, _ = nearest(self.ordered, self.tree, cutter, self.stages(cutter, clearance), tips, axes, 0.0)
        return -away

    def kept(
        self, scene: Scene, cutter: CatalogueCutter, tables: Floats, clearance: float, points: NDArray[np.int64],
        ranges: tuple[Floats, ...], least: float, workers: int = 1,
    ) -> tuple[tuple[Floats, ...], NDArray[np.bool_]]:  # fmt: skip
        """Parts of the ranges of B that hold for the nodes too; False where there were too many arcs to decide.

        Parameters
        ----------
        tables : alpha (c,) [rad] of the contact ``points`` (c,)
        ranges : for each of them (k, 2) [rad], clear of the check points
        """
        rows = np.ascontiguousarray(scene.rows[points])
        cones = np.column_stack([np.sin(tables), np.cos(tables)])
        given, count = np.zeros((len(rows), _MOST, 2)), np.zeros(len(rows), dtype=np.int64)
        for k, row in enumerate(ranges):
            given[k, : len(row)], count[k] = row, len(row)
        found, number = np.zeros((len(rows), _MOST, 2)), np.zeros(len(rows), dtype=np.int64)
        tool = np.array([cutter.rho, cutter.corner_radius])
        stages, tree, size = self.stages(cutter, clearance), self.tree, len(self.points)

        def block(first: int) -> None:
            _kernels.kept(
                self.ordered, tree.nodes, tree.spans, tree.leaves, rows, cones, tool, stages, given, count, _NEAR**2,
                _WIDTH, least, first, min(first + BLOCK, len(rows)), np.zeros(size, dtype=np.int64),
                np.empty(_LISTS * size + 64, dtype=np.int64), found, number,
            )  # fmt: skip

        in_blocks(block, len(rows), workers, silent, "between check points")
        out = tuple(found[k, : max(int(n), 0)].copy() for k, n in enumerate(number))
        return out, number >= 0


def depth_of(radius: float, reach: float, bend: float, sunk: float) -> float:
    """The bound of the lemma [mm].

    >>> round(depth_of(2.0, 0.4, 0.0, 0.0), 6)
    0.040408
    """
    left = radius - bend - sunk
    return radius - math.sqrt(left * left - reach * reach) if left > reach else math.inf


def covering_of(
    impeller: Impeller, tolerance: float, corner: float, around: int, hub_range: tuple[float, float],
    slack: float = 0.0,
) -> Covering:  # fmt: skip
    """Covering of the walls of the channels beside the bodies of an impeller.

    Parameters
    ----------
    tolerance : [mm] > 0
    corner : least corner radius of the cutters [mm], > 0
    around, hub_range : as :meth:`Impeller.scene`
    slack : [mm] by which tapered cutters stand out of their cylinders, below tolerance and corner

    Raises
    ------
    InputError
        There would be too many nodes.
    """
    tolerance, corner = tolerance - slack, corner - slack
    sunk, edge = SUNK * tolerance, first_edge(impeller, tolerance, corner, around)
    while True:
        sides, hub = _each(impeller, around, hub_range, edge)
        made = [*itertools.chain.from_iterable(sides), hub]
        reach, bend = max(x.reach for x in made), max(x.bend for x in made)
        if depth_of(corner, reach, bend, sunk) <= tolerance:
            break
        edge *= max(_lessened(corner, reach, bend, sunk, tolerance), _STEP)
    parts = [*_round(impeller, around, sides), hub]
    points = np.concatenate([x.points - sunk * x.normals for x in parts])
    return Covering(points, tolerance + slack, corner, reach, bend, sunk, slack)


def _lessened(corner: float, reach: float, bend: float, sunk: float, tolerance: float) -> float:
    """By what the cells are made narrower: the reach goes with their width, the bend with its square.

    >>> round(_lessened(2.0, 0.5, 0.0, 0.0, 0.04), 3)
    0.792
    """
    low, high = 0.1, 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        if depth_of(corner, middle * reach, middle * middle * bend, sunk) <= tolerance:
            low = middle
        else:
            high = middle
    return _LESS * low


def first_edge(impeller: Impeller, tolerance: float, corner: float, around: int) -> float:
    """Width of the first cells [mm] of :func:`covering_of`.

    Raises
    ------
    InputError
        There would be too many nodes.
    """
    sunk, tight = SUNK * tolerance, min(tolerance, 0.5 * corner)
    edge = _FIRST * math.sqrt(2.0 * ((corner - sunk) ** 2 - (corner - tight) ** 2))
    count = _area(impeller, around) / edge**2
    if count > _MOST_NODES:
        raise InputError(
            f"a corner radius of {corner:g} mm needs about {count:.2g} points of the walls: must be at most "
            f"{_MOST_NODES:g}: raise it, or leave cutters of so small a corner radius out of the catalogue"
        )
    return edge


def _area(impeller: Impeller, around: int) -> float:
    """About the area [mm2] of the walls."""
    t = np.linspace(0.0, 1.0, 17)
    u, v = (0.5 * (x[1:] + x[:-1]) for x in (t, t))
    sides = [side for blade in impeller.bodies for side in (blade.plus, blade.minus)]
    each = sum(
        float(np.linalg.norm(np.cross(grid_of(p, u, v, 1, 0), grid_of(p, u, v, 0, 1)), axis=2).mean()) for p in sides
    )
    curve = impeller.hub.curve(t)
    ring = math.tau * float(curve[:, 0].mean()) * float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum())
    bodies = len(impeller.bodies)
    return each * (2 + 2 * around + bodies) / bodies + ring


def _each(
    impeller: Impeller, around: int, hub_range: tuple[float, float], edge: float
) -> tuple[list[list[Nodes]], Nodes]:
    """Nodes of the sides of each body once, and of the hub under all of them."""
    bodies = len(impeller.bodies)
    first, last = -1 - around, bodies + around
    out = []
    for index in range(bodies):
        blades = [impeller.body(index), *([impeller.fillet(index)] if impeller.fillets else [])]
        out.append([patch_nodes(side, edge) for blade in blades for side in (blade.plus, blade.minus)])
    s = np.linspace(*hub_range, 41)
    begin = impeller.across(first, s, [0.0])[:, 0]
    width = impeller.pitch * math.ceil((last - first) / bodies)
    low, high = float(begin.min()), float(begin.max()) + width
    return out, hub_nodes(impeller.hub, hub_range, (low, min(high, low + math.tau)), edge)


def _round(impeller: Impeller, around: int, sides: list[list[Nodes]]) -> list[Nodes]:
    """The nodes of every body round the channels."""
    bodies = len(impeller.bodies)
    numbers = range(-1 - around, bodies + around + 1)
    return [turned(x, impeller.pitch * (k // bodies)) for k in numbers for x in sides[k % bodies]]
