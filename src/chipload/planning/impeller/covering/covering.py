"""Covering of the walls of an impeller: points so close together that a cutter clear of them is clear of the walls.

Notation: r corner radius; tolerance [mm]; nodes q of the walls as in ``nodes.py``, with reach t and bend e; sunk [mm]
depth of a node below the surface of the wall.

Lemma: let p be the deepest point of a wall in a convex part of the tool, at the depth d < r, and let a ball of radius r
roll inside that part along its boundary. At p the wall is parallel to the boundary of the part: one position of the
ball has p at the distance r - d from its centre, and the vector from p to its nearest node is along the wall. The node
is therefore within sqrt((r - d)^2 + t^2) + e + sunk of that centre, and inside the part if this is below r. If no node
is in the part, d <= r - sqrt((r - e - sunk)^2 - t^2). On an edge of a wall the same holds along the edge, which has
nodes too.

Inside the cutting part rolls a ball of its corner radius. Neck, shank and holder are enlarged by their clearance. With
their edges rounded to that radius they still contain the real parts if they begin lower by the amount by which the
bound exceeds the tolerance.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chipload.cutter.catalogue import CatalogueCutter
from chipload.errors import InputError
from chipload.lazy import LateModule
from chipload.number_text import number_text
from chipload.planning.impeller.blocks import BLOCK, in_blocks
from chipload.planning.impeller.clearance import nearest
from chipload.planning.impeller.covering.nodes import Nodes, grid_of, hub_nodes, patch_nodes, turn_nodes
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.scene import Scene
from chipload.planning.impeller.tree import Tree, tree_of
from chipload.progress import silent

_clear_parts = LateModule("chipload.planning.impeller.covering._clear_parts")

Floats = NDArray[np.float64]

#: depth of the nodes below the surface as a share of the tolerance, so that a wall that is touched has no node inside
SUNK = 0.2
#: nodes in a leaf of the tree
_LEAF = 96
#: first width of the cells as a share of that for a plane wall; share of the width that is correct to first order
_FIRST, _LESS = 0.98, 0.995
#: least factor by which the cells are made narrower at once: another wall may then have the greatest reach
_STEP = 0.94
#: the exact arcs of nodes within this distance of the contact are computed first [mm]
_NEAR = 1.0
#: width of a part of B whose nodes in reach are listed at once [rad]
_WIDTH = math.radians(1.0)
#: greatest number of nodes
_MOST_NODES = 5e6
#: length of the workspace for lists of nodes, in numbers of all nodes
_LISTS = 8
#: greatest number of ranges of one contact point
_MOST = 32


@dataclass(frozen=True, eq=False)
class Covering:
    """Covering of all walls round a channel.

    Parameters
    ----------
    points : (m, 3) float [mm], sunk into the metal
    tolerance : greatest depth of a wall in a cutter that is clear of the nodes [mm]; a tapered one stands for its
        enclosing cylinders
    corner : least corner radius for which that holds [mm]
    reach, bend, sunk : of the nodes [mm]
    slack : distance by which a tapered cutter may protrude from its cylinders [mm]; its corner radius is at least
        ``corner`` plus this
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
        """Greatest depth [mm] of a wall in a part of the tool inside which a ball of ``radius`` rolls; inf: unknown."""
        return depth_of(radius, self.reach, self.bend, self.sunk)

    def proves(self, cutter: CatalogueCutter, clearance: float) -> bool:
        """Whether a cutter that is clear of the nodes is clear of the walls within the tolerance.

        A tapered cutter that protrudes from its cylinders by c lies inside them once it is reduced by c all round. A
        ball of its corner radius less c rolls inside the reduced cutter: no wall is deeper in that than the tolerance
        less ``slack``.
        """
        out = cutter.not_enclosed
        if cutter.corner_radius - out < self.corner or out > self.slack or cutter.barrel_radius is not None:
            return False
        radii = cutter.stages(0.0)[:, 1]
        return bool((np.diff(radii) <= 0.0).all()) or math.isfinite(self.depth(clearance))

    def stages(self, cutter: CatalogueCutter, clearance: float) -> Floats:
        """As :meth:`CatalogueCutter.stages`, with every part above the cutting part extended down to cover its edge."""
        out = cutter.enclosing(clearance)
        drop = self.depth(clearance) - self.tolerance
        if len(out) > 1 and 0.0 < drop < math.inf:
            upper = cutter.stages(clearance)[1:]
            upper[:, 0] = np.maximum(upper[:, 0] - drop, 0.0)
            cone = out[: len(out) - len(upper)]
            # where the lowest part above the cone now overlaps the cone, the wider of both counts
            upper[0, 1] = max(upper[0, 1], cone[-1, 1]) if len(cone) > 1 else upper[0, 1]
            out = np.vstack([cone[:1], cone[1:][cone[1:, 0] < upper[0, 0]], upper])
        return out

    def node_depth(self, cutter: CatalogueCutter, tips: Floats, axes: Floats, clearance: float) -> Floats:
        """Depth (n,) [mm] of the deepest node in a cutter at each pose; 0: no node is in it."""
        distance, _ = nearest(self.ordered, self.tree, cutter, self.stages(cutter, clearance), tips, axes, 0.0)
        return -distance

    def clear_ranges(
        self, scene: Scene, cutter: CatalogueCutter, tables: Floats, clearance: float, points: NDArray[np.int64],
        ranges: tuple[Floats, ...], least: float, workers: int = 1,
    ) -> tuple[tuple[Floats, ...], NDArray[np.bool_]]:  # fmt: skip
        """Parts of the ranges of B that are clear of the nodes too, and whether each contact point was decided.

        A contact point is not decided where there are more arcs than the workspace holds.

        Parameters
        ----------
        tables : table angle alpha (c,) [rad] of each contact point
        clearance : [mm] by which neck, shank and holder are enlarged
        points : (c,) int, the contact points of the scene
        ranges : for each of them (k, 2) [rad], clear of the check points
        least : [rad] narrower parts are left out
        """
        rows = np.ascontiguousarray(scene.rows[points])
        cones = np.column_stack([np.sin(tables), np.cos(tables)])
        parts, count = np.zeros((len(rows), _MOST, 2)), np.zeros(len(rows), dtype=np.int64)
        for k, row in enumerate(ranges):
            parts[k, : len(row)], count[k] = row, len(row)
        clear, number = np.zeros((len(rows), _MOST, 2)), np.zeros(len(rows), dtype=np.int64)
        tool = np.array([cutter.rho, cutter.corner_radius])
        stages, tree, size = self.stages(cutter, clearance), self.tree, len(self.points)

        def block(first: int) -> None:
            _clear_parts.clear_parts(
                self.ordered, tree.nodes, tree.spans, tree.leaves, rows, cones, tool, stages, parts, count, _NEAR**2,
                _WIDTH, least, first, min(first + BLOCK, len(rows)), np.zeros(size, dtype=np.int64),
                np.empty(_LISTS * size + 64, dtype=np.int64), clear, number,
            )  # fmt: skip

        in_blocks(block, len(rows), workers, silent, "between check points")
        out = tuple(clear[k, : max(int(n), 0)].copy() for k, n in enumerate(number))
        return out, number >= 0


