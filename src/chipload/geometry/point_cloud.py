"""Sections of a blade out of a cloud of points: measured points, or nodes of a mesh, that lie on levels.

A level is a plane x, y or z = constant, or a cylinder about the axis of rotation. The points of a level are joined to
the shortest closed polyline through them, which goes once round the profile as long as neighbours on one side are
nearer to one another than to the other side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError

Floats = NDArray[np.float64]

#: fewest and most points of a level, most levels
LEAST, MOST, LEVELS = 12, 2000, 100
#: levels are as thick as this share of the least distance of two at most
THICK = 0.1
#: points whose heights differ by this share of their size lie on one level
FLAT = 1e-3
#: points that are nearer than this share of the size of a level are one
SAME = 1e-7
#: points of a ring that are compared with those of another
PLACES = 64


def levels_of_cloud(points: Floats) -> tuple[Floats, ...] | None:
    """Return the closed sections of a cloud in the order of their levels; None where its points lie on no levels.

    Parameters
    ----------
    points : (n, 3) float, in any order, the axis of rotation is z

    Returns
    -------
    Sections (m, 3) float, from the lowest level to the highest, each in order round its profile, in the same sense, and
    from the same one of its two most distant points; a point that is repeated is there once. O(m^2) for each level and
    pass.

    Raises
    ------
    InputError
        A level has more than :data:`MOST` points.
    """
    heights = (*points.T, np.hypot(points[:, 0], points[:, 1]))
    if min(float(np.ptp(h)) for h in heights) <= FLAT * float(np.ptp(points, axis=0).max()):
        return None  # all on one level
    found = [split for split in map(_split, heights) if split is not None]
    if not found:
        return None
    _, parts = min(found, key=lambda split: split[0])
    if (most := max(map(len, parts))) > MOST:
        raise InputError(f"points: {most} on one level: must be at most {MOST}: leave out some")
    rings: list[Floats] = []
    for part in parts:
        ring = _ring(points[np.sort(part)])
        rings.append(_alike(ring, rings[-1] if rings else ring))
    return tuple(rings)


def _split(height: Floats) -> tuple[float, list[NDArray[np.intp]]] | None:
    """Return the thickness of the levels over their least distance, and their points; None where there are none."""
    order = np.argsort(height, kind="stable")
    apart = np.diff(height[order])
    widest = np.argsort(-apart, kind="stable")[: min(len(height) // LEAST, LEVELS) - 1]
    best: tuple[float, list[NDArray[np.intp]]] | None = None
    for count in range(1, len(widest) + 1):
        cuts = np.sort(widest[:count]) + 1
        parts = np.split(order, cuts)
        least = float(apart[widest[count - 1]])
        thick = max(float(np.ptp(height[part])) for part in parts)
        if min(map(len, parts)) >= LEAST and thick <= THICK * least and (best is None or thick / least < best[0]):
            best = thick / least, parts
    return best


def _ring(p: Floats) -> Floats:
    """Return points (n, 3) in order round their shortest closed polyline, or as they are where that is as short."""
    p = _distinct(p)
    far = np.linalg.norm(p[:, None] - p[None], axis=2)
    order = _shorten(_nearest_neighbours(far), far)
    n = np.arange(len(p))
    return p if _length(n, far) <= _length(order, far) * (1.0 + 1e-9) else p[order]


def _alike(ring: Floats, before: Floats) -> Floats:
    """Return a ring from one of its two most distant points, in the sense in which it is most like another."""
    far = np.linalg.norm(ring[:, None] - ring[None], axis=2)
    ends = np.unravel_index(int(far.argmax()), far.shape)
    rings = [np.roll(ring, -int(k), axis=0) for k in ends]
    rings += [np.roll(one[::-1], 1, axis=0) for one in rings]
    wanted = _resample(before)
    return min(rings, key=lambda one: float(((_resample(one) - wanted) ** 2).sum()))


def _resample(ring: Floats) -> Floats:
    """Return :data:`PLACES` points at equal lengths round a ring, about their centre."""
    closed = np.concatenate([ring, ring[:1]])
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    places = np.linspace(0.0, at[-1], PLACES, endpoint=False)
    out = np.stack([np.interp(places, at, x) for x in closed.T], axis=-1)
    return np.asarray(out - out.mean(axis=0))


def _distinct(p: Floats) -> Floats:
    """Return points without those that repeat an earlier one."""
    size = float(np.ptp(p, axis=0).max())
    _, first = np.unique(np.round(p / (SAME * size)), axis=0, return_index=True)
    return p[np.sort(first)]


def _nearest_neighbours(far: Floats) -> NDArray[np.intp]:
    """Return an order (n,) that goes to the nearest point that is left."""
    left = np.ones(len(far), dtype=np.bool_)
    order = np.zeros(len(far), dtype=np.intp)
    left[0] = False
    for k in range(1, len(far)):
        order[k] = np.where(left, far[order[k - 1]], np.inf).argmin()
        left[order[k]] = False
    return order


def _shorten(order: NDArray[np.intp], far: Floats) -> NDArray[np.intp]:
    """Return an order that neither turning a part of it round nor moving a point makes shorter."""
    while True:
        before = _length(order, far)
        order = _move_points(_turn_parts(order, far), far)
        if _length(order, far) >= before * (1.0 - 1e-12):
            return order


def _turn_parts(order: NDArray[np.intp], far: Floats) -> NDArray[np.intp]:
    """Return an order after one pass of turning parts round (2-opt)."""
    order = order.copy()
    for i in range(len(order) - 2):
        a, b = order[i], order[i + 1]
        c = order[i + 2 :]
        d = np.roll(order, -1)[i + 2 :]
        gain = far[a, b] + far[c, d] - far[a, c] - far[b, d]
        k = int(gain.argmax())
        if gain[k] > 1e-12 * far[a, b]:
            order[i + 1 : i + 3 + k] = order[i + 1 : i + 3 + k][::-1]
    return order


def _move_points(order: NDArray[np.intp], far: Floats) -> NDArray[np.intp]:
    """Return an order after each point was moved to where it makes the ring shortest (or-opt)."""
    for point in order.copy():
        k = int(np.flatnonzero(order == point)[0])
        before, after = order[k - 1], order[(k + 1) % len(order)]
        rest = np.delete(order, k)
        following = np.roll(rest, -1)
        more = far[rest, point] + far[point, following] - far[rest, following]
        place = int(more.argmin())
        saved = far[before, point] + far[point, after] - far[before, after]
        if more[place] < saved * (1.0 - 1e-12):
            order = np.insert(rest, place + 1, point)
    return order


def _length(order: NDArray[np.intp], far: Floats) -> float:
    return float(far[order, np.roll(order, -1)].sum())
