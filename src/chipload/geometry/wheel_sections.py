"""Sections of the blades of a wheel that is a closed mesh, by surfaces of revolution between its hub and its shroud.

Notation: as in ``wheel_meridian.py``; v the height of a surface between hub, 0, and shroud, 1. A **ring** is where such
a surface cuts the mesh round one blade. A section is fitted to its ring by splines between the corners at its edges.
The first and the last section are those of the nearest surfaces, continued to the hub and to the tips.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.mesh import level_rings
from chipload.geometry.sections import check_sections, loft
from chipload.geometry.wheel_meridian import WheelMeridian, meridional, wheel_meridian
from chipload.lazy import scipy, trimesh

Floats = NDArray[np.float64]

#: heights of the sections, the outer ones a little way from hub and tips, and of the one that is looked at first
HEIGHTS, MIDDLE = (0.02, 0.06, 0.12, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.98), 0.5
#: points of one side of a section between its edges, of half an edge, and most spans of the spline of a side
SIDE, EDGE_POINTS, SPANS = 61, 6, 40
#: a corner of a ring turns by this angle [rad] between chords of this share of its thickness
CORNER, WINDOW = 0.9, 0.3
#: how far from its outermost point the corners of an edge lie, over the thickness; half of an edge without corners, and
#: the least distance along the ring of its opposite sides, as shares of the ring
BLUNT, ROUND_EDGE, OPPOSITE = 2.0, 0.01, 0.1
#: an edge is straight that bulges by less than this share of its width
STRAIGHT = 0.3
#: blades whose rings differ in length by less than this share are alike
ALIKE = 0.02
#: a ring of a blade: greatest width over its length, least length along the channel, least angle about the axis [rad]
SLENDER, ALONG, WRAP = 0.35, 0.2, 0.05
#: heights between which vertices are compared with the blade, and the share of its length at each edge that is left out
COMPARED, EDGE = (0.01, 0.99), 0.03


@dataclass(frozen=True, eq=False)
class WheelBlades:
    """The blades of a wheel.

    Parameters
    ----------
    meridian : its hub and shroud
    count : number of blades, evenly round
    bodies : closed sections (n, 3) float [mm] of a blade from hub to shroud, and of a splitter if there is one
    off : [mm] greatest distance of a vertex on the sides of the blade that was read from the one through its sections
    usual : [mm] the same, of 95 % of the vertices
    others : [mm] greatest distance of a vertex on the sides of any blade from the one that was read, turned to it
    """

    meridian: WheelMeridian
    count: int
    bodies: tuple[tuple[Floats, ...], ...]
    off: float
    usual: float
    others: float


def wheel_blades(mesh: trimesh.Trimesh) -> WheelBlades | None:
    """The blades of a wheel about z; None where the mesh is no wheel with blades.

    Parameters
    ----------
    mesh : closed, in mm

    Raises
    ------
    InputError
        The wheel is closed by a shroud, has blades of three lengths or more or unevenly round, or they have no closed
        sections.
    """
    found = wheel_meridian(mesh)
    if found is None:
        return None
    values = found.height(np.asarray(mesh.vertices, dtype=np.float64))
    middle = [ring for ring in _rings(mesh, found, values, MIDDLE) if _like_blade(ring)]
    kinds = _kinds(middle)
    if not kinds:
        return None
    if found.closed:
        raise InputError(
            f"{len(kinds[0])} blades stand between two surfaces of revolution: a wheel with a shroud is not milled "
            "from its open side: leave the shroud out of the model"
        )
    rows = [middle if v == MIDDLE else _rings(mesh, found, values, v) for v in HEIGHTS]
    count = len(kinds[0])
    starts = [kind[0] for kind in kinds]
    if len(starts) == 2:
        # the splitter behind the blade in the sense of a growing angle
        ahead = [(_angle(ring) - _angle(starts[0])) % (2.0 * np.pi) for ring in kinds[1]]
        starts[1] = kinds[1][int(np.argmin(ahead))]
    bodies = tuple(_body(rows, start) for start in starts)
    off = _off(mesh, found, bodies, count)
    first = off[0]
    if not len(first):
        raise InputError("no vertex of the mesh lies on the sides of the first blade: export it in more triangles")
    return WheelBlades(
        found, count, bodies, float(first.max()), float(np.quantile(first, 0.95)),
        max(float(d.max(initial=0.0)) for d in off),
    )  # fmt: skip


# -- rings ------------------------------------------------------------------------------------------------------
def _rings(mesh: trimesh.Trimesh, found: WheelMeridian, values: Floats, v: float) -> list[Floats]:
    """The closed rings (n, 3) [mm] at the height v that lie in the channel."""
    p = np.asarray(mesh.vertices, dtype=np.float64)
    near = found.channel.buffer(4.0 * found.fine)
    shapely.prepare(near)
    out = []
    for first, last in level_rings(np.asarray(mesh.faces), values, v):
        a, b, fa, fb = p[first], p[last], values[first] - v, values[last] - v
        # the edge is straight, the height along it is not linear
        t = fa / (fa - fb)
        for _ in range(4):
            q = a + t[:, None] * (b - a)
            f = found.height(q) - v
            same = (f < 0.0) == (fa < 0.0)
            a, fa = np.where(same[:, None], q, a), np.where(same, f, fa)
            b, fb = np.where(same[:, None], b, q), np.where(same, fb, f)
            t = np.where(fa == fb, 0.0, fa / np.where(fa == fb, 1.0, fa - fb))
        ring = a + t[:, None] * (b - a)
        rz = meridional(ring)
        if len(ring) >= 12 and shapely.contains_xy(near, rz[:, 0], rz[:, 1]).all():
            out.append(_distinct(ring, 1e-2 * found.fine))
    return [ring for ring in out if len(ring) >= 12]


def _distinct(ring: Floats, least: float) -> Floats:
    """A ring without points nearer than ``least`` to the one before."""
    kept = [0]
    for k in range(1, len(ring)):
        if np.linalg.norm(ring[k] - ring[kept[-1]]) > least and np.linalg.norm(ring[k] - ring[0]) > least:
            kept.append(k)
    return ring[kept]


def _length(ring: Floats) -> float:
    return float(np.linalg.norm(np.diff(np.concatenate([ring, ring[:1]]), axis=0), axis=1).sum())


def _angle(ring: Floats) -> float:
    """Angle [rad] of the middle of a ring round the axis."""
    middle = ring.mean(axis=0)
    return float(np.arctan2(middle[1], middle[0]))


def _like_blade(ring: Floats) -> bool:
    """Whether a ring is that of a blade: slender, along the channel, and turned about the axis; a tooth is none."""
    half = 0.5 * _length(ring)
    middle = ring.mean(axis=0)
    theta = np.unwrap(np.arctan2(ring[:, 1], ring[:, 0]))
    rz = meridional(ring)
    along = float(np.linalg.norm(np.ptp(rz, axis=0)))
    flat = np.linalg.svd(ring - middle, full_matrices=False)[0:2][1] / np.sqrt(len(ring))
    slender = flat[1] < SLENDER * flat[0]
    i, j = (int(x) for x in (rz @ np.array([1.0, -1.0])).argsort()[[0, -1]])
    wrap = abs(float(theta[i] - theta[j]))
    return bool(slender and along > ALONG * half and wrap > WRAP and np.ptp(theta) < 2.0 * np.pi)


def _kinds(rings: list[Floats]) -> list[list[Floats]]:
    """Rings that are alike, each kind evenly round the axis, the longest first; none where there are no blades."""
    kinds: list[list[Floats]] = []
    for ring in sorted(rings, key=_length, reverse=True):
        if kinds and _length(kinds[-1][0]) < (1.0 + ALIKE) * _length(ring):
            kinds[-1].append(ring)
        else:
            kinds.append([ring])
    kinds = [kind for kind in kinds if len(kind) >= 3]
    if not kinds:
        return []
    counts = [len(kind) for kind in kinds]
    if len(kinds) > 2 or len(set(counts)) > 1:
        raise InputError(
            f"blades of {len(kinds)} lengths, {', '.join(map(str, counts))} of each: must be alike, or with one "
            "splitter between two blades: state sections of one blade"
        )
    for kind in kinds:
        angle = np.sort([_angle(ring) for ring in kind])
        step = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
        if np.abs(step * len(kind) / (2.0 * np.pi) - 1.0).max() > 0.05:
            raise InputError(
                f"{len(kind)} blades are {np.degrees(step.min()):.4g} to {np.degrees(step.max()):.4g} deg apart: must "
                "be evenly round the axis: turn the part so that its axis of rotation is x, y or z, through the origin"
            )
    return kinds


# -- sections ---------------------------------------------------------------------------------------------------
def _body(rows: list[list[Floats]], start: Floats) -> tuple[Floats, ...]:
    """The sections of the blade whose ring at the middle height is ``start``, from hub to tips."""
    middle = HEIGHTS.index(MIDDLE)
    rings: dict[int, Floats] = {middle: start}
    for order in (range(middle + 1, len(rows)), range(middle - 1, -1, -1)):
        before = start
        for k in order:
            alike = [r for r in rows[k] if 0.5 < _length(r) / _length(before) < 2.0]
            if not alike:
                raise InputError(
                    f"no closed section of the blade at {100.0 * HEIGHTS[k]:g} % of its height from hub to tips: the "
                    "blade is joined to another one there, or open: state sections"
                )
            before = min(alike, key=lambda r: float(np.linalg.norm(r.mean(axis=0) - before.mean(axis=0))))
            rings[k] = before
    # an edge is blunt where it is in all sections, so that points of equal number lie above one another
    found = [_edges(rings[k], _lengths(rings[k]), (True, True))[1] for k in range(len(rows))]
    blunt = all(b[0] for b in found), all(b[1] for b in found)
    shaped = [_section(rings[k], blunt) for k in range(len(rows))]
    v = np.array(HEIGHTS)
    whole = np.stack(shaped)
    ends = [_extrapolate(whole[:3], v[:3], 0.0), _extrapolate(whole[-3:], v[-3:], 1.0)]
    return (ends[0], *shaped, ends[1])


def _extrapolate(sections: Floats, v: Floats, at: float) -> Floats:
    """The section at a height by the parabola through three."""
    share = [np.prod((at - np.delete(v, k)) / (v[k] - np.delete(v, k))) for k in range(3)]
    return np.asarray(np.tensordot(share, sections, axes=1), dtype=np.float64)


def _lengths(ring: Floats) -> Floats:
    """Lengths (n + 1,) along a ring from its first point and back to it."""
    return np.concatenate([[0.0], np.linalg.norm(np.diff(np.concatenate([ring, ring[:1]]), axis=0), axis=1).cumsum()])


def _section(ring: Floats, blunt: tuple[bool, bool]) -> Floats:
    """A section (n, 3) from the middle of its edge of greater z, along one side and back along the other."""
    closed = np.concatenate([ring, ring[:1]])
    at = _lengths(ring)
    edges, _ = _edges(ring, at, blunt)
    (a0, _, a1), (b0, _, b1) = edges
    whole = float(at[-1])
    shape = [_edge(closed, at, edge) for edge in edges]
    one = _side(closed, at, (a1, b0))
    two = _side(closed[::-1], (at[-1] - at)[::-1], (whole - a0, whole - b1))
    n = EDGE_POINTS - 1
    sides = [
        np.concatenate([shape[0][n:-1], one, shape[1][1 : n + 1]]),
        np.concatenate([shape[0][n:0:-1], two, shape[1][: n - 1 : -1][1:]]),
    ]
    # the side of the greater angle about the axis first
    p, q = sides[0][len(one) // 2], sides[1][len(one) // 2]
    if p[0] * q[1] - p[1] * q[0] > 0.0:
        sides = sides[::-1]
    return np.concatenate([sides[0], sides[1][-2:0:-1]])


def _edge(closed: Floats, at: Floats, edge: tuple[float, float, float]) -> Floats:
    """Points of an edge from its begin to its end; a straight line where it bulges by little: a burr of the model."""
    begin, _, end = edge
    arc = np.array([_along(closed, at, s) for s in np.linspace(begin, end, 2 * EDGE_POINTS - 1)])
    chord = arc[0] + np.linspace(0.0, 1.0, len(arc))[:, None] * (arc[-1] - arc[0])
    bulge = np.linalg.norm(arc - chord, axis=1).max()
    return chord if bulge < STRAIGHT * np.linalg.norm(arc[-1] - arc[0]) else arc


def _along(closed: Floats, at: Floats, s: float) -> Floats:
    """The point (3,) of a ring at a length from its first point."""
    return np.array([np.interp(s % at[-1], at, x) for x in closed.T])


def _side(closed: Floats, at: Floats, ends: tuple[float, float]) -> Floats:
    """Points (SIDE, 3) of a side by a spline between two lengths along a ring."""
    whole = float(at[-1])
    begin = ends[0] % whole
    end = begin + (ends[1] - ends[0]) % whole
    places = np.concatenate([at[:-1], at[:-1] + whole])
    points = np.concatenate([closed[:-1]] * 2)
    kept = (places > begin + 1e-9 * whole) & (places < end - 1e-9 * whole)
    first, last = _along(closed, at, begin), _along(closed, at, end)
    return _spline_points(np.concatenate([first[None], points[kept], last[None]]))


def _edges(
    ring: Floats, at: Floats, blunt: tuple[bool, bool]
) -> tuple[list[tuple[float, float, float]], tuple[bool, bool]]:
    """Both edges of a ring, that of greater z first, and whether each is blunt; what must not be so is taken as round.

    An edge is the lengths along the ring at which it begins, has its middle, and ends. A blunt edge lies between its
    two corners; a round one goes ``ROUND_EDGE`` of the ring to both sides of the outermost point.
    """
    apart = np.sqrt(((ring[:, None] - ring[None]) ** 2).sum(axis=2))
    i, j = (int(x) for x in np.unravel_index(int(apart.argmax()), apart.shape))
    whole = float(at[-1])
    between = np.abs((at[:-1, None] - at[None, :-1] + 0.5 * whole) % whole - 0.5 * whole)
    thick = float(np.median(np.where(between > OPPOSITE * whole, apart, np.inf).min(axis=1)))
    out, flags = [], []
    for k, may in zip((i, j) if ring[i, 2] >= ring[j, 2] else (j, i), blunt, strict=True):
        away = (at[:-1] - at[k] + 0.5 * whole) % whole - 0.5 * whole
        near = np.flatnonzero(np.abs(away) < BLUNT * thick)
        turn = np.array([_turn(ring, at, int(c), WINDOW * thick) for c in near])
        span = [
            float(away[c]) for c, t in zip(near, turn, strict=True)
            if t > CORNER and t == turn[np.abs(away[near] - away[c]) < WINDOW * thick].max()
        ]  # fmt: skip
        flags.append(may and len(span) > 1)
        low, high = (min(span), max(span)) if flags[-1] else (-ROUND_EDGE * whole, ROUND_EDGE * whole)
        begin = float(at[k]) + low
        out.append((begin, begin + 0.5 * (high - low), begin + high - low))
    return out, (flags[0], flags[1])


def _turn(ring: Floats, at: Floats, k: int, window: float) -> float:
    """Angle [rad] by which a ring turns at a point, between chords to points so far along it [mm]."""
    closed = np.concatenate([ring, ring[:1]])
    a, b = ring[k] - _along(closed, at, at[k] - window), _along(closed, at, at[k] + window) - ring[k]
    return float(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1.0, 1.0)))


def _spline_points(side: Floats) -> Floats:
    """SIDE points of a spline through a side (n, 3), closer together towards its ends."""
    at = np.concatenate([[0.0], np.linalg.norm(np.diff(side, axis=0), axis=1).cumsum()])
    at /= at[-1]
    x = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, SIDE))
    spans = min(SPANS, (len(side) - 1) // 3)
    if spans < 2:
        out = np.stack([np.interp(x, at, p) for p in side.T], axis=-1)
    else:
        inner = np.interp(np.linspace(0.0, len(at) - 1.0, spans + 1)[1:-1], np.arange(len(at)), at)
        knots = np.concatenate([np.zeros(4), inner, np.ones(4)])
        out = scipy.interpolate.make_lsq_spline(at, side, knots, k=3)(x)
    out[0], out[-1] = side[0], side[-1]
    return np.asarray(out)


# -- comparison with the mesh -----------------------------------------------------------------------------------
def _off(
    mesh: trimesh.Trimesh, found: WheelMeridian, bodies: tuple[tuple[Floats, ...], ...], count: int
) -> list[Floats]:
    """For each blade round the axis, distances (k,) [mm] of the vertices of its sides from the first one, turned."""
    p = np.asarray(mesh.vertices, dtype=np.float64)
    v, rz = found.height(p), meridional(p)
    in_channel = shapely.contains_xy(found.channel.buffer(-found.fine), rz[:, 0], rz[:, 1])
    p = p[in_channel & (v > COMPARED[0]) & (v < COMPARED[1])]
    a, b = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 1.0, 301), np.linspace(0.0, 1.0, 81), indexing="ij"))
    edge = np.tile((a < EDGE) | (a > 1.0 - EDGE), 2 * len(bodies))
    patches = [side for body in bodies for blade in [loft(check_sections(body))] for side in (blade.plus, blade.minus)]
    places, normals = (np.concatenate(x) for x in zip(*((q.at(a, b), q.normal(a, b)) for q in patches), strict=True))
    trees = scipy.spatial.cKDTree(places)
    # a vertex belongs to the blade that it is nearest to when it is turned back
    every, away = [], []
    for k in range(count):
        c, s = np.cos(2.0 * np.pi * k / count), np.sin(2.0 * np.pi * k / count)
        turned = np.stack([p[:, 0] * c + p[:, 1] * s, p[:, 1] * c - p[:, 0] * s, p[:, 2]], axis=-1)
        far, which = trees.query(turned)
        away.append(far)
        every.append(np.where(edge[which], np.nan, np.abs(((turned - places[which]) * normals[which]).sum(axis=1))))
    own = np.argmin(away, axis=0)
    return [d[(own == k) & ~np.isnan(d)] for k, d in enumerate(every)]
