"""Exact engagement of a cutter circle with stock that lines and arcs bound.

Notation: O cutter centre, T unit feed direction, R cutter radius, a engagement angle [rad]: the part of the front half
of the rim (u . T > 0) that lies in material. Immersion phi [rad] is counted from n = Rot(+90 deg) T clockwise:
a wall on the right (down milling) is cut from pi - a to pi, one on the left (up milling) from 0 to a.

Reference: [Uddin2007]; closed forms of circle against line and circle, no sampling.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import LateModule

_contact = LateModule("chipload.engagement._contact")

Floats = NDArray[np.float64]

#: engaged pieces of the rim that are kept with their ends; ``angle`` always counts all of them
PIECES = 4


@dataclass(frozen=True, eq=False)
class StockBoundary:
    """Boundary of the stock: segments (n, 7) of lines and arcs with the MATERIAL ON THE LEFT of each.

    Closed contours, or open chains so long that the cutter never reaches past their ends.
    """

    segments: Floats

    def __post_init__(self) -> None:
        seg = np.ascontiguousarray(self.segments, dtype=np.float64)
        if seg.ndim != 2 or seg.shape[1] != 7 or not np.isfinite(seg).all():
            raise InputError(f"stock boundary: segments of shape {seg.shape}: need (n, 7) finite numbers")
        seg.setflags(write=False)
        object.__setattr__(self, "segments", seg)


@dataclass(frozen=True, eq=False)
class Engagement:
    """Engagement of the rim, a row for each query.

    ``angle`` (m,) [rad] sum of the engaged pieces; ``count`` (m,) their number, -1 where the boundary is broken there
    (its crossings do not alternate); ``phi`` (m, PIECES, 2) [rad] their ends in immersion, 0 where there is none.
    """

    angle: Floats
    count: NDArray[np.int64]
    phi: Floats


def engagement(
    stock: StockBoundary, centres: ArrayLike, headings: ArrayLike, radius: float, workers: int = 1
) -> Engagement:
    """Return the exact engaged arcs of the rim for every centre and heading.

    Parameters
    ----------
    stock : boundary with n segments
    centres : (m, 2) float [mm]
    headings : (m, 2) float, unit vectors
    radius : R > 0 [mm]
    workers : threads; the answer does not depend on it

    Notes
    -----
    Segments near the last centre are kept while the path stays within R / 4 of it: for queries along a path of length
    P the cost is O(m + n P / R).

    Examples
    --------
    A straight wall, s = 0.1 deep, R = 5: cos a = 1 - s/R.

    >>> wall = StockBoundary([[50.0, 0.1, -50.0, 0.1, 0.0, 0.0, 0.0]])
    >>> float(round(np.degrees(engagement(wall, [[0.0, 5.0]], [[1.0, 0.0]], 5.0).angle[0]), 3))
    11.478
    """
    o = np.ascontiguousarray(centres, dtype=np.float64).reshape(-1, 2)
    t = np.ascontiguousarray(headings, dtype=np.float64).reshape(-1, 2)
    if len(o) != len(t):
        raise InputError(f"engagement: {len(o)} centres but {len(t)} headings: need one each")
    if not radius > 0.0:
        raise InputError(f"engagement: radius = {radius:g} mm: must be above 0")
    m = len(o)
    seg = stock.segments
    box = np.empty((len(seg), 4))
    _contact.boxes(seg, box)
    angle = np.zeros(m)
    count = np.zeros(m, dtype=np.int64)
    phi = np.zeros((m, PIECES, 2))
    cut = np.linspace(0, m, max(workers, 1) + 1).astype(int)
    with ThreadPoolExecutor(max(workers, 1)) as pool:
        list(
            pool.map(
                lambda k: _contact.engage(o, t, radius, seg, box, cut[k], cut[k + 1], angle, count, phi),
                range(len(cut) - 1),
            )
        )
    return Engagement(angle, count, phi)
