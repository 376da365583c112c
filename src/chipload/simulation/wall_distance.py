"""Greatest gouge and excess of a centre path on the wall of the part.

Notation: R cutter radius; d the distance from the cutter's centre to the wall, negative on the side of the material.
The gouge is R - d along the path, the excess the distance from the wall to the path less R.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.geometry.contour import Contour
from chipload.lazy import LateModule
from chipload.simulation.centre_path import CentrePath, motion_rows

_centre_path = LateModule("chipload.simulation._centre_path")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: local maxima of the gouge that are sought exactly, the greatest first
REFINED = 64
#: steps of the golden section: the bracket shrinks by 0.618^40 = 4e-9
STEPS = 40


@dataclass(frozen=True)
class GreatestDistance:
    """A greatest value [mm], its place (x, y) [mm], and how many samples were taken."""

    value_mm: float
    at: tuple[float, float]
    samples: int


def gouge(centres: CentrePath, wall: Sequence[Contour], material: str, step_mm: float = 0.05) -> GreatestDistance:
    """Return the greatest depth R - d of the cutter in the part (0 if it does not enter), and the wall's point there.

    Parameters
    ----------
    centres : every motion that cuts
    wall : closed contours or open chains of the finished part; beyond the loose ends of a chain there is no part
    material : `left` or `right` of the wall's travel
    step_mm : spacing of the centres [mm]; distances are exact, and the greatest local maxima are then narrowed down
        between their neighbours. A maximum is missed only if it is narrower than the spacing: by less than half of it

    Raises
    ------
    InputError
        ``material`` is neither left nor right, or ``step_mm`` is not above 0.

    Examples
    --------
    >>> trail = CentrePath([[0.0, 4.995, 10.0, 4.995, 0.0, 0.0, 0.0]], 5.0)
    >>> worst = gouge(trail, [Contour.polyline([[-20.0, 0.0], [20.0, 0.0]])], "right")
    >>> round(worst.value_mm, 9), worst.at[1]
    (0.005, 0.0)
    """
    if not step_mm > 0.0:
        raise InputError(f"gouge: step_mm = {step_mm:g}: must be above 0")
    rows, loose, side = _wall(wall, material)
    k, w = _stations(centres, step_mm)

    def depth(k: Ints, w: Floats) -> Floats:
        out = np.empty(len(k))
        _centre_path.signed_distance(centres.places(k, w)[0], rows, loose, side, out)
        return centres.radius - out

    g = depth(k, w)
    high = np.flatnonzero((g >= np.r_[-np.inf, g[:-1]]) & (g >= np.r_[g[1:], -np.inf]) & (g > -step_mm))
    high = high[np.argsort(-g[high], kind="stable")[:REFINED]]
    best_k, best_w, best_g = k[int(g.argmax())], float(w[int(g.argmax())]), float(g.max())
    if len(high):
        same = np.r_[False, k[1:] == k[:-1]]
        lo = np.where(same[high], w[high - 1], w[high])
        hi = np.where(np.r_[same[1:], False][high], w[np.minimum(high + 1, len(w) - 1)], w[high])
        ratio = 0.5 * (math.sqrt(5.0) - 1.0)
        for _ in range(STEPS):
            a, b = hi - ratio * (hi - lo), lo + ratio * (hi - lo)
            up = depth(k[high], a) < depth(k[high], b)
            lo, hi = np.where(up, a, lo), np.where(up, hi, b)
        middle = 0.5 * (lo + hi)
        found = depth(k[high], middle)
        j = int(found.argmax())
        if found[j] > best_g:
            best_k, best_w, best_g = k[high][j], float(middle[j]), float(found[j])
    o = centres.places([best_k], [best_w])[0][0]
    near = min((*_centre_path.nearest(rows, i, 0.0, 1.0, o[0], o[1]), i) for i in range(len(rows)))
    x, y, _, _ = _centre_path.place(rows, near[2], near[1])
    return GreatestDistance(max(best_g, 0.0), (float(x), float(y)), len(k))


def excess(centres: CentrePath, wall: Sequence[Contour], step_mm: float = 0.05) -> GreatestDistance:
    """Return the greatest excess on the wall, max(0, distance from the wall's point to the path - R), and that point.

    The wall is sampled at most every ``step_mm`` [mm] and at its joints; each distance is exact.

    Examples
    --------
    >>> trail = CentrePath([[0.0, 5.002, 10.0, 5.002, 0.0, 0.0, 0.0]], 5.0)
    >>> round(excess(trail, [Contour.polyline([[1.0, 0.0], [9.0, 0.0]])]).value_mm, 9)
    0.002
    """
    if not step_mm > 0.0:
        raise InputError(f"excess: step_mm = {step_mm:g}: must be above 0")
    points = np.vstack(
        [
            c.at(np.unique(np.concatenate([c.knots, np.linspace(0.0, c.length, int(c.length / step_mm) + 2)])))[0]
            for c in wall
        ]
    )
    left = np.maximum(centres.distance(points) - centres.radius, 0.0)
    k = int(left.argmax())
    return GreatestDistance(float(left[k]), (float(points[k, 0]), float(points[k, 1])), len(points))


def _wall(wall: Sequence[Contour], material: str) -> tuple[Floats, Ints, float]:
    """The wall's segments for the kernels, the loose ends of its chains, and the side of the material."""
    if material not in ("left", "right"):
        raise InputError(f"wall: material = {material!r}: must be left or right of the wall's travel")
    loose = []
    for c in wall:
        ends = np.zeros(len(c.segments), dtype=np.int64)
        if not c.closed:
            ends[0] |= 1
            ends[-1] |= 2
        loose.append(ends)
    rows = motion_rows(np.vstack([c.segments for c in wall]))
    return rows, np.concatenate(loose), 1.0 if material == "left" else -1.0


def _stations(centres: CentrePath, step: float) -> tuple[Ints, Floats]:
    """Moments of all motions that cut, both ends among them, no more than ``step`` apart."""
    k = np.flatnonzero(np.asarray(centres.active))
    n = np.maximum(np.ceil(centres.lengths[k] / step).astype(np.int64), 1)
    owner = np.repeat(np.arange(len(k)), n + 1)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(n + 1) - (n + 1), n + 1)
    return k[owner], within / n[owner]
