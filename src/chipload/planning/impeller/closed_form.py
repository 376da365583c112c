"""Largest cutter that one check point admits, in closed form.

Notation: S contact point, N its outward normal, T cutter axis, n = N.T, V = (N - n T) / sqrt(1 - n^2); R cutter radius,
r corner radius, rho = R - r; c check point, y = c - S - r N, h = y.T its height above the centres of the corner,
y_V = y.V. The cutter's axis passes S + r N + rho V. B pallet angle, alpha table angle,
T(B) = (sin alpha cos B, sin alpha sin B, cos alpha).

The check point is clear up to rho = (|y|^2 - h^2 - r^2) / (2 (r + y_V)) at h >= 0 (flank), rho = (|y|^2 - r^2) /
(2 (y_V + sqrt(r^2 - h^2))) at -r <= h < 0 (corner); below h = -r, or where the denominator is not above 0, up to any.

Reference: [Wu2019]. Differs from source: the source tests each diameter; here every radius of a corner radius at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def axis_at(table: float, pallet: ArrayLike) -> Floats:
    """T(B) (..., 3) at the table angle [rad] and the pallet angles (...,) [rad].

    >>> axis_at(0.5 * np.pi, 0.0).round(12).tolist()
    [1.0, 0.0, 0.0]
    """
    B = np.asarray(pallet, dtype=np.float64)
    s = np.sin(table)
    return np.stack([s * np.cos(B), s * np.sin(B), np.full(B.shape, np.cos(table))], axis=-1)


def rho_limits(check: ArrayLike, contact: ArrayLike, normal: ArrayLike, axis: ArrayLike, corner: float) -> Floats:
    """Largest rho of each check point.

    Parameters
    ----------
    check : (m, 3) float [mm]
    contact, normal, axis : S, N, T (3,), 0 <= N.T < 1
    corner : r [mm], >= 0

    Returns
    -------
    (m,) float [mm]; inf: any. Below 0: not even a ball of that corner radius fits.

    Examples
    --------
    A slot of width 24: the far wall at the same height admits R = 12.

    >>> rho_limits([[24.0, 0.0, 5.0]], [0, 0, 0], [1, 0, 0], [0, 0, 1], 2.0)
    array([10.])
    """
    S, N, T = (np.asarray(x, dtype=np.float64) for x in (contact, normal, axis))
    n = N @ T
    V = (N - n * T) / np.sqrt(1.0 - n * n)
    y = np.asarray(check, dtype=np.float64) - S - corner * N
    h, yV, yy = y @ T, y @ V, (y * y).sum(axis=-1)
    low = h < 0.0
    w = np.sqrt(np.clip(corner**2 - h * h, 0.0, None))
    top = yy - corner**2 - np.where(low, 0.0, h * h)
    den = 2.0 * (yV + np.where(low, w, corner))
    bound = (h >= -corner) & (den > 0.0)
    return np.where(bound, top / np.where(bound, den, 1.0), np.inf)


def contact_limit(normal: ArrayLike, axis: ArrayLike, corner: float, curvature: ArrayLike) -> float:
    """Largest rho [mm] that the surface's curvature at the contact admits.

    The corner touches with the principal curvatures 1/r, in the plane of N and T, and 1/(r + rho/s), s^2 = 1 - n^2; it
    stays outside as long as the difference of the curvatures is not negative in any direction.

    Parameters
    ----------
    curvature : (3, 3) float [1/mm], tensor of the surface in space, above 0 where it bends towards N

    Examples
    --------
    Inside of a cylinder of 20 mm radius, parallel to its axis: R = 20.

    >>> contact_limit([1, 0, 0], [0, 0, 1], 2.0, np.diag([0.0, 0.05, 0.0]))
    18.0
    """
    N, T, K = (np.asarray(x, dtype=np.float64) for x in (normal, axis, curvature))
    n = float(N @ T)
    s = np.sqrt(1.0 - n * n)
    e1 = (T - n * N) / s
    e2 = np.cross(N, e1)
    k11, k12, k22 = e1 @ K @ e1, e1 @ K @ e2, e2 @ K @ e2
    if corner * k11 >= 1.0:
        return -np.inf
    least = k22 + (k12 * k12 * corner / (1.0 - corner * k11))
    return float(s * (1.0 / least - corner)) if least > 0.0 else np.inf
