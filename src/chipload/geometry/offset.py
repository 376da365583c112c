"""Parallel curves of contours and regions, as lines and arcs.

Notation: d [mm] the signed distance, positive to the LEFT of travel; theta [rad] the angle by which a contour turns
at a vertex; kappa [1/mm] the curvature, positive to the left; a **raw** segment is the parallel of one input segment
before trimming: a line moved by d n, or an arc of the same centre with the radius ``r - d`` (left turn) or ``r + d``
(right turn). An arc whose parallel would have no positive radius has none. At a vertex that turns away from the offset
side the raw segments do not meet; an arc of radius ``|d|`` about the vertex joins them.

Every point of the trimmed parallel lies at distance ``|d|`` from the input and no nearer to any part of it. Therefore
the raw segments are split wherever they cross, touch or overlap; a piece is retained if its quarter points are at least
``|d| - tol`` from all input; and the retained pieces are chained by their ends. Comparison with OCP:
docs/design/offsets.md.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.errors import ChiploadError, InputError
from chipload.geometry.contour import Contour, Floats, Region
from chipload.geometry.distance import boxes
from chipload.geometry.split import (
    LADDER,
    Ints,
    RawSegments,
    SplitSegments,
    chained_segments,
    left_of,
    lengths_of,
    on_segments,
    split_segments,
    swept,
)
from chipload.lazy import LateModule

_segments = LateModule("chipload.geometry._segments")

#: an arc whose parallel has a smaller radius [mm] than this becomes a point
POINT_MM = 1e-9


def offset(contours: Sequence[Contour], distance_mm: float) -> tuple[Contour, ...]:
    """Parallel curves of contours, trimmed against all contours, in the sense of travel of the input.

    Parameters
    ----------
    contours : closed contours and open chains
    distance_mm : d [mm], positive to the left of travel; 0 returns the contours

    Returns
    -------
    Contours whose every point lies ``|d|`` from the nearest input point (to 1e-9 mm), closed or open, in the order of
    the input; empty if trimming leaves no curve. The parallel of an open chain ends square to the ends of the chain,
    without caps, and is trimmed against both sides of all contours. Of two parallels that coincide (a slot of width
    exactly 2 d) both are dropped if they run in opposite directions, one if they run in the same direction.

    Raises
    ------
    InputError
        ``distance_mm`` is not finite.
    ChiploadError
        The pieces do not close within the largest tolerance, or an input contour crosses itself.

    Examples
    --------
    >>> (inner,) = offset([Contour.circle((0.0, 0.0), 5.0)], 2.0)
    >>> round(float(inner.radii[0]), 12)
    3.0
    """
    return _offset(contours, distance_mm, both_sides=True)


def offset_region(region: Region, distance_mm: float) -> Region:
    """A region inset by ``distance_mm`` [mm], or grown if it is negative.

    An inset region consists of the points at least ``distance_mm`` from the boundary; a grown one also contains every
    point within ``-distance_mm`` of the region. The contours must not cross. The inside of the result is on the left of
    its contours; it has no parts of zero width. Raises as :func:`offset`.

    Examples
    --------
    >>> square = Region.of([Contour.polyline([[0, 0], [4, 0], [4, 4], [0, 4]], closed=True)])
    >>> offset_region(square, 1.0).area
    4.0
    """
    return Region(_offset(region.contours, distance_mm, both_sides=False))


def _offset(contours: Sequence[Contour], d: float, both_sides: bool) -> tuple[Contour, ...]:
    if not np.isfinite(d):
        raise InputError(f"offset: distance_mm = {d}: must be a finite number")
    if d == 0.0 or not contours:
        return tuple(contours)
    raw = _raw(contours, d, both_sides)
    given = np.vstack([c.segments for c in contours])
    if len(raw.segments) == 0:
        return ()
    lost = np.zeros(2)
    for tol, snap in LADDER:
        done, place = _trim_offsets(raw, given, d, tol, snap)
        if place is None:
            return done
        lost = place
    raise ChiploadError(
        f"offset: the parallel at {d:.6g} mm does not close at ({lost[0]:.6g}, {lost[1]:.6g}): "
        "the contour crosses itself, or has segments shorter than the tolerance"
    )


# -- raw parallels ------------------------------------------------------------------------------------------------
def _raw(contours: Sequence[Contour], d: float, both_sides: bool) -> RawSegments:
    parts = [(_parallel(c, d), False, not c.closed) for c in contours]
    if both_sides:
        parts += [(_parallel(c, -d), True, False) for c in contours]
        for c in contours:
            if not c.closed:
                for x, y in (c.start, c.end):
                    parts.append(((Contour.circle((x, y), abs(d)).segments, np.array([-1])), True, False))
    rows, smooth, knife, ends = [], [], [], []
    total = 0
    for (seg, link), cuts, is_open in parts:
        n = len(seg)
        rows.append(seg)
        smooth.append(np.where(link >= 0, link + total, -1))
        knife.append(np.full(n, cuts))
        end = np.zeros((n, 2), dtype=np.bool_)
        if is_open and n:
            end[0, 0] = end[-1, 1] = True
        ends.append(end)
        total += n
    return RawSegments(np.vstack(rows), np.concatenate(smooth), np.concatenate(knife), np.vstack(ends))


def _parallel(contour: Contour, d: float) -> tuple[Floats, Ints]:
    """Raw segments (n, 7) of a contour with their joining arcs, and the tangential successor (n,) of each or -1."""
    seg = contour.segments
    count = len(seg)
    p0, p1, sweep = seg[:, 0:2], seg[:, 2:4], seg[:, 6]
    arc = sweep != 0.0
    sense = np.sign(sweep)
    centre = true_centres(seg)
    r = np.where(arc, np.hypot(*(p0 - centre).T), 1.0)
    kappa = sense / r
    t0 = np.where(arc[:, None], sense[:, None] * left_of(p0 - centre), p1 - p0)
    t1 = np.where(arc[:, None], sense[:, None] * left_of(p1 - centre), p1 - p0)
    t0, t1 = t0 / np.hypot(*t0.T)[:, None], t1 / np.hypot(*t1.T)[:, None]
    radius = np.where(arc, r - sense * d, np.inf)
    ratio = (np.where(np.abs(radius) <= POINT_MM, 0.0, np.where(arc, radius, 1.0)) / r)[:, None]
    a = np.where(arc[:, None], centre + ratio * (p0 - centre), p0 + d * left_of(t0))
    b = np.where(arc[:, None], centre + ratio * (p1 - centre), p1 + d * left_of(t1))
    alive = radius > POINT_MM
    length = np.where(arc, np.abs(sweep) * np.abs(np.where(arc, radius, 1.0)), contour.lengths)
    bend = np.where(arc & alive, 1.0 / np.where(alive, radius, 1.0), 0.0)

    joints = range(count if contour.closed else count - 1)
    links: dict[int, tuple[Floats, bool]] = {}
    seamless: set[int] = set()
    for i in joints:
        j = (i + 1) % count
        theta = float(np.arctan2(t1[i, 0] * t0[j, 1] - t1[i, 1] * t0[j, 0], t1[i] @ t0[j]))
        gap = float(np.hypot(*(a[j] - b[i])))
        both = bool(alive[i] and alive[j])
        # at a cusp the curvatures decide to which side the contour turns back; a retraced path is joined on both sides
        cusp = abs(theta) > np.pi - 1e-9
        if cusp and kappa[i] + kappa[j] != 0.0:
            theta = -np.copysign(np.pi, kappa[i] + kappa[j])
        # lateral error of moving both ends along the curve to the middle of the gap
        bow = abs(d) * theta**2 / 4.0 + gap**2 / 8.0 * (bend[i] + bend[j])
        if gap <= LADDER[0][1] or (both and bow < 2e-10 and 4.0 * gap < min(length[i], length[j])):
            b[i] = a[j] = 0.5 * (b[i] + a[j])
            if both and abs(theta) < 1e-4:
                seamless.add(i)
        elif d * theta < 0.0 or (cusp and kappa[i] + kappa[j] == 0.0):
            turn = -np.sign(d) * abs(theta)
            links[i] = (np.concatenate([b[i], a[j], 0.5 * (p1[i] + p0[j]), [turn]]), True)
        elif both and abs(theta) < 0.1:
            x = _corner(b[i], a[j], (t1[i], t0[j]), (centre[i], centre[j]), (radius[i], radius[j]))
            reach = max(float(np.hypot(*(x - b[i]))), float(np.hypot(*(x - a[j]))))
            if reach < min(2.0 * gap, 0.25 * min(length[i], length[j])):
                b[i] = a[j] = x

    rows: list[Floats] = []
    follow: list[int] = []
    for i in range(count):
        if alive[i]:
            rows.append(np.concatenate([a[i], b[i], centre[i] if arc[i] else (0.0, 0.0), [sweep[i]]]))
            follow.append(len(rows) if i in links or i in seamless else -1)
        if i in links:
            rows.append(links[i][0])
            follow.append(len(rows) if alive[(i + 1) % count] else -1)
    if not rows:
        return np.zeros((0, 7)), np.zeros(0, dtype=np.int64)
    out = np.array(rows)
    smooth = np.array(follow, dtype=np.int64)
    smooth[smooth == len(out)] = 0 if contour.closed else -1
    out[:, 6] = swept(out, out[:, 0:2], out[:, 2:4], out[:, 6])
    # a segment that its snapped ends make shorter than POINT_MM is dropped; its neighbours then meet
    keep = (np.hypot(*(out[:, 2:4] - out[:, 0:2]).T) > POINT_MM) | (np.abs(out[:, 6]) > np.pi)
    place = np.cumsum(keep) - 1
    smooth = np.where((smooth >= 0) & keep[smooth], place[smooth], -1)
    return out[keep], smooth[keep]


def _corner(
    p: Floats, q: Floats, tangents: tuple[Floats, Floats], centres: tuple[Floats, Floats], radii: tuple[float, float]
) -> Floats:
    """Intersection (2,) of two raw segments near p (on the first) and q (on the second), by Newton's method."""
    x = 0.5 * (p + q)
    for _ in range(8):
        f = np.empty(2)
        jac = np.empty((2, 2))
        for k, on in enumerate((p, q)):
            if np.isfinite(radii[k]):
                v = x - centres[k]
                dist = float(np.hypot(*v))
                f[k], jac[k] = dist - radii[k], v / dist
            else:
                jac[k] = left_of(tangents[k])
                f[k] = jac[k] @ (x - on)
        det = jac[0, 0] * jac[1, 1] - jac[0, 1] * jac[1, 0]
        if det == 0.0:
            return np.full(2, np.inf)
        step = np.array([jac[1, 1] * f[0] - jac[0, 1] * f[1], jac[0, 0] * f[1] - jac[1, 0] * f[0]]) / det
        x = x - step
    return x


