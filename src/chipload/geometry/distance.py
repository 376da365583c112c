"""Exact distance of points to lines and circular arcs.

Notation: a segment is a row ``[x0, y0, x1, y1, xc, yc, sweep]`` as in ``contour.py``. The distance to a line is that to
the nearest point between its ends. The distance to an arc is ``| |p - c| - r |`` if p lies in its sector, otherwise
that to its nearer end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from chipload.geometry.contour import Floats
from chipload.lazy import LateModule

_segments = LateModule("chipload.geometry._segments")


def distance(segments: ArrayLike, points: ArrayLike) -> Floats:
    """Distance of each point from the nearest segment.

    Parameters
    ----------
    segments : (n, 7) float [mm, rad]
    points : (m, 2) float [mm]

    Returns
    -------
    (m,) float [mm]; ``inf`` if there are no segments.

    Examples
    --------
    >>> distance([[0, 0, 10, 0, 0, 0, 0]], [[3, 4], [13, 4]])
    array([4., 5.])
    """
    seg = np.ascontiguousarray(segments, dtype=np.float64).reshape(-1, 7)
    p = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
    out = np.empty(len(p))
    _segments.distance(seg, boxes(seg), p, out)
    return out


def boxes(segments: Floats) -> Floats:
    """Bounding boxes (n, 4) ``[xmin, ymin, xmax, ymax]`` [mm] of segments (n, 7), including the bulge of arcs."""
    x0, y0, x1, y1, xc, yc, sweep = segments.T
    out = np.column_stack([np.minimum(x0, x1), np.minimum(y0, y1), np.maximum(x0, x1), np.maximum(y0, y1)])
    arc = sweep != 0.0
    r = np.hypot(x0 - xc, y0 - yc)
    a0 = np.arctan2(y0 - yc, x0 - xc)
    for k, (axis, side) in enumerate([(0, 1), (1, 1), (0, -1), (1, -1)]):
        quarter = k * np.pi / 2
        along = np.where(sweep > 0.0, quarter - a0, a0 - quarter) % (2.0 * np.pi)
        hit = arc & (along <= np.abs(sweep))
        extreme = (xc, yc)[axis] + side * r
        column = axis if side < 0 else axis + 2
        pick = np.minimum if side < 0 else np.maximum
        out[:, column] = np.where(hit, pick(out[:, column], extreme), out[:, column])
    return out
