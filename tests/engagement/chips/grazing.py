"""Where the edge of a section moves neither outward nor inward: the points that bound what a move covers.

Notation: cylinder of radius R, tip C, unit axis A = (a, A_z), layer z = h; E = C_xy + a (h - C_z) / A_z centre of the
ellipse, x = E + R M c, c = (cos theta, sin theta), M = I + a a' / (A_z (1 + A_z)). F = v' (I - a a') v - R^2, v =
x - E, is below 0 inside; F_t < 0 on the advancing edge, > 0 on the leaving one, and

    F_t = -2 R (g . c) - 2 R^2 (M a_t . c)(M a . c),   g = (I - a a' / (1 + A_z)) E_t,

with z = e^(i theta) a quartic in z of which the roots of modulus 1 count: two or four grazing points.

A general cutter has the speed V of its surface in place of -F_t; it is sampled around the section, the signs of both
pieces compared at corners, and each change refined to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.cutter.cutter import Cutter
from chipload.engagement.chips._grazing_points import MAX_ROOTS, NODES, roots
from chipload.engagement.chips._section import instant
from chipload.engagement.chips.move import Move
from chipload.engagement.chips.section import cutter_numbers
from chipload.errors import InputError

Floats = NDArray[np.float64]


def ellipse_grazing(
    radius: float,
    height: float,
    tip: ArrayLike,
    axis: ArrayLike,
    tip_rate: ArrayLike,
    axis_rate: ArrayLike,
    circle: float,
) -> tuple[Floats, NDArray[np.int64]]:
    """Grazing points of a cylinder by the quartic.

    Parameters
    ----------
    radius : R [mm], height : h [mm]
    tip, axis : (3,) C [mm] and A at the instant
    tip_rate, axis_rate : (3,) C' [mm] and A'
    circle : how far from 1 the modulus of a root may be

    Returns
    -------
    theta : (n,) float [rad], rising from 0; sign : (n,) int, +1 where the edge behind (theta below) moves inward

    Examples
    --------
    A vertical cutter along x grazes at its sides.

    >>> theta, _ = ellipse_grazing(5.0, 1.0, [0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 0, 0], 1e-6)
    >>> np.degrees(theta).round(9).tolist()
    [90.0, 270.0]
    """
    g, Ma, Mda = _terms(height, tip, axis, tip_rate, axis_rate)
    S = 0.5 * radius * (np.outer(Mda, Ma) + np.outer(Ma, Mda))
    k2, k1, k0 = 0.5 * (S[0, 0] - S[1, 1]) - 1j * S[0, 1], g[0] - 1j * g[1], 0.5 * (S[0, 0] + S[1, 1])
    z = np.roots([0.5 * k2, 0.5 * k1, k0, 0.5 * np.conj(k1), 0.5 * np.conj(k2)])
    theta = np.sort(np.angle(z[np.abs(np.abs(z) - 1.0) <= circle]) % (2.0 * np.pi))
    c, s = np.cos(theta), np.sin(theta)
    rising = -g[0] * s + g[1] * c - (S[0, 0] - S[1, 1]) * 2.0 * c * s + 2.0 * S[0, 1] * (c * c - s * s)
    return theta, np.sign(rising).astype(np.int64)


def _terms(h: float, tip: ArrayLike, axis: ArrayLike, tip_rate: ArrayLike, axis_rate: ArrayLike) -> tuple[Floats, ...]:
    C, A, dC, dA = (np.asarray(v, dtype=np.float64) for v in (tip, axis, tip_rate, axis_rate))
    a, Az, da, dAz = A[:2], A[2], dA[:2], dA[2]
    lam = (h - C[2]) / Az
    dE = dC[:2] + (-dC[2] / Az - lam * dAz / Az) * a + lam * da
    M = np.eye(2) + np.outer(a, a) / (Az * (1.0 + Az))
    return dE - a * (a @ dE) / (1.0 + Az), M @ a, M @ da


@dataclass(frozen=True, eq=False)
class Grazing:
    """Grazing points of a section: ``theta`` (n,) [rad], ``points`` (n, 2) [mm], ``sign`` (n,) +1 from inward to
    outward with theta rising, ``piece`` (n,) as of :class:`~chipload.engagement.chips.section.Section`, 5 a corner;
    ``around``: the sign of V where there is none, 0 where all stands still.
    """

    theta: Floats
    points: Floats
    sign: NDArray[np.int64]
    piece: NDArray[np.int64]
    around: int


def grazing(move: Move, cutter: Cutter, height: float, t: float, still: float) -> Grazing | None:
    """Grazing points of any cutter at t; speeds below ``still`` [mm per unit of t] count as none. None: not cut.

    >>> mill = Cutter(10.0, 4, 0.5, 20.0, 30.0, 6e5)
    >>> move = Move.lerp([0, 0, 0], [0, 0, 1], [20, 0, 0], [0, 0, 1])
    >>> grazing(move, mill, 1.0, 0.5, 1e-9).points.round(9).tolist()
    [[10.0, 5.0], [10.0, -5.0]]
    """
    S, C, grid = np.empty(27), np.empty((8, 5)), np.empty(NODES)
    rows, sign = np.empty((MAX_ROOTS, 7)), np.empty(MAX_ROOTS, np.int64)
    if not instant(move.tip, move.axis, cutter_numbers(cutter), float(height), float(t), S, C):
        return None
    n, around = roots(S, cutter_numbers(cutter), C, float(still), rows, sign, grid)
    if n < 0:
        raise InputError(f"grazing: t = {t:g}: more than {MAX_ROOTS} points: still = {still:g} is below rounding")
    order = np.argsort(rows[:n, 2])
    rows, sign = rows[:n][order], sign[:n][order]
    return Grazing(rows[:, 2], rows[:, :2], sign, rows[:, 6].astype(np.int64), around if n == 0 else 0)
