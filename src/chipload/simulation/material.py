"""The initial stock in the plane, before the first motion: its region and its boundary in strips.

Notation: a boundary is a set of contours with the MATERIAL ON THE LEFT of travel.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.contour import JOIN_MM, Contour, Region

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def strips(stock: Region | None, low: float, high: float) -> tuple[float, float, int, Ints, Ints, Floats]:
    """Return the boundary of ``stock`` in pieces monotone in y, by strips of y between ``low`` and ``high`` [mm].

    The form is that of ``rows`` in :mod:`chipload.simulation._centre_path`. Ends of neighbours are made one, so that no
    ray slips between them.
    """
    if stock is None:
        return low, 1.0, 0, np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros((0, 8))
    pieces = [row for c in stock.contours for row in _monotone(c)]
    piece = np.array(pieces).reshape(-1, 8)
    n = int(min(4096, max(1, 4 * len(piece))))
    dy = (high - low) / n
    j0 = np.clip(np.floor((piece[:, 0] - low) / dy), 0, n - 1).astype(np.int64)
    j1 = np.clip(np.floor((piece[:, 1] - low) / dy), 0, n - 1).astype(np.int64)
    owner = np.repeat(np.arange(len(piece)), j1 - j0 + 1)
    strip = np.concatenate([np.arange(a, b + 1) for a, b in zip(j0, j1, strict=True)]) if len(piece) else owner
    order = np.argsort(strip, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(strip, minlength=n))]).astype(np.int64)
    return low, dy, n, start, owner[order].astype(np.int64), piece


def _monotone(contour: Contour) -> list[list[float]]:
    """Rows ``[ylo, yhi, up, arc, xa, ya, xb, yb]``; of an arc ``xa, ya`` is the centre, ``xb`` the radius, ``yb`` the
    half (+1 right, -1 left).
    """
    out: list[list[float]] = []
    seg = contour.segments
    ends = np.roll(seg[:, 0:2], -1, axis=0)
    if np.hypot(*(ends - seg[:, 2:4]).T).max() > 2.0 * JOIN_MM:
        raise InputError("stock boundary: a contour is open: close it")
    for (x0, y0, _, _, xc, yc, sweep), (x1, y1), rho in zip(seg.tolist(), ends.tolist(), contour.radii, strict=True):
        if sweep == 0.0:
            if y0 < y1:
                out.append([y0, y1, 1.0, 0.0, x0, y0, x1, y1])
            elif y1 < y0:
                out.append([y1, y0, -1.0, 0.0, x1, y1, x0, y0])
            continue
        a0 = math.atan2(y0 - yc, x0 - xc)
        lo, hi = min(a0, a0 + sweep), max(a0, a0 + sweep)
        poles = np.arange(math.ceil(lo / math.pi - 0.5), math.floor(hi / math.pi - 0.5) + 1) * math.pi + 0.5 * math.pi
        cut = [lo, *(float(a) for a in poles if lo < a < hi), hi]
        y = [yc + rho * math.sin(a) for a in cut]
        y[0], y[-1] = (y0, y1) if sweep > 0.0 else (y1, y0)
        for k in range(len(cut) - 1):
            half = 1.0 if math.cos(0.5 * (cut[k] + cut[k + 1])) > 0.0 else -1.0
            if y[k] != y[k + 1]:
                up = 1.0 if (y[k + 1] > y[k]) == (sweep > 0.0) else -1.0
                out.append([min(y[k], y[k + 1]), max(y[k], y[k + 1]), up, 1.0, xc, yc, float(rho), half])
    return out