def true_centres(seg: Floats) -> Floats:
    """Centres (n, 2) [mm] of segments (n, 7), moved along the chord so that both ends of an arc have one radius."""
    chord = seg[:, 2:4] - seg[:, 0:2]
    length = np.hypot(*chord.T)
    fit = (seg[:, 6] != 0.0) & (length > 1e-6)
    u = chord / np.where(fit, length, 1.0)[:, None]
    slip = np.sum((seg[:, 4:6] - 0.5 * (seg[:, 0:2] + seg[:, 2:4])) * u, axis=1)
    out: Floats = seg[:, 4:6] - np.where(fit, slip, 0.0)[:, None] * u
    return out


# -- trimming -----------------------------------------------------------------------------------------------------
def _trim_offsets(
    raw: RawSegments, given: Floats, d: float, tol: float, snap: float
) -> tuple[tuple[Contour, ...], Floats | None]:
    """The parallel contours, and a point of a valid piece that belongs to no contour (None: there is no such piece)."""
    pieces, loose = split_segments(raw, tol, snap)
    pieces = pieces[~raw.knife[pieces.raw]]
    fixed = boxes(given)

    def too_near(some: SplitSegments, limit: float) -> NDArray[np.bool_]:
        out = np.empty(len(some.raw), dtype=np.bool_)
        _segments.within_distance(given, fixed, _samples(raw, some), limit, out)
        return out

    pieces = pieces[~too_near(pieces, abs(d) - tol)]
    pieces = pieces[_single(raw, pieces, 10.0 * snap)]
    alive = _without_dead_ends(pieces, loose)
    rest = pieces[~alive]
    pieces = pieces[alive]
    if len(rest.raw):
        seg = raw.segments[rest.raw]
        long = lengths_of(seg) * (rest.span[:, 1] - rest.span[:, 0]) > 100.0 * snap
        sound = long & ~too_near(rest, abs(d) - 1e-3 * tol)
        if sound.any():
            return (), rest.place[rest.node[int(sound.argmax()), 0]]
    return chained_segments(raw, pieces, d, tol), None


