"""The area that a cutter covers on a plane layer during a move, bounded by curves of the diagram of (theta, t).

Notation: t in 0 .. 1 is the time of the move. The section of the cutter with the layer z = h at t is convex, with the
edge x(theta, t); V is the outward speed of the edge in the layer. The boundary of the covered area is a subset of these
curves: V = 0 (the envelope), the part of the first section with V < 0 and of the last one with V > 0, and the same at
both ends of a time in which the cutter meets the layer at all.

If V has two zeros at every t, the curves form one loop. If the loop does not cross itself, it is the boundary, because
no other candidate exists. If it crosses itself, it bounds the surface in space and time through which points enter the
cutter: it goes once round a point for each time that the cutter comes over the point, and every point that it goes
round at least once is covered. In all other cases the curves are divided where they cross, and a face between them is
kept if one of its points is covered at some t, which branch and bound finds.

Reference: Undeformed chips in five-axis milling by boundary construction diagrams, Computer-Aided Design 88 (2017)
42-59. Differs from source: the speed of the cutter's surface stands for the derivative of the ellipse's equation, so
that flank, corner, ball, taper, bottom face and flute end are one case; the convex section is met by rays from an inner
point.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias, cast

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.ring import Origin, Ring, ring_of_edges, rings_of_polygons
from chipload.engagement.chips.section import cutter_numbers
from chipload.errors import InputError
from chipload.lazy import LateModule

_section = LateModule("chipload.engagement.chips._section")
faces = LateModule("chipload.engagement.chips._diagram_faces")
loop = LateModule("chipload.engagement.chips._boundary")
trace = LateModule("chipload.engagement.chips._grazing_trace")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shape: TypeAlias = shapely.Polygon | shapely.MultiPolygon

#: speed below which the edge stands still, as a share of the tolerance per move
STILL = 1e-3
#: a tip that leaves the line along its axis by less than this share of the tolerance moves along the axis
STRAIGHT = 1e-2
#: instants at which the general case searches for grazing points before it halves a time
_KNOTS = 64
_MOST_EDGES = 4_000_000
_SPANS = 8
#: a layer that the cutter meets for a smaller share of the move is touched at one point
_TOUCH = 1e-12
_GRID = 1e-5  # of the tolerance: points that are nearer are one point where curves are divided


@dataclass(frozen=True, eq=False)
class CoveredArea:
    """Area of a layer that a move covers.

    Parameters
    ----------
    rings : outer ones counter-clockwise, holes clockwise
    height : h of the layer [mm]
    tolerance : most that a ring is off its curve [mm]
    simple : whether the boundary was one loop of two grazing points at every time
    """

    rings: tuple[Ring, ...]
    height: float
    tolerance: float
    simple: bool

    @property
    def area(self) -> float:
        """Area within the curves [mm2]; its error falls with the square of the tolerance."""
        return sum(ring.area for ring in self.rings)

    @property
    def polygon(self) -> shapely.Polygon | shapely.MultiPolygon:
        """The rings as a polygon, or as several."""
        if len(self.rings) == 1:
            return shapely.Polygon(self.rings[0].points)
        signed = [(ring.polygon_area, shapely.Polygon(ring.points)) for ring in self.rings]
        outer = [[p, []] for area, p in signed if area > 0.0]
        for area, hole in signed:
            if area <= 0.0:
                inside = hole.representative_point()
                around = min((o for o in outer if o[0].contains(inside)), key=lambda o: float(o[0].area))
                around[1].append(hole.exterior)
        made = [shapely.Polygon(o.exterior, holes) for o, holes in outer]
        return cast(Shape, made[0] if len(made) == 1 else shapely.MultiPolygon(made))


def covered(move: Move, cutter: Cutter, height: float, tolerance: float) -> CoveredArea | None:
    """Return the area of the layer z = height that a move covers; None if the open cutter never reaches it.

    Parameters
    ----------
    height : h [mm]
    tolerance : most that the polygon may be off the true boundary [mm], > 0

    Raises
    ------
    InputError
        The tolerance is not above 0, or so fine that the boundary has more than four million edges.

    Examples
    --------
    A cutter of 10 mm goes 20 mm straight: pi 5^2 + 2 5 20.

    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> move = Move.lerp([0, 0, 0], [0, 0, 1], [20, 0, 0], [0, 0, 1])
    >>> round(covered(move, mill, 1.0, 1e-4).area, 5)
    278.53982
    """
    return covered_areas(move, cutter, [height], tolerance)[0]


def covered_areas(move: Move, cutter: Cutter, heights: Iterable[float], tolerance: float) -> list[CoveredArea | None]:
    """Return the covered areas of many layers, as :func:`covered`."""
    K, levels = cutter_numbers(cutter), np.array([float(h) for h in heights])
    along = _as_upright_move(move, K, tolerance)
    if along is not None:
        return [_standing_area(*along, h, tolerance) for h in levels.tolist()]
    buffer, count, knots, whole = _loops([move], K, levels, np.array([0, len(levels)]), tolerance)
    start = np.cumsum([0, *count.clip(0)])
    out: list[CoveredArea | None] = []
    for i, h in enumerate(levels.tolist()):
        if count[i] == trace.NOTHING:
            out.append(None)
        elif count[i] == trace.GENERAL:
            out.append(_general_area(move, K, h, tolerance, max(_KNOTS, 4 * int(knots[i]))))
        else:
            edges = buffer[start[i] : start[i + 1]].copy()
            rings: tuple[Ring, ...] = (ring_of_edges(edges),)
            if not whole[i]:
                rings = _without_slivers(
                    rings_of_polygons(_untangle_loop(shapely.Polygon(edges[:, :2])), edges), tolerance
                )
            out.append(CoveredArea(rings, h, tolerance, True))
    return out


def _as_upright_move(move: Move, K: Floats, tolerance: float) -> tuple[Move, Floats] | None:
    """A cylinder that moves along its own leaning axis as a longer one that stands at the lower end, or None.

    Its flank slides along itself, so that every point of it and none would be a grazing point.
    """
    near = STRAIGHT * tolerance
    axis = move.axis[0] / np.linalg.norm(move.axis[0])
    if K[8] != 0.0 or axis[2] == 1.0 or len(move.tip) < 2 or np.abs(move.tip[2:]).sum() > near:
        return None
    if np.abs(move.axis[1:]).sum() * K[10] > near * np.linalg.norm(move.axis[0]):
        return None
    half = float(move.tip[1] @ axis)
    if half == 0.0 or 2.0 * float(np.linalg.norm(move.tip[1] - half * axis)) > near:
        return None
    longer = K.copy()
    longer[10] += 2.0 * abs(half)
    longer.setflags(write=False)
    return Move((move.tip[0] - abs(half) * axis)[None], axis[None]), longer


def _standing_area(move: Move, K: Floats, h: float, tolerance: float) -> CoveredArea | None:
    """Return the area of a layer that a standing cutter covers: its section."""
    if not 0.0 < tolerance < math.inf:
        raise InputError(f"covered: tolerance = {tolerance:g} mm: must be above 0")
    edges = whole_section(move, K, h, 0.0, tolerance)
    return CoveredArea((ring_of_edges(edges),), h, tolerance, True) if len(edges) else None


def _loops(
    moves: Sequence[Move], K: Floats, heights: Floats, first: Ints, tolerance: float
) -> tuple[Floats, Ints, Ints, NDArray[np.bool_]]:
    """Edges of the layers whose boundary is one loop; of each layer how many, NOTHING or GENERAL, how finely time was
    divided, whether the loop is known to be simple.
    """
    if not 0.0 < tolerance < math.inf:
        raise InputError(f"covered: tolerance = {tolerance:g} mm: must be above 0")
    if not np.isfinite(heights).all():
        bad = float(heights[~np.isfinite(heights)][0])
        raise InputError(f"covered: height = {bad:g} mm: must be finite")
    tips, axes = _fill_coefficients([m.tip for m in moves]), _fill_coefficients([m.axis for m in moves])
    count, knots = np.empty(len(heights), np.int64), np.empty(len(heights), np.int64)
    whole = np.empty(len(heights), np.bool_)
    buffer, still = np.empty((max(2048, 128 * len(heights)), 12)), STILL * tolerance
    while loop.loops(tips, axes, K, heights, first, tolerance, still, buffer, count, knots, whole) < len(heights):
        buffer = _larger(buffer)
    return buffer, count, knots, whole


def _fill_coefficients(coefficients: Sequence[Floats]) -> Floats:
    """(m, n, 3) coefficients of many moves, with zeros up to the same order."""
    out = np.zeros((len(coefficients), max((len(c) for c in coefficients), default=1), 3))
    for m, c in enumerate(coefficients):
        out[m, : len(c)] = c
    return out


def _untangle_loop(loop: shapely.Polygon) -> Shape:
    """Return the area that a counter-clockwise loop, which may cross itself, surrounds at least once."""
    return cast(Shape, shapely.buffer(loop, 0.0))


def _larger(buffer: Floats) -> Floats:
    if 4 * len(buffer) > _MOST_EDGES:
        raise InputError("covered: the boundary has more than four million edges: make the tolerance larger")
    return np.empty((4 * len(buffer), 12))


def candidates(move: Move, cutter: Cutter, height: float, tolerance: float) -> Floats:
    """All pieces of the diagram that may bound the covered area, as edges (n, 12) of :mod:`chips.ring`."""
    return _candidates(move, cutter_numbers(cutter), float(height), tolerance, _KNOTS)


def _candidates(move: Move, K: Floats, h: float, tolerance: float, knots: int) -> Floats:
    cp, ca, vmin = move.tip, move.axis, STILL * tolerance
    span, ends = np.empty((_SPANS, 2)), np.empty((knots + 1, 2))
    trace.levels(cp, ca, K, ends)
    m = trace.spans(cp, ca, K, h, ends, span)
    buffer, jumps = np.empty((8192, 12)), np.empty(16)
    found: list[Floats] = []
    for ta, tb in span[:m]:
        if tb - ta <= _TOUCH:
            continue
        n, jumped = faces.candidates(cp, ca, K, h, tolerance, vmin, ta, tb, knots, buffer, 0, jumps)
        while n == trace.FULL:
            buffer = _larger(buffer)
            n, jumped = faces.candidates(cp, ca, K, h, tolerance, vmin, ta, tb, knots, buffer, 0, jumps)
        found.append(buffer[:n].copy())
        for t in jumps[:jumped]:
            found += [
                whole_section(move, K, h, at, tolerance)
                for at in (max(t - 2 * faces.LEAST, ta), min(t + 2 * faces.LEAST, tb))
            ]
    edges = np.concatenate(found) if found else np.empty((0, 12))
    # a section that is a point but for rounding has no direction along its edge, and bounds nothing
    return edges[np.isfinite(edges[:, :4]).all(axis=1)]


def whole_section(move: Move, K: Floats, h: float, t: float, tolerance: float) -> Floats:
    """Edges (n, 12) of the section at t, counter-clockwise; none where the layer isn't cut."""
    S, C, buffer = np.empty(27), np.empty((8, 5)), np.empty((2048, 12))
    if not _section.instant(move.tip, move.axis, K, h, t, S, C):
        return np.empty((0, 12))
    n = trace.ring(S, K, C, tolerance, trace.FIRST, buffer, 0)
    while n < 0:
        buffer = _larger(buffer)
        n = trace.ring(S, K, C, tolerance, trace.FIRST, buffer, 0)
    return buffer[:n].copy()