def depth_of(radius: float, reach: float, bend: float, sunk: float) -> float:
    """Bound of the lemma: greatest depth [mm] of a wall of such nodes in a part with no node inside.

    >>> round(depth_of(2.0, 0.4, 0.0, 0.0), 6)
    0.040408
    """
    left = radius - bend - sunk
    return radius - math.sqrt(left * left - reach * reach) if left > reach else math.inf


def covering_of(
    impeller: Impeller, tolerance: float, corner: float, around: int, hub_range: tuple[float, float],
    slack: float = 0.0,
) -> Covering:  # fmt: skip
    """Covering of the walls of the channels of an impeller.

    Parameters
    ----------
    tolerance : [mm] > 0
    corner : least corner radius of the cutters [mm], > 0
    around, hub_range : as :meth:`Impeller.scene`
    slack : [mm] by which tapered cutters protrude from their cylinders, below tolerance and corner

    Raises
    ------
    InputError
        There would be too many nodes.
    """
    tolerance, corner = tolerance - slack, corner - slack
    sunk, edge = SUNK * tolerance, first_edge(impeller, tolerance, corner, around)
    while True:
        sides, hub = _nodes_of_pitch(impeller, around, hub_range, edge)
        parts = [*itertools.chain.from_iterable(sides), hub]
        reach, bend = max(x.reach for x in parts), max(x.bend for x in parts)
        if depth_of(corner, reach, bend, sunk) <= tolerance:
            break
        edge *= max(_cell_factor(corner, reach, bend, sunk, tolerance), _STEP)
    parts = [*_nodes_of_all(impeller, around, sides), hub]
    points = np.concatenate([x.points - sunk * x.normals for x in parts])
    return Covering(points, tolerance + slack, corner, reach, bend, sunk, slack)


def _cell_factor(corner: float, reach: float, bend: float, sunk: float, tolerance: float) -> float:
    """Factor by which the cells are made narrower: reach is proportional to their width, bend to its square.

    >>> round(_cell_factor(2.0, 0.5, 0.0, 0.0, 0.04), 3)
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
            f"a corner radius of {corner:g} mm needs about {number_text(count, 2)} points of the walls: must "
            "be at most "
            f"{_MOST_NODES:g}: raise it, or leave cutters of so small a corner radius out of the catalogue"
        )
    return edge


def _area(impeller: Impeller, around: int) -> float:
    """Approximate area [mm2] of the walls."""
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


def _nodes_of_pitch(
    impeller: Impeller, around: int, hub_range: tuple[float, float], edge: float
) -> tuple[list[list[Nodes]], Nodes]:
    """Nodes of the sides of each body of one pitch, and of the hub under all bodies."""
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


def _nodes_of_all(impeller: Impeller, around: int, sides: list[list[Nodes]]) -> list[Nodes]:
    """Nodes of every body round the channels, turned copies of ``sides``."""
    bodies = len(impeller.bodies)
    numbers = range(-1 - around, bodies + around + 1)
    return [turn_nodes(x, impeller.pitch * (k // bodies)) for k in numbers for x in sides[k % bodies]]