def _samples(raw: RawSegments, pieces: SplitSegments) -> Floats:
    """(m, 3, 2) middle and quarter points of the pieces."""
    seg, (t0, t1) = raw.segments[pieces.raw], pieces.span.T
    return np.stack([on_segments(seg, t0 + w * (t1 - t0)) for w in (0.5, 0.25, 0.75)], axis=1)


def _single(raw: RawSegments, pieces: SplitSegments, same: float) -> NDArray[np.bool_]:
    """(m,) whether each piece is retained: of coincident pieces in one direction the first, of opposite ones none."""
    middle = _samples(raw, pieces)[:, 0]
    groups: dict[tuple[int, int], list[int]] = defaultdict(list)
    for k, (a, b) in enumerate(pieces.node):
        groups[(a, b) if a < b else (b, a)].append(k)
    keep = np.ones(len(pieces.raw), dtype=np.bool_)
    for members in groups.values():
        while len(members) > 1:
            k, *rest = members
            twins = [m for m in rest if np.hypot(*(middle[m] - middle[k])) <= same]
            members = [m for m in rest if m not in twins]
            ring = pieces.node[k, 0] == pieces.node[k, 1]
            ahead = [
                m for m in twins
                if (raw.segments[pieces.raw[m], 6] * raw.segments[pieces.raw[k], 6] > 0.0 if ring
                    else pieces.node[m, 0] == pieces.node[k, 0])
            ]  # fmt: skip
            keep[twins] = False
            if len(ahead) < len(twins):
                keep[k] = False
    return keep


def _without_dead_ends(pieces: SplitSegments, loose: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(m,) whether each piece remains when dead ends are removed until there are none."""
    alive = np.ones(len(pieces.raw), dtype=np.bool_)
    if not len(alive):
        return alive
    size = len(pieces.place)
    while True:
        starts = np.bincount(pieces.node[alive, 0], minlength=size)
        ends = np.bincount(pieces.node[alive, 1], minlength=size)
        dead = alive & (
            ((ends[pieces.node[:, 0]] == 0) & ~loose[pieces.node[:, 0]])
            | ((starts[pieces.node[:, 1]] == 0) & ~loose[pieces.node[:, 1]])
        )
        if not dead.any():
            return alive
        alive &= ~dead