def _general_area(move: Move, K: Floats, h: float, tolerance: float, knots: int) -> CoveredArea | None:
    """The general case, with the origin of each edge."""
    edges = _candidates(move, K, h, tolerance, knots)
    whole = _noded_shape(edges, move, K, h, tolerance)
    if whole is None:
        return None
    return CoveredArea(_without_slivers(rings_of_polygons(whole, edges), tolerance), h, tolerance, False)


def _noded_shape(edges: Floats, move: Move, K: Floats, h: float, tolerance: float) -> Shape | None:
    """Faces between all pieces of the diagram, those kept that some section covers."""
    if len(edges) == 0:
        return None
    lines = shapely.line_merge(shapely.multilinestrings(edges[:, :4].reshape(-1, 2, 2)))
    net = shapely.unary_union(lines, grid_size=_GRID * tolerance)  # the same curve twice becomes one
    found = np.array(shapely.get_parts(shapely.polygonize([net])))
    if len(found) == 0:
        return None
    thin = shapely.area(found) < tolerance * shapely.length(found)
    points = shapely.get_coordinates(shapely.point_on_surface(found))
    inside = np.empty(len(found), np.bool_)
    over = np.where(thin, tolerance, 0.0)  # what is no wider than the error of the polygon is not left open
    faces.covered_points(move.tip, move.axis, K, h, points, over, 0.01 * tolerance, inside)
    if not inside.any():
        return None
    return cast(Shape, shapely.unary_union(found[inside]))


def _without_slivers(rings: tuple[Ring, ...], tolerance: float) -> tuple[Ring, ...]:
    """Without holes and specks that are no wider than the polygon's own error."""
    kept = []
    for ring in rings:
        around = float(np.hypot(*(np.roll(ring.points, -1, axis=0) - ring.points).T).sum())
        if abs(ring.polygon_area) > 2.0 * tolerance * around or len(rings) == 1:
            kept.append(ring)
    return tuple(kept)


__all__ = [
    "CoveredArea",
    "Origin",
    "candidates",
    "covered",
    "covered_areas",
    "whole_section",
]
