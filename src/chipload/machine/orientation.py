"""Two successive rotations that bring one direction onto another.

Notation: u, v unit directions of the first and second rotary axis (u nearer to the workpiece), w unit direction that
both rotate, a unit target direction: R(u, q1) R(v, q2) w = a. chi, phi, psi [rad] angles of a and u, w and v, u and v.
c = R(v, q2) w lies where two cones meet, at chi from u and at phi from v: u, v and c are the corners of a spherical
triangle with known sides, which determine its angle E at v:

    tan(E/2)^2 = sin(S - psi) sin(S - phi) / (sin S sin(S - chi)),  S = (chi + phi + psi) / 2

and c lies on either side of the plane of u and v: two solutions. The half-angle form stays accurate where chi is small,
next to the pole, where an arc cosine loses half of its digits. Without a triangle, `a` is out of reach by the greatest
of chi - (phi + psi), |phi - psi| - chi and chi - (2 pi - phi - psi), and the nearest direction is used.

References: [Paden1986] subproblem 2 for the problem; the half-angle formula is in any textbook of spherical
trigonometry.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def rotate_about(d: Floats, q: Floats, v: Floats) -> Floats:
    """Direction v turned right-handed by q about the unit d: v cos q + (d x v) sin q + d (d.v)(1 - cos q).

    Parameters
    ----------
    d, v : (..., 3) float
    q : (...,) float [rad]

    Examples
    --------
    >>> rotate_about(np.array([0.0, 0.0, 1.0]), np.array(np.pi / 2), np.array([1.0, 0.0, 0.0])).round(12).tolist()
    [0.0, 1.0, 0.0]
    """
    c, s = np.cos(q)[..., None], np.sin(q)[..., None]
    return np.asarray(v * c + np.cross(d, v) * s + d * ((v * d).sum(axis=-1)[..., None] * (1.0 - c)))


def angle_between(a: Floats, b: Floats) -> Floats:
    """Angle [rad] of (..., 3) directions, exact near 0 and pi.

    >>> float(angle_between(np.array([1.0, 0.0, 0.0]), np.array([1.0, 1e-12, 0.0])))
    1e-12
    """
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))


def azimuth(d: Floats, start: Floats, end: Floats) -> Floats:
    """Angle [rad] in [-pi, pi] that turns ``start`` about d into the half-plane of ``end``; all (..., 3)."""
    across = np.cross(d, start)
    along = start - (start * d).sum(axis=-1)[..., None] * d
    return np.asarray(np.arctan2((across * end).sum(axis=-1), (along * end).sum(axis=-1)))


def wrap_angles(q: Floats) -> Floats:
    """Angles [rad] without whole turns, in (-pi, pi]; unchanged if already in that range."""
    return np.asarray(q - 2.0 * np.pi * np.ceil((q - np.pi) / (2.0 * np.pi)))


def two_turns(u: Floats, v: Floats, w: Floats, a: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Both pairs (q1, q2) with R(u, q1) R(v, q2) w = a; O(n).

    Parameters
    ----------
    u, v, w : (3,) or (n, 3) float, unit; u and v not parallel, v and w not parallel
    a : (n, 3) float, unit

    Returns
    -------
    q1, q2 : (n, 2) float [rad], in (-pi, pi]; q1 is 0 where a lies along u and q1 is arbitrary.
    miss : (n,) float [rad], angle by which ``a`` is out of reach; q1, q2 then give the nearest direction.
    pole : (n,) float [rad], angle between the line of u and the direction reached; 0 where q1 is arbitrary.

    Examples
    --------
    From vertical to horizontal with u = z and v = x: a rotation by 90 degrees about x, then one about z.

    >>> z, x = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    >>> q1, q2, miss, pole = two_turns(z, x, z, np.array([[1.0, 0.0, 0.0]]))
    >>> np.degrees(q1).round(9).tolist(), np.degrees(q2).round(9).tolist(), float(pole[0].round(6))
    ([[-90.0, 90.0]], [[-90.0, 90.0]], 1.570796)
    """
    a, u, v, w = np.broadcast_arrays(a, u, v, w)
    chi, phi, psi = angle_between(a, u), angle_between(w, v), angle_between(u, v)
    low, high = np.abs(phi - psi), np.minimum(phi + psi, 2.0 * np.pi - phi - psi)
    miss = np.maximum(np.maximum(low - chi, chi - high), 0.0)
    chi = np.clip(chi, low, high)
    S = 0.5 * (chi + phi + psi)
    over = np.maximum(np.sin(S - psi) * np.sin(S - phi), 0.0)
    under = np.maximum(np.sin(S) * np.sin(S - chi), 0.0)
    E = 2.0 * np.arctan2(np.sqrt(over), np.sqrt(under))
    q2 = wrap_angles(azimuth(v, w, u)[:, None] + np.stack([-E, E], axis=1))
    c = rotate_about(v[:, None], q2, w[:, None])
    q1 = wrap_angles(azimuth(u[:, None], c, a[:, None]))
    pole = np.minimum(chi, np.pi - chi)
    q1[pole == 0.0] = 0.0
    return q1, q2, miss, pole
