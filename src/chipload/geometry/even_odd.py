"""Conversion of contours that cross, touch or overlap into separate contours that bound the same area (even-odd rule).

Notation: a **piece** runs along a contour from one intersection of contours to the next. It bounds the area if the
winding number is odd on one of its sides and even on the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.contour import Contour, Floats, Region, winding_number
from chipload.geometry.split import (
    LADDER,
    RawSegments,
    SplitSegments,
    chained_segments,
    left_of,
    meetings,
    rows_of,
    split_segments,
)

#: distance from a piece at which its sides are tested: share of its length, and upper bound [mm]
_PROBE, _PROBE_MM = 1e-3, 1e-6


def even_odd(contours: Sequence[Contour]) -> tuple[tuple[Contour, ...], Floats]:
    """Contours of the area that has an odd winding number, and the places where the given contours meet.

    Parameters
    ----------
    contours : closed contours; each may cross, touch or retrace itself and others

    Returns
    -------
    The contours, and places (k, 2) [mm]. Contours that do not meet are returned unchanged, with k = 0. Otherwise
    the inside is on the left of each contour, and contours do not cross but may share single points.

    Raises
    ------
    InputError
        A contour is open, or the pieces that bound the area do not close.

    Examples
    --------
    >>> square = [[0, 0], [4, 0], [4, 4], [0, 4]]
    >>> two = [Contour.polyline(np.add(square, at), closed=True) for at in ((0, 0), (2, 2))]
    >>> made, where = even_odd(two)
    >>> sum(c.area for c in made), where.tolist()
    (24.0, [[2.0, 4.0], [4.0, 2.0]])
    """
    given = Region(tuple(contours)).contours
    if not given:
        return given, np.zeros((0, 2))
    raw = _raw(given)
    places = np.zeros((0, 2))
    for tol, snap in LADDER:
        found = np.unique(np.round(meetings(raw, tol)[1], 6), axis=0)
        if not len(found):
            return given, found
        places = found
        pieces, _ = split_segments(raw, tol, snap)
        bounding, rows = _bounding_segments(given, raw, pieces)
        made = chained_segments(RawSegments.plain(rows), bounding, 1.0, tol)
        if made and all(c.closed for c in made):
            return made, places
    x, y = places[0]
    raise InputError(f"part: contours cross at ({x:.6g}, {y:.6g}) and enclose no definite area: draw only one of them")


def _raw(contours: Sequence[Contour]) -> RawSegments:
    """The segments of closed contours; each segment refers to the next one of its contour."""
    rows = np.vstack([c.segments for c in contours])
    follow, first = [], 0
    for c in contours:
        n = len(c.segments)
        follow.append(first + np.roll(np.arange(n), -1))
        first += n
    return RawSegments.plain(rows, np.concatenate(follow))


def _bounding_segments(
    contours: Sequence[Contour], raw: RawSegments, pieces: SplitSegments
) -> tuple[SplitSegments, Floats]:
    """The pieces that bound the area, each once and with the area on its left, and their segments (m, 7)."""
    rows = rows_of(raw, pieces)
    middle, normal = _middles(rows)
    length = np.hypot(*(rows[:, 2:4] - rows[:, 0:2]).T)
    step = np.minimum(np.where(length > 0.0, _PROBE * length, _PROBE_MM), _PROBE_MM)[:, None] * normal
    left, right = _odd(contours, middle + step), _odd(contours, middle - step)
    pick = np.flatnonzero((left != right) & _is_first(pieces, middle))
    rows, node, back = rows[pick], pieces.node[pick], right[pick]
    rows[back] = np.column_stack([rows[:, 2:4], rows[:, 0:2], rows[:, 4:6], -rows[:, 6]])[back]
    node = np.where(back[:, None], node[:, ::-1], node)
    span = np.tile([0.0, 1.0], (len(pick), 1))
    return SplitSegments(np.arange(len(pick)), span, node, pieces.place), rows


def _is_first(pieces: SplitSegments, middle: Floats) -> NDArray[np.bool_]:
    """(m,) whether each piece is the first of those with the same end nodes and the same middle."""
    ends = np.sort(pieces.node, axis=1)
    key = np.column_stack([ends, np.round(middle, 6)])
    out = np.zeros(len(key), dtype=np.bool_)
    out[np.unique(key, axis=0, return_index=True)[1]] = True
    return out


def _middles(rows: Floats) -> tuple[Floats, Floats]:
    """(m, 2) midpoints of segments, and the unit normals (m, 2) to their left."""
    arc = rows[:, 6:7] != 0.0
    v = rows[:, 0:2] - rows[:, 4:6]
    c, s = np.cos(0.5 * rows[:, 6:7]), np.sin(0.5 * rows[:, 6:7])
    out = c * v + s * left_of(v)
    middle = np.where(arc, rows[:, 4:6] + out, 0.5 * (rows[:, 0:2] + rows[:, 2:4]))
    along = rows[:, 2:4] - rows[:, 0:2]
    normal = np.where(arc, -np.sign(rows[:, 6:7]) * out, left_of(along))
    return middle, normal / np.hypot(*normal.T)[:, None]


def _odd(contours: Sequence[Contour], points: Floats) -> NDArray[np.bool_]:
    """(m,) whether the winding number about each point is odd."""
    total = np.zeros(len(points), dtype=np.int64)
    for c in contours:
        total += winding_number(c, points)
    out: NDArray[np.bool_] = total % 2 == 1
    return out
