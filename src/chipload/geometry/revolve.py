"""Surfaces of revolution about z: hub and shroud from their meridional curves.

Notation: meridional curve (r(s), z(s)) [mm], a cubic spline over s in 0..1 (chord length); theta [rad]. The point is
(r cos theta, r sin theta, z). K curvature tensor as in ``bspline.py``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipload.errors import InputError
from chipload.lazy import scipy

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Revolved:
    """A surface of revolution.

    Parameters
    ----------
    meridian : (n, 2) float [mm], r >= 0 and z, n >= 2, no two consecutive points equal
    side : 1: the normal lies to the left of the curve in the (r, z) plane, -1: to the right

    Raises
    ------
    InputError
        A radius is below 0, points coincide, or there are too few.
    """

    meridian: Floats
    side: int
    _curve: scipy.interpolate.BSpline = field(init=False, repr=False)

    def __post_init__(self) -> None:
        m = np.array(self.meridian, dtype=np.float64)
        if m.ndim != 2 or m.shape[1] != 2 or len(m) < 2 or not np.isfinite(m).all():
            raise InputError(f"meridian: shape {m.shape}: must be finite, (n, 2), at least 2 points")
        if (m[:, 0] < 0.0).any():
            raise InputError(f"meridian: radius {m[:, 0].min():g} mm: must be at least 0")
        chord = np.linalg.norm(np.diff(m, axis=0), axis=1)
        if (chord == 0.0).any():
            raise InputError(f"meridian: point {int((chord == 0.0).argmax()) + 1} appears twice: keep one")
        if self.side not in (1, -1):
            raise InputError(f"meridian.side = {self.side}: must be 1 or -1")
        s = np.concatenate([[0.0], np.cumsum(chord)])
        m.flags.writeable = False
        object.__setattr__(self, "meridian", m)
        object.__setattr__(self, "_curve", scipy.interpolate.make_interp_spline(s / s[-1], m, k=min(3, len(m) - 1)))

    @property
    def knots(self) -> Floats:
        """Parameters s (k,) between which the curve is a polynomial of at most third degree."""
        return np.unique(self._curve.t)

    def curve(self, s: ArrayLike, derivative: int = 0) -> Floats:
        """(k, 2) r and z [mm] at s (k,), or their derivative of the given order with respect to s."""
        out: Floats = self._curve(np.asarray(s, dtype=np.float64), nu=derivative)
        return out

    def at(self, s: ArrayLike, theta: ArrayLike) -> Floats:
        """Points (k, 3) [mm] at s and theta [rad] (k,)."""
        r, z = self.curve(s).T
        return np.stack([r * np.cos(theta), r * np.sin(theta), z], axis=-1)

    def normal(self, s: ArrayLike, theta: ArrayLike) -> Floats:
        """Unit normals (k, 3) at s and theta [rad] (k,)."""
        d = self.curve(s, 1)
        n = self.side * np.stack([-d[:, 1], d[:, 0]], axis=-1) / np.linalg.norm(d, axis=1)[:, None]
        return np.stack([n[:, 0] * np.cos(theta), n[:, 0] * np.sin(theta), n[:, 1]], axis=-1)

    def curvature(self, s: ArrayLike, theta: ArrayLike) -> Floats:
        """Curvature tensors K (k, 3, 3) [1/mm]: along the meridian the curvature of the curve, across it -n_r / r.

        Raises
        ------
        InputError
            A point is on the axis, r = 0.
        """
        p, d, e = self.curve(s), self.curve(s, 1), self.curve(s, 2)
        if (p[:, 0] <= 0.0).any():
            raise InputError("meridian: no curvature on the axis: exclude r = 0")
        speed = np.linalg.norm(d, axis=1)
        n = self.side * np.stack([-d[:, 1], d[:, 0]], axis=-1) / speed[:, None]
        along = (e * n).sum(axis=1) / speed**2
        around = -n[:, 0] / p[:, 0]
        t = d / speed[:, None]
        c, w = np.cos(theta), np.sin(theta)
        A = np.stack([t[:, 0] * c, t[:, 0] * w, t[:, 1]], axis=-1)
        B = np.stack([-w * np.ones(len(A)), c * np.ones(len(A)), np.zeros(len(A))], axis=-1)
        out: Floats = np.einsum("k,ki,kj->kij", along, A, A) + np.einsum("k,ki,kj->kij", around, B, B)
        return out

    def nearest(self, r: ArrayLike, z: ArrayLike, count: int = 2001) -> Floats:
        """Parameter s (k,) of the nearest of ``count`` points of the curve to each (r, z)."""
        s = np.linspace(0.0, 1.0, count)
        c = self.curve(s)
        given = np.stack(np.broadcast_arrays(np.asarray(r, float), np.asarray(z, float)), axis=-1).reshape(-1, 2)
        _, which = scipy.spatial.cKDTree(c).query(given)
        out: Floats = s[which]
        return out
