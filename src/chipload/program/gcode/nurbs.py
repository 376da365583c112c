"""Splines of G5, G5.1, G5.2 and G6.2 as points on the curve.

Notation: control points p_i [mm] with weights w_i, i = 0 to n; order L, degree L - 1; n + L + 1 knots, those of G6.2
as stated, else uniform and clamped: L zeros, 1, 2, ... , L times n - L + 2. The curve is

    c(u) = sum N_i(u) w_i p_i / sum N_i(u) w_i

Points are such that the curve leaves the chord between neighbours by at most the tolerance, measured at a quarter, half
and three quarters of each.

Reference: [Piegl1997] chapters 3 and 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chipload.errors import InputError
from chipload.lazy import scipy

Floats = NDArray[np.float64]

#: the curve leaves the chords by at most this [mm]
CHORD_TOLERANCE = 1e-3
#: largest order, most control points, most points on one curve
HIGHEST_ORDER = 20
MOST_CONTROL_POINTS = 10_000
MOST_POINTS = 200_000


def spline_points(
    points: Floats, weights: Floats, order: int, tolerance: float = CHORD_TOLERANCE, knots: Floats | None = None
) -> Floats:
    """(m, d) points on a spline after its first.

    Parameters
    ----------
    points : (n + 1, d) float [mm], control points; a clamped curve starts at the first and ends at the last
    weights : (n + 1,) float > 0
    order : L above, 2 to n + 1
    tolerance : the curve leaves the chords by at most this [mm]
    knots : (n + 1 + L,) float, none below the one before; None: uniform and clamped

    Raises
    ------
    InputError
        The order, or the number or sequence of the knots, is wrong; the curve has too many chords.
    """
    n = len(points) - 1
    if not 2 <= order <= min(n + 1, HIGHEST_ORDER):
        raise InputError(
            f"G5.2: L{order}: the order of a spline with {n + 1} control points must be from 2 to "
            f"{min(n + 1, HIGHEST_ORDER)}"
        )
    if knots is None:
        inner = n - order + 2
        knots = np.concatenate([np.zeros(order), np.arange(1.0, inner), np.full(order, float(inner))])
    if len(knots) != n + 1 + order or (np.diff(knots) < 0.0).any() or knots[order - 1] == knots[n + 1]:
        raise InputError(
            f"{len(knots)} knots: must be {n + 1 + order}, {n + 1} control points and the order {order}, each at least "
            "the one before"
        )
    first, last = float(knots[order - 1]), float(knots[n + 1])
    curve = scipy.interpolate.BSpline(knots, np.column_stack([points * weights[:, None], weights]), order - 1)

    def curve_point(u: Floats) -> Floats:
        h = curve(np.clip(u, first, last))
        return np.asarray(h[:, :-1] / h[:, -1:])

    u = np.unique(knots[order - 1 : n + 2])
    # a smooth piece between knots may be S-shaped: never judge it by its middle alone
    u = np.interp(np.arange(4 * (len(u) - 1) + 1) / 4.0, np.arange(float(len(u))), u)
    while True:
        ends = curve_point(u)
        a, b = ends[:-1], ends[1:]
        step = np.diff(u)
        away = np.zeros(len(step))
        for part in (0.25, 0.5, 0.75):
            p = curve_point(u[:-1] + part * step)
            d, e = b - a, p - a
            size = np.einsum("ij,ij->i", d, d)
            t = np.clip(np.einsum("ij,ij->i", e, d) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
            away = np.maximum(away, np.linalg.norm(e - t[:, None] * d, axis=1))
        coarse = np.flatnonzero((away > tolerance) & (step > 1e-12 * (last - first)))
        if len(coarse) == 0:
            break
        if len(u) + len(coarse) > MOST_POINTS:
            raise InputError(f"spline of more than {MOST_POINTS} chords of {tolerance:g} mm tolerance: split it")
        u = np.sort(np.concatenate([u, u[coarse] + 0.5 * step[coarse]]))
    if (knots[n + 1 :] == last).all():
        ends[-1] = points[-1]
    return ends[1:]


def cubic(start: tuple[float, float], i: float, j: float, p: float, q: float, end: tuple[float, float]) -> Floats:
    """(4, 2) control points of G5: (i, j) from the start, (p, q) from the end."""
    return np.array([start, (start[0] + i, start[1] + j), (end[0] + p, end[1] + q), end])


def quadratic(start: tuple[float, float], i: float, j: float, end: tuple[float, float]) -> Floats:
    """(3, 2) control points of G5.1: (i, j) from the start."""
    return np.array([start, (start[0] + i, start[1] + j), end])
