"""Passes of a contour: centre path, the stock that each one meets, lead-in and lead-out.

Notation: planning frame, material on the right; R cutter radius, s radial depth of the finish pass, s1 that of the
semi-finish pass; W the walls, O the finish centre path.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chipload.engagement.contact import StockBoundary
from chipload.errors import InputError
from chipload.geometry.contour import Contour, Region
from chipload.geometry.distance import distance
from chipload.geometry.offset import offset
from chipload.planning.contour.backward import pass_before
from chipload.planning.contour.offsets import Walls
from chipload.planning.result import Event


@dataclass(frozen=True, eq=False)
class ContourPass:
    """One pass round one wall.

    ``path`` the centre path that makes the wall, ``lead_in`` and ``lead_out`` (None where there is no room),
    ``stock`` the stock that it meets, ``stopped`` the reason why it ends too early.
    """

    name: str
    path: Contour
    lead_in: Contour | None
    lead_out: Contour | None
    stock: StockBoundary
    stopped: Event | None = None


def surface(paths: Sequence[Contour], radius: float) -> tuple[Contour, ...]:
    """Surface that a pass leaves on its right: the parallel of its centre paths at R."""
    return offset(paths, -radius)


def semifinish_paths(
    after: Sequence[Contour], walls: Walls, radius: float, stock: float, engagement: float | None
) -> tuple[Contour, ...]:
    """Centre paths of one semi-finish pass.

    Parameters
    ----------
    after : centre paths of the pass that follows
    walls, radius : the walls, and R [mm]
    stock : what the pass leaves on the walls [mm]: it is parallel to them at R + ``stock``
    engagement : a* [rad] of the pass that follows: O* of the backward method in place of the parallel

    Raises
    ------
    InputError
        The pass vanishes somewhere, so that the one that follows would meet more than it should.
    """
    if engagement is None:
        paths = offset(walls.extended, radius + stock)
    else:
        paths = tuple(c for path in after for c in pass_before(path, radius, engagement))
    if len(paths) != len(after):
        raise InputError(
            f"operation: the semi-finish pass that leaves {stock:g} mm falls into {len(paths)} pieces where the next "
            f"pass has {len(after)}: the passage is too narrow, take a smaller cutter, radial_depth_mm or fewer passes"
        )
    return paths


def rough_stock(walls: Walls, rough: Sequence[Contour], behind: float) -> Region:
    """The stock on the walls before the first pass, as a closed region: from the rough surface to ``behind`` mm inside
    the part, or to half of it, a quarter ... where the parallel of an open wall breaks there.

    Raises
    ------
    InputError
        The walls are too crowded for even a 32nd of it.
    """
    depth = behind
    while depth > behind / 50.0:
        inner = offset(walls.extended, -depth)
        if all(c.closed for c in walls.extended):
            return Region.of([*rough, *inner])
        if len(inner) == len(rough) == 1:
            return Region.of([_closed_between(rough[0], inner[0])])
        depth *= 0.5
    x, y = walls.walls[0].start
    raise InputError(f"part: the walls near ({x:.4g}, {y:.4g}) leave no room for stock behind them")


def _closed_between(a: Contour, b: Contour) -> Contour:
    """Two open chains that run the same way, joined at their ends."""
    ends = np.zeros((2, 7))
    ends[0, :4] = *a.end, *b.end
    ends[1, :4] = *b.start, *a.start
    return Contour(np.vstack([a.segments, ends[:1], b.reversed().segments, ends[1:]]))


def boundary(contours: Sequence[Contour]) -> StockBoundary:
    """Stock on the right of ``contours`` as the kernel wants it, on the left.

    Raises
    ------
    InputError
        There are none.
    """
    if not contours:
        raise InputError("the stock before the first pass has no outline: state a smaller semifinish_depth_mm")
    return StockBoundary(np.vstack([c.reversed().segments for c in contours]))


def start_at_widest(path: Contour) -> Contour:
    """A closed path started in the middle of its longest segment; an open one as it is."""
    if not path.closed:
        return path
    k = int(np.argmax(path.lengths))
    return path.started_at(0.5 * (path.knots[k] + path.knots[k + 1]))


def run_on_length(radius: float, lead: float, passes: int) -> float:
    """Length [mm] by which open walls are extended for ``passes`` passes before the last one.

    Each pass runs on by 2 R more than the pass that follows it (:func:`with_leads`); the rim of the first one, on its
    quarter circle, reaches up to ``lead`` + R beyond that.
    """
    return 2.0 * lead + (2.0 * passes + 1.0) * radius


def with_leads(
    name: str,
    path: Contour,
    stock: StockBoundary,
    walls: Walls,
    radius: float,
    lead: float,
    later: int = 0,
    ahead: float = 0.0,
) -> ContourPass:
    """A pass with lead-in and lead-out: quarter circles tangent to the path on the free side.

    The path of an open chain is that over the extended one; between its quarter circles and the chain it runs on
    along the end tangents by ``lead`` mm, and by 2 R more for each of the ``later`` passes that follow, so that no
    pass meets the ends of the one before it. By the backward method both ends of an open path lie ``ahead`` mm (R sin
    a* for each later pass) further along than those of the last one: the parts are measured from where those lie.
    """
    if path.closed:
        return ContourPass(
            name, path, _quarter(path, walls, radius, lead, 0.0), _quarter(path, walls, radius, lead, None), stock
        )
    on = lead + 2.0 * later * radius
    first, last = walls.run_on - ahead, path.length - walls.run_on - ahead
    path, begins, ends = path.part(first, last), path.part(first - on, first), path.part(last, last + on)
    lead_in, lead_out = _quarter(begins, walls, radius, lead, 0.0), _quarter(ends, walls, radius, lead, None)
    return ContourPass(
        name,
        path,
        begins if lead_in is None else Contour.join([lead_in, begins]),
        ends if lead_out is None else Contour.join([ends, lead_out]),
        stock,
    )


def _quarter(path: Contour, walls: Walls, radius: float, lead: float, at: float | None) -> Contour | None:
    """A quarter circle into the start of ``path`` (``at`` = 0) or out of its end (None), on its left.

    Its radius ``lead`` is halved until it is R clear of all walls; None where there is no room.
    """
    p, t, _ = path.at([path.length if at is None else at])
    o, t = p[0], t[0]
    n = np.array([-t[1], t[0]])
    wall = np.vstack([w.segments for w in walls.extended])
    while lead > 1e-3 * radius:
        c = o + lead * n
        ends = (*(c - lead * t), *o) if at is not None else (*o, *(c + lead * t))
        arc = Contour(np.array([[*ends, *c, 0.5 * math.pi]]))
        if distance(wall, arc.at(np.linspace(0.0, arc.length, 64))[0]).min() >= radius - 1e-7:
            return arc
        lead *= 0.5
    return None
